"""Symbolic solution of sparse linear blocks by elimination, in an order chosen once from sparsity and numeric magnitudes."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from powertrain.language.symbols import Symbol

Row = dict[int, Symbol]
Numbers = dict[int, float]


class SingularBlock(Exception):
    """Rows without a pivot: these equations depend on the others."""

    def __init__(self, rows: list[int]) -> None:
        super().__init__(str(rows))
        self.rows = rows


@dataclass(frozen=True)
class Factors:
    """Rows of the eliminated table in the order of their pivots, and what was subtracted: (target row, pivot row, factor)."""

    table: list[Row]
    order: list[tuple[int, int]]
    operations: list[tuple[int, int, Symbol]]

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
            solution[j] = total / self.table[i][j]
        return solution


def solve(
    rows: Sequence[Row], right: Sequence[Symbol], numbers: Sequence[Numbers], varying: Sequence[set[int]] = ()
) -> dict[int, Symbol]:
    """The x with sum_j rows[i][j] x_j = right[i], as expressions; see ``factorize``."""
    return factorize(rows, numbers, varying).solve(right)


def factorize(rows: Sequence[Row], numbers: Sequence[Numbers], varying: Sequence[set[int]] = ()) -> Factors:
    """Gaussian elimination of sparse rows.

    ``numbers`` are the values of the entries at a reference point; the pivot of a row is the entry in the shortest column among those
    not below a hundredth of the row's largest value. ``varying`` are the columns whose entry in a row may pass through zero later:
    pivots only where a row has no other, and such rows come last. Raises SingularBlock where a row has no pivot left.
    """
    table, values = [dict(r) for r in rows], [dict(n) for n in numbers]
    rough = [set(v) for v in varying] or [set[int]() for _ in rows]

    def rank(i: int) -> tuple[bool, int, int]:
        return rough[i].issuperset(table[i]) and bool(rough[i]), len(table[i]), i

    holders: dict[int, set[int]] = {}
    for i, row in enumerate(table):
        for j in row:
            holders.setdefault(j, set()).add(i)
    heap = [rank(i) for i in range(len(table))]
    heapq.heapify(heap)
    open_rows, order = set(range(len(table))), []
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
        for k in holders.pop(j):
            if k in open_rows:
                rough[k] |= set(table[i]) if j in rough[k] or j in rough[i] else rough[i] & set(table[i])
                operations.append((k, i, _subtract(table, values, holders, k, i, j)))
                heapq.heappush(heap, rank(k))
        for n in table[i]:
            if n in holders:
                holders[n].discard(i)
    return Factors(table, order, operations)


def _subtract(table: list[Row], values: list[Numbers], holders: dict[int, set[int]], k: int, i: int, j: int) -> Symbol:
    """Takes the pivot row i from row k; returns by which factor."""
    factor, number = table[k].pop(j) / table[i][j], values[k].pop(j) / values[i][j]
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
        values[k][n] = 0.0 if abs(old - change) <= 1e-11 * (abs(old) + abs(change)) else old - change
        holders[n].add(k)
    return factor
