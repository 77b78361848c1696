"""Parameters set by an enclosing model: they are replaced by the expression and must stay in their range like all others.

    self.axle.J == 2 * self.J        a part's parameter in terms of the whole's

``Limits`` checks every set of parameter values: the ranges of bound parameters, the conditions of ``check()``, and ``within`` if it
concerns parameters only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.flatten import Flat, ModelConstant, rewritten
from powertrain.errors import ModelError, ParameterError
from powertrain.language.checks import unmet
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.language.units import told_apart, with_unit


def bind_parameters(flat: Flat) -> Flat:
    """The model with every bound parameter replaced by its value, also in ``bindings``. ModelError if definitions are circular."""
    if not flat.bindings:
        return flat
    order = _ordered(flat)
    for k in order:
        if (name := flat.bindings[k][0].name()) in flat.recorder.evaluated:
            raise ModelError(
                f"the equations are written with the number that {name} has in its part, but the model sets it by an equation; "
                f"give the part its value instead\n  {flat.binding_places[k]}"
            )
    old, new = [flat.bindings[k][0] for k in order], [flat.bindings[k][1] for k in order]
    for i in range(1, len(order)):
        (new[i],) = ca.substitute([new[i]], [column(old[:i])], [column(new[:i])])

    def bound(expressions: list[Symbol]) -> Sequence[Symbol]:
        return ca.substitute(expressions, [column(old)], [column(new)])

    found = rewritten(flat, bound)
    constants = {key(c.symbol): c for c in flat.parameters}
    return replace(
        found,
        bindings=dict(zip(order, zip(old, new, strict=True), strict=True)),
        bound=[(constants[k], flat.binding_places[k]) for k in order],
        conditions=[
            replace(c, holds=e) for c, e in zip(flat.conditions, bound([c.holds for c in flat.conditions]), strict=True)
        ],
        parameters=[c for c in flat.parameters if key(c.symbol) not in flat.bindings],
    )


def _ordered(flat: Flat) -> list[int]:
    """The bound parameters, each after those on which it depends."""
    order: dict[int, None] = {}
    for first in flat.bindings:
        path = [first] if first not in order else []
        while path:
            inner = [key(s) for s in free_symbols(flat.bindings[path[-1]][1])]
            open_ = [k for k in inner if k in flat.bindings and k not in order]
            if not open_:
                order[path.pop()] = None
            elif open_[0] in path:
                raise ModelError(_circle(flat, path[path.index(open_[0]) :]))
            else:
                path.append(open_[0])
    return list(order)


def _circle(flat: Flat, circle: Sequence[int]) -> str:
    names = [flat.bindings[k][0].name() for k in (*circle, circle[0])]
    quoted = "\n  ".join(str(flat.binding_places[k]) for k in circle)
    return f"circular definition of parameters: {' by '.join(names)}; give one of them a value\n  {quoted}"


@dataclass(frozen=True)
class _Limit:
    """low <= value <= high for an expression of parameters; ``constant`` is the bound parameter with this value."""

    value: Symbol
    place: Place
    low: Symbol
    high: Symbol
    name: str = ""
    unit: str = "1"
    constant: ModelConstant | None = None


class Limits:
    """The conditions on the values of all free parameters of a model."""

    def __init__(self, flat: Flat) -> None:
        self.parameters = flat.parameters
        free = {key(c.symbol) for c in flat.parameters}
        none, all_ = Symbol(-np.inf), Symbol(np.inf)
        limits = [_Limit(flat.bindings[key(c.symbol)][1], place, none, all_, constant=c) for c, place in flat.bound] + [
            _Limit(c.holds, c.place, Symbol(1), all_) for c in flat.conditions
        ]
        limits += [
            _Limit(g.value, g.place, g.low, g.high, g.name, g.unit) for g in flat.recorder.guards if g.action == "error"
        ]
        symbols = [{key(s) for s in free_symbols(column([m.value, m.low, m.high]))} for m in limits]
        self._limits = [m for m, inside in zip(limits, symbols, strict=True) if inside <= free]
        self._symbols = [inside for inside in symbols if inside <= free]
        rows = column([column([m.value, m.low, m.high]) for m in self._limits])
        self._values = ca.Function(
            "powertrain_limits", [column([c.symbol for c in flat.parameters])], [ca.densify(rows)]
        )

    @property
    def names(self) -> set[str]:
        """The parameters in conditions with others."""
        concerned = set().union(*self._symbols)
        return {c.name for c in self.parameters if key(c.symbol) in concerned}

    def check(self, p: NDArray[np.float64]) -> None:
        """Raise ParameterError if values, one set per column, are not allowed."""
        if not self._limits:
            return
        values = np.asarray(self._values(p), float).reshape(len(self._limits), 3, -1)
        for k, (limit, (value, low, high)) in enumerate(zip(self._limits, values, strict=True)):
            if limit.constant is not None:
                for number in np.unique(value).tolist():
                    self._check_bound(limit, limit.constant, number)
            bad = ~((low <= value) & (value <= high))
            if bad.any():
                i = int(bad.argmax())
                columns = np.broadcast_to(np.reshape(p, (len(self.parameters), -1)), (len(self.parameters), bad.size))
                given = {
                    c.name: (float(columns[j, i]), c.unit)
                    for j, c in enumerate(self.parameters)
                    if key(c.symbol) in self._symbols[k]
                }
                raise ParameterError(unmet(limit.place, given, _said(limit, *values[k, :, i].tolist())))

    def _check_bound(self, limit: _Limit, constant: ModelConstant, number: float) -> None:
        try:
            constant.check(number, constant.name)
        except ParameterError as error:
            raise ParameterError(f"{error}; it is given by\n  {limit.place}") from None


def _said(limit: _Limit, value: float, low: float, high: float) -> str:
    """The violation in words: a quantity is named; a condition speaks for itself."""
    if not limit.name:
        return ""
    shown, allowed = told_apart(value, (low, high)), f"[{low:g}, {high:g}]"
    return f"{limit.name} = {with_unit(shown, limit.unit)} is outside {with_unit(allowed, limit.unit)}"
