"""Operating points whose unknowns stay implicit: found together with the modes of the laws.

Modes and Newton's method take turns first, as at an event of a simulation. Where that does not settle, the combinations of modes are
tried which what is given does not rule out: those that other points have, then those of all laws with the switches following, then all.
The first consistent combination is the answer, unless all are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Friction, Switch
from powertrain.engine.buffers import Array
from powertrain.engine.modes import ZONE
from powertrain.steadystate.choices import FORWARD, FREE, STUCK, Choice, held_rows, possible
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows, Tape
from powertrain.steadystate.newton import CONVERGED, SINGULAR, Evaluate, newton, newton_step
from powertrain.steadystate.newton import DIVERGED as LOST
from powertrain.steadystate.points import DIVERGED, NONE, OK, SEVERAL, Index, Mask, Points
from powertrain.steadystate.table import LANES, Table
from powertrain.symbols import Symbol, column

_FEW = 64
_PASSES = 30
_FAILURES = 3
"""Modes are no longer improved at a point after as many times without unknowns that fit."""
_COMBINATIONS = 4096
_TRIED = 256
_COLUMNS = 4096
_KNOWN = 16
_BATCH = 8
_GROWTH = 32
_REASON = np.array([OK, SEVERAL, DIVERGED, NONE], np.int8)
"""What the outcomes of Newton's method mean for a point."""
_SAME = 1e-9
_ROUND_OFF = 1e-13
_SPEED = 1.0
_KICKS = (100.0, -100.0)


@dataclass(frozen=True)
class _Begin:
    """Where a search begins: modes and unknowns of every point; the ``frozen`` modes must turn out right."""

    modes: Rows
    u: Rows
    frozen: list[int]


