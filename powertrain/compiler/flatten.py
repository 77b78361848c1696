"""From the tree of components to one list of variables, equations and laws.

Every component gets a path ('wheels[0].hub'), its quantities become symbols with that name, and its equations are read once. Connections
become equal potentials and one balance of flows per node. An unconnected port has zero flow, or the reference potential if it is a
support.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from powertrain.compiler.texts import read, residual_of
from powertrain.errors import ModelError, ParameterError
from powertrain.language.checks import checked_condition
from powertrain.language.component import Component, children, place_parts
from powertrain.language.connectors import Connector, Input, Output, Signal, declared
from powertrain.language.dimensions import measure
from powertrain.language.fields import Discrete, Parameter, Port, Quantity, Variable
from powertrain.language.law import Law
from powertrain.language.laws import Connection
from powertrain.language.recorder import Place, Recorder, reading
from powertrain.language.symbols import Symbol, free_symbols, key, time
from powertrain.language.units import with_unit


@dataclass(frozen=True)
class ModelVariable:
    """A variable of the model."""

    name: str
    symbol: Symbol
    unit: str
    doc: str
    start: float | None = None
    guess: float = 0.0
    prefer: bool = False
    flow: bool = False
    nominal: float | None = None


@dataclass(frozen=True)
class ModelConstant:
    """A parameter (tunable) or a discrete variable of the model; ``check`` rejects values outside the range.

    ``default``: the value of a parameter to which none was given; None if one must be given.
    """

    name: str
    symbol: Symbol
    unit: str
    doc: str
    value: float
    check: Callable[[float, str], float] = lambda value, where: float(value)
    default: float | None = None


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


@dataclass(frozen=True)
class ParameterCondition:
    """A condition between parameters, true or false, with its source line."""

    holds: Symbol
    place: Place


Face = tuple[str, bool]
"""A port seen from outside its component, or (True) from inside, where the component's own parts are connected to it."""


@dataclass(frozen=True)
class Flat:
    """A model without hierarchy. ``bindings``: by the keys of the parameters' symbols.

    ``given``: unknowns alone on the left of an equation, with the path of the component that states it.
    """

    recorder: Recorder = field(default_factory=Recorder)
    unknowns: dict[int, ModelVariable] = field(default_factory=dict)
    parameters: list[ModelConstant] = field(default_factory=list)
    discretes: list[ModelConstant] = field(default_factory=list)
    inputs: list[ModelVariable] = field(default_factory=list)
    loose_inputs: list[str] = field(default_factory=list)
    equations: list[Equation] = field(default_factory=list)
    initial: list[Equation] = field(default_factory=list)
    laws: list[tuple[Place, Law]] = field(default_factory=list)
    components: list[Component] = field(default_factory=list)
    bindings: dict[int, Binding] = field(default_factory=dict)
    conditions: list[ParameterCondition] = field(default_factory=list)
    nodes: list[tuple[Face, ...]] = field(default_factory=list)
    open_ports: list[tuple[Component, Connector]] = field(default_factory=list)
    given: dict[int, str] = field(default_factory=dict)


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
    guards = [replace(g, value=new(g.value), low=new(g.low), high=new(g.high)) for g in flat.recorder.guards]
    return replace(
        flat,
        recorder=replace(flat.recorder, switches=switches, relations=relations, guards=guards),
        equations=[Equation(new(e.residual), e.place) for e in flat.equations],
        initial=[Equation(new(e.residual), e.place) for e in flat.initial],
        laws=[(place, law.mapped(lambda listed: [new(e) for e in listed])) for place, law in flat.laws],
        conditions=[ParameterCondition(new(c.holds), c.place) for c in flat.conditions],
    )


def flatten(model: Component) -> Flat:
    """The flat model of ``model``; a ModelError quotes the line that cannot be read."""
    _refuse_other(model)
    flat, nodes = Flat(), _Nodes()
    root = _bind(model, "", flat)
    with reading(flat.recorder):
        for component in flat.components:
            for place, row in read(component, component.equations(), flat.recorder):
                if isinstance(row, Connection):
                    nodes.join(component, row, place)
                elif isinstance(row, Law):
                    for value in vars(row).values():
                        _check_known(flat, value, place)
                    flat.laws.append((place, row))
                else:
                    _add_equation(flat, row, place)
            for place, row in read(component, component.initial(), flat.recorder):
                flat.initial.append(Equation(_residual(flat, row, place), place))
            for place, row in read(component, component.check(), flat.recorder):
                flat.conditions.append(ParameterCondition(checked_condition(row, place), place))
        nodes.write(flat, root)
    return flat


def _refuse_other(model: object) -> None:
    """ParameterError for what is not a component."""
    if not isinstance(model, Component):
        kind = model.__name__ if isinstance(model, type) else ""
        raise ParameterError(
            f"a model is a component, not {f'the class {kind}; write {kind}(...)' if kind else repr(model)}"
        )


