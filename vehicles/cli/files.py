"""Parameter files: a model's parameters and parts in TOML, a table for every part.

    class = "SplitPathCar"

    [engine]
    class = "WillansEngine"
    J = 0.15  # kg.m2, Moment of inertia with the flywheel, range [0, inf)

``class`` names the component in a slot. Where it is the one that is there already, only the values of its table change.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, TypeVar

import powertrain as pt
from powertrain.component import children
from powertrain.vehicles.cli.settings import Place, part, place, places, with_value

M = TypeVar("M", bound=pt.Component)
CLASS = "class"


def read(path: str | Path) -> dict[str, Any]:
    """The tables of a file. Errors: ParameterError where it is not TOML, with the line."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise pt.ParameterError(f"{path} is no TOML file: {error}") from None


def applied(model: M, tables: dict[str, Any]) -> tuple[M, list[str]]:
    """A copy of the model with what the tables say, and the paths that were set.

    Errors: ParameterError for a file of another model, for names the model does not have, and for values that do not fit.
    """
    name = tables.get(CLASS, type(model).__name__)
    if name != type(model).__name__:
        raise pt.ParameterError(f"the parameter file is for {name}, not for {type(model).__name__}")
    paths: list[str] = []
    return _applied(model, tables, "", paths), paths


def _applied(model: M, tables: dict[str, Any], prefix: str, paths: list[str]) -> M:
    for key, value in tables.items():
        if key == CLASS:
            continue
        path = f"{prefix}{key}"
        found = place(model, path)
        if isinstance(value, dict) and found.is_part:
            if CLASS in value:
                model = _with_class(model, found, value, paths)
            model = _applied(model, value, f"{path}.", paths)
        elif found.is_part:
            model = pt.replace(model, {path: part(str(value), found)})
        else:
            model = with_value(model, found, value)
            paths.append(path)
    return model


def _with_class(model: M, found: Place, table: dict[str, Any], paths: list[str]) -> M:
    """The slot filled anew where another class is asked for; values that the class cannot do without come from the table."""
    name = str(table[CLASS])
    if name == type(found.value).__name__:
        return model
    if "(" not in name:
        given = [f"{k}={v!r}" for k, v in table.items() if k != CLASS and not isinstance(v, dict)]
        name = f"{name}({', '.join(given)})"
    return pt.replace(model, {found.path: part(name, found)})


def written(model: pt.Component, free: Collection[str] | None = None) -> str:
    """The text of a parameter file: every part with its class, every parameter (of ``free``) with unit, meaning and range."""
    lines = [
        f"# Parameters of {type(model).__name__}, powertrain {pt.__version__}. Read with --params; a table may leave out what stays.",
        f"{CLASS} = {json.dumps(type(model).__name__)}",
        *_table(model, "", free),
    ]
    return "\n".join(lines) + "\n"


def _table(component: pt.Component, prefix: str, free: Collection[str] | None) -> Iterator[str]:
    parts = dict(children(component))
    for found in places(component):
        if "." in found.path or found.is_part:
            continue
        if found.spec is not None:
            if free is None or f"{prefix}{found.path}" in free:
                said = f"{found.spec.unit}, {found.spec.doc}, range {found.spec.range}"
                yield f"{found.path} = {float(found.value)!r}  # {said}"
        elif (text := _literal(found.value)) is not None:
            yield f"{found.path} = {text}"
        elif found.value is not None:
            yield f"# {found.path}: a {type(found.value).__name__} is not written here"
    for found in places(component):
        if found.is_part and "." not in found.path:
            value = parts[found.path]
            path = f"{prefix}{found.path}"
            yield ""
            yield f"[{'.'.join(json.dumps(p) if '[' in p else p for p in path.split('.'))}]"
            yield f"{CLASS} = {json.dumps(type(value).__name__)}"
            yield from _table(value, f"{path}.", free)


def _literal(value: Any) -> str | None:
    """A plain value in TOML; None for what has no form there."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, (int, float)):
        return repr(value) if math.isfinite(value) else None
    if isinstance(value, tuple):
        items = [_literal(item) for item in value]
        return None if None in items else f"[{', '.join(str(item) for item in items)}]"
    return None