class Implicit:
    """Solves one steady problem with unknowns at given points. Serves one thread."""

    def __init__(self, problem: Equilibrium, found: list[Choice], table: Table) -> None:
        self.problem, self.choices, self._table = problem, found, table
        self._all = list(range(len(found)))
        self._laws = [k for k in self._all if not isinstance(found[k].law, Switch)]
        self._held = held_rows(problem)
        rows = column([*problem.rows, *(row for _, row in self._held)])
        self._equations = rows.numel()
        jacobian = ca.densify(ca.jacobian(rows, column(problem.u)))
        elements = [rows[i] for i in range(rows.numel())] + list(ca.vertsplit(ca.vec(jacobian.T)))
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._newton = Tape("steady_newton", varying, problem.common, elements, _FEW)
        hidden = [*problem.u, *problem.modes]
        margins = [possible(choice, mode, hidden) for choice in found for mode in choice.modes]
        self._possible = Tape("steady_possible", problem.grid, problem.common, margins or [Symbol(0)], LANES)
        self._known: list[tuple[Array, Array]] = []
        self.untried = False

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._newton.set_common(values)
        self._possible.set_common(values)

    def solve(self, grid: Rows, side: Rows, exhaustive: bool) -> Points:
        """The points of ``grid``; ``side`` says for laws at rest from which side (1 or -1) they are looked at."""
        count = grid.shape[1]
        points = Points.empty(len(self.problem.u), len(self.choices), count)
        allowed = self._possible(grid) >= 0.0
        if exhaustive:
            if self._most(allowed) <= _COMBINATIONS:
                self._combine(grid, points, np.arange(count), side, allowed, self._all, every=True)
                return points
            self.untried = True
        self._known = []
        open_, size, guessing = np.arange(count), _BATCH, True
        while open_.size:
            left = here = open_[:: max(1, open_.size // size)][:size]
            if not guessing:
                left = self._like_others(grid, points, left, side, near=False)
            tried = left.size
            left = self._guess(grid, points, left, side, allowed)
            if tried:
                guessing = 2 * left.size < tried
            size *= _GROWTH
            left = self._like_others(grid, points, left, side, near=True)
            for laws in (self._laws, self._all):
                left = self._combine(grid, points, left, side, allowed, laws)
            open_ = np.setdiff1d(open_, here)
        return points

    def _like_others(self, grid: Rows, points: Points, left: Index, side: Rows, near: bool) -> Index:
        """Tries the modes of other points, and from ``near`` these points' unknowns; which points are left."""
        for modes, u in self._known:
            begin = self.problem.u_start if not near else u
            trial = self._iterate(
                grid[:, left],
                side[:, left],
                _Begin(_spread(modes, left.size), _spread(begin, left.size), self._all),
                kicks=False,
            )
            good = trial.status == OK
            points.put(left[good], trial.some(good))
            left = left[~good]
            if not left.size:
                break
        return left

    def _guess(self, grid: Rows, points: Points, open_: Index, side: Rows, allowed: Mask) -> Index:
        """Modes and unknowns in turns from several guesses; which points are left to try."""
        for guess in self._guesses():
            if not open_.size:
                break
            begin = self._begin(allowed[:, open_], guess)
            trial = self._iterate(grid[:, open_], side[:, open_], begin)
            worse = (trial.status == NONE) & (points.status[open_] != OK)
            keep = ~worse if guess else np.ones(open_.size, bool)
            points.put(open_[keep], trial.some(keep))
            good = trial.status == OK
            for k in np.flatnonzero(good)[:: max(1, int(good.sum()) // 4)]:
                self._remember(trial.modes[:, k], trial.u[:, k])
            open_ = open_[~good]
        left: Index = open_[points.status[open_] != SEVERAL]
        return left

    def _combine(
        self, grid: Rows, points: Points, where: Index, side: Rows, allowed: Mask, tried: list[int], every: bool = False
    ) -> Index:
        """Tries all allowed combinations of the modes of some laws; which points are left. ``every``: tells one from several solutions."""
        if not where.size or not tried:
            return where
        patterns, group = np.unique(allowed[:, where], axis=1, return_inverse=True)
        for g, pattern in enumerate(patterns.T):
            some, options = where[group.ravel() == g], self._options(pattern, tried)
            if prod(map(len, options)) > (_COMBINATIONS if every else _TRIED):
                self.untried = True
                continue
            modes = np.array(list(product(*options))).T
            step = max(1, _COLUMNS // modes.shape[1])
            for low in range(0, some.size, step):
                self._try(grid, points, some[low : low + step], side, modes, tried, every)
        left: Index = where[points.status[where] != OK]
        return left

    def _try(
        self, grid: Rows, points: Points, where: Index, side: Rows, modes: Rows, tried: list[int], every: bool
    ) -> None:
        """All columns of ``modes`` at some points."""
        count, columns = modes.shape[1], np.repeat(where, modes.shape[1])
        begin = _Begin(np.tile(modes, where.size), _spread(self.problem.u_start, columns.size), tried)
        trial = self._iterate(grid[:, columns], side[:, columns], begin, kicks=False)
        table = self._table.evaluate(grid[:, columns], trial.u, trial.modes)
        values = np.vstack([*(self._table.signature(table, k) for k in self._all), trial.u])
        good = ((trial.status == OK) & np.isfinite(values).all(axis=0)).reshape(where.size, count)
        first = np.arange(where.size) * count + good.argmax(axis=1)
        mark = np.repeat(values[:, first], count, axis=1)
        other = (np.abs(values - mark) > _SAME * (1.0 + np.abs(mark))).any(axis=0).reshape(where.size, count)
        found = good.any(axis=1)
        points.put(where[found], trial.some(first[found]))
        several = every & found & (good & other).any(axis=1)
        for state, hit in ((NONE, ~found), (SEVERAL, several)):
            points.status[where[hit]] = state
            points.blame[:, where[hit]] = True
        for k in first[found][:: max(1, int(found.sum()) // 4)]:
            self._remember(trial.modes[:, k], trial.u[:, k])

    def _remember(self, modes: Array, u: Array) -> None:
        if not any(np.array_equal(modes, known) for known, _ in self._known):
            self._known = [(modes.copy(), u.copy()), *self._known][:_KNOWN]

    def _options(self, pattern: Mask, tried: list[int]) -> list[tuple[float, ...]]:
        """The modes of every law that a pattern allows; those that are not ``tried`` begin with the first."""
        options: list[tuple[float, ...]] = []
        place = 0
        for k, choice in enumerate(self.choices):
            fine = pattern[place : place + len(choice.modes)]
            place += len(choice.modes)
            modes = tuple(m for m, f in zip(choice.modes, fine, strict=True) if f) or choice.modes
            options.append(modes if k in tried else modes[:1])
        return options

    def _most(self, allowed: Mask) -> int:
        """The largest number of combinations that any point allows."""
        count, place = np.ones(allowed.shape[1]), 0
        for choice in self.choices:
            count *= np.maximum(allowed[place : place + len(choice.modes)].sum(axis=0), 1)
            place += len(choice.modes)
        return int(count.max(initial=1.0))

    def _guesses(self) -> Iterator[dict[int, float]]:
        """Modes of friction laws to begin with: none, and all sliding, which then stay as they are."""
        laws = [k for k, c in enumerate(self.choices) if isinstance(c.law, Friction) and c.rest is None]
        yield {}
        if laws:
            yield from (dict.fromkeys(laws, mode) for mode in (FORWARD, -FORWARD))

    def _begin(self, allowed: Mask, guess: dict[int, float]) -> _Begin:
        """The guessed modes where they are allowed, else the first that are."""
        modes, place = np.empty((len(self.choices), allowed.shape[1])), 0
        for k, choice in enumerate(self.choices):
            fine, values = allowed[place : place + len(choice.modes)], np.array(choice.modes)
            place += len(choice.modes)
            modes[k] = values[fine.argmax(axis=0)]
            if k in guess:
                modes[k] = np.where(fine[choice.modes.index(guess[k])], guess[k], modes[k])
        return _Begin(modes, _spread(self.problem.u_start, allowed.shape[1]), list(guess))

    def _iterate(self, grid: Rows, side: Rows, begin: _Begin, kicks: bool = True) -> Points:
        """Modes and unknowns in turns."""
        count, frozen = grid.shape[1], begin.frozen
        points = Points.empty(len(self.problem.u), len(self.choices), count)
        points.u[:], points.modes[:] = begin.u, begin.modes
        active, failed = np.arange(count), np.zeros(count, int)
        for _ in range(_PASSES):
            u, outcome = self._solve(grid[:, active], points.modes[:, active], points.u[:, active], kicks)
            usable = (outcome == CONVERGED) | (outcome == SINGULAR)
            points.u[:, active[usable]] = u[:, usable]
            table = self._table.evaluate(grid[:, active], u, points.modes[:, active])
            modes, rests, changed = self._next(table, points.modes[:, active], side[:, active])
            points.blame[:, active] = changed
            points.rest[:, active] = rests
            settled = ~changed.any(axis=0)
            wrong = usable & changed[frozen].any(axis=0)
            points.status[active] = _REASON[outcome]
            points.status[active[wrong]] = NONE
            modes[frozen] = begin.modes[frozen][:, active]
            settled |= (modes == points.modes[:, active]).all(axis=0)
            points.modes[:, active] = modes
            failed[active] += ~usable
            active = active[~settled & ~wrong & (failed[active] < _FAILURES)]
            if not active.size:
                break
        points.status[active] = NONE
        return points

    def _next(self, table: Rows, modes: Rows, side: Rows) -> tuple[Rows, Mask, Mask]:
        """The rules of the simulation, for all laws together."""
        new, rests, changed = modes.copy(), np.zeros(modes.shape, bool), np.zeros(modes.shape, bool)
        for k, choice in enumerate(self.choices):
            margins = self._table.margins(table, k)
            values = np.array(choice.modes)
            place = (modes[k][None, :] == values[:, None]).argmax(axis=0)
            fine = margins[place, np.arange(margins.shape[1])] >= 0.0
            other = values[(margins >= 0.0).argmax(axis=0)]
            if isinstance(choice.law, Friction) and choice.rest is None:
                speed, breaks = self._table.motion(table, k)
                sign = np.where(np.abs(speed) <= ZONE, STUCK, np.sign(np.nan_to_num(speed)))
                other = np.where(modes[k] == STUCK, np.where(breaks != 0.0, breaks, sign), sign)
                if choice.law.algebraic:
                    other = np.where(modes[k] == STUCK, breaks, STUCK)
                if choice.law.may_free:
                    other = np.where(margins[-1] >= 0.0, FREE, other)
            elif choice.rest is not None:
                rests[k] = ~(margins >= 0.0).any(axis=0) & (self._table.rest(table, k) >= 0.0)
                other = np.where(rests[k], side[k], other)
            new[k] = np.where(fine, modes[k], other)
            changed[k] = new[k] != modes[k]
        return new, rests, changed

    def _solve(self, grid: Rows, modes: Rows, start: Rows, kicks: bool = True) -> tuple[Rows, NDArray[np.int8]]:
        """The unknowns for given modes."""
        tape, n, equations = self._newton, len(self.problem.u), self._equations
        active = np.ones((equations, grid.shape[1]), bool)
        for j, (k, _) in enumerate(self._held, len(self.problem.rows)):
            law = self.problem.laws[k]
            active[j] = modes[k] == (STUCK if isinstance(law, Friction) else 1.0)

        loose = self._loose_slopes(grid, start, modes)

        def evaluate(u: Rows, where: Index) -> tuple[Rows, NDArray[np.float64]]:
            found = tape(np.vstack([grid[:, where], u, modes[:, where]]))
            jacobian = found[equations:].T.reshape(-1, equations, n)
            slopes, largest = np.abs(jacobian).max(axis=2).T, loose[:, where]
            on = active[:, where] & ~((slopes <= _ROUND_OFF * largest) & (largest > 0.0))
            residual = np.where(on, found[:equations], 0.0)
            return residual, np.where(on.T[:, :, None], jacobian, 0.0)

        u, outcome = newton(evaluate, self._moving(grid, modes, start, evaluate))
        for kick in _KICKS if kicks else ():
            again = np.flatnonzero(outcome >= LOST)
            if not again.size:
                break
            retried, result = newton(lambda v, where, some=again: evaluate(v, some[where]), start[:, again] + kick)  # type: ignore[misc]
            better = result < LOST
            u[:, again[better]], outcome[again[better]] = retried[:, better], result[better]
        return u, outcome

    def _loose_slopes(self, grid: Rows, u: Rows, modes: Rows) -> Rows:
        """The largest slope of every equation while nothing is stuck; beside it, one that stuck laws leave is round-off."""
        loose = modes.copy()
        for k, _ in self._held:
            if isinstance(self.problem.laws[k], Friction):
                loose[k] = np.where(modes[k] == STUCK, FORWARD, modes[k])
            else:
                loose[k] = 0.0
        found = self._newton(np.vstack([grid, u, loose]))
        slopes = np.abs(found[self._equations :]).reshape(self._equations, len(self.problem.u), -1).max(axis=1)
        return np.asarray(np.nan_to_num(slopes, nan=0.0, posinf=0.0))

    def _moving(self, grid: Rows, modes: Rows, start: Rows, evaluate: Evaluate) -> Rows:
        """The start, moved so that laws that slide do."""
        sliding = [(j, k) for j, (k, _) in enumerate(self._held) if isinstance(self.problem.laws[k], Friction)]
        if not sliding:
            return start
        found, n = self._newton(np.vstack([grid, start, modes])), len(self.problem.u)
        equations, first = self._equations, len(self.problem.rows)
        speeds = found[[first + j for j, _ in sliding]]
        wanted = modes[[k for _, k in sliding]]
        wrong = (np.abs(wanted) == 1.0) & (speeds * wanted <= ZONE)
        slopes = found[equations:].T.reshape(-1, equations, n)[:, [first + j for j, _ in sliding]]
        moves, _ = newton_step(
            np.where(wrong, speeds - wanted * _SPEED, 0.0), np.where(wrong.T[:, :, None], slopes, 0.0)
        )
        return np.where(np.isfinite(moves), start - moves, start)


def _spread(values: Array, count: int) -> Rows:
    """The same values at all points."""
    return np.repeat(values[:, None], count, axis=1)
