"""Choices of pivots: the row of each column, for elimination without run-time pivoting, and the columns that stand for directions."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array

CANCELLED = 1e-12
"""A difference of two numbers below this share of them is round-off, and no pivot."""
_EQUAL = 1e-6
"""Relative difference up to which columns are equally long."""
_STRUCTURAL_ZERO = 1e9
_NUMERIC_ZERO = 1e6


def difference(a: float, b: float) -> float:
    """Difference a - b, or zero if that is round-off."""
    left = a - b
    return left if abs(left) > CANCELLED * (abs(a) + abs(b)) else 0.0


def match_rows(pattern: ca.Sparsity, values: NDArray[np.float64]) -> list[int]:
    """Return ``rows``: row ``rows[j]`` is the pivot of column j, chosen to maximise the product of the pivots' sizes.

    ``values`` is the matrix at a typical point. Entries that vanish there but may not elsewhere are used only if there is no alternative.
    Raises ValueError with the unmatched columns if the matrix is structurally singular.
    """
    from scipy.optimize import linear_sum_assignment

    n = pattern.size1()
    cost = np.full((n, n), _STRUCTURAL_ZERO)
    size = np.abs(np.nan_to_num(values, nan=0.0, posinf=1e300, neginf=1e300))
    for i, j in zip(pattern.row(), pattern.get_col(), strict=True):
        cost[i, j] = -np.log(size[i, j]) if size[i, j] > 1e-300 else _NUMERIC_ZERO
    _, rows = linear_sum_assignment(cost.T)
    unmatched = [j for j in range(n) if cost[rows[j], j] >= _STRUCTURAL_ZERO]
    if unmatched:
        raise ValueError(f"structurally singular: no equation is left for the unknowns {unmatched}")
    return [int(row) for row in rows]


def leading_columns(directions: Array) -> list[int]:
    """A column for each direction, the longest left by those before, and the first of equal ones: whichever directions span the same."""
    left, places = directions.copy(), list[int]()
    for _ in directions:
        sizes = np.linalg.norm(left, axis=0)
        places.append(int(np.argmax(sizes >= (1 - _EQUAL) * sizes.max())))
        along = left[:, places[-1]] / sizes[places[-1]]
        left -= np.outer(along, along @ left)
    return places
