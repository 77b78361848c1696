"""Moves what depends only on constants out of a function that is called many times with the same constants."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.language.symbols import column


def hoisted(
    name: str, inputs: Sequence[ca.SX], constants: Sequence[ca.SX], outputs: Sequence[ca.SX]
) -> tuple[ca.Function, ca.Function]:
    """A function (inputs, constants, values) -> outputs, and the function for these values: constants -> values."""
    outputs = ca.cse(list(outputs))
    numbers = column([output.nz[:] for output in outputs])
    short, symbols, values = ca.extract_parametric(numbers, ca.vertcat(*constants), {})
    known = column(symbols)
    rest, first = list[ca.SX](), 0
    for output in outputs:
        rest.append(ca.SX(output.sparsity(), short[first : first + output.nnz()]))
        first += output.nnz()
    return (
        ca.Function(name, [*inputs, *constants, known], rest),
        ca.Function(f"{name}_constants", list(constants), [ca.densify(column(values))]),
    )
