"""A power-split hybrid: engine, two machines and the wheels on one planetary gear, and a battery."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, Pedals, PowerSplit, PowerSplitControl
from powertrain.components.differentials import CrownGear, Epicyclic, PlanetaryGear
from powertrain.components.electric import ConditionedMachine, ElectricMachine, MachineCooling
from powertrain.components.engines import Engine, WillansEngine, operating_line
from powertrain.components.rotational import SpringDamper
from powertrain.vehicles.bus import known_machine, one_bus
from powertrain.vehicles.hybrid import HybridCar

ENGINE = WillansEngine(
    e=0.4, tau_0=15, tau_max=115, w_tau=420, P_max=55e3, w_P=520, tau_low=85, w_low=100, tau_starter=0, J=0.13
)
SHARE = 0.9
"""Share of the full-load torque on the engine's operating line."""


class PowerSplitHybrid(HybridCar):
    """A car of 1,450 kg with a planetary gear between the engine (carrier), machine 1 (sun) and machine 2 with the wheels (ring).

    The gear splits the engine's torque: 2.6/3.6 of it goes to the ring, 1/3.6 to machine 1, whose power drives machine 2
    or charges the battery. So machine 1 determines the engine's speed at every speed of the car. The engine is stopped at low power;
    machine 1 starts it. The rules are those of ``PowerSplitControl``; their data of the engine come from the engine in the slot.
    ``front`` and ``rear`` accept axles, see ``Car``.
    The layout is that of the Toyota Prius (2004): gear 78/30, final drive 3.93, a 1.3 kWh battery; all component data are invented.
    """

    driver: Pedals = Driver(k_a=1 / 4)
    control: PowerSplit = PowerSplitControl()
    engine: Engine = ENGINE
    damper: SpringDamper = SpringDamper(c=800, d=20)
    gear: Epicyclic = PlanetaryGear(ratio=2.6, eta_ab=0.98, eta_ba=0.98)
    machine_1: ElectricMachine = ElectricMachine(J=0.02, tau_max=70, P_max=42e3, w_max=1250, copper=0.1, iron=0.5)
    machine_1_cooling: MachineCooling = ConditionedMachine()
    machine_2: ElectricMachine = ElectricMachine(J=0.03, tau_max=450, P_max=55e3, w_max=700, copper=0.015, iron=0.8)
    machine_2_cooling: MachineCooling = ConditionedMachine()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=3.93, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1450, A=2.2, Cd=0.27)

    def equations(self) -> Equations:
        """The gear, the bus, and the connection to the road."""
        yield connect(self.engine.crank, self.damper.flange_a)
        yield connect(self.damper.flange_b, self.gear.carrier)
        yield connect(self.machine_1.shaft, self.gear.sun)
        yield connect(self.machine_2.shaft, self.gear.ring)
        yield from one_bus(
            self,
            self.battery,
            self.battery_cooling,
            self.accessories,
            (self.machine_1, self.machine_1_cooling),
            (self.machine_2, self.machine_2_cooling),
        )
        yield from self._to_the_road(self.gear.ring, self.control.friction)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._engine_by(self.control)
        yield connect(self.driver.accelerator, self.control.accelerator)
        yield connect(self.driver.brake, self.control.brake)
        yield connect(self.machine_2.speed, self.control.w_ring)
        yield connect(self.battery.charge_power, self.control.charge_power)
        yield connect(self.battery.discharge_power, self.control.battery_power)
        others = self.accessories.lossPower + self.machine_1.power + self.machine_1.lossPower
        yield from known_machine(self.control, self.machine_2, self.battery.discharge_power.value - others)
        line = operating_line(self.engine, SHARE)
        yield self.control.w_best.value == line(self.control.power.value)
        yield connect(self.control.tau_1, self.machine_1.torque_demand)
        yield connect(self.control.tau_2, self.machine_2.torque_demand)

    def check(self) -> Equations:
        """Machine 1 has a torque at the speed up to which the control turns it."""
        yield self.control.w_sun <= self.machine_1.w_max - self.machine_1.band

    def initial(self) -> Equations:
        """With the engine off: stopped, if machine 1 does not turn too fast then."""
        slowest, _ = self.control.speeds_of_carrier(self.machine_2.w)
        yield self.engine.w == ca.fmax(slowest, 0)
        yield self.damper.phi_rel == 0
        yield self.damper.w_rel == 0
