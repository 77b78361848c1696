"""The conditions of a steady state for given torques of the laws: equations, and the relations of the laws between speeds and torques."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import HybridDae
from powertrain.language.symbols import Symbol, column, key
from powertrain.numerics.batch import dependence


@dataclass(frozen=True)
class Balance:
    """``rows`` are zero at the unknowns ``y`` for the torques ``tau``; all in terms of grid, y, modes, common values and tau.

    ``speed`` are the relative speeds of friction laws and the gaps of contacts, ``lower`` and ``upper`` the limits of their torques
    (minus the force of a contact), multiplied by ``peak`` while stuck. ``rate_of`` is the unknown whose rate a row is, or -1.
    """

    dae: HybridDae
    grid: Symbol
    y: Symbol
    names: tuple[str, ...]
    start: NDArray[np.float64]
    modes: Symbol
    common: Symbol
    tau: Symbol
    rows: Symbol
    rate_of: NDArray[np.intp]
    speed: Symbol
    lower: Symbol
    upper: Symbol
    conditions: Symbol
    peak: Symbol

    @property
    def tau_symbols(self) -> list[Symbol]:
        """The torques one by one."""
        return list(ca.vertsplit(self.tau)) if self.tau.numel() else []


def opened(compiled: Compiled, names: Sequence[str]) -> tuple[Symbol, Symbol, Symbol, list[Symbol]]:
    """The torques of the laws; rates, residuals and the variables ``names`` for given torques."""
    dae, given = compiled.dae, []
    variables = compiled.variables
    if dae.opened is None:
        return Symbol(0, 1), dae.xdot, dae.residual, [compiled.signals[n].expression for n in names]
    for name in names:
        known = name in variables
        given.append(compiled.open([variables[name].symbol])[0] if known else compiled.signals[name].expression)
    return dae.opened.tau, dae.opened.xdot, dae.opened.residual, given


def changed(expressions: Sequence[Symbol], old: Sequence[Symbol], new: Sequence[Symbol]) -> list[Symbol]:
    """Expressions with some symbols replaced by others."""
    return list(ca.substitute(list(expressions), [column(list(old))], [column(list(new))])) if expressions else []


def start_of(names: Sequence[str], compiled: Compiled, guesses: Mapping[str, float]) -> NDArray[np.float64]:
    """The start of the search for unknowns: guesses, present parameters, else what the model declares or starts with."""
    given = _initial_values(compiled)
    return np.array([_start(compiled, name, guesses, given) for name in names], float)


def _start(compiled: Compiled, name: str, guesses: Mapping[str, float], given: Mapping[str, float]) -> float:
    if name in guesses:
        return float(guesses[name])
    if name in compiled.parameters:
        return compiled.parameters[name].value
    unknown = compiled.variables.get(name) or compiled.inputs.get(name)
    return given.get(name, 0.0) if unknown is None else float(unknown.start or unknown.guess or given.get(name, 0.0))


def _initial_values(compiled: Compiled) -> dict[str, float]:
    """The unknowns that an initial equation gives as an expression of parameters."""
    values, found = {key(c.symbol): c.value for c in compiled.parameters.values()}, dict[str, float]()
    names = {key(u.symbol): name for name, u in compiled.variables.items()}
    for equation in compiled.source.initial:
        symbols = ca.symvar(equation.residual)
        unknown = [s for s in symbols if key(s) not in values]
        if len(unknown) != 1 or key(unknown[0]) not in names:
            continue
        slope = ca.jacobian(equation.residual, unknown[0])
        others = [s for s in symbols if key(s) in values]
        line = ca.Function("powertrain_start", [unknown[0], column(others)], [equation.residual, slope])
        value, rise = (float(x) for x in line(0.0, [values[key(s)] for s in others]))
        if not dependence([slope], unknown).any() and rise != 0.0 and np.isfinite(value / rise):
            found[names[key(unknown[0])]] = -value / rise
    return found
