"""Parameter files: a model's parameters and parts in TOML, a table for every part.

    class = "SplitPathCar"

    [engine]
    class = "WillansEngine"
    J = 0.15  # kg.m2, Moment of inertia with the flywheel, range [0, inf)

``class`` names the component in a slot. Where it is the one that is there already, only the values of its table change. Values may have
units: ``J = "0.15 kg.m2"``, ``P_max = "82 kW"``. Parts in a row, such as the gears of a gearbox, are an array of tables, which replaces all
of them. Maps and drive cycles are a CSV file's name, a cycle's name, or a table of their numbers; see ``data``.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import powertrain as pt
from powertrain.errors import PowertrainError
from powertrain.language.checks import is_rows
from powertrain.language.component import variants
from powertrain.presets.catalogue import fitting, is_named, name_in
from powertrain.presets.data import decoded, encoded, literal, plain, takes_data
from powertrain.presets.places import Adjustable, place, places
from powertrain.presets.settings import at_place, checked, component_named, part

M = TypeVar("M", bound=pt.Component)
CLASS = "class"
HINTS = {
    "Cannot overwrite a value": "; a value is given once, and a component that is set as a text has no table of its own: "
    "write its name as class = ... in the table",
    "twice": "; write all values of a component in one table",
    "Invalid value": "; texts stand in quotation marks",
    "Expected newline": '; quantities with a unit stand in quotation marks, as in m = "1500 kg", and decimals have a point',
    "Expected '='": "; write name = value, and [name] above the values of a component",
}
"""Likely mistakes in files that are not TOML, by a fragment of the parser's message."""


def read(path: str | Path) -> dict[str, Any]:
    """The tables of a file. Errors: ParameterError where it cannot be read, and where it is not TOML, with the line."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise pt.ParameterError(f"{path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        hint = next((hint for said, hint in HINTS.items() if said in str(error)), "")
        raise pt.ParameterError(f"{path} is not a TOML file: {error}{hint}") from None


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the name of the parameter file before an error that does not begin with it."""
    try:
        yield
    except pt.ParameterError as error:
        raise at_place(str(path), error) from None


def applied(model: M, tables: dict[str, Any], folder: Path | None = None) -> tuple[M, list[str]]:
    """A copy of the model with what the tables say, and the paths that were set; names of files are relative to ``folder``.

    Errors: ParameterError for a file of another model, for names the model does not have, and for values that do not fit.
    """
    name = str(tables.get(CLASS, type(model).__name__)).partition("(")[0].partition(".")[0]
    if not is_named(type(model), name):
        raise pt.ParameterError(f"the parameter file is for {name}, not for {type(model).__name__}")
    paths: list[str] = []
    return _applied(model, tables, "", paths, folder or Path()), paths


def _applied(model: M, tables: dict[str, Any], prefix: str, paths: list[str], folder: Path) -> M:
    values: dict[str, Any] = {}
    """The parameters and data of this table, set at once, so that conditions between them hold for all of them together."""
    for key, value in tables.items():
        if key == CLASS:
            continue
        path = f"{prefix}{key}"
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            model = _with_row(model, path, value, folder)
            continue
        if isinstance(value, list):
            _check_no_row(model, path)
        found = place(model, path)
        if found.is_part:
            if (new := _new(value, found, folder)) is not None:
                model = pt.replace(model, {path: new})
            model = _applied(model, value, f"{path}.", paths, folder) if isinstance(value, dict) else model
        elif takes_data(found):
            values[path] = _data(value, found, _owner(model, path), folder)
        else:
            values[path] = checked(found, value)
            paths.append(path)
    return pt.replace(model, values) if values else model


def _owner(model: pt.Component, path: str) -> type[pt.Component]:
    """The class of the part that a path leads to a place of."""
    whole = path.rpartition(".")[0]
    return type(place(model, whole).value) if whole else type(model)


def _data(value: Any, found: Adjustable, owner: type[pt.Component], folder: Path) -> Any:
    """A map, cycle or record for a place of a part, which the errors name."""
    if not isinstance(value, (str, list, dict)):
        raise pt.ParameterError(f"{found.path} = {value!r} is neither a name nor a table of numbers")
    try:
        return decoded(value, found, folder)
    except PowertrainError as error:
        reads = isinstance(value, str) and "from_csv" in variants(owner)
        said = f'; write class = "{owner.__name__}.from_csv(...)" for other layouts of files' if reads else ""
        raise at_place(found.path, error, said) from None


def _check_no_row(model: pt.Component, path: str) -> None:
    """ParameterError for plain values where there are parts in a row."""
    row = next((found for found in places(model) if found.path == f"{path}[0]"), None)
    if row is not None:
        whole, kind = path.rpartition(".")[0], _owner(model, path)
        raise pt.ParameterError(
            f"{path} has several components ({type(row.value).__name__}): write a table [[{path}]] for each of them"
            + "".join(f', or in [{whole}]  class = "{kind.__name__}.{maker}(...)"' for maker in variants(kind))
        )


