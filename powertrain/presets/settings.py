"""Setting what can be set of a model from texts, as on the command line and in parameter files."""

from __future__ import annotations

import ast
import inspect
import tomllib
import typing
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import powertrain as pt
from powertrain.errors import PowertrainError, suggestion
from powertrain.language.checks import is_rows, is_scalar, rows, scalar
from powertrain.language.component import variants
from powertrain.language.fields import is_given
from powertrain.presets.calls import located
from powertrain.presets.catalogue import Entry, components, find, fitting
from powertrain.presets.data import decoded, plain, takes_data
from powertrain.presets.places import Adjustable, place

MANY, FEW = 12, 4
"""Components and parameters that a message lists at most."""
M = TypeVar("M", bound=pt.Component)


def assigned(component: M, pairs: Iterable[tuple[str, str]]) -> M:
    """A copy with places set from texts: ``differential.mu`` "0.1", ``differential`` "CircularCamDifferential(mu=0.1)".

    Maps are named by their file and cycles by their name or file, as in a parameter file: ``engine.curve`` "full_load.csv"; tables are
    written as there, too: ``cam`` "{ M = 4, N = 5 }".
    Values that follow each other are set at once, so that conditions between them hold for all of them together.
    Errors: ParameterError for an unknown path, for a value that does not fit, with its unit and range, and for a value that a later one
    would replace.
    """
    values: dict[str, Any] = {}
    for path, text in _each_once(pairs):
        found = place(component, path)
        if found.is_part:
            component = pt.replace(component, values | {path: part(text, found)})
            values = {}
        elif takes_data(found):
            values[path] = decoded(table_or_name(text, path), found, Path())
        else:
            values[path] = checked(found, number_or_text(text) if found.spec is not None else _read(text, found))
    return pt.replace(component, values) if values else component


