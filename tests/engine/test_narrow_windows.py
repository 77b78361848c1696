"""Conditions on a magnitude, or on the smaller or larger of two, hold for however short a time: no event is lost between steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from joined import joined

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import ConstantTorque, DogClutch, Inertia

Condition = Callable[[Any, Any], Any]
CONDITIONS: dict[str, Condition] = {
    "magnitude": lambda e, c: ca.fabs(e) < c,
    "not above": lambda e, c: ca.logic_not(ca.fabs(e) >= c),
    "difference": lambda e, c: c - ca.fabs(e) > 0.0,
    "sum": lambda e, c: ca.fabs(e) + 1.0 < c + 1.0,
    "smaller": lambda e, c: ca.fmin(c - e, c + e) > 0.0,
    "larger": lambda e, c: ca.fmax(e, -e) < c,
    "negative": lambda e, c: -ca.fabs(e) > -c,
    "both": lambda e, c: ca.logic_and(ca.fabs(e) < c, e > -10.0),
}


class Passing(pt.Component):
    """A place that moves at 1/s past a window of half-width c around x0; visits are counted, and the time within."""

    condition: Any
    x0: pt.Parameter = pt.parameter("1", "Middle of the window", default=0.5)
    c: pt.Parameter = pt.parameter("1", "Half of its width", default=1e-3)
    x: pt.Variable = pt.variable("1", "Place", start=0.0)
    inside: pt.Variable = pt.variable("s", "Time in the window", start=0.0, nominal=1e-6)
    visits: pt.Discrete = pt.discrete("1", "Visits")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.inside) == pt.switch(self.condition(self.x - self.x0, self.c), 1.0, 0.0)
        yield pt.when(self.condition(self.x - self.x0, self.c), pt.reinit(self.visits, self.visits + 1))


@pytest.mark.parametrize("condition", few(list(CONDITIONS), 3))
def test_a_window_of_any_width_is_visited_once(condition: str) -> None:
    """A step of 0.5 s and more passes a window of 20 us."""
    plant = pt.compile(Passing(condition=CONDITIONS[condition]))
    for c in (0.1, 1e-2, 1e-5):
        for x0 in np.linspace(0.6, 2.4, 7):
            result = plant.simulate(3.0, parameters={"c": c, "x0": x0})
            assert result["visits"][-1] == 1
            assert result["inside"][-1] == pytest.approx(2 * c, rel=1e-5)


def test_dogs_engage_as_the_speeds_pass_each_other() -> None:
    """100 N.m take a shaft of 1 kg.m2 through the speed of the other, within 5 rad/s of which it is for 0.1 s."""
    parts = ConstantTorque(tau_constant=-100.0), Inertia(J=1.0), DogClutch(), Inertia(J=1.0), Constant(k=1.0)
    plant = pt.compile(
        joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a 4.y=2.engage")
    )
    for w in np.linspace(30.0, 80.0, 11):
        result = plant.simulate(1.5, starts={"parts[1].w": w, "parts[3].w": 0.0})
        assert result["parts[2].inside"][-1] == 1
        assert result["parts[1].w"][-1] == pytest.approx((w - 150.0) / 2, abs=1e-5)
