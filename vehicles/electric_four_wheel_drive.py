"""A battery-electric car with a machine at each axle."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, connect, parameter
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, ElectricDriveControl, Pedals
from powertrain.components.differentials import CrownGear
from powertrain.components.electric import (
    AccessoryLoad,
    BatteryCooling,
    ConditionedBattery,
    ConditionedMachine,
    ElectricMachine,
    MachineCooling,
    PolarizedBattery,
)
from powertrain.components.wheels import WheelBrake
from powertrain.vehicles.bus import one_bus
from powertrain.vehicles.car import Car
from powertrain.vehicles.electric_car import BATTERY


class ElectricFourWheelDriveCar(Car):
    """A battery-electric car of 2,000 kg with a 90 kW machine at the front axle and a 150 kW machine at the rear axle.

    front torque = (1 - share) tau,  rear torque = share tau,  |tau| at most min(front limit/(1 - share), rear limit/share)

    The control treats both machines as one with the torque tau and the speed (1 - share) w_front + share w_rear, which has their total
    power, so the final drives may differ. Both recover. ``front`` and ``rear`` accept axles, see ``Car``. The numbers are invented, for a
    mid-size car.
    """

    share: Parameter = parameter(
        "1", "Share of the rear machine in the torque of both machines", default=0.6, above=0, max=0.99
    )
    driver: Pedals = Driver(k_a=2000 / 9000)
    control: ElectricDriveControl = ElectricDriveControl(F_most=7000)
    battery: PolarizedBattery = BATTERY
    battery_cooling: BatteryCooling = ConditionedBattery()
    accessories: AccessoryLoad = AccessoryLoad(P=300)
    front_machine: ElectricMachine = ElectricMachine(
        J=0.03, tau_max=180, P_max=90e3, w_max=1500, P_0=60, copper=0.06, iron=0.7, windage=3e-4
    )
    front_machine_cooling: MachineCooling = ConditionedMachine()
    rear_machine: ElectricMachine = ElectricMachine(
        J=0.04, tau_max=310, P_max=150e3, w_max=1680, P_0=80, copper=0.045, iron=1.0, windage=4e-4
    )
    rear_machine_cooling: MachineCooling = ConditionedMachine()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=9.0, eta_ab=0.97, eta_ba=0.97))
    rear: Axle = LumpedAxle(final_drive=CrownGear(ratio=9.0, eta_ab=0.97, eta_ba=0.97), brakes=WheelBrake(tau_max=1500))
    body: Body = VehicleBody(m=2000, A=2.35, Cd=0.25)

    def equations(self) -> Equations:
        """The bus, and each machine at its axle."""
        yield from one_bus(
            self,
            self.battery,
            self.battery_cooling,
            self.accessories,
            (self.front_machine, self.front_machine_cooling),
            (self.rear_machine, self.rear_machine_cooling),
        )
        yield from self._to_the_road(self.front_machine.shaft, self.control.friction, self.rear_machine.shaft)
        yield from self._signals()

    def _signals(self) -> Equations:
        front, rear, share = self.front_machine, self.rear_machine, self.share
        yield from self._on_the_cycle()
        yield connect(self.body.v, self.control.v)
        yield connect(self.driver.accelerator, self.control.accelerator)
        yield connect(self.driver.brake, self.control.brake)
        yield self.control.w.value == (1 - share) * front.w + share * rear.w
        yield connect(self.battery.charge_power, self.control.charge_power)
        ahead, behind = (machine.full_load(machine.w, machine.bus.v, machine.heat_port.T) for machine in (front, rear))
        most = ca.fmin(ahead / (1 - share), behind / share)
        idle = front.loss_at(Symbol(0.0)) + rear.loss_at(Symbol(0.0))
        yield self.control.limit.value == most
        yield self.control.added_loss.value == front.loss_at((1 - share) * most) + rear.loss_at(share * most) - idle
        left = self.battery.discharge_power.value - self.accessories.lossPower
        yield self.control.discharge_power.value == left - idle
        yield front.torque_demand.value == (1 - share) * self.control.tau.value
        yield rear.torque_demand.value == share * self.control.tau.value
