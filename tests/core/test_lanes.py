"""Tapes that call functions, as interpolated maps do, at many points together."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.numerics.batch import TOGETHER, Columns, Common, Lanes, Tape
from powertrain.numerics.many import Many
from powertrain.steadystate.known_modes import all_hold


@pytest.mark.parametrize("seed", range(5))
def test_calls_are_followed_through_a_tape(seed: int) -> None:
    """Several functions, one of them of several inputs and outputs, one called twice, one inside another's argument."""
    rng = np.random.default_rng(seed)
    grid = [np.linspace(-3, 3, 5), np.linspace(-3, 3, 4)]
    table = ca.interpolant("table", "linear", grid, rng.normal(size=20), {"inline": False})
    curve = ca.interpolant("curve", "linear", [grid[0]], rng.normal(size=5), {"inline": False})
    u, v = ca.SX.sym("u", 2), ca.SX.sym("v")
    pair = ca.Function("pair", [u, v], [u * v, ca.sin(u[0]) + v], {"never_inline": True})
    x, y, c = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("c", 2)
    first, second = pair(ca.vertcat(x, c[0]), y)
    inner = curve(ca.fmin(ca.fmax(x * c[1], -3), 3))
    outputs = [
        table(ca.vertcat(x, y)) * 2 + first[1],
        table(ca.vertcat(ca.tanh(inner), x)) - second * curve(y),
        ca.SX(1.5),
        x + inner,
    ]
    tape = Tape("test", [x, y], c, outputs, 16)
    common, rows = rng.normal(size=2), rng.uniform(-2, 2, (2, 50))
    tape.set_common(common)
    plain = ca.Function("plain", [x, y, c], [ca.vertcat(*outputs)])
    exact = np.array([np.array(plain(*row, common)).ravel() for row in rows.T]).T
    np.testing.assert_allclose(tape(rows), exact, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("count", [0, 1, TOGETHER - 1, TOGETHER, 2 * TOGETHER + 3])
@pytest.mark.parametrize("made", [Lanes, Many])
def test_many_points_are_those_of_one(count: int, made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Columns of no, one and several entries that differ from point to point, and one that does not; nothing is left of other points."""
    monkeypatch.setattr("powertrain.numerics.many._MANY", 2 * TOGETHER)
    rng = np.random.default_rng(count)
    t, x, none, p = (ca.SX.sym(name, size) for name, size in (("t", 1), ("x", 3), ("none", 0), ("p", 2)))
    outputs = ca.vertcat(t * x[0], 7.0, t * x[2], ca.sin(x[0]) + p[1], p[0])
    lanes, plain = made([t, x, none, p], outputs), ca.Function("plain", [t, x, p], [outputs])
    for _ in range(2):
        times, points, common = rng.normal(size=count), rng.normal(size=(count, 3)), rng.normal(size=2)
        found = lanes([times, points, np.zeros((count, 0))], common)
        exact = np.array([np.array(plain(a, b, common)).ravel() for a, b in zip(times, points, strict=True)])
        np.testing.assert_allclose(found, exact.reshape(count, 5), rtol=1e-14)


def test_arrays_that_were_given_may_change_later() -> None:
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    common, values = Common(p), np.array([2.0])
    columns = Columns("test", [x], common, [x * p])
    common.set(values)
    values[0] = 5.0
    np.testing.assert_array_equal(columns(np.array([[1.0, 3.0]])), [[2.0, 6.0]])


def test_margins_hold_down_to_zero() -> None:
    for margins, holds in (([], 1), ([0.0, 2.0], 1), ([1.0, -1e-300], 0), ([np.nan, 1.0], 0)):
        assert float(all_hold([ca.SX(margin) for margin in margins])) == holds


def test_what_is_common_may_change_between_calls() -> None:
    """Of tapes for few and for many points alike, and of one that is made later; columns that nothing depends on are left out."""
    x, y, p = (ca.SX.sym(name) for name in "xyp")
    common = Common(p)
    columns, others = Columns("test", [x, y], common, [x * p, p + 1]), Columns("test", [x], common, [x - p])
    few, many = np.arange(6.0).reshape(2, 3), np.linspace(0, 1, 1200).reshape(2, 600)
    assert columns.needed.tolist() == [0]
    for value, rows in ((2.0, [few]), (3.0, [few, many]), (-5.0, [many, few])):
        common.set(np.array([value]))
        for each in rows:
            np.testing.assert_allclose(columns(each), [each[0] * value, np.full(each.shape[1], value + 1)])
            np.testing.assert_allclose(others(each[:1]), [each[0] - value])
