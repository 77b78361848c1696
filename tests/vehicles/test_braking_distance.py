"""Braking tests: against the equation of motion, with tyres that lock, and on a slope."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

import powertrain as pt
from powertrain.components.body import RoadProfile
from powertrain.trials import braking
from powertrain.vehicles import ManualCar, RearDriveCar

FREE = pt.replace(
    ManualCar.in_one_gear(ratio=2.0),
    {
        "engine.J": 1e-3,
        "engine.tau_0": 0.01,
        "engine.tau_2": 0.0,
        "gearbox.input.J": 1e-4,
        "gearbox.churning.d": 0.0,
        "front.wheels.J": 3.0,
        "front.wheels.Cr": 0.012,
        "rear.wheels.Cr": 0.012,
        "body.Cd": 0.5,
    },
)
"""A car whose engine and gearbox hardly count: 1,300 kg, 2.1 m2, brakes of 4,500 N.m, wheels of 0.3 m and 5 kg.m2."""


def by_hand(v_0: float, v_end: float, brake: float, grade: float = 0.0) -> tuple[float, float]:
    """Distance [m] and time [s]: the integrals of v m dv/F and m dv/F."""
    g, cosine = 9.80665, 1 / np.hypot(1, grade)

    def per_speed(v: float) -> float:
        force = brake * 4500 / 0.3 + 0.012 * 1300 * g * cosine + 0.5 * 2.1 * 0.6 * v**2 + 1300 * g * grade * cosine
        return float((1300 + 5 / 0.09) / force)

    return quad(lambda v: v * per_speed(v), v_end, v_0)[0], quad(per_speed, v_end, v_0)[0]


@pytest.mark.parametrize(("brake", "grade"), [(1.0, 0.0), (0.2, 0.0), (0.3, -0.1)])
def test_distance_by_the_equation_of_motion(brake: float, grade: float) -> None:
    road = RoadProfile(profile=pt.Map.constant(grade, x="s", x_unit="m", name="grade"))
    v_0 = 80 / 3.6
    test = braking(pt.replace(FREE, {"road": road}), "80 km/h", brake)
    distance, time = by_hand(v_0, 0.0, brake, grade)
    assert test.distance == pytest.approx(distance, rel=4e-3)
    assert test.time == pytest.approx(time, rel=4e-3)
    developed = by_hand(0.8 * v_0, 0.1 * v_0, brake, grade)[0]
    assert test.mfdd == pytest.approx((0.64 - 0.01) * v_0**2 / 2 / developed, rel=4e-3)


@pytest.mark.slow
def test_locked_tyres_slide() -> None:
    """On ice the wheels lock: the car slides with the friction coefficient, 0.1, whatever the pedal."""
    icy = pt.replace(RearDriveCar(), {"rear.left.mu": 0.1, "rear.right.mu": 0.1, "front.brakes.tau_max": 0.0})
    test = braking(icy, "20 km/h")
    result = test.result
    during = (result.time > result.time[-1] - 0.8 * test.time) & (result["body.v"] > 1)
    push: NDArray[np.float64] = sum(
        (result[f"rear.{side}.f"] for side in ("left", "right")), np.zeros(result.time.size)
    )
    load = sum((result[f"rear.{side}.fn"] for side in ("left", "right")), np.zeros(result.time.size))
    assert np.abs(result["rear.left.w"][during]).max() < 0.1
    assert np.ptp((push / load)[during]) < 0.05
    assert test.distance > 3 * (20 / 3.6) ** 2 / 2 / 9.80665


@pytest.mark.slow
def test_what_cannot_be_tested_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("powertrain.trials.braking"), "LONGEST", 10.0)
    with pytest.raises(pt.SimulationError, match=r"ManualCar does not reach 90 m/s within 10 s"):
        braking(FREE, 90.0)
    steep = RoadProfile(profile=pt.Map.constant(-0.3, x="s", x_unit="m", name="grade"))
    with pytest.raises(pt.SimulationError, match=r"ManualCar does not come to rest within 10 s"):
        braking(pt.replace(FREE, {"road": steep}), 20.0, 0.1)
    with pytest.raises(pt.ParameterError, match="braking: speed = 0 m/s"):
        braking(ManualCar(), 0.0)
    with pytest.raises(pt.ParameterError, match="braking: brake = 2"):
        braking(ManualCar(), 20.0, 2.0)
