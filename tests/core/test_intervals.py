"""Intervals of operations contain all values that the operations have, and tell which divisors cannot vanish."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from powertrain.compiler.intervals import _RANGES, interval_of
from powertrain.compiler.operations import opened

ENDS = (-np.inf, -3.0, -1.0, -0.2, 0.0, 0.4, 1.0, 2.0, np.inf)
UNARY = {
    ca.OP_NEG, ca.OP_TWICE, ca.OP_INV, ca.OP_SQ, ca.OP_FABS, ca.OP_SQRT, ca.OP_EXP, ca.OP_COSH, ca.OP_SIN, ca.OP_COS, ca.OP_TANH,
    ca.OP_NOT,
}  # fmt: skip


@pytest.mark.parametrize("code", sorted(_RANGES))
def test_values_lie_in_the_interval(code: int) -> None:
    rng, count = np.random.default_rng(code), 1 if code in UNARY else 2
    x = [ca.SX.sym(f"x{k}") for k in range(count)]
    function = ca.Function("f", x, [ca.SX.unary(code, *x) if count == 1 else ca.SX.binary(code, *x)])
    for _ in range(60):
        inside = [tuple(sorted(rng.choice(len(ENDS), 2, replace=False))) for _ in x]
        given = [(ENDS[i], ENDS[j]) for i, j in inside]
        low, high = interval_of(code, given)
        points = [[*rng.uniform(max(a, -8.0), min(b, 8.0), 40), max(a, -8.0), min(b, 8.0)] for a, b in given]
        values = np.array(function(*(np.array(p)[None] for p in points))).ravel()
        values = values[np.isfinite(values)]  # at a pole the sign is that of the zero
        assert (values >= low - 1e-12).all()
        assert (values <= high + 1e-12).all()


def test_a_square_is_that_of_one_operand() -> None:
    assert interval_of(ca.OP_MUL, [(-2.0, 1.0)] * 2) == (-2.0, 4.0)
    assert interval_of(ca.OP_MUL, [(-2.0, 1.0)] * 2, same=True) == (0.0, 4.0)


@pytest.mark.parametrize(("divisor", "vanishes"), [
    (lambda w: 1 + ca.fabs(w), False),
    (lambda w: -1 - ca.fabs(w), False),
    (lambda w: ca.hypot(w, 2), False),
    (lambda w: 1e-15 + ca.fabs(w), True),
    (lambda w: -1e-15 - ca.fabs(w), True),
    (lambda w: 1 - ca.fabs(w), True),
])  # fmt: skip
def test_only_divisors_that_may_vanish_are_examined(divisor: object, vanishes: bool) -> None:
    w = ca.SX.sym("w")
    found, _ = opened(ca.fabs(w) / divisor(w), lambda _: True)  # type: ignore[operator]
    assert bool(found) == vanishes
