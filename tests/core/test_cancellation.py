"""The size of the terms of an expression, against numbers."""

from __future__ import annotations

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
