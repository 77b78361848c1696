"""A model without hierarchy: one list each of variables, parameters, equations and laws."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from powertrain.language.component import Component
from powertrain.language.connectors import Connector
from powertrain.language.law import Law
from powertrain.language.recorder import Guard, Place, Recorder, reading
from powertrain.language.symbols import Symbol, mapped


@dataclass(frozen=True)
class ModelVariable:
    """A variable of the model."""

    name: str
    symbol: Symbol
    unit: str
    doc: str
    start: float | None = None
    guess: float | None = None
    prefer: bool = False
    flow: bool = False
    nominal: float | None = None


@dataclass(frozen=True)
class ModelInput:
    """A signal that comes from outside the model, with the value that it has unless another is given.

    ``declared``: whether the component declares that value; it is zero otherwise.
    """

    name: str
    symbol: Symbol
    unit: str
    doc: str
    value: float
    declared: bool


@dataclass(frozen=True)
class ModelConstant:
    """A parameter (tunable) or a discrete variable of the model; ``check`` rejects values outside the range.

    ``default``: the value of a parameter to which none was given; None if one must be given. ``low`` and ``high``: the ends of the range.
    """

    name: str
    symbol: Symbol
    unit: str
    doc: str
    value: float
    check: Callable[[float, str], float] = lambda value, where: float(value)
    default: float | None = None
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True)
class Equation:
    """residual == 0, with its source line."""

    residual: Symbol
    place: Place


@dataclass(frozen=True)
class Binding:
    """A parameter that the enclosing model sets to ``value``, with the source line."""

    constant: ModelConstant
    value: Symbol
    place: Place


Face = tuple[str, bool]
"""A port seen from outside its component, or (True) from inside, where the component's own parts are connected to it."""


@dataclass(frozen=True)
class Flat:
    """A model without hierarchy, and its ``components``, each before its parts, whose quantities are symbols.

    ``bindings``: by the keys of the parameters' symbols. ``nodes``: the ports that meet in each node. ``given``: unknowns alone on the left
    of an equation, with the path of the component that states it.
    """

    recorder: Recorder = field(default_factory=Recorder)
    unknowns: dict[int, ModelVariable] = field(default_factory=dict)
    parameters: list[ModelConstant] = field(default_factory=list)
    discretes: list[ModelConstant] = field(default_factory=list)
    inputs: list[ModelInput] = field(default_factory=list)
    loose_inputs: list[str] = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    initial: list[Equation] = field(default_factory=list)
    laws: list[tuple[Place, Law]] = field(default_factory=list)
    components: list[Component] = field(default_factory=list)
    bindings: dict[int, Binding] = field(default_factory=dict)
    conditions: list[Guard] = field(default_factory=list)
    nodes: list[tuple[Face, ...]] = field(default_factory=list)
    open_ports: list[tuple[Component, Connector]] = field(default_factory=list)
    given: dict[int, str] = field(default_factory=dict)

    def lines(self) -> Iterator[tuple[Place, Symbol]]:
        """Every expression that is integrated, solved or monitored for events, with its source line."""
        yield from ((e.place, e.residual) for e in self.equations)
        yield from ((place, v) for place, law in self.laws for v in vars(law).values() if isinstance(v, Symbol))
        yield from ((s.place, s.g) for s in (*self.recorder.switches, *self.recorder.relations))

    @property
    def model(self) -> Component:
        """The model, whose variables and those of its parts are symbols."""
        return self.components[0]

    @contextmanager
    def reading(self, path: str) -> Iterator[Recorder]:
        """Allows ``der`` and laws in expressions of the components' variables; what they declare is recorded apart."""
        with reading(replace(self.recorder, path=path, text=None, switches=[], schedules=[], guards=[])) as apart:
            yield apart


def rewritten(flat: Flat, change: Callable[[list[Symbol]], Sequence[Symbol]]) -> Flat:
    """The same model with all expressions changed."""
    old: list[Symbol] = []

    def collect(expression: Symbol) -> Symbol:
        old.append(expression)
        return expression

    _with_each(flat, collect)
    new = iter(change(old))
    return _with_each(flat, lambda _: next(new))


def _with_each(flat: Flat, new: Callable[[Symbol], Symbol]) -> Flat:
    switches = [replace(s, g=new(s.g)) for s in flat.recorder.switches]
    relations = [replace(r, g=new(r.g)) for r in flat.recorder.relations]

    def each(listed: list[Symbol]) -> list[Symbol]:
        return [new(e) for e in listed]

    guards, conditions = ([mapped(g, each) for g in listed] for listed in (flat.recorder.guards, flat.conditions))
    return replace(
        flat,
        recorder=replace(flat.recorder, switches=switches, relations=relations, guards=guards),
        equations=[Equation(new(e.residual), e.place) for e in flat.equations],
        initial=[Equation(new(e.residual), e.place) for e in flat.initial],
        laws=[(place, law.mapped(each)) for place, law in flat.laws],
        conditions=conditions,
    )
