"""Dimensional similarity (Buckingham): in other units of mass, length, time and current every equation is multiplied by one factor.

Parameters, tables and module constants are converted, variables take random values, and each residual, condition and limit must have
the same ratio at all points. A formula with a wrong dimension, a parameter with a wrong unit or a number with a hidden unit breaks this.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
import sys
import typing
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
from catalogue import concrete, made

import powertrain as pt
import powertrain.components as library
from powertrain.compiler.flat import Flat
from powertrain.compiler.flatten import flatten
from powertrain.language.component import Component
from powertrain.language.connectors import Connector
from powertrain.language.dimensions import exact
from powertrain.language.fields import Parameter, is_given
from powertrain.language.map import Axis, Map
from powertrain.language.symbols import Symbol, column, key, time

BASE = {"m": 2.0, "kg": 2.0**5, "s": 2.0**-7, "A": 2.0**11}
"""New sizes of the units. Powers of two leave no round-off; temperatures keep their unit, as many laws are relative to 293.15 K."""
POINTS = 1000
WITHOUT = {
    "CoolantCircuit": "Walther's equation is for viscosities in cSt",
    "CycleSpeed": "the values of a schedule have no unit",
    "ElastoGap": "the unit of its stiffness depends on its exponent",
    "GearSchedule": "speeds that nothing reaches, in rad/s and m/s",
    "PowerShiftSchedule": "speeds that nothing reaches, in rad/s and m/s",
    "UnitRatio": "needs a basic ratio",
    "Vehicle": "its wind is the output of a block, without unit",
}
COLUMNS = {
    ("BearingFriction", "tau_pos"): ("rad/s", "N.m"),
    ("LossyGear", "lossTable"): ("rad/s", "1", "1", "N.m", "N.m"),
    ("MountedHousing", "mounts"): ("m", "N/m", "N.s/m"),
    ("StagedSpring", "stages"): ("rad", "N.m/rad"),
    ("StiffeningSpring", "stiffness"): ("N.m", "N.m/rad"),
    ("SupportFriction", "f_pos"): ("m/s", "N"),
    ("TorqueConverter", "table"): ("1", "root", "1"),
}
"""Units of the columns of tables; "root" is rad/s/root(N.m), and other tables contain numbers."""


def size(unit: str) -> float:
    """What a value in a unit is multiplied by."""
    if unit == "root":
        return float(size("rad/s") / size("N.m") ** 0.5)
    return float(np.prod([BASE.get(base, 1.0) ** power for base, power in exact(unit)[1]]))


def converted(part: Component, bound: set[str], path: str = "") -> Component:
    """The same component with its values in the new units, except for parameters that the enclosing model sets."""
    values = {}
    for name, spec in part._fields.items():
        if is_given(spec):
            values[name] = part._values[name] if path + name in bound else _value(part, name, spec, bound, path + name)
    return type(part)(**values)


def _value(part: Component, name: str, spec: Any, bound: set[str], path: str) -> Any:
    value: Any = part._values[name]
    hint = type(part)._slot_types().get(name)
    if isinstance(spec, Parameter):
        return value * size(spec.unit)
    if typing.get_origin(hint) is typing.Annotated:
        return value * size(typing.get_args(hint)[1])
    if isinstance(value, Component):
        return converted(value, bound, f"{path}.")
    if isinstance(value, Map):
        axes = [Axis(a.name, a.unit, np.multiply(a.points, size(a.unit)), a.outside) for a in value.axes]
        return Map(axes, value.values * size(value.unit), value.unit, value.name, value.method)
    if isinstance(value, tuple) and value and isinstance(value[0], Component):
        return tuple(converted(item, bound, f"{path}[{k}].") for k, item in enumerate(value))
    units = COLUMNS.get((type(part).__name__, name))
    return tuple(map(tuple, np.multiply(value, [size(u) for u in units]).tolist())) if units else value


def symbols(flat: Flat) -> list[tuple[Symbol, float, float | None]]:
    """Symbols with what they are multiplied by, and the values of parameters; not a number for modes."""
    found: list[tuple[Symbol, float, float | None]] = [(time, size("s"), None)]
    found += [(v.symbol, size(v.unit), None) for v in flat.unknowns.values()]
    found += [(c.symbol, size(c.unit), c.value) for c in (*flat.parameters, *flat.discretes)]
    found += [(s.mode, 1.0, np.nan) for s in (*flat.recorder.switches, *flat.recorder.relations)]
    sizes = {key(symbol): each for symbol, each, _ in found}
    for rate in flat.recorder.derivatives.values():
        base, order = flat.recorder.bases[key(rate)]
        found.append((rate, sizes[key(base)] / size("s") ** order, None))
    return found


def lines(flat: Flat) -> Iterator[tuple[str, Symbol, str | None]]:
    """Everything that is solved, monitored or audited, with its unit where that is known."""
    yield from ((str(place), expression, None) for place, expression in flat.lines())
    yield from ((str(e.place), e.residual, None) for e in flat.initial)
    for g in (*flat.recorder.guards, *flat.conditions):
        yield from ((f"{g.name} {g.where}", value, g.unit) for value in (g.value, g.low, g.high))
    yield from ((str(b.place), b.value, b.constant.unit) for b in flat.bindings.values())
    for part in flat.components:
        if not isinstance(part, Connector):
            with flat.reading(part._path):
                yield f"energy of {part._path}", Symbol(part.energy()), "J"
                yield f"loss of {part._path}", Symbol(part.loss()), "W"


def sample(flat: Flat) -> np.ndarray:
    """Random values of all symbols: 0 or 1 of modes, those of parameters around their own."""
    generator = np.random.default_rng(0)
    middle = [30 * generator.normal(size=POINTS) if own is None else own or 0.3 for *_, own in symbols(flat)]
    points = np.array([each * 10 ** generator.uniform(-2, 2, POINTS) for each in middle])
    return np.where(np.isnan(points), generator.integers(0, 2, points.shape), points)


def values(flat: Flat, points: np.ndarray) -> np.ndarray:
    """The values of all lines."""
    expressions = column([expression for _, expression, _ in lines(flat)])
    return np.array(ca.Function("f", [column([symbol for symbol, *_ in symbols(flat)])], [expressions])(points))


@cache
def constants() -> list[tuple[Any, str, float]]:
    """The module constants of the library whose docstring has a unit in brackets, in all modules that use them, with the new values."""
    found: list[tuple[Any, str, float]] = []
    names = [m.name for m in pkgutil.walk_packages(library.__path__, "powertrain.components.")]
    for module in map(importlib.import_module, names):
        body = ast.parse(inspect.getsource(module)).body
        for one, text in pairwise(body):
            said = text.value.value if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) else ""
            units = re.findall(r"\[([^\]]+)\]", str(said))
            targets = ast.walk(one.targets[0]) if isinstance(one, ast.Assign) else ()
            for k, target in enumerate(t for t in targets if isinstance(t, ast.Name)):
                value = getattr(module, target.id)
                if units and isinstance(value, float):
                    users = [sys.modules[n] for n in names if vars(sys.modules[n]).get(target.id) is value]
                    found += [(user, target.id, value * size(units[min(k, len(units) - 1)])) for user in users]
    return found


KINDS = [kind for kind in concrete() if kind.__name__ not in WITHOUT and ".blocks." not in kind.__module__]
"""Blocks are left out, as the numbers in their signals have any unit."""


@pytest.mark.parametrize("kind", KINDS, ids=[kind.__qualname__ for kind in KINDS])
def test_equations_are_the_same_in_other_units(kind: type[pt.Component], monkeypatch: pytest.MonkeyPatch) -> None:
    part = made(kind)
    flat = flatten(part)
    listed, points = [*lines(flat)], sample(flat)
    sizes = np.array([[each] for _, each, _ in symbols(flat)])
    before = values(flat, points)
    for module, name, value in constants():
        monkeypatch.setattr(module, name, value)
    after = values(flatten(converted(part, {b.constant.name for b in flat.bindings.values()})), points * sizes)
    for (text, _, unit), one, other in zip(listed, before, after, strict=True):
        used = np.isfinite(one) & np.isfinite(other) & ((one != 0) | (other != 0))
        if used.any():
            with np.errstate(divide="ignore"):
                ratio = other[used] / one[used]
            np.testing.assert_allclose(ratio, size(unit) if unit else np.median(ratio), rtol=1e-6, err_msg=text)
