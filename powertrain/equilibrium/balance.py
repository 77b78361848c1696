"""The conditions of a steady state for given torques of the laws: what is zero, and what the laws say between speeds and torques."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import HybridDae
from powertrain.language.symbols import Symbol, column


@dataclass(frozen=True)
class Balance:
    """``rows`` are zero at the unknowns ``y`` for the torques ``tau``; all in terms of grid, y, modes, common values and tau.

    ``speed`` are the relative speeds of friction laws and the gaps of contacts, ``lower`` and ``upper`` the limits of their torques
    (minus the force of a contact). ``rate_of`` is the unknown whose rate a row is, -1 where it is none.
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

    @property
    def tau_symbols(self) -> list[Symbol]:
        """The torques one by one."""
        return list(ca.vertsplit(self.tau)) if self.tau.numel() else []


def opened(compiled: Compiled, names: Sequence[str]) -> tuple[Symbol, Symbol, Symbol, list[Symbol]]:
    """The torques of the laws; rates, residuals and the variables ``names`` for given torques."""
    dae, given = compiled.dae, []
    unknowns = {u.name: u.symbol for u in compiled.flat.unknowns.values()}
    if dae.opened is None:
        return Symbol(0, 1), dae.xdot, dae.residual, [compiled.signals[n].expression for n in names]
    for name in names:
        known = name in unknowns
        given.append(compiled.open([unknowns[name]])[0] if known else compiled.signals[name].expression)
    return dae.opened.tau, dae.opened.xdot, dae.opened.residual, given


def changed(expressions: Sequence[Symbol], old: Sequence[Symbol], new: Sequence[Symbol]) -> list[Symbol]:
    """Expressions with symbols put in the place of others."""
    return list(ca.substitute(list(expressions), [column(list(old))], [column(list(new))])) if expressions else []


def start_of(names: Sequence[str], compiled: Compiled, guesses: Mapping[str, float]) -> NDArray[np.float64]:
    """Where the search for unknowns begins: guesses, parameters as they are, else what the model declares."""
    return np.array([_start(compiled, name, guesses) for name in names], float)


def _start(compiled: Compiled, name: str, guesses: Mapping[str, float]) -> float:
    if name in guesses:
        return float(guesses[name])
    if name in compiled.parameters:
        return compiled.parameters[name].value
    known = {u.name: u for u in [*compiled.flat.unknowns.values(), *compiled.flat.inputs]}
    unknown = known.get(name)
    return 0.0 if unknown is None else float(unknown.start or unknown.guess or 0.0)
