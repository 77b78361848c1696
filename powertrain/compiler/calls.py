"""Replaces CasADi operations that fail for expressions with function calls, such as maps.

``ca.substitute_inplace`` gives wrong results for an expression with a call. Forward derivatives call functions even for symbols that are
not among their arguments, so an equation that is linear in such a symbol no longer looks linear.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from powertrain.language.symbols import Symbol, column, free_symbols


def calling(expressions: Sequence[Symbol]) -> list[int]:
    """Which of the expressions contain a call."""
    found = marks(expressions, lambda tape, k, _: int(tape.instruction_id(k) == ca.OP_CALL))
    return [i for i, mark in enumerate(found) if mark]


def marks(expressions: Sequence[Symbol], mark: Callable[[ca.Function, int, list[int]], int]) -> list[int]:
    """For each expression the marks (bits) of all instructions that compute it.

    ``mark`` gives the marks of the k-th instruction from those of its operands.
    """
    everything = column(list(expressions))
    rows = everything.sparsity().row()
    tape = ca.Function("powertrain_marks", [column(free_symbols(everything))], [everything])
    touched: dict[int, int] = {}
    found = [0] * len(expressions)
    for k in range(tape.n_instructions()):
        operation, inputs, outputs = tape.instruction_id(k), tape.instruction_input(k), tape.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            found[rows[outputs[1]]] |= touched[inputs[0]]
            continue
        inner = [] if operation in (ca.OP_CONST, ca.OP_INPUT, ca.OP_PARAMETER) else [touched[i] for i in inputs]
        bits = mark(tape, k, inner)
        for b in inner:
            bits |= b
        touched.update(dict.fromkeys(outputs, bits))
    return found


def jacobian(rows: Sequence[Symbol], unknowns: Symbol) -> Symbol:
    """The Jacobian of scalar rows, free of calls in the columns of symbols on which no call depends."""
    full = ca.jacobian(column(list(rows)), unknowns)
    pieces, done = [], 0
    for i in calling(rows):
        pieces += [full[done:i, :], ca.sparsify(ca.gradient(rows[i], unknowns)).T]
        done = i + 1
    return ca.vertcat(*pieces, full[done:, :])


def substituted_in_place(names: Sequence[Symbol], expressions: Sequence[Symbol]) -> list[Symbol]:
    """``expressions``, in each of which the names before it are replaced by their own expressions."""
    callers = calling(expressions)
    others = np.setdiff1d(np.arange(len(expressions)), callers).tolist()
    plain = column([names[i] for i in others])
    resolved = list(expressions)
    if others:
        within = ca.substitute_inplace([names[i] for i in others], [expressions[i] for i in others], [], False)[0]
        for i, expression in zip(others, within, strict=True):
            resolved[i] = Symbol(expression)
    for k, i in enumerate(callers):
        (resolved[i],) = ca.substitute([resolved[i]], [plain], [column([resolved[j] for j in others])])
        resolved[i] = _replaced([resolved[i]], names, resolved, callers[:k])[0]
    for i, expression in zip(others, _replaced([resolved[i] for i in others], names, resolved, callers), strict=True):
        resolved[i] = expression
    return resolved


def _replaced(
    expressions: list[Symbol], names: Sequence[Symbol], resolved: Sequence[Symbol], which: Sequence[int]
) -> list[Symbol]:
    if not which or not expressions:
        return expressions
    old, new = column([names[i] for i in which]), column([resolved[i] for i in which])
    return list(ca.substitute(expressions, [old], [new]))
