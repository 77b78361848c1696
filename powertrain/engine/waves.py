"""Limits the step size while laws follow sines of time: a model at rest integrates nothing that would limit it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from powertrain.compiler.calls import marks
from powertrain.dae.hybrid import Contact, Friction, HybridDae
from powertrain.language.symbols import column, free_symbols, key
from powertrain.modes.indicators import Indicator
from powertrain.numerics.buffers import Array, Evaluated

PART = 1 / 8
"""Share of a period that a step may take: a parabola through a sine sampled at quarters of it is accurate to 5e-5 of the amplitude.

If such a parabola comes closer to zero than that, steps are halved (``survey``).
"""


class Waves:
    """The sines and cosines of time that the indicators of a model contain."""

    def __init__(self, dae: HybridDae, indicators: Sequence[Indicator]) -> None:
        timed = [i for i in indicators if ca.depends_on(i.value, dae.t)]
        speeds = _Speeds(dae, [i.value for i in timed])
        found = [(i.law, of) for k, i in enumerate(timed) if (of := speeds.of(k))]
        self._laws = [(law, len(of)) for law, of in found]
        values = ca.vertcat(ca.SX(0, 1), *[speed for _, of in found for speed in of])
        self._speeds = ca.Function("powertrain_waves", [dae.t, dae.m, dae.p], [ca.fabs(values)])
        self._sizes = dae.m.numel(), dae.p.numel()
        self._symbols = dae.t, dae.m, dae.p

    def __bool__(self) -> bool:
        return bool(self._laws)

    @cached_property
    def function(self) -> ca.Function:
        """The longest step (s) as a function of (t, stop, m, p) in the modes m; infinite if no law follows a sine."""
        t, m, p = self._symbols
        stop, fastest, k = ca.SX.sym("stop"), ca.SX(0.0), 0
        now, then = (self._speeds(at, m, p) for at in (t, stop))
        for law, count in self._laws:
            for _ in range(count):
                fastest = ca.fmax(fastest, ca.if_else(_follows(law, t, m), ca.fmax(now[k], then[k]), 0.0))
                k += 1
        longest = ca.if_else(fastest > 0, 2 * np.pi * PART / fastest, np.inf)
        return ca.Function("powertrain_longest", [t, stop, m, p], [longest])

    def longest_step(self, t: float, stop: float, m: Array, p: Array) -> float:
        """The value of ``function``."""
        if not self:
            return np.inf
        count, np_ = self._sizes
        return float(self._longest(t, stop, m[:count], p[:np_])[0][0, 0])

    @cached_property
    def _longest(self) -> Evaluated:
        return Evaluated(self.function)


def _follows(law: object, t: ca.SX, m: ca.SX) -> ca.SX:
    """Whether a law's condition follows time alone in its mode. A law that moves is integrated, which limits the step anyway.

    A gap that depends on time always counts: a signal may move towards a stop without moving anything else before it arrives.
    """
    if isinstance(law, Friction):
        mode = m[law.index]  # stuck or free
        return ca.SX(1) if law.algebraic or law.prescribed else ca.logic_or(mode == 0, mode == 2)
    if isinstance(law, Contact):
        return ca.SX(1) if ca.depends_on(law.gap, t) else m[law.index] > 0.5
    return ca.SX(1)


class _Speeds:
    """The rates (rad/s) of angles that are functions of time alone and appear in a sine or cosine.

    One pass finds those of all expressions, which share most of their operations. A product of two sines has the sum of their rates.
    At its extremum the power n of a sine, 1 - n u^2/2 + (3n - 2) n u^4/24, bends like a sine that is sqrt(3n - 2) times as fast.
    """

    def __init__(self, dae: HybridDae, expressions: Sequence[ca.SX]) -> None:
        self._time, self._states = dae.t, set(map(key, ca.vertsplit(ca.vertcat(dae.x, dae.z))))
        self._symbols = free_symbols(column(list(expressions)))
        self._values: dict[int, ca.SX] = {}  # of instructions that do not depend on states
        self._speeds: list[ca.SX] = []
        self._found = marks(expressions, self._mark)

    def of(self, i: int) -> list[ca.SX]:
        """The rates in the i-th expression, each once."""
        mine = [speed for k, speed in enumerate(self._speeds) if self._found[i] >> k & 1]
        return list({key(speed): speed for speed in mine}.values())

    def _mark(self, tape: ca.Function, k: int, inner: list[int]) -> int:
        """A separate bit for each sine of time, and for each product and power of them."""
        code, operands = tape.instruction_id(k), self._operands(tape, k)
        value = None if operands is None else _value(tape, k, operands)
        for target in tape.instruction_output(k):
            self._values.pop(target, None)
            if value is not None:
                self._values[target] = value
        speed = ca.SX(0) if operands is None else self._speed(code, operands, inner)
        if speed.is_zero():
            return 0
        self._speeds.append(speed)
        return 1 << (len(self._speeds) - 1)

    def _speed(self, code: int, operands: Sequence[ca.SX], inner: Sequence[int]) -> ca.SX:
        """The rate that an operation brings about, zero where its operands have none, or the same."""
        if code in (ca.OP_SIN, ca.OP_COS):
            return ca.SX(ca.jacobian(operands[0], self._time))
        if code == ca.OP_SQ:
            return 2 * self._fastest(inner[0])
        if code in (ca.OP_MUL, ca.OP_DIV) and all(inner):
            return self._fastest(inner[0]) + self._fastest(inner[1])
        if code in (ca.OP_POW, ca.OP_CONSTPOW) and operands[1].is_constant() and (n := float(operands[1])) > 1:
            return float(np.sqrt(3 * n - 2)) * self._fastest(inner[0])
        return ca.SX(0)

    def _fastest(self, bits: int) -> ca.SX:
        """The largest of the rates with these marks."""
        rates = [ca.fabs(speed) for k, speed in enumerate(self._speeds) if bits >> k & 1]
        return ca.SX(ca.mmax(ca.vertcat(*rates))) if rates else ca.SX(0)

    def _operands(self, tape: ca.Function, k: int) -> list[ca.SX] | None:
        """The operands of an operation (of a symbol: itself), or None if it depends on a state or a call."""
        code, sources = tape.instruction_id(k), tape.instruction_input(k)
        if code == ca.OP_INPUT:
            symbol = self._symbols[sources[1]]
            return None if key(symbol) in self._states else [symbol]
        if code == ca.OP_CALL or not all(i in self._values for i in sources):
            return None
        return [self._values[i] for i in sources]


def _value(tape: ca.Function, k: int, operands: Sequence[ca.SX]) -> ca.SX:
    """The result of one operation."""
    code = tape.instruction_id(k)
    if code == ca.OP_CONST:
        return ca.SX(tape.instruction_constant(k))
    if code == ca.OP_INPUT:
        return operands[0]
    return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)
