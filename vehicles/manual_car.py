"""A front-driven car with a manual gearbox."""

from __future__ import annotations

from powertrain import Component, Equations, connect
from powertrain.components.body import Body, RoadProfile, VehicleBody
from powertrain.components.control import AlwaysOn, Driver, EngineSwitch, GearSchedule, Pedals, Shifting
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.differentials import CrownGear
from powertrain.components.engines import AccessoryDrive, Engine, WillansEngine
from powertrain.components.rotational import Clutch, TwoFlanges
from powertrain.components.transmissions import ManualGearbox, Shiftable
from powertrain.components.wheels import RigidWheel, Wheel, WheelBrake
from powertrain.vehicles.lumped_axles import to_the_road


class ManualCar(Component):
    """A front-driven car of 1,300 kg: engine, clutch, gearbox of six gears, final drive, wheels.

    The driver follows ``cycle``; the schedule shifts by the vehicle's speed, with a real clutch and real synchronisers. ``start_stop``
    says whether the engine runs: ``AlwaysOn()``, or ``StartStop()``, which stops it at rest. The loss of the gearbox counts in the final
    drive. The numbers are made up for a compact car with an engine of 1.6 l.
    It drives straight, where a differential turns as one block whatever its kind: the two wheels of an axle are one here, and
    ``RearDriveCar`` and ``FourWheelDriveCar`` have the slots for a differential.
    """

    cycle: CycleSpeed = CycleSpeed(cycle=DriveCycle.named("wltc"))
    driver: Pedals = Driver(k_a=1300 / 6000)
    schedule: Shifting = GearSchedule()
    start_stop: EngineSwitch = AlwaysOn()
    engine: Engine = WillansEngine()
    accessories: AccessoryDrive = AccessoryDrive()
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    gearbox: Shiftable = ManualGearbox()
    final_drive: TwoFlanges = CrownGear(ratio=4.1, eta_ab=0.95, eta_ba=0.95)
    front_brake: WheelBrake = WheelBrake(tau_max=3000)
    rear_brake: WheelBrake = WheelBrake(tau_max=1500)
    front: Wheel = RigidWheel(J=2.0)
    rear: Wheel = RigidWheel(J=2.0)
    body: Body = VehicleBody(m=1300, A=2.1)
    road: RoadProfile = RoadProfile()

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.gearbox.flange_a)
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
        yield connect(self.schedule.clutch, self.clutch.f_normalized)
        yield connect(self.schedule.lever, self.gearbox.lever)
        yield connect(self.start_stop.on, self.engine.on)

    def initial(self) -> Equations:
        """At rest, with the engine idling and the first gear in."""
        yield self.engine.w == self.engine.w_idle