def _bind(component: Component, path: str, flat: Flat, above: tuple[int, ...] = ()) -> Component:
    """A copy of ``component`` whose quantities are symbols with the names of their paths."""
    if id(component) in above:
        raise ModelError(
            f"{path}: {type(component).__name__} contains itself; a component may not contain itself as a part"
        )
    bound: Component = object.__new__(type(component))
    state: dict[str, Any] = dict(component.__dict__)
    state["_path"] = path
    state["_symbols"] = {
        n: _declare(component, path, s, flat) for n, s in component._fields.items() if isinstance(s, Quantity)
    }
    bound.__dict__.update(state)
    if type(component).equations is Component.equations and not isinstance(component, Connector):
        raise ModelError(
            f"{path or 'the model'}: {type(component).__name__} is a partial class without equations; use one of its subclasses"
        )
    flat.components.append(bound)
    parts = {
        name: _bind(part, f"{path}.{name}" if path else name, flat, (*above, id(component)))
        for name, part in children(component)
    }
    place_parts(bound, parts)
    return bound


def _declare(component: Component, path: str, quantity: Quantity, flat: Flat) -> Symbol:
    name = path if isinstance(component, Signal) else f"{path}.{quantity.name}" if path else quantity.name
    unit, doc = declared(component, quantity)
    if isinstance(quantity, Variable):
        symbol = Symbol.sym(name)
        q = quantity
        flat.recorder.units[key(symbol)] = unit
        flat.unknowns[key(symbol)] = ModelVariable(
            name, symbol, unit, doc, q.start, q.guess, q.prefer, q.flow, q.nominal
        )
        return symbol
    symbol = flat.recorder.hold(name)
    flat.recorder.units[key(symbol)] = unit
    if isinstance(quantity, Parameter):
        value = component._values[quantity.name]
        flat.parameters.append(ModelConstant(name, symbol, unit, doc, value, quantity.check, quantity.default))
    elif isinstance(quantity, Discrete):
        flat.discretes.append(ModelConstant(name, symbol, unit, doc, quantity.start))
    return symbol


def _check_known(flat: Flat, expression: Any, place: Place) -> None:
    """ModelError for a symbol that no component declares."""
    for s in free_symbols(expression) if isinstance(expression, ca.SX) else ():
        k = key(s)
        if not (k in flat.unknowns or k in flat.recorder.bases or k in flat.recorder.constants or k == key(time)):
            raise ModelError(
                f"{place}: {s.name()} is not a variable of the model; declare it as a field of a component"
            )


def _add_equation(flat: Flat, row: Any, place: Place) -> None:
    residual = _residual(flat, row, place)
    _check_known(flat, residual, place)
    left, right = row.dep(0), row.dep(1)
    if not all(key(s) in flat.recorder.constants for s in free_symbols(residual)):
        flat.equations.append(Equation(residual, place))
        if left.is_symbolic():
            flat.given[key(left)] = place.path
        return
    parameters = {key(c.symbol): c for c in flat.parameters}
    own = left.is_symbolic() and left.name().rpartition(".")[0] == place.path  # the whole's own sets that of a part
    if right.is_symbolic() and (own or not left.is_symbolic()) and right.name().rpartition(".")[0] != place.path:
        left, right = right, left
    if not left.is_symbolic() or key(left) not in parameters:
        raise ModelError(
            f"{place}: only parameters may appear here; to set a parameter of a part write  self.part.name == expression"
        )
    if key(left) in flat.bindings:
        raise ModelError(f"{left.name()} is set twice\n  {flat.bindings[key(left)].place}\n  {place}")
    constant = parameters[key(left)]
    if constant.default not in (None, constant.value):
        given = f"{constant.name} = {with_unit(f'{constant.value:g}', constant.unit)}"
        raise ParameterError(
            f"{given} would have no effect, because the model sets this parameter; leave it out\n  {place}"
        )
    flat.bindings[key(left)] = Binding(constant, right, place)


def _residual(flat: Flat, row: Any, place: Place) -> Symbol:
    """Left - right of an equation. ModelError where it equates rad/s to rpm; where the kinds differ, a factor of 1 may be meant."""
    residual, sides = residual_of(row, place), (row.dep(0), row.dep(1))
    left, right = (flat.recorder.units.get(key(side), "1") if side.is_symbolic() else "1" for side in sides)
    if "1" in (left, right):
        return residual
    (size, kind), (other_size, other_kind) = measure(left), measure(right)
    if kind == other_kind and size != other_size:
        raise ModelError(
            f"{place}: the left side is in {left}, the right side in {right}; nothing is converted in an equation"
        )
    return residual


