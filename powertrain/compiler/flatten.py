"""From the tree of components to a flat model.

Every component gets a path ('wheels[0].hub'), its quantities become symbols with that name, and its equations are read once.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import casadi as ca
import numpy as np

from powertrain.compiler.connections import Nodes
from powertrain.compiler.flat import Binding, Equation, Flat, ModelConstant, ModelVariable
from powertrain.compiler.texts import read, residual_of
from powertrain.errors import ModelError, ParameterError
from powertrain.language.checks import checked_condition
from powertrain.language.component import Component, bound_copy
from powertrain.language.connectors import Connector, Signal, declared
from powertrain.language.dimensions import measure, units_of_terms
from powertrain.language.fields import Discrete, Parameter, Quantity, Variable, is_symbolic
from powertrain.language.law import Law
from powertrain.language.laws import Connection
from powertrain.language.recorder import Guard, Place, reading
from powertrain.language.symbols import Symbol, free_symbols, key, time
from powertrain.language.units import with_unit


def flatten(model: Component) -> Flat:
    """The flat model of ``model``; a ModelError quotes the line that cannot be read."""
    _refuse_other(model)
    flat, nodes = Flat(), Nodes()
    root = bound_copy(model, "", lambda component: _entered(component, flat))
    with reading(flat.recorder):
        for component in flat.components:
            for place, row in read(component, component.equations(), flat.recorder):
                if isinstance(row, Connection):
                    nodes.join(component, row, place)
                elif isinstance(row, Law):
                    for value in vars(row).values():
                        _check_known(flat, value, place)
                    flat.laws.append((place, row))
                else:
                    _add_equation(flat, row, place)
            of_runs, flat.recorder.guards[:] = [*flat.recorder.guards], []
            for place, row in read(component, component.initial(), flat.recorder):
                flat.initial.append(Equation(_residual(flat, row, place), place))
            of_starts = [replace(g, action="start") for g in flat.recorder.guards if g.action == "error"]
            flat.recorder.guards[:] = [*of_runs, *of_starts]
            for place, row in read(component, component.check(), flat.recorder):
                holds = checked_condition(row, place)
                flat.conditions.append(Guard("", place, holds, Symbol(1), Symbol(np.inf), "1", "error"))
        nodes.write(flat, root)
    return flat


def _refuse_other(model: object) -> None:
    """ParameterError for what is not a component."""
    if not isinstance(model, Component):
        kind = model.__name__ if isinstance(model, type) else ""
        raise ParameterError(
            f"a model is a component, not {f'the class {kind}; write {kind}(...)' if kind else repr(model)}"
        )


def _refuse_outdated(component: Component) -> None:
    """ParameterError for a component that was pickled when its class had other fields."""
    fields = {name for name, spec in component._fields.items() if not is_symbolic(spec)}
    if differing := sorted(fields ^ set(component._values)):
        raise ParameterError(
            f"{component._path or 'the model'}: this {type(component).__name__} was pickled with another version of its class, which "
            f"differs in {', '.join(differing)}; make it again"
        )


def _entered(component: Component, flat: Flat) -> dict[str, Symbol]:
    """The symbols of a component's quantities; it becomes one of the flat model's components."""
    _refuse_outdated(component)
    symbols = {n: _declare(component, s, flat) for n, s in component._fields.items() if isinstance(s, Quantity)}
    if type(component).equations is Component.equations and not isinstance(component, Connector):
        raise ModelError(
            f"{component._path or 'the model'}: {type(component).__name__} is a partial class without equations; "
            "use one of its subclasses"
        )
    flat.components.append(component)
    return symbols


def _declare(component: Component, quantity: Quantity, flat: Flat) -> Symbol:
    path = component._path
    name = path if isinstance(component, Signal) else f"{path}.{quantity.name}".lstrip(".")
    unit, doc = declared(component, quantity)
    if isinstance(quantity, Variable):
        symbol = Symbol.sym(name)
        q = quantity
        flat.recorder.units[key(symbol)] = unit
        flat.unknowns[key(symbol)] = ModelVariable(
            name, symbol, unit, doc, q.start, q.guess, q.prefer, q.flow, q.nominal
        )
        return symbol
    symbol = flat.recorder.hold(name)
    flat.recorder.units[key(symbol)] = unit
    if isinstance(quantity, Parameter):
        value = component._values[quantity.name]
        own, low = quantity, max(quantity.min, quantity.above)
        flat.parameters.append(ModelConstant(name, symbol, unit, doc, value, own.check, own.default, low, own.max))
    elif isinstance(quantity, Discrete):
        flat.discretes.append(ModelConstant(name, symbol, unit, doc, quantity.start))
    return symbol


def _check_known(flat: Flat, expression: Any, place: Place) -> None:
    """ModelError for a symbol that no component declares."""
    for s in free_symbols(expression) if isinstance(expression, ca.SX) else ():
        k = key(s)
        if not (k in flat.unknowns or k in flat.recorder.bases or k in flat.recorder.constants or k == key(time)):
            raise ModelError(
                f"{place}: {s.name()} is not a variable of the model; declare it as a field of a component"
            )


def _add_equation(flat: Flat, row: Any, place: Place) -> None:
    residual = _residual(flat, row, place)
    _check_known(flat, residual, place)
    left, right = row.dep(0), row.dep(1)
    if not all(key(s) in flat.recorder.constants for s in free_symbols(residual)):
        flat.equations.append(Equation(residual, place))
        if left.is_symbolic():
            flat.given[key(left)] = place.path
        return
    parameters = {key(c.symbol): c for c in flat.parameters}
    own = left.is_symbolic() and left.name().rpartition(".")[0] == place.path  # the whole's own sets that of a part
    if right.is_symbolic() and (own or not left.is_symbolic()) and right.name().rpartition(".")[0] != place.path:
        left, right = right, left
    if not left.is_symbolic() or key(left) not in parameters:
        raise ModelError(
            f"{place}: only parameters may appear here; to set a parameter of a part write  self.part.name == expression"
        )
    if key(left) in flat.bindings:
        raise ModelError(f"{left.name()} is set twice\n  {flat.bindings[key(left)].place}\n  {place}")
    constant = parameters[key(left)]
    if constant.default not in (None, constant.value):
        given = f"{constant.name} = {with_unit(f'{constant.value:g}', constant.unit)}"
        raise ParameterError(
            f"{given} would have no effect, because the model sets this parameter; leave it out\n  {place}"
        )
    flat.bindings[key(left)] = Binding(constant, right, place)


def _residual(flat: Flat, row: Any, place: Place) -> Symbol:
    """Left - right of an equation. ModelError where it adds or equates rad/s and rpm; where kinds differ, a factor of 1 may be meant.

    Temperatures in K and degC differ by a constant, so only an equation without another term is wrong.
    """
    residual = residual_of(row, place)
    left, right = (units_of_terms(side, flat.recorder.units) for side in (row.dep(0), row.dep(1)))
    bare = row.dep(0).is_symbolic() and row.dep(1).is_symbolic()
    for one, other in combinations(dict.fromkeys([*left, *right]), 2):
        (size, kind), (other_size, other_kind) = measure(one), measure(other)
        scaled = kind == other_kind and size != other_size and "1" not in (one, other)
        if scaled or (bare and {one, other} == {"K", "degC"}):
            apart = len(left) == len(right) == 1
            said = (
                f"the left side is in {one}, the right side in {other}"
                if apart
                else f"its terms are in {one} and {other}"
            )
            raise ModelError(f"{place}: {said}; nothing is converted in an equation")
    return residual
