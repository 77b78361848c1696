"""The size of an expression if none of its terms cancelled; its round-off is about 1e-16 of that."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.language.symbols import Symbol, column, free_symbols
from powertrain.numerics.tape import CallsFunction, operations


def terms(expression: Symbol) -> Symbol:
    """The sum of the sizes of a scalar's terms; the scalar's own size if it calls a function."""
    symbols = free_symbols(expression)
    sizes: dict[int, Symbol] = {}
    result = Symbol(0)
    try:
        for line in operations(expression, [column(symbols)], [symbols]):
            if line.code == ca.OP_OUTPUT:
                result = sizes[line.sources[0]]
                continue
            inner = [sizes[i] for i in line.sources] if line.operands else []
            size = _size(line.code, inner, line.operands)
            sizes[line.target] = ca.fabs(line.value) if size is None else size
    except CallsFunction:
        return ca.fabs(expression)
    return result


def _size(operation: int, sizes: Sequence[Symbol], values: Sequence[Symbol]) -> Symbol | None:
    """The size of an operation's result; None if it is the magnitude of the result."""
    if operation in (ca.OP_ADD, ca.OP_SUB):
        return sizes[0] + sizes[1]
    if operation == ca.OP_MUL:
        return sizes[0] * sizes[1]
    if operation == ca.OP_DIV:
        return sizes[0] / ca.fabs(values[1])
    if operation == ca.OP_SQ:
        return sizes[0] ** 2
    if operation == ca.OP_TWICE:
        return 2 * sizes[0]
    if operation in (ca.OP_NEG, ca.OP_FABS):
        return sizes[0]
    if operation == ca.OP_IF_ELSE_ZERO:
        return ca.if_else(values[0], sizes[1], 0)
    return None
