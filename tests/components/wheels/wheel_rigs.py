"""Rigs for wheels: one on a drum with both speeds given, and a body on two axles."""

from __future__ import annotations

from typing import Any

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Ramp, Sine
from powertrain.components.body import VehicleBody
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, SlipWheel, Wheel, WheelBrake

WHEELS: dict[str, Wheel] = {"rigid": RigidWheel(), "linear": SlipWheel(), "magic": MagicFormulaWheel()}
SLIPPING = {name: wheel for name, wheel in WHEELS.items() if name != "rigid"}


class Drum(pt.Component):
    """A wheel with a given speed on a road with a given speed."""

    wheel: Wheel
    turning: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=0)
    rolling: tr.ConstantSpeed = tr.ConstantSpeed(v_fixed=0)
    load: Constant = Constant(k=4000)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.turning.flange, self.wheel.hub)
        yield pt.connect(self.rolling.flange, self.wheel.road)
        yield pt.connect(self.load.y, self.wheel.load)


class Plain(pt.Component):
    """A body on a front and a rear axle, a torque at the front and a brake at the rear."""

    torque: Constant | Ramp | Sine = Constant(k=0)
    drive: rot.Torque = rot.Torque()
    front: Wheel
    rear: Wheel
    brake: WheelBrake = WheelBrake()
    front_brake: WheelBrake = WheelBrake(tau_max=0)
    demand: Constant = Constant(k=0)
    grade: Constant = Constant(k=0)
    wind: Constant = Constant(k=0)
    body: VehicleBody = VehicleBody(Cd=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.front.hub, self.front_brake.flange_a)
        yield pt.connect(self.brake.flange_a, self.rear.hub)
        yield pt.connect(self.demand.y, self.brake.demand, self.front_brake.demand)
        yield pt.connect(self.front.road, self.body.front)
        yield pt.connect(self.rear.road, self.body.rear)
        yield pt.connect(self.body.front_load, self.front.load)
        yield pt.connect(self.body.rear_load, self.rear.load)
        yield pt.connect(self.grade.y, self.body.grade)
        yield pt.connect(self.wind.y, self.body.wind)


def plain(wheel: Wheel, *, locked_front: bool = False, **changes: Any) -> Plain:
    """The same wheel at the front and at the rear, with a brake at the front too where it shall lock."""
    if locked_front:
        changes = {"front_brake": WheelBrake(), **changes}
    return Plain(front=wheel, rear=wheel, **changes)


def tight(model: pt.Component, stop: float, starts: dict[str, float] | None = None, **options: Any) -> Any:
    return pt.simulate(model, stop, starts=starts, **{"rtol": 1e-9, **options})
