"""Gear ratios as users type them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from powertrain import ParameterError, parameter

RATIO = parameter("1", "Gear ratio, speed at flange_a over speed at flange_b", above=0)


def gear_ratios(where: str, given: Sequence[Any]) -> tuple[float, ...]:
    """Ratios from the arguments of ``where``: separate numbers, or one sequence of them.

    Errors: ParameterError for no ratio, and for one that is not a positive number, with its gear.
    """
    listed: Any = given
    if len(given) == 1 and isinstance(given[0], Sequence | np.ndarray) and not isinstance(given[0], str):
        listed = np.atleast_1d(given[0]) if isinstance(given[0], np.ndarray) else given[0]
    if not len(listed):
        raise ParameterError(f"{where}: give the ratio of every gear, first gear first, as in {where}(3.6, 2.1, 1.4)")
    return tuple(RATIO.check(ratio, f"{where}: ratio of gear {k}") for k, ratio in enumerate(listed, 1))
