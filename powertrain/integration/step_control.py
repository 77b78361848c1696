"""The verdict on a step: whether its error is small enough, whether its indicators are resolved, and the next step size."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.integration.samples import ROUGH, least, survey

ALGEBRAIC = 10.0
"""Factor on the tolerance for algebraic unknowns: their error is not passed on, because the states determine the next value."""
GROWTH = 5.0
"""Largest ratio of a step to the one before."""
_NO_ERROR = 1e-10
"""Lower bound of the error norm in the step size."""
_CALM, _MOST_CHANGE = 0.003, 0.3
"""Relative third difference above which it limits the next step, and the value aimed at."""


def allowances(states: int, algebraic: int) -> NDArray[np.float64]:
    """The allowed error of each unknown in one step, as a factor on the tolerance."""
    return np.array([1.0] * states + [ALGEBRAIC] * algebraic)


def verdict(norm: ca.SX, before: ca.SX, stiffness: ca.SX, samples: Sequence[ca.SX], noise: ca.SX) -> ca.SX:
    """Error norm, 1 if indicators are not resolved, growth of the step size, least indicator, stiffness, minimum of each sample.

    ``before`` is the error norm of the last step, ``samples`` the indicators at 1/4, 1/2, 3/4 and 1 of the step,
    ``noise`` their round-off.
    """
    minima = [least(sample) for sample in samples]
    smallest = least(ca.vertcat(*minima))
    dips, rough = survey(samples, noise)
    unresolved = ca.logic_or(rough > ROUGH, dips)
    return ca.vertcat(norm, unresolved, growth(norm, before, rough), smallest, stiffness, *minima)


def growth(norm: ca.SX, before: ca.SX, rough: ca.SX) -> ca.SX:
    """Ratio of the next step size to this one: a PI controller on the error norm, limited if indicators are barely resolved.

    If the error is far below the tolerance, as after an event, caution gains nothing: the step grows at once to the size for 0.6**5.
    """
    error = ca.fmax(norm, _NO_ERROR)
    factor = ca.fmax(0.9 * error**-0.14 * before**0.08, 0.6 * error**-0.2)
    bounded = ca.logic_and(rough > _CALM, rough <= ROUGH)
    factor = ca.fmin(factor, ca.if_else(bounded, (_MOST_CHANGE / ca.fmax(rough, _CALM)) ** (1 / 3), GROWTH))
    return ca.fmin(ca.fmax(factor, 0.2), GROWTH)
