"""Linear tables by the names of the functions that look them up."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LinearTable:
    """Values over the points of one or more axes, the first axis the fastest; ``modes`` are CasADi's ways of finding the interval."""

    points: tuple[tuple[float, ...], ...]
    modes: tuple[str, ...]
    values: NDArray[np.float64]


known: WeakValueDictionary[str, LinearTable] = WeakValueDictionary()
"""The tables that are in use."""
