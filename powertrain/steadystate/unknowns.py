"""The unknowns that stay implicit, for given modes of the laws that depend on them."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Friction
from powertrain.engine.buffers import Array
from powertrain.modes.tolerances import ZONE
from powertrain.steadystate.choices import FORWARD, STUCK, Group, held_rows
from powertrain.steadystate.columns import Columns
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.lanes import Rows
from powertrain.steadystate.newton import IMPOSSIBLE, Evaluate, newton, newton_step
from powertrain.steadystate.points import Index, Mask
from powertrain.symbols import column

_ROUND_OFF = 1e-13
_MOVES = 8
_STILL = 1e-9
_COUNTS_NOT = np.nan


class Unknowns:
    """The unknowns of a group.

    While a law is stuck, its speed is zero, and rows that its torque keeps at zero say nothing more; one that slides keeps its direction.
    """

    def __init__(self, problem: Equilibrium, group: Group) -> None:
        first = len(problem.grid)
        self.places = [first + j for j in group.unknowns]
        laws = first + len(problem.u)
        held = [(k, row) for k, row in held_rows(problem) if k in group.laws]
        self._held = [(laws + k, isinstance(problem.laws[k], Friction)) for k, _ in held]
        rows = column([*(problem.rows[i] for i in group.rows), *(row for _, row in held)])
        jacobian = ca.densify(ca.jacobian(rows, column([problem.u[j] for j in group.unknowns])))
        self._shape = rows.numel(), len(group.unknowns)
        self._plain = len(group.rows)
        outputs = [rows[i] for i in range(rows.numel())] + list(ca.vertsplit(ca.vec(jacobian.T)))
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._columns = Columns("steady_newton", varying, problem.common, outputs)
        used = [(i, self.places.index(k)) for i, k in enumerate(self._columns.needed.tolist()) if k in self.places]
        self._own, self._used = [i for i, _ in used], [j for _, j in used]

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def solve(self, values: Rows, sides: Rows, speed: float) -> tuple[Rows, NDArray[np.int8], Mask]:
        """The unknowns, the outcomes of Newton's method, and whether another speed to begin with may lead elsewhere."""
        given, u = values[self._columns.needed], values[self.places]

        def evaluate(u: Rows, where: Index) -> tuple[Rows, NDArray[np.float64]]:
            here = given[:, where]
            here[self._own] = u[self._used]
            return self._split(self._columns.of_needed(here))

        can, moved = self._move(evaluate, u, sides, speed)
        some, outcome = np.flatnonzero(can), np.full(can.size, IMPOSSIBLE, np.int8)
        u[:, some], outcome[some] = newton(lambda u, where: evaluate(u, some[where]), u[:, some], sides[:, some])
        return u, outcome, can & moved

    def _split(self, found: Rows) -> tuple[Rows, NDArray[np.float64]]:
        rows, unknowns = self._shape
        return found[:rows], found[rows:].reshape(rows, unknowns, -1)

    def sides(self, values: Rows) -> Rows:
        """What every row is for ``newton``, by the modes."""
        sides = np.zeros((self._shape[0], values.shape[1]))
        for j, (place, friction) in enumerate(self._held, self._plain):
            mode = values[place]
            sides[j] = mode if friction else 1.0 - mode
            sides[j, np.abs(sides[j]) > 1.0] = _COUNTS_NOT
        stuck = np.flatnonzero((sides[self._plain :] == 0.0).any(axis=0))
        if stuck.size:
            _, slopes = self._split(self._columns(values[:, stuck]))
            largest = np.abs(self._loose_slopes(values[:, stuck])).max(axis=1)
            lost = (np.abs(slopes).max(axis=1) <= _ROUND_OFF * largest) & (largest > 0.0)
            sides[:, stuck] = np.where(lost & (sides[:, stuck] == 0.0), _COUNTS_NOT, sides[:, stuck])
        return sides

    def _loose_slopes(self, values: Rows) -> NDArray[np.float64]:
        """The slopes while nothing is stuck; beside them, those that stuck laws leave may be round-off."""
        loose = values.copy()
        for place, friction in self._held:
            loose[place] = np.where(values[place] == STUCK, FORWARD, values[place]) if friction else 0.0
        return np.nan_to_num(self._split(self._columns(loose))[1], nan=0.0, posinf=0.0, neginf=0.0)

    def _move(self, evaluate: Evaluate, u: Rows, sides: Rows, speed: float) -> tuple[Mask, Mask]:
        """Moves a start until laws that slide do so, with ``speed`` where they did not; whether they can, and whether it was moved."""
        active, moved = np.arange(u.shape[1]), np.zeros(u.shape[1], bool)
        can = ~moved
        for _ in range(_MOVES):
            values, slopes = evaluate(u[:, active], active)
            kept = sides[:, active]
            wrong = (np.abs(kept) == 1.0) & (values * kept <= ZONE)
            some = np.flatnonzero(wrong.any(axis=0))
            if not some.size:
                break
            held = (wrong | (kept == 0.0))[:, some]
            held[: self._plain] = False
            gap, slope = (values - kept * speed)[:, some], slopes[..., some]
            step, _ = newton_step(np.where(held, gap, 0.0), np.where(held[:, None], slope, 0.0))
            active = active[some]
            still = ~(np.abs(step) > _STILL * speed).any(axis=0)
            can[active[still]] = False
            active = active[~still]
            u[:, active] -= step[:, ~still]
            moved[active] = True
        return can, moved
