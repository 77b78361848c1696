"""The size of an expression if none of its terms cancelled; its round-off is about 1e-16 of that."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.language.symbols import Symbol, key
from powertrain.numerics.tape import graph_of


def terms(expression: Symbol) -> Symbol:
    """The sum of the sizes of a scalar's terms; results of functions, such as maps, are single terms."""
    sizes: dict[int, Symbol] = {}
    for place, (node, operands) in graph_of(expression).items():
        inner = [sizes[key(operand)] for operand in operands]
        size = _size(node.op(), inner, operands) if inner else None
        sizes[place] = ca.fabs(node) if size is None else size
    return sizes[key(expression)]


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
