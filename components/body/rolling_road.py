"""A rolling road: the wheels of a vehicle stand on rollers whose speed is given."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, Parameter, Variable, der, parameter, variable
from powertrain.components.body.body import Body


class RollingRoad(Body):
    """In the place of a body: the road moves with a given speed under the axles and takes what force they push with.

    der(front.s) = der(rear.s) = speed,  force = front.f + rear.f
    front_load = m g front_share, and the rest on the rear axle

    Mass, drag and slope of a body are not there; add them to ``force`` for what a vehicle would do.
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
