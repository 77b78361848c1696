"""The algebraic unknowns at one instant, by damped Newton steps with pivoting, at starts and after events."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import BALANCED, FOUND, KINK, ROUND_OFF
from powertrain.language.reals import Array
from powertrain.modes.selflocking import SelfLocking
from powertrain.numerics.buffers import Call, Evaluated, Memory, bound, zeros
from powertrain.numerics.newton import Index, newton

_ITERATIONS = 60


class NotConsistent(ArithmeticError):
    """The algebraic equations have no solution near the guess; the message quotes the unsatisfied equations."""


class AlgebraicSolver:
    """Solves 0 = residual(t, x, z, m, p) for z in place, on either side of the double-buffered unknowns."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.n = dae, dae.x.numel()
        self._memory, self._self_locking = memory, SelfLocking(dae, memory)
        self._quick: list[Call] = []
        self._nearer, self._unsettled = zeros(dae.z.numel()), zeros(1)
        self._algebra = Evaluated(dae.function("algebra", *ca.cse([dae.residual, ca.jacobian(dae.residual, dae.z)])))

    def hasten(self, function: ca.Function) -> None:
        """Try ``function`` first: (time, y, m, p) -> z after a few Newton steps, and 0 if ``solve`` would give the same z."""
        memory, results = self._memory, [self._nearer, self._unsettled]
        self._quick = [bound(function, [memory.time, side, memory.m, memory.p], results) for side in memory.y]

    def equations(self, side: int) -> tuple[Array, Array]:
        """d(residual)/dz and the residuals at the current point."""
        residual, jacobian = self._algebra(*self._memory.instant(side))
        return jacobian, residual.ravel()

    def solve(self, side: int) -> None:
        """Correct z in ``memory.y[side]``; raises NotConsistent."""
        z = self._memory.y[side][self.n :]
        if self._quick:
            self._quick[side]()
            if self._unsettled[0] == 0.0:
                z[:] = self._nearer
                return

        def equations(_: Index, trial: Array) -> tuple[Array, Array]:
            z[:] = trial[0]
            jacobian, residual = self.equations(side)
            return jacobian[None], residual[None]

        found, fine = newton(equations, z[None], still=FOUND, most=_ITERATIONS)
        z[:] = found[0]
        jacobian, residual = self.equations(side)
        # stiff equations cannot do better than the round-off of their terms
        with np.errstate(invalid="ignore"):
            terms = np.abs(jacobian) @ (BALANCED * (1.0 + np.abs(z)) if fine[0] else ROUND_OFF * np.abs(z))
        if not (np.abs(residual) <= terms).all() and not np.abs(residual).max() <= KINK:
            self._refuse(side, residual)

    def _refuse(self, side: int, residual: Array) -> None:
        sizes = np.where(np.isfinite(residual), np.abs(residual), np.inf)
        rows = [int(k) for k in np.argsort(-sizes, kind="stable")[:4] if sizes[k] > 0.0]
        quoted = "\n  ".join(f"{self.dae.equation(k)}: left minus right is {residual[k]:.6g}" for k in rows)
        loop = (
            "these equations have no solution near the guess (an algebraic loop), or their slopes vanish there; check them, give guesses "
            "of their unknowns, or put an inertia or a compliance where a motion is loose"
        )
        raise NotConsistent(f"{self._self_locking.found(side) or loop}\n  {quoted}")
