"""Which of the equations and conditions of a start are independent, and the square system that these make.

Earlier rows prevail: a condition that depends on those before it is left out.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.numerics.newton import Solver, dense
from powertrain.numerics.pivots import difference

_SLIGHT = 1e-9
"""A row is dependent if elimination leaves less than this share of it."""
_DENSE = 200


@dataclass(frozen=True)
class StartJacobian:
    """The places of the entries in the Jacobian of a start.

    The first rows are ``implicit`` equations, the others ``conditions``. The first of the ``unknowns`` are ``states``.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    implicit: int
    conditions: int
    states: int
    unknowns: int


class Choice:
    """The rows that are solved, the unknowns they own, and the positions of the entries of their square system.

    ``displaces``: an implicit equation owns a state. ``taken`` and ``left`` are indices of conditions.
    """

    def __init__(self, of: StartJacobian, chosen: list[int], owned: list[int]) -> None:
        self.chosen, self.owned = np.array(chosen, int), np.array(owned, int)
        self.displaces = bool((self.owned[self.chosen < of.implicit] < of.states).any())
        row_place, column_place = np.full(of.implicit + of.conditions, -1), np.full(of.unknowns, -1)
        row_place[self.chosen], column_place[self.owned] = np.arange(len(chosen)), np.arange(len(owned))
        i, k = row_place[of.rows], column_place[of.columns]
        self.inside = np.flatnonzero((i >= 0) & (k >= 0))
        self.i, self.k = i[self.inside], k[self.inside]
        self.taken = frozenset(i - of.implicit for i in chosen)
        self.left = np.array([i for i in range(of.conditions) if i not in self.taken], int)
        self.open_states = sorted(set(range(of.states)) - set(owned))

    def factors(self, nonzeros: Array) -> Solver:
        """The solver of the square system with these nonzeros; each row has all of them."""
        entries, size = nonzeros[0, self.inside], len(self.chosen)
        if size > _DENSE and np.isfinite(entries).all():
            return _sparse(entries, self.i, self.k, size)
        matrix = np.zeros((1, size, size))
        matrix[0, self.i, self.k] = entries
        return dense(matrix)


def _sparse(entries: Array, rows: NDArray[np.intp], columns: NDArray[np.intp], size: int) -> Solver:
    """Dense elimination grows with the cube of the size; SciPy's sparse solver is slow to import, but pivots at run time as needed here."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    try:
        factors = splu(csc_array((entries, (rows, columns)), shape=(size, size)))
    except RuntimeError:  # singular
        return lambda right: np.full(right.shape, np.nan)
    return lambda right: np.asarray(factors.solve(right[0]), float)[None]


def independent(of: StartJacobian, nonzeros: Array) -> tuple[Choice, list[int]]:
    """Independent rows and the unknowns they own, in order, and implicit rows without an unknown."""
    table: list[dict[int, float]] = [{} for _ in range(of.implicit + of.conditions)]
    for i, k, a in zip(of.rows.tolist(), of.columns.tolist(), nonzeros.tolist(), strict=False):
        if a != 0.0 and np.isfinite(a):
            table[i][k] = a
    chosen: list[int] = []
    open_rows: list[int] = []
    basis: dict[int, tuple[int, dict[int, float]]] = {}
    for i, row in enumerate(table):
        size = max(map(abs, row.values()), default=0.0)
        _reduce(row, basis)
        implicit = i < of.implicit
        pivot = max(row, key=lambda k: (abs(row[k]) * (1e3 if implicit and k >= of.states else 1.0), -k), default=None)
        if pivot is None or abs(row[pivot]) <= _SLIGHT * size:
            if implicit:
                open_rows.append(i)
            continue
        chosen.append(i)
        basis[pivot] = (len(basis), row)
    return Choice(of, chosen, list(basis)), open_rows


def _reduce(row: dict[int, float], basis: dict[int, tuple[int, dict[int, float]]]) -> None:
    """Subtract basis rows until ``row`` has no entry at a pivot. ``basis``: pivot -> (age, row), zero at older pivots."""
    pending = [(basis[k][0], k) for k in row if k in basis]
    heapq.heapify(pending)
    while pending:
        _, pivot = heapq.heappop(pending)
        if pivot not in row:
            continue
        other = basis[pivot][1]
        factor = row[pivot] / other[pivot]
        for k, a in other.items():
            new = difference(row.get(k, 0.0), factor * a)
            if k == pivot or new == 0.0:
                row.pop(k, None)
                continue
            if k not in row and k in basis:
                heapq.heappush(pending, (basis[k][0], k))
            row[k] = new
