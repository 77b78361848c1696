"""The request of a steady problem, and the model with grid symbols in place of held values, inputs and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import Contact, Friction, Switch, TimeSignal
from powertrain.language.symbols import Symbol, column, key
from powertrain.modes.friction import held_at_rest
from powertrain.numerics.buffers import Array

Law = Friction | Switch | Contact
Turning = dict[int, dict[int, float]]
"""States of which only differences matter: {omitted state: {other state: ratio at which they turn together}}."""


@dataclass(frozen=True)
class Request:
    """Names on the grid, those among them that prescribe variables or hold states, unknowns to be found, and requested expressions."""

    axes: tuple[str, ...]
    prescribed: tuple[str, ...]
    held: tuple[str, ...]
    free: tuple[str, ...]
    wanted: tuple[Symbol, ...]


@dataclass(frozen=True)
class Unknown:
    """A state, an algebraic unknown, or an input or parameter to be found."""

    symbol: Symbol
    name: str


class Placed:
    """The model with grid symbols in place of held values, inputs and parameters."""

    def __init__(self, compiled: Compiled, asked: Request, time: float, parameters: Array) -> None:
        dae = self.dae = compiled.dae
        self.values = {key(dae.p[i]): float(value) for i, value in enumerate(parameters)}
        self.compiled, self.asked = compiled, asked
        self.axis = {n: Symbol.sym(n) for n in asked.axes}
        self.free = {n: Symbol.sym(n) for n in asked.free}
        known = self.axis | self.free
        frictions = [replace(f, rounding=Symbol(0)) for f in dae.frictions]  # the value of angles makes no difference
        contacts = [replace(c, rounding=Symbol(0)) for c in dae.contacts]
        self.laws: list[Law] = [*frictions, *dae.switches, *contacts]
        self.inputs = {n: Symbol.sym(n) for n in compiled.inputs}
        m = [Symbol(v) for v in dae.held_start.tolist()]
        for name, place in compiled.discretes.items():
            m[place] = self.axis.get(name, m[place])
        for law in self.laws:
            m[law.index] = dae.m[law.index]
        for s in dae.schedules:
            value = known.get(s.name, self.inputs[s.name]) if s.name in self.inputs else Symbol(_at(s, time))
            m[s.index : s.index + 3] = [Symbol(time), value, Symbol(0)]
        p = [known.get(n, dae.p[i]) for i, n in enumerate(compiled.parameters)]
        self.arguments = [Symbol(time), dae.x, dae.z, column(m), column(p)]
        shared = [(law.rests, held_at_rest(law)) for law in dae.frictions if law.rests is not None]
        for (index, _), rests in zip(shared, self.put([rests for _, rests in shared]), strict=True):
            m[index] = rests
        self.arguments[3] = column(m)
        self.common = (
            column([*ca.vertsplit(dae.p), *self.inputs.values()])
            if dae.p.numel()
            else column(list(self.inputs.values()))
        )
        self.everything = self._everything()

    def put(self, expressions: Sequence[Symbol]) -> list[Symbol]:
        """Expressions of (t, x, z, m, p) in the symbols of the grid."""
        dae = self.dae
        function = ca.Function("powertrain_put", [dae.t, dae.x, dae.z, dae.m, dae.p], [column(list(expressions))])
        result = function.call(self.arguments)[0]
        return list(ca.vertsplit(ca.densify(result))) if result.numel() else []

    def _everything(self) -> list[Symbol]:
        """Everything a state can influence: rates, residuals, laws (except their uncertainties), guards, prescribed variables."""
        dae = self.dae
        found = [dae.xdot, dae.residual]
        for law in [*self.laws, *dae.guards]:
            found += [
                getattr(law, f.name)
                for f in fields(law)
                if isinstance(getattr(law, f.name), ca.SX) and f.name not in ("time", "known", "still", "share")
            ]
        found += [self.compiled.signals[n].expression for n in self.asked.prescribed]
        whole = column(found)
        return self.put(list(ca.vertsplit(ca.densify(whole)))) if whole.numel() else []

    def put_all(self, columns: Sequence[Symbol], tau: Symbol) -> list[Symbol]:
        """The same for columns that also contain the torques of the laws."""
        dae = self.dae
        z = dae.z if dae.opened is None else dae.z[: dae.opened.residual.numel()]
        t, x, _, m, p = self.arguments
        function = ca.Function("powertrain_put", [dae.t, dae.x, z, dae.m, dae.p, tau], list(columns))
        found: list[Symbol] = function.call([t, x, z, m, p, tau])
        return [ca.densify(e) for e in found]

    def rate(self, i: int, turning: Turning, xdot: Symbol) -> Symbol:
        """The rate of a state relative to those with which it turns together."""
        return xdot[i] - sum((row[i] * xdot[k] for k, row in turning.items() if i in row), Symbol(0))

    def state_of(self, name: str) -> int:
        """The index of the state that a variable is, up to its sign; -1 if it is none."""
        return state_of(self.compiled, name)


def state_of(compiled: Compiled, name: str) -> int:
    """The index of the state that a variable is, up to its sign; -1 if it is none."""
    expression = compiled.signals[name].expression
    if not expression.is_symbolic():
        expression = -expression
    places = {key(compiled.dae.x[i]): i for i in range(compiled.dae.x.numel())}
    return places.get(key(expression), -1) if expression.is_symbolic() else -1


def _at(schedule: TimeSignal, time: float) -> float:
    return float(np.interp(time, schedule.times, schedule.values))
