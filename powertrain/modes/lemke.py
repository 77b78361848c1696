"""Lemke's method for the linear complementarity problem. The lexicographic rule prevents cycling: it ends in a solution or on a ray.

    w = q + M z,   w >= 0,   z >= 0,   w'z = 0

The tableau has extended precision, to distinguish the effect of a tiny compliance from round-off.

R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem, SIAM 2009, algorithm 4.4.5 and section 4.9.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array

Long = NDArray[np.longdouble]

PIVOT = 1e-13
"""Entries below this share of the largest in their column are round-off."""
LARGE = 0.01
"""Among tied rows, only pivots of at least this share of the largest are considered."""
LEFT = 1e-10
"""A ray on which the artificial variable is below this is a solution: the rest, of ``q`` of the order of one, is round-off."""
_MOST = 50
"""Pivots per variable after which round-off must have made the method cycle."""


@dataclass(frozen=True)
class Solution:
    """``z`` and ``w`` solve the problem.

    Without a solution ``z`` is None, and ``ray`` lists the pairs that grow along the ray on which the method ended. For a copositive-plus
    ``M`` a ray proves that there is no solution. ``ray`` is empty if round-off ended the search.
    """

    z: Long | None
    w: Long | None
    ray: tuple[int, ...]
    pivots: int


def lemke(M: Array | Long, q: Array | Long) -> Solution:
    """Solve the problem with the matrix ``M`` (n, n) and the vector ``q`` (n), whose entries are of the order of one."""
    n = q.size
    if not (q < 0.0).any():
        return Solution(np.zeros(n, np.longdouble), q.astype(np.longdouble), (), 0)
    tableau: Long = np.hstack([np.eye(n), -M, -np.ones((n, 1)), q[:, None]]).astype(np.longdouble)
    basis, artificial = list(range(n)), 2 * n
    row = int(n - 1 - np.argmin(q[::-1]))  # among equal ones the last: its perturbation is the smallest
    leaving = _exchange(tableau, basis, row, artificial)
    for pivots in range(1, _MOST * n):
        entering = leaving + n if leaving < n else leaving - n
        column = tableau[:, entering]
        small = PIVOT * np.abs(column).max()
        rows = np.flatnonzero(column > small)
        if not rows.size:
            if tableau[basis.index(artificial), -1] <= LEFT:  # round-off broke a tie with it
                return _solution(tableau, basis, pivots)
            growing = {basis[k] % n for k in np.flatnonzero(np.abs(column) > small) if basis[k] != artificial}
            return Solution(None, None, tuple(sorted(growing | {entering % n})), pivots)
        leaving = _exchange(tableau, basis, _leaving_row(tableau, rows, entering, basis.index(artificial)), entering)
        if leaving == artificial:
            return _solution(tableau, basis, pivots + 1)
    return Solution(None, None, (), _MOST * n)


def _solution(tableau: Long, basis: list[int], pivots: int) -> Solution:
    """The solution of a basis in which the artificial variable is zero, or that it has left."""
    n = len(basis)
    values = np.zeros(2 * n + 1, np.longdouble)
    values[basis] = np.maximum(tableau[:, -1], 0)
    return Solution(values[n : 2 * n], values[:n], (), pivots)


def _leaving_row(tableau: Long, rows: NDArray[np.intp], entering: int, artificial: int) -> int:
    """The row with the least ratio; among tied rows the artificial variable's, else the lexicographically least without a small pivot.

    Only equal ratios are tied. A tolerance would spoil the lexicographic order, and the method could cycle.
    """
    column = tableau[:, entering]
    ratios = np.maximum(tableau[rows, -1], 0.0) / column[rows]
    tied = rows[ratios == ratios.min()]
    if artificial in tied:
        return artificial
    tied = tied[column[tied] >= LARGE * column[tied].max()]
    for j in range(len(tableau)):
        if tied.size == 1:
            break
        entries = tableau[tied, j] / column[tied]
        tied = tied[entries == entries.min()]
    return int(tied[0])


def _exchange(tableau: Long, basis: list[int], row: int, entering: int) -> int:
    """Bring a variable into the basis; return the one that leaves."""
    tableau[row] /= tableau[row, entering]
    factors = tableau[:, entering].copy()
    factors[row] = 0.0
    touched = np.flatnonzero(factors)
    tableau[touched] -= factors[touched, None] * tableau[row]
    tableau[:, entering] = 0.0
    tableau[row, entering] = 1.0
    leaving, basis[row] = basis[row], entering
    return leaving
