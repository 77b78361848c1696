"""The operations that compute expressions: as a graph, or replayed in another arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise
from typing import Protocol, TypeVar

import casadi as ca

from powertrain.language.symbols import Symbol, column, key

T = TypeVar("T")


def applied(code: int, operands: Sequence[Symbol]) -> Symbol:
    """One operation on one or two operands."""
    return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)


def grouped(function: ca.Function, operands: Sequence[T]) -> list[Sequence[T]]:
    """The entries of all arguments of a function, one argument after the other."""
    ends = accumulate((function.nnz_in(i) for i in range(function.n_in())), initial=0)
    return [operands[first:last] for first, last in pairwise(ends)]


def results_of(function: ca.Function, operands: Sequence[Symbol]) -> list[Symbol]:
    """The entries of all results of a function, which is called and not inlined, from those of its arguments."""
    groups = enumerate(grouped(function, operands))
    results: list[Symbol] = function.call([Symbol(function.sparsity_in(i), column(g)) for i, g in groups], False, True)
    return [result.nz[k] for result in results for k in range(result.nnz())]


def again(node: Symbol, operands: Sequence[Symbol]) -> Symbol:
    """The operation of a node, or its result of a call, for other operands."""
    if node.is_output():
        return results_of(node.dep(0).which_function(), operands)[node.which_output()]
    return applied(node.op(), operands)


def operands_of(node: Symbol) -> list[Symbol]:
    """The operands of an operation; for a result of a call, those of the call."""
    source = node.dep(0) if node.is_output() else node
    return [source.dep(k) for k in range(source.n_dep())]


def graph_of(*expressions: Symbol) -> dict[int, tuple[Symbol, list[Symbol]]]:
    """All nodes of scalars by their keys, with their operands, which come first."""
    found: dict[int, tuple[Symbol, list[Symbol]]] = {}
    entered: dict[int, list[Symbol]] = {}
    stack = [(key(expression), expression) for expression in reversed(expressions)]
    while stack:
        place, node = stack[-1]
        if place in entered:
            found.setdefault(place, (node, entered[place]))
            stack.pop()
        else:
            entered[place] = operands_of(node)
            keyed = [(key(operand), operand) for operand in reversed(entered[place])]
            stack += [(place, operand) for place, operand in keyed if place not in entered]
    return found


class Arithmetic(Protocol[T]):
    """A replacement for numbers when a tape is replayed."""

    def constant(self, value: float) -> T:
        """A number."""
        ...

    def operate(self, code: int, operands: list[T]) -> T:
        """One operation with one or two operands."""
        ...

    def call(self, function: ca.Function, operands: list[T]) -> list[T]:
        """A function of all entries of its arguments, one after the other."""
        ...


def replayed(
    scalar: ca.Function, expressions: Sequence[Symbol], argument: Callable[[int, int], T], arithmetic: Arithmetic[T]
) -> list[T]:
    """The outputs of a function of scalars, built from ``expressions``, in another arithmetic.

    ``argument(i, j)`` is an entry of an input.
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
    # outputs that are identically zero may be missing on the tape
    return [results[k] if k in results else arithmetic.constant(0.0) for k in range(scalar.n_out())]


def called(scalar: ca.Function, expressions: Sequence[Symbol]) -> dict[int, ca.Function]:
    """The functions called on a tape, found by following the expressions backwards along it."""
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
