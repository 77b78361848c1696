"""Where the search for the unknowns of a steady state starts: at guesses and prescribed values, and where a run would start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.operations import affine_root
from powertrain.equilibrium.placed import Placed
from powertrain.language.symbols import Symbol, column, key, scalars

Told = Mapping[str, float] | Mapping[str, Symbol]
"""Values that variables have at a start."""


def starts(placed: Placed, y: Mapping[str, Symbol], cyclic: Sequence[Symbol]) -> tuple[Symbol, Symbol]:
    """The unknowns ``y`` at the guesses, as far as these determine them, and at the start of a run, in terms of grid and common values.

    The user's guesses come first, then what the grid prescribes, then what the components expect: with a shaft's speed given, a contact
    that rolls tells its ratio. An unknown of which nothing is known is zero, as are the states ``cyclic``.
    """
    compiled, guesses = placed.compiled, placed.asked.guesses
    expected = {n: v.guess for n, v in compiled.variables.items() if v.guess is not None}
    declared = {n: v.start for n, v in compiled.variables.items() if v.start}
    present = {n: i.value for n, i in compiled.inputs.items() if i.value}
    present |= {n: compiled.parameters[n].value for n in y if n in compiled.parameters}
    begun = _initial_values(compiled) | declared | present
    own = {n: v for n, v in begun.items() if n in y}
    prescribed: dict[str, Symbol] = {n: placed.axis[n] for n in placed.asked.prescribed}
    first: list[Told] = [guesses, prescribed, expected, own]
    initial: list[Told] = [own, prescribed, begun, expected]
    return _determined(placed, y, cyclic, first), _determined(placed, y, cyclic, initial)


def _determined(placed: Placed, y: Mapping[str, Symbol], cyclic: Sequence[Symbol], told: Sequence[Told]) -> Symbol:
    """The unknowns at which variables have the values ``told``; what is told first counts more.

    One after the other, a variable gives the unknown on which it depends linearly, if it depends on no other that is still open.
    """
    known, names, none = dict[str, Symbol](), {key(s): n for n, s in y.items()}, ca.SX.zeros(len(cyclic))
    given = {key(s) for s in (*placed.axis.values(), *scalars(placed.common.symbols))}
    for values in told:
        known = {n: Symbol(v) for n, v in values.items() if n in y} | known
        others = [n for n in values if n in placed.compiled.variables and n not in y]
        expressions = placed.put([placed.compiled.signals[n].expression for n in others])
        for name, expression in zip(others, ca.substitute(expressions, [column(cyclic)], [none]), strict=True):
            old, new = column([y[n] for n in known]), column(list(known.values()))
            residual = ca.substitute(expression - values[name], old, new)
            left = [s for s in ca.symvar(residual) if key(s) not in given]
            if len(left) == 1 and key(left[0]) in names and (root := affine_root(residual, left[0])) is not None:
                known[names[key(left[0])]] = root
    return column([known.get(n, Symbol(0)) for n in y])


def _initial_values(compiled: Compiled) -> dict[str, float]:
    """The variables that initial equations give, one after the other, from parameters and those given before."""
    values, found = {key(c.symbol): c.value for c in compiled.parameters.values()}, dict[str, float]()
    names = {key(u.symbol): name for name, u in compiled.variables.items()}
    left, before = [equation.residual for equation in compiled.source.initial], -1
    while before != len(found):
        before = len(found)
        for residual in left:
            symbols = ca.symvar(residual)
            unknown = [s for s in symbols if key(s) not in values]
            if len(unknown) != 1 or key(unknown[0]) not in names or (root := affine_root(residual, unknown[0])) is None:
                continue
            others = [s for s in symbols if key(s) in values]
            value = float(ca.Function("powertrain_start", [column(others)], [root])([values[key(s)] for s in others]))
            if np.isfinite(value):
                values[key(unknown[0])] = found[names[key(unknown[0])]] = value
    return found
