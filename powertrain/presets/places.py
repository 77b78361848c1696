"""The places of a model that can be set from outside, by path: parameters, parts in slots, and fields such as a layout."""

from __future__ import annotations

import difflib
import inspect
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import powertrain as pt
from powertrain.errors import suggestion
from powertrain.language.component import variants
from powertrain.language.fields import Port
from powertrain.presets.catalogue import fitting

ALIKE = 0.65
"""Likeness of two names from which one may be meant for the other."""


@dataclass(frozen=True)
class Adjustable:
    """Something that can be set: a parameter (``spec``, else None), a part, or another field; ``kind`` is what it takes, if known."""

    path: str
    spec: Any
    kind: Any
    value: Any

    @property
    def is_part(self) -> bool:
        """It holds a component."""
        return isinstance(self.value, pt.Component)

    @property
    def in_row(self) -> type[pt.Component] | None:
        """The class of the components of a row that has none, such as the trailers of a car; None for anything else."""
        kind = (typing.get_args(self.kind) or (None,))[0]
        is_row = typing.get_origin(self.kind) is tuple and isinstance(kind, type) and issubclass(kind, pt.Component)
        return kind if is_row else None


def places(component: pt.Component, path: str = "") -> Iterator[Adjustable]:
    """Everything that can be set in a component and its parts."""
    kinds = component._slot_types()
    for name, spec in component._fields.items():
        if isinstance(spec, (Port, pt.Variable, pt.Discrete)):
            continue
        value, kind, here = component._values[name], kinds.get(name), f"{path}{name}"
        if isinstance(spec, pt.Parameter):
            yield Adjustable(here, spec, float, value)
        elif isinstance(value, tuple) and any(isinstance(item, pt.Component) for item in value):
            item_kind = (typing.get_args(kind) or (None,))[0]
            for i, item in enumerate(value):
                yield from _part(f"{here}[{i}]", item_kind, item)
        elif isinstance(value, pt.Component):
            yield from _part(here, kind, value)
        else:
            yield Adjustable(here, None, kind, value)


def _part(path: str, kind: Any, value: pt.Component) -> Iterator[Adjustable]:
    yield Adjustable(path, None, kind, value)
    yield from places(value, f"{path}.")


def place(component: pt.Component, path: str) -> Adjustable:
    """The place of a path. Errors: ParameterError for an unknown one, with those that are like it."""
    known = {found.path: found for found in places(component)}
    if path not in known:
        if _is_variable(component, path, known):
            raise pt.ParameterError(
                f"{type(component).__name__}.{path} is a variable, not a parameter; its value at the start of a run is given by "
                f"powertrain run --start {path}=VALUE, and by drive_cycle(..., starts={{{path!r}: VALUE}}) in Python"
            )
        near = (_others(path, known) or _near(path, known) or _beside(path, known)) + _makers(path, known)
        raise pt.ParameterError(f"{type(component).__name__} has no parameter or component {path!r}{near}")
    return known[path]


def _is_variable(component: pt.Component, path: str, known: Mapping[str, Adjustable]) -> bool:
    """Whether a path leads to a variable of the component or of one of its parts."""
    inside, _, name = path.rpartition(".")
    owner = known[inside].value if inside in known else None if inside else component
    return isinstance(owner, pt.Component) and isinstance(owner._fields.get(name), pt.Variable | pt.Discrete)


def _others(path: str, known: Mapping[str, Adjustable]) -> str:
    """The other classes of the slot in which a path leaves the known ones that have what it asks for."""
    names = path.split(".")
    depth = max((k for k in range(1, len(names)) if ".".join(names[:k]) in known), default=0)
    inside, name = ".".join(names[:depth]), names[depth].partition("[")[0]
    if not depth or not known[inside].is_part or name in known[inside].value._fields:
        return ""
    has = [entry.name for entry in fitting(known[inside].kind) if name in entry.kind._fields]
    now = type(known[inside].value).__name__
    return f"; {name} belongs to {' and '.join(has)}, but {inside} is of class {now}" if has else ""


def _near(path: str, known: Mapping[str, Adjustable]) -> str:
    """What an unknown path may mean: near misses within the part that it leads into, or fields of that name elsewhere."""
    inside, _, name = path.rpartition(".")
    if inside and inside not in known:
        return suggestion(path, known)
    start = f"{inside}." if inside else ""
    own = {k[len(start) :]: k for k in known if k.startswith(start) and not {".", "["} & set(k[len(start) :])}
    if said := suggestion(name, (), {k: known[k].spec for k in own.values()}):
        return said
    near = [k for k in known if k.rpartition(".")[2] == name]
    near += [own[k] for k in difflib.get_close_matches(name, own, n=3, cutoff=ALIKE)]
    return f"; did you mean {' or '.join(near[:3])}?" if near else ""


def _beside(path: str, known: Iterable[str]) -> str:
    """'; choose from ...' with the names where the path leaves the known ones."""
    inside, known = path.rpartition(".")[0], list(known)
    while inside and inside not in known:
        inside = inside.rpartition(".")[0]
    start = f"{inside}." if inside else ""
    names = [k for k in known if k.startswith(start) and not {".", "["} & set(k[len(start) :])]
    return f"; choose from {', '.join(names)}" if names else ""


def _makers(path: str, known: Mapping[str, Adjustable]) -> str:
    """What else makes the part that an unknown path leads into: its variants, which may have an argument of that name."""
    inside, _, name = path.rpartition(".")
    if inside not in known or not known[inside].is_part:
        return ""
    kind = type(known[inside].value)
    takes = [maker for maker in variants(kind) if name in inspect.signature(getattr(kind, maker)).parameters]
    return "".join(f"; {inside} = {kind.__name__}.{maker}(...) takes {name}" for maker in takes)
