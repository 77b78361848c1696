"""A model with small signals added at its ports: the same model, compiled with perturbations at requested ports.

The perturbation of a port is a polynomial in time around a reference instant, u(t) = sum_k u_k (t - t_r)^k / k!, so u_k is the k-th
derivative of u there. Derivatives of inputs that index reduction introduces appear as a dependence on u_1, u_2, ...
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled, compile_flat
from powertrain.compiler.flat import Equation, Flat, ModelConstant
from powertrain.compiler.flatten import flatten
from powertrain.dae.hybrid import OperatingPoint
from powertrain.errors import ModelError
from powertrain.language.component import Component
from powertrain.language.connectors import Connector, Output, Signal
from powertrain.language.fields import Variable
from powertrain.language.law import Law
from powertrain.language.laws import FrictionLaw, UnilateralLaw
from powertrain.language.reals import Array
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars, time, total_derivative

ORDER = 4
"""Highest derivative of a perturbation that is considered."""


@dataclass(frozen=True)
class Spot:
    """A variable of a port at which a signal, a force or a torque can be added; ``owner`` is the component with the port.

    ``kind``: an input's variable is determined by everything but its owner, an output's by its owner; both contain what is added.
    A flow's variable does not contain it.
    """

    unit: str
    symbol: Symbol
    owner: str
    kind: Literal["input", "output", "flow"]


@dataclass(frozen=True)
class Perturbed:
    """The model with perturbations.

    ``coefficients[i][k]`` is the k-th derivative of the i-th perturbation at the reference instant. They are the last parameters of the
    model, after that instant.
    """

    compiled: Compiled
    coefficients: tuple[tuple[Symbol, ...], ...]


def spots(components: Sequence[Component]) -> dict[str, Spot]:
    """Every signal port by its path, and every flow of a port ('shaft.flange_a.tau'): an external torque or force on the component."""
    found: dict[str, Spot] = {}
    for port in components:
        if not isinstance(port, Connector):
            continue
        owner = port._path.rpartition(".")[0]
        if isinstance(port, Signal):
            kind: Literal["input", "output"] = "output" if isinstance(port, Output) else "input"
            found[port._path] = Spot(port.unit, port._symbols["value"], owner, kind)
            continue
        for name, spec in port._fields.items():
            if isinstance(spec, Variable) and spec.flow:
                found[f"{port._path}.{name}"] = Spot(spec.unit, port._symbols[name], owner, "flow")
    return found


def compile_perturbed(model: Component, names: Sequence[str]) -> Perturbed:
    """Compile ``model`` with perturbations at the spots of these names."""
    flat = flatten(model)
    known, reference = spots(flat.components), _parameter(flat, "reference")
    coefficients = []
    for name in names:
        coefficients.append(tuple(_parameter(flat, f"{name}.u{k}") for k in range(ORDER + 1)))
        polynomial, factorial = Symbol(0), 1.0
        for k, coefficient in enumerate(coefficients[-1]):
            factorial *= max(k, 1)
            polynomial += coefficient * (time - reference) ** k / factorial
        flat = _with_added(flat, known[name], polynomial)
    return Perturbed(compile_flat(flat), tuple(coefficients))


def _parameter(flat: Flat, name: str) -> Symbol:
    """A new parameter of the model, zero."""
    symbol = flat.recorder.hold(name)
    flat.parameters.append(ModelConstant(name, symbol, "1", "", 0.0))
    return symbol


def _with_added(flat: Flat, spot: Spot, polynomial: Symbol) -> Flat:
    """The model with the perturbation added: a flow to what its owner sees; a signal to what determines its variable.

    The derivatives of the perturbation are added to those of the variable.
    """
    recorder = flat.recorder
    old, new = [], []
    symbol, added = spot.symbol, polynomial if spot.kind == "flow" else -polynomial
    while True:
        old.append(symbol)
        new.append(symbol + added)
        if key(symbol) not in recorder.derivatives:
            break
        symbol, added = recorder.derivatives[key(symbol)], total_derivative(added, recorder.derivative)

    def seen(expression: Symbol) -> Symbol:
        return ca.substitute(expression, column(old), column(new))

    def concerned(place: Place) -> bool:
        return (place.path == spot.owner) == (spot.kind != "input")

    def law_seen(place: Place, law: Law) -> Law:
        if not concerned(place) or not isinstance(law, FrictionLaw | UnilateralLaw):
            return law
        return law.mapped(lambda expressions: [seen(e) for e in expressions])

    return replace(
        flat,
        equations=[Equation(seen(e.residual), e.place) if concerned(e.place) else e for e in flat.equations],
        laws=[(place, law_seen(place, law)) for place, law in flat.laws],
        inputs=[replace(i, symbol=seen(i.symbol)) if spot.kind == "input" else i for i in flat.inputs],
    )


def transfer(original: Compiled, perturbed: Compiled) -> Callable[[OperatingPoint], tuple[Array, Array]]:
    """States and algebraic unknowns of the perturbed model from a point of the original one, by their names."""
    if perturbed is original:
        return lambda point: (point.x, point.z)
    if [s.name() for s in scalars(perturbed.dae.m)] != [s.name() for s in scalars(original.dae.m)]:
        raise ModelError("a perturbation of this input changes modes of the model; choose another input")
    x = column([_found(original, n) for n in perturbed.states])
    z = column([_found(original, s.name()) for s in scalars(perturbed.dae.z)])
    function = original.dae.function("transfer", x, z)

    def at(point: OperatingPoint) -> tuple[Array, Array]:
        x, z = function(*point)
        return np.array(x, float).ravel(), np.array(z, float).ravel()

    return at


def _found(compiled: Compiled, name: str) -> Symbol:
    """An unknown, a signal or a derivative of a model by its name, in terms of the model's arguments."""
    dae = compiled.dae
    symbols = {s.name(): s for s in (*scalars(dae.x), *scalars(dae.z))}
    symbols |= dict(zip(compiled.states, scalars(dae.x), strict=True))
    if name in symbols:
        return symbols[name]
    expression: Symbol
    if name in compiled.signals:
        expression = compiled.signals[name].expression
        return expression
    base, order = name, 0
    while base.startswith("der(") and base.endswith(")"):
        base, order = base[4:-1], order + 1
    if base in compiled.variables:
        expression = compiled.variables[base].symbol
        for _ in range(order):
            expression = compiled.source.recorder.derivative(expression)
        (expression,) = compiled.resolve([expression])
        inside = {s.name() for group in dae.arguments for s in scalars(group)}
        if all(s.name() in inside for s in free_symbols(expression)):
            return expression
    raise ModelError(
        f"with a perturbation of this input the model has the state {name}, which the operating point lacks; choose another input"
    )
