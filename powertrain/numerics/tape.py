"""The operations by which an expression is computed, one after the other, with their symbolic values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca

from powertrain.language.symbols import Symbol


@dataclass(frozen=True)
class Operation:
    """One line: CasADi's ``code``, where the operands come from and the result goes, and their values.

    ``ca.OP_OUTPUT`` has the whole expression as its value, ``ca.OP_INPUT`` and ``ca.OP_CONST`` have no operands.
    """

    code: int
    sources: tuple[int, ...]
    target: int
    operands: tuple[Symbol, ...]
    value: Symbol


COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE)


class CallsFunction(Exception):
    """The expression calls a function, which has no symbolic value here."""


def operations(expression: Symbol, inputs: Sequence[Symbol], leaves: Sequence[Sequence[Symbol]]) -> Iterator[Operation]:
    """All operations of a scalar expression of the columns ``inputs``, with ``leaves`` as the values of their entries.

    Raises CallsFunction at the first call.
    """
    tape = ca.Function("powertrain_tape", list(inputs), [ca.densify(expression)])
    values: dict[int, Symbol] = {}
    for k in range(tape.n_instructions()):
        code, sources, targets = tape.instruction_id(k), tape.instruction_input(k), tape.instruction_output(k)
        operands: tuple[Symbol, ...] = ()
        if code == ca.OP_CALL:
            raise CallsFunction
        if code == ca.OP_CONST:
            value = Symbol(tape.instruction_constant(k))
        elif code == ca.OP_INPUT:
            value = leaves[sources[0]][sources[1]]
        elif code == ca.OP_OUTPUT:
            value = values[sources[0]]
        else:
            operands = tuple(values[i] for i in sources)
            value = ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)
        values[targets[0]] = value
        yield Operation(code, tuple(sources), targets[0], operands, value)
