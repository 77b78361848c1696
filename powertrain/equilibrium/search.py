"""Operating points whose only unknowns are modes: all combinations that known values do not rule out, group by group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Contact, Friction
from powertrain.equilibrium.choices import Group, LawModes, possible
from powertrain.equilibrium.points import NONE, OK, SEVERAL, Index, Mask, Points
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.symbols import Symbol
from powertrain.modes.tolerances import SAME
from powertrain.numerics.batch import Columns, Rows
from powertrain.numerics.buffers import Array

_COLUMNS = 1 << 15


@dataclass
class Trials:
    """Candidates for solutions, one per column: the point, the values so far, and what is known about it.

    ``values``: of the grid and the modes. ``rest``: laws at rest under a prescribed motion.
    """

    point: Index
    values: Rows
    rest: Mask

    def some(self, which: Index | Mask) -> Trials:
        """Copies of some of them."""
        return Trials(self.point[which], self.values[:, which], self.rest[:, which])

    def per_point(self, count: int) -> Index:
        """The number of candidates of each point."""
        return np.bincount(self.point, minlength=count)

    @classmethod
    def joined(cls, parts: Sequence[Trials]) -> Trials:
        """All candidates, in the order of their points."""
        names = ("point", "values", "rest")
        whole = cls(*(np.concatenate([getattr(part, name) for part in parts], axis=-1) for name in names))
        return whole.some(np.argsort(whole.point, kind="stable"))


class Combinations:
    """Solves one steady problem whose only unknowns are modes. Serves one thread."""

    def __init__(self, problem: Equilibrium, found: Sequence[LawModes], groups: Sequence[Group]) -> None:
        self._laws, self._searches = len(found), [Search(problem, found, group) for group in groups]

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        for search in self._searches:
            search.set_common(values)

    def solve(self, grid: Rows, side: Rows) -> Points:
        """The points of ``grid``; ``side`` as in ``Solver.solve``."""
        laws, count = self._laws, grid.shape[1]
        values, rest = np.vstack([grid, np.zeros((laws, count))]), np.zeros((laws, count), bool)
        trials = Trials(np.arange(count), values.copy(), rest.copy())
        status, involved = np.zeros(count, np.int8), np.zeros((laws, count), bool)
        for search in self._searches:
            before = trials
            trials, failure, about = search.extend(before, side)
            left, had = trials.per_point(count), before.per_point(count)
            ended = left[before.point] == 0
            lost = before.point[ended]
            values[:, lost], rest[:, lost] = before.values[:, ended], before.rest[:, ended]
            status[lost] = failure[ended]
            for k, law in zip(search.group.laws, about, strict=True):
                involved[k, lost] = law[ended]
                involved[k, left > had] = True
        found, best = np.unique(trials.point, return_index=True)
        values[:, found], rest[:, found] = trials.values[:, best], trials.rest[:, best]
        status[found] = np.where((trials.per_point(count) > 1)[found], SEVERAL, OK)
        return Points(values[:0], values[len(grid) :], status, involved, rest)

    def holds(self, grid: Rows, modes: Rows, apart: Mask) -> Mask:
        """Whether the modes of all laws except those ``apart`` hold."""
        values = np.vstack([grid, modes])
        return np.asarray(np.logical_and.reduce([search.holds(values, apart) for search in self._searches]))


class Search:
    """All combinations of the modes of a group. Serves one thread."""

    def __init__(self, problem: Equilibrium, found: Sequence[LawModes], group: Group) -> None:
        first = len(problem.grid)
        self.group, self.choices = group, [found[k] for k in group.laws]
        self.places = [first + k for k in group.laws]
        self.table = _Table(problem, self.choices)
        hidden = [problem.modes[k] for k in group.laws]
        margins = [possible(c, mode, hidden) for c in self.choices for mode in c.modes]
        varying = [*problem.grid, *problem.modes]
        self._possible = Columns("steady_possible", varying, problem.common, margins)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.table.set_common(values)
        self._possible.set_common(values)

    def extend(self, trials: Trials, side: Rows) -> tuple[Trials, NDArray[np.int8], Mask]:
        """All extensions of the trials by this group; the status of trials without any, and the laws of the group responsible."""
        count = trials.point.size
        status, involved = np.full(count, NONE, np.int8), np.ones((len(self.choices), count), bool)
        if not self.group.coupled:
            involved = self._take(trials, side)
            return trials.some(np.flatnonzero(~involved.any(axis=0))), status, involved
        found = [trials.some(np.zeros(0, np.intp))]
        patterns, which = np.unique(self._possible(trials.values) >= 0.0, axis=1, return_inverse=True)
        for g, pattern in enumerate(patterns.T):
            some, options = np.flatnonzero(which.ravel() == g), self._options(pattern)
            number = prod(map(len, options))
            for low in range(0, some.size if number else 0, max(1, _COLUMNS // max(number, 1))):
                here = some[low : low + max(1, _COLUMNS // number)]
                found.append(self._combine(trials.some(here), side, np.array(list(product(*options))).T))
        return Trials.joined(found), status, involved

    def holds(self, values: Rows, apart: Mask) -> Mask:
        """Whether the modes of the group's laws hold, except those ``apart``."""
        table, found = self.table.evaluate(values), np.ones(values.shape[1], bool)
        for i, (k, choice) in enumerate(zip(self.group.laws, self.choices, strict=True)):
            place = (values[self.places[i]][None, :] == np.array(choice.modes)[:, None]).argmax(axis=0)
            fine = np.take_along_axis(self.table.margins(table, i), place[None, :], 0)[0] >= 0.0
            found &= fine | apart[k]
        return found

    def _options(self, pattern: Mask) -> list[tuple[float, ...]]:
        """The modes of every law that a pattern allows."""
        fine = iter(pattern)
        return [tuple(mode for mode in choice.modes if next(fine)) for choice in self.choices]

    def _take(self, trials: Trials, side: Rows) -> Mask:
        """Give laws that depend only on known values their first mode that holds; return where a law has none."""
        table = self.table.evaluate(trials.values)
        involved = np.zeros((len(self.choices), trials.point.size), bool)
        for i, (k, choice) in enumerate(zip(self.group.laws, self.choices, strict=True)):
            holds = self.table.margins(table, i) >= 0.0
            modes = np.array(choice.modes)[holds.argmax(axis=0)]
            involved[i] = ~holds.any(axis=0)
            if choice.rest is not None:
                rests = involved[i] & (self.table.rest(table, i) >= 0.0)
                trials.rest[k] |= rests
                modes = np.where(rests, side[k, trials.point], modes)
                involved[i] &= ~rests
            trials.values[self.places[i]] = modes
        return involved

    def _combine(self, parents: Trials, side: Rows, modes: Rows) -> Trials:
        """Try all columns of ``modes`` with every parent; return the consistent ones."""
        count, number = parents.point.size, modes.shape[1]
        trials = parents.some(np.repeat(np.arange(count), number))
        trials.values[self.places] = np.tile(modes, count)
        found = trials.some(self._consistent(trials, side))
        return found.some(self._distinct(found))

    def _consistent(self, trials: Trials, side: Rows) -> Mask:
        """Whether the modes hold. Marks laws that rest under a prescribed motion."""
        table = self.table.evaluate(trials.values)
        holds: Mask = np.asarray(np.isfinite(self.table.signature(table)).all(axis=0))
        for i, (k, choice) in enumerate(zip(self.group.laws, self.choices, strict=True)):
            mode, margins = trials.values[self.places[i]], self.table.margins(table, i)
            place = (mode[None, :] == np.array(choice.modes)[:, None]).argmax(axis=0)
            fine = np.take_along_axis(margins, place[None, :], 0)[0] >= 0.0
            if choice.rest is not None:
                rests = ~(margins >= 0.0).any(axis=0) & (self.table.rest(table, i) >= 0.0)
                trials.rest[k] |= rests
                fine |= rests & (mode == side[k, trials.point])
            holds &= fine
        return holds

    def _distinct(self, trials: Trials) -> Index:
        """One representative of each distinct solution of a point."""
        marks = self.table.signature(self.table.evaluate(trials.values))
        kept, left = [], np.arange(trials.point.size)
        while left.size:
            heads = left[np.unique(trials.point[left], return_index=True)[1]]
            kept.append(heads)
            head = heads[np.searchsorted(trials.point[heads], trials.point[left])]
            same = np.abs(marks[:, left] - marks[:, head]) <= SAME * (1.0 + np.abs(marks[:, head]))
            left = left[~same.all(axis=0)]
        return np.sort(np.concatenate([*kept, left]))


