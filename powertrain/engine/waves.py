"""Limits the step size while laws follow sines of time: a model at rest integrates nothing that would limit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import compress
from operator import or_

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Contact, Friction, HybridDae
from powertrain.language.reals import Array
from powertrain.language.symbols import column, depending, free_symbols, key, scalars
from powertrain.modes.indicators import Indicator
from powertrain.numerics.buffers import Evaluated
from powertrain.numerics.tape import applied, replayed

PART = 1 / 8
"""Share of a period that a step may take: a parabola through a sine sampled at quarters of it is accurate to 5e-5 of the amplitude.

If such a parabola comes closer to zero than that, steps are halved (``survey``).
"""
MOST = 12
"""A product counts as at most this many times as fast as the fastest sine in it, which covers powers up to 48: elimination multiplies by a
ratio again and again, and what it computes changes no faster for that.
"""


class Waves:
    """The sines and cosines of time that the indicators of a model contain."""

    def __init__(self, dae: HybridDae, indicators: Sequence[Indicator]) -> None:
        timed = list(compress(indicators, depending([i.value for i in indicators], dae.t)))
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
        held, parameters = self._sizes
        return float(self._longest(t, stop, m[:held], p[:parameters])[0][0, 0])

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


@dataclass(frozen=True)
class _Wave:
    """An expression, None if it depends on a state or a call, and the marks of the rates in it: a bit for each."""

    value: ca.SX | None
    marks: int


class _Speeds:
    """The rates (rad/s) of angles that are functions of time alone and appear in a sine or cosine.

    One pass finds those of all expressions, which share most of their operations. A product of two sines has the sum of their rates, up to
    ``MOST`` times that of one.
    At its extremum the power n of a sine, 1 - n u^2/2 + (3n - 2) n u^4/24, bends like a sine that is sqrt(3n - 2) times as fast.
    """

    def __init__(self, dae: HybridDae, expressions: Sequence[ca.SX]) -> None:
        self._time, self._speeds, self._sines = dae.t, list[ca.SX](), 0
        states, symbols = set(map(key, scalars(ca.vertcat(dae.x, dae.z)))), free_symbols(column(list(expressions)))

        def argument(_: int, j: int) -> _Wave:
            return _Wave(None if key(symbols[j]) in states else symbols[j], 0)

        tape = ca.Function("powertrain_waves", [column(symbols)], list(expressions))
        self._found = replayed(tape, expressions, argument, self)

    def of(self, i: int) -> list[ca.SX]:
        """The rates in the i-th expression, each once."""
        return list({key(speed): speed for speed in self._among(self._found[i].marks)}.values())

    def constant(self, value: float) -> _Wave:
        return _Wave(ca.SX(value), 0)

    def call(self, function: ca.Function, operands: list[_Wave]) -> list[_Wave]:
        marks = reduce(or_, (each.marks for each in operands), 0)
        return [_Wave(None, marks)] * sum(function.nnz_out(i) for i in range(function.n_out()))

    def operate(self, code: int, operands: list[_Wave]) -> _Wave:
        """A separate mark for each sine of time, and for each product and power of them."""
        values, inner = [each.value for each in operands if each.value is not None], [each.marks for each in operands]
        marks = reduce(or_, inner)
        if len(values) < len(operands):
            return _Wave(None, marks)
        speed = self._speed(code, values, inner)
        if not speed.is_zero():
            mark = 1 << len(self._speeds)
            self._speeds.append(speed)
            self._sines |= mark if code in (ca.OP_SIN, ca.OP_COS) else 0
            marks |= mark
        return _Wave(applied(code, values), marks)

    def _speed(self, code: int, operands: Sequence[ca.SX], inner: Sequence[int]) -> ca.SX:
        """The rate that an operation brings about, zero where its operands have none, or the same."""
        if code in (ca.OP_SIN, ca.OP_COS):
            return ca.SX(ca.jacobian(operands[0], self._time))
        if code == ca.OP_SQ:
            return self._of_product(inner[0], inner[0])
        if code in (ca.OP_MUL, ca.OP_DIV) and all(inner):
            return self._of_product(*inner)
        if code in (ca.OP_POW, ca.OP_CONSTPOW) and operands[1].is_constant() and (n := float(operands[1])) > 1:
            return float(np.sqrt(3 * n - 2)) * self._fastest(inner[0])
        return ca.SX(0)

    def _of_product(self, first: int, second: int) -> ca.SX:
        """The rate of the product of two expressions with these marks."""
        most = MOST * self._fastest((first | second) & self._sines)
        return ca.fmin(self._fastest(first) + self._fastest(second), most)

    def _fastest(self, marks: int) -> ca.SX:
        """The largest of the rates with these marks."""
        rates = list(map(ca.fabs, self._among(marks)))
        return ca.SX(ca.mmax(ca.vertcat(*rates))) if rates else ca.SX(0)

    def _among(self, marks: int) -> list[ca.SX]:
        """The rates with these marks."""
        return [speed for k, speed in enumerate(self._speeds) if marks >> k & 1]
