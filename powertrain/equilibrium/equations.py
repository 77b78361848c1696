"""The equations of operating points for given modes, as functions of columns: values and matrix.

    f(y, tau) - (y - y')/h = 0                  rows; the last term only for rates
    w(y, tau) - yields (tau - tau') = 0         stuck laws: at rest, except for their compliance
    tau - U(y, tau) = 0, tau - L(y, tau) = 0    laws at a limit

y' and tau' are the values before the step. The last terms enter only the matrix, and hold motions that nothing else holds.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from powertrain.equilibrium.balance import Balance
from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import Columns, picked
from powertrain.numerics.buffers import Array
from powertrain.numerics.elimination import Pattern
from powertrain.numerics.newton import Solver

HELD, UPPER, LOWER, LEAST, NOTHING = range(5)
"""The equation of a law: its speed is zero, or its torque equals a limit, the smallest torque between the limits, or zero."""


class Equations:
    """Matrix and values in z = (y, tau) at many points; in ``balance`` all torques have the same sign. Serves one thread."""

    def __init__(self, balance: Balance, compile: bool) -> None:
        b, count = balance, balance.tau.numel()
        kinds, yields, length = Symbol.sym("kinds", count), Symbol.sym("yields", count), Symbol.sym("h")
        z = ca.vertcat(b.y, b.tau)
        matrix, values = ca.jacobian(b.rows, z), [b.rows]
        for i in np.flatnonzero(b.rate_of >= 0).tolist():
            matrix[i, int(b.rate_of[i])] -= 1 / length
        held, low, high = (ca.jacobian(e, z) for e in (b.speed, b.lower, b.upper))
        for k in range(count):
            own = ca.SX(ca.DM.triplet([0], [b.y.numel() + k], [1.0], 1, z.numel()))
            options = {HELD: held[k, :] - yields[k] * own, UPPER: own - high[k, :], LOWER: own - low[k, :]}
            matrix = ca.vertcat(matrix, _chosen(kinds[k], options | {LEAST: own, NOTHING: own}))
            smallest = ca.fmin(ca.fmax(0, ca.fmin(b.lower[k], b.upper[k])), ca.fmax(b.lower[k], b.upper[k]))
            torque = {UPPER: b.tau[k] - b.upper[k], LOWER: b.tau[k] - b.lower[k], LEAST: b.tau[k] - smallest}
            values.append(_chosen(kinds[k], torque | {HELD: b.speed[k], NOTHING: b.tau[k]}))
        self.pattern, entries = Pattern(matrix.sparsity()), [matrix.nz[k] for k in range(matrix.nnz())]
        given = ca.vertcat(b.grid, b.modes, kinds, yields, length)
        varying = ca.vertsplit(ca.vertcat(given, z))
        right = ca.vertsplit(ca.vertcat(*values)) if z.numel() else []
        self._columns, self._size = (
            Columns("steady_equations", varying, b.common, [*entries, *right], compile),
            len(entries),
        )
        needed, first = self._columns.needed, given.numel()
        self._given, self._moving = needed[needed < first], needed[needed >= first] - first

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def given(self, grid: Array, modes: Array, kinds: Array, yields: Array, length: float) -> list[Array]:
        """Everything constant while z changes, one row per quantity; the arguments have one row per point, except the step length h."""
        return picked([grid, modes, kinds, yields, np.full((len(grid), 1), length)], self._given)

    def __call__(self, given: list[Array], z: Array) -> tuple[Array, Array]:
        """The entries of the matrix for ``solver``, and the values, one row per point, of ``given`` for the same points."""
        with np.errstate(all="ignore"):
            found = self._columns.of_needed([*given, *picked([z], self._moving)], len(z))
        return found[: self._size].T, found[self._size :].T

    def solver(self, entries: Array) -> Solver:
        """The solver of the matrices."""
        return self.pattern.solver(entries)


def _chosen(kind: Symbol, options: Mapping[int, Symbol]) -> Symbol:
    """The entries of the option with this number; those of other options may have no value."""
    places = sorted({j for e in options.values() for j in e.sparsity().get_col()})
    chosen = ca.SX(1, next(iter(options.values())).shape[1])
    for j in places:
        chosen[j] = sum((ca.if_else(kind == k, e[j], 0) for k, e in options.items()), Symbol(0))
    return chosen
