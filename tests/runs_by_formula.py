"""Values and derivatives of runs against formulas."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt

TIGHT: dict[str, Any] = {"rtol": 1e-11}
Formula = Callable[..., Any]


def assert_as_formula(model: Any, of: Any, formula: Formula, values: dict[str, float], **options: Any) -> None:
    """Value, gradient and second derivatives as those of a formula of the unknowns."""
    names, options = list(values), {**TIGHT, **options}
    symbols = [ca.SX.sym(name) for name in names]
    second, first = ca.hessian(formula(*symbols), ca.vertcat(*symbols))
    exact = ca.Function("exact", symbols, [formula(*symbols), first, second])
    value, slopes, bends = (np.array(v) for v in exact(*values.values()))
    found = pt.gradient(pt.compile(model).simulate(**options), of, names)
    assert found.value == pytest.approx(value.item(), rel=1e-8)
    np.testing.assert_allclose([found[n] for n in names], slopes.ravel(), atol=1e-8 * np.abs(slopes).max())
    second_found = pt.hessian(model, of, names, **options).sel(wrt=names, wrt_2=names)
    np.testing.assert_allclose(second_found, bends, atol=1e-8 * max(np.abs(bends).max(), 1.0))
