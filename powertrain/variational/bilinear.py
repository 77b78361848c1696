"""Linear maps with several axes as functions whose mixed second derivatives CasADi knows; it takes those of its interpolants for zero."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np

from powertrain.language.symbols import Symbol, column
from powertrain.numerics.lookup import Lookup, table_of
from powertrain.numerics.tape import replayed
from powertrain.variational.instants import NotDifferentiable


def twice_differentiable(expressions: Symbol, symbols: Symbol) -> Symbol:
    """The same expressions of ``symbols`` with such maps looked up in the interval of each axis."""
    scalars = ca.vertsplit(ca.densify(expressions)) if expressions.numel() else []
    tape = ca.Function("powertrain_lookups", [symbols], scalars)
    if all(tape.instruction_id(k) != ca.OP_CALL for k in range(tape.n_instructions())):
        return expressions
    entries = ca.vertsplit(symbols)
    found = replayed(tape, scalars, lambda _, j: entries[j], _Intervals())
    return column([found.get(i, Symbol(0)) for i in range(len(scalars))])


class _Intervals:
    """CasADi's own arithmetic, but for calls of linear tables with several axes."""

    def constant(self, value: float) -> Symbol:
        """A number."""
        return Symbol(value)

    def operate(self, code: int, operands: list[Symbol]) -> Symbol:
        """The operation itself."""
        return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)

    def call(self, function: ca.Function, operands: list[Symbol]) -> list[Symbol]:
        """A function as it is, or a table by its intervals."""
        table, slopes = table_of(function)
        if table is None and function.class_name() == "LinearInterpolant":
            raise NotDifferentiable(
                "the equations look up a linear map that no component keeps, so that its grid is not known and there are no second "
                "derivatives; make the map a field of the component"
            )
        if table is not None and not slopes and len(table.points) > 1:
            x = ca.MX.sym("x", len(table.points))
            value = Lookup(table, ca.vertsplit(x)).value()
            function = ca.Function(f"intervals_{function.name()}", [x], [value], {"never_inline": True})
        places = np.cumsum([0, *(function.nnz_in(k) for k in range(function.n_in()))])
        inner = [ca.SX(function.sparsity_in(k), column(operands[a:b])) for k, (a, b) in enumerate(pairwise(places))]
        return [e.nz[j] for e in function.call(inner, False, True) for j in range(e.nnz())]
