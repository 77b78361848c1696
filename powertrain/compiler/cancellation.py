"""How large an expression would be if none of its terms cancelled another: its round-off is some 1e-16 of that."""

from __future__ import annotations

import casadi as ca

from powertrain.symbols import Symbol, column, free_symbols


def terms(expression: Symbol) -> Symbol:
    """The sum of the sizes of a scalar's terms; its own size where it calls a function."""
    symbols = free_symbols(expression)
    tape = ca.Function("powertrain_terms", [column(symbols)], [ca.densify(expression)])
    values: dict[int, Symbol] = {}
    sizes: dict[int, Symbol] = {}
    result = Symbol(0)
    for k in range(tape.n_instructions()):
        operation, inputs, outputs = tape.instruction_id(k), tape.instruction_input(k), tape.instruction_output(k)
        if operation == ca.OP_CALL:
            return ca.fabs(expression)
        if operation == ca.OP_OUTPUT:
            result = sizes[inputs[0]]
            continue
        if operation == ca.OP_CONST:
            value = Symbol(tape.instruction_constant(k))
        elif operation == ca.OP_INPUT:
            value = symbols[inputs[1]]
        elif len(inputs) == 1:
            value = ca.SX.unary(operation, values[inputs[0]])
        else:
            value = ca.SX.binary(operation, values[inputs[0]], values[inputs[1]])
        size = _size(operation, [sizes.get(i, Symbol(0)) for i in inputs], [values.get(i, Symbol(0)) for i in inputs])
        values[outputs[0]], sizes[outputs[0]] = value, ca.fabs(value) if size is None else size
    return result


def _size(operation: int, sizes: list[Symbol], values: list[Symbol]) -> Symbol | None:
    """The size of an operation's result, None where that is the result's own."""
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
