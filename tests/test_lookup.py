"""Tables looked up at columns of points against CasADi's interpolants, one point after the other."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.numerics.batch import Tape

COUNT = 40


def table(axes: int, even: bool, rng: np.random.Generator) -> pt.Map:
    shape = [40 if axes == 1 else int(n) for n in rng.integers(2, 6, axes)]
    points = [np.linspace(-1.0, 2.0, n) if even else np.cumsum(rng.uniform(0.1, 1.0, n)) - 1.0 for n in shape]
    return pt.Map([pt.Axis(f"x{k}", "1", p, "linear") for k, p in enumerate(points)], rng.normal(size=shape), "1")


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("axes", [1, 2, 3])
def test_values_and_slopes(axes: int, even: bool) -> None:
    """Inside, outside and on the points; the slopes by differences as well, and the slope in one direction."""
    rng = np.random.default_rng(axes)
    tabulated = table(axes, even, rng)
    x = [ca.SX.sym(f"x{k}") for k in range(axes)]
    value = tabulated(*x)
    along = ca.jtimes(value, ca.vertcat(*x), ca.vertcat(*x[::-1]))
    outputs = [value, *ca.vertsplit(ca.gradient(3.0 * value, ca.vertcat(*x))), along]
    tape: Any = Tape("table", x, ca.SX(0, 1), outputs, COUNT)
    at = rng.uniform(-2.0, 3.0, (axes, COUNT))
    at[:, :3] = [(axis.points[0], axis.points[-1], axis.points[1]) for axis in tabulated.axes]
    found = tape(at)
    one = ca.Function("one", x, outputs)
    assert ca.OP_LOW in {tape.function.instruction_id(k) for k in range(tape.function.n_instructions())}
    for k, point in enumerate(at.T):
        assert found[:, k] == pytest.approx(np.array(one(*point)).ravel(), rel=1e-12, abs=1e-12)
    step = 1e-6
    for k in range(axes):
        ahead = at.copy()
        ahead[k] += step
        slope = 3.0 * (tape(ahead)[0] - found[0]) / step
        assert np.median(np.abs(slope - found[1 + k])) < 1e-6


def test_each_table_is_itself() -> None:
    """Tables of one grid at one place, and one table at two places."""
    rng, x = np.random.default_rng(1), ca.SX.sym("x", 2)
    axes = [pt.Axis("a", "1", [0, 1, 3]), pt.Axis("b", "1", [0, 2])]
    one, other = (pt.Map(axes, rng.normal(size=(3, 2)), "1") for _ in range(2))
    a, b = 1.5 * x[0], x[0] * x[1] / 2
    outputs = [one(x[0], x[1]), other(x[0], x[1]), one(x[1], x[0]), one(a, b), other(a, b)]
    at = rng.uniform(0.0, 2.0, (2, 7))
    found = Tape("tables", ca.vertsplit(x), ca.SX(0, 1), outputs, 7)(at)
    values, c, d = (one(*at), other(*at)), 1.5 * at[0], at[0] * at[1] / 2
    assert found == pytest.approx(np.array([*values, one(at[1], at[0]), one(c, d), other(c, d)]), rel=1e-12)


def test_no_number_stays_none() -> None:
    x = ca.SX.sym("x", 2)
    tabulated = table(2, False, np.random.default_rng(1))
    found = Tape("table", ca.vertsplit(x), ca.SX(0, 1), [tabulated(x[0], x[1])], 2)(
        np.array([[np.nan, 1.0], [1.0, 1.0]])
    )
    assert np.isnan(found[0]).tolist() == [True, False]
