"""Trailers with their own brakes."""

from __future__ import annotations

from powertrain import Component, Equations, Input, connect, port, signal_input
from powertrain.components.body.axle import RollingAxle
from powertrain.components.body.body import VehicleBody
from powertrain.components.translational import Flange
from powertrain.components.wheels import RigidWheel, WheelBrake


class Trailer(Component):
    """A trailer on one axle, or on several lumped into one, with brakes; a vehicle pulls it at the hitch.

    m a = hitch.f + axle.axle.f - drag - m g sin(alpha),  tan(alpha) = grade
    axle.load = m g cos(alpha) (1 - front_share)

    ``body.front_share`` is the part of the weight on the hitch, ``body.wheelbase`` the distance from the hitch to the axle. With
    ``body.h`` = 0, the default, braking does not change the load of the axle. The weight on the hitch does not load the axles of the
    vehicle. ``body.Cd`` is that behind the vehicle. Set ``axle.brakes.tau_max`` to 0 for a trailer without brakes. The defaults are
    invented, for a luggage trailer of a car.
    """

    hitch: Flange = port(Flange)
    grade: Input = signal_input("1", "Slope of the road, tan(alpha), positive uphill", default=0.0)
    brake: Input = signal_input("1", "Brake demand, 0 to 1", default=0.0)
    body: VehicleBody = VehicleBody(m=1000, wheelbase=3.5, h=0, front_share=0.06, Cd=0.3, A=2.0)
    axle: RollingAxle = RollingAxle(brakes=WheelBrake(tau_max=2000), wheels=RigidWheel(J=1.5))

    def equations(self) -> Equations:
        """A body whose front is the hitch."""
        yield connect(self.hitch, self.body.front)
        yield connect(self.axle.axle, self.body.rear)
        yield connect(self.body.rear_load, self.axle.load)
        yield connect(self.grade, self.body.grade)
        yield connect(self.brake, self.axle.brake)
