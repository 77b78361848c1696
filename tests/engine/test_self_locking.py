"""A brake shoe that draws itself in: where it cannot slide the error says so; friction never drives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from cases import few

import powertrain as pt


class Shoe(pt.Component):
    """A shoe that its own friction presses on: N = 10 N + k F."""

    size: str = "plain"
    mu: pt.Parameter = pt.parameter("1", "Coefficient of friction", default=0.5)
    k: pt.Parameter = pt.parameter("1", "Pressing force over friction force", default=3.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=10.0)
    N: pt.Variable = pt.variable("N", "Pressing force")
    F: pt.Variable = pt.variable("N", "Friction force")

    def equations(self) -> pt.Equations:
        sizes = {"plain": self.F, "size": ca.fabs(self.F), "smooth": ca.sqrt(self.F**2 + 1e-4)}
        yield self.N - self.k * sizes[self.size] == 10.0
        yield pt.friction(self.w, self.F, -self.mu * self.N, self.mu * self.N)
        yield pt.der(self.w) == 1.0 - self.F

    def loss(self) -> pt.Symbol:
        return self.F * self.w


@pytest.mark.parametrize("size", ["plain", "size", "smooth"])
@pytest.mark.parametrize(("mu", "k"), few([(0.5, 3.0), (1.0, 1.5), (0.9, 20.0)]))
def test_what_cannot_slide_is_called_self_locking(size: str, mu: float, k: float) -> None:
    with pytest.raises(pt.PowertrainError, match=r"mode .*pt\.friction\(.* is self-locking.*stiffness") as caught:
        pt.simulate(Shoe(size=size, mu=mu, k=k), 1.0)
    assert "algebraic loop" not in str(caught.value)


@pytest.mark.parametrize("size", ["plain", "size", "smooth"])
def test_below_its_limit_it_slides(size: str) -> None:
    """F = mu (10 N + k F) = 5 N/(1 - 0.5) = 10 N."""
    result = pt.simulate(Shoe(size=size, k=1.0), 0.5)
    np.testing.assert_allclose(result["F"], 10.0, rtol=1e-4)


def test_the_other_way_it_lets_go() -> None:
    """F = -mu (10 N + k F) = -5 N/2.5 = -2 N."""
    result = pt.simulate(Shoe(), 1.0, starts={"w": -10.0})
    np.testing.assert_allclose(result["F"], -2.0, rtol=1e-9)


def test_at_rest_it_holds() -> None:
    result = pt.simulate(Shoe(), 1.0, starts={"w": 0.0})
    assert result["mode"][-1] == 0
    np.testing.assert_allclose(result["F"], 1.0)
