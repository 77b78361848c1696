"""Copies of components with other values, also deep inside: components are frozen."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, TypeVar

from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import by_name
from powertrain.language.component import Component, is_given

C = TypeVar("C", bound=Component)
_STEP = re.compile(r"(\w+)(?:\[(\d+)\])?(?:\.(.+))?")


def replace(component: C, changes: Mapping[str, Any] | None = None, /, **fields: Any) -> C:
    """A copy with other fields; ``changes`` may name parts of parts: ``replace(car, {"wheels[0].r": 0.3}, body=...)``."""
    if not isinstance(component, Component):
        raise ParameterError(f"replace() requires a component, not {component!r}")
    kind = type(component)
    values = {n: v for n, v in component._values.items() if is_given(component._fields[n])}
    values.update(fields)
    for path, value in by_name("changes", changes).items():
        step = _STEP.fullmatch(path)
        if step is None:
            raise ParameterError(f"{kind.__name__}: {path!r} is not a path such as J, wheels[0] or wheels[0].r")
        name, index, rest = step.groups()
        if name not in values:
            raise ParameterError(f"{kind.__name__} has no field {name}{suggestion(name, values)}")
        if index is None:
            values[name] = _changed(f"{kind.__name__}.{name}", values[name], rest, value)
            continue
        items, i = values[name], int(index)
        if not isinstance(items, tuple):
            raise ParameterError(f"{kind.__name__}.{name} is not a tuple, so there is no {name}[{i}]; write {name}")
        if i >= len(items):
            raise ParameterError(
                f"{kind.__name__}.{name} has {len(items)} members, so there is no {name}[{i}]; indices begin at 0"
            )
        values[name] = (*items[:i], _changed(f"{kind.__name__}.{name}[{i}]", items[i], rest, value), *items[i + 1 :])
    return kind(**values)


def _changed(where: str, old: Any, rest: str | None, value: Any) -> Any:
    """A new value, or a part with a new value at the rest of a path."""
    if rest is None:
        return value
    if isinstance(old, Component):
        return replace(old, {rest: value})
    hint = f"; write {where.rpartition('.')[2]}[0].{rest} for its first member" if isinstance(old, tuple) else ""
    raise ParameterError(f"{where} is {_shortly(old)}, which has no fields, so it has no {rest}{hint}")


def _shortly(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"a {type(value).__name__}"
