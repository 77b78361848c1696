"""Many operating points at once: the modes of all laws and the unknowns are found together, with a status for each point.

If only modes are unknown, laws form groups that are resolved one after the other. In each group, every combination of modes consistent
with the known values is tried: no, one and several solutions are distinguished. If unknowns are implicit, or there are many combinations,
modes and unknowns are solved for together (``powertrain.equilibrium.solutions``).
"""

from __future__ import annotations

from functools import cached_property
from math import prod

import numpy as np

from powertrain.dae.friction import BACKWARD, FORWARD, STUCK
from powertrain.dae.hybrid import Friction, Switch
from powertrain.dae.tolerances import INFINITE, ZONE, balance_tolerance
from powertrain.equilibrium.creep import Creep
from powertrain.equilibrium.laws import SteadyLaws
from powertrain.equilibrium.points import DIVERGED, IMMOVABLE, NONE, OK, SEVERAL, Index, Mask, Points, SolvedPoints
from powertrain.equilibrium.search import Combinations, choices, order
from powertrain.equilibrium.solutions import Between, Solutions
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.reals import Array
from powertrain.language.symbols import scalars
from powertrain.modes.guards import guard_margin
from powertrain.numerics.batch import Columns, Rows

COMBINATIONS = 4096
"""Combinations of modes that are tried at a point."""


