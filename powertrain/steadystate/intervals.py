"""The range of outputs while laws at rest carry any torque between their bounds: at both ends, and inside.

Torques are affine between the ends; what is derived from them, as an efficiency, is not. It may have an extremum inside, and no bound where
it has a pole.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import OK, ONE, Index, Mask, Points
from powertrain.numerics.batch import Rows
from powertrain.numerics.buffers import Array

MOST_LAWS = 8
"""Laws at rest whose ends are combined."""
SAMPLES = 33
"""Places on a line from end to end at which values are computed first."""
HALVINGS = 60
"""Of a piece between two samples, down to round-off."""
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
BLOCK = 256
"""Points that are looked at together."""
STRAIGHT = 1e-9
"""Outputs that leave the line between their ends by less, relative to their size, are affine."""
INFINITE = 1e10
"""Values so much larger than usual on the line have no bound."""
POLE = 1e4
"""Growth of a value towards a place by which a pole is known there."""


def ranges(solver: Solver, grid: Rows, laws: Index) -> tuple[Rows, Rows, Mask]:
    """Least and greatest values at the points of ``grid``, where ``laws`` rest; and where all ends can be.

    With several laws at rest the lines between all ends are looked at.
    """
    ends, sides = [], []
    for combination in product((1.0, -1.0), repeat=min(len(laws), MOST_LAWS)):
        side = np.ones((len(solver.choices), grid.shape[1]))
        side[laws[:MOST_LAWS]] = np.array(combination)[:, None]
        ends.append(solver.solve(grid, side))
        sides.append(side)
    values = [solver.values(grid, end)[0] for end in ends]
    low, high = np.minimum.reduce(values), np.maximum.reduce(values)
    solved: Mask = np.logical_and.reduce([np.isin(end.status, (OK, ONE)) for end in ends])
    if not solver.explicit:
        return low, high, solved
    where = np.flatnonzero(solved)
    for some in np.array_split(where, len(where) // BLOCK + 1):
        for i, k in combinations(range(len(ends)), 2):
            least, most = Line(solver, grid[:, some], ends[i], ends[k], some).extremes()
            low[:, some], high[:, some] = np.fmin(low[:, some], least), np.fmax(high[:, some], most)
    return low, high, solved


class Line:
    """Points with torques between those of two ends, by the part of the way from the first to the second."""

    def __init__(self, solver: Solver, grid: Rows, first: Points, last: Points, where: Index) -> None:
        self.solver, self.grid, self.count = solver, grid, grid.shape[1]
        self.first, self.last = first.modes[:, where], last.modes[:, where]
        self.resting = np.asarray(first.rest[:, where] & last.rest[:, where])

    def values(self, part: Array, points: Index) -> Rows:
        """All outputs at some points; nan where neither end's modes of the other laws hold there."""
        found = np.full((self.solver.wanted, part.size), np.nan)
        between = (1 - part) * self.first[:, points] + part * self.last[:, points]
        between[between == 0.0] = 1e-15  # zero would be stuck
        for others in (self.last[:, points], self.first[:, points]):
            modes = np.where(self.resting[:, points], between, others)
            holds = self.solver.holds(self.grid[:, points], modes, self.resting[:, points])
            here = Points(
                modes[:0], modes, np.zeros(part.size, np.int8), self.resting[:, points], self.resting[:, points]
            )
            found = np.where(holds, self.solver.values(self.grid[:, points], here)[0], found)
        return found

    def extremes(self) -> tuple[Rows, Rows]:
        """Least and greatest values, infinite where there is a pole on the way."""
        parts = np.linspace(0.0, 1.0, SAMPLES)
        table = np.array([self.values(np.full(self.count, q), np.arange(self.count)) for q in parts])
        least, most = np.fmin.reduce(table), np.fmax.reduce(table)
        line = table[0] + parts[:, None, None] * (table[-1] - table[0])
        size = np.nanmedian(np.abs(table), axis=0)
        self.bent = np.flatnonzero((np.abs(table - line) > STRAIGHT * (1.0 + size)).any(axis=(0, 2)))
        table, size = table[:, self.bent], size[self.bent]
        poles = self._poles(table, parts)
        greatest, smallest = self._greatest(table, parts, 1.0), -self._greatest(-table, parts, -1.0)
        most[self.bent] = np.where(poles | (greatest > INFINITE * (1.0 + size)), np.inf, greatest)
        least[self.bent] = np.where(poles | (smallest < -INFINITE * (1.0 + size)), -np.inf, smallest)
        return least, most

    def _greatest(self, table: Array, parts: Array, sign: float) -> Rows:
        """The greatest values of sign times the outputs: about the greatest sample by golden sections."""
        best = np.where(np.isfinite(table), table, -np.inf)
        place = best.argmax(axis=0)
        low, high = parts[np.maximum(place - 1, 0)], parts[np.minimum(place + 1, SAMPLES - 1)]
        greatest = best.max(axis=0)
        for _ in range(HALVINGS):
            inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            one, other = (np.nan_to_num(sign * self._at(q), nan=-np.inf) for q in (inner, outer))
            greatest = np.maximum(greatest, np.maximum(one, other))
            low, high = np.where(one < other, inner, low), np.where(one < other, high, outer)
        return np.asarray(greatest)

    def _poles(self, table: Array, parts: Array) -> Mask:
        """Outputs whose sign changes between two samples through large values, not through zero."""
        poles = np.zeros(table.shape[1:], bool)
        for k in range(SAMPLES - 1):
            turns = table[k] * table[k + 1] < 0.0
            if not turns.any():
                continue
            low, high = np.full(turns.shape, parts[k]), np.full(turns.shape, parts[k + 1])
            size = np.abs(table[k]) + np.abs(table[k + 1])
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                value = self._at(middle)
                above = value * table[k] > 0.0
                low, high = np.where(above, middle, low), np.where(above, high, middle)
                poles |= turns & (np.abs(value) > POLE * size)
        return poles

    def _at(self, parts: Rows) -> Rows:
        """Each output that is not affine at its own place on the line."""
        outputs, count = parts.shape
        found = self.values(parts.ravel(), np.tile(np.arange(count), outputs)).reshape(-1, outputs, count)
        return np.asarray(found[self.bent, np.arange(outputs)])
