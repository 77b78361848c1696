"""Operating points, many at once: the modes of all laws found together, point by point with a status.

Where the speeds do not depend on torques, the laws fall into groups that are resolved one after the other, and every combination inside a
group is tried: so none, one or several solutions are told apart. Where unknowns are implicit, they are found together with the modes.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from powertrain.compiler.hybrid import Friction
from powertrain.engine.buffers import Array
from powertrain.engine.indicators import guard_margin
from powertrain.steadystate.choices import FORWARD, INFINITE, choices, order
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.implicit import Implicit
from powertrain.steadystate.lanes import Rows, Tape
from powertrain.steadystate.points import IMMOVABLE, NONE, OK, SEVERAL, Index, Mask, Points
from powertrain.steadystate.table import LANES, Table

_SAME = 1e-9


class Solver:
    """Solves one steady problem at given points. Serves one thread."""

    def __init__(self, problem: Equilibrium) -> None:
        self.problem = problem
        self.choices = choices(problem)
        self.groups = order(self.choices, problem.modes)
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._table = Table(problem, self.choices, varying)
        guards = [guard_margin(g) for g in problem.guards]
        self.values_tape = Tape(
            "steady_values", varying, problem.common, [*problem.outputs, *problem.rates, *guards], LANES
        )
        self.wanted = len(problem.outputs) + len(problem.rates)
        self.implicit = Implicit(problem, self.choices, self._table) if problem.u else None

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.common = values.copy()
        for each in (self._table.tape, self.values_tape, self.implicit):
            if each is not None:
                each.set_common(values)

    def solve(self, grid: Rows, side: Rows | None = None, exhaustive: bool = False) -> Points:
        """The points of ``grid`` (one row per axis); ``side`` says for laws at rest from which side (1 or -1) they are looked at."""
        with np.errstate(all="ignore"):
            if side is None:
                side = np.ones((len(self.choices), grid.shape[1]))
            if self.implicit is not None:
                return self.implicit.solve(grid, side, exhaustive)
            return self._explicit(grid, side)

    def values(self, grid: Rows, points: Points) -> tuple[Rows, Mask]:
        """The wanted values, and which guards are left."""
        found = self.values_tape(np.vstack([grid, points.u, points.modes]))
        return found[: self.wanted], ~(found[self.wanted :] >= 0.0)

    def _explicit(self, grid: Rows, side: Rows) -> Points:
        points = Points.empty(0, len(self.choices), grid.shape[1])
        points.modes[:] = [
            [c.modes[0] if isinstance(c.law, Friction) is False else FORWARD] for c in self.choices
        ] or 0.0
        ready: list[int] = []
        for group, coupled in self.groups:
            if coupled:
                self._assign(grid, points, ready, side)
                ready = []
                self._enumerate(grid, points, group, np.flatnonzero(points.status == OK), side)
            elif any(self._table.needs(group[0], j) for j in ready):
                self._assign(grid, points, ready, side)
                ready = list(group)
            else:
                ready += group
        self._assign(grid, points, ready, side)
        self._immovable(grid, points)
        return points

    def _assign(self, grid: Rows, points: Points, laws: list[int], side: Rows) -> None:
        """Modes of laws that depend on modes already found only."""
        if not laws:
            return
        table = self._table.evaluate(grid, points.u, points.modes)
        for k in laws:
            self._take(table, points, k, side)

    def _take(self, table: Rows, points: Points, k: int, side: Rows) -> None:
        choice = self.choices[k]
        holds = self._table.margins(table, k) >= 0.0
        first = holds.argmax(axis=0)
        points.modes[k] = np.array(choice.modes)[first]
        found = holds.any(axis=0)
        if choice.rest is not None:
            rests = ~found & (self._table.rest(table, k) >= 0.0)
            points.rest[k] |= rests
            points.modes[k] = np.where(rests, side[k], points.modes[k])
            found |= rests
        lost = ~found & (points.status == OK)
        points.status[lost] = NONE
        points.blame[k, lost] = True

    def _enumerate(self, grid: Rows, points: Points, group: list[int], where: Index, side: Rows) -> None:
        """Tries all combinations of the modes of a group at some points."""
        if not where.size:
            return
        count = np.zeros(where.size, int)
        best = np.zeros((len(self.choices), where.size))
        rest = np.zeros((len(self.choices), where.size), bool)
        mark: Rows | None = None
        for combination in product(*(self.choices[k].modes for k in group)):
            modes = points.modes[:, where].copy()
            modes[group] = np.array(combination)[:, None]
            holds, resting, signature = self._consistent(
                grid[:, where], points.u[:, where], modes, group, side[:, where]
            )
            if mark is None:
                mark = np.full(signature.shape, np.nan)
            same = np.abs(signature - mark) <= _SAME * (1.0 + np.abs(mark))
            new = holds & ~((count > 0) & same.all(axis=0))
            count += new
            first = new & (count == 1)
            best[:, first], mark[:, first], rest[:, first] = modes[:, first], signature[:, first], resting[:, first]
        good = count > 0
        points.modes[:, where[good]] = best[:, good]
        points.rest[:, where[good]] |= rest[:, good]
        for state, hit in ((NONE, count == 0), (SEVERAL, count > 1), (OK, count == 1)):
            points.status[where[hit]] = state
            points.blame[np.ix_(np.array(group), where[hit])] = state != OK

    def _consistent(self, grid: Rows, u: Rows, modes: Rows, group: list[int], side: Rows) -> tuple[Mask, Mask, Rows]:
        """Whether the modes of a group hold, which of its laws rest under a prescribed motion, and the values that tell solutions apart."""
        table = self._table.evaluate(grid, u, modes)
        holds, resting = np.ones(grid.shape[1], bool), np.zeros(modes.shape, bool)
        for k in group:
            margins = self._table.margins(table, k)
            values = np.array(self.choices[k].modes)
            place = (modes[k][None, :] == values[:, None]).argmax(axis=0)
            fine = margins[place, np.arange(margins.shape[1])] >= 0.0
            if self.choices[k].rest is not None:
                rests = ~(margins >= 0.0).any(axis=0) & (self._table.rest(table, k) >= 0.0)
                resting[k] = rests & (modes[k] == side[k])
                fine |= resting[k]
            holds &= fine
        signature = np.vstack([self._table.signature(table, k) for k in group])
        return holds & np.isfinite(signature).all(axis=0), resting, signature

    def _immovable(self, grid: Rows, points: Points) -> None:
        """Points where speeds, or what has to be found, are not finite."""
        table = self._table.evaluate(grid, points.u, points.modes)
        lost = ~(np.abs(self._table.speeds(table)) <= INFINITE).all(axis=0)
        points.status[lost] = IMMOVABLE
        points.blame[:, lost] = False
