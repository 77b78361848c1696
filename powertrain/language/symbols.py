"""Helpers on ``casadi.SX`` scalars: keys of symbols, free symbols, time derivative."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any, TypeAlias, TypeVar

import casadi as ca

Symbol: TypeAlias = ca.SX
R = TypeVar("R")

time: Symbol = ca.SX.sym("time")
"""Simulated time in seconds, for use in equations."""


def key(symbol: Symbol) -> int:
    """Identity of a scalar symbol, usable as a dictionary key."""
    return int(symbol.element_hash())


def free_symbols(expression: Symbol) -> list[Symbol]:
    """The scalar symbols that occur in ``expression``."""
    return [] if expression.is_constant() else list(ca.symvar(expression))


def total_derivative(expression: Symbol, derivative: Callable[[Symbol], Symbol]) -> Symbol:
    """d/dt of a scalar by the chain rule; ``derivative`` gives d/dt of each free symbol."""
    symbols = free_symbols(expression)
    if not symbols:
        return Symbol(0)
    rates = [derivative(s) for s in symbols]
    if expression.is_symbolic():
        return rates[0]
    return ca.jtimes(expression, ca.vertcat(*symbols), ca.vertcat(*rates))


def scalars(matrix: Symbol) -> list[Symbol]:
    """The entries of a matrix, column by column."""
    return list(ca.vertsplit(ca.vec(ca.densify(matrix))))


def depending(expressions: Sequence[Symbol], symbols: Symbol) -> list[bool]:
    """Whether each scalar depends on any of the symbols, found in one pass over what the scalars share."""
    if not expressions or not symbols.numel():
        return [False] * len(expressions)
    return [bool(found) for found in ca.which_depends(ca.densify(column(expressions)), symbols, 1, True)]


def column(expressions: Sequence[Symbol]) -> Symbol:
    """A column vector, also of nothing."""
    return ca.vertcat(*expressions) if expressions else Symbol(0, 1)


def mapped(record: R, change: Callable[[list[Symbol]], Sequence[Symbol]]) -> R:
    """The same record (a dataclass) with all its expressions changed."""
    each: Any = record
    names = [f.name for f in fields(each) if isinstance(getattr(each, f.name), Symbol)]
    changed: R = replace(each, **dict(zip(names, change([getattr(each, name) for name in names]), strict=True)))
    return changed
