"""Operating points, many at once: unknowns and modes of all laws found together, point by point with a status.

Where the speeds do not depend on torques, the laws fall into groups that are resolved one after the other, and every combination inside a
group is tried: so none, one or several solutions are told apart. Where unknowns are implicit, modes and Newton's method take turns,
and combinations are tried where that cycles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Contact, Friction
from powertrain.engine.buffers import Array
from powertrain.engine.indicators import guard_margin
from powertrain.engine.modes import ZONE
from powertrain.steadystate.choices import (
    FORWARD,
    FREE,
    INFINITE,
    STUCK,
    Choice,
    breakaway,
    choices,
    held_rows,
    needs,
    order,
)
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows, Tape
from powertrain.steadystate.newton import CONVERGED, SINGULAR, Evaluate, newton, newton_step
from powertrain.steadystate.newton import DIVERGED as LOST
from powertrain.symbols import Symbol, column

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

OK, STUCK_POINT, SEVERAL, NONE, IMMOVABLE, OUTSIDE, DIVERGED, UNDEFINED = range(8)
LANES = 256
_FEW = 64
_PASSES = 30
_COMBINATIONS = 4096
_FROZEN = 256
_REASON = np.array([OK, SEVERAL, DIVERGED, NONE], np.int8)
"""What the outcomes of Newton's method mean for a point."""
_SAME = 1e-9
_SPEED = 1.0
_KICKS = (100.0, -100.0)


@dataclass
class Points:
    """Operating points: unknowns, modes, status, the laws that it is about, and those at rest under a prescribed motion."""

    u: Rows
    modes: Rows
    status: NDArray[np.int8]
    blame: Mask
    rest: Mask

    @classmethod
    def empty(cls, unknowns: int, laws: int, count: int) -> Points:
        """Points of which nothing is known."""
        masks = [np.zeros((laws, count), bool) for _ in range(2)]
        return cls(np.zeros((unknowns, count)), np.zeros((laws, count)), np.zeros(count, np.int8), *masks)

    def some(self, which: Mask) -> Points:
        """Some of the points."""
        return Points(
            self.u[:, which], self.modes[:, which], self.status[which], self.blame[:, which], self.rest[:, which]
        )

    def put(self, where: Index, other: Points) -> None:
        """Takes over the other points."""
        for name in ("u", "modes", "blame", "rest"):
            getattr(self, name)[:, where] = getattr(other, name)
        self.status[where] = other.status


