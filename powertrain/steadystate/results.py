"""Results at the points of a map: values, status, the laws it concerns, and intervals if values are not unique."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.dae.tolerances import ALIKE
from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import LARGEST, NONE, OK, OUTSIDE, SEVERAL, STUCK_POINT, UNDEFINED, Points
from powertrain.language.reals import Array
from powertrain.numerics.batch import Rows
from powertrain.steadystate.intervals import ranges

MOST_LAWS = 62
"""Number of laws that can have a bit in the results."""


@dataclass(frozen=True)
class Look:
    """Options of a map: the values at one ``side`` of laws at rest, the ``first`` of several solutions."""

    side: int | None = None
    first: bool = False


@dataclass(frozen=True)
class DataVariable:
    """What a map gives at every point: a requested signal, or the rate of a held one."""

    name: str
    unit: str
    doc: str


class MapResults:
    """The results of all points, flat, in the order of the grid.

    If ``solved`` is a list, it collects the solutions with modes and unknowns, block by block.
    """

    def __init__(self, solver: Solver, count: int, size: int, look: Look) -> None:
        self.solver, self.count, self.size, self.look = solver, count, size, look
        self.rows = [np.empty(size) for _ in range(self.count)]
        self.status = np.zeros(size, np.int8)
        self.involved: NDArray[np.int64] | None = None
        self.solved: list[Points] | None = None
        self._ends: list[tuple[NDArray[np.intp], Rows, Rows]] = []
        self._resting: list[tuple[Rows, NDArray[np.intp]]] = []

    def solve(self, grid: Rows, places: NDArray[np.intp], later: bool = False) -> Array | None:
        """Solve points, the numbers of which are ``places``, and store them; return the modes of the first good one.

        ``later``: points with laws at rest are left to ``finish``, because intervals of many points take hardly more time than one.
        """
        end = self.look.side
        side = None if end is None else np.full((len(self.solver.choices), grid.shape[1]), float(end))
        points = self.solver.solve(grid, side)
        if self.solved is not None:
            self.solved.append(points)
        values, left = self.solver.values(grid, points.u, points.modes)
        status = points.status
        alike = np.zeros(values.shape, bool)
        resting = (status == OK) & points.rest.any(axis=0)
        if later:
            self._resting.append((grid[:, resting], places[resting]))
            status[resting] = STUCK_POINT
        waiting = np.flatnonzero(resting & (not later))
        while waiting.size:  # only laws at rest have two ends
            pattern = points.rest[:, waiting[0]]
            same = (points.rest[:, waiting] == pattern[:, None]).all(axis=0)
            where, waiting = waiting[same], waiting[~same]
            low, high, ends = ranges(self.solver, grid[:, where], np.flatnonzero(pattern))
            solved = ends == OK
            status[where] = np.where(solved, STUCK_POINT, np.where(ends == SEVERAL, SEVERAL, NONE))
            alike[:, where] = solved & (high - low <= ALIKE * np.maximum(np.abs(low), np.abs(high)))
            points.involved[:, where] = points.rest[:, where]
            inside = solved & ~left[:, where].any(axis=0)
            self._ends.append((places[where[inside]], low[:, inside], high[:, inside]))
        shown = (status == OK) | (status == STUCK_POINT) | ((status == SEVERAL) & self.look.first)
        outside = shown & left.any(axis=0)
        status[outside] = OUTSIDE
        undefined = (status == OK) & ~np.isfinite(values).all(axis=0)
        status[undefined] = UNDEFINED
        given = (status == OK) | undefined
        given |= (status == STUCK_POINT) & (end is not None)
        given |= (status == SEVERAL) & self.look.first
        values[~given & ~alike] = np.nan
        values[:, undefined] = np.where(np.isfinite(values[:, undefined]), values[:, undefined], np.nan)
        for row, found in zip(self.rows, values, strict=True):
            row[places] = found
        self.status[places] = status
        self._note(places, np.vstack([points.involved, left & outside]), status)
        good = np.flatnonzero(status == OK)
        return points.modes[:, good[0]].copy() if good.size else None

    def finish(self) -> None:
        """Solve the points that were left for later."""
        if not self._resting:
            return
        grid, places = (np.concatenate(parts, axis=-1) for parts in zip(*self._resting, strict=True))
        self._resting.clear()
        for low in range(0, places.size, LARGEST):
            self.solve(grid[:, low : low + LARGEST], places[low : low + LARGEST])

    def _note(self, places: NDArray[np.intp], involved: NDArray[np.bool_], status: NDArray[np.int8]) -> None:
        hit = (status != OK) & (status != UNDEFINED) & involved.any(axis=0)
        if not hit.any():
            return
        if self.involved is None:
            self.involved = np.zeros(self.size, np.int64)
        weights = np.array([1 << k if k < MOST_LAWS else 0 for k in range(len(involved))], np.int64)
        self.involved[places[hit]] = weights @ involved[:, hit]

    @property
    def intervals(self) -> tuple[list[Array], list[Array]] | None:
        """Least and greatest values at all points, if any point is stuck."""
        if not self._ends:
            return None
        both = ([r.copy() for r in self.rows], [r.copy() for r in self.rows])
        for places, low, high in self._ends:
            for rows, values in zip(both, (low, high), strict=True):
                for row, value in zip(rows, values, strict=True):
                    row[places] = value
        return both


def block(values: Sequence[Array], low: int, high: int) -> Rows:
    """Some points of axes, one row per axis."""
    return np.array([v[low:high] for v in values]).reshape(len(values), high - low)
