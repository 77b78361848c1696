"""The when: everything that follows from its record, ``When``. Its resets are in ``powertrain.modes.discontinuities``.

The mode holds whether the condition g was positive; when g becomes positive, the resets are applied and the mode is set.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.dae.hybrid import HybridDae, When
from powertrain.dae.switch import condition_margin, in_time, now
from powertrain.dae.tolerances import EPS
from powertrain.language.symbols import column


def watched(dae: HybridDae, law: When) -> list[tuple[ca.SX, ca.SX | float]]:
    """What falls through zero when the condition changes, with its uncertainty; nothing if the instant or comparisons tell it."""
    if law.time is not None or law.relations:
        return []
    return [(condition_margin(dae.m[law.index], law.g), EPS)]


def conditions(dae: HybridDae, held: Sequence[ca.SX]) -> list[ca.SX]:
    """The conditions of all whens for the new modes of the comparisons in them; those with a known instant as times."""
    relations = [r.index for r in dae.relations]
    old, new = (column([values[i] for i in relations]) for values in (ca.vertsplit(dae.m), held))
    found = ca.substitute([w.g for w in dae.whens], [old], [new])
    return [g if w.time is None else in_time(dae, g) for w, g in zip(dae.whens, found, strict=True)]


def rises(dae: HybridDae, law: When, g: ca.SX, fires: ca.SX | None) -> ca.SX:
    """Whether the condition ``g`` has become positive; ``fires``: whether the instant of the law is now, if that is known."""
    positive = g >= EPS if fires is None else ca.logic_or(g >= EPS, fires)
    return ca.logic_and(dae.m[law.index] < 0.5, positive)


def next_mode(dae: HybridDae, law: When, g: ca.SX) -> ca.SX:
    """The mode falls with the condition; what rises is set by ``discontinuities``."""
    old, known = dae.m[law.index], EPS if law.time is None else EPS + now(dae)
    return ca.if_else(condition_margin(old, g, known) <= 0, 0.0, old)
