"""What is recorded while the equations of a model are read: derivatives, switches, schedules, guards, and the line being read."""

from __future__ import annotations

import linecache
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from types import GeneratorType
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ModelError
from powertrain.language.symbols import Symbol, key, time

L = TypeVar("L")


@dataclass(frozen=True)
class Place:
    """The path of a component and a line of its source, which is read only when an error quotes it."""

    path: str
    file: str = ""
    line: int = 0

    def __str__(self) -> str:
        text = linecache.getline(self.file, self.line).strip()
        short = self.file.replace("\\", "/").rsplit("/", 1)[-1]
        return f"{self.path or 'the model'}: {text} ({short}:{self.line})" if text else (self.path or "the model")


@dataclass(frozen=True)
class SwitchEntry:
    """A declared piecewise expression: ``mode`` is 1 while ``g`` > 0."""

    mode: Symbol
    g: Symbol
    place: Place
    continuous: bool
    condition: Symbol = field(default_factory=Symbol)


@dataclass(frozen=True)
class ScheduleEntry:
    """A piecewise linear signal of time, as the held symbols (t0, y0, slope) of its running segment."""

    held: tuple[Symbol, Symbol, Symbol]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    place: Place


@dataclass(frozen=True)
class Guard:
    """low <= value <= high; ``action`` "error" ends the simulation, "count" counts the accepted steps outside the limits.

    "start" holds for the values of a start alone. ``where``: the line that says so.
    """

    name: str
    where: Place | str
    value: Symbol
    low: Symbol
    high: Symbol
    unit: str
    action: str


def place_in(text: Any, path: str) -> Place:
    """The line at which a generator is: in the innermost method, not in a function that several classes share."""
    # CPython 3.11 may crash where it is asked what a running generator yields from.
    while isinstance(text, GeneratorType) and not text.gi_running and _is_method(text.gi_yieldfrom):
        text = text.gi_yieldfrom
    frame = text.gi_frame if isinstance(text, GeneratorType) else None
    return Place(path, frame.f_code.co_filename, frame.f_lineno) if frame else Place(path)


def _is_method(text: Any) -> bool:
    return isinstance(text, GeneratorType) and text.gi_code.co_varnames[:1] == ("self",)


@dataclass
class Recorder:
    """Collects what the equations declare while they are read."""

    path: str = ""
    text: Generator[Any, None, None] | None = None
    derivatives: dict[int, Symbol] = field(default_factory=dict)
    bases: dict[int, tuple[Symbol, int]] = field(default_factory=dict)
    constants: set[int] = field(default_factory=set)
    switches: list[SwitchEntry] = field(default_factory=list)
    relations: list[SwitchEntry] = field(default_factory=list)
    """The comparisons that the conditions of ``when`` combine."""
    schedules: list[ScheduleEntry] = field(default_factory=list)
    guards: list[Guard] = field(default_factory=list)
    units: dict[int, str] = field(default_factory=dict)
    """Of variables, parameters and results of maps, by their keys."""
    results: list[Symbol] = field(default_factory=list)
    """The results of maps, which keep their keys as long as they exist."""
    differentiated: list[tuple[Place, Symbol]] = field(default_factory=list)
    """Expressions that ``der`` was asked of."""
    evaluated: set[str] = field(default_factory=set)
    """Parameters whose values are used while the equations are read, as for the table of a control."""
    written: list[tuple[Place, str, Any]] = field(default_factory=list)
    """Laws that were written and not yielded yet, with the word of each."""

    @property
    def place(self) -> Place:
        """The line that is being read."""
        return place_in(self.text, self.path)

    def yielded(self, law: Any) -> None:
        """Note that a law has become part of the model."""
        self.written = [one for one in self.written if one[2] is not law]

    def measured(self, result: Symbol, unit: str) -> None:
        """Note the unit of the result of a map."""
        self.results.append(result)
        self.units[key(result)] = unit

    def derivative(self, symbol: Symbol) -> Symbol:
        """The symbol of d/dt of a symbol; 1 for time, 0 for parameters and held values."""
        k = key(symbol)
        if k == key(time):
            return Symbol(1)
        if k in self.constants:
            return Symbol(0)
        if k not in self.derivatives:
            rate = Symbol.sym(f"der({symbol.name()})")
            base, order = self.bases.get(k, (symbol, 0))
            self.derivatives[k], self.bases[key(rate)] = rate, (base, order + 1)
        return self.derivatives[k]

    def hold(self, name: str) -> Symbol:
        """A new symbol whose value changes at events only."""
        symbol = Symbol.sym(name)
        self.constants.add(key(symbol))
        return symbol


_active: ContextVar[Recorder | None] = ContextVar("recorder", default=None)


@contextmanager
def reading(active: Recorder) -> Iterator[Recorder]:
    """Makes ``active`` the recorder that ``der``, ``switch`` and the like write to."""
    token = _active.set(active)
    try:
        yield active
    finally:
        _active.reset(token)


def recorder() -> Recorder:
    """The recorder of the model being read; ModelError outside equations()."""
    active = _active.get()
    if active is None:
        raise ModelError("der, switch, schedule and tables can only be used inside equations() or initial()")
    return active


def recording() -> bool:
    """Whether the equations of a model are being read."""
    return _active.get() is not None


def to_be_yielded(word: str, law: L) -> L:
    """A law that counts only once the component yields it."""
    if (active := _active.get()) is not None:
        active.written.append((active.place, word, law))
    return law


_as_float = ca.SX.__float__


def _number(symbol: Symbol) -> float:
    """The number of a constant expression. CasADi gives nan for a symbol; within equations that is an error."""
    active = _active.get()
    if active is not None and not symbol.is_constant():
        raise ModelError(
            f"{active.place}\n  a symbol has no value while the equations are read, so float(), int() or math.sin() "
            "cannot be applied to it: use casadi's functions (casadi.sin, casadi.fmax), and switch(condition, a, b) instead of a Python if"
        )
    return float(_as_float(symbol))


ca.SX.__float__ = _number  # type: ignore[method-assign]
_as_int = ca.SX.__int__


def _whole_number(symbol: Symbol) -> int:
    """The whole number of a constant expression; within equations a symbol is an error."""
    _number(symbol)
    return int(_as_int(symbol))


ca.SX.__int__ = _whole_number  # type: ignore[method-assign]
