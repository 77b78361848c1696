"""A front-driven car with an automatic gearbox."""

from __future__ import annotations

from powertrain import Component, Equations, Input, connect, signal_input
from powertrain.components.body import (
    Axle,
    Body,
    LumpedAxle,
    RigidTransferCase,
    RoadProfile,
    RollingAxle,
    TransferCase,
    VehicleBody,
)
from powertrain.components.control import AlwaysOn, Driver, EngineSwitch, Pedals, PowerShiftSchedule, Shifting
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.differentials import CrownGear
from powertrain.components.engines import AccessoryDrive, Engine, WillansEngine
from powertrain.components.transmissions import PowerShiftGearbox, Shiftable, StartingConverter, StartingDevice
from powertrain.vehicles.driving import by_schedule
from powertrain.vehicles.road import to_the_road

SPEEDS = ((4.0, 2.5), (7.0, 4.5), (9.5, 6.5), (12.0, 9.0), (15.0, 11.5), (18.0, 14.0), (22.0, 17.0))
"""Shifts of an eight-speed gearbox in m/s, with the accelerator released."""


class AutomaticCar(Component):
    """A front-driven car of 1,500 kg: engine, torque converter, gearbox of eight gears that shifts under load, final drive, wheels.

    The driver follows ``cycle``; the schedule shifts by the vehicle's speed and the accelerator. ``start`` takes a ``StartingClutch``
    instead of the converter: with a dual-clutch gearbox's ratios that is a dual-clutch car. ``start_stop`` says whether the engine runs.
    The numbers are made up for a compact car with an engine of 1.6 l.
    ``front`` and ``rear`` take axles, see ``to_the_road``.
    """

    cycle: CycleSpeed = CycleSpeed(cycle=DriveCycle.named("wltc"))
    driver: Pedals = Driver(k_a=1500 / 6000, hold=0.3)
    schedule: Shifting = PowerShiftSchedule(speeds=SPEEDS)
    start_stop: EngineSwitch = AlwaysOn()
    engine: Engine = WillansEngine()
    accessories: AccessoryDrive = AccessoryDrive()
    start: StartingDevice = StartingConverter()
    gearbox: Shiftable = PowerShiftGearbox()
    transfer: TransferCase = RigidTransferCase()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=3.2, eta_ab=0.97, eta_ba=0.97))
    rear: Axle = RollingAxle()
    body: Body = VehicleBody(m=1500, A=2.2)
    road: RoadProfile = RoadProfile()
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.start.flange_a)
        yield connect(self.start.flange_b, self.gearbox.flange_a)
        yield from to_the_road(self, self.gearbox.flange_b, self.driver.brake)
        yield from by_schedule(self, self.start.pressed)

    def initial(self) -> Equations:
        """At rest, with the engine idling and the first gear in."""
        yield self.engine.w == self.engine.w_idle
