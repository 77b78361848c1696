"""Where an indicator falls through zero, against bracketing root finders, on curves that secants do not like."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from curves import CURVES, DEEP, Curve, Step
from scipy.optimize import brentq

from powertrain.numerics.buffers import CHECKS, INFO

AIM = 1e-11


FEW = {"line": 3, "curved up": 10, "curved down": 12, "flat above": 15, "clipped at the hysteresis": 30, "quintic": 20}
"""Evaluations that the Illinois method and the extrapolations take at most."""


@pytest.mark.parametrize("name", CURVES)
def test_first_root(name: str) -> None:
    """The indicator there is below zero, by twice the aim at most, or at the nearest number where it jumps."""
    step = Step([CURVES[name]])
    found = step.find()
    assert found is not None
    value = CURVES[name](found)
    root: Any = brentq(CURVES[name], 0.0, 1.0, xtol=1e-16, maxiter=1000)
    assert value <= 0.0
    if value < -2 * AIM:
        assert found == pytest.approx(root, abs=1e-15)
    assert found >= root - 1e-12
    assert CURVES[name](np.nextafter(found, -1) - 1e-9 * (name == "jump")) > 0.0 or value >= -2 * AIM
    assert step.calls <= FEW.get(name, 70)
    assert step.memory.g[0] == value
    assert step.memory.fraction[0] == found


@pytest.mark.parametrize("seed", range(20))
def test_random_cubics(seed: int) -> None:
    """The first root of several indicators where one is below zero at the next place, as all roots of the polynomials give it."""
    rng = np.random.default_rng(seed)
    while True:
        polynomials = [np.polynomial.Polynomial([rng.uniform(0.1, 1), *rng.normal(size=3) * 2]) for _ in range(3)]
        step = Step([lambda q, p=p: float(p(q)) for p in polynomials])  # type: ignore[misc]
        below = step.memory.info[INFO:] <= 0.0
        if below.any():
            break
    begin = [0.0, *CHECKS][int(np.argmax(below))]
    every = np.concatenate([np.asarray(p.roots(), complex) for p in polynomials])
    roots = [float(r.real) for r in every if abs(r.imag) < 1e-12 and begin < r.real <= 1]
    found = step.find()
    assert found is not None
    assert found == pytest.approx(min(roots), abs=1e-9)
    assert min(float(p(found)) for p in polynomials) <= 0.0
    assert step.calls < 25


def test_the_first_of_two_that_fall_between_two_places() -> None:
    step = Step([lambda q: 0.45 - q, lambda q: 10.0 * (0.31 - q)])
    assert step.find() == pytest.approx(0.31, abs=1e-10)


def test_the_first_interval_with_a_negative_end_is_taken() -> None:
    """An indicator that comes back above zero at the next place, and falls again."""

    def curve(q: float) -> float:
        return (q - 0.3) * (q - 0.6) * (q - 0.9) * -1.0

    assert curve(0.5) < 0.0 < curve(0.75)
    assert Step([curve]).find() == pytest.approx(0.3, abs=1e-9)


def test_an_indicator_that_was_below_zero_at_the_start() -> None:
    """The event is now, at the beginning of the interval."""
    assert Step([lambda q: -1.0 - q]).find() == 0.0


def test_nothing_on_closer_look() -> None:
    """The minima of a step are those of its polynomial; where the corrected unknowns say otherwise there is no event."""
    step = Step([lambda q: 0.2 - q])
    step.curves = [lambda q: 2.0 - q]
    assert step.find() is None


def test_an_indicator_that_just_touches_its_goal_at_a_place() -> None:
    assert Step([lambda q: 0.5 - q - 1e-12]).find() == 0.5
    assert Step([lambda q: 1.0 - q - 0.5e-11]).find() == 1.0


def test_depth() -> None:
    """Where an indicator is below -depth, counting those only that are above it at the end of the interval."""
    step = Step([lambda q: 0.4 - q, lambda q: 5.0])
    found = step.find(depth=0.05)
    assert found == pytest.approx(0.45, abs=1e-9)
    assert Step([lambda q: 0.2 - 0.3 * q]).find(depth=0.5) is None
    dips = Step([lambda q: 30.0 * (q - 0.65) ** 2 - 0.6, lambda q: 0.2 - q])
    assert dips.find(depth=0.5) == pytest.approx(0.65 - np.sqrt(1 / 300), abs=1e-9)
    assert Step([lambda q: 0.2 - q]).find(depth=0.7) == pytest.approx(
        0.9, abs=1e-9
    )  # not deep where it is first below zero


def test_one_that_dips_below_the_depth_from_between_zero_and_there() -> None:
    assert Step(DEEP).find(depth=0.05) == pytest.approx(0.1 - np.sqrt(0.002), abs=1e-9)


def test_others_that_fall_later_in_the_interval_do_not_count_twice() -> None:
    """Indicators above zero at the end of the interval are left out, so that their values do not steer the search."""
    step = Step([lambda q: 0.3 - q, lambda q: 0.02])
    assert step.find() == pytest.approx(0.3, abs=1e-10)
    assert step.memory.above[1] > 0.0
    assert step.memory.above[0] < 0.0


def test_one_that_rises_again_behind_the_event_of_another() -> None:
    """The first falls at 0.11; behind 0.2, where the second falls, its values mean nothing."""
    step = Step([lambda q: 0.11 - q + 20.0 * max(q - 0.2, 0.0), lambda q: 3.0 * (0.2 - q), lambda q: 0.22 - q])
    assert step.find() == pytest.approx(0.11, abs=1e-10)


def test_one_that_dips_before_the_event_of_another() -> None:
    """Above zero at both ends of the interval and at the event of the other, 0.2; below in between."""
    dip: Curve = lambda q: (q - 0.1) ** 2 - 0.0016  # noqa: E731
    assert min(dip(0.0), dip(0.2), dip(0.25)) > 0.0
    step = Step([lambda q: 0.2 - q, dip])
    assert step.find() == pytest.approx(0.06, abs=1e-9)
    assert step.memory.g[1] <= 0.0 < step.memory.g[0]
