"""Symbolic elimination of sparse linear systems, in an order chosen once from sparsity and numeric magnitudes.

There is no pivoting at run time: a solution is an expression. Above some hundred unknowns expressions are inefficient; such systems are
solved numerically, with pivoting, by SciPy's ``splu``.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from powertrain.language.symbols import Symbol, scalars
from powertrain.numerics.pivots import difference

Row = dict[int, Symbol]
Numbers = dict[int, float]
Solve = Callable[[Symbol], Symbol]
_PIVOT = 1e9
"""Represents the entry of a given pivot, compared with ones for the others."""


class SingularBlock(Exception):
    """Rows without a pivot: these equations depend on others."""

    def __init__(self, rows: list[int]) -> None:
        super().__init__(str(rows))
        self.rows = rows


@dataclass(frozen=True)
class Factors:
    """Rows of the eliminated table in the order of their pivots, and the subtractions (target row, pivot row, factor).

    ``inverses`` are the reciprocals of the pivots by row if there are many right-hand sides; else empty.
    """

    table: list[Row]
    order: list[tuple[int, int]]
    operations: list[tuple[int, int, Symbol]]
    inverses: Row

    def solve(self, right: Sequence[Symbol]) -> dict[int, Symbol]:
        """The x with sum_j rows[i][j] x_j = right[i]."""
        b = list(right)
        for target, pivot, factor in self.operations:
            b[target] = b[target] - factor * b[pivot]
        solution: dict[int, Symbol] = {}
        for i, j in reversed(self.order):
            total = b[i]
            for n, entry in self.table[i].items():
                if n != j:
                    total = total - entry * solution[n]
            solution[j] = total * self.inverses[i] if self.inverses else total / self.table[i][j]
        return solution

    def column(self, right: Symbol) -> Symbol:
        """The same for columns."""
        solution = self.solve(scalars(right))
        return ca.vertcat(*(solution[j] for j in range(len(solution))))

    def values(self) -> list[Symbol]:
        """All numbers needed for a solution."""
        upper = [entry for i, j in self.order for n, entry in self.table[i].items() if n != j]
        return [*(factor for *_, factor in self.operations), *upper, *self.inverses.values()]

    def known(self, values: Sequence[Symbol]) -> Factors:
        """The same factors with other ``values``."""
        given = iter(values)
        operations = [(target, pivot, next(given)) for target, pivot, _ in self.operations]
        table: list[Row] = [{} for _ in self.table]
        for i, j in self.order:
            table[i] = {n: next(given) for n in self.table[i] if n != j}
        return replace(self, operations=operations, table=table, inverses={i: next(given) for i in self.inverses})


def solve(
    rows: Sequence[Row], right: Sequence[Symbol], numbers: Sequence[Numbers], varying: Sequence[set[int]] = ()
) -> dict[int, Symbol]:
    """The x with sum_j rows[i][j] x_j = right[i], as expressions; see ``eliminate``."""
    return eliminate(rows, numbers, varying).solve(right)


def factorize(matrix: ca.SX | ca.MX, rows: Sequence[int] | None = None) -> Solve:
    """Return ``solve(b)`` for ``matrix @ x == b``, for any number of right-hand sides.

    ``rows[i]`` is the row whose entry in column i serves as pivot (default: the diagonal); see
    :func:`powertrain.numerics.pivots.match_rows`. For an ``MX`` one function gives the factors and one the solution.
    Raises KeyError if there is no such entry.
    """
    pivots = list(range(matrix.size1())) if rows is None else list(rows)
    if not isinstance(matrix, ca.MX):
        return _factors(matrix, pivots).column
    pattern = matrix.sparsity()
    entries, right = ca.SX.sym("entries", pattern.nnz()), ca.SX.sym("right", matrix.size1())
    factors = _factors(ca.SX(pattern, entries), pivots)
    values = factors.values()
    known = ca.SX.sym("factors", len(values))
    solution = factors.known(scalars(known)).column(right)
    factored = ca.Function("powertrain_factors", [entries], ca.cse([ca.vertcat(*values)]))
    substitute = ca.Function("powertrain_substitute", [known, right], [solution])
    found: Any = factored(matrix.nz[:])
    return lambda b: substitute(found, b)


def _factors(matrix: ca.SX, pivots: Sequence[int]) -> Factors:
    rows: list[Row] = [{} for _ in pivots]
    numbers: list[Numbers] = [{} for _ in pivots]
    for k, (i, j) in enumerate(zip(*matrix.sparsity().get_triplet(), strict=True)):
        rows[i][j], numbers[i][j] = matrix.nz[k], 1.0
    for j, i in enumerate(pivots):
        if j not in rows[i]:
            raise KeyError(j)
        numbers[i][j] = _PIVOT
    return eliminate(rows, numbers, reciprocals=True)


def eliminate(
    rows: Sequence[Row],
    numbers: Sequence[Numbers],
    varying: Sequence[set[int]] = (),
    reciprocals: bool = False,
) -> Factors:
    """Gaussian elimination of sparse rows, the shortest first.

    ``numbers`` are the values of the entries at a reference point; the pivot of a row is the entry in the shortest column among those of at
    least a hundredth of the row's largest value. ``varying`` are the columns whose entry in a row may pass through zero later: they are
    pivots only if a row has no others, and such rows come last. With ``reciprocals`` there is one division per pivot.
    Raises SingularBlock if a row has no pivot left.
    """
    table, values = [dict(r) for r in rows], [dict(n) for n in numbers]
    rough = [set(v) for v in varying] or [set[int]() for _ in rows]

    def rank(i: int) -> tuple[bool, int, int]:
        return rough[i].issuperset(table[i]), len(table[i]), i

    holders: dict[int, set[int]] = {}
    for i, row in enumerate(table):
        for j in row:
            holders.setdefault(j, set()).add(i)
    heap = [rank(i) for i in range(len(table))]
    heapq.heapify(heap)
    open_rows, order, inverses = set(range(len(table))), list[tuple[int, int]](), Row()
    operations: list[tuple[int, int, Symbol]] = []
    while heap:
        ranked = heapq.heappop(heap)
        i = ranked[-1]
        if i not in open_rows or ranked != rank(i):
            continue
        largest = max((abs(v) for v in values[i].values()), default=0.0)
        if largest == 0.0:
            raise SingularBlock([i])
        large = [j for j in table[i] if abs(values[i][j]) >= 0.01 * largest]
        j = min(large, key=lambda j: (j in rough[i], len(holders[j]), j))
        open_rows.discard(i)
        order.append((i, j))
        if reciprocals:
            inverses[i] = 1 / table[i][j]
        for k in sorted(holders.pop(j)):
            if k in open_rows:
                rough[k] |= set(table[i]) if j in rough[k] or j in rough[i] else rough[i] & set(table[i])
                entry, number = table[k].pop(j), values[k].pop(j) / values[i][j]
                factor = entry * inverses[i] if reciprocals else entry / table[i][j]
                operations.append((k, i, factor))
                _subtract(table, values, holders, k, i, j, factor, number)
                heapq.heappush(heap, rank(k))
        for n in table[i]:
            if n in holders:
                holders[n].discard(i)
    return Factors(table, order, operations, inverses)


def _subtract(
    table: list[Row],
    values: list[Numbers],
    holders: dict[int, set[int]],
    k: int,
    i: int,
    j: int,
    factor: Symbol,
    number: float,
) -> None:
    """Subtract the pivot row i, multiplied by a factor, from row k."""
    for n, entry in table[i].items():
        if n == j:
            continue
        old, change = values[k].get(n, 0.0), number * values[i][n]
        new = table[k][n] - factor * entry if n in table[k] else -factor * entry
        if new.is_zero():
            table[k].pop(n, None)
            values[k].pop(n, None)
            holders[n].discard(k)
            continue
        table[k][n] = new
        values[k][n] = difference(old, change)
        holders[n].add(k)
