"""Roots, logarithms and the like of arguments without a real value end a run, also where other operations would hide the nan."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt

CURVE = pt.Map.curve([0.0, 1.0], [0.0, 1.0], outside="clip")


class Integrated(pt.Component):
    """x' = f(x); ``shown`` is a signal on which nothing depends."""

    x: pt.Variable = pt.variable("1", "Integral", start=1.0)
    shown: pt.Variable = pt.variable("1", "Signal")
    k: pt.Parameter = pt.parameter("1", "Factor", default=1.0, min=0.0)
    rate: Any = lambda x, k: -0.5
    signal: Any = lambda x, k: x

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.rate(self.x, self.k)
        yield self.shown == self.signal(self.x, self.k)


def _two(argument: Any, one: Callable[[Any], Any], other: Callable[[Any], Any]) -> Any:
    """Two functions of one argument, with different domains."""
    return ca.fmin(one(argument), 9.0) + ca.fmin(other(argument), 9.0)


@pytest.mark.parametrize(
    ("signal", "what"),
    [
        (lambda x, k: ca.fmin(ca.sqrt(x - 0.75), 9.0), "the argument of a square root"),
        (lambda x, k: ca.fmax(ca.log(x - 0.75), -9.0), "the argument of a logarithm"),
        (lambda x, k: ca.fmax((x - 0.75) ** 1.3, 0.0), "the base of a power"),
        (lambda x, k: ca.fmax(ca.asin(1.75 - x), 0.0), "the argument of an arcsine"),
        (lambda x, k: CURVE(ca.sqrt(x - 0.75)), "the argument of a square root"),
        (lambda x, k: ca.sqrt(x - 0.75), "the argument of a square root"),
        (lambda x, k: _two(x + 0.25, ca.sqrt, ca.acosh), "the argument of an inverse hyperbolic cosine"),
        (lambda x, k: _two(x + 0.25, ca.acosh, ca.sqrt), "the argument of an inverse hyperbolic cosine"),
    ],
)
def test_a_run_ends_where_a_value_is_lost(signal: Callable[[Any, Any], Any], what: str) -> None:
    """x = 1 - t / 2 leaves the domain at t = 0.5 s, where the run ends with what was reached."""
    with pytest.raises(pt.SimulationError, match=rf"{what} \(.*test_domains.py.* at t = 0\.5\d* s") as caught:
        pt.simulate(Integrated(signal=signal), 1.0)
    assert caught.value.result is not None
    assert caught.value.result["x"][-1] == pytest.approx(0.75)


@pytest.mark.parametrize(
    "signal",
    [
        lambda x, k: ca.sqrt(ca.fmax(x - 0.75, 0.0)),
        lambda x, k: ca.sqrt(x * x + k),
        lambda x, k: ca.sqrt((1e200 + k) ** 2 + x**2),
        lambda x, k: ca.fabs(x - 0.75) ** 1.3,
        lambda x, k: ca.asin(ca.fmin(ca.fmax(3.0 * x, -1.0), 1.0)),
        lambda x, k: (x - 0.75) ** 3,
        lambda x, k: (x - 0.75) ** (2.0 * k),
        lambda x, k: ca.sqrt(k) * x,
        lambda x, k: ca.if_else(x > 0.75, ca.sqrt(x - 0.75), 0.0),
        lambda x, k: pt.switch(x > 0.75, ca.sqrt(x - 0.75), 0.0),
    ],
)
def test_arguments_that_stay_in_the_domain_need_no_guard(signal: Callable[[Any, Any], Any]) -> None:
    plant = pt.compile(Integrated(signal=signal))
    assert not plant.compiled.dae.guards
    assert plant.simulate(1.0)["x"][-1] == pytest.approx(0.5)


@pytest.mark.parametrize("start", [0.0, -1e-12, -9e-10])
def test_an_argument_beyond_its_domain_by_round_off_counts_as_the_limit(start: float) -> None:
    """The root of 1e-12 less than nothing is zero, where fmin would hide a nan."""
    model = Integrated(rate=lambda x, k: -x, signal=lambda x, k: ca.fmin(ca.sqrt(x), 2.0) + ca.fmin(ca.acosh(1 + x), 2))
    run = pt.simulate(model, 1.0, starts={"x": start})
    np.testing.assert_allclose(run["shown"], 0.0, atol=1e-4)


def test_an_argument_farther_beyond_its_domain_has_no_value() -> None:
    dynamics = pt.compile(Integrated(rate=lambda x, k: ca.sqrt(x))).function()
    assert np.isnan(float(dynamics.function(0.0, -1e-8, [], [], [])[0]))


def test_a_root_of_parameters_is_an_error_of_the_parameters() -> None:
    plant = pt.compile(Integrated(rate=lambda x, k: -ca.fmin(ca.sqrt(2.0 - k), 1.0)))
    said = re.escape("the argument of a square root = -1 is outside [0, inf]")
    with pytest.raises(pt.ParameterError, match=rf"{said} with k = 3"):
        plant.simulate(1.0, parameters={"k": 3.0})


class Placed(pt.Component):
    """y starts at a table of a root of x."""

    x: pt.Variable = pt.variable("1", "Integral", start=1.0)
    y: pt.Variable = pt.variable("1", "Twice the integral")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == 2.0

    def initial(self) -> pt.Equations:
        yield self.y == pt.Map.curve([0.0, 2.0], [0.0, 2.0], outside="error")(ca.sqrt(2.0 - self.x * self.x))


def test_a_start_is_checked_at_the_start_alone() -> None:
    """The root has a value at x = 1, not later; from x = 4 it has none."""
    assert pt.simulate(Placed(), 2.0)["y"][-1] == pytest.approx(5.0)
    with pytest.raises(pt.InitializationError):
        pt.simulate(Placed(), 2.0, starts={"x": 4.0})
