"""Sobol' and Morris indices against Ishigami's function and a product, whose indices are known; gradients beside them."""

from __future__ import annotations

import math
import sys

import casadi as ca
import numpy as np
import pytest
from scipy import stats

import powertrain as pt


class Ishigami(pt.Component):
    """sin x + 7 sin^2 y + 0.1 z^4 sin x, as the slope of an integral."""

    x: pt.Parameter = pt.parameter("1", "First", default=0.0)
    y: pt.Parameter = pt.parameter("1", "Second", default=0.0)
    z: pt.Parameter = pt.parameter("1", "Third", default=0.0)
    idle: pt.Parameter = pt.parameter("1", "Without effect", default=1.0)
    f: pt.Variable = pt.variable("1", "Value", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.f) == ca.sin(self.x) + 7 * ca.sin(self.y) ** 2 + 0.1 * self.z**4 * ca.sin(self.x)


PLANT = pt.compile(Ishigami())
CUBE = dict.fromkeys("xyz", (-math.pi, math.pi))


def test_sobol_indices_of_ishigami() -> None:
    """I. M. Sobol', Y. L. Levitan, Computer Physics Communications 117 (1999) 52-61: first and total indices in closed form."""
    found = pt.sensitivity_indices(PLANT, {"f": "f"}, {**CUBE, "idle": (0, 1)}, 256, stop=1.0)
    a, b = 7.0, 0.1
    both = b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    parts = [0.5 * (1 + b * math.pi**4 / 5) ** 2, a**2 / 8, 0.0, 0.0]
    total = sum(parts) + both
    first = np.array(parts) / total
    exact = {"first": first, "total": first + np.array([both, 0, both, 0]) / total}
    for name, wanted in exact.items():
        here, error = found[name].sel(result="f").values, found[f"{name}_error"].sel(result="f").values
        assert (np.abs(here - wanted) <= 1.5 * error).all()
        assert error.max() < 0.25
    assert float(found["total"].sel(parameter="idle").item()) == 0.0
    assert found.attrs["runs"] == 256 * 6
    # at the medians only x has a slope
    np.testing.assert_allclose(found["linear"].sel(result="f"), [1.0, 0.0, 0.0, 0.0], atol=1e-12)


def test_parameters_that_do_not_scatter_keep_their_values() -> None:
    """With x = pi/2 for all runs, f = 1 + 7 sin^2 y + 0.1 z^4: the variances are 7^2/8 and 0.1^2 pi^8 (1/9 - 1/25)."""
    square = {"y": CUBE["y"], "z": CUBE["z"]}
    found = pt.sensitivity_indices(PLANT, {"f": "f"}, square, 256, stop=1.0, parameters={"x": math.pi / 2})
    parts = np.array([7**2 / 8, 0.1**2 * math.pi**8 * (1 / 9 - 1 / 25)])
    np.testing.assert_allclose(found["first"].sel(result="f"), parts / parts.sum(), atol=0.05)


class Sum(pt.Component):
    """3 a - 2 b + c."""

    a: pt.Parameter = pt.parameter("1", "First", default=0.0)
    b: pt.Parameter = pt.parameter("1", "Second", default=0.0)
    c: pt.Parameter = pt.parameter("1", "Third", default=0.0)
    f: pt.Variable = pt.variable("1", "Value", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.f) == 3 * self.a - 2 * self.b + self.c


SUM = pt.compile(Sum())


def test_linear_results() -> None:
    """For sums all methods agree: shares 9 s_a^2 : 4 s_b^2 : s_c^2, elementary effects slope times range, without scatter."""
    spread = {"a": (0.0, 1.0), "b": stats.norm(0.0, 0.5), "c": stats.uniform(-1.0, 2.0)}
    variances = np.array([9 / 12, 4 * 0.25, 4 / 12])
    found = pt.sensitivity_indices(SUM, {"f": "f", "still": pt.integral("c")}, spread, 128, stop=1.0)
    np.testing.assert_allclose(found["linear"].sel(result="f"), variances / variances.sum(), rtol=1e-12)
    np.testing.assert_allclose(found["first"].sel(result="f"), variances / variances.sum(), atol=0.05)
    np.testing.assert_allclose(found["first"].sel(result="still"), [0.0, 0.0, 1.0], atol=0.02)
    screened = pt.sensitivity_indices(
        SUM, {"f": "f"}, {"a": (0.0, 1.0), "b": (0.0, 0.5), "c": (-1.0, 1.0)}, 4, method="morris", stop=1.0
    )
    np.testing.assert_allclose(screened["mean"].sel(result="f"), [3.0, -1.0, 2.0], rtol=1e-9)
    np.testing.assert_allclose(screened["magnitude"].sel(result="f"), [3.0, 1.0, 2.0], rtol=1e-9)
    assert float(abs(screened["scatter"]).max()) < 1e-9
    assert screened.attrs["runs"] == 4 * 4


def test_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(pt.ParameterError, match="power of two, which Sobol' points need; take 128"):
        pt.sensitivity_indices(SUM, {"f": "f"}, {"a": (0, 1)}, 100, stop=1.0)
    with pytest.raises(pt.ParameterError, match="b gives values that are not finite"):
        pt.sensitivity_indices(SUM, {"f": "f"}, {"a": (0, 1), "b": stats.norm()}, 4, method="morris", stop=1.0)
    with pytest.raises(pt.ParameterError, match="at least one result"):
        pt.sensitivity_indices(SUM, {}, {"a": (0, 1)}, 4, stop=1.0)
    monkeypatch.setitem(sys.modules, "SALib.sample.sobol", None)
    with pytest.raises(pt.PowertrainError, match=r"pip install 'powertrain\[uncertainty\]'"):
        pt.sensitivity_indices(SUM, {"f": "f"}, {"a": (0, 1)}, 4, stop=1.0)