class Solver:
    """Solves one steady problem at given points. Serves one thread."""

    def __init__(self, problem: Equilibrium) -> None:
        self.problem = problem
        self.choices = choices(problem)
        self.groups = order(self.choices, problem.modes)
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._table = _Table(problem, self.choices, varying)
        guards = [guard_margin(g) for g in problem.guards]
        self.values_tape = Tape(
            "steady_values", varying, problem.common, [*problem.outputs, *problem.rates, *guards], LANES
        )
        self.wanted = len(problem.outputs) + len(problem.rates)
        self._newton: Tape | None = None
        if problem.u:
            self._held = held_rows(problem)
            rows = column([*problem.rows, *(row for _, row in self._held)])
            jacobian = ca.densify(ca.jacobian(rows, column(problem.u)))
            elements = [rows[i] for i in range(rows.numel())] + list(ca.vertsplit(ca.vec(jacobian.T)))
            self._newton = Tape("steady_newton", varying, problem.common, elements, _FEW)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self.common = values.copy()
        for tape in (self._table.tape, self.values_tape, self._newton):
            if tape is not None:
                tape.set_common(values)

    def solve(self, grid: Rows, side: Rows | None = None, exhaustive: bool = False) -> Points:
        """The points of ``grid`` (one row per axis); ``side`` says for laws at rest from which side (1 or -1) they are looked at."""
        with np.errstate(all="ignore"):
            if side is None:
                side = np.ones((len(self.choices), grid.shape[1]))
            if self.problem.u:
                return self._implicit(grid, side, exhaustive)
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

    def _enumerate(
        self, grid: Rows, points: Points, group: list[int], where: Index, side: Rows, newton_too: bool = False
    ) -> None:
        """Tries all combinations of the modes of a group at some points."""
        if not where.size:
            return
        count = np.zeros(where.size, int)
        best = np.zeros((len(self.choices), where.size))
        unknowns = np.zeros((points.u.shape[0], where.size))
        rest = np.zeros((len(self.choices), where.size), bool)
        mark: Rows | None = None
        for combination in product(*(self.choices[k].modes for k in group)):
            modes = points.modes[:, where].copy()
            modes[group] = np.array(combination)[:, None]
            u, solved = points.u[:, where], np.ones(where.size, bool)
            if newton_too:
                begin = np.repeat(self.problem.u_start[:, None], where.size, axis=1)
                u, outcome = self._solve(grid[:, where], modes, begin, kicks=False)
                solved = outcome == CONVERGED
            holds, resting, signature = self._consistent(grid[:, where], u, modes, group, side[:, where])
            holds &= solved
            if mark is None:
                mark = np.full(signature.shape, np.nan)
            same = np.abs(signature - mark) <= _SAME * (1.0 + np.abs(mark))
            new = holds & ~((count > 0) & same.all(axis=0))
            count += new
            first = new & (count == 1)
            best[:, first], unknowns[:, first], mark[:, first] = modes[:, first], u[:, first], signature[:, first]
            rest[:, first] = resting[:, first]
        good = count > 0
        points.modes[:, where[good]] = best[:, good]
        points.u[:, where[good]] = unknowns[:, good]
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
        return holds & np.isfinite(signature).all(axis=0), resting, np.vstack([signature, u])

    def _immovable(self, grid: Rows, points: Points) -> None:
        """Points where speeds, or what has to be found, are not finite."""
        table = self._table.evaluate(grid, points.u, points.modes)
        lost = ~(np.abs(self._table.speeds(table)) <= INFINITE).all(axis=0)
        points.status[lost] = IMMOVABLE
        points.blame[:, lost] = False

    def _implicit(self, grid: Rows, side: Rows, exhaustive: bool) -> Points:
        count, everything = grid.shape[1], list(range(len(self.choices)))
        points = Points.empty(len(self.problem.u), len(self.choices), count)
        if exhaustive and prod(len(c.modes) for c in self.choices) <= _COMBINATIONS:
            self._enumerate(grid, points, everything, np.arange(count), side, newton_too=True)
            return points
        open_ = np.arange(count)
        for guess in self._guesses():
            trial = self._iterate(grid[:, open_], side[:, open_], guess)
            worse = (trial.status == NONE) & (points.status[open_] != OK)
            keep = ~worse if guess else np.ones(open_.size, bool)
            points.put(open_[keep], trial.some(keep))
            open_ = open_[trial.status != OK]
            if not open_.size:
                return points
        open_ = open_[points.status[open_] != SEVERAL]
        if everything and prod(len(c.modes) for c in self.choices) <= _FROZEN:
            points.u[:, open_], points.rest[:, open_] = self.problem.u_start[:, None], False
            self._enumerate(grid, points, everything, open_, side, newton_too=True)
        return points

    def _guesses(self) -> Iterator[dict[int, float]]:
        """Modes of friction laws to begin with: none, and all sliding, which then stay as they are."""
        laws = [k for k, c in enumerate(self.choices) if isinstance(c.law, Friction) and c.rest is None]
        yield {}
        if laws:
            yield from (dict.fromkeys(laws, mode) for mode in (FORWARD, -FORWARD))

    def _iterate(self, grid: Rows, side: Rows, frozen: dict[int, float]) -> Points:
        """Modes and unknowns in turns; the ``frozen`` modes must turn out right."""
        count = grid.shape[1]
        points = Points.empty(len(self.problem.u), len(self.choices), count)
        points.u[:] = self.problem.u_start[:, None]
        for k, choice in enumerate(self.choices):
            points.modes[k] = frozen.get(k, choice.modes[0])
        active = np.arange(count)
        for _ in range(_PASSES):
            u, outcome = self._solve(grid[:, active], points.modes[:, active], points.u[:, active])
            usable = (outcome == CONVERGED) | (outcome == SINGULAR)
            points.u[:, active[usable]] = u[:, usable]
            table = self._table.evaluate(grid[:, active], u, points.modes[:, active])
            modes, rests, changed = self._next(table, points.modes[:, active], side[:, active])
            points.blame[:, active] = changed
            points.rest[:, active] = rests
            settled = ~changed.any(axis=0)
            wrong = usable & changed[list(frozen)].any(axis=0)
            points.status[active] = _REASON[outcome]
            points.status[active[wrong]] = NONE
            for k in frozen:
                modes[k] = frozen[k]
            settled |= (modes == points.modes[:, active]).all(axis=0)
            points.modes[:, active] = modes
            active = active[~settled & ~wrong]
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
        assert self._newton is not None
        tape, n, equations = self._newton, len(self.problem.u), len(self.problem.rows) + len(self._held)
        active = np.ones((equations, grid.shape[1]), bool)
        for j, (k, _) in enumerate(self._held, len(self.problem.rows)):
            law = self.problem.laws[k]
            active[j] = modes[k] == (STUCK if isinstance(law, Friction) else 1.0)

        def evaluate(u: Rows, where: Index) -> tuple[Rows, NDArray[np.float64]]:
            found = tape(np.vstack([grid[:, where], u, modes[:, where]]))
            on = active[:, where]
            residual = np.where(on, found[:equations], 0.0)
            jacobian = found[equations:].T.reshape(-1, equations, n)
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

    def _moving(self, grid: Rows, modes: Rows, start: Rows, evaluate: Evaluate) -> Rows:
        """The start, moved so that laws that slide do."""
        sliding = [(j, k) for j, (k, _) in enumerate(self._held) if isinstance(self.problem.laws[k], Friction)]
        if not sliding:
            return start
        assert self._newton is not None
        found, n = self._newton(np.vstack([grid, start, modes])), len(self.problem.u)
        equations = len(self.problem.rows) + len(self._held)
        first = len(self.problem.rows)
        speeds = found[[first + j for j, _ in sliding]]
        wanted = modes[[k for _, k in sliding]]
        wrong = (np.abs(wanted) == 1.0) & (speeds * wanted <= ZONE)
        slopes = found[equations:].T.reshape(-1, equations, n)[:, [first + j for j, _ in sliding]]
        moves, _ = newton_step(
            np.where(wrong, speeds - wanted * _SPEED, 0.0), np.where(wrong.T[:, :, None], slopes, 0.0)
        )
        return np.where(np.isfinite(moves), start - moves, start)


