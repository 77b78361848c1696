"""Symbolic solution of sparse linear blocks by elimination, in an order chosen once from sparsity and numeric magnitudes."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence

from powertrain.symbols import Symbol

Row = dict[int, Symbol]
Numbers = dict[int, float]


class SingularBlock(Exception):
    """Rows without a pivot: these equations depend on the others."""

    def __init__(self, rows: list[int]) -> None:
        super().__init__(str(rows))
        self.rows = rows


Settle = Callable[[int, Symbol], Symbol]
"""Changes the pivot of a row before it is divided by, as where it may vanish."""


def solve(
    rows: Sequence[Row],
    right: Sequence[Symbol],
    numbers: Sequence[Numbers],
    settle: Settle | None = None,
    varying: Sequence[set[int]] = (),
) -> dict[int, Symbol]:
    """The x with sum_j rows[i][j] x_j = right[i], as expressions.

    ``numbers`` are the values of the entries at a reference point; the pivot of a row is the entry in the shortest column among those
    not below a hundredth of the row's largest value. ``varying`` are the columns whose entry in a row may pass through zero later:
    pivots only where a row has no other, and such rows come last. Raises SingularBlock where a row has no pivot left.
    """
    table, values, b = [dict(r) for r in rows], [dict(n) for n in numbers], list(right)
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
        if settle is not None:
            table[i][j] = settle(i, table[i][j])
        for k in holders.pop(j):
            if k in open_rows:
                rough[k] |= set(table[i]) if j in rough[k] or j in rough[i] else rough[i] & set(table[i])
                _subtract(table, values, b, holders, k, i, j)
                heapq.heappush(heap, rank(k))
        for n in table[i]:
            if n in holders:
                holders[n].discard(i)
    return _back_substitution(table, b, order)


def _subtract(
    table: list[Row], values: list[Numbers], b: list[Symbol], holders: dict[int, set[int]], k: int, i: int, j: int
) -> None:
    factor, number = table[k].pop(j) / table[i][j], values[k].pop(j) / values[i][j]
    b[k] = b[k] - factor * b[i]
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


def _back_substitution(table: list[Row], b: list[Symbol], order: list[tuple[int, int]]) -> dict[int, Symbol]:
    solution: dict[int, Symbol] = {}
    for i, j in reversed(order):
        total = b[i]
        for n, entry in table[i].items():
            if n != j:
                total = total - entry * solution[n]
        solution[j] = total / table[i][j]
    return solution
