"""The equations and conditions of a start as rows of numbers, with their Jacobian."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import ROUND_OFF
from powertrain.initialization.choice import StartJacobian
from powertrain.initialization.conditions import StartEquation
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.numerics.buffers import Evaluated


class StartRows:
    """Equations, each to be zero, and conditions, each to have a value, of the unknowns y = (x, z). Serves one thread.

    ``implicit``: the number of equations, which come first. ``linear``: the Jacobian is constant, and there are no equations. ``modal``:
    rows or slopes depend on modes.
    """

    def __init__(self, dae: HybridDae, conditions: Sequence[StartEquation]) -> None:
        expressions = [c.expression for c in conditions]
        residuals = _residuals_to_solve(dae, expressions)
        self.implicit, y = len(residuals), ca.vertcat(dae.x, dae.z)
        rows = column([*residuals, *expressions])
        slopes = ca.jacobian(rows, y)
        self.function = ca.Function(
            "powertrain_initial", [dae.t, y, dae.m, dae.p], [ca.densify(rows), ca.densify(slopes.nz[:])]
        )
        self._values = Evaluated(self.function)
        self.linear = not self.implicit and not ca.depends_on(slopes.nz[:], y)
        outputs = ca.vertcat(rows, ca.vec(slopes.nz[:])) if rows.numel() else rows
        self.modal = bool(dae.m.numel()) and any(ca.which_depends(outputs, dae.m, 1, True))
        i, k = (np.array(places, int) for places in slopes.sparsity().get_triplet())
        self.jacobian = StartJacobian(i, k, self.implicit, len(conditions), dae.x.numel(), y.numel())
        self._single = np.flatnonzero((i >= self.implicit) & (np.bincount(i)[i] == 1))

    def at(self, t: float, y: Array, m: Array, p: Array) -> tuple[Array, Array]:
        """All rows and the nonzeros of their Jacobian."""
        rows, nonzeros = self._values(t, y, m, p)
        return rows.ravel(), nonzeros.ravel()

    def solve_single(self, t: float, y: Array, m: Array, p: Array, target: Array) -> None:
        """A Newton step of every condition with a single unknown: from its guess, Newton's method for all equations may not converge."""
        r, j = self.at(t, y, m, p)
        guess = y.copy()
        for n in self._single[::-1].tolist():  # the first condition prevails
            i, k = self.jacobian.rows[n], self.jacobian.columns[n]
            value = guess[k] - (r[i] - target[i]) / j[n] if j[n] else np.nan
            if np.isfinite(value):
                y[k] = value

    def are_round_off(self, gap: Array, nonzeros: Array, y: Array) -> NDArray[np.bool_]:
        """Which rows are zero within the round-off of their terms; stiff equations cannot do better."""
        with np.errstate(invalid="ignore"):
            terms = np.bincount(self.jacobian.rows, np.abs(nonzeros * y[self.jacobian.columns]), len(gap))
        return np.asarray(np.abs(gap) <= ROUND_OFF * terms)

    def slopes(self, rows: NDArray[np.intp], nonzeros: Array) -> Array:
        """Some rows of the Jacobian as a matrix."""
        place = np.full(self.implicit + self.jacobian.conditions, -1)
        place[rows] = np.arange(len(rows))
        inside = np.flatnonzero(place[self.jacobian.rows] >= 0)
        found = np.zeros((len(rows), self.jacobian.unknowns))
        found[place[self.jacobian.rows[inside]], self.jacobian.columns[inside]] = nonzeros[inside]
        return found


def _residuals_to_solve(dae: HybridDae, conditions: list[Symbol]) -> list[Symbol]:
    """The algebraic equations, unless they depend on modes and no condition needs their unknowns; then both are solved together later."""
    if not dae.z.numel():
        return []
    needed = bool(conditions) and any(ca.which_depends(column(conditions), dae.z, 1, True))
    modal = bool(dae.m.numel()) and any(ca.which_depends(dae.residual, dae.m, 1, True))
    return scalars(dae.residual) if needed or not modal else []
