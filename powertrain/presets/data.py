"""Maps, drive cycles and other records in a parameter file: the name of a file or cycle, the call of a function, or their fields.

curve = "full_load.csv"
curve = { csv = "full_load.csv", outside = "clip" }
ocv = "cells_in_series(96)"
curve = { name = "full load", unit = "N.m", axes = [{ name = "w", unit = "rad/s", points = [80.0, 400.0], outside = "clip" }],
          values = [110.0, 150.0] }
cycle = "udds"
cycle = { name = "hill", table = [[0.0, 0.0], [10.0, 12.0]], grades = [0.0, 0.05] }
cam = { M = 4, N = 5 }
scheme = { levers = [{ name = "1", a = "sun", b = "ring", carrier = "out", ratio = -2.0, eta = 0.985 }], elements = [...], gears = [...] }
"""

from __future__ import annotations

import dataclasses
import json
import math
import typing
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import powertrain as pt
from powertrain.components.cycles import CYCLES, DriveCycle
from powertrain.errors import suggestion
from powertrain.presets.calls import map_of
from powertrain.presets.places import Adjustable

NONE = "none"
"""In a file, for a place that may be empty."""


CYCLE_KEYS = ("name", "table", "source", "grades", "heights")
MAP_KEYS = ("name", "unit", "method", "axes", "values")
AXIS_KEYS = ("name", "unit", "points", "outside")
CSV_KEYS = ("csv", "outside", "method")
"""Keys of the tables of axes, cycles and maps."""


def takes_data(found: Adjustable) -> bool:
    """Whether a place takes a map, a drive cycle, another record, or rows with records."""
    return any(isinstance(kind, type) and dataclasses.is_dataclass(kind) for kind in _kinds(found))


def _is_record(kind: Any) -> bool:
    """Whether a kind is a record whose fields are plain values and records; in a file it is a table of these."""
    return isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind not in (pt.Map, DriveCycle)


def _kinds(found: Adjustable) -> tuple[Any, ...]:
    return (type(found.value), *_within(found.kind))


def _within(kind: Any) -> Iterator[Any]:
    yield kind
    for inner in typing.get_args(kind):
        yield from _within(inner)


def decoded(value: Any, found: Adjustable, folder: Path) -> Any:
    """The map, cycle or record that a value says, None for "none" where that is allowed. Errors: ParameterError, which names the place."""
    kinds = _kinds(found)
    is_map = pt.Map in kinds
    record = next(filter(_is_record, kinds), None)
    if value == NONE and type(None) in _kinds(found):
        return None
    try:
        if record is not None:
            return _field(found.kind if isinstance(value, list) else record, value)
        return _map(value, folder) if is_map else _cycle(value, folder)
    except (KeyError, TypeError, ValueError) as error:
        what = f"a {record.__name__}" if record is not None else "a map" if is_map else "a drive cycle"
        missing = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise pt.ParameterError(f"{found.path} = {str(value)[:80]} is not {what}: {missing}") from None


def _map(value: Any, folder: Path) -> pt.Map:
    if isinstance(value, str):
        return map_of(value, folder) if value.rstrip().endswith(")") else pt.Map.from_csv(folder / value)
    if "csv" in value:
        _check_keys(value, CSV_KEYS)
        return pt.Map.from_csv(folder / value["csv"], **{name: value[name] for name in value if name != "csv"})
    _check_keys(value, MAP_KEYS)
    for axis in value["axes"]:
        _check_keys(axis, AXIS_KEYS)
    axes = [pt.Axis(**axis) for axis in value["axes"]]
    return pt.Map(axes, value["values"], value["unit"], value.get("name", "map"), value.get("method", "linear"))


def _cycle(value: Any, folder: Path) -> DriveCycle:
    if isinstance(value, str):
        return DriveCycle.of(folder / value if Path(value).suffix.lower() == ".csv" else value)
    _check_keys(value, CYCLE_KEYS)
    return DriveCycle(
        value["name"],
        value["table"],
        value.get("source", ""),
        *(tuple(value.get(n, ())) for n in ("grades", "heights")),
    )


def _check_keys(table: Any, known: Iterable[str]) -> None:
    """ValueError for a key that would have no effect."""
    known = tuple(known)
    if unknown := [key for key in dict(table) if key not in known]:
        near = suggestion(unknown[0], known)
        raise ValueError(f"it has an unknown key {unknown[0]!r}{near}; known keys are {', '.join(known)}")


def _record(kind: Any, value: Any) -> Any:
    """A record from the table of its fields."""
    hints = typing.get_type_hints(kind)
    if not isinstance(value, dict):
        raise TypeError(f"give a table of {', '.join(hints)}")
    _check_keys(value, hints)
    needed = [field.name for field in dataclasses.fields(kind) if field.default is dataclasses.MISSING]
    if missing := [name for name in needed if name not in value]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    return kind(**{name: _field(hints[name], content) for name, content in dict(value).items()})


def _field(hint: Any, value: Any) -> Any:
    if dataclasses.is_dataclass(hint):
        return _record(hint, value)
    if isinstance(value, list):
        inner = typing.get_args(hint)
        hints = inner[:1] * len(value) if inner[-1:] == (Ellipsis,) else inner or (None,) * len(value)
        return tuple(_field(each, item) for each, item in zip(hints, value, strict=True))
    return value


def encoded(found: Adjustable) -> str:
    """A value that is not plain in TOML. Errors: ParameterError for what has no form there."""
    value = found.value
    if value is None:
        return json.dumps(NONE)
    if isinstance(value, DriveCycle):
        if value.name in CYCLES and value == DriveCycle.named(value.name):
            return json.dumps(value.name)
        fields = {name: getattr(value, name) for name in CYCLE_KEYS}
        return _inline({name: content for name, content in fields.items() if content})
    if isinstance(value, pt.Map):
        axes = tuple({"name": a.name, "unit": a.unit, "points": a.points, "outside": a.outside} for a in value.axes)
        values = plain(value.values.tolist())
        return _inline({"name": value.name, "unit": value.unit, "method": value.method, "axes": axes, "values": values})
    if _is_record(type(value)) or (isinstance(value, tuple) and takes_data(found)):
        return _text(value)
    raise pt.ParameterError(f"{found.path}: a {type(value).__name__} cannot be written to a parameter file")


def _inline(fields: dict[str, Any]) -> str:
    return "{ " + ", ".join(f"{name} = {_text(value)}" for name, value in fields.items()) + " }"


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return _inline(value)
    if dataclasses.is_dataclass(value):
        return _inline({field.name: getattr(value, field.name) for field in dataclasses.fields(value)})
    if isinstance(value, tuple):
        return f"[{', '.join(_text(item) for item in value)}]"
    return str(literal(value))


def plain(value: Any) -> Any:
    """A list as the tuple that fields hold."""
    return tuple(plain(item) for item in value) if isinstance(value, list) else value


def literal(value: Any) -> str | None:
    """A plain value in TOML; None for what has no form there."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, (int, float)):
        return repr(value) if math.isfinite(value) else None
    if isinstance(value, tuple):
        items = [literal(item) for item in value]
        return None if None in items else f"[{', '.join(str(item) for item in items)}]"
    return None