class _Table:
    """All margins of all laws and what else tells modes apart, at many points."""

    def __init__(self, problem: Equilibrium, found: list[Choice], varying: list[Symbol]) -> None:
        rows: list[Symbol] = []
        self._first, self._extra = [], []
        self._found = found
        for c in found:
            self._first.append(len(rows))
            rows += c.margins
            self._extra.append(len(rows))
            rows.append(Symbol(-1) if c.rest is None else c.rest)
            if isinstance(c.law, Friction):
                rows += [c.law.torque, c.law.w, breakaway(c.law)]
            else:
                rows.append(c.law.force if isinstance(c.law, Contact) else c.law.g)
        self._speeds = len(rows)
        rows += problem.solved
        self._speed_rows = [self._extra[k] + 2 for k, c in enumerate(found) if isinstance(c.law, Friction)]
        self._speed_rows += list(range(self._speeds, len(rows)))
        self._needs = needs(found, problem.modes)
        self.tape = Tape("steady_laws", varying, problem.common, rows or [Symbol(0)], LANES)

    def needs(self, k: int, j: int) -> bool:
        """Whether the modes of law k depend on those of law j."""
        return bool(self._needs[k, j])

    def evaluate(self, grid: Rows, u: Rows, modes: Rows) -> Rows:
        return self.tape(np.vstack([grid, u, modes]))

    def margins(self, table: Rows, k: int) -> Rows:
        return table[self._first[k] : self._extra[k]]

    def rest(self, table: Rows, k: int) -> Array:
        return np.asarray(table[self._extra[k]])

    def signature(self, table: Rows, k: int) -> Rows:
        """The torque of a friction law, the force of a contact, the condition of a switch."""
        return table[self._extra[k] + 1 : self._extra[k] + 2]

    def motion(self, table: Rows, k: int) -> tuple[Array, Array]:
        """The speed of a friction law, and the direction in which a stuck one breaks away."""
        return table[self._extra[k] + 2], table[self._extra[k] + 3]

    def speeds(self, table: Rows) -> Rows:
        return table[self._speed_rows]
