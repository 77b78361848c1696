"""What a component's declarations say, as tables: what ``powertrain info`` prints and the pages of the documentation show."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, get_args

import powertrain as pt
from powertrain.language.checks import bare
from powertrain.language.fields import MISSING, Port
from powertrain.presets.catalogue import fitting

HELPER = re.compile(r"\bself\.(_\w+)\(")
METHODS = "equations", "initial", "energy", "loss"
Row = tuple[str, ...]


@dataclass(frozen=True)
class Facts:
    """A table about a component; the columns ``right`` are numbers."""

    title: str
    head: Row
    rows: list[Row]
    right: tuple[int, ...] = ()


def facts(kind: type[pt.Component], model: pt.Component | None = None) -> list[Facts]:
    """All tables of a component that have rows, with its defaults, or with the values of a ``model`` of this kind."""
    said, given = ("default", {}) if model is None else ("value", model._values)
    tables = [
        Facts("Parameters", ("name", said, "unit", "range", "meaning"), list(_parameters(kind, given)), (1,)),
        Facts("Slots and fields", ("name", "kind", said, "takes"), list(_slots(kind, given))),
        Facts("Ports", ("name", "kind", "unit", "meaning"), list(_ports(kind))),
        Facts("Variables", ("name", "unit", "meaning"), list(_variables(kind))),
        Facts(
            "Parameters of its parts", ("path", "value", "unit", "range", "meaning"), list(_inner(kind, model)), (1,)
        ),
    ]
    return [_without_empty_end(table) for table in tables if table.rows]


def _without_empty_end(table: Facts) -> Facts:
    if any(row[-1] for row in table.rows):
        return table
    return replace(table, head=table.head[:-1], rows=[row[:-1] for row in table.rows])


def text_of(kind: type[pt.Component]) -> str:
    """The text of equations, initial, energy and loss, with the helpers they call."""
    wanted, seen, found = list(METHODS), set[str](), []
    while wanted:
        name = wanted.pop(0)
        owner = next((c for c in kind.__mro__ if name in vars(c)), None)
        if name in seen or owner is None or owner.__module__ == "powertrain.language.component":
            continue
        seen.add(name)
        text = textwrap.dedent(inspect.getsource(vars(owner)[name]))
        wanted += [helper for helper in HELPER.findall(text) if helper not in seen]
        found.append(text)
    return "\n".join(found)


def _parameters(kind: type[pt.Component], given: dict[str, Any]) -> Iterator[Row]:
    for name, spec in kind._fields.items():
        if isinstance(spec, pt.Parameter):
            yield _parameter(name, spec, given.get(name, spec.default))


def _parameter(name: str, spec: pt.Parameter, value: float | None) -> Row:
    return name, "must be given" if value is None else f"{value:g}", spec.unit, spec.range, spec.doc


def _slots(kind: type[pt.Component], given: dict[str, Any]) -> Iterator[Row]:
    for name, spec in kind._fields.items():
        if isinstance(spec, (Port, pt.Parameter, pt.Variable, pt.Discrete)):
            continue
        takes = kind._slot_types().get(name)
        fits = [entry.name for entry in fitting(takes) if entry.kind is not takes]
        yield name, _kind(takes), _default(given.get(name, spec)), ", ".join(fits)


def _default(spec: Any) -> str:
    if spec is MISSING:
        return "must be given"
    text = type(spec).__name__ if isinstance(spec, pt.Component) else repr(spec)
    return text if len(text) <= 30 else f"a {type(spec).__name__}"


def _kind(takes: Any) -> str:
    takes, unit = bare(takes)
    generic = get_args(takes) or not isinstance(takes, type)  # tuple[Inertia, ...] is a type, too
    said = re.sub(r"\b(?:\w+\.)+(?=\w)", "", str(takes)).replace("NoneType", "None") if generic else takes.__name__
    return f"{said} [{unit}]" if unit else said


def _ports(kind: type[pt.Component]) -> Iterator[Row]:
    for name, spec in kind._fields.items():
        if isinstance(spec, Port):
            made = spec.build()
            unit, doc = (str(getattr(made, key, "")) for key in ("unit", "doc"))
            inner = [f"{n} [{q.unit}]" for n, q in spec.kind._fields.items() if isinstance(q, pt.Variable) and not doc]
            yield name, spec.kind.__name__, unit or ", ".join(inner), doc or "grounded if open" * spec.grounded


def _variables(kind: type[pt.Component]) -> Iterator[Row]:
    for name, spec in kind._fields.items():
        if isinstance(spec, (pt.Variable, pt.Discrete)):
            yield name, spec.unit, spec.doc


def _inner(kind: type[pt.Component], model: pt.Component | None) -> Iterator[Row]:
    """The parameters of the parts in the slots, by default or in a model, by path, without those that the whole determines."""
    from powertrain.compiler.assemble import free_parameters
    from powertrain.presets.places import places

    try:
        model = model or kind()
    except pt.PowertrainError:
        return
    found = [place for place in places(model) if place.spec is not None and "." in place.path]
    if found:
        with suppress(pt.PowertrainError):  # some parts do not stand alone
            free = free_parameters(model)
            found = [place for place in found if place.path in free]
    for place in found:
        yield _parameter(place.path, place.spec, place.value)
