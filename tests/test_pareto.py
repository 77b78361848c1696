"""Pareto fronts in closed form: a convex one, a concave one, and one of three results."""

from __future__ import annotations

import sys
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.optimal.pareto import _undominated


class Circles(pt.Component):
    """(x^2 + y^2, (x - 2)^2 + y^2, x^2 + (y - 1)^2) at the end of a second."""

    x: pt.Parameter = pt.parameter("1", "First", default=0.0)
    y: pt.Parameter = pt.parameter("1", "Second", default=0.0)
    a: pt.Variable = pt.variable("1", "First result", start=0.0)
    b: pt.Variable = pt.variable("1", "Second result", start=0.0)
    c: pt.Variable = pt.variable("1", "Third result", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.a) == self.x**2 + self.y**2
        yield pt.der(self.b) == (self.x - 2) ** 2 + self.y**2
        yield pt.der(self.c) == self.x**2 + (self.y - 1) ** 2


class Concave(pt.Component):
    """Fonseca and Fleming's problem: 1 - exp(-sum (x_i -+ 1/sqrt 2)^2)."""

    x: pt.Parameter = pt.parameter("1", "First", default=0.0)
    y: pt.Parameter = pt.parameter("1", "Second", default=0.0)
    a: pt.Variable = pt.variable("1", "First result", start=0.0)
    b: pt.Variable = pt.variable("1", "Second result", start=0.0)

    def equations(self) -> pt.Equations:
        for result, side in ((self.a, 1), (self.b, -1)):
            distance = (self.x - side / np.sqrt(2)) ** 2 + (self.y - side / np.sqrt(2)) ** 2
            yield pt.der(result) == 1 - ca.exp(-distance)


CIRCLES, BOX = pt.compile(Circles()), {"x": (-1.0, 3.0), "y": (-2.0, 3.0)}


@pytest.mark.parametrize(("method", "points", "count", "error"), [("gradient", 9, 9, 1e-4), ("nsga2", 24, 20, 0.1)])
def test_convex_front(method: Any, points: int, count: int, error: float) -> None:
    """y = 0 and sqrt(a) + sqrt(b) = 2."""
    found = pt.pareto_front(CIRCLES, {"a": "a", "b": "b"}, BOX, method=method, points=points, stop=1.0)
    assert len(found) >= count
    assert (found["y"] ** 2).max() < error
    assert np.sqrt(found[["a", "b"]]).sum(axis=1).to_numpy() == pytest.approx(2.0, abs=error)
    assert found["a"].is_monotonic_increasing
    assert found["b"].is_monotonic_decreasing
    assert found["a"].max() > 3.5


def test_concave_front() -> None:
    """x = y = s for s within +-1/sqrt 2; a weighted sum would find the ends only."""
    found = pt.pareto_front(
        pt.compile(Concave()), {"a": "a", "b": "b"}, {"x": (-1.5, 1.5), "y": (-1.5, 1.5)}, points=9, stop=1.0
    )
    np.testing.assert_allclose(found["x"], found["y"], atol=1e-3)
    s = found["x"].to_numpy()
    np.testing.assert_allclose(found["a"], 1 - np.exp(-2 * (s - 1 / np.sqrt(2)) ** 2), atol=1e-6)
    assert len(found) == 9
    assert np.diff(np.sort(s)).max() < 0.4


def test_three_results() -> None:
    """Least distances from the corners (0, 0), (2, 0) and (0, 1) of a triangle: the front is the triangle."""
    found = pt.pareto_front(CIRCLES, {"a": "a", "b": "b", "c": "c"}, BOX, points=10, stop=1.0)
    x, y = found["x"].to_numpy(), found["y"].to_numpy()
    assert (x > -1e-4).all()
    assert (y > -1e-4).all()
    assert (x / 2 + y < 1 + 1e-4).all()
    assert ((x > 0.1) & (y > 0.1)).any()


class Extra(pt.Component):
    """p^2, (p - 1)^2 + q^2, (p - 1)^2 + (q - 1)^2 + r^2 at the end of a second."""

    p: pt.Parameter = pt.parameter("1", "First", default=0.3)
    q: pt.Parameter = pt.parameter("1", "Second", default=0.3)
    r: pt.Parameter = pt.parameter("1", "Third", default=0.0)
    a: pt.Variable = pt.variable("1", "First result", start=0.0)
    b: pt.Variable = pt.variable("1", "Second result", start=0.0)
    c: pt.Variable = pt.variable("1", "Third result", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.a) == self.p**2
        yield pt.der(self.b) == (self.p - 1) ** 2 + self.q**2
        yield pt.der(self.c) == (self.p - 1) ** 2 + (self.q - 1) ** 2 + self.r**2


@pytest.mark.parametrize("names", ["ab", "abc"])
def test_an_unknown_without_effect_on_one_result_is_best_for_the_others(names: str) -> None:
    """The first result does not depend on q and r: its minimum used to keep their first values, and (0, 2) was on the front for (0, 1).

    For three results, most of the weights asked for used to be left out.
    """
    bounds = {"p": (-2.0, 2.0), "q": (0.0, 2.0), "r": (0.0, 2.0)}
    found = pt.pareto_front(pt.compile(Extra()), {n: n for n in names}, bounds, points=6, stop=1.0)
    p, q = (each.ravel() for each in np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 1, 101)))
    others = np.stack([p**2, (p - 1) ** 2 + q**2, (p - 1) ** 2 + (q - 1) ** 2], axis=1)[:, : len(names)]
    for row in found[list(names)].to_numpy():
        assert not np.logical_and((others < row - 1e-3).any(axis=1), (others <= row + 1e-6).all(axis=1)).any()
    assert len(found) >= 6
    assert found["a"].iloc[0] == pytest.approx(0.0, abs=1e-6)
    assert found["b"].iloc[0] == pytest.approx(1.0 if names == "ab" else 1.25, abs=1e-3)


def test_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(pt.ParameterError, match="at least two results"):
        pt.pareto_front(CIRCLES, {"a": "a"}, BOX, stop=1.0)
    with pytest.raises(pt.ParameterError, match="bounds: x: the range 1 to 0 is empty"):
        pt.pareto_front(CIRCLES, {"a": "a", "b": "b"}, {"x": (1.0, 0.0)}, stop=1.0)
    with pytest.raises(pt.ParameterError, match="must be one of gradient, nsga2"):
        pt.pareto_front(CIRCLES, {"a": "a", "b": "b"}, BOX, method="sum", stop=1.0)  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "pymoo.optimize", None)
    with pytest.raises(pt.PowertrainError, match=r"pip install 'powertrain\[uncertainty\]'"):
        pt.pareto_front(CIRCLES, {"a": "a", "b": "b"}, BOX, method="nsga2", stop=1.0)


def test_points_that_differ_by_round_off_do_not_dominate_each_other() -> None:
    """Of two such points one is left; of two with one result in common, the better one."""
    assert len(_undominated(np.array([[0.0, 1.0], [1e-9, 1.0 - 1e-9], [1.0, 0.0]]))) == 2
    assert _undominated(np.array([[0.0, 1.0], [0.0, 0.5], [1.0, 0.0]])) == [1, 2]