class Solver:
    """Solves one steady problem at given points. Serves one thread. ``compile``: with machine code, if unknowns are implicit."""

    def __init__(self, problem: Equilibrium, compile: bool = False) -> None:
        self.problem, self.choices = problem, choices(problem)
        self._moving = np.array([k for k, law in enumerate(problem.laws) if not isinstance(law, Switch)], np.intp)
        self.groups = order(problem, self.choices)
        many = any(prod(len(self.choices[k].modes) for k in g.laws) > COMBINATIONS for g in self.groups if g.coupled)
        self.explicit = not (problem.u or many)
        if self.explicit:
            self._combinations = Combinations(problem, self.choices, self.groups)
        else:
            self._solutions = Solutions(SteadyLaws(problem.balance, compile), self._within)
            self._creep = Creep(problem, compile)
            names = [*problem.balance.names, *(s.name() for s in scalars(problem.balance.tau))]
            self._places = [names.index(n) for n in problem.u_names]
        frictions = [law for law in problem.laws if isinstance(law, Friction)]
        self._shared = np.array([f.rests is not None for f in frictions], bool)
        guards, wanted = [guard_margin(g) for g in problem.guards], [*problem.outputs, *problem.rates]
        within = [*guards, *(f.upper - f.lower + f.hysteresis for f in frictions)]
        self.wanted, varying = len(wanted), [*problem.grid, *problem.u, *problem.modes]
        speeds = [*(f.w for f in frictions), *problem.solved]
        limits = [e for f in frictions for e in (f.torque, f.peak * f.lower, f.peak * f.upper)]
        self._values, self._limits, self._speeds, self._torques = (
            Columns(f"steady_{name}", varying, problem.common, outputs, compile and not self.explicit)
            for name, outputs in (
                ("values", [*wanted, *guards]), ("within", within), ("speeds", speeds), ("torques", limits)
            )
        )  # fmt: skip

    def solve(self, grid: Rows, side: Rows | None = None) -> Points:
        """The points of ``grid`` (one row per axis); ``side`` is the side (1 or -1) from which laws at rest are approached."""
        side = np.ones((len(self.choices), grid.shape[1])) if side is None else side
        with np.errstate(all="ignore"):
            points = self._combinations.solve(grid, side) if self.explicit else self._together(grid, side)
            known = [grid.T, points.u.T, points.modes.T]
            points.status[~(np.abs(self._speeds.of_points(known)) <= INFINITE).all(axis=0)] = IMMOVABLE
            refused = self._refused(self._torques.of_points(known))
            points.status[(points.status == OK) & refused.any(axis=0)] = NONE
        points.involved[: len(refused), points.status == NONE] |= refused[:, points.status == NONE]
        points.involved[:, (points.status == OK) | (points.status == IMMOVABLE)] = False
        return points

    def _refused(self, torques: Rows) -> Mask:
        """The laws with an infinite torque, or with their limits in the wrong order."""
        torque, lower, upper = torques[::3], torques[1::3], torques[2::3]
        crossed = lower - upper > balance_tolerance(np.abs(torque).max(axis=0, initial=0.0))
        return np.asarray(~(np.abs(torque) <= INFINITE) | crossed)

    def values(self, grid: Rows, u: Rows, modes: Rows) -> tuple[Rows, Mask]:
        """The requested values, and which guards are violated."""
        with np.errstate(all="ignore"):
            found = self._values.of_points([grid.T, u.T, modes.T])
        return found[: self.wanted], ~(found[self.wanted :] >= 0.0)

    def holds(self, grid: Rows, modes: Rows, apart: Mask) -> Mask:
        """Whether the modes of all laws except those ``apart`` hold, if only modes are unknown."""
        with np.errstate(all="ignore"):
            return self._combinations.holds(grid, modes, apart)

    def between(self, grid: Rows, side: Rows, rest: Mask, near: SolvedPoints) -> tuple[Rows, Rows, Mask]:
        """Unknowns and modes with the torques of laws that ``rest`` at ``side`` (-1 and 1 are the limits), and which are solutions.

        For implicit unknowns; the search begins at ``near``.
        """
        found = self._between.solve(grid.T, side[self._moving].T, rest[self._moving].T, near)
        u, modes = self._unknowns(found), found.modes.T
        return u, modes, found.done & self._creep.settle(grid, u, modes)

    @cached_property
    def _between(self) -> Between:
        return Between(self.problem.balance)

    def _together(self, grid: Rows, side: Rows) -> Points:
        """Solve for modes and unknowns as one problem."""
        count, moving = grid.shape[1], self._moving
        best = self._solutions.solve(grid.T, side[moving].T)
        status = np.select([~best.solved.done, best.several], [DIVERGED, SEVERAL], OK).astype(np.int8)
        rest, involved = np.zeros((len(self.choices), count), bool), best.differing.T.copy()
        rest[moving] = best.rest.T
        nameless = (status != OK) & ~involved.any(axis=0) & ~best.apart  # no law is to blame for several equilibria
        involved[np.ix_(moving, np.flatnonzero(nameless))] = True
        found = best.solved
        points = Points(self._unknowns(found), found.modes.T.copy(), status, involved, rest, found)
        self._limit(grid, points)
        return points

    def _unknowns(self, found: SolvedPoints) -> Rows:
        """The implicit unknowns, which may be torques of laws."""
        known = [*found.y.T, *np.where(self._solutions.laws.contact, -found.tau, found.tau).T]
        return np.array([known[k] for k in self._places]).reshape(len(self._places), len(found.y))

    def _within(self, grid: Array, found: SolvedPoints) -> Mask:
        """Which solutions are within the limits of the model, and have limits of friction in order."""
        if not len(grid):
            return np.ones(0, bool)
        margins = self._limits.of_points([grid, self._unknowns(found).T, found.modes])
        return np.asarray((margins >= 0.0).all(axis=0))

    def _limit(self, grid: Rows, points: Points) -> None:
        """Laws at rest share a torque by compliance; what exceeds the static limit of one law is passed on to the others.

        The model's compliance is not that of the search. All laws at rest begin stuck and yield one after the other. Where the last of them
        fails to hold what is left, the modes that the search found are taken instead; where these fail, too, there is no solution.
        """
        count = len(self._shared)
        modes, u = points.modes.copy(), points.u.copy()
        slides = (modes[:count] == FORWARD) | (modes[:count] == BACKWARD)
        if (held := self._shared[:, None] & ~points.rest[:count] & (points.status == OK) & slides).any():
            still = np.abs(self._speeds.of_points([grid.T, points.u.T, points.modes.T])[:count]) <= ZONE
            points.modes[:count][held & still] = STUCK
        left = self._passed_on(grid, points, np.flatnonzero((points.status == OK) | (points.status == SEVERAL)))
        points.modes[:, left], points.u[:, left] = modes[:, left], u[:, left]
        left = self._passed_on(grid, points, left) if left.size else left
        points.status[left] = DIVERGED

    def _passed_on(self, grid: Rows, points: Points, which: Index) -> Index:
        """Let stuck laws yield that are beyond their limits; return the points that are no equilibrium then.

        Under a growing load the law with the largest torque over its limit yields first, which may spare the others.
        """
        left, lost = which, [which[:0]]
        for _ in range(len(self._shared) + 1):
            u = points.u.take(left, axis=1)
            good = self._creep.settle(grid.take(left, axis=1), u, points.modes.take(left, axis=1))
            points.u[:, left] = u
            lost.append(left[~good])
            left = self._yielding(grid, points, left[good])
            if not left.size:
                break
        return np.concatenate(lost)

    def _yielding(self, grid: Rows, points: Points, which: Index) -> Index:
        """Let the law farthest beyond its limit slide at each point; return the points at which one does."""
        count = len(self._shared)
        held = ((points.modes[:count] == STUCK) & ~points.rest[:count]).any(axis=0) & (points.status == OK)
        which = which[held[which]]
        if not which.size:
            return which
        modes = points.modes[:, which]
        stuck = (modes[:count] == STUCK) & ~points.rest[:count, which]
        found = self._torques.of_points([grid[:, which].T, points.u[:, which].T, modes.T])
        torque, lower, upper = found[::3], found[1::3], found[2::3]
        known = balance_tolerance(np.abs(torque).max(axis=0, initial=0.0))
        above, below = stuck & (torque > upper + known), stuck & (torque < lower - known)
        over = np.where(above, (torque - upper) / (np.abs(upper) + known), -np.inf)
        over = np.where(below, (lower - torque) / (np.abs(lower) + known), over)
        yields = (above | below) & (over == over.max(axis=0, initial=-np.inf))
        modes[:count][above & yields], modes[:count][below & yields] = FORWARD, BACKWARD
        points.modes[:, which] = modes
        return np.asarray(which[yields.any(axis=0)])
