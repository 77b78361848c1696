"""Sliding laws that draw themselves in, as a wedge or a brake shoe does: their limit grows with their own torque, and faster.

A law that slides forward has the torque T = upper(T). Where d(upper)/dT > 1, no torque is large enough: an equation solved all the same
gives a torque of the other sign, upper < lower, with which friction would drive.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.errors import SimulationError
from powertrain.modes.guards import first_violation
from powertrain.modes.jam import law_values
from powertrain.modes.tolerances import LEAST_TORQUE, ZONE
from powertrain.numerics.buffers import PREFIX, Array, Bound, Memory, zeros


class SelfLocking:
    """Looks at the laws whose limits depend on torques."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self._dae, self._memory = dae, memory
        self._laws, self._slopes = _laws(dae), zeros(len(_laws(dae)))
        self._bound_slopes: list[Bound] = []

    def check(self, side: int) -> None:
        """SimulationError for a law that slides although its limits stand the wrong way round, as the last mode rules found.

        Where a value has left its range, as the load of a wheel in the air, that is the cause.
        """
        if self._memory.flags[5] <= 0.0:
            return
        for law, row in zip(self._dae.frictions, law_values(self._dae, self._memory, side).tolist(), strict=True):
            w, _, low, high, _, _ = row
            if abs(w) > ZONE and self._memory.m[law.index] != 0.0 and low > high:
                t = float(self._memory.time[0])
                raise SimulationError(
                    first_violation(self._dae, self._memory, side, t)
                    or f"{_said(law)}. At t = {t:.9g} s it slides with limits of {low:.6g} and {high:.6g} {law.unit}, "
                    f"in the wrong order: friction would drive. {_ADVICE}"
                )

    def found(self, side: int) -> str:
        """What to say of laws whose own equation has no solution; '' where there are none."""
        if not self._laws:
            return ""
        if not self._bound_slopes:
            self._bound_slopes = self._bound([_slope(self._dae, f) for f in self._laws], self._slopes)
        self._bound_slopes[side].call()
        locked = [_said(law) for law, slope in zip(self._laws, self._slopes, strict=True) if slope >= 1.0]
        return f"{'; '.join(locked)}. {_ADVICE}" if locked else ""

    def _bound(self, rows: Sequence[ca.SX], results: Array) -> list[Bound]:
        """A function of these rows for either side."""
        dae, memory, n = self._dae, self._memory, self._dae.x.numel()
        time, y = ca.SX.sym("time", 2), ca.SX.sym("y", n + dae.z.numel())
        inner = ca.Function(PREFIX + "limits", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(ca.vertcat(*rows))])
        found = inner.call([time[0], y[:n], y[n:], dae.m, dae.p])
        function = ca.Function(PREFIX + "self_locking", [time, y, dae.m, dae.p], found)
        return [Bound(function, [memory.time, side, memory.m, memory.p], [results]) for side in memory.y]


_LARGE = 1e6
_CLEARLY = 1e-6
"""Limits that cross by less than this share of the largest torque do so by round-off, or by the hysteresis of a switch of theirs."""
_ADVICE = "Start it at rest, or add a stiffness to the path of the force that presses it, so that this force changes gradually."


def _said(law: Friction) -> str:
    return f"{law.name} ({law.where}) is self-locking: its limit grows faster than its own torque"


def inverted(dae: HybridDae) -> ca.SX:
    """Above zero where a law slides with its limits the wrong way round."""
    return ca.SX(ca.mmax(ca.vertcat(-1.0, *[_inverted(dae, law) for law in _laws(dae)])))


def _laws(dae: HybridDae) -> list[Friction]:
    """The laws whose limits depend on torques."""
    torques = ca.vertcat(dae.z, dae.m)
    return [f for f in dae.frictions if ca.depends_on(ca.vertcat(f.lower, f.upper), torques)]


def _inverted(dae: HybridDae, law: Friction) -> ca.SX:
    slides = ca.logic_and(dae.m[law.index] != 0, ca.fabs(law.w) > ZONE)
    largest = ca.mmax(ca.fabs(ca.vertcat(*[friction.torque for friction in dae.frictions])))
    return ca.if_else(slides, law.lower - law.upper - LEAST_TORQUE - _CLEARLY * largest, -1.0)


def _slope(dae: HybridDae, law: Friction) -> ca.SX:
    """By how much the limit of a sliding law grows with its own torque where that is large, as far as it is an implicit unknown."""
    forward = dae.m[law.index] >= 0
    limit = ca.if_else(forward, law.upper, law.lower)
    way = ca.densify(ca.jacobian(law.torque, dae.z)) / (ca.sumsqr(ca.jacobian(law.torque, dae.z)) + 1e-300)
    large = ca.if_else(forward, _LARGE, -_LARGE) * (1.0 + ca.fabs(limit))
    slope = ca.dot(way, ca.densify(ca.jacobian(limit, dae.z)))
    return ca.SX(ca.substitute(slope, dae.z, dae.z + large * way.T))
