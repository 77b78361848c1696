"""One question about a plant, prepared once: given, unknown and requested quantities. Solves any grid."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import LARGEST, OK
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.reals import Array
from powertrain.numerics.batch import Rows
from powertrain.steadystate.axes import Grid
from powertrain.steadystate.known_modes import KnownModes
from powertrain.steadystate.results import DataVariable, Look, MapResults, block
from powertrain.steadystate.rowwise import RowMap, RowPieces, make_plan

_FAST = 2048
_SHORT_ROW = 64
_PATIENCE = 2.0
"""Seconds without a progress bar."""


class SteadyMap:
    """One question about a plant: given, unknown and requested quantities. Solves any grid."""

    def __init__(
        self,
        problem: Equilibrium,
        quantities: list[DataVariable],
        parameters: Array,
        given: frozenset[str],
        compile: bool,
    ) -> None:
        self._given = given
        self.problem, self.quantities, self._parameters = problem, quantities, parameters
        self.solver = Solver(problem, compile)
        self._rows = None if problem.u else RowMap(KnownModes(problem, self.solver, compile))
        self._orders: dict[Any, list[str]] = {}
        self._plans: dict[Any, RowPieces | None] = {}

    def valid(self, parameters: Array) -> bool:
        """Whether the formulation is also valid for these parameters."""
        return not self.problem.together or np.array_equal(parameters, self._parameters)

    def run(self, grid: Grid, look: Look, progress: bool | None, *, keep: bool = False) -> tuple[Grid, MapResults]:
        """Solve all points of a grid; return the grid, with its dimensions in the order of the results, and the results.

        ``keep``: with modes and unknowns of every point, so every point is solved on its own.
        """
        if grid.size >= _FAST and not keep and self._rows is not None:
            return self._in_known_modes(self._rows, grid, look, progress)
        results = MapResults(self.solver, len(self.quantities), grid.size, look)
        results.solved = [] if keep else None
        bar = Bar(progress, grid.size)
        values = grid.points()
        for low in range(0, grid.size, LARGEST):
            high = min(low + LARGEST, grid.size)
            results.solve(block(values, low, high), np.arange(low, high))
            bar.reach(high)
        bar.close()
        return grid, results

    def _in_known_modes(self, rows: RowMap, grid: Grid, look: Look, progress: bool | None) -> tuple[Grid, MapResults]:
        """The map of an explicit model, in few combinations of modes."""
        ordered, bar = self._slowest_first(grid), Bar(progress, grid.size)
        results = MapResults(self.solver, len(self.quantities), ordered.size, look)
        finite = self._by_rows(rows, results, ordered, bar)
        if finite is None:
            self._by_points(rows.known, results, np.arange(ordered.size), ordered.points(), results.rows, bar.reach)
        if not finite:
            self._look_again(results, ordered)
        results.finish()
        bar.close()
        return ordered, results

    def _slowest_first(self, grid: Grid) -> Grid:
        """The grid with the dimensions first along which modes change most."""
        identity = grid.identity()
        if identity not in self._orders:
            shape, rows = grid.sample(512)
            modes = self.solver.solve(rows).modes.reshape(-1, *shape)
            changes = [
                float((np.diff(modes, axis=i + 1) != 0).any(axis=0).mean() if n > 1 else 0.0) * n
                for i, n in enumerate(shape)
            ]
            # Torques are affine in inputs, but not in most parameters.
            curved = [any(d in a.dims and a.name in self._given for a in grid.axes) for d in grid.dims]
            best = sorted(range(len(shape)), key=lambda i: (-changes[i], grid.shape[i] >= _SHORT_ROW, not curved[i], i))
            self._orders = {identity: [grid.dims[i] for i in best]}
            self._plans.clear()
        return grid.ordered(self._orders[identity])

    def _by_rows(self, by_rows: RowMap, results: MapResults, grid: Grid, bar: Bar) -> bool | None:
        """Fill the map by rows along the last dimension, if only one axis changes along it; whether all values are known to be finite."""
        last = [i for i, a in enumerate(grid.axes) if grid.dims[-1] in a.dims]
        if len(last) != 1 or grid.axes[last[0]].dims != (grid.dims[-1],) or grid.shape[-1] < _SHORT_ROW:
            return None
        fast, x = last[0], np.ascontiguousarray(grid.axes[last[0]].values)
        slow = grid.rows(fast)

        def points(rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Rows:
            values = np.insert(slow[:, rows], fast, x[columns], axis=0)
            found = self.solver.solve(values)
            for k in np.flatnonzero(found.status == OK)[:: max(1, rows.size // 64)]:
                by_rows.known.enter(found.modes[:, k])
            return found.modes

        identity = grid.identity()
        if identity not in self._plans:
            self._plans[identity] = make_plan(slow.shape[1], x.size, points)
        plan = self._plans[identity]
        if plan is None:
            return None

        def rest(places: NDArray[np.intp]) -> None:
            found = [np.empty(places.size) for _ in results.rows]
            self._by_points(by_rows.known, results, places, list(grid.at(places)), found, lambda _: None)
            for row, values in zip(results.rows, found, strict=True):
                row[places] = values

        return by_rows.fill(fast, x, slow, plan, results.rows, rest, bar.reach)

    def _by_points(
        self,
        known: KnownModes,
        results: MapResults,
        places: NDArray[np.intp],
        values: list[Array],
        found: list[Array],
        done: Callable[[int], None],
    ) -> None:
        """The points with these numbers and ``values`` of the axes; requested values go into ``found``."""

        def careful(low: int, high: int) -> Array | None:
            modes = results.solve(block(values, low, high), places[low:high], later=True)
            for row, whole in zip(found, results.rows, strict=True):
                row[low:high] = whole[places[low:high]]
            return modes

        known.fill(places.size, values, found, careful, done)

    @np.errstate(all="ignore")
    def _look_again(self, results: MapResults, grid: Grid) -> None:
        """Solve points with values that are not finite one by one, which gives the reason."""
        suspects = np.zeros(results.size, bool)
        for row in results.rows:
            if not math.isfinite(float(np.add.reduce(row))):
                suspects |= ~np.isfinite(row)
        where = np.flatnonzero(suspects & (results.status == OK))
        for low in range(0, where.size, LARGEST):
            some = where[low : low + LARGEST]
            results.solve(grid.at(some), some)


class Bar:
    """A progress bar over points: always, never, or (None) if the computation takes more than two seconds."""

    def __init__(self, wanted: bool | None, total: int) -> None:
        self._wanted, self._total = wanted, total
        self._bar: Any = None
        self._start = time.perf_counter()

    def reach(self, count: int) -> None:
        """Set the number of points that are done."""
        if self._wanted is False:
            return
        if self._bar is None and (self._wanted or time.perf_counter() - self._start > _PATIENCE):
            from tqdm.auto import tqdm

            self._bar = tqdm(total=self._total, unit=" points", desc="steady")
        if self._bar is not None:
            self._bar.update(count - self._bar.n)

    def close(self) -> None:
        """The end."""
        if self._bar is not None:
            self._bar.close()
