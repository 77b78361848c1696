"""The range of outputs while laws at rest carry any torque between their bounds: values at both ends and in between.

Torques are affine between the ends; derived values such as an efficiency are not. They may have an extremum in between, and no bound at
a pole.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import OK, Index, Mask, Points
from powertrain.language.reals import Array
from powertrain.numerics.batch import Rows

MOST_LAWS = 8
"""The number of laws at rest up to which their ends are combined."""
SAMPLES = 33
"""Samples on the line between two ends."""
HALVINGS, SECTIONS = 60, 60
"""Iterations between two samples: they locate a pole, and compute an extremum, to round-off."""
NEAR = 1e-6
"""Distance of the neighbour of an end, as a fraction of the line."""
BESIDE = 1e-15
"""Place of the midpoint: zero would be the mode of a stuck law."""
GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
BLOCK = 256
"""Points that are processed together."""
STRAIGHT = 1e-9
"""Outputs are affine if they deviate from the line between their ends by less than this, relative to their size."""
UNBOUNDED = 1e10
"""Values larger than the usual ones on the line by this factor are unbounded."""
POLE = 1e4
"""Growth of a value towards a place that indicates a pole."""


def ranges(solver: Solver, grid: Rows, laws: Index) -> tuple[Rows, Rows, NDArray[np.int8]]:
    """Least and greatest values at the points of ``grid`` at which ``laws`` rest, and the status of the ends: the greatest of all.

    With several laws at rest, the lines between all ends are searched.
    """
    ends = ends_of(solver, grid, laws)
    values = [solver.values(grid, end.u, end.modes)[0] for end in ends]
    low, high = np.minimum.reduce(values), np.maximum.reduce(values)
    status: NDArray[np.int8] = np.maximum.reduce([end.status for end in ends])
    line = StuckLine if solver.explicit else ImplicitLine
    where = np.flatnonzero(status == OK)
    if not where.size:
        return low, high, status
    for some in np.array_split(where, len(where) // BLOCK + 1):
        for i, k in combinations(range(len(ends)), 2):
            least, most = line(solver, grid[:, some], ends[i], ends[k], some).extremes()
            low[:, some], high[:, some] = np.fmin(low[:, some], least), np.fmax(high[:, some], most)
    return low, high, status


def ends_of(solver: Solver, grid: Rows, laws: Index) -> list[Points]:
    """The solutions with all combinations of the sides from which ``laws`` approach rest.

    A law whose bounds coincide at the first end, because it carries no torque there, may rest at another one.
    """
    ends = []
    for combination in product((1.0, -1.0), repeat=min(len(laws), MOST_LAWS)):
        side = np.ones((len(solver.choices), grid.shape[1]))
        side[laws[:MOST_LAWS]] = np.array(combination)[:, None]
        ends.append(solver.solve(grid, side))
    resting = np.flatnonzero(np.any([end.rest.any(axis=1) for end in ends], axis=0))
    return ends_of(solver, grid, resting) if len(resting) > len(laws) else ends


class StuckLine:
    """Points with torques between those of two ends, as a function of the position from the first (0) to the second (1)."""

    def __init__(self, solver: Solver, grid: Rows, first: Points, last: Points, where: Index) -> None:
        self.solver, self.grid, self.count = solver, grid, grid.shape[1]
        one, other = first.rest[:, where], last.rest[:, where]
        self.resting = np.asarray(one | other)
        modes, others = first.modes[:, where], last.modes[:, where]
        # A law that rests at one end only carries no torque at the other: its place between its bounds is open there.
        self.first, self.last = np.where(other & ~one, others, modes), np.where(one & ~other, modes, others)

    def sides(self, part: Array, points: Index) -> Rows:
        """Places of the laws between their limits, -1 and 1."""
        between: Rows = (1 - part) * self.first[:, points] + part * self.last[:, points]
        between[between == 0.0] = BESIDE
        return between

    def values(self, part: Array, points: Index) -> Rows:
        """All outputs at some points; nan where neither end's modes of the other laws hold there."""
        found, between = np.full((self.solver.wanted, part.size), np.nan), self.sides(part, points)
        for others in (self.last[:, points], self.first[:, points]):
            modes = np.where(self.resting[:, points], between, others)
            holds = self.solver.holds(self.grid[:, points], modes, self.resting[:, points])
            found = np.where(holds, self.solver.values(self.grid[:, points], modes[:0], modes)[0], found)
        return found

    @np.errstate(over="ignore", invalid="ignore")  # at a pole values are infinite or extremely large
    def extremes(self) -> tuple[Rows, Rows]:
        """Least and greatest values; infinite if there is a pole in between."""
        parts = np.linspace(0.0, 1.0, SAMPLES)
        found = self.values(np.repeat(parts, self.count), np.tile(np.arange(self.count), SAMPLES))
        table = found.reshape(-1, SAMPLES, self.count).transpose(1, 0, 2)
        least, most = np.fmin.reduce(table), np.fmax.reduce(table)
        line = table[0] + parts[:, None, None] * (table[-1] - table[0])
        size = np.nanmedian(np.abs(table), axis=0)
        bent = (np.abs(table - line) > STRAIGHT * (1.0 + size)).any(axis=0)
        if not bent.any():
            return least, most
        most = np.fmax(most, self._greatest(table, parts, bent, 1.0))
        least = np.fmin(least, -self._greatest(-table, parts, bent, -1.0))
        poles = self._poles(table, parts, bent)
        most[poles | (most > UNBOUNDED * (1.0 + size))] = np.inf
        least[poles | (least < -UNBOUNDED * (1.0 + size))] = -np.inf
        return least, most

    def _greatest(self, table: Array, parts: Array, bent: Mask, sign: float) -> Rows:
        """The greatest values of sign times the nonlinear outputs, by golden sections around the greatest samples; else -inf."""
        best = np.where(np.isfinite(table), table, -np.inf)
        place, greatest = best.argmax(axis=0), np.full(bent.shape, -np.inf)
        output, point = np.nonzero(bent)
        at = place[output, point]
        low, high = parts[np.maximum(at - 1, 0)], parts[np.minimum(at + 1, SAMPLES - 1)]
        inward = parts[at] + NEAR * ((at == 0).astype(float) - (at == SAMPLES - 1))  # from an end it may fall
        rises = self._at(output, point, inward, sign) >= best.max(axis=0)[output, point]
        output, point = output[rises], point[rises]
        low, high = low[rises], high[rises]
        for _ in range(SECTIONS if output.size else 0):
            inner, outer = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            one, other = self._at(output, point, inner, sign), self._at(output, point, outer, sign)
            np.maximum.at(greatest, (output, point), np.maximum(one, other))
            low, high = np.where(one < other, inner, low), np.where(one < other, high, outer)
        return greatest

    def _poles(self, table: Array, parts: Array, bent: Mask) -> Mask:
        """Outputs whose sign changes between two samples through large values, not through zero."""
        poles = np.zeros(bent.shape, bool)
        piece, output, point = np.nonzero((table[:-1] * table[1:] < 0.0) & bent)
        low, high, first = parts[piece], parts[piece + 1], table[piece, output, point]
        size = np.abs(first) + np.abs(table[piece + 1, output, point])
        for _ in range(HALVINGS if piece.size else 0):
            middle = (low + high) / 2
            value = self._at(output, point, middle, 1.0)
            above = value * first > 0.0
            low, high = np.where(above, middle, low), np.where(above, high, middle)
            found = np.abs(value) > POLE * size
            poles[output[found], point[found]] = True
        return poles

    def _at(self, output: Index, point: Index, parts: Array, sign: float) -> Array:
        """Sign times some outputs at some points, each at its own position on the line; -inf if there is no value."""
        found = self.values(parts, point)[output, np.arange(parts.size)]
        return np.nan_to_num(sign * found, nan=-np.inf)


