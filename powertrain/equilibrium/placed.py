"""The model as a steady problem sees it: what is given stands in its place, and angles that merely turn are left out.

Nothing depends on such an angle, or only differences of several of them matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.generic import generic_values
from powertrain.dae.friction import held_at_rest
from powertrain.dae.hybrid import Contact, Friction, Law, TimeSignal
from powertrain.errors import ParameterError
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, key, scalars
from powertrain.numerics.batch import Common, dependence
from powertrain.numerics.pivots import leading_columns

Turning = dict[int, dict[int, float]]
"""States of which only differences matter: {omitted state: {other state: ratio at which they turn together}}."""
_NOTHING = 1e-9
"""Shares of the largest slope, and of one turn, that count as round-off."""


@dataclass(frozen=True)
class Request:
    """What is asked of a model at a ``time``.

    Names on the grid, those among them that prescribe variables or hold states, unknowns to be found with ``guesses``, and requested
    expressions.
    """

    axes: tuple[str, ...]
    prescribed: tuple[str, ...]
    held: tuple[str, ...]
    free: tuple[str, ...]
    wanted: tuple[Symbol, ...]
    guesses: Mapping[str, float] = field(default_factory=dict)
    time: float = 0.0


class Placed:
    """The model with grid symbols in place of held values, inputs and parameters.

    ``laws``: frictions, switches, contacts. ``everything`` that a state can influence: rates, residuals, laws (except their
    uncertainties), guards, prescribed variables.
    """

    def __init__(self, compiled: Compiled, asked: Request, parameters: Array) -> None:
        dae = self.dae = compiled.dae
        self.compiled, self.asked, self.parameters = compiled, asked, parameters
        self.axis = {n: Symbol.sym(n) for n in asked.axes}
        self.free = {n: Symbol.sym(n) for n in asked.free}
        known, time = self.axis | self.free, Symbol(asked.time)
        frictions = [replace(f, rounding=Symbol(0)) for f in dae.frictions]  # the value of angles makes no difference
        contacts = [replace(c, rounding=Symbol(0)) for c in dae.contacts]
        self.laws: list[Law] = [*frictions, *dae.switches, *contacts]
        inputs = {n: Symbol.sym(n) for n in compiled.inputs}
        self.common = Common(ca.vertcat(dae.p, column(list(inputs.values()))))
        m = [Symbol(v) for v in dae.held_start.tolist()]
        for name, place in compiled.discretes.items():
            m[place] = self.axis.get(name, m[place])
        for law in self.laws:
            m[law.index] = dae.m[law.index]
        for s in dae.schedules:
            value = known.get(s.name, inputs[s.name]) if s.name in inputs else Symbol(_at(s, asked.time))
            m[s.index : s.index + 3] = [time, value, Symbol(0)]
        p = column([known.get(n, dae.p[i]) for i, n in enumerate(compiled.parameters)])
        self._given = [time, column(m), p]
        shared = [(law.rests, held_at_rest(law)) for law in dae.frictions if law.rests is not None]
        for (index, _), rests in zip(shared, self.put([rests for _, rests in shared]), strict=True):
            m[index] = rests
        self._given = [time, column(m), p]
        self.everything = self.put(self._everything())

    def put(self, expressions: Sequence[Symbol]) -> list[Symbol]:
        """Expressions of the model in the symbols of the grid."""
        dae = self.dae
        return [ca.densify(e) for e in ca.substitute(list(expressions), [dae.t, dae.m, dae.p], self._given)]

    def _everything(self) -> list[Symbol]:
        dae = self.dae
        found = [dae.xdot, dae.residual]
        for law in [*self.laws, *(g for g in dae.guards if g.action == "error")]:  # counted ones belong to runs
            found += [
                getattr(law, f.name)
                for f in fields(law)
                if isinstance(getattr(law, f.name), ca.SX) and f.name not in ("time", "known", "still", "share")
            ]
        found += [self.compiled.signals[n].expression for n in self.asked.prescribed]
        return scalars(column(found))


def state_of(compiled: Compiled, name: str) -> int:
    """The index of the state that a variable is, up to its sign; -1 if it is none."""
    expression = compiled.signals[name].expression
    if not expression.is_symbolic():
        expression = -expression
    places = {key(compiled.dae.x[i]): i for i in range(compiled.dae.x.numel())}
    return places.get(key(expression), -1) if expression.is_symbolic() else -1


def rest_of(law: Law) -> Symbol:
    """What is zero while a law is at rest: its speed, or the gap of a contact; zero for a switch."""
    return law.w if isinstance(law, Friction) else law.gap if isinstance(law, Contact) else Symbol(0)


def _at(schedule: TimeSignal, time: float) -> float:
    return float(np.interp(time, schedule.times, schedule.values))


def influential(placed: Placed) -> list[int]:
    """The states on which anything depends. ParameterError if the request holds another one."""
    found = np.asarray(dependence(placed.everything, scalars(placed.dae.x)).any(axis=0))
    for name in placed.asked.held:
        if not found[state_of(placed.compiled, name)]:
            raise ParameterError(
                f"grid: {name} only rotates; nothing in the model depends on it, so it has no steady value"
            )
    return [int(i) for i in np.flatnonzero(found)]


def turning_together(placed: Placed, kept: Sequence[int]) -> Turning:
    """The states of which only differences matter. ParameterError if that changes along the grid."""
    found = _null_directions(placed, kept, 1.0)
    if found and not _alike(found, _null_directions(placed, kept, 1.01)):
        names = ", ".join(placed.dae.state_names[i] for i in (*found, *next(iter(found.values()))))
        raise ParameterError(
            f"steady: {names} turn together by ratios that change along the grid; "
            "let their difference be a state of its own, by its rate: der(difference) == ..."
        )
    return found


def _alike(one: Turning, other: Turning) -> bool:
    return one.keys() == other.keys() and all(
        one[i].keys() == other[i].keys() and all(abs(one[i][j] - other[i][j]) < _NOTHING for j in one[i]) for i in one
    )


def _null_directions(placed: Placed, kept: Sequence[int], place: float) -> Turning:
    """The directions in which no state has an effect, for any values but those of the grid, which are at one ``place``."""
    if not kept:
        return {}
    p, jacobian = placed.dae.p, ca.jacobian(column(placed.everything), column([placed.dae.x[i] for i in kept]))
    own, grid = {key(s) for s in scalars(p)}, {key(s) for s in (*placed.axis.values(), *placed.free.values())}
    symbols = [s for s in ca.symvar(jacobian) if key(s) not in own]
    function = ca.Function("powertrain_turning", [column(symbols), p], [ca.densify(jacobian)])
    given, points = [key(s) in grid for s in symbols], np.random.default_rng(0).uniform(0.3, 2.0, (3, len(symbols)))
    points[:, given] = place * points[0, given]
    stacks = []
    for point in points:
        value = np.nan_to_num(np.array(function(point, placed.parameters)), nan=1.0, posinf=1.0, neginf=1.0)
        stacks.append(value / np.maximum(np.abs(value).max(axis=1, keepdims=True), 1e-300))
    _, sizes, basis = np.linalg.svd(np.vstack(stacks))
    null = basis[int((sizes > _NOTHING * max(sizes.max(), 1e-300)).sum()) :]
    places = leading_columns(null)
    turning: Turning = {}
    for place, row in zip(places, np.linalg.solve(null[:, places], null), strict=True):
        turning[kept[place]] = {
            kept[j]: float(row[j]) for j in range(len(kept)) if j not in places and abs(row[j]) > _NOTHING
        }
    return turning


def relative_rate(i: int, turning: Turning, xdot: Symbol) -> Symbol:
    """The rate of a state relative to those with which it turns together."""
    return xdot[i] - sum((row[i] * xdot[k] for k, row in turning.items() if i in row), Symbol(0))


def lost_outputs(placed: Placed, cyclic: Sequence[int], turning: Turning) -> tuple[list[bool], bool]:
    """The requested expressions that depend on how far the model has turned, and whether others would with other parameters.

    Gears may cancel, as in a rig in which the torque of a twisted shaft circulates: slopes are zero except for round-off of their
    terms, whose sizes show with other parameters.
    """
    wanted, x = placed.put(placed.asked.wanted), placed.dae.x
    alone = [i for i in cyclic if i not in turning]
    depends = np.asarray(dependence(wanted, [x[i] for i in alone]))
    if not turning and not depends.any():
        return [False] * len(wanted), False
    jacobian, parameters = ca.jacobian(column(wanted), x), scalars(placed.dae.p)
    slopes, others = (
        generic_values(jacobian, {key(s): float(v) for s, v in zip(parameters, values, strict=True)}).full()
        for values in (placed.parameters, placed.parameters * np.linspace(1.1, 1.9, len(parameters)))
    )
    sizes = np.maximum(np.abs(slopes), np.abs(others))
    lost = depends & ~(np.abs(slopes[:, alone]) < _NOTHING * sizes[:, alone])
    found: NDArray[np.bool_] = lost.any(axis=1)
    for i, shares in turning.items():
        direction = np.zeros(x.numel())
        for j, share in (shares | {i: 1.0}).items():
            direction[j] = share
        found |= np.abs(slopes @ direction) > _NOTHING * (sizes @ np.abs(direction))
    return [bool(each) for each in found], bool((depends & ~lost).any())
