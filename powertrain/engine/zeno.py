"""Resets that follow each other at ever shorter intervals: infinitely many in a finite time, which no run can pass (Zeno).

A reset of states that reverses its own condition throws it like a ball. With the rate g' of the condition before and after it and the
acceleration g'' after it, the condition returns after the time 2|g'+|/g''+ and swings g'+^2/(2 g''+) below zero meanwhile. Near the point
where events accumulate, each swing is a parabola, and each interval is e = |g'+|/g'- times the one before: a geometric series with the
sum 2|g'+|/g''+/(1 - e). A run can follow it as long as the swings exceed the hysteresis of events.
K. H. Johansson, M. Egerstedt, J. Lygeros, S. Sastry, On the regularization of Zeno hybrid automata, Systems & Control Letters 38 (1999).
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae, When
from powertrain.dae.tolerances import EPS
from powertrain.engine.chatter import STOP
from powertrain.engine.trajectory import Instant
from powertrain.errors import SimulationError
from powertrain.language.reals import Array
from powertrain.numerics.buffers import Evaluated, Memory

_RESOLVED = 10 * EPS
"""A condition must swing this far below zero for its next event to be found."""
_PASSED = (
    "the reset of {} puts its condition back to the limit at which it becomes true, and the motion goes on beyond it: a reset happens "
    "once, it does not hold a variable at a limit; use switch(...) for a rate that ends there, unilateral(gap, force) for a stop"
)


class Zeno:
    """Checks the resets of a run for one whose successor would be missed."""

    def __init__(self, dae: HybridDae, memory: Memory) -> None:
        self._memory = memory
        relations = {r.index: r.g for r in dae.relations}
        self._conditions = [(w, g) for w in resetting(dae) for g in [relations[i] for i in w.relations] or [w.g]]
        motions = ca.horzcat(*[_motion(dae, g) for _, g in self._conditions])
        self._motions = Evaluated(dae.function("zeno", motions))

    def check(self, instant: Instant) -> list[str]:
        """Raise SimulationError if a reset at this instant reverses its condition for a swing too small to be detected.

        Notes for resets that put their condition back to its limit while it goes on rising: they happen once, and hold nothing there.
        """
        notes = []
        before = self._values(instant.time, instant.left, instant.held_left)
        after = self._values(instant.time, instant.right, instant.held_right)
        for k, (when, _) in enumerate(self._conditions):
            if (when.name, "reset") not in instant.extra or max(abs(before[0, k]), abs(after[0, k])) > _RESOLVED:
                continue
            way = -1.0 if before[1, k] < 0.0 else 1.0  # the whole condition may require a comparison to fail
            (_, rising, _), (_, rate, acceleration) = way * before[:, k], way * after[:, k]
            if rate < 0 < acceleration and rate**2 / (2 * acceleration) < _RESOLVED:
                interval = -2 * rate / acceleration
                raise SimulationError(_message(when, instant.time, interval, -rate / rising if rising > 0 else np.inf))
            if before[0, k] != after[0, k] and (rate > 0 or (rate == 0 and acceleration > 0)):
                notes.append(_PASSED.format(f"{when.name} ({when.where})"))
        return notes

    def _values(self, t: float, y: Array, held: Array) -> Array:
        return self._motions(*self._memory.values(t, y, held))[0]


def resetting(dae: HybridDae) -> list[When]:
    """The laws that reset states when a condition of states comes true."""
    return [w for w in dae.whens if w.time is None and not all(r.discrete for r in w.resets)]


def _motion(dae: HybridDae, g: ca.SX) -> ca.SX:
    """A condition, its rate and its acceleration."""
    rate = _rate(dae, g)
    return ca.vertcat(g, rate, _rate(dae, rate))


def _rate(dae: HybridDae, expression: ca.SX) -> ca.SX:
    """The time derivative, including the implicit unknowns by 0 = d(residual)/dt."""
    found = ca.jtimes(expression, dae.x, dae.xdot) + ca.jacobian(expression, dae.t)
    if not ca.depends_on(expression, dae.z):
        return found
    drift = ca.jtimes(dae.residual, dae.x, dae.xdot) + ca.jacobian(dae.residual, dae.t)
    return found - ca.jtimes(expression, dae.z, ca.solve(ca.jacobian(dae.residual, dae.z), drift))


def _message(when: When, t: float, interval: float, ratio: float) -> str:
    said = f"at t = {t:.9g} s the resets of {when.name} ({when.where}) come too close to be followed: the next is due in {interval:.2g} s"
    if ratio < 1:
        end = t + interval / (1 - ratio)
        said += f", each interval is {ratio:.3g} times the one before, and at t = {end:.9g} s there have been infinitely many"
    return f"{said}. {STOP}"
