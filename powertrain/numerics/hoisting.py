"""Moves what depends only on constants out of a function that is called many times with the same constants."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.language.symbols import Symbol, column, key, scalars
from powertrain.numerics.tape import applied, replayed, results_of


def hoisted(
    name: str, inputs: Sequence[ca.SX], constants: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[ca.Function, ca.Function]:
    """A function (inputs, constants, values) -> outputs, and the function for these values: constants -> values.

    The values include the reciprocals of constants: a division takes as long as several multiplications.
    """
    outputs = ca.cse(list(outputs))
    numbers = column([output.nz[:] for output in outputs])
    short, symbols, values = ca.extract_parametric(numbers, ca.vertcat(*constants), {})
    known = column(symbols)
    given = [*inputs, *constants, known]
    quick = _Multiplying([*scalars(column(list(constants))), *symbols])
    flat = scalars(short)
    tape = ca.Function("powertrain_scalars", given, flat)
    places = [scalars(each) for each in given]
    found = replayed(tape, flat, lambda i, j: places[i][j], quick)
    numbers = column([found.get(k, Symbol(0.0)) for k in range(len(flat))])
    reciprocals, inverted = (
        column(list(quick.reciprocals.values())),
        column([1 / quick.of[k] for k in quick.reciprocals]),
    )
    rest, first = list[ca.SX](), 0
    for output in outputs:
        rest.append(ca.SX(output.sparsity(), numbers[first : first + output.nnz()]))
        first += output.nnz()
    inverted = ca.substitute(inverted, known, column(values))
    return (
        ca.Function(name, [*inputs, *constants, ca.vertcat(known, reciprocals)], rest),
        ca.Function(f"{name}_constants", list(constants), [ca.densify(ca.vertcat(column(values), inverted))]),
    )


class _Multiplying:
    """Operations in which the reciprocals of these symbols replace divisions by them."""

    def __init__(self, constants: Sequence[Symbol]) -> None:
        self.of = {key(each): each for each in constants}
        self.reciprocals: dict[int, Symbol] = {}

    def constant(self, value: float) -> Symbol:
        return Symbol(value)

    def operate(self, code: int, operands: list[Symbol]) -> Symbol:
        if code != ca.OP_DIV or (place := key(operands[1])) not in self.of:
            return applied(code, operands)
        return operands[0] * self.reciprocals.setdefault(place, Symbol.sym(f"reciprocal_{len(self.reciprocals)}"))

    def call(self, function: ca.Function, operands: list[Symbol]) -> list[Symbol]:
        return results_of(function, operands)
