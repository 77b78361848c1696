"""Figures of shifts and gears, from courses and maps given by formulas."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from powertrain.trials.gears import accelerator, overrun, per_speed
from powertrain.trials.shifts import SPAN, _jerk


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
