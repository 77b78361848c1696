"""Gaussian elimination of many small systems with one sparsity pattern at once: each entry is an array over all systems.

The next pivot is in the shortest row. It serves all systems in which it is not small compared with the rest of that row; the other
systems continue separately, with their own pivot (threshold pivoting: I. S. Duff, A. M. Erisman, J. K. Reid, Direct Methods for Sparse
Matrices, Oxford 2017, section 5.2). Small groups of systems, and systems without a pivot, are solved one by one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import casadi as ca
import numpy as np

from powertrain.language.reals import Array
from powertrain.numerics.newton import Index, Mask, Solver, solved

THRESHOLD = 0.1
"""The smallest allowed pivot, relative to the largest entry of its row."""
FEW = 128
"""Up to this number, systems are solved faster one by one."""


class Pattern:
    """Square matrices with entries at the same positions."""

    def __init__(self, sparsity: ca.Sparsity) -> None:
        self.rows, self.columns = np.array(sparsity.row(), np.intp), np.array(sparsity.get_col(), np.intp)
        self.size = sparsity.size1()

    def solver(self, entries: Array) -> Solver:
        """The solver of the matrices with these ``entries``, one row per matrix, for one right-hand side or several, as ``solved``."""

        def solve(right: Array) -> Array:
            if len(right) < FEW:
                return solved(self.dense(entries), right)
            found = np.full(right.shape[::-1], np.nan).T
            left = self._eliminate(entries.T, right.T.swapaxes(0, -2), found.T.swapaxes(0, -2))
            if left.size:
                found[left] = solved(self.dense(entries[left]), right[left])
            return found

        return solve

    def dense(self, entries: Array) -> Array:
        """The matrices as dense arrays; the same entry of all matrices is contiguous."""
        full = np.zeros((self.size, self.size, len(entries)))
        full[self.rows, self.columns] = entries.T
        return full.transpose(2, 0, 1)

    def product(self, entries: Array, vectors: Array) -> Array:
        """The matrices with these ``entries``, each times its vector (one per row)."""
        found = np.zeros((self.size, len(entries)))
        for i, j, values in zip(self.rows.tolist(), self.columns.tolist(), entries.T, strict=True):
            found[i] += values * vectors[:, j]
        return found.T

    def _eliminate(self, entries: Array, right: Array, found: Array) -> Index:
        """Solve systems, the last axis of the arrays, into ``found``; return those that remain."""
        table: list[dict[int, Array]] = [{} for _ in range(self.size)]
        for i, j, values in zip(self.rows.tolist(), self.columns.tolist(), entries, strict=True):
            table[i][j] = values
        waiting, left = (
            [_Part(np.arange(right.shape[-1]), table, list(right), list(range(self.size)), [])],
            [np.zeros(0, np.intp)],
        )
        while waiting:
            part = waiting.pop()
            while part.open and part.systems.size >= FEW:
                i = part.shortest_row()
                sizes = {j: np.abs(values) for j, values in part.table[i].items()}
                largest = reduce(np.maximum, sizes.values(), np.zeros(part.systems.size))
                sound = (largest > 0.0) & (largest < np.inf)
                if not sound.all():
                    left.append(part.systems[~sound])
                    part = part.some(sound)
                    continue
                j = part.shortest_column([j for j in sizes if sizes[j][0] >= THRESHOLD * largest[0]])
                good = sizes[j] >= THRESHOLD * largest
                if not good.all():
                    waiting.append(part.some(~good))
                    part = part.some(good)
                part.eliminate(i, j)
            if part.open:
                left.append(part.systems)
            else:
                part.substitute(found)
        return np.concatenate(left)


@dataclass
class _Part:
    """Some partly eliminated systems: numbers, remaining rows, right-hand sides, rows without pivot, pivots as (row, column)."""

    systems: Index
    table: list[dict[int, Array]]
    right: list[Array]
    open: list[int]
    pivots: list[tuple[int, int]]

    def some(self, which: Mask) -> _Part:
        """Some of them."""
        table = [{j: values[which] for j, values in row.items()} for row in self.table]
        return _Part(
            self.systems[which],
            table,
            [values[..., which] for values in self.right],
            self.open.copy(),
            self.pivots.copy(),
        )

    def shortest_row(self) -> int:
        """The next row."""
        return min(self.open, key=lambda i: len(self.table[i]))

    def shortest_column(self, columns: list[int]) -> int:
        """The column among ``columns`` with entries in the fewest rows."""
        return min(columns, key=lambda j: sum(j in self.table[i] for i in self.open))

    def eliminate(self, i: int, j: int) -> None:
        """Eliminate unknown j from all rows but i."""
        self.pivots.append((i, j))
        self.open.remove(i)
        for k in self.open:
            if j not in self.table[k]:
                continue
            factor = self.table[k].pop(j) / self.table[i][j]
            self.right[k] = self.right[k] - factor * self.right[i]
            for n, values in self.table[i].items():
                if n != j:
                    self.table[k][n] = self.table[k].get(n, 0.0) - factor * values

    def substitute(self, found: Array) -> None:
        """The solutions, from the last pivot to the first."""
        solution: dict[int, Array] = {}
        for i, j in reversed(self.pivots):
            total = self.right[i]
            for n, values in self.table[i].items():
                if n != j:
                    total = total - values * solution[n]
            solution[j] = total / self.table[i][j]
            found[j][..., self.systems] = solution[j]
