"""Operating points whose only unknowns are modes: all combinations that known values do not rule out, group by group.

Each mode that a law may have has a margin, which is not negative where the mode holds: those of ``steady_margins`` in
``powertrain.dae.friction``, ``contact`` and ``switch``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import casadi as ca
import numpy as np

from powertrain.compiler.matching import components
from powertrain.dae import contact, friction, switch
from powertrain.dae.friction import FREE
from powertrain.dae.hybrid import Contact, Friction, Law, Switch
from powertrain.dae.tolerances import INFINITE, SAME
from powertrain.equilibrium.points import NONE, OK, SEVERAL, Index, Mask, Points
from powertrain.equilibrium.system import Equilibrium, moved_by_unknowns
from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import Columns, Rows, dependence

_COLUMNS = 1 << 15


@dataclass(frozen=True)
class LawModes:
    """A law with a margin for each possible mode; ``rest`` is not negative where none holds because a prescribed motion rests."""

    law: Law
    margins: Mapping[float, Symbol]
    rest: Symbol | None = None

    @property
    def modes(self) -> tuple[float, ...]:
        """In the order in which they are tried."""
        return tuple(self.margins)


def choices(problem: Equilibrium) -> list[LawModes]:
    """The choice of every law of a steady problem."""
    return [_choice(law, moved) for law, moved in zip(problem.laws, moved_by_unknowns(problem), strict=True)]


def _choice(law: Law, moved: bool) -> LawModes:
    if isinstance(law, Switch):
        return LawModes(law, switch.steady_margins(law))
    if isinstance(law, Contact):
        return LawModes(law, contact.steady_margins(law, moved))
    return LawModes(law, friction.steady_margins(law), friction.steady_rest(law) if law.prescribed else None)


def possible(choice: LawModes, mode: float, hidden: Sequence[Symbol]) -> Symbol:
    """Negative where the given values alone rule out a mode; ``hidden`` symbols are unknown.

    While it is not known whether a law is free, nor whether it slides, the free mode need not be tried: between bounds of zero the law
    slides without torque anyway.
    """
    law, found = choice.law, [] if choice.rest is not None else [choice.margins[mode]]
    if isinstance(law, Friction) and mode != FREE:
        found += friction.necessary(law, mode)
    elif isinstance(law, Friction) and dependence([friction.width_margin(law), law.w], hidden).any(axis=1).all():
        return Symbol(-1)
    known = [margin for margin in found if not dependence([margin], hidden).any()]
    return ca.mmin(ca.vertcat(Symbol(0), *known))


@dataclass(frozen=True)
class Group:
    """Laws that depend on each other and on earlier groups, or, if not ``coupled``, on earlier groups only."""

    laws: list[int]
    coupled: bool


def order(problem: Equilibrium, found: Sequence[LawModes]) -> list[Group]:
    """All laws in groups, in the order in which they can be resolved: a law comes after those on whose modes its margins depend."""
    margins = [[*c.margins.values(), *([] if c.rest is None else [c.rest])] for c in found]
    graph = [np.flatnonzero(dependence(own, problem.modes).any(axis=0)).tolist() for own in margins]
    groups: list[Group] = []
    for members in map(sorted, components(graph)):
        coupled = len(members) > 1 or members[0] in graph[members[0]]
        last = groups[-1] if groups else None
        if last is not None and not coupled and not last.coupled and not set(last.laws) & set(graph[members[0]]):
            groups[-1] = Group([*last.laws, *members], False)
        else:
            groups.append(Group(members, coupled))
    return groups


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

    def solve(self, grid: Rows, side: Rows) -> Points:
        """The points of ``grid``; ``side`` as in ``Solver.solve``."""
        laws, count = self._laws, grid.shape[1]
        values, rest = np.vstack([grid, np.zeros((laws, count))]), np.zeros((laws, count), bool)
        trials = Trials(np.arange(count), values.copy(), rest.copy())
        status, involved = np.full(count, NONE, np.int8), np.zeros((laws, count), bool)
        for search in self._searches:
            before = trials
            trials, about = search.extend(before, side)
            left, had = trials.per_point(count), before.per_point(count)
            ended = left[before.point] == 0
            lost = before.point[ended]
            values[:, lost], rest[:, lost] = before.values[:, ended], before.rest[:, ended]
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
    """All combinations of the modes of a group. Serves one thread.

    Its table has for each law a row per mode with its margin, a row that is not negative where the law rests under a prescribed motion,
    and one that distinguishes solutions: the torque of a friction law, the force of a contact, the condition of a switch.
    """

    def __init__(self, problem: Equilibrium, found: Sequence[LawModes], group: Group) -> None:
        self.group, self.choices = group, [found[k] for k in group.laws]
        self.places = [len(problem.grid) + k for k in group.laws]
        self._margins: list[slice] = []
        rows, varying = list[Symbol](), [*problem.grid, *problem.modes]
        for c in self.choices:
            self._margins.append(slice(len(rows), len(rows) + len(c.modes)))
            law, rest = c.law, Symbol(-1) if c.rest is None else c.rest
            own = law.torque if isinstance(law, Friction) else law.force if isinstance(law, Contact) else law.g
            rows += [*c.margins.values(), rest, own]
        hidden = [problem.modes[k] for k in group.laws]
        margins = [possible(c, mode, hidden) for c in self.choices for mode in c.modes]
        self._table = Columns("steady_laws", varying, problem.common, rows)
        self._possible = Columns("steady_possible", varying, problem.common, margins)

    def extend(self, trials: Trials, side: Rows) -> tuple[Trials, Mask]:
        """All extensions of the trials by this group, and which of its laws are responsible where there are none."""
        if not self.group.coupled:
            involved = self._take(trials, side)
            return trials.some(np.flatnonzero(~involved.any(axis=0))), involved
        found = [trials.some(np.zeros(0, np.intp))]
        patterns, which = np.unique(self._possible(trials.values) >= 0.0, axis=1, return_inverse=True)
        for g, pattern in enumerate(patterns.T):
            some, options = np.flatnonzero(which.ravel() == g), self._options(pattern)
            number = prod(map(len, options))
            for low in range(0, some.size if number else 0, max(1, _COLUMNS // max(number, 1))):
                here = some[low : low + max(1, _COLUMNS // number)]
                found.append(self._combine(trials.some(here), side, np.array(list(product(*options))).T))
        return Trials.joined(found), np.ones((len(self.choices), trials.point.size), bool)

    def holds(self, values: Rows, apart: Mask) -> Mask:
        """Whether the modes of the group's laws hold, except those ``apart``."""
        table, found = self._table(values), np.ones(values.shape[1], bool)
        for i, k in enumerate(self.group.laws):
            found &= self._holds(table, i, values) | apart[k]
        return found

    def _holds(self, table: Rows, i: int, values: Rows) -> Mask:
        """Whether the mode of a law of the group holds."""
        place = (values[self.places[i]][None, :] == np.array(self.choices[i].modes)[:, None]).argmax(axis=0)
        return np.asarray(np.take_along_axis(table[self._margins[i]], place[None, :], 0)[0] >= 0.0)

    def _rests(self, table: Rows, i: int) -> Mask:
        """Whether a law of the group rests under a prescribed motion: no mode holds."""
        margins = self._margins[i]
        return np.asarray(~(table[margins] >= 0.0).any(axis=0) & (table[margins.stop] >= 0.0))

    def _options(self, pattern: Mask) -> list[tuple[float, ...]]:
        """The modes of every law that a pattern allows."""
        fine = iter(pattern)
        return [tuple(mode for mode in choice.modes if next(fine)) for choice in self.choices]

    def _take(self, trials: Trials, side: Rows) -> Mask:
        """Give laws that depend only on known values their first mode that holds; return where a law has none."""
        table = self._table(trials.values)
        involved = np.zeros((len(self.choices), trials.point.size), bool)
        for i, (k, choice) in enumerate(zip(self.group.laws, self.choices, strict=True)):
            holds, rests = table[self._margins[i]] >= 0.0, self._rests(table, i)
            modes = np.array(choice.modes)[holds.argmax(axis=0)]
            involved[i] = ~holds.any(axis=0) & ~rests
            trials.rest[k] |= rests
            trials.values[self.places[i]] = np.where(rests, side[k, trials.point], modes)
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
        table = self._table(trials.values)
        holds: Mask = np.asarray((np.abs(self._signature(table)) <= INFINITE).all(axis=0))
        for i, k in enumerate(self.group.laws):
            rests = self._rests(table, i)
            trials.rest[k] |= rests
            rests &= trials.values[self.places[i]] == side[k, trials.point]
            holds &= self._holds(table, i, trials.values) | rests
        return holds

    def _signature(self, table: Rows) -> Rows:
        return table[[margins.stop + 1 for margins in self._margins]]

    def _distinct(self, trials: Trials) -> Index:
        """One representative of each distinct solution of a point."""
        marks = self._signature(self._table(trials.values))
        kept, left = [], np.arange(trials.point.size)
        while left.size:
            heads = left[np.unique(trials.point[left], return_index=True)[1]]
            kept.append(heads)
            head = heads[np.searchsorted(trials.point[heads], trials.point[left])]
            same = np.abs(marks[:, left] - marks[:, head]) <= SAME * (1.0 + np.abs(marks[:, head]))
            left = left[~same.all(axis=0)]
        return np.sort(np.concatenate([*kept, left]))
