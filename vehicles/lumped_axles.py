"""The way from a driven axle to the road, where the two wheels of an axle are one, since they turn alike on a straight road."""

from __future__ import annotations

from typing import Protocol

from powertrain import Equations, connect
from powertrain.components.body import Body, RoadProfile
from powertrain.components.rotational import Flange
from powertrain.components.wheels import Wheel, WheelBrake


class LumpedAxles(Protocol):
    """The parts of a front-driven car behind its final drive."""

    front_brake: WheelBrake
    rear_brake: WheelBrake
    front: Wheel
    rear: Wheel
    body: Body
    road: RoadProfile


def to_the_road(car: LumpedAxles, drive: Flange) -> Equations:
    """``drive`` turns the front wheels; both axles push the body, which loads them, on the slope of its road."""
    yield connect(drive, car.front_brake.flange_a)
    yield connect(car.front_brake.flange_b, car.front.hub)
    yield connect(car.rear_brake.flange_b, car.rear.hub)
    yield connect(car.front.road, car.body.front)
    yield connect(car.rear.road, car.body.rear)
    yield connect(car.body.front_load, car.front.load)
    yield connect(car.body.rear_load, car.rear.load)
    yield connect(car.body.s, car.road.s)
    yield connect(car.road.grade, car.body.grade)
