"""Fast evaluation of a map: few combinations of modes occur in it, and in given modes little arithmetic remains.

Every combination of modes that was met gives the requested values, and a flag that is set where these modes, and no others, hold. One
expression tape evaluates all of them and takes the first that fits. Only points that no known combination fits are left to the solver,
and those in modes with too many other combinations to exclude.
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
from powertrain.equilibrium.points import LARGEST
from powertrain.equilibrium.system import Equilibrium, with_modes
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.modes.guards import guard_margin
from powertrain.numerics.batch import LANES, Tape, column_tape, dependence
from powertrain.numerics.vectorised import VectorTape

_WIDTH = 4096
"""Points that are evaluated together."""
_KNOWN = 64
"""The number of combinations that are known at most."""
_ALTERNATIVES = 64
_DEPTH = 20
"""Depth to which margins are compared."""
Key = tuple[float, ...]
Careful = Callable[[int, int], Array | None]
"""Solves the points from the first to before the last one by one, stores them, and returns the modes of the first good one."""


class KnownModes:
    """The combinations of modes of one explicit steady problem, ``keys``, and their tape. Serves one thread."""

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
        self._fits, self._width, self._block = np.empty(max(_WIDTH, VectorTape.most)), _WIDTH, LANES
        self._tape: tuple[int, Tape | VectorTape] | None = None
        self._called = 0
        self._refused: set[Key] = set()

    def fill(
        self,
        count: int,
        arguments: Sequence[Array],
        results: Sequence[Array],
        careful: Careful,
        done: Callable[[int], None],
    ) -> None:
        """Fill ``results`` at ``count`` points."""
        i, self._block = 0, LANES
        while i < count:
            i = self._stretch(i, count, arguments, results, careful) if self.keys else self._ask(i, count, careful)
            done(i)

    def _stretch(
        self, first: int, count: int, arguments: Sequence[Array], results: Sequence[Array], careful: Careful
    ) -> int:
        """Fill some points in the known modes, and leave those that none of them fits to the solver. Returns where they end."""
        tape, last = self._evaluator(), min(first + self._width, count)
        fits = self._fits[: last - first]
        given, found = ([a[first:last] for a in arrays] for arrays in (arguments, results))
        if last - first < tape.least:
            *values, fits[:] = tape.of_rows(given, last - first)
            for row, value in zip(found, values, strict=True):
                row[:] = value
        else:
            tape.into(given, [*found, fits])
        left = first + np.flatnonzero(fits == 0.0)
        self._width = _WIDTH if left.size else min(2 * self._width, tape.most)
        while left.size:
            end = self._ask(int(left[0]), last, careful)
            if self._outdated:
                return end
            left = left[left >= end]
        return last

    def _ask(self, first: int, last: int, careful: Careful) -> int:
        """Leave a block of points to the solver, and enter the modes that it finds. Returns where the block ends."""
        end = min(first + self._block, last)
        modes = careful(first, end)
        self._called += 1
        unknown = modes is not None and not self.enter(modes)
        self._block = min(2 * self._block, LARGEST) if unknown else LANES
        return end

    @property
    def _outdated(self) -> bool:
        """Whether the tape lacks combinations, and the calls of the solver since have taken as long as rebuilding it."""
        return self._tape is None or self._tape[0] < len(self.keys) <= self._called

    def _evaluator(self) -> Tape | VectorTape:
        """The requested values of the first combination that fits, and its number from one; zeros if none fits."""
        if self._tape is None or self._outdated:
            problem, open_, found = self.problem, Symbol(1), [Symbol(0)] * (len(self._wanted) + 1)
            for number, key in enumerate(self.keys, 1):
                *values, fits = self._expressions(key)
                first, open_ = fits * open_, open_ * ca.logic_not(fits)
                found = [f + ca.if_else(first, v, 0) for f, v in zip(found, [*values, Symbol(number)], strict=True)]
            tape = column_tape(
                "steady_known", problem.grid, problem.common.symbols, ca.cse(found), _WIDTH, self._compile
            )
            self._tape, self._called = (len(self.keys), tape), 0
        self._tape[1].set_common(self.problem.common.values)
        return self._tape[1]

    def enter(self, modes: Array) -> bool:
        """Whether the combination of these modes is known from now on: not if there are too many, or too many rivals."""
        laws = tuple(float(m) for k, m in enumerate(modes) if k not in self._switches)
        given = {k: float(m) for k, m in enumerate(modes) if k not in self._switches}
        if laws not in self._relevant:
            self._relevant[laws] = self._influential(given)
        relevant = set(self._relevant[laws]) | set(given)  # other switches count as zero
        key = tuple(float(m) if k in relevant else 0.0 for k, m in enumerate(modes))
        if key in self.keys:
            return True
        if len(self.keys) >= _KNOWN or key in self._refused:
            return False
        if any(prod(len(self.choices[k].modes) for k in members) > _ALTERNATIVES for members in self._members(key)):
            self._refused.add(key)
            return False
        self.keys.append(key)
        return True

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
            rivals.append([rival - 2 * EPS for rival in _separated(found)])
        return exact[: len(self._wanted)], _different(_separated(exact[len(self._wanted) :])), rivals

    def _expressions(self, key: Key) -> list[Symbol]:
        """The requested values of one combination, and whether these modes and no others hold."""
        wanted, margins, rivals = self.parts(key)
        fits = all_hold(margins)
        for rival in rivals:
            fits = fits * ca.logic_not(all_hold(rival))
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


def all_hold(margins: Sequence[Symbol]) -> Symbol:
    """One if no margin is negative (or nan), else zero."""
    result = Symbol(1)
    for margin in margins:
        result = result * (margin >= 0)
    return result


def _separated(margins: Sequence[Symbol]) -> list[Symbol]:
    """The margins with the operands of each minimum in its place: it is not negative where none of them is."""
    found = list[Symbol]()
    for margin in margins:
        found += _separated([margin.dep(0), margin.dep(1)]) if margin.is_op(ca.OP_FMIN) else [margin]
    return found


def _different(expressions: Sequence[Symbol]) -> list[Symbol]:
    """The expressions without duplicates and without constants that are not negative."""
    kept: list[Symbol] = []
    for expression in expressions:
        trivial = expression.is_constant() and float(expression) >= 0.0
        if not trivial and not any(ca.is_equal(expression, other, _DEPTH) for other in kept):
            kept.append(expression)
    return kept