class _Table:
    """All margins of some laws, and what distinguishes their modes, at many points; ``k`` is the number of a law among them."""

    def __init__(self, problem: Equilibrium, found: list[LawModes]) -> None:
        rows: list[Symbol] = []
        self._first, self._extra = [], []
        for c in found:
            self._first.append(len(rows))
            rows += c.margins.values()
            self._extra.append(len(rows))
            rows.append(Symbol(-1) if c.rest is None else c.rest)
            if isinstance(c.law, Friction):
                rows.append(c.law.torque)
            else:
                rows.append(c.law.force if isinstance(c.law, Contact) else c.law.g)
        varying = [*problem.grid, *problem.modes]
        self._columns = Columns("steady_laws", varying, problem.common, rows)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def evaluate(self, values: Rows) -> Rows:
        """The table for the values of grid, unknowns and modes, to be read with the other methods."""
        return self._columns(values)

    def margins(self, table: Rows, k: int) -> Rows:
        """One row per mode of a law, not negative where it holds."""
        return table[self._first[k] : self._extra[k]]

    def rest(self, table: Rows, k: int) -> Array:
        """Not negative where a law rests under a prescribed motion."""
        return np.asarray(table[self._extra[k]])

    def signature(self, table: Rows) -> Rows:
        """The torques of friction laws, the forces of contacts, the conditions of switches."""
        return table[[extra + 1 for extra in self._extra]]
