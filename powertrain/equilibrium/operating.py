"""Many operating points at once: the modes of all laws and the unknowns are found together, with a status for each point.

If only modes are unknown, laws form groups that are resolved one after the other. In each group, every combination of modes consistent
with the known values is tried: no, one and several solutions are distinguished. If unknowns are implicit, or there are many combinations,
modes and unknowns are solved for together (``powertrain.equilibrium.solutions``).
"""

from __future__ import annotations

from math import prod

import numpy as np

from powertrain.compiler.hybrid import Friction, Switch
from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.between import Between
from powertrain.equilibrium.choices import choices, order
from powertrain.equilibrium.laws import SteadyLaws
from powertrain.equilibrium.points import DIVERGED, IMMOVABLE, NONE, OK, SEVERAL, Mask, Points, SolvedPoints, Trials
from powertrain.equilibrium.search import Search
from powertrain.equilibrium.solutions import Solutions
from powertrain.equilibrium.system import Equilibrium
from powertrain.modes.friction import BACKWARD, FORWARD, STUCK
from powertrain.modes.guards import guard_margin
from powertrain.modes.tolerances import INFINITE, ZONE, balance_tolerance
from powertrain.numerics.batch import Columns, Rows
from powertrain.numerics.buffers import Array

COMBINATIONS = 4096
"""Combinations of modes that are tried at a point."""


