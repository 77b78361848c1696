"""How long a step may be while laws follow sines of time: what is at rest integrates nothing that would limit it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Contact, Friction, HybridDae
from powertrain.modes.indicators import Indicator
from powertrain.numerics.buffers import Array
from powertrain.numerics.tape import CallsFunction, operations

PART = 1 / 8
"""Part of a period that a step may take: a parabola through a sine's samples at quarters of it is right to 1e-5 of its amplitude."""


class Waves:
    """The sines and cosines of time that the indicators of a model contain."""

    def __init__(self, dae: HybridDae, indicators: Sequence[Indicator]) -> None:
        found = [(i.law, _speeds(dae, i.value)) for i in indicators if ca.depends_on(i.value, dae.t)]
        self._laws = [(law, len(speeds)) for law, speeds in found if speeds]
        values = ca.vertcat(ca.SX(0, 1), *[speed for _, speeds in found for speed in speeds])
        self._speeds = ca.Function("powertrain_waves", [dae.t, dae.m, dae.p], [ca.fabs(values)])
        self._sizes = dae.m.numel(), dae.p.numel()
        self._symbols = dae.t, dae.m, dae.p

    def function(self) -> ca.Function:
        """``longest_step`` as a function of (t, stop, m, p)."""
        t, m, p = self._symbols
        stop, fastest, k = ca.SX.sym("stop"), ca.SX(0.0), 0
        now, then = (self._speeds(at, m, p) for at in (t, stop))
        for law, count in self._laws:
            for _ in range(count):
                fastest = ca.fmax(fastest, ca.if_else(_following(law, m), ca.fmax(now[k], then[k]), 0.0))
                k += 1
        longest = ca.if_else(fastest > 0, 2 * np.pi * PART / fastest, np.inf)
        return ca.Function("powertrain_longest", [t, stop, m, p], [longest])

    def longest_step(self, t: float, stop: float, m: Array, p: Array) -> float:
        """In seconds, for the modes in ``m``; infinite where none of them follows a sine."""
        if not self._laws:
            return np.inf
        acting = np.repeat([_follows(law, m) for law, _ in self._laws], [count for _, count in self._laws])
        if not acting.any():
            return np.inf
        nm, count = self._sizes
        speeds = [np.array(self._speeds(at, m[:nm], p[:count]), float).ravel() for at in (t, stop)]
        fastest = float(np.nan_to_num(np.maximum(*speeds))[acting.astype(bool)].max())
        return 2 * np.pi / fastest * PART if fastest > 0.0 else np.inf


def _follows(law: object, m: Array) -> bool:
    """Whether a law's condition is one of time alone: where it moves, what it moves is integrated."""
    if isinstance(law, Friction):
        return law.algebraic or law.prescribed or m[law.index] in (0.0, 2.0)  # stuck or free
    return not isinstance(law, Contact) or m[law.index] > 0.5


def _following(law: object, m: ca.SX) -> ca.SX:
    """``_follows`` as an expression of the modes."""
    if isinstance(law, Friction):
        mode = m[law.index]
        return ca.SX(1) if law.algebraic or law.prescribed else ca.logic_or(mode == 0, mode == 2)
    return m[law.index] > 0.5 if isinstance(law, Contact) else ca.SX(1)


def _speeds(dae: HybridDae, expression: ca.SX) -> list[ca.SX]:
    """The rates (rad/s) of the angles whose sine or cosine is taken, where these are functions of time alone."""
    inputs = [dae.t, dae.x, dae.z, dae.m, dae.p]
    found: dict[int, ca.SX] = {}
    with suppress(CallsFunction):
        for line in operations(expression, inputs, [ca.vertsplit(symbols) for symbols in inputs]):
            if line.code in (ca.OP_SIN, ca.OP_COS):
                (angle,) = line.operands
                speed = ca.jacobian(angle, dae.t)
                if not speed.is_zero() and not ca.depends_on(angle, ca.vertcat(dae.x, dae.z)):
                    found[speed.element_hash()] = speed
    return list(found.values())
