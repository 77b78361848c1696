"""Segments of piecewise linear signals against numpy's interpolation, and their right limits at jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from powertrain.dae.hybrid import TimeSignal
from powertrain.engine.schedules import Schedules

Matrix = np.ndarray[Any, Any]


def value(m: Matrix, index: int, t: float) -> float:
    start, y, slope = m[index : index + 3]
    return float(y + slope * (t - start))


def random_schedules(rng: np.random.Generator) -> list[TimeSignal]:
    """Three signals on shared and on own times."""
    shared = np.sort(rng.integers(0, 20, 4)) / 2.0
    found = []
    for k in range(3):
        times = np.unique(np.concatenate([shared, rng.uniform(0, 10, 3 + k)]))
        found.append(TimeSignal(f"s{k}", 3 * k, times, rng.normal(size=times.size)))
    return found


@pytest.mark.parametrize("seed", range(10))
def test_continuous_signals_are_interpolated(seed: int) -> None:
    """Entered anywhere; and passed in random strides, small ones and such that jump over many breakpoints."""
    rng = np.random.default_rng(seed)
    given = random_schedules(rng)
    schedules, m = Schedules(given), np.zeros(9)
    assert schedules
    for t in rng.uniform(-2, 12, 40):
        schedules.enter(m, float(t))
        for k, one in enumerate(given):
            assert value(m, 3 * k, float(t)) == pytest.approx(np.interp(t, one.times, one.values), abs=1e-9)
    t = -1.0
    schedules.enter(m, t)
    while t < 11.0:
        following = t + float(rng.exponential(0.7))
        assert not schedules.cross(m, t, following)
        t = following
        for k, one in enumerate(given):
            assert value(m, 3 * k, t) == pytest.approx(np.interp(t, one.times, one.values), abs=1e-9)


def test_following_breakpoints() -> None:
    given = [
        TimeSignal("a", 0, np.array([1.0, 3.0]), np.zeros(2)),
        TimeSignal("b", 3, np.array([2.0, 3.0, 3.0]), np.zeros(3)),
    ]
    schedules = Schedules(given)
    assert [schedules.following(t) for t in (-5.0, 0.999, 1.0, 1.5, 2.0, 2.9, 3.0)] == [1, 1, 2, 2, 3, 3, np.inf]
    assert not Schedules([])
    assert Schedules([]).following(0.0) == np.inf


def test_the_right_limit_holds_at_a_jump() -> None:
    """A time that stands twice, or three times: the first and the last value count."""
    for middle in ([], [99.0]):
        times = np.array([0.0, 1.0, *[1.0 for _ in middle], 1.0, 2.0])
        values = np.array([0.0, 2.0, *middle, 5.0, 4.0])
        schedules, m = Schedules([TimeSignal("a", 0, times, values)]), np.zeros(3)
        schedules.enter(m, 0.5)
        assert value(m, 0, 0.5) == pytest.approx(1.0)
        assert value(m, 0, 1.0) == pytest.approx(2.0)
        schedules.enter(m, 1.0)
        assert value(m, 0, 1.0) == pytest.approx(5.0)
        assert value(m, 0, 1.5) == pytest.approx(4.5)
        schedules.enter(m, 0.5)
        assert schedules.cross(m, 0.5, 1.0)
        assert value(m, 0, 1.0) == pytest.approx(5.0)
        assert not schedules.cross(m, 1.0, 2.0)
        assert value(m, 0, 7.0) == pytest.approx(4.0)


def test_a_time_that_stands_twice_with_one_value_is_no_jump() -> None:
    schedules, m = Schedules([TimeSignal("a", 0, np.array([0.0, 1, 1, 2]), np.array([0.0, 2, 2, 4]))]), np.zeros(3)
    assert not schedules.cross(m, 0.0, 1.5)
    assert value(m, 0, 1.5) == pytest.approx(3.0)


@pytest.mark.parametrize("first", [True, False])
def test_a_jump_beside_a_corner(first: bool) -> None:
    """Of two signals with a breakpoint at the same instant."""
    times = [np.array([0.0, 1, 1, 2]), np.array([0.0, 1, 2])]
    values = [np.array([0.0, 2, 3, 4]), np.array([0.0, 2, 3])]
    schedules = Schedules([TimeSignal("a", 3 * k, times[one], values[one]) for k, one in enumerate((not first, first))])
    assert schedules.cross(np.zeros(6), 0.5, 1.0)


def test_constant_outside_and_jumps_at_the_ends() -> None:
    schedules, m = Schedules([TimeSignal("a", 0, np.array([0.0, 0, 1, 1]), np.array([-3.0, 1, 2, 8]))]), np.zeros(3)
    for t, expected in ((-1.0, -3.0), (0.0, 1.0), (0.5, 1.5), (1.0, 8.0), (9.0, 8.0)):
        schedules.enter(m, t)
        assert value(m, 0, t) == pytest.approx(expected)
    schedules.enter(m, -1.0)
    assert schedules.cross(m, -1.0, 0.0)
    assert schedules.cross(m, 0.5, 1.0)
    assert not schedules.cross(m, 0.0, 0.5)
