"""Moves what depends only on constants out of a function that is called many times with the same constants.

Divisions by such values become multiplications by their reciprocals, which changes results by round-off.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.language.symbols import Symbol, column, key, scalars
from powertrain.numerics.tape import applied, replayed, results_of


def hoisted(
    name: str, inputs: Sequence[ca.SX], constants: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[ca.Function, ca.Function]:
    """A function (inputs, constants, values) -> outputs, and the function for these values: constants -> values."""
    outputs = ca.cse(list(outputs))
    numbers = column([output.nz[:] for output in outputs])
    short, symbols, values = ca.extract_parametric(numbers, ca.vertcat(*constants), {})
    known, hoisted_values = column(symbols), column(values)
    multiplying = _Multiplying([*scalars(column(list(constants))), *symbols])
    flat = multiplying.rewritten(scalars(short), [*inputs, *constants, known])
    inverted = ca.substitute(multiplying.inverted(), known, hoisted_values)
    results, first = list[ca.SX](), 0
    for output in outputs:
        results.append(ca.SX(output.sparsity(), flat[first : first + output.nnz()]))
        first += output.nnz()
    return (
        ca.Function(name, [*inputs, *constants, ca.vertcat(known, multiplying.symbols())], results),
        ca.Function(f"{name}_constants", list(constants), [ca.densify(ca.vertcat(hoisted_values, inverted))]),
    )


class _Multiplying:
    """Operations in which multiplications by reciprocals replace divisions by these symbols."""

    def __init__(self, divisors: Sequence[Symbol]) -> None:
        self._divisors = {key(each): each for each in divisors}
        self._reciprocals: dict[int, Symbol] = {}

    def rewritten(self, expressions: Sequence[Symbol], inputs: Sequence[Symbol]) -> Symbol:
        """A column of the same expressions of these inputs."""
        tape, places = ca.Function("powertrain_scalars", list(inputs), list(expressions)), list(map(scalars, inputs))
        return column(replayed(tape, expressions, lambda i, j: places[i][j], self))

    def symbols(self) -> Symbol:
        """The reciprocals so far."""
        return column(list(self._reciprocals.values()))

    def inverted(self) -> Symbol:
        """Their values."""
        return column([1 / self._divisors[place] for place in self._reciprocals])

    def constant(self, value: float) -> Symbol:
        return Symbol(value)

    def operate(self, code: int, operands: list[Symbol]) -> Symbol:
        if code != ca.OP_DIV or (place := key(operands[1])) not in self._divisors:
            return applied(code, operands)
        return operands[0] * self._reciprocals.setdefault(place, Symbol.sym(f"reciprocal_{len(self._reciprocals)}"))

    def call(self, function: ca.Function, operands: list[Symbol]) -> list[Symbol]:
        return results_of(function, operands)
