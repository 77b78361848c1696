"""The when: everything that follows from its record, ``When``. Its resets are in ``powertrain.modes.discontinuities``.

The mode holds whether the condition g was positive; when g becomes positive, the resets are applied and the mode is set.
"""

from __future__ import annotations

import casadi as ca

from powertrain.dae.hybrid import HybridDae, When
from powertrain.dae.switch import condition_margin, in_time, now
from powertrain.dae.tolerances import EPS


def watched(dae: HybridDae, law: When) -> list[tuple[ca.SX, ca.SX | float]]:
    """What falls through zero when the condition changes, with its uncertainty; nothing if the instant or comparisons tell it."""
    if law.time is not None or law.relations:
        return []
    return [(_margin(dae, law, law.g, EPS), EPS)]


def rises(dae: HybridDae, law: When, fires: ca.SX | None) -> ca.SX:
    """Whether the condition has become positive; ``fires``: whether the instant of the law is now, if that is known."""
    positive = _condition(dae, law) >= EPS
    positive = positive if fires is None else ca.logic_or(positive, fires)
    return ca.logic_and(dae.m[law.index] < 0.5, positive)


def next_mode(dae: HybridDae, law: When) -> ca.SX:
    """The mode falls with the condition; what rises is set by ``discontinuities``."""
    old, known = dae.m[law.index], EPS if law.time is None else EPS + now(dae)
    return ca.if_else(_margin(dae, law, _condition(dae, law), known) <= 0, 0.0, old)


def _margin(dae: HybridDae, law: When, g: ca.SX, known: ca.SX | float) -> ca.SX:
    return condition_margin(dae.m[law.index], g, known, _has_ended(dae, law.g))


def _has_ended(dae: HybridDae, g: ca.SX) -> ca.SX:
    """Whether a condition is zero and depends on nothing, as a limited signal at its limit.

    One that a reset has put there depends on states, and goes on from there.
    """
    slopes = ca.jacobian(g, ca.vertcat(dae.t, dae.x, dae.z))
    return ca.logic_and(g == 0, ca.logic_not(ca.norm_inf(slopes)))


def _condition(dae: HybridDae, law: When) -> ca.SX:
    """The condition; if its instant is known, as a time."""
    return law.g if law.time is None else in_time(dae, law.g)
