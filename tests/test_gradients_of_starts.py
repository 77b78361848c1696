"""Derivatives of runs by their starts, first and second, against closed forms; and objectives that differ in a late digit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from runs_by_formula import TIGHT, assert_as_formula

import powertrain as pt


class Begun(pt.Component):
    """x decays at a rate k that ``initial()`` computes, as it does x itself from k."""

    a: pt.Parameter = pt.parameter("1", "One", default=0.7)
    b: pt.Parameter = pt.parameter("1", "Other", default=1.3)
    x: pt.Variable = pt.variable("1", "Level")
    k: pt.Discrete = pt.discrete("1", "Rate", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.k * self.x

    def initial(self) -> pt.Equations:
        yield self.k == self.a**2 * self.b
        yield self.x * self.b == self.k**2


def test_a_discrete_variable_that_initial_computes() -> None:
    """x = k^2/b exp(-k t) with k = a^2 b."""
    assert_as_formula(Begun(), "x", lambda a, b: a**4 * b * ca.exp(-(a**2) * b * 1.5), {"a": 0.7, "b": 1.3}, stop=1.5)


@pytest.mark.parametrize("varied", [("a", "b"), ("a", "b", "k")])
def test_a_discrete_variable_given_for_the_run(varied: tuple[str, ...]) -> None:
    """x = k^2/b exp(-k t) with the k that is given: a has no effect."""

    def level(a: Any, b: Any, k: Any = 0.4) -> Any:
        return k**2 / b * ca.exp(-k * 1.5) + 0 * a

    values = {"a": 0.7, "b": 1.3, "k": 0.4}
    assert_as_formula(Begun(), "x", level, {n: values[n] for n in varied}, stop=1.5, starts={"k": 0.4})


class Chained(pt.Component):
    """x decays at a rate h = k^2 b that follows from another, k = a."""

    a: pt.Parameter = pt.parameter("1", "One", default=0.7)
    b: pt.Parameter = pt.parameter("1", "Other", default=1.3)
    x: pt.Variable = pt.variable("1", "Level", start=1.0)
    h: pt.Discrete = pt.discrete("1", "Rate")
    k: pt.Discrete = pt.discrete("1", "Other rate")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.h * self.x

    def initial(self) -> pt.Equations:
        yield self.h == self.k**2 * self.b
        yield self.k == self.a


@pytest.mark.parametrize("given", [{}, {"k": 0.4}, {"h": 0.4}])
def test_a_discrete_variable_that_another_determines(given: dict[str, float]) -> None:
    """x = exp(-h t) with h = k^2 b and k = a, each of which may be given or varied instead."""

    def level(a: Any, b: Any, *value: Any) -> Any:
        h = value[0] if "h" in given else (value[0] if value else a) ** 2 * b
        return ca.exp(-1.5 * h) + 0 * a

    values = {"a": 0.7, "b": 1.3} | given
    assert_as_formula(Chained(), "x", level, values, stop=1.5, starts=given)
    assert_as_formula(Chained(), "x", lambda b, k: ca.exp(-1.5 * k**2 * b), {"b": 1.3, "k": 0.7}, stop=1.5)


class Loose(pt.Component):
    """x has no condition at the start; y begins at its square."""

    x: pt.Variable = pt.variable("1", "Level")
    y: pt.Variable = pt.variable("1", "Other level")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0 - self.x**2
        yield pt.der(self.y) == self.x

    def initial(self) -> pt.Equations:
        yield self.y == self.x**2


def test_a_state_without_a_condition() -> None:
    """x = tanh(t + artanh x0), y = x0^2 + ln cosh(t + artanh x0) - ln cosh(artanh x0), at x0 = 0."""

    def level(x: Any) -> Any:
        return x**2 + ca.log(ca.cosh(0.8 + ca.atanh(x))) - ca.log(ca.cosh(ca.atanh(x)))

    assert_as_formula(Loose(), "y", level, {"x": 0.0}, stop=0.8)


class Fed(pt.Component):
    """The same, with a rate and a level that begin with what an input is at the start."""

    u: pt.Input = pt.signal_input("1", "Feed")
    x: pt.Variable = pt.variable("1", "Level")
    k: pt.Discrete = pt.discrete("1", "Rate", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.k * self.x

    def initial(self) -> pt.Equations:
        yield self.k == 0.5 * self.u.value
        yield self.x == self.k**2 + self.u.value


def test_a_start_that_is_an_input() -> None:
    """x = (u^2/4 + u) exp(-u t/2), u the value at the first knot."""
    run = pt.simulate(Fed(), 1.5, inputs={"u": ([0.0, 1.0, 2.0], [0.8, 2.0, 3.0])}, **TIGHT)
    slopes = pt.gradient(run, "x", "u").array
    u, e = 0.8, np.exp(-0.6)
    np.testing.assert_allclose(slopes, [(u / 2 + 1 - 0.75 * (u**2 / 4 + u)) * e, 0.0, 0.0], rtol=1e-8, atol=1e-12)


class Rising(pt.Component):
    """x = 1 + t."""

    x: pt.Variable = pt.variable("1", "Level", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0


def square(c: float) -> Callable[[Any], Any]:
    """(1000 x - c)^2."""
    return lambda m: (1000 * m.x - c) ** 2


def test_expressions_that_differ_in_a_late_digit() -> None:
    """The integral of (1000 x - c)^2 is that of a parabola, for either c."""
    run = pt.simulate(Rising(), 0.4, **TIGHT)
    for c in (1000.001, 1000.004):
        found = pt.gradient(run, pt.integral(square(c)), "x")
        assert found.value == pytest.approx(((1400 - c) ** 3 - (1000 - c) ** 3) / 3000, rel=1e-9)
        first = pt.sensitivity(run, square(c), "x", [0.0])
        assert first.to_array().item() == pytest.approx(2000 * (1000 - c), rel=1e-9)


class Held(pt.Component):
    """Two inertias that a clutch holds together from the start, and one that sticks to a belt."""

    belt: pt.Parameter = pt.parameter("m/s", "Speed of the belt", default=0.5)
    a: pt.Variable = pt.variable("rad/s", "Speed of 2 kg.m2", start=1.0)
    b: pt.Variable = pt.variable("rad/s", "Speed of 3 kg.m2", start=1.0)
    v: pt.Variable = pt.variable("m/s", "Speed of 2 kg on the belt", start=0.5)
    x: pt.Variable = pt.variable("m", "Its way", start=0.0)
    torque: pt.Variable = pt.variable("N.m", "Of the clutch")
    force: pt.Variable = pt.variable("N", "Of the belt")

    def equations(self) -> pt.Equations:
        yield 2 * pt.der(self.a) == -self.torque
        yield 3 * pt.der(self.b) == self.torque
        yield pt.friction(self.a - self.b, self.torque, -5, 5, name="clutch")
        yield pt.der(self.x) == self.v
        yield 2 * pt.der(self.v) == 1.0 - self.force
        yield pt.friction(self.v - self.belt, self.force, -5, 5, name="shoe")


@pytest.mark.parametrize("of", ["a", "b"])
def test_laws_that_stick_from_the_start_take_away_what_a_start_adds(of: str) -> None:
    """The momentum 2 a + 3 b stays; what has stuck to the belt follows it, whatever speed it begins with."""
    run = pt.simulate(Held(), 2.0)
    found = pt.gradient(run, of, ["a", "b"])
    assert (found["a"], found["b"]) == pytest.approx((0.4, 0.6), rel=1e-9)
    found = pt.gradient(run, "x", ["belt", "v"])
    assert (found["belt"], found["v"]) == pytest.approx((2.0, 0.0), abs=1e-9)
