"""Parameters set by an enclosing model: they are replaced by the expression and must stay in their range like all others.

    self.axle.J == 2 * self.J        a part's parameter in terms of the whole's

``Limits`` checks every set of parameter values: the ranges of bound parameters, the conditions of ``check()``, and ``within`` if it
concerns parameters only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.flat import Binding, Flat, ModelConstant, rewritten
from powertrain.errors import ModelError, ParameterError
from powertrain.language.checks import unmet
from powertrain.language.recorder import Guard, Place
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.language.units import told_apart, with_unit


def bind_parameters(flat: Flat) -> Flat:
    """The model with every bound parameter replaced by its value, also in ``bindings``. ModelError if definitions are circular."""
    if not flat.bindings:
        return flat
    bindings = _ordered(flat.bindings)
    for b in bindings.values():
        if b.constant.name in flat.recorder.evaluated:
            raise ModelError(
                f"the equations are written with the number that {b.constant.name} has in its part, but the model sets it by an equation; "
                f"give the part its value instead\n  {b.place}"
            )
    old, new = [b.constant.symbol for b in bindings.values()], [b.value for b in bindings.values()]
    for i in range(1, len(old)):
        (new[i],) = ca.substitute([new[i]], [column(old[:i])], [column(new[:i])])

    def bound(expressions: list[Symbol]) -> Sequence[Symbol]:
        return ca.substitute(expressions, [column(old)], [column(new)])

    return replace(
        rewritten(flat, bound),
        bindings={k: replace(b, value=value) for (k, b), value in zip(bindings.items(), new, strict=True)},
        parameters=[c for c in flat.parameters if key(c.symbol) not in bindings],
    )


def _ordered(bindings: Mapping[int, Binding]) -> dict[int, Binding]:
    """The bound parameters, each after those on which it depends."""
    done: dict[int, Binding] = {}
    for first in bindings:
        path = [first] if first not in done else []
        while path:
            inner = [key(s) for s in free_symbols(bindings[path[-1]].value)]
            open_ = [k for k in inner if k in bindings and k not in done]
            if not open_:
                done[path[-1]] = bindings[path[-1]]
                path.pop()
            elif open_[0] in path:
                raise ModelError(_circle([bindings[k] for k in path[path.index(open_[0]) :]]))
            else:
                path.append(open_[0])
    return done


def _circle(circle: Sequence[Binding]) -> str:
    names = [b.constant.name for b in (*circle, circle[0])]
    quoted = "\n  ".join(str(b.place) for b in circle)
    return f"circular definition of parameters: {' by '.join(names)}; give one of them a value\n  {quoted}"


class Limits:
    """The conditions on the values of all free parameters of a model."""

    def __init__(self, flat: Flat) -> None:
        self.parameters = flat.parameters
        free = {key(c.symbol) for c in flat.parameters}
        bound = [(_range(b.constant, b.value, b.place), b.constant) for b in flat.bindings.values()]
        others = [*flat.conditions, *(g for g in flat.recorder.guards if g.action != "count")]
        limits = [(g, _symbols(g), constant) for g, constant in [*bound, *((g, None) for g in others)]]
        self._limits = [(g, inside, constant) for g, inside, constant in limits if inside <= free]
        """Each with the keys of its symbols; that of a bound parameter also with the parameter."""
        rows = column([column([g.value, g.low, g.high]) for g, _, _ in self._limits])
        self._values = ca.Function(
            "powertrain_limits", [column([c.symbol for c in flat.parameters])], [ca.densify(rows)]
        )

    @property
    def names(self) -> set[str]:
        """The parameters in conditions with others."""
        concerned = set().union(*(inside for _, inside, _ in self._limits))
        return {c.name for c in self.parameters if key(c.symbol) in concerned}

    def guards(self, names: Sequence[str]) -> list[Guard]:
        """The ranges of the named parameters and the conditions in which they occur, for values that are to be found."""
        named = [c for c in self.parameters if c.name in names]
        wanted = {key(c.symbol) for c in named}
        concerned = [g for g, inside, _ in self._limits if inside & wanted]
        return [
            *(_range(c, c.symbol, "its range") for c in named),
            *(replace(g, name=g.name or "condition", action="error") for g in concerned),
        ]

    def check(self, p: NDArray[np.float64]) -> None:
        """Raise ParameterError if values, one set per column, are not allowed."""
        if not self._limits:
            return
        values = np.asarray(self._values(p), float).reshape(len(self._limits), 3, -1)
        for k, ((guard, inside, constant), (value, low, high)) in enumerate(zip(self._limits, values, strict=True)):
            if constant is not None:
                for number in np.unique(value).tolist():
                    _check_bound(guard, constant, number)
            bad = ~((low <= value) & (value <= high))
            if bad.any():
                i = int(bad.argmax())
                columns = np.broadcast_to(np.reshape(p, (len(self.parameters), -1)), (len(self.parameters), bad.size))
                given = {
                    c.name: (float(columns[j, i]), c.unit)
                    for j, c in enumerate(self.parameters)
                    if key(c.symbol) in inside
                }
                raise ParameterError(unmet(guard.where, given, _said(guard, *values[k, :, i].tolist())))


def _symbols(guard: Guard) -> set[int]:
    return {key(s) for s in free_symbols(column([guard.value, guard.low, guard.high]))}


def _range(constant: ModelConstant, value: Symbol, where: Place | str) -> Guard:
    """The range of a parameter as limits of what gives its value."""
    return Guard(constant.name, where, value, Symbol(constant.low), Symbol(constant.high), constant.unit, "error")


def _check_bound(guard: Guard, constant: ModelConstant, number: float) -> None:
    try:
        constant.check(number, constant.name)
    except ParameterError as error:
        raise ParameterError(f"{error}; it is given by\n  {guard.where}") from None


def _said(guard: Guard, value: float, low: float, high: float) -> str:
    """The violation in words: a quantity is named; a condition speaks for itself."""
    if not guard.name:
        return ""
    shown, allowed = told_apart(value, (low, high)), f"[{low:g}, {high:g}]"
    return f"{guard.name} = {with_unit(shown, guard.unit)} is outside {with_unit(allowed, guard.unit)}"
