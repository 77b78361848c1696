"""Operating points, many at once: the modes of all laws and the unknowns found together, point by point with a status.

Laws and unknowns fall into groups that are resolved one after the other. In every group all combinations of modes are tried that what is
known of the point does not rule out, and every one that is consistent is followed: so none, one or several solutions are told apart.
"""

from __future__ import annotations

import numpy as np

from powertrain.compiler.hybrid import Friction, Switch
from powertrain.engine.buffers import Array
from powertrain.engine.indicators import guard_margin
from powertrain.steadystate.choices import INFINITE, choices, order
from powertrain.steadystate.columns import Columns
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows
from powertrain.steadystate.points import IMMOVABLE, NONE, OK, ONE, SEVERAL, Mask, Points, Trials
from powertrain.steadystate.search import Search
from powertrain.steadystate.solutions import Solutions
from powertrain.steadystate.steady_laws import SteadyLaws


class Solver:
    """Solves one steady problem at given points. Serves one thread."""

    def __init__(self, problem: Equilibrium) -> None:
        self.problem = problem
        self.laws = SteadyLaws(problem.balance) if problem.u and problem.balance is not None else None
        self._solutions = Solutions(self.laws) if self.laws is not None else None
        self.choices = choices(problem)
        self.groups = order(problem, self.choices)
        self._searches = [Search(problem, self.choices, group) for group in self.groups]
        varying = [*problem.grid, *problem.u, *problem.modes]
        guards = [guard_margin(g) for g in problem.guards]
        wanted = [*problem.outputs, *problem.rates]
        self.wanted = len(wanted)
        self._values = Columns("steady_values", varying, problem.common, [*wanted, *guards])
        speeds = [law.w for law in problem.laws if isinstance(law, Friction)]
        self._speeds = Columns("steady_speeds", varying, problem.common, [*speeds, *problem.solved])

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        for search in self._searches:
            search.set_common(values)
        for columns in (self._values, self._speeds):
            columns.set_common(values)
        if self.laws is not None:
            self.laws.set_common(values)

    def solve(self, grid: Rows, side: Rows | None = None, exhaustive: bool = False) -> Points:
        """The points of ``grid`` (one row per axis); ``side`` says for laws at rest from which side (1 or -1) they are looked at."""
        laws, first, count = len(self.choices), len(grid) + len(self.problem.u), grid.shape[1]
        if side is None:
            side = np.ones((laws, count))
        if self._solutions is not None:
            return self._by_continuation(self._solutions, grid, side)
        trials = Trials.of(grid, self.problem.u_start, laws)
        values, rest = trials.values.copy(), trials.rest.copy()
        status, blame = np.zeros(count, np.int8), np.zeros((laws, count), bool)
        with np.errstate(all="ignore"):
            for search in self._searches:
                before = trials
                trials, failure, about = search.extend(before, side, exhaustive)
                left, had = trials.per_point(count), before.per_point(count)
                ended = left[before.point] == 0
                lost = before.point[ended]
                values[:, lost], rest[:, lost], status[lost] = (
                    before.values[:, ended],
                    before.rest[:, ended],
                    failure[ended],
                )
                for k, law in zip(search.group.laws, about, strict=True):
                    blame[k, lost] = law[ended]
                    blame[k, left > had] = True
            found, best = np.unique(trials.point, return_index=True)
            values[:, found], rest[:, found] = trials.values[:, best], trials.rest[:, best]
            loose = np.bincount(trials.point, trials.loose, count) > 0
            several = (trials.per_point(count) > 1) | loose
            status[found] = np.where(several[found], SEVERAL, np.where(trials.alone[best], ONE, OK))
            status[~(np.abs(self._speeds(values)) <= INFINITE).all(axis=0)] = IMMOVABLE
        values[len(grid) : first, loose] = np.nan
        blame[:, np.isin(status, (OK, ONE, IMMOVABLE))] = False
        return Points(values[len(grid) : first], values[first:], status, blame, rest)

    def _by_continuation(self, solutions: Solutions, grid: Rows, side: Rows) -> Points:
        """Points whose unknowns are implicit."""
        balance, count = solutions.laws.balance, grid.shape[1]
        places = np.array([k for k, law in enumerate(self.problem.laws) if not isinstance(law, Switch)], np.intp)
        best = solutions.solve(grid.T, side[places].T)
        found = best.solved
        names = {n: found.y[:, i] for i, n in enumerate(balance.names)}
        names |= {balance.tau[i].name(): found.tau[:, i] for i in range(balance.tau.numel()) if balance.tau[i].is_symbolic()}
        u = np.array([names[n] for n in self.problem.u_names]).reshape(len(self.problem.u_names), count)
        modes = found.modes.T
        status = np.select([best.number == 0, best.number > 1], [NONE, SEVERAL], OK).astype(np.int8)
        with np.errstate(all="ignore"):
            fine = (np.abs(self._speeds(np.vstack([grid, u, modes]))) <= INFINITE).all(axis=0)
        status[(status == OK) & ~fine] = IMMOVABLE
        rest, blame = np.zeros(modes.shape, bool), best.differing.T.copy()
        rest[places] = best.rest.T
        lost = (status == NONE) | ((status == SEVERAL) & ~blame.any(axis=0))
        blame[np.ix_(places, np.flatnonzero(lost))] = True
        blame[:, (status == OK) | (status == IMMOVABLE)] = False
        return Points(u, modes, status, blame, rest)

    def values(self, grid: Rows, points: Points) -> tuple[Rows, Mask]:
        """The wanted values, and which guards are left."""
        with np.errstate(all="ignore"):
            found = self._values(np.vstack([grid, points.u, points.modes]))
        return found[: self.wanted], ~(found[self.wanted :] >= 0.0)
