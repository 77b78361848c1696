"""A symbolic sparse LU factorisation of small SX matrices: minimum-degree order, pivots on the diagonal of the matched rows."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca

Solve = Callable[[ca.SX], ca.SX]
Factors = tuple[list[dict[int, ca.SX]], list[dict[int, ca.SX]], list[ca.SX]]
"""The strict lower and upper rows, and the inverse pivots, in the order of elimination."""


def factorize(matrix: ca.SX | ca.MX, rows: Sequence[int] | None = None) -> Solve:
    """Return ``solve(b)`` for ``matrix @ x == b``, as expressions without any pivoting at run time.

    ``rows[i]`` is the row whose entry in column i serves as pivot (default: the diagonal). It must be structurally non-zero; see
    :func:`powertrain.numerics.pivots.match_rows`.
    """
    pivot_row = list(range(matrix.size1())) if rows is None else list(rows)
    if isinstance(matrix, ca.MX):
        return _called(matrix, pivot_row)
    order, factors = _factors(matrix, pivot_row)
    return lambda b: _substitute(pivot_row, order, factors, b)


def _called(matrix: ca.MX, pivot_row: list[int]) -> Solve:
    """One function that gives the factors and one for the solution, instead of their expressions."""
    pattern = matrix.sparsity()
    entries, right = ca.SX.sym("entries", pattern.nnz()), ca.SX.sym("right", matrix.size1())
    order, (lower, upper, inverse) = _factors(ca.SX(pattern, entries), pivot_row)
    values = [value for rows in (lower, upper) for row in rows for value in row.values()] + inverse
    known = ca.SX.sym("factors", len(values))
    places = iter(ca.vertsplit(known))
    below, above = ([{j: next(places) for j in row} for row in rows] for rows in (lower, upper))
    solution = _substitute(pivot_row, order, (below, above, list(places)), right)
    eliminate = ca.Function("powertrain_factors", [entries], ca.cse([ca.vertcat(*values)]))
    substitute = ca.Function("powertrain_substitute", [known, right], [solution])
    found: Any = eliminate(matrix.nz[:])
    return lambda b: substitute(found, b)


def _factors(matrix: ca.SX, pivot_row: list[int]) -> tuple[list[int], Factors]:
    entries = _entries(matrix, {row: column for column, row in enumerate(pivot_row)})
    order = _minimum_degree(len(pivot_row), entries)
    return order, _eliminate(len(pivot_row), entries, order)


def _substitute(pivot_row: list[int], order: list[int], factors: Factors, b: ca.SX) -> ca.SX:
    """The solution for the right side ``b``."""
    lower, upper, inverse = factors
    n = len(order)
    y: list[ca.SX] = []
    for i in range(n):
        value = b[pivot_row[order[i]]]
        for j, factor in lower[i].items():
            value = value - factor * y[j]
        y.append(value)
    for i in range(n - 1, -1, -1):
        value = y[i]
        for j, factor in upper[i].items():
            value = value - factor * y[j]
        y[i] = value * inverse[i]
    solution: list[ca.SX] = [ca.SX(0)] * n
    for i in range(n):
        solution[order[i]] = y[i]
    return ca.vertcat(*solution)


def _entries(matrix: ca.SX, position_of_row: dict[int, int]) -> list[dict[int, ca.SX]]:
    """The non-zeros as rows of {column: value}, rows permuted so that the pivots stand on the diagonal."""
    sparsity = matrix.sparsity()
    rows: list[dict[int, ca.SX]] = [{} for _ in range(matrix.size1())]
    for k, (i, j) in enumerate(zip(sparsity.row(), sparsity.get_col(), strict=True)):
        rows[position_of_row[i]][j] = matrix.nz[k]
    return rows


def _minimum_degree(n: int, entries: list[dict[int, ca.SX]]) -> list[int]:
    """Greedy minimum degree on the symmetrised pattern."""
    neighbours: list[set[int]] = [set() for _ in range(n)]
    for i, row in enumerate(entries):
        for j in row:
            if i != j:
                neighbours[i].add(j)
                neighbours[j].add(i)
    heap = [(len(neighbours[i]), i) for i in range(n)]
    heapq.heapify(heap)
    alive = set(range(n))
    order: list[int] = []
    while heap:
        degree, i = heapq.heappop(heap)
        if i not in alive or degree != len(neighbours[i]):
            continue
        alive.discard(i)
        order.append(i)
        for a in neighbours[i]:
            neighbours[a].discard(i)
        for a in neighbours[i]:
            neighbours[a] |= neighbours[i] - {a}
            heapq.heappush(heap, (len(neighbours[a]), a))
    return order


def _eliminate(n: int, entries: list[dict[int, ca.SX]], order: list[int]) -> Factors:
    """Gaussian elimination in ``order``."""
    position = {v: k for k, v in enumerate(order)}
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    below: list[set[int]] = [set() for _ in range(n)]
    for i, row in enumerate(entries):
        for j, value in row.items():
            rows[position[i]][position[j]] = value
            if position[j] < position[i]:
                below[position[j]].add(position[i])
    lower: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    inverse: list[ca.SX] = []
    for k in range(n):
        inverse.append(1 / rows[k][k])
        right = [(j, value) for j, value in rows[k].items() if j > k]
        for i in sorted(below[k]):
            factor = rows[i].pop(k) * inverse[k]
            lower[i][k] = factor
            for j, value in right:
                if j in rows[i]:
                    rows[i][j] = rows[i][j] - factor * value
                    continue
                rows[i][j] = -factor * value
                if j < i:
                    below[j].add(i)
    upper = [{j: value for j, value in row.items() if j > i} for i, row in enumerate(rows)]
    return lower, upper, inverse
