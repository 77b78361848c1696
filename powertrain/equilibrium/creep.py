"""The speeds at which stuck laws creep at an operating point.

Operating points are found with the torques of laws as unknowns. The model itself computes torques from modes: if a stuck law acts on a
part without inertia, its torque follows from a speed, through its compliance, and at a speed of exactly zero such laws share a load that
only one of them carries. As in a run, they creep at the speeds at which nothing accelerates.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np

from powertrain.dae.tolerances import BALANCED, CREEP, STILL
from powertrain.equilibrium.points import Index, Mask
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.reals import Array
from powertrain.language.symbols import column, scalars
from powertrain.numerics.batch import Columns, Rows
from powertrain.numerics.elimination import Pattern
from powertrain.numerics.newton import Solver, newton, relative

CORRECTIONS = 4
"""Newton steps; the equations are almost linear in speeds as small as these."""
STIFF = 1e-6
"""Slopes below this share of the largest are not those of compliances, which are 1e8 times stiffer than inertias."""
ROUND_OFF = 1e-14
"""Share of its terms that an equation may differ from zero, besides ``BALANCED``."""


class Creep:
    """Balances the model's own equations in the modes of given points. Serves one thread."""

    def __init__(self, problem: Equilibrium, compile: bool) -> None:
        rows, u = column(problem.rows), column(problem.u)
        slopes = ca.jacobian(rows, u)
        self._pattern, self._count = Pattern(slopes.sparsity()), rows.numel()
        outputs = [*(slopes.nz[k] for k in range(slopes.nnz())), *scalars(rows)]
        varying = [*problem.grid, *problem.u, *problem.modes]
        self._equations = Columns("steady_creep", varying, problem.common, outputs, compile)
        self._apart = np.array([name in problem.balance.names for name in problem.u_names], bool)
        creep = ca.SX.sym("creep", u.numel())
        terms = ca.fabs(slopes) @ ca.fabs(creep) + column(problem.torques_in)
        allowed = BALANCED * (1 + terms) + ROUND_OFF * (ca.fabs(slopes) @ ca.fabs(u))
        varying = [*varying, *scalars(creep)]
        self._excess = Columns("steady_excess", varying, problem.common, scalars(ca.fabs(rows) - allowed), compile)

    def settle(self, grid: Rows, u: Rows, modes: Rows) -> Mask:
        """Change ``u`` where the equations are not zero in ``modes``; return where they are zero now."""
        good = self._balanced(grid, u, modes, np.zeros_like(u))
        if good.all():
            return good
        for factors, exact in ((self._pattern.solver, True), (self._shortest, False)):
            left = np.flatnonzero(~good)
            if not left.size:
                break
            z, still = self._corrected(grid[:, left], u[:, left], modes[:, left], factors)
            creep = z - u[:, left]
            near = (np.abs(creep) / relative(u[:, left]) <= CREEP)[self._apart].all(axis=0)
            better = near & (still & exact | self._balanced(grid[:, left], z, modes[:, left], creep))
            u[:, left[better]] = z[:, better]
            good[left] = better
        return good

    def _corrected(self, grid: Rows, u: Rows, modes: Rows, factors: Callable[[Array], Solver]) -> tuple[Rows, Mask]:
        """The unknowns after Newton steps, and where these have become still."""

        def equations(which: Index, z: Array) -> tuple[Array, Array]:
            found = self._equations.of_points([grid.T[which], z, modes.T[which]])
            return found[: -self._count].T, found[-self._count :].T

        z, still = newton(equations, u.T, still=STILL, most=CORRECTIONS, halvings=0, factors=factors)
        return z.T, still

    def _shortest(self, entries: Array) -> Solver:
        """Steps that only make laws creep: other motions are balanced, and round-off would move those that nothing holds."""
        slopes = np.nan_to_num(self._pattern.dense(entries))
        return lambda right: (np.linalg.pinv(slopes, rcond=STIFF) @ right[:, :, None])[:, :, 0]

    def _balanced(self, grid: Rows, u: Rows, modes: Rows, creep: Rows) -> Mask:
        """Whether the equations are zero, compared with what they owe to torques and to a change of the unknowns by ``creep``."""
        return np.asarray((self._excess.of_points([grid.T, u.T, modes.T, creep.T]) <= 0.0).all(axis=0))