class _Nodes:
    """Sets of joined ports. A port has two faces: outward, to the surroundings of its component, and inward, for the component's parts."""

    def __init__(self) -> None:
        self.parent: dict[Face, Face] = {}
        self.ports: dict[Face, Connector] = {}
        self.places: dict[Face, Place] = {}

    def find(self, face: Face) -> Face:
        while self.parent[face] != face:
            self.parent[face] = self.parent[self.parent[face]]
            face = self.parent[face]
        return face

    def join(self, owner: Component, row: Connection, place: Place) -> None:
        own = {id(port) for _, port, _ in _ports(owner)}
        faces = [(p._path, id(p) in own) for p in row.ports]
        for face, p in zip(faces, row.ports, strict=True):
            self.ports[face] = p
            self.parent.setdefault(face, face)
            self.places.setdefault(face, place)
        for face in faces[1:]:
            self.parent[self.find(face)] = self.find(faces[0])

    def write(self, flat: Flat, root: Component) -> None:
        """Add the equations of all nodes and of all unconnected ports."""
        sets: dict[Face, list[Face]] = {}
        for face in self.ports:
            sets.setdefault(self.find(face), []).append(face)
        for faces in sets.values():
            flat.nodes.append(tuple(faces))
            self._write_node(flat, faces)
        for component in flat.components:
            for name, port, grounded in _ports(component):
                if (f"{component._path}.{name}".lstrip("."), False) not in self.ports:
                    if component is not root and not grounded and not isinstance(port, Signal):
                        flat.open_ports.append((component, port))
                    _write_unconnected(flat, port, grounded, top=component is root)

    def _write_node(self, flat: Flat, faces: list[Face]) -> None:
        first, place = self.ports[faces[0]], self.places[faces[0]]
        _check_units([self.ports[face] for face in faces], place)
        outputs = [f for f in faces if isinstance(self.ports[f], Output) and not f[1]]
        if len(outputs) > 1:
            raise ModelError(f"{place}: two outputs are connected: {' and '.join(f[0] for f in outputs)}")
        for name, quantity in first._fields.items():
            if not isinstance(quantity, Variable):
                continue
            symbols = [self.ports[face]._symbols[name] for face in faces]
            if quantity.flow:
                signed = [-s if face[1] else s for s, face in zip(symbols, faces, strict=True)]
                flat.equations.append(Equation(sum(signed[1:], signed[0]), place))
            else:
                flat.equations.extend(Equation(s - symbols[0], place) for s in symbols[1:])
        if not outputs and not any(inward and isinstance(self.ports[path, inward], Input) for path, inward in faces):
            self._write_outside(flat, [self.ports[f] for f in faces if not f[1]], place)

    def _write_outside(self, flat: Flat, ports: Sequence[Connector], place: Place) -> None:
        """An external input that is connected to other inputs gives all of them its value."""
        sources = [p for p in ports if isinstance(p, Input) and p.outside and "." in p._path]
        if len(sources) > 1:
            raise ModelError(
                f"{place}: two inputs of the model are connected: {' and '.join(p._path for p in sources)}; "
                "a signal has one source: remove the connection"
            )
        for port in sources:
            _write_unconnected_signal(flat, port, place, top=False)


def _check_units(ports: Sequence[Connector], place: Place) -> None:
    """ModelError for signals that measure different things; a signal with the unit 1, as of a block, fits any other."""
    signals = [p for p in ports if isinstance(p, Signal) and p.unit != "1"]
    for p in signals[1:]:
        if measure(p.unit) != measure(signals[0].unit):
            said = f"{signals[0]._path} [{signals[0].unit}] and {p._path} [{p.unit}]"
            raise ModelError(f"{place}: connect() joins signals of different units: {said}")


def _ports(component: Component) -> Iterator[tuple[str, Connector, bool]]:
    """The ports of a bound component with their names ("u", "u[0]"), and whether they are held at their reference unconnected."""
    for name, spec in component._fields.items():
        value = component.__dict__.get(name)
        for i, port in enumerate(value if isinstance(value, tuple) else (value,)):
            if isinstance(port, Connector):
                grounded = isinstance(spec, Port) and spec.grounded
                yield f"{name}[{i}]" if isinstance(value, tuple) else name, port, grounded


def _write_unconnected(flat: Flat, port: Connector, grounded: bool, top: bool) -> None:
    place = Place(f"{port._path} (not connected)")
    if isinstance(port, Signal):
        _write_unconnected_signal(flat, port, place, top)
        return
    for name, quantity in port._fields.items():
        if isinstance(quantity, Variable) and quantity.flow is not grounded:
            reference = port.reference if grounded else 0.0
            flat.equations.append(Equation(port._symbols[name] - reference, place))


def _given_by_whole(flat: Flat, port: Signal) -> bool:
    """Whether an equation of an enclosing component says  part.input.value == expression."""
    path, owner = flat.given.get(key(port._symbols["value"])), port._path.rpartition(".")[0]
    return path is not None and path != owner and f"{owner}.".startswith(f"{path}." if path else "")


def _write_unconnected_signal(flat: Flat, port: Signal, place: Place, top: bool) -> None:
    symbol = port._symbols["value"]
    if not isinstance(port, Input):
        return
    if not top and _given_by_whole(flat, port):
        return
    if top or port.outside:
        flat.inputs.append(ModelVariable(port._path, symbol, port.unit, port.doc, guess=port.default or 0.0))
    elif port.default is not None:
        constant = flat.recorder.hold(port._path)
        flat.parameters.append(ModelConstant(port._path, constant, port.unit, port.doc, port.default))
        flat.equations.append(Equation(symbol - constant, place))
    else:
        flat.loose_inputs.append(port._path)
