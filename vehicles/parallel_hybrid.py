"""Parallel hybrids P0 to P4: an engine, a gearbox, and a machine at one of five positions."""

from __future__ import annotations

from typing import Any, Literal, Self

from powertrain import Equations, Symbol, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import (
    Driver,
    ParallelControl,
    Pedals,
    PowerShiftSchedule,
    Shifting,
    SpeedSchedule,
)
from powertrain.components.control.shift_rule import KickLimits
from powertrain.components.differentials import CrownGear
from powertrain.components.electric import (
    ConditionedMachine,
    ElectricMachine,
    MachineCooling,
    PolarizedBattery,
    cells_in_series,
)
from powertrain.components.engines import Engine, WillansEngine
from powertrain.components.limited import limited
from powertrain.components.rotational import Clutch, IdealGear
from powertrain.components.transmissions import PowerShiftGearbox, Shiftable
from powertrain.components.wheels import WheelBrake
from powertrain.language.makers import arguments_checked
from powertrain.vehicles.bus import known_machine, one_bus
from powertrain.vehicles.car import ShiftedCar
from powertrain.vehicles.hybrid import HybridCar

Position = Literal["P0", "P1", "P2", "P3", "P4"]
"""At the engine's belt, at its crankshaft, at the gearbox input, at the gearbox output, at the other axle."""
RATIOS = {"P0": 2.7, "P1": 1.0, "P2": 1.0, "P3": 2.2, "P4": 1.0}
"""Speed of the machine over that of its shaft; on its own axle the final drive reduces it."""
SMALL = ElectricMachine(J=0.005, tau_max=55, P_max=12e3, w_max=1900, P_0=40, copper=0.5, iron=0.4, windage=2e-4)
LARGE = ElectricMachine(J=0.03, tau_max=220, P_max=60e3, w_max=1500, P_0=70, copper=0.06, iron=0.8, windage=3e-4)
CRANK = ElectricMachine(J=0.04, tau_max=160, P_max=20e3, w_max=800, P_0=50, copper=0.08, iron=0.8, windage=3e-4)
MACHINES = {"P0": SMALL, "P1": CRANK, "P2": LARGE, "P3": LARGE, "P4": LARGE}
ALWAYS = -1e9
"""Power demand that is always exceeded, so the engine runs."""
PLUG_IN = PolarizedBattery(
    ocv=cells_in_series(96),
    Q=37 * 3600,
    R=0.12,
    i_discharge=300,
    i_charge=150,
    overvoltage=4.2 / 4.15,
    soc_min=0.1,
    soc_max=0.98,
    band=0.03,
    B=2000,
)
"""96 cells of 37 A.h in series: 13 kW.h."""


class ParallelHybrid(ShiftedCar, HybridCar):
    """A car of 1,500 kg whose engine drives through a clutch and a gearbox, with a machine at one of five positions.

    ``position``: P0 at the crankshaft through a belt, P1 at the crankshaft, P2 at the gearbox input, P3 at its output, P4 at the rear axle.
    ``coupling`` is the gear between the machine and that shaft. With P2 to P4 the car drives and recovers with the engine stopped and its
    clutch open. A machine at the crankshaft is coupled to the wheels only while the clutch is closed, and its engine runs.
    ``ParallelHybrid.at("P4")`` makes the car with a machine that suits the position; ``ParallelHybrid.plug_in()`` has a 13 kWh battery,
    which it discharges first. The rules are those of ``ParallelControl``. ``front`` and ``rear`` accept axles, see ``Car``. The numbers
    are invented, for a compact car.
    """

    position: Position = "P2"
    driver: Pedals = Driver(k_a=1500 / 6000)
    schedule: Shifting = PowerShiftSchedule()
    control: ParallelControl = ParallelControl(v_on=36.0, v_off=33.0)
    engine: Engine = WillansEngine()
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    gearbox: Shiftable = PowerShiftGearbox(ratios=(3.8, 2.3, 1.5, 1.1, 0.87, 0.7))
    coupling: IdealGear = IdealGear(ratio=RATIOS["P2"])
    machine: ElectricMachine = MACHINES["P2"]
    machine_cooling: MachineCooling = ConditionedMachine()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=4.1, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1500, A=2.2)

    @classmethod
    @arguments_checked
    def at(cls, position: Position, **parts: Any) -> Self:
        """The car with a machine and a coupling that suit the position. Errors: ParameterError for another position."""
        made: dict[str, Any] = {
            "position": position,
            "coupling": IdealGear(ratio=RATIOS[position]),
            "machine": MACHINES[position],
        }
        if position in ("P0", "P1"):
            made["control"] = ParallelControl(P_on=ALWAYS / 2, P_off=ALWAYS, P_min=0, k_soc=30e3, F_most=1500)
        if position == "P4":
            made["rear"] = LumpedAxle(
                final_drive=CrownGear(ratio=9.0, eta_ab=0.97, eta_ba=0.97), brakes=WheelBrake(tau_max=1500)
            )
        return cls(**(made | parts))

    @classmethod
    def plug_in(cls, **parts: Any) -> Self:
        """The P2 hybrid with a 13 kWh battery, whose charge it sustains at 20 %: start it with ``{"battery.soc": 0.95}``."""
        control = ParallelControl(v_on=36.0, v_off=33.0, soc_0=0.2, k_soc=150e3)
        return cls(**({"battery": PLUG_IN, "control": control} | parts))

    @property
    def mover(self) -> Engine:
        """The engine."""
        return self.engine

    def kick_limits(self, schedule: SpeedSchedule, gear: Symbol) -> KickLimits:
        """Upper limits only: the engine may stand while the machine drives."""
        return super().kick_limits(schedule, gear)._replace(earliest=Symbol(0.0), down=Symbol(0.0))

    def equations(self) -> Equations:
        """Engine to road, and the machine at its position."""
        yield connect(self.engine.crank, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.gearbox.flange_a)
        yield connect(self.machine.shaft, self.coupling.flange_a)
        places = {
            "P0": self.engine.crank,
            "P1": self.engine.crank,
            "P2": self.gearbox.flange_a,
            "P3": self.gearbox.flange_b,
        }
        own = self.coupling.flange_b if self.position == "P4" else None
        if own is None:
            yield connect(self.coupling.flange_b, places[self.position])
        yield from one_bus(
            self, self.battery, self.battery_cooling, self.accessories, (self.machine, self.machine_cooling)
        )
        yield from self._to_the_road(self.gearbox.flange_b, self.control.friction, own)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._engine_by(self.control)
        yield from self._shifted()
        yield connect(self.schedule.throttle, self.control.accelerator)
        yield connect(self.driver.brake, self.control.brake)
        yield self.clutch.f_normalized.value == self._closed()
        at_the_crank = self.position in ("P0", "P1")
        yield self.control.coupled.value == (self._closed() if at_the_crank else 1.0)
        yield self.control.w_shaft.value == self.engine.w + (0.0 if at_the_crank else self.clutch.w_rel)
        yield self.control.slip.value == self.clutch.w_rel
        yield connect(self.machine.speed, self.control.w_machine)
        yield connect(self.battery.charge_power, self.control.charge_power)
        yield connect(self.battery.discharge_power, self.control.battery_power)
        left = self.battery.discharge_power.value - self.accessories.lossPower
        yield from known_machine(self.control, self.machine, left)
        yield connect(self.control.tau, self.machine.torque_demand)

    def _closed(self) -> Symbol:
        """The clutch follows the schedule once the engine is as fast as the gearbox."""
        return self.control.matched * limited(self.schedule.clutch.value)
