"""Fast evaluation of a map: neighbouring points mostly have the same modes, and in given modes little arithmetic remains.

Every combination of modes gets an expression tape specialised to it. The tape gives the requested values, and a flag that is set where
these modes, and no others, hold. It runs ahead until the flag fails; then the next combination takes over. Where neighbours differ, one
tape of all combinations is used. Only points that no known combination fits are left to the solver, and those in modes with too many
other combinations to exclude.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from math import prod

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.dae.hybrid import Friction, Switch
from powertrain.dae.tolerances import EPS, INFINITE
from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.system import Equilibrium, with_modes
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.modes.guards import guard_margin
from powertrain.numerics.batch import LANES, Tape, all_hold, column_tape, dependence, different, separated
from powertrain.numerics.vectorised import VectorTape

WIDTHS = (128, 1024, 4096)
_TAPES = 64
_SHORT_RUN, _SHORT_RUNS = 32, 4
_ALTERNATIVES = 64
_LARGEST = 16384
"""Points that the solver takes together where combinations cannot be known."""
Key = tuple[float, ...]
Careful = Callable[[int, int], Array | None]
"""Solves the points from the first to before the last one by one, stores them, and returns the modes of the first good one."""


class Walker:
    """Tapes for the combinations of modes of one explicit steady problem. Serves one thread."""

    def __init__(self, problem: Equilibrium, solver: Solver, compile: bool = False) -> None:
        self._compile = compile
        self.problem, self.choices, self.groups = problem, solver.choices, solver.groups
        self._wanted = [*problem.outputs, *problem.rates]
        found = [*problem.solved, *(law.torque for law in problem.laws if isinstance(law, Friction))]
        self._guards = [margin for e in found for margin in (INFINITE - e, INFINITE + e)]
        self._guards += [guard_margin(g) for g in problem.guards]
        self._switches = [k for k, c in enumerate(self.choices) if isinstance(c.law, Switch)]
        self._relevant: dict[Key, list[int]] = {}
        self._parts: dict[Key, tuple[list[Symbol], list[Symbol], list[list[Symbol]]]] = {}
        self.keys: list[Key] = []
        self._tapes: dict[tuple[Key, int], Tape | VectorTape] = {}
        self.common: Array = np.zeros(1)
        self._fits, self._width = np.empty(max(*WIDTHS, VectorTape.most)), WIDTHS[-1]
        self._all: tuple[int, Tape | VectorTape] | None = None
        self._called = 0
        self._refused: set[Key] = set()

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.common = values.copy()
        for each in self._tapes.values():
            each.set_common(values)

    def walk(
        self,
        count: int,
        arguments: Sequence[Array],
        results: Sequence[Array],
        careful: Careful,
        done: Callable[[int], None],
    ) -> None:
        """Fill the first ``count`` points of ``results``; points beyond them, up to the largest width, are overwritten with no meaning."""
        i, level, current, short, mixed, block = 0, 0, next(iter(self.keys), None), 0, False, LANES
        while i < count:
            if mixed or short >= _SHORT_RUNS:
                last, runs = self._mixed(i, count, arguments, results, careful)
                i, mixed, short = last, last - i < _SHORT_RUN * runs, 0
                done(i)
                continue
            fits = 0
            for candidate in self._candidates(current):
                fits, full = self._run(candidate, level, i, arguments, results)
                if fits:
                    current = candidate
                    level = min(level + 1, len(WIDTHS) - 1) if full else 0
                    break
                level = 0
            short = short + 1 if fits < _SHORT_RUN else 0
            if fits:
                i, block = min(i + fits, count), LANES
            else:
                last = min(i + block, count)
                modes = careful(i, last)
                found = None if modes is None else self.enter(modes)
                block = LANES if modes is None or found is not None else min(2 * block, _LARGEST)
                i, current = last, found
            done(i)

    def _mixed(
        self, first: int, count: int, arguments: Sequence[Array], results: Sequence[Array], careful: Careful
    ) -> tuple[int, int]:
        """Points whose neighbours have other modes, with all combinations at once. Returns where they end, and the number of runs."""
        union = self._union()
        last = min(first + self._width, count)
        some = slice(first, max(last, first + union.least))
        union.into([a[some] for a in arguments], [*(r[some] for r in results), self._fits[: some.stop - first]])
        which = self._fits[: last - first]
        left = first + np.flatnonzero(which == 0.0)
        self._width = WIDTHS[-1] if left.size else min(2 * self._width, union.most)
        while left.size:
            start = int(left[0])
            end = min(start + LANES, last)
            modes = careful(start, end)
            self._called += 1
            if modes is not None:
                self.enter(modes)
            left = left[left >= end]
        return last, 1 + int(np.count_nonzero(np.diff(which)))

    def _union(self) -> Tape | VectorTape:
        """The requested values of the first combination that fits, and its number from one; zeros if none fits.

        It is rebuilt for new combinations after as many calls of the solver as there are combinations, which takes as long as rebuilding.
        """
        if self._all is None or self._all[0] < len(self.keys) <= self._called:
            open_, found = Symbol(1), [Symbol(0)] * (len(self._wanted) + 1)
            for number, key in enumerate(self.keys, 1):
                *values, fits = self._expressions(key)
                first, open_ = fits * open_, open_ * (1 - fits)
                found = [f + ca.if_else(first, v, 0) for f, v in zip(found, [*values, Symbol(number)], strict=True)]
            self._all, self._called = (len(self.keys), self._made(found, WIDTHS[-1], self._compile)), 0
        self._all[1].set_common(self.common)
        return self._all[1]

    def _candidates(self, current: Key | None) -> list[Key]:
        return self.keys if current is None else [current, *(k for k in self.keys if k != current)]

    def _run(
        self, key: Key, level: int, i: int, arguments: Sequence[Array], results: Sequence[Array]
    ) -> tuple[int, bool]:
        """The number of points from i on that fit, and whether all that were tried did."""
        width = WIDTHS[level]
        fits = self._fits[:width]
        self._tape(key, level).into([a[i : i + width] for a in arguments], [*[r[i : i + width] for r in results], fits])
        first = int(fits.argmin())
        return (width, True) if fits[first] else (first, False)

    def _tape(self, key: Key, level: int) -> Tape | VectorTape:
        if (key, level) not in self._tapes:
            self._tapes[key, level] = self._made(self._expressions(key), WIDTHS[level])
            self._tapes[key, level].set_common(self.common)
        return self._tapes[key, level]

    def _made(self, expressions: list[Symbol], width: int, compile: bool = False) -> Tape | VectorTape:
        problem = self.problem
        return column_tape("steady_walk", problem.grid, problem.common, list(ca.cse(expressions)), width, compile)

    def enter(self, modes: Array) -> Key | None:
        """The combination for some modes; switches without influence are set to zero. None if there are too many, or too many rivals."""
        laws = tuple(float(m) for k, m in enumerate(modes) if k not in self._switches)
        given = {k: float(m) for k, m in enumerate(modes) if k not in self._switches}
        if laws not in self._relevant:
            self._relevant[laws] = self._influential(given)
        relevant = set(self._relevant[laws]) | set(given)
        key = tuple(float(m) if k in relevant else 0.0 for k, m in enumerate(modes))
        if key in self.keys:
            return key
        if len(self.keys) >= _TAPES or key in self._refused:
            return None
        if any(prod(len(self.choices[k].modes) for k in members) > _ALTERNATIVES for members in self._members(key)):
            self._refused.add(key)
            return None
        self.keys.append(key)
        return key

    def _influential(self, given: dict[int, float]) -> list[int]:
        """The switches on which the requested values and the margins depend, for given modes of the other laws."""
        modes = self.problem.modes
        margins = [self.choices[k].margins[m] for k, m in given.items() if m in self.choices[k].modes]
        conditions = [c.law.g if isinstance(c.law, Switch) else Symbol(0) for c in self.choices]
        base = [*self._wanted, *self._guards, *margins]
        put = with_modes([*base, *conditions], modes, given)
        found = dependence(put, modes)
        wanted = np.asarray(found[: len(base)].any(axis=0))
        while True:
            more = np.asarray(wanted | found[len(base) :][wanted].any(axis=0))
            if (more == wanted).all():
                break
            wanted = more
        return [k for k in self._switches if wanted[k]]

    def parts(self, key: Key) -> tuple[list[Symbol], list[Symbol], list[list[Symbol]]]:
        """The requested values of one combination, its margins, and the margins of each rival combination."""
        if key not in self._parts:
            self._parts[key] = self._specialised(key)
        return self._parts[key]

    def _specialised(self, key: Key) -> tuple[list[Symbol], list[Symbol], list[list[Symbol]]]:
        switches = self._switches_of(key)
        modes, nodes = self.problem.modes, [k for k in range(len(key)) if k not in self._switches] + switches
        given = dict(enumerate(key))
        margins = [self.choices[k].margins[key[k]] for k in nodes if key[k] in self.choices[k].modes]
        exact = with_modes([*self._wanted, *margins, *self._guards], modes, given)
        rivals = []
        for other in self._alternatives(key):
            found = with_modes([self.choices[k].margins[m] for k, m in other.items()], modes, given | other)
            rivals.append([rival - 2 * EPS for rival in separated(found)])
        return exact[: len(self._wanted)], different(separated(exact[len(self._wanted) :])), rivals

    def _expressions(self, key: Key) -> list[Symbol]:
        """The requested values of one combination, and whether these modes and no others hold."""
        wanted, margins, rivals = self.parts(key)
        fits = all_hold(margins)
        for rival in rivals:
            fits = fits * (1 - all_hold(rival))
        return [*wanted, fits]

    def _switches_of(self, key: Key) -> list[int]:
        """The switches that have an influence in a combination."""
        return self._relevant[tuple(m for k, m in enumerate(key) if k not in self._switches)]

    def _alternatives(self, key: Key) -> list[dict[int, float]]:
        """Other combinations of the laws that depend on each other."""
        found: list[dict[int, float]] = []
        for members in self._members(key):
            for combination in product(*(self.choices[k].modes for k in members)):
                other = dict(zip(members, combination, strict=True))
                if any(key[k] != m for k, m in other.items()):
                    found.append(other)
        return found

    def _members(self, key: Key) -> list[list[int]]:
        """Groups of laws that depend on each other."""
        switches, found = self._switches_of(key), list[list[int]]()
        given = {k: m for k, m in enumerate(key) if k not in self._switches}
        for group in self.groups:
            if group.coupled:
                members = [k for k in group.laws if k in switches or k not in self._switches]
                only_switches = all(k in self._switches for k in members)
                found.append(self._coupled(members, given) if only_switches else members)
        return found

    def _coupled(self, members: list[int], given: dict[int, float]) -> list[int]:
        """Those among some switches that still depend on each other in the given other modes."""
        modes = [self.problem.modes[k] for k in members]
        conditions = [c.g for c in (self.choices[k].law for k in members) if isinstance(c, Switch)]
        reach: NDArray[np.bool_] = dependence(with_modes(conditions, self.problem.modes, given), modes)
        for _ in members:
            reach = reach | (reach.astype(int) @ reach.astype(int) > 0)
        return [k for i, k in enumerate(members) if reach[i, i]]
