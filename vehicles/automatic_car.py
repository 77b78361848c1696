"""A front-driven car with an automatic gearbox."""

from __future__ import annotations

from powertrain import Component, Equations, connect
from powertrain.components.body import Body, RoadProfile, VehicleBody
from powertrain.components.control import AlwaysOn, Driver, EngineSwitch, Pedals, PowerShiftSchedule, Shifting
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.differentials import CrownGear
from powertrain.components.engines import AccessoryDrive, Engine, WillansEngine
from powertrain.components.rotational import TwoFlanges
from powertrain.components.transmissions import PowerShiftGearbox, Shiftable, StartingConverter, StartingDevice
from powertrain.components.wheels import RigidWheel, Wheel, WheelBrake
from powertrain.vehicles.lumped_axles import to_the_road

SPEEDS = ((4.0, 2.5), (7.0, 4.5), (9.5, 6.5), (12.0, 9.0), (15.0, 11.5), (18.0, 14.0), (22.0, 17.0))
"""Shifts of an eight-speed gearbox in m/s, with the accelerator released."""


class AutomaticCar(Component):
    """A front-driven car of 1,500 kg: engine, torque converter, gearbox of eight gears that shifts under load, final drive, wheels.

    The driver follows ``cycle``; the schedule shifts by the vehicle's speed and the accelerator. ``start`` takes a ``StartingClutch``
    instead of the converter: with a dual-clutch gearbox's ratios that is a dual-clutch car. ``start_stop`` says whether the engine runs.
    The numbers are made up for a compact car with an engine of 1.6 l.
    It drives straight, where a differential turns as one block whatever its kind: the two wheels of an axle are one here, and
    ``RearDriveCar`` and ``FourWheelDriveCar`` have the slots for a differential.
    """

    cycle: CycleSpeed = CycleSpeed(cycle=DriveCycle.named("wltc"))
    driver: Pedals = Driver(k_a=1500 / 6000, hold=0.3)
    schedule: Shifting = PowerShiftSchedule(speeds=SPEEDS)
    start_stop: EngineSwitch = AlwaysOn()
    engine: Engine = WillansEngine()
    accessories: AccessoryDrive = AccessoryDrive()
    start: StartingDevice = StartingConverter()
    gearbox: Shiftable = PowerShiftGearbox()
    final_drive: TwoFlanges = CrownGear(ratio=3.2, eta_ab=0.97, eta_ba=0.97)
    front_brake: WheelBrake = WheelBrake(tau_max=3000)
    rear_brake: WheelBrake = WheelBrake(tau_max=1500)
    front: Wheel = RigidWheel(J=2.0)
    rear: Wheel = RigidWheel(J=2.0)
    body: Body = VehicleBody(m=1500, A=2.2)
    road: RoadProfile = RoadProfile()

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.start.flange_a)
        yield connect(self.start.flange_b, self.gearbox.flange_a)
        yield connect(self.gearbox.flange_b, self.final_drive.flange_a)
        yield from to_the_road(self, self.final_drive.flange_b)
        yield from self._signals()

    def _signals(self) -> Equations:
        yield connect(self.cycle.v_ref, self.driver.v_ref)
        yield connect(self.cycle.a_ref, self.driver.a_ref)
        yield connect(self.body.v, self.driver.v, self.schedule.v, self.start_stop.v)
        yield connect(self.driver.brake, self.front_brake.demand, self.rear_brake.demand)
        yield connect(self.driver.accelerator, self.schedule.accelerator, self.start_stop.accelerator)
        yield connect(self.engine.speed, self.schedule.w)
        yield connect(self.schedule.throttle, self.engine.throttle)
        yield connect(self.schedule.clutch, self.start.pressed)
        yield connect(self.schedule.lever, self.gearbox.lever)
        yield connect(self.start_stop.on, self.engine.on)

    def initial(self) -> Equations:
        """At rest, with the engine idling and the first gear in."""
        yield self.engine.w == self.engine.w_idle
