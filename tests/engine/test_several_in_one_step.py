"""Laws whose limits are reached within one step: each event is found, in order."""

from __future__ import annotations

import casadi as ca
import pytest

import powertrain as pt


class Relieved(pt.Component):
    """A mass that a growing force tears off one law at 1 s, while the limit of another begins to rise ``later``."""

    later: pt.Parameter = pt.parameter("s", "Time from the first event to the second")
    w: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    held: pt.Variable = pt.variable("N", "Force of the law that is stuck at first")
    risen: pt.Variable = pt.variable("N", "Force of the law that is free at first")

    def equations(self) -> pt.Equations:
        limit = ca.fmax(0, 20 * (pt.time - 1 - self.later))
        yield pt.der(self.w) == 1 + pt.time - self.held - self.risen
        yield pt.friction(self.w, self.held, -2, 2, name="held")
        yield pt.friction(self.w, self.risen, -limit, limit, name="risen")


class Grazing(pt.Component):
    """Two masses: one is torn off for some milliseconds around 1 s, the other for good soon after."""

    w: pt.Variable = pt.variable("m/s", "Speed of the mass whose limit is just reached", start=0.0)
    u: pt.Variable = pt.variable("m/s", "Speed of the other mass", start=0.0)
    grazed: pt.Variable = pt.variable("N", "Force on the first mass")
    passed: pt.Variable = pt.variable("N", "Force on the other mass")

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == 1.0001 - (pt.time - 1) ** 2 - self.grazed
        yield pt.der(self.u) == pt.time - self.passed
        yield pt.friction(self.w, self.grazed, -1, 1, name="grazed")
        yield pt.friction(self.u, self.passed, -1.03, 1.03, name="passed")


@pytest.mark.parametrize("later", [1e-4, 1e-3])
def test_a_law_breaks_away_just_before_another_would_relieve_it(later: float) -> None:
    """Behind the second event the modes before it do not hold, and the first law seems to be within its limit again."""
    found = pt.simulate(Relieved(later=later), 1.2).events[:2]
    assert [(e.name, e.new) for e in found] == [("held", 1.0), ("risen", 1.0)]
    assert [e.time for e in found] == pytest.approx([1.0, 1.0 + later], abs=1e-6)


def test_a_limit_that_is_just_reached_before_another_law_breaks_away() -> None:
    found = pt.simulate(Grazing(), 1.2).events[:3]
    assert [(e.name, e.new) for e in found] == [("grazed", 1.0), ("grazed", 0.0), ("passed", 1.0)]
    assert found[0].time == pytest.approx(0.99, abs=1e-5)
    assert found[2].time == pytest.approx(1.03, abs=1e-6)
