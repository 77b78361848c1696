"""A rolling road: the wheels of a vehicle stand on rollers with a given speed."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, Parameter, Variable, der, parameter, variable
from powertrain.components.body.body import Body


class RollingRoad(Body):
    """Replaces a body: the road moves under the axles at a given speed and absorbs their tractive force.

    der(front.s) = der(rear.s) = speed,  force = front.f + rear.f
    front_load = m g front_share, and the rest on the rear axle

    Mass, drag and slope are not included; subtract them from ``force`` to predict a vehicle's motion.
    """

    boundary: ClassVar[bool] = True
    speed: Parameter = parameter("m/s", "Speed of the rollers", default=0.0)
    force: Variable = variable("N", "Tractive force of all wheels")

    def equations(self) -> Equations:
        """Rollers."""
        yield self.rear.s == self.front.s
        yield der(self.front.s) == self.speed
        yield self.force == self.front.f + self.rear.f
        yield self.v.value == self.speed
        yield self.s.value == self.front.s
        weight = self.m * self.g
        yield self.front_load.value == weight * self.front_share
        yield self.rear_load.value == weight * (1 - self.front_share)
