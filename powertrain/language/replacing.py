"""Copies of components with other values, also deep inside: components are frozen."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, TypeVar

from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import by_name
from powertrain.language.component import Component, bound_copy
from powertrain.language.fields import Parameter, is_given
from powertrain.language.recorder import recorder, recording
from powertrain.language.symbols import Symbol

C = TypeVar("C", bound=Component)
_STEP = re.compile(r"(\w+)(?:\[(\d+)\])?(?:\.(.+))?")


def replace(component: C, changes: Mapping[str, Any] | None = None, /, **fields: Any) -> C:
    """A copy with other fields; ``changes`` may name parts of parts: ``replace(car, {"wheels[0].r": 0.3}, body=...)``.

    What changes in one part changes at once, so that conditions between its parameters are those of all new values. Within
    ``equations()`` the copy has the values of the model as it is built; ``result.notes`` says where a run has others.
    """
    if not isinstance(component, Component):
        raise ParameterError(f"replace() requires a component, not {component!r}")
    kind = type(component)
    values = {n: v for n, v in component._values.items() if is_given(component._fields[n])}
    inside: dict[tuple[str, str | None], dict[str, Any]] = {}
    for path, value in {**fields, **by_name("changes", changes)}.items():
        name, index, rest = _step(kind, path, values)
        if rest is not None:
            inside.setdefault((name, index), {})[rest] = value
            continue
        inside = {
            place: within for place, within in inside.items() if place != (name, index) and (index or place[0] != name)
        }
        values[name] = value if index is None else _with_member(kind, name, int(index), values[name], value)
    for (name, index), within in inside.items():
        where = f"{kind.__name__}.{name}"
        if index is None:
            values[name] = _changed(where, values[name], within)
        else:
            old = _member(kind, name, int(index), values[name])
            new = _changed(f"{where}[{index}]", old, within)
            values[name] = _with_member(kind, name, int(index), values[name], new)
    made = kind(**values)
    bound = recording() and "_symbols" in component.__dict__
    if not bound:
        return made
    evaluated = recorder().evaluated
    return bound_copy(made, component._path, lambda part: _Values(part, evaluated))


class _Values(dict[str, Symbol]):
    """The values of a component's parameters; ``names`` gets those that are read."""

    def __init__(self, component: Component, names: set[str]) -> None:
        parameters = [name for name, spec in component._fields.items() if isinstance(spec, Parameter)]
        super().__init__({name: Symbol(component._values[name]) for name in parameters})
        self.path, self.names = component._path, names

    def __getitem__(self, name: str) -> Symbol:
        self.names.add(f"{self.path}.{name}" if self.path else name)
        return super().__getitem__(name)


def _step(kind: type[Component], path: str, known: Mapping[str, Any]) -> tuple[str, str | None, str | None]:
    """The field that a path begins with, the index of its member, and the path within it."""
    step = _STEP.fullmatch(path)
    if step is None:
        raise ParameterError(f"{kind.__name__}: {path!r} is not a path such as J, wheels[0] or wheels[0].r")
    name, index, rest = step.groups()
    given = isinstance(getattr(kind, name, None), property)  # the constructor may take what it keeps in several fields
    if name not in known and not given:
        inside = [
            f"{part}.{name}" for part, value in known.items() if isinstance(value, Component) and name in value._fields
        ]
        near = f"; did you mean {' or '.join(inside)}?" if inside else suggestion(name, known, kind._fields)
        near = near or f" (its fields: {', '.join(known)})"
        raise ParameterError(f"{kind.__name__} has no field {name}{near}")
    return name, index, rest


def _member(kind: type[Component], name: str, i: int, items: Any) -> Any:
    if not isinstance(items, tuple):
        raise ParameterError(f"{kind.__name__}.{name} is not a tuple, so there is no {name}[{i}]; write {name}")
    if i >= len(items):
        raise ParameterError(
            f"{kind.__name__}.{name} has {len(items)} members, so there is no {name}[{i}]; indices begin at 0"
        )
    return items[i]


def _with_member(kind: type[Component], name: str, i: int, items: Any, value: Any) -> tuple[Any, ...]:
    _member(kind, name, i, items)
    return (*items[:i], value, *items[i + 1 :])


def _changed(where: str, old: Any, within: dict[str, Any]) -> Any:
    """A part with new values at paths within it."""
    if isinstance(old, Component):
        return replace(old, within)
    rest = next(iter(within))
    hint = f"; write {where.rpartition('.')[2]}[0].{rest} for its first member" if isinstance(old, tuple) else ""
    raise ParameterError(f"{where} is {_shortly(old)}, which has no fields, so it has no {rest}{hint}")


def _shortly(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"a {type(value).__name__}"
