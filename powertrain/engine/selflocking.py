"""Sliding laws that draw themselves in, as a wedge or a brake shoe does: their limit grows with their own torque, and faster.

A law that slides forward has the torque T = upper(T). Where d(upper)/dT > 1, no torque is large enough: an equation solved all the same
gives a torque of the other sign, upper < lower, with which friction would drive.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.engine.buffers import Array, Memory
from powertrain.engine.indicators import IMPLICIT_EPS
from powertrain.engine.modes import ZONE
from powertrain.errors import SimulationError


class SelfLocking:
    """Looks at the laws whose limits depend on torques."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self._memory, self._sizes = memory, (dae.x.numel(), dae.z.numel(), dae.m.numel(), dae.p.numel())
        torques = ca.vertcat(dae.z, dae.m)
        self._laws = [f for f in dae.frictions if ca.depends_on(ca.vertcat(f.lower, f.upper), torques)]
        self._dae = dae
        self._limits = self._function([ca.horzcat(f.w, f.lower, f.upper) for f in self._laws])
        self._slopes: ca.Function | None = None

    def check(self, side: int) -> None:
        """SimulationError for a law that slides although its limits stand the wrong way round."""
        if not self._laws:
            return
        w, lower, upper = self._at(side, self._limits).T
        inverted = (np.abs(w) > ZONE) & (lower - upper > IMPLICIT_EPS * (1.0 + np.abs(lower) + np.abs(upper)))
        for law, bad, low, high in zip(self._laws, inverted, lower, upper, strict=True):
            if bad and self._memory.m[law.index] != 0.0:
                raise SimulationError(
                    f"{_said(law)}. At t = {self._memory.time[0]:.9g} s it slides with limits of {low:.6g} and {high:.6g} {law.unit}, "
                    f"the wrong way round: friction would drive. {_ADVICE}"
                )

    def found(self, side: int) -> str:
        """What to say of laws whose own equation has no solution; '' where there are none."""
        if not self._laws:
            return ""
        if self._slopes is None:
            self._slopes = self._function([_slope(self._dae, f) for f in self._laws])
        slopes = self._at(side, self._slopes)[:, 0]
        locked = [_said(law) for law, slope in zip(self._laws, slopes, strict=True) if slope >= 1.0]
        return f"{'; '.join(locked)}. {_ADVICE}" if locked else ""

    def _function(self, rows: Sequence[ca.SX]) -> ca.Function:
        dae = self._dae
        inputs = [dae.t, dae.x, dae.z, dae.m, dae.p]
        return ca.Function("powertrain_self_locking", inputs, [ca.densify(ca.vertcat(*rows))])

    def _at(self, side: int, function: ca.Function) -> Array:
        memory, (n, nz, nm, count) = self._memory, self._sizes
        y = memory.y[side]
        return np.asarray(function(memory.time[0], y[:n], y[n : n + nz], memory.m[:nm], memory.p[:count]), float)


_LARGE = 1e6
_ADVICE = "Let it start at rest, or put a stiffness into the way of the force that presses it, whose change takes time."


def _said(law: Friction) -> str:
    return f"{law.name} ({law.where}) is self-locking: its limit grows with its own torque, and faster"


def _slope(dae: HybridDae, law: Friction) -> ca.SX:
    """By how much the limit of a sliding law grows with its own torque where that is large, as far as it is an implicit unknown."""
    forward = dae.m[law.index] >= 0
    limit = ca.if_else(forward, law.upper, law.lower)
    way = ca.densify(ca.jacobian(law.torque, dae.z)) / (ca.sumsqr(ca.jacobian(law.torque, dae.z)) + 1e-300)
    large = ca.if_else(forward, _LARGE, -_LARGE) * (1.0 + ca.fabs(limit))
    slope = ca.dot(way, ca.densify(ca.jacobian(limit, dae.z)))
    return ca.SX(ca.substitute(slope, dae.z, dae.z + large * way.T))
