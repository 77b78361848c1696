"""What a step tells the loop, and how the next step size follows."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.integration.samples import ROUGH, least
from powertrain.integration.step_control import GROWTH, growth, reduction, verdict

Matrix = np.ndarray[Any, Any]


def factor(norm: float, rough: float = 0.0) -> float:
    return float(growth(ca.SX(norm), ca.SX(rough)))


def info(norm: float, samples: Matrix, stiffness: float = 2.0) -> Matrix:
    """``samples``: a row for each indicator, from the start of the step to its end."""
    columns = [ca.SX(column) for column in samples.T]
    return np.array(ca.DM(verdict(ca.SX(norm), ca.SX(stiffness), columns, ca.SX.zeros(len(samples))))).ravel()


def test_the_next_step_has_an_error_just_below_the_tolerance() -> None:
    """An error c h^5 becomes 0.9^5 of what is allowed."""
    for norm in (0.9, 0.5, 0.2, 0.01, 3e-4):
        assert norm * factor(norm) ** 5 == pytest.approx(0.9**5, rel=1e-12)


def test_steps_grow_and_shrink_by_five_at_most() -> None:
    assert factor(0.0) == GROWTH == 5.0
    assert factor(1e-12) == 5.0
    assert factor(1e9) == pytest.approx(0.2)
    assert factor(np.inf) == pytest.approx(0.2)
    assert reduction(0.1, 1e9, None) == pytest.approx(0.2)
    assert reduction(0.1, np.inf, None) == reduction(0.1, np.nan, (0.2, 3.0)) == 0.1


@pytest.mark.parametrize("order", [0.5, 1.0, 3.0, 5.0])
def test_rejected_steps_show_the_order_of_the_error(order: float) -> None:
    """Of an error c h^k, the third attempt has 0.9^k of what is allowed, however small k is; the second assumes five."""

    def error(h: float) -> float:
        return float(1.5 * (h / 0.1) ** order)

    second = 0.1 * reduction(0.1, error(0.1), None)
    assert second == pytest.approx(0.1 * 0.9 * 1.5**-0.2, rel=1e-12)
    third = second * reduction(second, error(second), (0.1, error(0.1)))
    assert error(third) == pytest.approx(0.9**order, rel=1e-9)


def test_errors_that_do_not_fall() -> None:
    """The order counts as a tenth, and as five where errors fall faster or the one before was not finite."""
    assert reduction(0.08, 1.05, (0.1, 1.0)) == pytest.approx(0.9 * 1.05**-10)
    assert reduction(0.08, 1.5, (0.1, 1.5)) == pytest.approx(0.2)
    assert reduction(0.09, 2.0, (0.1, 1e6)) == reduction(0.09, 2.0, (0.1, np.nan)) == reduction(0.09, 2.0, None)


def test_indicators_that_are_barely_resolved_hold_the_step_back() -> None:
    """A third difference goes with the cube of the step: aimed at 0.3, from 0.3 % on, up to where it is refused."""
    for rough in (0.02, 0.1, 0.3, 0.39):
        assert factor(1e-12, rough) == pytest.approx(min(5.0, (0.3 / rough) ** (1 / 3)), rel=1e-12)
    assert factor(1e-12, 0.002) == 5.0
    assert factor(1e-12, 1.01 * ROUGH) == 5.0  # such a step is not taken at all
    assert factor(3.0, 0.02) == pytest.approx(factor(3.0))


def test_entries() -> None:
    """Norm, unresolved, growth, least indicator, stiffness, the minimum of each sample; the start of the step is none of them."""
    samples = np.array([[5.0, 4.0, 3.0, 2.0, 1.0], [1.5, 2.0, 2.5, 3.0, 3.5]])
    found = info(0.3, samples)
    np.testing.assert_allclose(found, [0.3, 0.0, factor(0.3), 1.0, 2.0, 2.0, 2.5, 2.0, 1.0], rtol=1e-12)


@pytest.mark.parametrize(("samples", "unresolved"), [
    ([[1.0, 1.0, 1.0, 1.0, 1.0]], False),
    ([[0.28, 0.1, 0.01, 0.01, 0.1]], True),  # least value of the parabola: 0.01 - 0.045^2/0.18
    ([[0.26, 0.1, 0.02, 0.02, 0.1]], False),
    ([[0.1, 0.01, 0.01, 0.1, 0.28]], True),  # between the start and the middle
    ([[0.28, 0.1, 0.01, 0.01, 0.1], [1.2, 1.0, 0.5, -0.1, -0.5]], True),  # before the event of another indicator
    ([[0.89, 0.4, 0.1, -0.01, 0.02]], False),  # its own fall is located
    ([[-1.0, 1.0, -1.0, 1.0, -1.0]], True),  # not resolved at all, event or not
    ([[5.0, 5.0, 5.0, 5.0, 5.0], [2.4, 1.0, 0.3, 0.3, 1.0]], False),
])  # fmt: skip
def test_what_is_not_resolved(samples: list[list[float]], unresolved: bool) -> None:
    assert bool(info(1e-3, np.array(samples))[1]) == unresolved


def test_models_without_indicators() -> None:
    found = info(0.3, np.zeros((0, 5)))
    np.testing.assert_allclose(found[[1, 3, 5, 6, 7, 8]], [0, 1, 1, 1, 1, 1])
    assert float(least(ca.SX(0, 1))) == 1.0
    assert float(least(ca.SX([3.0, -2.0, 5.0]))) == -2.0
