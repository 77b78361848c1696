"""Conditions at the start of a run: equations of ``initial()``, declared starts, values given by name, discrete variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.operations import affine_root
from powertrain.dae.hybrid import HybridDae
from powertrain.errors import InitializationError, ParameterError, suggestion
from powertrain.language.arguments import by_name, number
from powertrain.language.labelled import check_unit
from powertrain.language.quantities import has_unit, quantity
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.numerics.buffers import PREFIX, Evaluated

DECLARED = "start of the variable"
_DEPTH = 10
"""Depth to which expressions are compared."""


@dataclass(frozen=True)
class StartCondition:
    """A condition at the start: its name or source line, its origin, and the value."""

    label: str
    source: str
    value: float
    unit: str = "1"


@dataclass(frozen=True)
class StartEquation:
    """expression = value at the start."""

    label: str
    source: str
    expression: Symbol
    value: float
    unit: str = "1"


class Discretes:
    """The equations of ``initial()`` that determine discrete variables from parameters, time, other discrete variables, and comparisons.

    A comparison of unknowns, such as the gear for the speed at the start, cannot determine these. ``held``: the names of the variables with
    values given for the run. ``given``: the indices in ``m`` of those that the equations determine; ``values``: their values as expressions
    of (t, x and z, m, p), in which no variable of ``given`` appears; ``others``: the remaining equations, without those that values of the
    run replace.
    """

    def __init__(self, compiled: Compiled, held: Set[str]) -> None:
        dae = compiled.dae
        self.others: list[StartEquation] = []
        found: dict[int, Symbol] = {}
        unknowns = ca.vertcat(dae.x, dae.z)
        places = [place for name, place in compiled.discretes.items() if name not in held]
        places.sort(key=lambda place: dae.held_start[place] != 0.0)  # other declared starts are kept if possible
        replaced = {key(dae.m[compiled.discretes[name]]) for name in held}
        for asked in text_conditions(compiled):
            expression = _put(dae, asked.expression, found)
            inside = set(map(key, free_symbols(expression)))
            roots = ((i, affine_root(expression, dae.m[i])) for i in places if key(dae.m[i]) in inside)
            place, value = next(((i, root) for i, root in roots if root is not None), (None, None))
            determines = not ca.jacobian(expression, unknowns).is_zero()
            if determines or place is None or value is None:
                self.others += [asked] if determines or not inside & replaced else []
                continue
            found = {i: _put(dae, e, {place: value}) for i, e in found.items()} | {place: value}
        self.given, self.values = list(found), column(list(found.values()))
        arguments, outputs = [dae.t, unknowns, dae.m, dae.p], [ca.densify(self.values)]
        self._evaluated = Evaluated(ca.Function(PREFIX + "discretes", arguments, outputs))

    def set(self, t: float, y: Array, m: Array, p: Array, before: Array | None = None) -> Array:
        """Write the values into ``m`` and return them; those as ``before`` are left out, since resets may have changed them there."""
        if not self.given:
            return np.zeros(0)
        found = self._evaluated(t, y, m, p)[0].ravel()
        new = np.ones(len(found), bool) if before is None else found != before
        m[np.array(self.given, int)[new]] = found[new]
        return found


def _put(dae: HybridDae, expression: Symbol, values: Mapping[int, Symbol]) -> Symbol:
    """The expression with these values for some entries of ``m``."""
    return ca.substitute(expression, column([dae.m[i] for i in values]), column([*values.values()]))


def text_conditions(compiled: Compiled) -> list[StartEquation]:
    """The equations of ``initial()`` of all parts."""
    initial, dae = compiled.source.initial, compiled.dae
    residuals = compiled.resolve([e.residual for e in initial])
    inside = {key(s) for group in dae.arguments for s in ca.symvar(group)}
    for equation, residual in zip(initial, residuals, strict=True):
        strange = [s.name() for s in free_symbols(residual) if key(s) not in inside]
        if strange:
            raise InitializationError(
                f"{equation.place}\n  {strange[0]} is not a variable of the compiled model; write the condition in terms of a variable or "
                "the derivative of a state"
            )
    return [StartEquation(str(e.place), "initial()", r, 0.0) for e, r in zip(initial, residuals, strict=True)]


def signal_condition(compiled: Compiled, name: str, value: float, source: str) -> StartEquation:
    """A variable of the model has a value."""
    signal = compiled.signals[name]
    return StartEquation(name, source, signal.expression, value, signal.unit)


def start_values(compiled: Compiled, given: Any, what: str = "starts") -> dict[str, float]:
    """Initial values by name as numbers: a text with a unit, such as "20 degC", is converted; ``what`` names them in errors."""

    def value(name: str, one: Any) -> float:
        if name not in compiled.signals:
            raise ParameterError(f"{what}: the model has no variable {name}{suggestion(name, compiled.signals)}")
        unit = compiled.signals[name].unit
        check_unit(f"{what}: {name}", one, unit)
        with_unit = isinstance(one, str) and has_unit(one)
        return quantity(one, unit, f"{what}: {name}") if with_unit else number(f"{what}: {name}", one)

    return {name: value(name, one) for name, one in by_name(what, given).items()}


def declared_conditions(compiled: Compiled) -> list[StartEquation]:
    """Declared starts: first those that are not zero, then absolute quantities, then relative ones that are preferred as states."""
    declared = [u for u in compiled.variables.values() if u.start is not None]
    declared.sort(key=lambda u: (u.start == 0.0, u.prefer))
    return [signal_condition(compiled, u.name, u.start or 0.0, DECLARED) for u in declared]


def unsettled(compiled: Compiled, conditions: Sequence[StartEquation]) -> str:
    """The message for modes that change the start at every iteration: what depends on them, and what to give instead."""
    dae = compiled.dae
    said = f"{', '.join([law.name for law in dae.laws[:8]])}: the modes of these laws at the start do not settle"
    depending = [c.label for c in conditions if ca.depends_on(c.expression, dae.m)]
    speeds = [name for f in dae.frictions if (name := _name(compiled, f.w))]
    if not depending:
        return f"{said}; give more of the start"
    instead = f"give the speeds of the laws ({', '.join(speeds[:4])}) too, or" if speeds else "give"
    return f"{said}, and they decide {', '.join(depending[:4])}; {instead} states in its place"


def _name(compiled: Compiled, expression: Symbol) -> str | None:
    """The shortest name of a signal that is this expression."""
    names = [name for name, s in compiled.signals.items() if ca.is_equal(s.expression, expression, _DEPTH)]
    return min(names, key=lambda name: (name.count("."), len(name)), default=None)
