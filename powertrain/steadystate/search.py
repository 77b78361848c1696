"""The modes of one group of laws, and the unknowns that depend on them: all combinations that what is known does not rule out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray

from powertrain.engine.buffers import Array
from powertrain.steadystate.choices import Choice, Group, possible
from powertrain.steadystate.columns import Columns
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows
from powertrain.steadystate.newton import DIVERGED as LOST
from powertrain.steadystate.newton import SINGULAR
from powertrain.steadystate.points import DIVERGED, NONE, Index, Mask, Trials
from powertrain.steadystate.stage import Stage
from powertrain.steadystate.turns import turns
from powertrain.steadystate.unknowns import Unknowns

COMBINATIONS, MOST = 4096, 1 << 18
"""How many are tried at a point, and how many if that is asked for."""
_COLUMNS = 1 << 15
_SPEEDS, _ALWAYS = (10.0, 100.0, 30.0, 1.0, 300.0), 2
"""With what speeds of laws that slide Newton's method begins: with the first two always, then as long as nothing was found."""
_SAME = 1e-9


class Search(Stage):
    """All combinations of the modes of a group. Serves one thread."""

    def __init__(self, problem: Equilibrium, found: Sequence[Choice], group: Group) -> None:
        super().__init__(problem, found, group)
        hidden = [*(problem.u[j] for j in group.unknowns), *(problem.modes[k] for k in group.laws)]
        varying = [*problem.grid, *problem.u, *problem.modes]
        margins = [possible(c, mode, hidden) for c in self.choices for mode in c.modes]
        self._possible = Columns("steady_possible", varying, problem.common, margins)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        super().set_common(values)
        self._possible.set_common(values)

    def extend(self, trials: Trials, side: Rows, exhaustive: bool) -> tuple[Trials, NDArray[np.int8], Mask]:
        """All that the trials may become; why any becomes nothing, and which laws of the group that is about."""
        count = trials.point.size
        status, blame = np.full(count, NONE, np.int8), np.ones((len(self.choices), count), bool)
        if not self.group.coupled:
            blame = self._take(trials, side)
            return trials.some(np.flatnonzero(~blame.any(axis=0))), status, blame
        found = [trials.some(np.zeros(0, np.intp))]
        patterns, which = np.unique(self._possible(trials.values) >= 0.0, axis=1, return_inverse=True)
        for g, pattern in enumerate(patterns.T):
            some, options = np.flatnonzero(which.ravel() == g), self._options(pattern)
            number = prod(map(len, options))
            if not number:
                continue
            step = max(1, _COLUMNS // number)
            for low in range(0, some.size, step):
                here = some[low : low + step]
                if number > (MOST if exhaustive else COMBINATIONS):
                    extended, lost = turns(self, trials.some(here), side, options), np.ones(here.size, bool)
                else:
                    extended, lost = self._combine(trials.some(here), side, np.array(list(product(*options))).T)
                status[here[lost]] = DIVERGED
                found.append(extended)
        return Trials.joined(found), status, blame

    def _options(self, pattern: Mask) -> list[tuple[float, ...]]:
        """The modes of every law that a pattern allows."""
        fine = iter(pattern)
        return [tuple(mode for mode in choice.modes if next(fine)) for choice in self.choices]

    def _take(self, trials: Trials, side: Rows) -> Mask:
        """Gives laws that depend on what is known the first mode that holds; where a law has none."""
        table = self.table.evaluate(trials.values)
        blame = np.zeros((len(self.choices), trials.point.size), bool)
        for i, (k, choice) in enumerate(zip(self.group.laws, self.choices, strict=True)):
            holds = self.table.margins(table, i) >= 0.0
            modes = np.array(choice.modes)[holds.argmax(axis=0)]
            blame[i] = ~holds.any(axis=0)
            if choice.rest is not None:
                rests = blame[i] & (self.table.rest(table, i) >= 0.0)
                trials.rest[k] |= rests
                modes = np.where(rests, side[k, trials.point], modes)
                blame[i] &= ~rests
            trials.values[self.places[i]] = modes
        return blame

    def _combine(self, parents: Trials, side: Rows, modes: Rows) -> tuple[Trials, Mask]:
        """Tries all columns of ``modes`` with every parent: what is consistent, and for which of them no unknowns were found."""
        count, number = parents.point.size, modes.shape[1]
        trials = parents.some(np.repeat(np.arange(count), number))
        trials.point = np.repeat(np.arange(count), number)
        trials.values[self.places] = np.tile(modes, count)
        side = side[:, parents.point]
        if self.unknowns is None:
            found, lost = trials.some(self._consistent(trials, side)), np.zeros(count, bool)
        else:
            found, lost = self._solved(self.unknowns, trials, side, count)
        found = found.some(self._distinct(found))
        found.point = parents.point[found.point]
        return found, lost

    def _solved(self, unknowns: Unknowns, trials: Trials, side: Rows, count: int) -> tuple[Trials, Mask]:
        """The trials with their unknowns, where these were found and the modes hold; and for which points none were found."""
        found, lost = trials.some(np.zeros(0, np.intp)), np.ones(count, bool)
        sides, again = unknowns.sides(trials.values), np.ones(trials.point.size, bool)
        for k, speed in enumerate(_SPEEDS):
            where = np.flatnonzero(again & ~np.isin(trials.point, found.point) if k >= _ALWAYS else again)
            if not where.size:
                break
            here = trials.some(where)
            u, outcome, again[where] = unknowns.solve(here.values, sides[:, where], speed)
            lost[here.point[outcome != LOST]] = False
            here.values[unknowns.places] = u
            here.loose = here.loose | (outcome == SINGULAR)
            here = here.some(outcome <= SINGULAR)
            found = Trials.joined([found, here.some(self._consistent(here, side))])
        return found, lost

    def _consistent(self, trials: Trials, side: Rows) -> Mask:
        """Whether the modes hold. Notes the laws that rest under a prescribed motion."""
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
        """One of all that are the same solution of the same point."""
        marks = self.table.signature(self.table.evaluate(trials.values))
        if self.unknowns is not None:
            marks = np.vstack([trials.values[self.unknowns.places], marks])
        kept, left = [], np.arange(trials.point.size)
        while left.size:
            heads = left[np.unique(trials.point[left], return_index=True)[1]]
            kept.append(heads)
            head = heads[np.searchsorted(trials.point[heads], trials.point[left])]
            same = np.abs(marks[:, left] - marks[:, head]) <= _SAME * (1.0 + np.abs(marks[:, head]))
            left = left[~same.all(axis=0)]
        return np.sort(np.concatenate([*kept, left]))
