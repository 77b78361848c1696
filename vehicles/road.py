"""The way from a transmission to the road: transfer case, two axles and the body on them."""

from __future__ import annotations

from typing import Protocol

from powertrain import Equations, Input, ModelError, Output, connect
from powertrain.components.body import (
    Axle,
    Body,
    CentreDifferential,
    DrivenAxle,
    PoweredAxle,
    RoadProfile,
    TransferCase,
)
from powertrain.components.rotational import Flange


class OnAxles(Protocol):
    """The parts of a car behind its transmission.

    A ``PoweredAxle`` in ``front`` or ``rear`` is driven: ``LumpedAxle``, or ``DrivenAxle`` with its differential. ``RollingAxle`` is not.
    """

    transfer: TransferCase
    front: Axle
    rear: Axle
    body: Body
    road: RoadProfile
    curvature: Input


def to_the_road(car: OnAxles, shaft: Flange, demand: Output) -> Equations:
    """``shaft`` turns the driven axles, ``demand`` brakes both; they push the body, which loads them, on the slope of its road.

    The curvature is that of the rear axle's path; the steered front wheels run on larger circles.
    Errors: ModelError where no axle is driven, or a centre differential has one axle only.
    """
    _check(car)
    yield connect(shaft, car.transfer.input)
    if isinstance(car.front, PoweredAxle):
        yield connect(car.transfer.front, car.front.pinion)
    if isinstance(car.rear, PoweredAxle):
        yield connect(car.transfer.rear, car.rear.pinion)
    if isinstance(car.front, DrivenAxle):
        yield car.front.path.ahead == car.body.wheelbase
    yield connect(demand, car.front.brake, car.rear.brake)
    yield connect(car.curvature, car.front.curvature, car.rear.curvature)
    yield connect(car.front.axle, car.body.front)
    yield connect(car.rear.axle, car.body.rear)
    yield connect(car.body.front_load, car.front.load)
    yield connect(car.body.rear_load, car.rear.load)
    yield connect(car.body.s, car.road.s)
    yield connect(car.road.grade, car.body.grade)


def _check(car: OnAxles) -> None:
    slots = {"front": car.front, "rear": car.rear}
    driven = [name for name, axle in slots.items() if isinstance(axle, PoweredAxle)]
    if not driven:
        kinds = " and ".join(f"{name} = {type(axle).__name__}" for name, axle in slots.items())
        raise ModelError(f"{type(car).__name__} drives no axle: {kinds}; give one of them a LumpedAxle or a DrivenAxle")
    if isinstance(car.transfer, CentreDifferential) and len(driven) < len(slots):
        raise ModelError(
            f"{type(car).__name__}.transfer is a CentreDifferential, but only {driven[0]} is a driven axle: the other side would spin; "
            "give both axles a LumpedAxle or a DrivenAxle, or leave transfer as it is"
        )
