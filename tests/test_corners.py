"""Derivatives of runs whose rates have corners, first and second, against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from runs_by_formula import assert_as_formula

import powertrain as pt
from powertrain.variational.corners import _changes

RATES: dict[str, Callable[[Any, Any], Any]] = {
    "abs": lambda x, c: ca.fabs(x - c),
    "sign": lambda x, c: (x - c) * ca.sign(x - c),
    "max": lambda x, c: ca.fmax(x, 2 * c - x) - c,
    "min": lambda x, c: c - ca.fmin(x, 2 * c - x),
    "less": lambda x, c: ca.if_else(x < c, c - x, x - c),
    "less or equal": lambda x, c: ca.if_else(x <= c, c - x, x - c),
    "two at once": lambda x, c: ca.fabs(x - c) / 2 + (ca.fmax(x, 2 * c - x) - c) / 2,
    "hidden": lambda x, c: ca.sqrt(ca.fabs(x - c) ** 2),
}


class Bent(pt.Component):
    """x rises at the rate a, past the corner of the rate of y."""

    rate: str = "abs"
    a: pt.Parameter = pt.parameter("1", "Rate", default=0.7)
    c: pt.Parameter = pt.parameter("1", "Corner", default=0.6)
    x: pt.Variable = pt.variable("1", "Level", start=0.2)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a
        yield pt.der(self.y) == RATES[self.rate](self.x, self.c)


def area(a: Any, c: Any, x: Any) -> Any:
    """The integral of |x + a t - c| up to t = 2."""
    return ((c - x) ** 2 + (x + 2 * a - c) ** 2) / (2 * a)


@pytest.mark.parametrize("rate", RATES)
def test_rates_with_a_corner(rate: str) -> None:
    """|x - c|, written in every way."""
    assert_as_formula(Bent(rate=rate), "y", area, {"a": 0.7, "c": 0.6, "x": 0.2}, stop=2.0)


class Twice(pt.Component):
    """Two corners at one instant."""

    c: pt.Parameter = pt.parameter("1", "Corner", default=0.6)
    d: pt.Parameter = pt.parameter("1", "Other corner", default=0.6)
    x: pt.Variable = pt.variable("1", "Level", start=0.2)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == ca.fabs(self.x - self.c) + ca.fmax(self.x, self.d)


def test_corners_that_move_apart_are_refused() -> None:
    with pytest.raises(pt.SimulationError, match="two corners at once"):
        pt.hessian(Twice(), "y", ["c", "d"], stop=2.0)


def test_changes_of_sign() -> None:
    """Values within the accuracy (1) have no sign; a value that only touches zero, or scatters there, does not change it."""
    cases: dict[tuple[float, ...], list[tuple[int, int]]] = {
        (5.0, 2.0, -3.0): [(1, 2)],
        (5.0, 0.5, -0.5, 4.0): [],
        (5.0, 0.5, -0.5, 0.5, -4.0): [(1, 4)],
        (-5.0, 0.5, 0.2, -5.0, 6.0): [(3, 4)],
        (0.5, -0.5, 0.5): [],
        (-2.0, 2.0, -2.0): [(0, 1), (1, 2)],
    }
    for values, changes in cases.items():
        assert list(_changes(np.array(values))) == changes


@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_a_gradient_is_as_accurate_as_its_run(rtol: float) -> None:
    """A step over the corner would leave errors of 1e-3."""
    found = pt.gradient(pt.simulate(Bent(), 2.0, rtol=rtol), "y", "x")["x"]
    assert found == pytest.approx((0.2 + 1.4 - 0.6 - (0.6 - 0.2)) / 0.7, rel=rtol)
