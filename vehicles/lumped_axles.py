"""The way from a driven axle to the road, where the two wheels of an axle are one.

On a straight road with equal ground the two wheels turn alike. A differential between them turns as one block then: its members do not
move against each other, whatever its kind, so that it loses nothing and changes no consumption. How it shares the torque between two wheels
that cannot slip is not even determined: friction at rest holds any share within its bounds. So the cars that drive cycles have no
differential; a wheel of theirs stands for two, with the inertia of both. For what differentials differ in, bends and unequal ground, there
are the vehicles with half shafts that twist and tyres that slip, which determine the share.
"""

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
