"""The catalogue of components and vehicles, found by walking the packages."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import typing
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import powertrain as pt
from powertrain.errors import suggestion
from powertrain.language.connectors import Connector
from powertrain.presets.ordinary import ordinary

NO_PARTS = {"figures", "animation"}
"""Modules without components of their own, which need not be imported."""


@dataclass(frozen=True)
class Entry:
    """A final component class with its family: the package or module below ``components`` or ``vehicles``."""

    kind: type[pt.Component]
    family: str

    @property
    def name(self) -> str:
        """The name of the class."""
        return self.kind.__name__

    @property
    def full_name(self) -> str:
        """With the family, where the name alone is not enough: rotational.Fixed."""
        return f"{self.family}.{self.name}"


@cache
def components() -> tuple[Entry, ...]:
    """The parts of the library."""
    import powertrain.components as package

    return tuple(_entries(package, "powertrain.components"))


@cache
def assembled() -> tuple[Entry, ...]:
    """The models put together from parts: vehicles and the benches of trials and designs."""
    from powertrain import design, trials

    return (*vehicles(), *_entries(design, "powertrain"), *_entries(trials, "powertrain"))


@cache
def vehicles() -> tuple[Entry, ...]:
    """The models of whole vehicles, which need none of the benches of trials and designs."""
    import powertrain.vehicles as package

    return tuple(_entries(package, "powertrain.vehicles"))


def is_vehicle(kind: type[pt.Component]) -> bool:
    """It has a slot for a body."""
    from powertrain.components.body import Body

    types = (kind._slot_types().get(slot) for slot in kind._fields)
    return any(isinstance(given, type) and issubclass(given, Body) for given in types)


def fitting(kind: object) -> list[Entry]:
    """The components that a slot of this kind takes."""
    kinds = tuple(each for each in (typing.get_args(kind) or (kind,)) if isinstance(each, type))
    return [entry for entry in components() if issubclass(entry.kind, kinds)] if kinds else []


def find(name: str, among: Iterable[Entry], what: str) -> Entry:
    """The entry of a name; case, spaces, - and _ do not matter. Errors: ParameterError for an unknown and for an ambiguous name."""
    entries = list(among)
    wanted = _plain(name)
    found = [
        e for e in entries if wanted in (_plain(e.name), _plain(e.full_name), _plain(e.kind.__module__ + "." + e.name))
    ]
    found = [e for e in found if e.name == name] or found
    if len(found) == 1:
        return found[0]
    if found:
        raise pt.ParameterError(f"{name} is ambiguous: {', '.join(e.full_name for e in found)}")
    called = [kind for kind in ordinary(name) if any(e.name == kind for e in entries)]
    near = f"; see {', '.join(called)}" if called else suggestion(name, [e.name for e in entries])
    few = "" if len(entries) > 25 else f"; choose from {', '.join(e.name for e in entries)}"
    raise pt.ParameterError(f"unknown {what} {name!r}{near}{few}")


def name_in(slot: object, kind: type[pt.Component]) -> str:
    """The name by which ``find`` finds a class among those of a slot: with its family where others are called the same."""
    alike = [entry for entry in fitting(slot) if entry.name == kind.__name__]
    return next((entry.full_name for entry in alike if entry.kind is kind and len(alike) > 1), kind.__name__)


def is_named(kind: type[pt.Component], name: str) -> bool:
    """Whether a name is that of the class, as ``find`` compares them."""
    return _plain(name) == _plain(kind.__name__)


def _plain(name: str) -> str:
    return name.lower().replace("-", "").replace("_", "").replace(" ", "")


def _entries(package: ModuleType, root: str) -> Iterator[Entry]:
    """The final components of a package; their families are named from below ``root``."""
    for module in sorted(_modules(package), key=lambda module: module.__name__):
        path = module.__name__.removeprefix(f"{root}.").split(".")
        family = ".".join(path[:-1]) or path[0]
        for kind in vars(module).values():
            if _is_final(kind) and kind.__module__ == module.__name__:
                yield Entry(kind, family if not hasattr(module, "__path__") else ".".join(path))


def _modules(package: ModuleType) -> Iterator[ModuleType]:
    for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        if found.name.rpartition(".")[2] not in NO_PARTS:
            module = importlib.import_module(found.name)
            yield module
            if found.ispkg:
                yield from _modules(module)


def _is_final(kind: object) -> bool:
    return (
        inspect.isclass(kind)
        and issubclass(kind, pt.Component)
        and not issubclass(kind, Connector)
        and not kind.__name__.startswith("_")
        and kind.equations is not pt.Component.equations
    )