def _with_row(model: M, path: str, items: list[dict[str, Any]], folder: Path) -> M:
    """Parts in a row, all of them made anew."""
    known = {found.path: found for found in places(model)}
    none = known.get(path)
    first, kind = known.get(f"{path}[0]"), none.in_row if none is not None else None
    if kind is not None:
        first = Adjustable(f"{path}[0]", None, kind, kind())
    if first is None:
        raise pt.ParameterError(
            f"{path} is not a tuple of components: write a table [{path}], not an array of tables [[{path}]]"
        )
    made = []
    for i, item in enumerate(items):
        base = known.get(f"{path}[{i}]", first)
        bare = Adjustable(f"{path}[{i}]", None, first.kind, base.value)
        made.append(_made(bare, item, folder))
    return pt.replace(model, {path: tuple(made)})


def _made(found: Adjustable, table: dict[str, Any], folder: Path) -> pt.Component:
    """A part of a table: of the class that the table names, else the one that is there, with the table's values."""
    new = _new(table, found, folder)
    try:
        return _applied(found.value if new is None else new, table, "", [], folder)
    except PowertrainError as error:
        raise at_place(found.path, error) from None


def _new(value: Any, found: Adjustable, folder: Path) -> pt.Component | None:
    """The part that a text, or the class of a table, asks for in a slot; None where a table keeps the one that is there."""
    if not isinstance(value, dict):
        return part(str(value), found, folder)
    name = str(value.get(CLASS, type(found.value).__name__))
    if is_named(type(found.value), name):
        return None
    if "(" in name:
        return part(name, found, folder)
    return _fresh(component_named(name, found.kind, found.path), value, found.path, folder)


def _fresh(cls: type[pt.Component], table: dict[str, Any], path: str, folder: Path) -> pt.Component:
    """A part of a class with the values of the table that it has no default for; the others are set afterwards.

    A part within it that is there by default stays: its table leaves out the parameters that are bound to others.
    """
    kinds, given = cls._slot_types(), dict[str, Any]()
    for name, spec in cls._fields.items():
        if name not in table:
            continue
        value, here = table[name], Adjustable(f"{path}.{name}", None, kinds.get(name), spec)
        if isinstance(spec, pt.Parameter):
            given[name] = value
        elif takes_data(here):
            given[name] = _data(value, here, cls, folder)
        elif not isinstance(value, list) and fitting(here.kind):
            new = _new(value, here, folder)
            given |= {} if new is None else {name: new}
        elif isinstance(value, (bool, int, float, str, list)) and not (
            isinstance(value, list) and any(isinstance(i, dict) for i in value)
        ):
            given[name] = checked(here, value) if is_rows(here.kind) else plain(value)
    try:
        return cls(**given)
    except PowertrainError as error:
        raise at_place(path, error) from None


def written(model: pt.Component, free: Collection[str] | None = None) -> str:
    """The text of a parameter file: every part with its class, every parameter (of ``free``) with unit, meaning and range."""
    lines = [
        f"# Parameters of {type(model).__name__}, powertrain {pt.__version__}. Read with --params; a table may leave out what stays.",
        f"{CLASS} = {json.dumps(type(model).__name__)}",
        *_table(model, "", free),
    ]
    return "\n".join(lines) + "\n"


def _table(component: pt.Component, prefix: str, free: Collection[str] | None, row: bool = False) -> Iterator[str]:
    """The lines of a part: its own values, then its parts. ``prefix`` is its path for people; in a row of parts all is free."""
    for found in places(component):
        if "." in found.path or found.is_part:
            continue
        if found.spec is not None:
            if row or free is None or f"{prefix}{found.path}" in free:
                said = f"{found.spec.unit}, {found.spec.doc}, range {found.spec.range}"
                yield f"{found.path} = {float(found.value)!r}  # {said}"
        elif (text := literal(found.value)) is not None:
            yield f"{found.path} = {text}"
        elif found.value is not None or takes_data(found):
            yield f"{found.path} = {encoded(found)}"
    for found in places(component):
        if found.is_part and "." not in found.path:
            slot, index, _ = found.path.partition("[")
            yield from _section(found, f"{prefix}{slot}", free, in_row=bool(index), row=row)


def _section(found: Adjustable, path: str, free: Collection[str] | None, *, in_row: bool, row: bool) -> Iterator[str]:
    yield ""
    yield f"[[{path}]]" if in_row else f"[{path}]"
    yield f"{CLASS} = {json.dumps(name_in(found.kind, type(found.value)))}"
    yield from _table(found.value, f"{path}.", free, row or in_row)
