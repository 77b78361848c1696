"""Derivatives of runs through events, first and second, against closed forms: readings at events, laws that a reset brings to rest."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from runs_by_formula import TIGHT, Formula, assert_as_formula

import powertrain as pt


class Growing(pt.Component):
    """x grows exponentially until it reaches c, where a reset sets it to 0.3 x^2; y is the time."""

    a: pt.Parameter = pt.parameter("1", "Rate", default=0.9)
    c: pt.Parameter = pt.parameter("1", "Limit", default=1.2)
    x: pt.Variable = pt.variable("1", "Level", start=0.3)
    y: pt.Variable = pt.variable("1", "Time", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a * self.x
        yield pt.der(self.y) == 1
        yield pt.when(self.x > self.c, pt.reinit(self.x, 0.3 * self.x**2))


GROWING = {"a": 0.9, "c": 1.2, "x": 0.3}


def instant(a: Any, c: Any, x: Any) -> Any:
    """When x reaches c."""
    return ca.log(c / x) / a


READINGS: dict[str, tuple[Any, Formula]] = {
    "end": ("x", lambda a, c, x: 0.3 * c**2 * ca.exp(a * (1.6 - instant(a, c, x)))),
    "before": (pt.maximum(lambda m: m.x * m.y), lambda a, c, x: c * instant(a, c, x)),
    "after": (pt.minimum(lambda m: 3 * m.x - m.y), lambda a, c, x: 0.9 * c**2 - instant(a, c, x)),
    "ratio": (pt.maximum(lambda m: m.y / m.x), lambda a, c, x: instant(a, c, x) / (0.3 * c**2)),
    "sum": (
        2 * pt.maximum("x") + pt.at("x", 1.0) + 3 * pt.minimum(lambda m: 3 * m.x - m.y),
        lambda a, c, x: 2 * c + x * ca.exp(a) + 3 * (0.9 * c**2 - instant(a, c, x)),
    ),
    "integrals": (
        2 * pt.integral("x") - 3 * pt.integral(lambda m: m.y * m.x / m.x),
        lambda a, c, x: 2 * ((c - x) + 0.3 * c**2 * (ca.exp(a * (1.6 - instant(a, c, x))) - 1)) / a - 3 * 1.6**2 / 2,
    ),
}


@pytest.mark.parametrize("reading", READINGS)
def test_readings_before_and_after_a_reset(reading: str) -> None:
    """The instant, and with it what is read, moves with every unknown."""
    of, formula = READINGS[reading]
    assert_as_formula(Growing(), of, formula, GROWING, stop=1.6)


class Thrown(pt.Component):
    """A body slides on a belt that runs at p^2 b s until it hits a stop at c, from which on it moves with the belt."""

    onto: float = 0.0
    p: pt.Parameter = pt.parameter("1", "Speed of the belt", default=0.7)
    b: pt.Parameter = pt.parameter("1/s", "Speed of the belt by place", default=1.4)
    c: pt.Parameter = pt.parameter("m", "Place of the stop", default=1.1)
    w: pt.Variable = pt.variable("m/s", "Speed", start=6.0)
    s: pt.Variable = pt.variable("m", "Place", start=0.3)
    f: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == self.w
        yield pt.der(self.w) == -self.f
        belt = self.p**2 * self.b * self.s
        yield pt.friction(self.w - belt, self.f, -9.0, 9.0)
        yield pt.when(self.s > self.c, pt.reinit(self.w, self.onto or belt))


def place(p: Any, b: Any, s: Any, c: Any, w: Any) -> Any:
    """The place at t = 2; the body is slowed at 9 m/s2 at first."""
    return c * ca.exp(p**2 * b * (2.0 - (w - ca.sqrt(w**2 - 18.0 * (c - s))) / 9.0))


THROWN = {"p": 0.7, "b": 1.4, "s": 0.3, "c": 1.1, "w": 6.0}


@pytest.mark.parametrize(
    ("of", "formula"), [("s", place), ("w", lambda p, b, s, c, w: p**2 * b * place(p, b, s, c, w))], ids=["s", "w"]
)
def test_a_reset_to_the_speed_at_which_a_law_sticks(of: str, formula: Formula) -> None:
    assert_as_formula(Thrown(), of, formula, THROWN, stop=2.0)


def test_a_law_takes_away_the_speed_that_a_reset_misses() -> None:
    """A reset to a number that is the belt's speed: where the belt is faster, friction catches up with it at once."""
    found = pt.gradient(pt.simulate(Thrown(onto=0.7**2 * 1.4 * 1.1), 2.0, **TIGHT), "s", list(THROWN))
    symbols = [ca.SX.sym(name) for name in THROWN]
    exact = ca.Function("exact", symbols, [ca.gradient(place(*symbols), ca.vertcat(*symbols))])
    np.testing.assert_allclose([found[n] for n in THROWN], np.array(exact(*THROWN.values())).ravel(), rtol=1e-7)


