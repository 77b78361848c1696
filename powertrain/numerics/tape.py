"""The operations by which expressions are computed: one after the other with their values, or replayed in another arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

import casadi as ca

from powertrain.language.symbols import Symbol

T = TypeVar("T")


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


class Arithmetic(Protocol[T]):
    """What stands for numbers when a tape is replayed."""

    def constant(self, value: float) -> T:
        """A number."""
        ...

    def operate(self, code: int, operands: list[T]) -> T:
        """One operation on one or two of them."""
        ...

    def call(self, function: ca.Function, operands: list[T]) -> list[T]:
        """A function of all entries of its arguments, one after the other."""
        ...


def replayed(
    scalar: ca.Function, expressions: Sequence[Symbol], argument: Callable[[int, int], T], arithmetic: Arithmetic[T]
) -> dict[int, T]:
    """The outputs of a function of scalars, made of ``expressions``, in another arithmetic; ``argument(i, j)`` is an entry of an input.

    Outputs that are zero whatever the inputs may be missing.
    """
    functions, work, results = called(scalar, expressions), dict[int, T](), dict[int, T]()
    for k in range(scalar.n_instructions()):
        code, sources, targets = scalar.instruction_id(k), scalar.instruction_input(k), scalar.instruction_output(k)
        if code == ca.OP_CONST:
            work[targets[0]] = arithmetic.constant(scalar.instruction_constant(k))
        elif code == ca.OP_INPUT:
            work[targets[0]] = argument(*sources)
        elif code == ca.OP_OUTPUT:
            results[targets[0]] = work[sources[0]]
        elif code == ca.OP_CALL:
            found = arithmetic.call(functions[k], [work[i] for i in sources])
            work |= {place: found[i] for i, place in enumerate(targets) if place >= 0}
        else:
            work[targets[0]] = arithmetic.operate(code, [work[i] for i in sources])
    return results


def called(scalar: ca.Function, expressions: Sequence[Symbol]) -> dict[int, ca.Function]:
    """The functions behind the calls of a tape, found by following the expressions backwards along it."""
    nodes: dict[int, Symbol] = {}
    found: dict[int, ca.Function] = {}
    if all(scalar.instruction_id(k) != ca.OP_CALL for k in range(scalar.n_instructions())):
        return found
    for k in reversed(range(scalar.n_instructions())):
        operation, inputs, outputs = scalar.instruction_id(k), scalar.instruction_input(k), scalar.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            nodes[inputs[0]] = ca.densify(expressions[outputs[0]]).nz[outputs[1]]
            continue
        results = [nodes.pop(place) for place in outputs if place in nodes]
        if operation in (ca.OP_CONST, ca.OP_INPUT) or not results:
            continue
        node = results[0].dep(0) if operation == ca.OP_CALL else results[0]
        if operation == ca.OP_CALL:
            found[k] = node.which_function()
        nodes |= {place: node.dep(i) for i, place in enumerate(inputs)}
    return found
