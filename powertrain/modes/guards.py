"""The guard of a value, ``Guard``: its margin, and the message for a value outside the range in which a model is valid."""

from __future__ import annotations

from typing import TypeAlias

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Guard, HybridDae
from powertrain.dae.tolerances import EPS, LIMIT
from powertrain.language.reals import Array
from powertrain.language.units import with_unit

Point: TypeAlias = tuple[float, Array, Array, Array, Array]
"""Time, states, algebraic unknowns, held values and parameters."""
_AT_LIMIT = 1e-6
"""A value this close to its limit, relative to 1 + |limit|, is not quoted: it would look like the limit."""


def guard_margin(guard: Guard) -> ca.SX:
    """Distance from the nearer limit, with a tolerance."""
    margins = []
    for distance, limit in ((guard.value - guard.low, guard.low), (guard.high - guard.value, guard.high)):
        size = ca.fabs(limit)
        margins.append(distance + LIMIT * (1.0 + ca.if_else(size < 1e300, size, 0.0)))
    return ca.fmin(*margins)


def watched(guard: Guard) -> list[tuple[ca.SX, ca.SX | float]]:
    """What falls through zero when the value leaves its range, if this ends the run, with its uncertainty."""
    return [(guard_margin(guard), EPS)] if guard.action == "error" else []


def first_violation(dae: HybridDae, point: Point, action: str = "error") -> str:
    """The message for the first violated guard with this ``action``; '' if there is none."""
    for guard in dae.guards:
        if guard.action == action and _evaluated(dae, point, guard)[-1] < 0.0:
            return guard_message(dae, point, guard)
    return ""


def _evaluated(dae: HybridDae, point: Point, guard: Guard) -> list[float]:
    """Its value, limits and margin."""
    function = dae.function("guard", guard.value, guard.low, guard.high, guard_margin(guard))
    return [float(v) for v in function(*point)]


def guard_message(dae: HybridDae, point: Point, guard: Guard) -> str:
    """The message for a guard whose limits are exceeded. It names the limit: at an event the value itself would look equal to it."""
    value, low, high, _ = _evaluated(dae, point, guard)
    above = high - value < value - low
    limit = high if above else low
    said = with_unit(f"{value:.9g}", guard.unit)
    if abs(value - limit) <= _AT_LIMIT * (1.0 + abs(limit)):
        said = f"it {'rises above' if above else 'falls below'} {with_unit(f'{limit:.9g}', guard.unit)}"
    span = f"{low:.9g} to {high:.9g}" if low != high else f"{low:.9g}"
    if not np.isfinite([low, high]).all():
        span = f"at least {low:.9g}" if high == np.inf else f"at most {high:.9g}"
    allowed = with_unit(span, guard.unit)
    return f"{guard.name} ({guard.where}) leaves its range at t = {point[0]:.9g} s: {said}; allowed is {allowed}"