class Solver:
    """Solves one steady problem at given points. Serves one thread. ``compile``: with machine code, if unknowns are implicit."""

    def __init__(self, problem: Equilibrium, compile: bool = False) -> None:
        self.problem = problem
        self.choices, self._common = choices(problem), np.zeros(problem.common.numel())
        self._moving = np.array([k for k, law in enumerate(problem.laws) if not isinstance(law, Switch)], np.intp)
        self._between: Between | None = None
        self.groups = order(problem, self.choices)
        many = any(prod(len(self.choices[k].modes) for k in g.laws) > COMBINATIONS for g in self.groups if g.coupled)
        self._laws = SteadyLaws(problem.balance, compile) if problem.u or many else None
        self._solutions = None if self._laws is None else Solutions(self._laws, self._within)
        self._searches = [Search(problem, self.choices, g) for g in self.groups] if self._laws is None else []
        machine = compile and self._laws is not None
        varying = [*problem.grid, *problem.u, *problem.modes]
        guards = [guard_margin(g) for g in problem.guards]
        wanted = [*problem.outputs, *problem.rates]
        self.wanted = len(wanted)
        self._values = Columns("steady_values", varying, problem.common, [*wanted, *guards], machine)
        self._guards = Columns("steady_guards", varying, problem.common, guards, machine) if guards else None
        frictions = [law for law in problem.laws if isinstance(law, Friction)]
        self._speeds = Columns(
            "steady_speeds", varying, problem.common, [*(f.w for f in frictions), *problem.solved], machine
        )
        self._shared = np.array([f.rests is not None for f in frictions], bool)
        limits = [e for f in frictions for e in (f.torque, f.peak * f.lower, f.peak * f.upper)]
        self._torques = Columns("steady_torques", varying, problem.common, limits, machine)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._common = values
        if self._between is not None:
            self._between.set_common(values)
        for columns in (self._values, self._speeds, self._torques, self._guards):
            if columns is not None:
                columns.set_common(values)
        for search in self._searches:
            search.set_common(values)
        if self._laws is not None:
            self._laws.set_common(values)

    def solve(self, grid: Rows, side: Rows | None = None) -> Points:
        """The points of ``grid`` (one row per axis); ``side`` is the side (1 or -1) from which laws at rest are approached."""
        side = np.ones((len(self.choices), grid.shape[1])) if side is None else side
        with np.errstate(all="ignore"):
            together = self._solutions
            points = self._by_groups(grid, side) if together is None else self._together(together, grid, side)
            if together is not None:
                self._limit(grid, points)
            known = [grid.T, points.u.T, points.modes.T]
            points.status[~(np.abs(self._speeds.of_points(known)) <= INFINITE).all(axis=0)] = IMMOVABLE
            locked = ~(np.abs(self._torques.of_points(known)[::3]) <= INFINITE)
            points.status[(points.status == OK) & locked.any(axis=0)] = NONE
        points.involved[: len(locked), points.status == NONE] |= locked[:, points.status == NONE]
        points.involved[:, (points.status == OK) | (points.status == IMMOVABLE)] = False
        return points

    @property
    def explicit(self) -> bool:
        """Whether only modes are unknown."""
        return self._solutions is None

    def holds(self, grid: Rows, modes: Rows, apart: Mask) -> Mask:
        """Whether the modes of all laws except those ``apart`` hold, if only modes are unknown."""
        values = np.vstack([grid, modes])
        with np.errstate(all="ignore"):
            return np.asarray(np.logical_and.reduce([search.holds(values, apart) for search in self._searches]))

    def between(self, grid: Rows, side: Rows, rest: Mask, near: SolvedPoints) -> tuple[Points, Mask]:
        """Points with the torques of laws that ``rest`` at ``side`` (-1 and 1 are the limits), and which of them are solutions.

        For implicit unknowns; the search begins at ``near``.
        """
        if self._between is None:
            self._between = Between(self.problem.balance)
            self._between.set_common(self._common)
        found = self._between.solve(grid.T, side[self._moving].T, rest[self._moving].T, near)
        u, status = self._unknowns(self.problem.balance, found), np.zeros(grid.shape[1], np.int8)
        return Points(u, found.modes.T.copy(), status, rest, rest, found), found.done

    def _by_groups(self, grid: Rows, side: Rows) -> Points:
        """Try combinations of modes, group by group."""
        laws, count = len(self.choices), grid.shape[1]
        trials = Trials.of(grid, laws)
        values, rest = trials.values.copy(), trials.rest.copy()
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

    def _together(self, solutions: Solutions, grid: Rows, side: Rows) -> Points:
        """Solve for modes and unknowns as one problem."""
        balance, count = solutions.laws.balance, grid.shape[1]
        moving = self._moving
        best = solutions.solve(grid.T, side[moving].T)
        found, u = best.solved, self._unknowns(balance, best.solved)
        status = np.select([best.number == 0, best.number > 1], [DIVERGED, SEVERAL], OK).astype(np.int8)
        rest, involved = np.zeros((len(self.choices), count), bool), best.differing.T.copy()
        rest[moving] = best.rest.T
        nameless = (status != OK) & ~involved.any(axis=0)
        involved[np.ix_(moving, np.flatnonzero(nameless))] = True
        return Points(u, found.modes.T.copy(), status, involved, rest, found)

    def _unknowns(self, balance: Balance, found: SolvedPoints) -> Rows:
        names = {n: found.y[:, i] for i, n in enumerate(balance.names)}
        names |= {s.name(): found.tau[:, i] for i, s in enumerate(balance.tau_symbols)}
        return np.array([names[n] for n in self.problem.u_names]).reshape(len(self.problem.u_names), len(found.y))

    def _within(self, grid: Array, found: SolvedPoints) -> Mask:
        """Which solutions are within the limits of the model."""
        if self._guards is None or not len(grid):
            return np.ones(len(grid), bool)
        u = self._unknowns(self.problem.balance, found)
        return np.asarray((self._guards.of_points([grid, u.T, found.modes]) >= 0.0).all(axis=0))

    def _limit(self, grid: Rows, points: Points) -> None:
        """Laws at rest share a torque by compliance; what exceeds the static limit of one law is passed on to the others."""
        count = len(self._shared)
        modes, candidates = points.modes[:count], ~points.rest[:count] & (points.status == OK)
        slides = (modes == FORWARD) | (modes == BACKWARD)
        if (held := self._shared[:, None] & candidates & slides).any():
            still = np.abs(self._speeds.of_points([grid.T, points.u.T, points.modes.T])[:count]) <= ZONE
            modes[held & still] = STUCK
        for _ in range(count):
            found = self._torques.of_points([grid.T, points.u.T, points.modes.T])
            torque, lower, upper = found[::3], found[1::3], found[2::3]
            known = balance_tolerance(np.abs(torque).max(axis=0, initial=0.0))
            stuck = candidates & (modes == STUCK)
            above, below = stuck & (torque > upper + known), stuck & (torque < lower - known)
            if not (above | below).any():
                return
            modes[above], modes[below] = FORWARD, BACKWARD

    def values(self, grid: Rows, points: Points) -> tuple[Rows, Mask]:
        """The requested values, and which guards are violated."""
        with np.errstate(all="ignore"):
            found = self._values.of_points([grid.T, points.u.T, points.modes.T])
        return found[: self.wanted], ~(found[self.wanted :] >= 0.0)
