"""Whether an expression jumps: compares its values on both sides of every place where one of its operations jumps.

``sign``, ``floor``, ``fmod``, comparisons and choices jump; an expression that contains them may still be continuous, such as
``sign(w) w**2`` or a choice whose branches agree. Numbers decide. Along straight lines through the space of the variables, from 1e-6 to
1e9 in both directions, every change of such an operation is narrowed down to two neighbouring numbers, and the expression is compared
there. It jumps if it differs by more than round-off. Declared switches take the branch that belongs to the point.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.operations import Ways, may_jump, opened, operation
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.numerics.batch import Lanes
from powertrain.numerics.tape import graph_of, operands_of

LINES = 48
_FAR = np.logspace(-6, 9, 24)
_PLACES = np.concatenate([-_FAR[::-1], [0.0], _FAR])
_HALVINGS = 160
_SEARCH = 60
_MOST = 32
"""The changes of one operation that are examined, spread over all lines; of all quotients together twice as many."""
_GOLDEN = 0.381966
_ROUND, _NOISE, _TINY = 1e-8, 1e-14, 1e-280
"""Jumps below these are ignored: relative to the values at the jump, relative to the largest intermediate value, and absolute."""
_GRAIN = 2.0**-50
_FAR_APART = 16
"""The steepness next to a jump is measured this many times further away."""


@dataclass(frozen=True)
class Jump:
    """An operation of the expression and the values on both sides of its jump; for a jump at one point (``w == 0``), there and beside."""

    operation: Symbol
    before: float
    after: float


@dataclass(frozen=True)
class Setting:
    """The meaning of the symbols in an expression.

    ``moves`` selects those that change between events. ``draw(key, generator, k)`` is the value of another one on the k-th line.
    ``switches``: the held mode of each declared switch and the expression that is positive while it is 1, in order.
    ``limits``: low <= value <= high; where a limit on its own variables is violated, an expression may do anything.
    """

    moves: Callable[[Symbol], bool]
    draw: Callable[[Symbol, np.random.Generator, int], float]
    switches: Sequence[tuple[Symbol, Symbol]] = field(default_factory=tuple)
    limits: Sequence[tuple[Symbol, Symbol, Symbol]] = field(default_factory=tuple)


def find_jump(expression: Symbol, setting: Setting) -> Jump | None:
    """A jump of ``expression`` between events, or None."""
    term = _jumping_term(expression, setting)
    if term is None:
        return None
    walk = _Walk(term, setting)
    return walk.jump() if walk.operations else None


def _jumping_term(expression: Symbol, setting: Setting) -> Symbol | None:
    """The only term of a sum that contains operations that jump; None if there are none."""
    holds: dict[int, bool] = {}
    ways: dict[int, Ways] = {}
    for place, (node, inner) in graph_of(expression).items():
        op, of = operation(node), [ways[key(n)] for n in inner]
        ways[place] = Ways.of_node(node, of, setting.moves)
        holds[place] = may_jump(op, of) or any(holds[key(n)] for n in inner)
    if not holds[key(expression)]:
        return None
    while operation(expression) in (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG):
        inside = [n for n in operands_of(expression) if holds[key(n)]]
        if len(inside) > 1:
            break
        (expression,) = inside
    return expression


class _Walk:
    """One expression on its lines."""

    def __init__(self, expression: Symbol, setting: Setting) -> None:
        self.operations, inner_form = opened(expression, setting.moves)
        if not self.operations:
            return
        modes = _modes(expression, setting.switches)
        limits = _limits(expression, setting)
        inner = column([g for _, g in modes] + [limits, expression])
        mode_keys = {key(m) for m, _ in modes}
        symbols = [s for s in free_symbols(inner) if key(s) not in mode_keys]
        v = [s for s in symbols if setting.moves(s)]
        r = [s for s in symbols if not setting.moves(s)]
        m, stand = column([mode for mode, _ in modes]), [o for o in self.operations if o.stand_in is not None]
        self.moving = len(v)
        inputs = [column(v), column(r), m]
        codes = column([o.code for o in self.operations])
        sides = column([Symbol(np.nan) if o.side is None else o.side for o in self.operations])
        stand_ins = [o.stand_in for o in stand if o.stand_in is not None]
        natural = column([o.natural for o in stand if o.natural is not None])
        self.index = {id(o): i for i, o in enumerate(stand)}
        quotients = np.array([operation(o.node) == ca.OP_DIV for o in self.operations])
        self.most = np.where(quotients, max(1, 2 * _MOST // max(1, int(quotients.sum()))), _MOST)
        self.switched = bool(modes)
        self._modes = _function([*inputs[:2]], lambda: _resolved(modes))
        self._codes = _function(inputs, lambda: codes)
        self._sides = _function(inputs, lambda: sides)
        self._natural = _function(inputs, lambda: natural)
        self._inner = _function(
            inputs, lambda: column([n for n, _ in graph_of(expression).values() if not n.is_constant()])
        )
        self._value = _function([*inputs, column(stand_ins)], lambda: ca.if_else(limits, inner_form, np.nan))
        self._draw(setting, r)

    def _draw(self, setting: Setting, fixed: list[Symbol]) -> None:
        """The lines: a point, a direction of the variables that change, and values of everything else."""
        generator = np.random.default_rng(0)
        n = self.moving
        signs = generator.choice([-1.0, 1.0], (n, LINES))
        self.point = signs * 10.0 ** generator.uniform(-3, 3, (n, LINES))
        self.direction = generator.normal(size=(n, LINES))
        for k in range(0, LINES, 2):  # every other line along one axis
            alone = np.arange(n) == (k // 2) % n
            self.direction[~alone, k] = 0.0
            self.point[alone, k] *= generator.integers(0, 2)
        others = [[setting.draw(s, generator, k) for k in range(LINES)] for s in fixed]
        self.fixed = np.array(others, float).reshape(len(fixed), LINES)

    def codes(self, line: NDArray[np.intp], place: Array) -> Array:
        """The codes of all operations, with the switches on their correct branches."""
        return self._codes(*self._at(line, place))

    def sides(self, line: NDArray[np.intp], place: Array) -> Array:
        """The expressions that are zero where the codes change."""
        return self._sides(*self._at(line, place))

    def _at(self, line: NDArray[np.intp], place: Array) -> tuple[Array, Array, Array]:
        v = self.point[:, line] + self.direction[:, line] * place
        r = self.fixed[:, line]
        return v, r, self._modes(v, r) if self.switched else np.empty((0, line.size))

    def jump(self) -> Jump | None:
        """The first jump on all lines."""
        line = np.repeat(np.arange(LINES), _PLACES.size).reshape(LINES, -1)
        place = np.tile(_PLACES, (LINES, 1))
        found, seen = self._between(line, place)
        if found is not None:
            return found
        hidden = [j for j, o in enumerate(self.operations) if o.side is not None and j not in seen]
        return self._hidden(line, place, hidden) if hidden else None

    @np.errstate(invalid="ignore")  # differences of infinite values
    def _between(self, line: NDArray[np.intp], place: Array) -> tuple[Jump | None, set[int]]:
        """A jump between neighbouring places, and the operations that changed somewhere."""
        code = self.codes(line.ravel(), place.ravel()).reshape(len(self.operations), *place.shape)
        changes = (code[:, :, 1:] != code[:, :, :-1]) & np.isfinite(code[:, :, 1:]) & np.isfinite(code[:, :, :-1])
        which, rows, columns = _spread(changes, self.most)
        if not rows.size:
            return None, set()
        at = line[rows, 0]
        low, high = self._narrowed(at, place[rows, columns], place[rows, columns + 1], which)
        return self._compared(at, low, high)

    def _narrowed(
        self, line: NDArray[np.intp], low: Array, high: Array, which: NDArray[np.intp]
    ) -> tuple[Array, Array]:
        """Neighbouring places between which the code of operation ``which`` first differs from that at ``low``."""
        each = np.arange(which.size)
        first = self.codes(line, low)[which, each]
        for _ in range(_HALVINGS):
            middle = low + (high - low) / 2
            open_ = (middle > low) & (middle < high)
            if not open_.any():
                break
            same = self.codes(line, middle)[which, each] == first
            low, high = np.where(open_ & same, middle, low), np.where(open_ & ~same, middle, high)
        return low, high

    def _compared(self, line: NDArray[np.intp], low: Array, high: Array) -> tuple[Jump | None, set[int]]:
        changed = self.codes(line, low) != self.codes(line, high)
        low, high = self._apart(line, low, high)
        one, other = self._at(line, low), self._at(line, high)
        a, b = self._values(one, one[2]), self._values(other, one[2])
        c, d = self._values(one, other[2]), self._values(other, other[2])
        allowed = self._round_off(line, low, high, one[2], a, b)
        # A declared switch is not a jump: compare its branch before with that after.
        size = _finite(np.fmin(np.abs(a - b), np.abs(c - d)) - allowed)
        seen = set(np.nonzero((changed & np.isfinite(a + b)).any(1))[0].tolist())
        if (size > 0).any():
            k = int(np.argmax(size))
            return Jump(self.operations[int(np.argmax(changed[:, k]))].node, float(a[k]), float(b[k])), seen
        return self._alone(one, a, allowed, changed), seen

    def _alone(
        self, at: tuple[Array, Array, Array], beside: Array, allowed: Array, changed: NDArray[np.bool_]
    ) -> Jump | None:
        """A jump at the point itself, where ``w == 0`` is true and sign(w) is 0."""
        for j, o in enumerate(self.operations):
            if o.stand_in is not None and changed[j].any():
                value = self._values(at, at[2], {self.index[id(o)]: o.alone})
                size = _finite(np.where(changed[j], np.abs(value - beside) - allowed - _ROUND * np.abs(value), -1.0))
                if (size > 0).any():
                    k = int(np.argmax(size))
                    return Jump(o.node, float(beside[k]), float(value[k]))
        return None

    def _values(self, at: tuple[Array, Array, Array], m: Array, instead: Mapping[int, float] | None = None) -> Array:
        v, r, _ = at
        stand_ins = self._natural(v, r, m) if self.index else np.empty((0, v.shape[1]))
        for i, value in (instead or {}).items():
            stand_ins[i] = value
        return self._value(v, r, m, stand_ins).ravel()

    def _apart(self, line: NDArray[np.intp], low: Array, high: Array) -> tuple[Array, Array]:
        """Places a few numbers further apart: the variables differ, and no operation is exactly at its jump."""
        with np.errstate(divide="ignore", invalid="ignore"):
            grains = np.abs(self.point[:, line] / self.direction[:, line])
        grain = _GRAIN * (np.where(np.isfinite(grains), grains, 0.0).max(0) + np.abs(low)) + (high - low)
        return low - grain, high + grain

    def _round_off(self, line: NDArray[np.intp], low: Array, high: Array, m: Array, a: Array, b: Array) -> Array:
        """The difference between two places that needs no jump: from steepness, and from the round-off of intermediate values."""
        far = _FAR_APART * (high - low)
        before, after = self._values(self._at(line, low - far), m), self._values(self._at(line, high + far), m)
        steep = np.nan_to_num(np.abs(before - a)) + np.nan_to_num(np.abs(after - b))
        allowed = np.asarray(_ROUND * (np.abs(a) + np.abs(b)) + 100 * steep + _TINY, float)
        if not self.index and (np.abs(a - b) <= allowed).all():
            return allowed
        inner = [np.abs(self._inner(*self._at(line, p)[:2], m)) for p in (low, high)]
        return np.asarray(allowed + _NOISE * np.where(np.isfinite(inner), inner, 0.0).max((0, 1)), float)

    def _hidden(self, line: NDArray[np.intp], place: Array, hidden: list[int]) -> Jump | None:
        """Operations without a change so far: look for one in a band between two places, where their operands come closest."""
        side = self.sides(line.ravel(), place.ravel())
        size = np.abs(side.reshape(len(self.operations), *place.shape)[hidden])
        lowest = (size[:, :, 1:-1] <= size[:, :, :-2]) & (size[:, :, 1:-1] <= size[:, :, 2:])
        which, rows, columns = _spread(lowest, self.most[hidden])
        if not which.size:
            return None
        at, pick = line[rows, 0], np.array(hidden)[which]
        nearest = self._nearest(at, place[rows, columns], place[rows, columns + 1], place[rows, columns + 2], pick)
        around = np.stack([place[rows, columns], nearest, place[rows, columns + 2]], axis=1)
        return self._between(np.repeat(at[:, None], 3, axis=1), around)[0]

    def _nearest(self, line: NDArray[np.intp], low: Array, middle: Array, high: Array, pick: NDArray[np.intp]) -> Array:
        """Golden section for the least of |side| between ``low`` and ``high``."""

        def size(place: Array) -> Array:
            return np.abs(self.sides(line, place)[pick, np.arange(pick.size)])

        best = size(middle)
        for _ in range(_SEARCH):
            right = high - middle > middle - low
            trial = np.where(right, middle + _GOLDEN * (high - middle), middle - _GOLDEN * (middle - low))
            value = size(trial)
            better = value < best
            low = np.where(better & right, middle, np.where(~better & ~right, trial, low))
            high = np.where(better & ~right, middle, np.where(~better & right, trial, high))
            middle, best = np.where(better, trial, middle), np.where(better, value, best)
        return middle


def _spread(found: NDArray[np.bool_], most: NDArray[np.intp]) -> tuple[NDArray[np.intp], ...]:
    """Operation, line and place of the changes found, at most so many per operation, evenly over all lines."""
    picked = []
    for j, own in enumerate(found):
        rows, columns = np.nonzero(own)
        some = np.linspace(0, rows.size - 1, min(rows.size, int(most[j]))).astype(np.intp)
        picked.append((np.full(some.size, j), rows[some], columns[some]))
    return tuple(np.concatenate(each) for each in zip(*picked, strict=True))


def _finite(size: Array) -> Array:
    return np.where(np.isfinite(size), size, -1.0)


def _function(inputs: list[Symbol], outputs: Callable[[], Symbol]) -> Callable[..., Array]:
    """A function of rows of values, built at its first call."""
    built: list[Lanes] = []

    def call(*given: Array) -> Array:
        if not built:
            built.append(Lanes([*inputs, Symbol(0, 1)], outputs()))
        return built[0]([g.T for g in given], np.zeros(0)).T

    return call


def _limits(expression: Symbol, setting: Setting) -> Symbol:
    """Whether the limits that concern only the expression's own variables hold."""
    inside = {key(s) for s in free_symbols(expression)}
    holds = Symbol(1)
    for value, low, high in setting.limits:
        if all(key(s) in inside for s in free_symbols(column([value, low, high])) if setting.moves(s)):
            holds = ca.logic_and(holds, ca.logic_and(low <= value, value <= high))
    return holds


def _modes(expression: Symbol, switches: Sequence[tuple[Symbol, Symbol]]) -> list[tuple[Symbol, Symbol]]:
    """The switches on which the expression and their own conditions depend, in order."""
    needed = {key(s) for s in free_symbols(expression)}
    picked = []
    for mode, g in reversed(switches):
        if key(mode) in needed:
            picked.append((mode, g))
            needed |= {key(s) for s in free_symbols(g)}
    return picked[::-1]


def _resolved(modes: Sequence[tuple[Symbol, Symbol]]) -> Symbol:
    """The modes on their correct branches, with no modes in the expressions."""
    known: list[Symbol] = []
    for k, (_, g) in enumerate(modes):
        inner = ca.substitute(g, column([m for m, _ in modes[:k]]), column(known)) if k else g
        known.append(inner > 0)
    return column(known)
