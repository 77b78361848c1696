"""A car with two driven axles and a centre differential that can be exchanged."""

from __future__ import annotations

from powertrain import Component, Equations, Input, connect, der, signal_input
from powertrain.components.body import DrivenAxle, VehicleBody
from powertrain.components.differentials import BevelDifferential, Differential
from powertrain.components.engines import Engine, WillansEngine
from powertrain.components.rotational import Clutch, IdealGear, Inertia, SpringDamper, TwoFlanges
from powertrain.components.wheels import WheelBrake


class FourWheelDriveCar(Component):
    """A two-axle 4x4 of 1,700 kg: engine, clutch, one gear, centre differential, and two driven axles with a differential each.

    ``centre`` takes any ``Differential``: its left side drives the front axle, its right side the rear axle. Each wheel has its own
    ground: ``front_axle.left.mu`` and so on. The curvature is that of the rear axle's path; the steered front wheels run on larger
    circles, so that the centre differential works in every bend.
    The parts stand from the road up to the engine: at the start the road turns the wheels, and they turn the rest.
    """

    throttle: Input = signal_input("1", "Throttle, 0 to 1", default=0.0)
    brake: Input = signal_input("1", "Brake pedal, 0 to 1", default=0.0)
    engaged: Input = signal_input("1", "Clutch, 0 open to 1 closed", default=1.0)
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)
    grade: Input = signal_input("1", "Slope of the road, tan(alpha), positive uphill", default=0.0)
    wind: Input = signal_input("m/s", "Speed of the wind along the road, positive with the car", default=0.0)

    body: VehicleBody = VehicleBody(m=1700, front_share=0.52, h=0.65, A=2.6, Cd=0.35)
    front_axle: DrivenAxle = DrivenAxle()
    rear_axle: DrivenAxle = DrivenAxle(left_brake=WheelBrake(tau_max=1000), right_brake=WheelBrake(tau_max=1000))
    front_shaft: SpringDamper = SpringDamper(c=1e4, d=10)
    rear_shaft: SpringDamper = SpringDamper(c=1e4, d=10)
    centre: Differential = BevelDifferential(eta=0.97)
    gearbox: TwoFlanges = IdealGear(ratio=3.5)
    shaft: Inertia = Inertia(J=0.02)
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    engine: Engine = WillansEngine()

    def equations(self) -> Equations:
        """From the engine to both axles."""
        yield connect(self.engine.crank, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.gearbox.flange_a)
        yield connect(self.gearbox.flange_b, self.centre.crown)
        yield connect(self.centre.left, self.front_shaft.flange_a)
        yield connect(self.centre.right, self.rear_shaft.flange_a)
        yield connect(self.front_shaft.flange_b, self.front_axle.pinion)
        yield connect(self.rear_shaft.flange_b, self.rear_axle.pinion)
        yield connect(self.front_axle.axle, self.body.front)
        yield connect(self.rear_axle.axle, self.body.rear)
        yield connect(self.body.front_load, self.front_axle.load)
        yield connect(self.body.rear_load, self.rear_axle.load)
        yield connect(self.throttle, self.engine.throttle)
        yield connect(self.engaged, self.clutch.f_normalized)
        yield connect(self.brake, self.front_axle.brake, self.rear_axle.brake)
        yield connect(self.curvature, self.front_axle.curvature, self.rear_axle.curvature)
        yield self.front_axle.path.ahead == self.body.wheelbase
        yield connect(self.grade, self.body.grade)
        yield connect(self.wind, self.body.wind)

    def initial(self) -> Equations:
        """The gearbox turns with the axles, and the shafts to them are not twisted."""
        front, rear = self.front_axle.pinion.phi, self.rear_axle.pinion.phi
        yield der(self.centre.crown.phi) == der(front + rear) / 2
        yield self.front_shaft.phi_rel == 0
        yield self.rear_shaft.phi_rel == 0
