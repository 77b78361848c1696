"""A function with numbers in the places of some entries of its inputs: constants are folded, and nothing else.

CasADi simplifies more than that: (a + b) - b becomes a, which is another number. The results here are those of the whole function to the
last bit, but for the sign of a zero, and where a factor of zero meets a value that is not finite.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeAlias

import casadi as ca

from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import building
from powertrain.numerics.tape import replayed

Value: TypeAlias = float | Symbol


def folded(function: ca.Function, known: Mapping[tuple[int, int], float]) -> ca.Function:
    """The same function of the same inputs, where (input, entry) in ``known`` has that value."""
    inputs: list[Symbol] = function.sx_in()
    outputs: list[Symbol] = [ca.densify(e) for e in function.call(inputs)]
    scalars = [e for output in outputs for e in _entries(output)]
    places = [_entries(each) for each in inputs]

    def argument(i: int, j: int) -> Value:
        return known[i, j] if (i, j) in known else places[i][j]

    with building, _unsimplified():
        found = replayed(ca.Function("powertrain_scalars", inputs, scalars), scalars, argument, _Folding())
        values = iter([Symbol(found.get(k, 0.0)) for k in range(len(scalars))])
        results = [ca.reshape(ca.vertcat(*(next(values) for _ in range(e.numel()))), e.shape) for e in outputs]
        return ca.Function(function.name(), inputs, ca.cse(results))


class _Folding:
    """Operations of numbers and expressions."""

    def constant(self, value: float) -> Value:
        return value

    def operate(self, code: int, operands: list[Value]) -> Value:
        first, last = operands[0], operands[-1]
        if len(operands) == 1:
            return ca.SX.unary(code, first) if isinstance(first, Symbol) else float(ca.SX.unary(code, Symbol(first)))
        if isinstance(first, Symbol):
            return ca.SX.binary(code, first, last) if isinstance(last, Symbol) else _number_last(code, first, last)
        return _number_first(code, first, last) if isinstance(last, Symbol) else float(ca.SX.binary(code, first, last))

    def call(self, function: ca.Function, operands: list[Value]) -> list[Value]:
        columns, first = list[Symbol](), 0
        for i in range(function.n_in()):
            columns.append(ca.vertcat(*operands[first : first + function.nnz_in(i)]))
            first += function.nnz_in(i)
        results: list[Any] = function.call(columns)
        return [e for found in results for e in _entries(ca.densify(found))]


def _number_first(code: int, a: float, b: Symbol) -> Value:
    if code == ca.OP_IF_ELSE_ZERO:
        return b if a else 0.0
    if code in (ca.OP_MUL, ca.OP_DIV) and a == 0.0:
        return 0.0
    if (code == ca.OP_MUL and a == 1.0) or (code == ca.OP_ADD and a == 0.0):
        return b
    if (code == ca.OP_MUL and a == -1.0) or (code == ca.OP_SUB and a == 0.0):
        return ca.SX.unary(ca.OP_NEG, b)
    return ca.SX.binary(code, a, b)


def _number_last(code: int, a: Symbol, b: float) -> Value:
    if code in (ca.OP_MUL, ca.OP_IF_ELSE_ZERO) and b == 0.0:
        return 0.0
    if (code in (ca.OP_MUL, ca.OP_DIV) and b == 1.0) or (code in (ca.OP_ADD, ca.OP_SUB) and b == 0.0):
        return a
    if code in (ca.OP_MUL, ca.OP_DIV) and b == -1.0:
        return ca.SX.unary(ca.OP_NEG, a)
    return ca.SX.binary(code, a, b)


def _entries(column: Symbol) -> list[Symbol]:
    return [column.nz[k] for k in range(column.nnz())]


@contextmanager
def _unsimplified() -> Iterator[None]:
    """Expressions as they are written."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
