"""A rigid transfer case in a bend: the tyres slip by the difference of the circles of both axles."""

from __future__ import annotations

import math

import pytest

import powertrain as pt
from powertrain.components.body import DrivenAxle, RigidTransferCase
from powertrain.components.wheels import SlipWheel
from powertrain.vehicles import FourWheelDriveCar

SIDES = "left", "right"


@pytest.mark.slow
def test_the_axles_push_against_each_other_in_a_bend() -> None:
    """f = C slip with slip = radius w/v - 1 at each wheel; both axles turn at the same speed, and the front one runs k times as far."""
    axle = DrivenAxle(left=SlipWheel(C=6e4), right=SlipWheel(C=6e4))
    car = FourWheelDriveCar.in_one_gear(front=axle, rear=axle, transfer=RigidTransferCase())
    curvature, t = 0.06, 9.0
    inputs = {
        "driver.accelerator_pedal": ([0, 1, t], [0, 0.5, 0.5]),
        "curvature": ([0, 4, 5, t], [0, 0, curvature, curvature]),
    }
    result = pt.simulate(car, t, inputs=inputs)
    force = {end: sum(float(result.at(t, f"{end}.{side}.f")) for side in SIDES) for end in ("front", "rear")}
    w, v = float(result.at(t, "rear.cage.w")), float(result.at(t, "body.v"))
    assert result.at(t, "front.cage.w") == pytest.approx(w, rel=1e-6)
    k = math.hypot(1, curvature * 2.7)
    by_slip = 2 * 6e4 * 0.3 * w / v * (1 - 1 / k)
    assert by_slip > 1500
    assert force["rear"] - force["front"] == pytest.approx(by_slip, rel=0.02)
    pushing = float(result.at(t, "transfer.front.tau")), float(result.at(t, "transfer.rear.tau"))
    assert pushing[1] < 0, "into the rear axle, out of the transfer case"
    assert abs(pushing[1]) > 3 * abs(pushing[0])
