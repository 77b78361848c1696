"""What a step tells the loop, and how the next step size follows."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.integration.samples import ROUGH, least
from powertrain.integration.step_control import GROWTH, growth, verdict

Matrix = np.ndarray[Any, Any]


def factor(norm: float, before: float, rough: float = 0.0) -> float:
    return float(growth(ca.SX(norm), ca.SX(before), ca.SX(rough)))


def info(norm: float, samples: Matrix, before: float = 1e-4, stiffness: float = 2.0) -> Matrix:
    """``samples``: a row for each indicator."""
    columns = [ca.SX(column) for column in samples.T]
    return np.array(
        ca.DM(verdict(ca.SX(norm), ca.SX(before), ca.SX(stiffness), columns, ca.SX.zeros(len(samples))))
    ).ravel()


def test_pi_controller() -> None:
    """0.9 norm^-0.14 before^0.08, or 0.6 norm^-0.2 where that is more."""
    for norm, before in ((0.9, 0.5), (0.5, 0.9), (0.2, 0.3), (3.0, 1.0), (0.01, 1e-4), (3e-4, 1e-4)):
        expected = max(0.9 * norm**-0.14 * before**0.08, 0.6 * norm**-0.2)
        assert factor(norm, before) == pytest.approx(expected, rel=1e-12)
    assert factor(1.0, 1e-4) == pytest.approx(0.6)  # patience is worth nothing
    assert factor(0.3, 0.3) < factor(0.3, 0.6) < factor(0.15, 0.6)


def test_steps_grow_and_shrink_by_five_at_most() -> None:
    assert factor(0.0, 1.0) == GROWTH == 5.0
    assert factor(1e-12, 1e-4) == 5.0
    assert factor(1e9, 1e-4) == pytest.approx(0.2)
    assert factor(np.inf, 1e-4) == pytest.approx(0.2)


def test_indicators_that_are_barely_resolved_hold_the_step_back() -> None:
    """A third difference goes with the cube of the step: aimed at 0.3, from 0.3 % on, up to where it is refused."""
    for rough in (0.02, 0.1, 0.3, 0.39):
        assert factor(1e-12, 1.0, rough) == pytest.approx(min(5.0, (0.3 / rough) ** (1 / 3)), rel=1e-12)
    assert factor(1e-12, 1.0, 0.002) == 5.0
    assert factor(1e-12, 1.0, 1.01 * ROUGH) == 5.0  # such a step is not taken at all
    assert factor(3.0, 1.0, 0.02) == pytest.approx(factor(3.0, 1.0))


def test_entries() -> None:
    """Norm, unresolved, growth, least indicator, stiffness, the minimum of each sample."""
    samples = np.array([[4.0, 3.0, 2.0, 1.0], [2.0, 2.5, 3.0, 3.5]])
    found = info(0.3, samples, 0.4)
    np.testing.assert_allclose(found, [0.3, 0.0, factor(0.3, 0.4), 1.0, 2.0, 2.0, 2.5, 2.0, 1.0], rtol=1e-12)


@pytest.mark.parametrize(("samples", "unresolved"), [
    ([[1.0, 1.0, 1.0, 1.0]], False),
    ([[0.1, 0.01, 0.01, 0.1]], True),  # least value of the parabola: 0.01 - 0.045^2/0.18
    ([[0.1, 0.02, 0.02, 0.1]], False),
    ([[0.1, 0.01, 0.01, 0.1], [1.0, 0.5, -0.1, -0.5]], True),  # before the event of another indicator
    ([[0.4, 0.1, -0.01, 0.02]], False),  # its own fall is located
    ([[1.0, -1.0, 1.0, -1.0]], True),  # not resolved at all, event or not
    ([[5.0, 5.0, 5.0, 5.0], [1.0, 0.3, 0.3, 1.0]], False),
])  # fmt: skip
def test_what_is_not_resolved(samples: list[list[float]], unresolved: bool) -> None:
    assert bool(info(1e-3, np.array(samples))[1]) == unresolved


def test_models_without_indicators() -> None:
    found = info(0.3, np.zeros((0, 4)))
    np.testing.assert_allclose(found[[1, 3, 5, 6, 7, 8]], [0, 1, 1, 1, 1, 1])
    assert float(least(ca.SX(0, 1))) == 1.0
    assert float(least(ca.SX([3.0, -2.0, 5.0]))) == -2.0