def _each_once(pairs: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """The pairs. Errors: ParameterError for a path whose value, or that of a place within it, was given before: that would be lost."""
    before: list[str] = []
    for path, text in pairs:
        for other in before:
            if other == path:
                raise pt.ParameterError(f"{path} is given twice")
            if other.startswith((f"{path}.", f"{path}[")):
                raise pt.ParameterError(
                    f"{path} = {text} replaces {other}, which is given before it; give {path} first"
                )
        before.append(path)
        yield path, text


def checked(found: Adjustable, value: Any) -> Any:
    """A value for a parameter or a plain field, as the field holds it. Errors: ParameterError where it does not fit."""
    return _fitted(value, found) if found.spec is None else found.spec.check(value, found.path)


def table_or_name(text: str, where: str) -> Any:
    """An array or table in TOML; other texts stay."""
    if text.lstrip()[:1] not in ("[", "{"):
        return text
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        raise pt.ParameterError(f"{where}: {text!r} is not a table as in a parameter file: {error}") from None


def number_or_text(text: str) -> float | str:
    """The number that a text is; other texts, such as those with a unit, stay."""
    try:
        return float(text)
    except ValueError:
        return text


def part(text: str, found: Adjustable, folder: Path | None = None) -> pt.Component:
    """The component that a text describes, for a slot: a name, with values in brackets where it needs some, or one of its makers.

    Names of files in it are relative to ``folder``, by default the working directory.
    """
    try:
        node = ast.parse(text.strip(), mode="eval").body
    except SyntaxError:
        raise pt.ParameterError(
            f"{found.path}: {text!r} is neither the name of a component nor Name(parameter=value)"
        ) from None
    try:
        made = _built(node, found.path, found.kind, folder)
    except PowertrainError as error:
        own = found.path.rpartition(".")[2]
        inside = isinstance(node, ast.Name) and own in type(found.value)._fields
        raise at_place(found.path, error, f"; or set {found.path}.{own}" if inside else "") from None
    if not isinstance(made, pt.Component):
        raise pt.ParameterError(
            f"{found.path} is a component: give the name of a component, not {text!r}{_takes(found)}{_parameters(found)}"
        )
    return made


def at_place(path: str, error: PowertrainError, more: str = "") -> pt.ParameterError:
    """An error with the path of its place, where it does not begin with that itself."""
    return pt.ParameterError((str(error) if str(error).startswith(path) else f"{path}: {error}") + more)


def component_named(name: str, kind: Any, where: str) -> type[pt.Component]:
    """The component class of a name that fits into a slot of ``kind``; ParameterError where there is none."""
    fits = fitting(kind) or list(components())
    said = kind.__name__ if isinstance(kind, type) else "component"
    try:
        return find(name, fits, said).kind
    except pt.ParameterError:
        _check_no_maker(name, where)
        other = [entry for entry in components() if entry.name == name]
        if not other or other[0] in fits:
            raise
    names = ", ".join(entry.name for entry in fits)
    raise pt.ParameterError(f"{where} must be of class {said}, which {name} is not; choose from {names}")


def _check_no_maker(name: str, where: str) -> None:
    """ParameterError for a variant without its arguments, GearSchedule.for_gears."""
    whole, _, maker = name.rpartition(".")
    kind = next((entry.kind for entry in components() if entry.name == whole), None)
    if kind is not None and maker in variants(kind):
        takes = ", ".join(inspect.signature(getattr(kind, maker)).parameters)
        raise pt.ParameterError(
            f"{where}: write {name}(...) with its arguments in brackets; it takes {takes or 'none'}"
        )


def model_named(text: str, among: Iterable[Entry], folder: Path | None = None) -> pt.Component:
    """A vehicle by the name of its class, or one of its variants: ParallelHybrid, ParallelHybrid.plug_in(), ParallelHybrid.at("P4").

    Names of files in it are relative to ``folder``, by default the working directory.
    Errors: ParameterError for an unknown name or variant, and for arguments that it does not take.
    """
    if "(" not in text:
        return find(text, among, "vehicle").kind()
    try:
        node = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise pt.ParameterError(f"vehicle {text!r}: {error.msg}") from None
    name = text.partition("(")[0].partition(".")[0]
    if not isinstance(node, ast.Call):
        raise pt.ParameterError(
            f'vehicle {text!r} is not of the form Name() or Name.variant(...), such as ParallelHybrid.at("P4")'
        )
    return _made(node, find(name, among, "vehicle").kind, "vehicle", folder)


def _built(node: ast.expr, where: str, kind: Any = None, folder: Path | None = None) -> Any:
    """A value from the syntax tree of Name, Name(...), Name.maker(...) and literals."""
    if isinstance(node, ast.Name) and node.id not in ("inf", "nan"):
        return component_named(node.id, kind, where)()
    if isinstance(node, ast.Call):
        return _called(node, where, kind, folder)
    try:
        return ast.literal_eval(node)
    except ValueError:
        raise pt.ParameterError(f"{where}: {ast.unparse(node)!r} is not a value") from None


def _called(node: ast.Call, where: str, kind: Any, folder: Path | None) -> pt.Component:
    target = node.func
    name = target.value if isinstance(target, ast.Attribute) else target
    if not isinstance(name, ast.Name):
        raise pt.ParameterError(f"{where}: {ast.unparse(node)!r} does not begin with the name of a component")
    return _made(node, component_named(name.id, kind, where), where, folder)


def _made(node: ast.Call, cls: type[pt.Component], where: str, folder: Path | None) -> pt.Component:
    """A component of a class, Name(...), or of one of its variants, Name.maker(...)."""
    target, maker = node.func, typing.cast("Any", cls)
    if isinstance(target, ast.Attribute):
        makers = variants(cls)
        if target.attr not in makers:
            names = [name for name, spec in cls._fields.items() if is_given(spec)]
            fields = ", ".join(f"{name}=..." for name in names[:FEW]) + ", ..." * (len(names) > FEW)
            instead = (
                f"choose from {', '.join(makers)}" if makers else f"give its fields, as in {cls.__name__}({fields})"
            )
            raise pt.ParameterError(f"{cls.__name__} has no variant {target.attr!r}; {instead}")
        maker = getattr(cls, target.attr)
    kinds = cls._slot_types()
    arguments = [_built(value, where, None, folder) for value in node.args]
    named = {str(k.arg): _built(k.value, f"{where}.{k.arg}", kinds.get(str(k.arg)), folder) for k in node.keywords}
    if folder is not None and isinstance(target, ast.Attribute):
        arguments, named = located(maker, arguments, named, folder)
    try:
        made = maker(*arguments, **named)
    except (TypeError, ValueError, AttributeError, LookupError) as error:
        takes = (
            f"; {ast.unparse(target)} takes {', '.join(inspect.signature(maker).parameters)}"
            if maker is not cls
            else ""
        )
        raise pt.ParameterError(f"{where}: {ast.unparse(node)} cannot be created: {error}{takes}") from None
    assert isinstance(made, pt.Component)
    return made


def _read(text: str, found: Adjustable) -> Any:
    """The value of a plain field from its text."""
    _check_plain(found)
    if is_scalar(found.kind):
        return scalar(found.path, found.kind, number_or_text(text))
    if isinstance(found.value, str):
        return text
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        raise pt.ParameterError(f"{found.path}: {text!r} is not a value like {found.value!r}") from None


def _fitted(value: Any, found: Adjustable) -> Any:
    """A value for a plain field, of the type of the one that is there."""
    old = found.value
    value = plain(value)
    if is_rows(found.kind):
        return rows(found.path, found.kind, value)
    if is_scalar(found.kind):
        return scalar(found.path, found.kind, value)
    if typing.get_origin(found.kind) is typing.Literal:
        choice = typing.get_args(found.kind)
        if value not in choice:
            near = suggestion(str(value), map(str, choice))
            raise pt.ParameterError(f"{found.path} = {value!r} must be one of {', '.join(map(str, choice))}{near}")
        return value
    if isinstance(old, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if value != ():
        _check_plain(found)
    if type(value) is not type(old):
        raise pt.ParameterError(f"{found.path} = {value!r} is not a {type(old).__name__} like {old!r}")
    return value


def _check_plain(found: Adjustable) -> None:
    if found.in_row is not None:
        raise pt.ParameterError(
            f"{found.path} is a row of components: write a table [[{found.path}]] in a parameter file for each "
            f"{found.in_row.__name__}"
        )
    if not isinstance(found.value, (bool, int, float, str, tuple)):
        raise pt.ParameterError(
            f"{found.path} (a {type(found.value).__name__}) cannot be set from text, only in Python"
        )


def _takes(found: Adjustable) -> str:
    names = [entry.name for entry in fitting(found.kind)]
    return f" (it takes {_few(names, MANY)})" if names else ""


def _parameters(found: Adjustable) -> str:
    """Where a number may belong instead of the component itself."""
    names = [name for name, spec in type(found.value)._fields.items() if isinstance(spec, pt.Parameter)]
    return f"; or set its parameters: {_few([f'{found.path}.{name}' for name in names], FEW)}" if names else ""


def _few(names: list[str], most: int) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} others" if len(names) > most else "")


def assignments(texts: Iterable[str], option: str = "--set", example: str = "body.m=1500") -> list[tuple[str, str]]:
    """(path, value) of texts ``path=value`` of an option. Errors: ParameterError for a text without =."""
    pairs = []
    for text in texts:
        path, sign, value = text.partition("=")
        if not sign or not path.strip() or not value.strip():
            raise pt.ParameterError(f"{option} {text!r}: write path=value, such as {example}")
        pairs.append((path.strip(), value.strip()))
    return pairs


def free_or_error(wanted: Iterable[str], model: pt.Component, free: Mapping[str, float]) -> None:
    """ParameterError for a parameter that was set although the component around it determines it."""
    for path in wanted:
        found = place(model, path)
        if found.spec is not None and path not in free:
            whole = path.rpartition(".")[0].rpartition(".")[0] or type(model).__name__
            raise pt.ParameterError(f"{path} cannot be set: {whole} determines it from its own parameters; set those")
