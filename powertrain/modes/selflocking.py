"""Laws that are refused in the modes that were found: at rest with a torque that nothing determines, or with limits in the wrong order.

No torque lies between such limits, and the one at a limit would drive. Limits of time and states are so by a slip of the model. Limits
that depend on torques are so while a law slides if it is self-locking, as a wedge or a brake shoe may be: the limit grows faster than the
torque itself. A law that slides forward has the torque T = upper(T). If d(upper)/dT > 1, no torque is large enough. Solving the equation
anyway gives a torque of the other sign with upper < lower.
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca

from powertrain.dae.friction import STUCK, order_margin, undetermined, width_margin
from powertrain.dae.hybrid import Friction, HybridDae
from powertrain.dae.tolerances import CROSSED, LEAST_TORQUE, ZONE
from powertrain.errors import SimulationError
from powertrain.language.units import with_unit
from powertrain.modes.guards import first_violation
from powertrain.numerics.buffers import FORBIDDEN, Evaluated, Memory

_LARGE = 1e6
"""Torque, relative to 1 + |limit|, at which the slope of a limit is judged."""
_ADVICE = "Start it at rest, or add a stiffness to the path of the force that presses it, so that this force changes gradually."


class SelfLocking:
    """Checks the order of limits, and says where laws lock themselves."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self._dae, self._memory = dae, memory
        self._laws = [law for law in dae.frictions if not law.may_free]

    def check(self, side: int) -> None:
        """Raise SimulationError if the last pass of the mode rules found a law with its limits in the wrong order.

        If a value has left its range, such as the load of a wheel in the air, the error names that as the cause.
        """
        if self._memory.flags[FORBIDDEN] <= 0.0:
            return
        t = float(self._memory.time[0])
        violated = first_violation(self._dae, self._memory.instant(side))
        for law, w, _, low, high, _ in zip(self._dae.frictions, *self._memory.frictions(side), strict=True):
            slides = abs(w) > ZONE and self._memory.m[law.index] != STUCK
            if low > high and (slides or law not in self._laws):
                raise SimulationError(violated or self._crossed(law, t, low, high))

    def _crossed(self, law: Friction, t: float, low: float, high: float) -> str:
        if law in self._laws:
            return (
                f"{_said(law)}. At t = {t:.9g} s it slides with limits of {low:.6g} and {high:.6g} {law.unit}, "
                f"in the wrong order: friction would drive. {_ADVICE}"
            )
        return (
            f"{law.name} ({law.where}) has a lower limit of {with_unit(f'{low:.6g}', law.unit)} above its upper limit of "
            f"{with_unit(f'{high:.6g}', law.unit)} at t = {t:.9g} s. A friction torque is positive where it opposes a positive speed, "
            "so that torque times speed is the loss: write friction(w, torque, -limit, limit) with a limit that is not negative."
        )

    def found(self, side: int) -> str:
        """The message for self-locking laws whose equation has no solution; empty if there are none."""
        if not self._laws:
            return ""
        slopes = self._limit_slopes(*self._memory.instant(side))[0].ravel()
        locked = [_said(law) for law, slope in zip(self._laws, slopes, strict=True) if slope >= 1.0]
        return f"{'; '.join(locked)}. {_ADVICE}" if locked else ""

    @cached_property
    def _limit_slopes(self) -> Evaluated:
        return Evaluated(self._dae.function("limits", ca.vertcat(*[_slope(self._dae, law) for law in self._laws])))


def _said(law: Friction) -> str:
    return f"{law.name} ({law.where}) is self-locking: its limit grows faster than its own torque"


def refused(dae: HybridDae) -> ca.SX:
    """Above zero if the limits of a law are in the wrong order, or if it rests where nothing determines its torque."""
    return ca.SX(ca.mmax(ca.vertcat(-1.0, *[_refused(dae, law) for law in dae.frictions])))


def _refused(dae: HybridDae, law: Friction) -> ca.SX:
    at_rest = ca.if_else(dae.m[law.index] == STUCK, width_margin(law), -1.0) if undetermined(dae, law) else ca.SX(-1)
    return ca.fmax(_inverted(dae, law), at_rest)


def _inverted(dae: HybridDae, law: Friction) -> ca.SX:
    if law.may_free:
        return -order_margin(dae, law)
    slides = ca.logic_and(dae.m[law.index] != 0, ca.fabs(law.w) > ZONE)
    largest = ca.mmax(ca.fabs(ca.vertcat(*[friction.torque for friction in dae.frictions])))
    return ca.if_else(slides, law.lower - law.upper - LEAST_TORQUE - CROSSED * largest, -1.0)


def _slope(dae: HybridDae, law: Friction) -> ca.SX:
    """Slope of the limit of a sliding law with respect to its own large torque, if that is an implicit unknown."""
    forward = dae.m[law.index] >= 0
    limit = ca.if_else(forward, law.upper, law.lower)
    way = ca.densify(ca.jacobian(law.torque, dae.z)) / (ca.sumsqr(ca.jacobian(law.torque, dae.z)) + 1e-300)
    large = ca.if_else(forward, _LARGE, -_LARGE) * (1.0 + ca.fabs(limit))
    slope = ca.dot(way, ca.densify(ca.jacobian(limit, dae.z)))
    return ca.SX(ca.substitute(slope, dae.z, dae.z + large * way.T))
