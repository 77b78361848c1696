"""A battery-electric car with one machine and one or more gears."""

from __future__ import annotations

from powertrain import Equations, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import (
    Driver,
    ElectricDriveControl,
    FixedGear,
    Pedals,
    PowerShiftSchedule,
    Shifting,
)
from powertrain.components.differentials import ChurningLoss, CrownGear
from powertrain.components.electric import (
    AccessoryLoad,
    BatteryCooling,
    ConditionedBattery,
    ConditionedMachine,
    ElectricMachine,
    MachineCooling,
    PolarizedBattery,
    cells_in_series,
)
from powertrain.components.rotational import IdealGear
from powertrain.components.transmissions import PowerShiftGearbox, Shiftable, SingleGear
from powertrain.vehicles.bus import known_machine, one_bus
from powertrain.vehicles.car import ShiftedCar

BATTERY = PolarizedBattery(
    ocv=cells_in_series(96),
    Q=150 * 3600,
    R=0.06,
    i_discharge=600,
    i_charge=400,
    overvoltage=4.2 / 4.15,
    soc_min=0.03,
    soc_max=0.98,
    band=0.02,
    B=2000,
)
"""96 cells of 150 A.h in series: 54 kW.h."""


OIL = ChurningLoss(d=8e-4)
"""Drag of bearings and oil at the machine's shaft."""


class ElectricCar(ShiftedCar):
    """A front-wheel-drive car of 1,700 kg with a 150 kW machine, a fixed reduction gear and a 54 kW.h battery.

    The control blends regenerative and friction braking. ``gearbox`` accepts one gear, or that of ``ElectricCar.two_speed()``: two gears,
    shifted under load by a ``PowerShiftSchedule``. ``CycleRun`` gives W.h/km, range and miles per gallon of gasoline equivalent.
    ``front`` and ``rear`` accept axles, see ``Car``. The numbers are invented, for a compact car.
    """

    driver: Pedals = Driver(k_a=1700 / 7500)
    control: ElectricDriveControl = ElectricDriveControl()
    schedule: Shifting = FixedGear()
    battery: PolarizedBattery = BATTERY
    battery_cooling: BatteryCooling = ConditionedBattery()
    accessories: AccessoryLoad = AccessoryLoad(P=300)
    machine: ElectricMachine = ElectricMachine(
        J=0.04, tau_max=310, P_max=150e3, w_max=1680, P_0=80, copper=0.045, iron=1.0, windage=4e-4
    )
    machine_cooling: MachineCooling = ConditionedMachine()
    gearbox: Shiftable = SingleGear(gear=IdealGear(ratio=2.5), churning=OIL)
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=3.6, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1700, A=2.3, Cd=0.25)

    @classmethod
    def two_speed(cls) -> ElectricCar:
        """The same car with two gears, the second from 17 m/s, and a smaller machine."""
        return cls(
            gearbox=PowerShiftGearbox(ratios=(3.4, 1.9), churning=OIL),
            schedule=PowerShiftSchedule(speeds=((17.0, 13.0),), eager=0.6),
            machine=ElectricMachine(
                J=0.03, tau_max=230, P_max=120e3, w_max=1680, P_0=70, copper=0.06, iron=0.8, windage=3e-4
            ),
        )

    def equations(self) -> Equations:
        """The bus, and the connection to the road."""
        yield from one_bus(
            self, self.battery, self.battery_cooling, self.accessories, (self.machine, self.machine_cooling)
        )
        yield connect(self.machine.shaft, self.gearbox.flange_a)
        yield from self._to_the_road(self.gearbox.flange_b, self.control.friction)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield from self._on_the_cycle()
        yield from self._shifted()
        yield connect(self.body.v, self.control.v)
        yield connect(self.schedule.throttle, self.control.accelerator)
        yield connect(self.driver.brake, self.control.brake)
        yield connect(self.machine.speed, self.control.w)
        yield connect(self.battery.charge_power, self.control.charge_power)
        left = self.battery.discharge_power.value - self.accessories.lossPower
        yield from known_machine(self.control, self.machine, left)
        yield connect(self.control.tau, self.machine.torque_demand)

    @property
    def mover(self) -> ElectricMachine:
        """The machine."""
        return self.machine
