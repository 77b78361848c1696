"""Figures of shifts and gears, from courses and maps given by formulas."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from powertrain.trials.gears import accelerator, gears_along, overrun, per_speed
from powertrain.trials.shifts import SPAN, _jerk
from powertrain.vehicles import ManualCar


@pytest.mark.parametrize(("start", "stop", "jerk"), [(2.0, 3.0, 3.0 - SPAN), (0.0, 1.0, 1.0 - SPAN)])
def test_jerk_is_the_second_difference_of_the_speed(start: float, stop: float, jerk: float) -> None:
    """A speed of t^3/6 + 4 t has a jerk of t; the last difference ends with the shift."""

    def speed(t: NDArray[np.float64], _: str) -> NDArray[np.float64]:
        assert t.min() >= 0
        return np.asarray(t**3 / 6 + 4 * t)

    run: Any = SimpleNamespace(time=np.array([0.0, 5.0]), at=speed)
    assert _jerk(run, "body.v", start, stop) == pytest.approx(jerk, abs=0.011)


def gear_map() -> xr.Dataset:
    """20 rad per metre; below 5 m/s the clutch is open."""
    speed, pedal = np.array([0.0, 2.0, 5.0, 10.0]), np.array([0.0, 0.5, 1.0])
    w = 20.0 * speed[:, None] * np.ones(3)
    w[:2] = [[80.0, 90.0, 100.0], [18.0, 20.0, 24.0]]
    force = np.array([[-100.0, 2e3, 4e3], [-200.0, 2e3, 4e3], [-300.0, 1e3, 3e3], [-400.0, 500.0, 500.0]])
    values = {"w": (("speed", "accelerator"), w), "force": (("speed", "accelerator"), force)}
    return xr.Dataset(values, {"speed": speed, "accelerator": pedal})


def test_the_ratio_of_a_gear_is_that_with_a_closed_clutch() -> None:
    assert per_speed(gear_map()) == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("v", "force", "pedal"), [(5.2, 2e3, 0.75), (0.8, 0.0, 1 / 21 / 2), (9.0, 600.0, 1.0), (5.0, -900.0, 0.0)]
)
def test_the_pedal_for_a_force_is_that_of_the_nearest_speed(v: float, force: float, pedal: float) -> None:
    assert accelerator(gear_map(), v, force) == pytest.approx(pedal)
    assert overrun(gear_map(), v) == {5.2: -300.0, 0.8: -100.0, 9.0: -400.0, 5.0: -300.0}[v]


def test_gears_along_a_drive_follow_the_pedal_of_their_maps() -> None:
    """Up from gear k above up_k (1 + pedal), with the pedal for the force in gear k, which gives 9/k kN at most, half of it half-way.

    With 1.4 kN, for instance, 0.16 in the first gear: 5.2 m/s; 0.62 in the fourth: 26.8 m/s.
    """
    car, speed, pedals = ManualCar(), np.array([1.0, 45.0]), np.array([0.0, 0.5, 1.0])
    maps = []
    for k in range(1, 7):
        values = {
            "w": 75.0 / k * speed[:, None] * np.ones(3),
            "force": np.ones((2, 1)) * [-50.0, 4500.0 / k, 9000.0 / k],
        }
        grid = {name: (("speed", "accelerator"), value) for name, value in values.items()}
        maps.append(xr.Dataset(grid, {"speed": speed, "accelerator": pedals}))
    v = np.array([2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 25, 30.0])
    for force, expected in (
        (200.0, [1, 1, 2, 2, 3, 3, 4, 4, 4, 5, 6, 6]),
        (1400.0, [1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5]),
    ):
        found = gears_along(car, np.linspace(0.0, 120.0, 13), v, np.full(12, force), maps, grades=np.zeros(12))
        assert found.tolist() == expected
