"""The verdict on a step: whether its error is small enough, whether its indicators are resolved, and the next step size.

E. Hairer, S. P. Norsett, G. Wanner: Solving Ordinary Differential Equations I, section II.4. K. Gustafsson: Control-theoretic techniques
for stepsize selection in implicit Runge-Kutta methods, ACM Transactions on Mathematical Software 20:496 (1994).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.integration.samples import ROUGH, WITHOUT, extremes, least

ALGEBRAIC = 10.0
"""Factor on the tolerance for algebraic unknowns: their error is not passed on, because the states determine the next value."""
ORDER = 5
"""The error estimate of a step is proportional to this power of its size."""
SAFETY = 0.9
"""Share of the step size at which the error would just be allowed."""
GROWTH = 5.0
"""Largest ratio of a step to the one before, and of a rejected one to the next attempt."""
FAILED = 0.1
"""Ratio of the next attempt to a step without a finite error."""
LEAST_ORDER = 0.1
"""Lower bound of an observed order."""
FINEST = 1e-5
"""Share of the simulated span, or of the longest step, below which steps are not halved to resolve indicators."""
HALVINGS = 8
"""How often a step is halved to resolve the indicators; a remaining kink is then accepted."""
STIFF, STIFF_STEPS = 3.25, 15
"""So many steps with a stability ratio above the first call for the implicit method."""
_NO_ERROR = 1e-10
"""Lower bound of the error norm in the step size."""
_CALM, _MOST_CHANGE = 0.003, 0.3
"""Relative third difference above which it limits the next step, and the value aimed at."""


def allowances(states: int, algebraic: int) -> NDArray[np.float64]:
    """The allowed error of each unknown in one step, as a factor on the tolerance."""
    return np.array([1.0] * states + [ALGEBRAIC] * algebraic)


def verdict(norm: ca.SX, stiffness: ca.SX, samples: Sequence[ca.SX], noise: ca.SX) -> ca.SX:
    """Error norm, 1 if indicators are not resolved, growth of the step size, least indicator, stiffness, minimum of each later sample.

    ``samples`` are the indicators at 0, 1/4, 1/2, 3/4 and 1 of the step, ``noise`` is their round-off.
    """
    return verdict_of(norm, stiffness, list(map(least, extremes(samples, noise), WITHOUT)))


def verdict_of(norm: ca.SX, stiffness: ca.SX, found: Sequence[ca.SX]) -> ca.SX:
    """The ``verdict`` from the least ``extremes`` of all indicators."""
    *minima, steady, smooth = found
    unresolved = ca.logic_or(-smooth > ROUGH, -steady)
    return ca.vertcat(norm, unresolved, growth(norm, -smooth), least(ca.vertcat(*minima)), stiffness, *minima)


def growth(norm: ca.SX, rough: ca.SX) -> ca.SX:
    """Ratio of the next step size to that of an accepted step: 0.9 norm^(-1/5), less if indicators are barely resolved."""
    factor = SAFETY * ca.fmax(norm, _NO_ERROR) ** (-1 / ORDER)
    bounded = ca.logic_and(rough > _CALM, rough <= ROUGH)
    factor = ca.fmin(factor, ca.if_else(bounded, (_MOST_CHANGE / ca.fmax(rough, _CALM)) ** (1 / 3), GROWTH))
    return ca.fmin(ca.fmax(factor, 1 / GROWTH), GROWTH)


def reduction(h: float, error: float, refused: tuple[float, float] | None) -> float:
    """Ratio of the next attempt to a rejected step of size ``h``; ``refused``: size and error of the attempt rejected just before, if any.

    In transients faster than the step, errors fall more slowly than h^5. Then the order that two attempts show is used (Gustafsson).
    """
    if not error < math.inf:
        return FAILED
    order = float(ORDER)
    if refused is not None and refused[1] < math.inf:
        order = min(max(math.log(refused[1] / error) / math.log(refused[0] / h), LEAST_ORDER), order)
    return float(max(SAFETY * error ** (-1 / order), 1 / GROWTH))
