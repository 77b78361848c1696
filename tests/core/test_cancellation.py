"""The size of the terms of an expression, against numbers."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.compiler.cancellation import terms


@pytest.mark.parametrize("seed", range(20))
def test_sum_of_products(seed: int) -> None:
    """sum of |c_i x_i y_i/z_i|, whatever cancels."""
    rng = np.random.default_rng(seed)
    c, x, y, z = rng.normal(size=(4, 5))
    names = ca.SX.sym("s", 15)
    expression = ca.SX(0)
    for i in range(5):
        expression += float(c[i]) * names[i] * names[5 + i] / names[10 + i]
    value = ca.Function("f", [names], [terms(expression)])(np.concatenate([x, y, z]))
    assert float(value) == pytest.approx(np.abs(c * x * y / z).sum(), rel=1e-12)


def test_cancelled() -> None:
    x = ca.SX.sym("x")
    expression = (1 + 1.7) * x - 1.7 * x - x
    value, size = (float(v) for v in ca.Function("f", [x], [expression, terms(expression)])(3.0))
    assert abs(value) <= 1e-15 * size
    assert size == pytest.approx(2 * 2.7 * 3)


def test_functions_count_by_their_value() -> None:
    x = ca.SX.sym("x")
    size = terms(ca.if_else(x > 0, ca.sqrt(x) - 2, -(x**2)))
    f = ca.Function("f", [x], [size])
    assert float(f(4.0)) == pytest.approx(4.0)
    assert float(f(-3.0)) == pytest.approx(9.0)


def test_a_called_function_is_one_term_among_others() -> None:
    """As the map of a road beside a mobility that cancels."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    called = ca.Function("called", [x], [x - 2], {"never_inline": True})
    cancelled = x * called.call([y], False, True)[0] + (1 + 1.7) * x - 1.7 * x - x
    value, size = (float(v) for v in ca.Function("f", [x, y], [cancelled, terms(cancelled)])(3.0, 2.0))
    assert abs(value) <= 1e-15 * size
    assert size == pytest.approx(2 * 2.7 * 3)


@pytest.mark.parametrize(("expression", "expected"), [
    (lambda x, y: 2 * x - y, 2 * 3 + 2),
    (lambda x, y: x + x, 6),
    (lambda x, y: -(x + y), 3 + 2),
    (lambda x, y: ca.fabs(x + y) * (y + x), (3 + 2) ** 2),
    (lambda x, y: (x + y) ** 2, (3 + 2) ** 2),
    (lambda x, y: (x + y) / (x - y), (3 + 2) / abs(3 + 2)),
    (lambda x, y: (x + 2 * y) / (1 - x), (3 + 4) / 2),
    (lambda x, y: ca.if_else(x > y, x + y, x - 7), 3 + 2),
    (lambda x, y: ca.if_else(x < y, x + y, x - 7), 3 + 7),
    (lambda x, y: ca.sqrt(x - y) - 4, np.sqrt(5) + 4),
    (lambda x, y: ca.SX(0) * x, 0),
])  # fmt: skip
def test_every_operation(expression: Any, expected: float) -> None:
    """At x = 3, y = -2, whose size is 2."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    size = ca.Function("f", [x, y], [terms(expression(x, y))])
    assert float(size(3.0, -2.0)) == pytest.approx(expected, rel=1e-14)
