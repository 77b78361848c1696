"""Functions with numbers in the places of some entries of their inputs."""

from __future__ import annotations

from typing import Any, Literal

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.numerics.folding import folded

BINARY = [ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_FMIN, ca.OP_FMAX, ca.OP_LE, ca.OP_IF_ELSE_ZERO]
UNARY = [ca.OP_NEG, ca.OP_FABS, ca.OP_NOT, ca.OP_SIN]


def random_function(rng: Any, length: int = 200) -> tuple[ca.Function, ca.Function]:
    """Of five numbers and four modes; and all that it computes on the way."""
    x, m = ca.SX.sym("x", 5), ca.SX.sym("m", 4)
    known = [*ca.vertsplit(x), *ca.vertsplit(m), ca.SX(0.3), ca.SX(2.0), ca.SX(-1.0)]
    for _ in range(length):
        a, b = (known[i] for i in rng.integers(len(known), size=2))
        kind = rng.random()
        if kind < 0.2:
            known.append(ca.SX.unary(int(rng.choice(UNARY)), a))
        elif kind < 0.3:
            known.append(a / (1.0 + ca.fabs(b)))
        else:
            known.append(ca.SX.binary(int(rng.choice(BINARY)), a, b))
    outputs = [ca.horzcat(ca.vertcat(*known[-6:-3]), ca.vertcat(*known[-3:])), known[-7]]
    return ca.Function("random", [x, m], outputs), ca.Function("steps", [x, m], [ca.vertcat(*known)])


@pytest.mark.parametrize("seed", range(20))
def test_results_are_the_same_to_the_last_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (whole, on_the_way), compared = random_function(rng), 0
    for _ in range(10):
        modes = rng.choice([0.0, 1.0, -1.0, 2.0], 4)
        part = folded(whole, {(1, k): float(mode) for k, mode in enumerate(modes)})
        assert (
            part.n_instructions() <= 1.1 * whole.n_instructions() + 3
        )  # what is hidden from simplification counts twice
        assert part.size_out(0) == (3, 2)
        for _ in range(20):
            x = rng.normal(size=5)
            if not np.isfinite(np.array(on_the_way(x, modes))).all():  # zero times infinity is zero here
                continue
            compared += 1
            for one, other in zip(whole(x, modes), part(x, np.full(4, 7.0)), strict=True):
                np.testing.assert_array_equal(np.array(one), np.array(other))
    assert compared >= 100


def test_sums_are_not_cancelled() -> None:
    """(1e16 m + x) - 1e16 is 0 for x = 0.3, whatever simplification would make of it."""
    x, m, a = (ca.SX.sym(name) for name in "xma")
    part = folded(ca.Function("sum", [x, m, a], [(m * a + x) - a]), {(1, 0): 1.0})
    assert float(part(0.3, 0.0, 1e16)) == 0.0


def test_what_a_number_decides_falls_away() -> None:
    x, m = ca.SX.sym("x"), ca.SX.sym("m")
    whole = ca.Function("branches", [x, m], [ca.if_else(m == 0, ca.sin(x), ca.cos(ca.exp(x))) + (m - 1) * ca.tan(x)])
    part = folded(whole, {(1, 0): 1.0})
    codes = [part.instruction_id(k) for k in range(part.n_instructions())]
    assert codes == [ca.OP_INPUT, ca.OP_EXP, ca.OP_COS, ca.OP_OUTPUT]


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_tables_are_looked_up_as_before(method: Literal["linear", "smooth"]) -> None:
    """With their slopes by forward and by reverse differentiation."""
    axes = [pt.Axis(name, "1", np.linspace(0, 1, 30)) for name in "ab"]
    table = pt.Map(axes, np.arange(900.0).reshape(30, 30), "1", method=method)
    x, m = ca.SX.sym("x", 2), ca.SX.sym("m")
    value = ca.SX(table._interpolant(x))
    slopes = [ca.gradient(value, x), ca.jtimes(value, x, ca.DM([1.0, 2.0]))]
    whole = ca.Function("table", [x, m], [m * value, *slopes])
    part = folded(whole, {(1, 0): 1.0})
    for one, other in zip(whole([0.31, 0.77], 1.0), part([0.31, 0.77], 0.0), strict=True):
        np.testing.assert_array_equal(np.array(one), np.array(other))
