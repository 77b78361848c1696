"""A function with constants for some entries of its inputs: constants are folded, and nothing else is changed.

CasADi simplifies more: (a + b) - b becomes a, which is another number. Where it would, an operand is hidden as its own magnitude with its
own sign. The results equal those of the general function to the last bit, except for the sign of a zero, and where a factor of zero
meets a value that is not finite.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import casadi as ca

from powertrain.language.symbols import Symbol, scalars
from powertrain.numerics.tape import applied, replayed, results_of

Value: TypeAlias = float | Symbol


def folded(function: ca.Function, known: Mapping[tuple[int, int], float]) -> ca.Function:
    """The same function of the same inputs, with the values in ``known`` for entries (input, entry)."""
    inputs: list[Symbol] = function.sx_in()
    outputs: list[Symbol] = [ca.densify(e) for e in function.call(inputs)]
    flat = [e for output in outputs for e in scalars(output)]
    places = [scalars(each) for each in inputs]

    def argument(i: int, j: int) -> Value:
        return known[i, j] if (i, j) in known else places[i][j]

    found = replayed(ca.Function("powertrain_scalars", inputs, flat), flat, argument, _Folding())
    values = map(Symbol, found)
    results = [ca.reshape(ca.vertcat(*(next(values) for _ in range(e.numel()))), e.shape) for e in outputs]
    return ca.Function(function.name(), inputs, results)


class _Folding:
    """Operations of numbers and expressions, each built once."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, ...], tuple[tuple[Symbol, ...], Symbol]] = {}  # operands, to keep them alive

    def constant(self, value: float) -> Value:
        return value

    def operate(self, code: int, operands: list[Value]) -> Value:
        first, last = operands[0], operands[-1]
        if len(operands) == 1:
            return self._written(code, first) if isinstance(first, Symbol) else float(ca.SX.unary(code, Symbol(first)))
        if isinstance(first, Symbol):
            return (
                self._written(code, first, last) if isinstance(last, Symbol) else self._number_last(code, first, last)
            )
        return (
            self._number_first(code, first, last)
            if isinstance(last, Symbol)
            else float(ca.SX.binary(code, first, last))
        )

    def _number_first(self, code: int, a: float, b: Symbol) -> Value:
        if code == ca.OP_IF_ELSE_ZERO:
            return b if a else 0.0
        if code in (ca.OP_MUL, ca.OP_DIV) and a == 0.0:
            return 0.0
        if (code == ca.OP_MUL and a == 1.0) or (code == ca.OP_ADD and a == 0.0):
            return b
        if (code == ca.OP_MUL and a == -1.0) or (code == ca.OP_SUB and a == 0.0):
            return self._written(ca.OP_NEG, b)
        return self._written(code, Symbol(a), b)

    def _number_last(self, code: int, a: Symbol, b: float) -> Value:
        if code in (ca.OP_MUL, ca.OP_IF_ELSE_ZERO) and b == 0.0:
            return 0.0
        if (code in (ca.OP_MUL, ca.OP_DIV) and b == 1.0) or (code in (ca.OP_ADD, ca.OP_SUB) and b == 0.0):
            return a
        if code in (ca.OP_MUL, ca.OP_DIV) and b == -1.0:
            return self._written(ca.OP_NEG, a)
        return self._written(code, a, Symbol(b))

    def _written(self, code: int, *operands: Symbol) -> Symbol:
        """The operation without simplification; only signs are combined."""
        a, b = operands[0], operands[-1]
        if code == ca.OP_ADD and b.is_op(ca.OP_NEG):
            return self._written(ca.OP_SUB, a, b.dep(0))
        if code == ca.OP_ADD and a.is_op(ca.OP_NEG):
            return self._written(ca.OP_SUB, b, a.dep(0))
        if code == ca.OP_SUB and b.is_op(ca.OP_NEG):
            return self._written(ca.OP_ADD, a, b.dep(0))
        place = (code, *(e.element_hash() for e in operands))
        if place not in self._known:
            self._known[place] = operands, self._made(code, operands)
        return self._known[place][1]

    def _made(self, code: int, operands: tuple[Symbol, ...]) -> Symbol:
        result = applied(code, operands)
        if code == ca.OP_NEG or (
            result.is_op(code) and _hashes(result.dep(i) for i in range(result.n_dep())) == _hashes(operands)
        ):
            return result
        return applied(code, [e if e.is_constant() else self._written(ca.OP_COPYSIGN, e, e) for e in operands])

    def call(self, function: ca.Function, operands: list[Value]) -> list[Value]:
        return list(results_of(function, [Symbol(each) for each in operands]))


def _hashes(operands: Iterable[Symbol]) -> list[int]:
    return sorted(e.element_hash() for e in operands)
