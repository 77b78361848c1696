"""Whether a start is unique: variables that do not start at zero, although nobody asked for another value, because others do.

Every variable starts at zero unless a start is given or declared. Where equations forbid that for all of them, some keep their zeros, and
the others follow. If one that follows depends on one that is kept, it might as well be the other way round: with an engine that starts at
100 rad/s and a differential, one wheel stands and the other turns at 200 rad/s. Where a driveline is turned as a whole, that changes
nothing of its motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from powertrain.initialization.conditions import DECLARED, StartEquation
from powertrain.language.reals import Array
from powertrain.language.units import with_unit

Changes = Callable[[Array], tuple[Array, Array]]
"""How the variables that follow and the rates of all states change with the starts that are kept: one column per set of changes."""
_SHOWN = 3
_SLIGHT = 1e-9
"""Change per unit of a start below which it is round-off."""


def is_default(condition: StartEquation) -> bool:
    """Whether it is the zero of a variable without a start."""
    return condition.source == DECLARED and condition.value == 0.0


def not_unique(
    following: Sequence[StartEquation], values: Sequence[float], kept: Sequence[StartEquation], changes: Changes
) -> str:
    """A note on variables with these values that follow from zeros that are ``kept``; '' if none depends on them."""
    moved, _ = changes(np.linspace(1.0, 2.0, len(kept))[:, None])  # equal changes might cancel
    if not (np.abs(moved) > _SLIGHT).any():
        return ""
    each, rates = (np.abs(change) > _SLIGHT for change in changes(np.eye(len(kept))))
    decides = each.any(axis=0) & rates.any(axis=0)
    found = [
        f"{following[i].label} = {with_unit(f'{values[i]:.6g}', following[i].unit)}"
        for i in np.flatnonzero(each @ decides).tolist()
    ]
    rivals = [kept[i].label for i in np.flatnonzero(decides).tolist()]
    if not found:
        return ""
    return (
        f"the start is not unique: {listed(found)} only because {listed(rivals)} {'starts' if len(rivals) == 1 else 'start'} at 0 "
        "by default; give one of them in starts"
    )


def listed(names: Sequence[str]) -> str:
    """Names for a sentence, the first few of many."""
    *first, last = [*names[:_SHOWN], f"{len(names) - _SHOWN} more"] if len(names) > _SHOWN else names
    return f"{', '.join(first)} and {last}" if first else last
