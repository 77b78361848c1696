"""Conditions on limited signals: they fall to zero, where they are no longer positive, and no further."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import pytest

import powertrain as pt
from powertrain.components.blocks import Limiter, Ramp

LIMITED: dict[str, Callable[[Any], Any]] = {
    "maximum": lambda x: ca.fmax(x, 0),
    "share": lambda x: 2 * ca.fmax(x, 0),
    "both sides": lambda x: ca.fmin(ca.fmax(x, 0), 1),
    "square": lambda x: ca.fmax(x, 0) ** 2,
    "branch": lambda x: ca.if_else(x > 0, x, 0),
    "curve": lambda x: ca.fmax(ca.sin(x), 0),
}


class Falling(pt.Component):
    """x falls from 1 by one per second; the rate of z is 1 while what is left of x is positive, then 3."""

    limit: Callable[[Any], Any]
    x: pt.Variable = pt.variable("1", "Signal", start=1.0)
    y: pt.Variable = pt.variable("1", "Limited signal")
    z: pt.Variable = pt.variable("1", "State", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -1
        yield self.y == self.limit(self.x)
        yield pt.der(self.z) == pt.switch(self.y > 0, 1.0, 3.0)


@pytest.mark.parametrize("kind", LIMITED)
def test_a_switch_falls_where_a_limited_signal_ends(kind: str) -> None:
    """It stayed on: its condition is never below zero."""
    result = pt.simulate(Falling(limit=LIMITED[kind]), 2.0)
    assert result.events.times == pytest.approx([1.0], abs=1e-9)
    assert result["z"][-1] == pytest.approx(4.0, abs=1e-8)


def test_a_gradient_says_what_to_do() -> None:
    result = pt.simulate(Falling(limit=LIMITED["maximum"]), 2.0, starts={"x": 1.0})
    with pytest.raises(
        pt.SimulationError, match=r"switch0 .* at t = 1 s where its condition ends at zero.*signal before its limit"
    ):
        pt.gradient(result, "z", ["x"])
    plain = pt.simulate(Falling(limit=lambda x: x), 2.0, starts={"x": 1.0})
    assert pt.gradient(plain, "z", ["x"])["x"] == pytest.approx(-2.0)


class Limiting(pt.Component):
    """The same with blocks: the instant is one of a time signal."""

    ramp: Ramp = Ramp(height=-2.0, duration=2.0, offset=1.0)
    limiter: Limiter = Limiter(uMax=1.0, uMin=0.0)
    z: pt.Variable = pt.variable("1", "State", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.ramp.y, self.limiter.u)
        yield pt.der(self.z) == pt.switch(self.limiter.y.value > 0, 1.0, 3.0)


def test_a_switch_behind_a_limiter() -> None:
    assert pt.simulate(Limiting(), 2.0)["z"][-1] == pytest.approx(4.0, abs=1e-8)


class Resisting(pt.Component):
    """A speed at which a torque that depends on a limited signal is that of a damper."""

    x: pt.Input = pt.signal_input("1", "Signal")
    y: pt.Variable = pt.variable("1", "Limited signal")
    w: pt.Variable = pt.variable("rad/s", "Speed")

    def equations(self) -> pt.Equations:
        yield self.y == ca.fmax(self.x.value, 0)
        yield pt.der(self.w) == pt.switch(self.y > 0, 1.0, 3.0) - 0.1 * self.w


def test_operating_points_with_a_limited_signal() -> None:
    """They had the other side, with the status ok."""
    found = pt.steady(pt.compile(Resisting()), {"x": [-1.0, 0.0, 1.0]}, outputs=["w"])
    assert found["w"].values.tolist() == [30.0, 30.0, 10.0]
    assert (found["status"] == 0).all()


class Counting(pt.Component):
    """Counts how often a limited sine becomes positive, alone or while the count is below 100."""

    both: bool
    x: pt.Variable = pt.variable("1", "Sine", start=0.0)
    y: pt.Variable = pt.variable("1", "Limited sine")
    count: pt.Variable = pt.variable("1", "How often", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 2 * ca.pi * ca.cos(2 * ca.pi * pt.time)
        yield self.y == ca.fmax(self.x, 0)
        yield pt.der(self.count) == 0
        condition = ca.logic_and(self.y > 0, self.count < 100) if self.both else self.y > 0
        yield pt.when(condition, pt.reinit(self.count, self.count + 1))


@pytest.mark.parametrize("both", [False, True])
def test_a_when_becomes_true_again(both: bool) -> None:
    """It was true but once."""
    assert pt.simulate(Counting(both=both), 3.7)["count"][-1] == 4
