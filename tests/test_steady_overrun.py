"""Steady points of a centrifugal clutch: where it holds, where it slips, and where it may do either."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Clutch, ConstantSpeed, Inertia, Torque

OK, SEVERAL = 0, 2
IDLE, OPEN, SLOPE = 80.0, 95.0, 5.0


class Overrun(pt.Component):
    """An engine of torque w_idle - w, and a clutch that its speed presses, on a shaft of given speed."""

    engine: Torque = Torque()
    crank: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=SLOPE, mue_pos=((0.0, 1.0),))
    shaft: ConstantSpeed = ConstantSpeed(w_fixed=150.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.crank.flange_a)
        yield pt.connect(self.crank.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.shaft.flange)
        yield self.engine.tau.value == IDLE - self.crank.w
        yield self.clutch.f_normalized.value == self.crank.w - OPEN


def test_overrun_has_several_solutions() -> None:
    """At 150 rad/s the clutch holds, slips at 98.75 = (5 95 - 80)/4 rad/s, or lets the engine idle; a shaft below 98.75 leaves the last."""
    plant = pt.compile(Overrun())
    speeds = {"shaft.w_fixed": [60.0, 90.0, 97.0, 150.0]}
    found = pt.steady(plant, speeds, outputs=["crank.w", "clutch.tau"])
    assert found.status.values.tolist() == [OK, OK, OK, SEVERAL]
    assert "clutch" in found.attrs["problems"]
    np.testing.assert_allclose(found["crank.w"].values[:3], IDLE, rtol=1e-12)
    np.testing.assert_allclose(found["clutch.tau"].values[:3], 0.0, atol=1e-12)
    assert np.isnan(found["crank.w"].values[3])


def test_first_of_several_solutions_holds() -> None:
    found = pt.steady(Overrun(), {"shaft.w_fixed": [97.0, 150.0]}, outputs=["crank.w", "clutch.tau"], first=True)
    assert found.status.values.tolist() == [OK, SEVERAL]
    np.testing.assert_allclose(found["crank.w"], [IDLE, 150.0], rtol=1e-12)
    assert found["clutch.tau"].values[1] == pytest.approx(150.0 - IDLE)


@pytest.mark.parametrize(("start", "end"), [(98.0, IDLE), (99.5, 150.0)])
def test_simulations_end_in_both(start: float, end: float) -> None:
    """The slipping solution between them is not stable."""
    result = pt.simulate(Overrun(), 10.0, starts={"crank.w": start})
    assert result["crank.w"][-1] == pytest.approx(end, rel=1e-6)


def test_maps_say_the_same_as_points() -> None:
    """Many points are solved together; the border is where the clutch just holds, 5 (w - 95) = w - 80."""
    speeds = np.linspace(50.0, 200.0, 3000)
    found = pt.steady(Overrun(), {"shaft.w_fixed": speeds}, outputs=["crank.w"], first=True)
    holds = speeds > (SLOPE * OPEN - IDLE) / (SLOPE - 1)
    np.testing.assert_array_equal(found.status, np.where(holds, SEVERAL, OK))
    np.testing.assert_allclose(found["crank.w"], np.where(holds, speeds, IDLE), rtol=1e-9)
