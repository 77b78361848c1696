"""A series hybrid: an engine with a generator, a battery, and a drive machine."""

from __future__ import annotations

from powertrain import Equations, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, ElectricDriveControl, GensetControl, Pedals
from powertrain.components.differentials import CrownGear
from powertrain.components.electric import ConditionedMachine, ElectricMachine, MachineCooling
from powertrain.components.engines import Engine, WillansEngine, operating_line
from powertrain.components.rotational import IdealGear, SpringDamper
from powertrain.components.transmissions import Shiftable, SingleGear
from powertrain.vehicles.bus import known_machine, one_bus
from powertrain.vehicles.electric_car import OIL
from powertrain.vehicles.hybrid import HybridCar

SHARE = 0.9
"""Share of the full-load torque on the engine's operating line."""


class SeriesHybrid(HybridCar):
    """A car of 1,550 kg driven by a machine alone; an engine with a generator supplies the mean power, a battery the rest.

    The engine runs on its line of lowest fuel consumption, independently of vehicle speed, and is stopped at low power. The rules are those
    of ``GensetControl`` for engine and generator, and of ``ElectricDriveControl`` for the machine, with blended regenerative braking.
    ``front`` and ``rear`` accept axles, see ``Car``. The numbers are invented, for a compact car.
    """

    driver: Pedals = Driver(k_a=1550 / 6500)
    control: ElectricDriveControl = ElectricDriveControl()
    genset: GensetControl = GensetControl(P_most=55e3, v_on=30.0, v_off=27.0)
    engine: Engine = WillansEngine(tau_starter=0)
    damper: SpringDamper = SpringDamper(c=800, d=20)
    generator: ElectricMachine = ElectricMachine(J=0.02, tau_max=180, P_max=65e3, w_max=800, copper=0.05, iron=0.6)
    generator_cooling: MachineCooling = ConditionedMachine()
    machine: ElectricMachine = ElectricMachine(
        J=0.03, tau_max=280, P_max=100e3, w_max=1500, P_0=70, copper=0.05, iron=0.8, windage=3e-4
    )
    machine_cooling: MachineCooling = ConditionedMachine()
    gearbox: Shiftable = SingleGear(gear=IdealGear(ratio=2.3), churning=OIL)
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=3.6, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1550, A=2.2, Cd=0.28)

    def equations(self) -> Equations:
        """Engine to generator, the bus, machine to road."""
        yield connect(self.engine.crank, self.damper.flange_a)
        yield connect(self.damper.flange_b, self.generator.shaft)
        yield from one_bus(
            self,
            self.battery,
            self.battery_cooling,
            self.accessories,
            (self.generator, self.generator_cooling),
            (self.machine, self.machine_cooling),
        )
        yield connect(self.machine.shaft, self.gearbox.flange_a)
        yield from self._to_the_road(self.gearbox.flange_b, self.control.friction)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._engine_by(self.genset)
        line = operating_line(self.engine, SHARE)
        yield self.genset.w_best.value == line(self.genset.power.value)
        yield self.genset.load.value == self.machine.power
        yield self.genset.asked.value == self.control.asked()
        yield connect(self.genset.tau, self.generator.torque_demand)
        yield connect(self.body.v, self.control.v)
        yield connect(self.driver.accelerator, self.control.accelerator)
        yield connect(self.driver.brake, self.control.brake)
        yield connect(self.machine.speed, self.control.w)
        yield self.gearbox.lever.value == 1
        others = self.accessories.lossPower + self.generator.power + self.generator.lossPower
        yield connect(self.battery.charge_power, self.genset.charge_power)
        yield connect(self.battery.discharge_power, self.genset.battery_power)
        yield self.control.charge_power.value == self.battery.charge_power.value + others
        yield from known_machine(self.control, self.machine, self.battery.discharge_power.value - others)
        yield connect(self.control.tau, self.machine.torque_demand)

    def initial(self) -> Equations:
        """At rest, with the engine stopped."""
        yield self.engine.w == 0
        yield self.damper.phi_rel == 0
        yield self.damper.w_rel == 0
