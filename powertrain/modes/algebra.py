"""The algebraic unknowns at one instant, by damped Newton steps with pivoting, at starts and after events."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import BALANCED, FOUND, KINK, ROUND_OFF
from powertrain.modes.selflocking import SelfLocking
from powertrain.numerics.buffers import PREFIX, Array, Bound, Memory, zeros
from powertrain.numerics.newton import newton

_ITERATIONS = 60


class NotConsistent(ArithmeticError):
    """The algebraic equations have no solution near the guess; the message quotes the unsatisfied equations."""


class AlgebraicSolver:
    """Solves 0 = residual(t, x, z, m, p) for z in place, on either side of the double-buffered unknowns."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self.dae, self.n, self.nz = dae, dae.x.numel(), dae.z.numel()
        self._y, self._self_locking = memory.y, SelfLocking(dae, memory)
        self._quick: list[Bound] = []
        self._nearer, self._unsettled = zeros(self.nz), zeros(1)
        self._residual, self._jacobian = zeros(self.nz), zeros(self.nz * self.nz)
        time, y = ca.SX.sym("time", 2), ca.SX.sym("y", self.n + self.nz)
        inner = dae.function("algebra", dae.residual, ca.jacobian(dae.residual, dae.z))
        residual, jacobian = inner.call([time[0], y[: self.n], y[self.n :], dae.m, dae.p])
        outputs = ca.cse([residual, jacobian])
        self.function = ca.Function(PREFIX + "newton", [time, y, dae.m, dae.p], outputs)
        results = [self._residual, self._jacobian]
        self._bound = [Bound(self.function, [memory.time, side, memory.m, memory.p], results) for side in memory.y]

    def hasten(self, function: ca.Function, memory: Memory) -> None:
        """Try ``function`` first: (time, y, m, p) -> z after a few Newton steps, and 0 if ``solve`` would give the same z."""
        results = [self._nearer, self._unsettled]
        self._quick = [Bound(function, [memory.time, side, memory.m, memory.p], results) for side in memory.y]

    def jacobian(self, side: int) -> Array:
        """d(residual)/dz at the current point."""
        self._bound[side].call()
        return self._jacobian.reshape(self.nz, self.nz, order="F").copy()

    def solve(self, side: int) -> None:
        """Correct z in ``memory.y[side]``; raises NotConsistent."""
        if not self.nz:
            return
        z, call = self._y[side][self.n :], self._bound[side].call
        if self._quick:
            self._quick[side].call()
            if self._unsettled[0] == 0.0:
                z[:] = self._nearer
                return
        found, fine = newton(lambda _, trial: self._equations(side, trial[0]), z[None], still=FOUND, most=_ITERATIONS)
        z[:] = found[0]
        call()
        if (
            not self._closed(BALANCED * (1.0 + np.abs(z)) if fine[0] else ROUND_OFF * np.abs(z))
            and not float(np.abs(self._residual).max()) <= KINK
        ):
            self._refuse(side)

    def _equations(self, side: int, trial: Array) -> tuple[Array, Array]:
        """Matrix and values of the equations at a trial, shaped as a batch of one system."""
        self._y[side][self.n :] = trial
        self._bound[side].call()
        return self._jacobian.reshape(1, self.nz, self.nz).transpose(0, 2, 1).copy(), self._residual[None].copy()

    def _closed(self, errors: Array) -> bool:
        """Whether each residual is no larger than ``errors`` of the unknowns explain; stiff equations cannot do better than round-off."""
        with np.errstate(invalid="ignore"):
            terms = np.abs(self._jacobian.reshape(self.nz, self.nz, order="F")) @ errors
        return bool(np.all(np.abs(self._residual) <= terms))

    def _refuse(self, side: int) -> None:
        sizes = np.where(np.isfinite(self._residual), np.abs(self._residual), np.inf)
        rows = [int(k) for k in np.argsort(-sizes, kind="stable")[:4] if sizes[k] > 0.0]
        quoted = "\n  ".join(f"{self.dae.equation(k)}: left minus right is {self._residual[k]:.6g}" for k in rows)
        loop = (
            "these equations have no solution near the guess (an algebraic loop), or their slopes vanish there; check them, give guesses "
            "of their unknowns, or put an inertia or a compliance where a motion is loose"
        )
        raise NotConsistent(f"{self._self_locking.found(side) or loop}\n  {quoted}")