class ImplicitLine(StuckLine):
    """The same for implicit unknowns: they are solved for at every place, starting from an interpolation of the ends."""

    def __init__(self, solver: Solver, grid: Rows, first: Points, last: Points, where: Index) -> None:
        super().__init__(solver, grid, first, last, where)
        assert first.solved is not None
        assert last.solved is not None
        self.ends = first.solved.some(where), last.solved.some(where)

    def values(self, part: Array, points: Index) -> Rows:
        """All outputs at some points; nan if no solution is found with the modes of either end, the nearer one first."""
        first, last = (end.some(points) for end in self.ends)
        rest, sides, grid = self.resting[:, points], self.sides(part, points), self.grid[:, points]
        y, tau = ((1 - part)[:, None] * a + part[:, None] * b for a, b in ((first.y, last.y), (first.tau, last.tau)))
        nearer = np.where((part < 0.5)[:, None], first.modes, last.modes)
        found, left = np.full((self.solver.wanted, part.size), np.nan), np.arange(part.size)
        for modes in (nearer, first.modes + last.modes - nearer):
            near = replace(first, y=y, tau=tau, modes=modes).some(left)
            u, held, done = self.solver.between(grid[:, left], sides[:, left], rest[:, left], near)
            found[:, left] = np.where(done, self.solver.values(grid[:, left], u, held)[0], np.nan)
            left = left[~done]
            if not left.size:
                break
        return found