class Caught(pt.Component):
    """The same belt; at 0.1 s the body gets the speed that the belt has at 0.3 m + 0.6 m - 0.045 m."""

    w: pt.Variable = pt.variable("m/s", "Speed", start=6.0)
    s: pt.Variable = pt.variable("m", "Place", start=0.3)
    f: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == self.w
        yield pt.der(self.w) == -self.f
        yield pt.friction(self.w - 0.7 * self.s, self.f, -9.0, 9.0)
        yield pt.when(pt.time > 0.1, pt.reinit(self.w, 0.7 * 0.855))


def test_a_law_takes_away_the_speed_that_a_place_misses() -> None:
    """From elsewhere the body has the speed of the belt there at once: s = (s0 + 0.1 w0 - 0.045) exp(0.7 (t - 0.1))."""
    found = pt.gradient(pt.simulate(Caught(), 2.0, **TIGHT), "s", ["s", "w"])
    grown = np.exp(0.7 * 1.9)
    np.testing.assert_allclose([found["s"], found["w"]], [grown, 0.1 * grown], rtol=1e-7)


class Carried(pt.Component):
    """A body that a belt carries at p^2 b from the start."""

    p: pt.Parameter = pt.parameter("1", "Speed of the belt", default=0.7)
    b: pt.Parameter = pt.parameter("m/s", "Speed of the belt", default=1.4)
    w: pt.Variable = pt.variable("m/s", "Speed")
    s: pt.Variable = pt.variable("m", "Place", start=0.3)
    f: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == self.w
        yield pt.der(self.w) == -self.f
        yield pt.friction(self.w - self.p**2 * self.b, self.f, -9.0, 9.0)

    def initial(self) -> pt.Equations:
        yield self.w == self.p**2 * self.b


def test_a_law_that_sticks_from_the_start() -> None:
    assert_as_formula(Carried(), "s", lambda p, b, s: s + 2.0 * p**2 * b, {"p": 0.7, "b": 1.4, "s": 0.3}, stop=2.0)


class Apart(pt.Component):
    """Two levels that reach their limits together, and go on faster, each by itself."""

    one: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    other: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0 + pt.switch(self.x > self.one, self.x, 0.0)
        yield pt.der(self.y) == 1.0 + pt.switch(self.y > self.other, self.x, 0.0)


def test_second_derivatives_need_one_instant() -> None:
    """Laws that an unknown moves apart are refused."""
    with pytest.raises(pt.SimulationError, match="switch together, and an unknown moves their instants apart"):
        pt.hessian(Apart(), "y", ["one", "other"], stop=1.5)


class Colliding(pt.Component):
    """A mass meets another one that stands 0.5 m ahead."""

    m_1: pt.Parameter = pt.parameter("kg", "Mass", default=1.5)
    m_2: pt.Parameter = pt.parameter("kg", "Mass of the other", default=0.8)
    e: pt.Parameter = pt.parameter("1", "Restitution", default=0.6)
    x_1: pt.Variable = pt.variable("m", "Place", start=0.0)
    v_1: pt.Variable = pt.variable("m/s", "Speed", start=1.2)
    x_2: pt.Variable = pt.variable("m", "Place of the other", start=0.5)
    v_2: pt.Variable = pt.variable("m/s", "Speed of the other", start=0.0)
    force: pt.Variable = pt.variable("N", "Force between them")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x_1) == self.v_1
        yield pt.der(self.x_2) == self.v_2
        yield self.m_1 * pt.der(self.v_1) == -self.force
        yield self.m_2 * pt.der(self.v_2) == self.force
        yield pt.unilateral(self.x_2 - self.x_1, self.force, restitution=self.e)


@pytest.mark.parametrize("of", ["x_1", "x_2"])
def test_an_impact_of_two_masses(of: str) -> None:
    """Momentum stays, and they part with e times the speed at which they met."""

    def place(m_1: Any, m_2: Any, e: Any, v_1: Any) -> Any:
        after = v_1 * ((m_1 - e * m_2 if of == "x_1" else (1 + e) * m_1) / (m_1 + m_2))
        return 0.5 + after * (2.0 - 0.5 / v_1)

    assert_as_formula(Colliding(), of, place, {"m_1": 1.5, "m_2": 0.8, "e": 0.6, "v_1": 1.2}, stop=2.0)


class Noting(pt.Component):
    """As x reaches 1, one reset notes the square of the time, and by that sets off another, which notes the square of that."""

    r: pt.Parameter = pt.parameter("1/s", "Rate", default=0.8)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    a: pt.Discrete = pt.discrete("s2", "Square of the time", start=0.0)
    b: pt.Discrete = pt.discrete("s4", "Its square", start=0.0)
    s: pt.Variable = pt.variable("1", "Sum", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.r
        yield pt.der(self.s) == self.b
        yield pt.when(self.x > 1, pt.reinit(self.a, pt.time**2))
        yield pt.when(self.a > 0.5, pt.reinit(self.b, self.a**2))


def test_a_reset_that_another_reset_sets_off_at_its_own_time() -> None:
    """b = 1/r^4 from 1/r on."""
    assert_as_formula(Noting(), "s", lambda r: (2.0 - 1 / r) / r**4, {"r": 0.8}, stop=2.0)
