"""A clutch between shafts that gears tie to each other: nothing determines its torque, and the run says so."""

from __future__ import annotations

import pytest
from joined import joined

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Step

Source = Constant | Step


class FourWheelDrive(pt.Component):
    """An engine, a front and a rear final drive on a rigid road (one inertia), and the clutch between the shafts to them."""

    rear: rot.IdealGear
    on: Source
    engine: rot.Inertia = rot.Inertia(J=0.1)
    torque: rot.Torque = rot.Torque()
    given: Constant = Constant(k=100.0)
    lock: rot.Clutch = rot.Clutch(fn_max=2e4)
    front: rot.IdealGear = rot.IdealGear(ratio=3.0)
    body: rot.Inertia = rot.Inertia(J=100.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.given.y, self.torque.tau)
        yield pt.connect(self.on.y, self.lock.f_normalized)
        yield pt.connect(self.torque.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.front.flange_a, self.lock.flange_a)
        yield pt.connect(self.lock.flange_b, self.rear.flange_a)
        yield pt.connect(self.front.flange_b, self.rear.flange_b, self.body.flange_a)


@pytest.mark.parametrize("on", [Constant(k=1.0), Step(height=1.0, startTime=0.05)])
def test_axles_on_a_rigid_road(on: Source) -> None:
    """With equal ratios the two axles may share 100 N.m in any way; with others the clutch holds the car."""
    equal = pt.simulate(FourWheelDrive(rear=rot.IdealGear(ratio=3.0), on=on), 0.1, starts={"body.w": 1.0})
    (note,) = equal.notes
    assert note.startswith("lock.mode (")
    assert note.endswith(
        "): other parts tie what it connects, so nothing determines its torque while it is stuck: it may lie anywhere between its limits"
    )
    assert equal["body.w"][-1] == pytest.approx(1.0 + 0.1 * 300.0 / (100.0 + 9.0 * 0.1))
    assert pt.simulate(FourWheelDrive(rear=rot.IdealGear(ratio=3.3), on=on), 0.1).notes == ()


def test_shafts_without_a_second_path_are_silent() -> None:
    """The same clutch between two inertias, and in parallel with a soft shaft."""
    clutch, on = rot.Clutch(fn_max=10.0), Constant(k=1.0)
    row = joined(
        rot.Inertia(J=1.0),
        clutch,
        rot.Inertia(J=2.0),
        on,
        joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 3.y=1.f_normalized",
    )
    assert pt.simulate(row, 0.1).notes == ()
