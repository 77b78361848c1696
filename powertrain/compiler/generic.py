"""Values of expressions at a point where nothing special happens: what holds there holds for almost all parameters and states."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from powertrain.language.symbols import Symbol, column, free_symbols, key


def generic_values(expression: Symbol, known: Mapping[int, float] | None = None) -> ca.DM:
    """The value of an expression, with its sparsity; ``known``: values of symbols, by their keys."""
    inside, given = free_symbols(expression), known or {}
    function = ca.Function("powertrain_generic", [column(inside)], [expression])
    return function(ca.DM([given.get(key(s), _generic(s)) for s in inside]) if inside else ca.DM(0, 1))


def _generic(symbol: Symbol) -> float:
    """A value without special meaning, always the same for the same name."""
    value = 0
    for character in symbol.name():
        value = (value * 31 + ord(character)) & 0xFFFFFFFF
    return 0.3 + 0.4 * (value % 1000) / 1000
