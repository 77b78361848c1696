"""Connections: ports that are joined have equal potentials and one balance of flows per node.

An unconnected port has zero flow, or the reference potential if it is a support.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from powertrain.compiler.flat import Equation, Face, Flat, ModelConstant, ModelInput
from powertrain.errors import ModelError
from powertrain.language.component import Component
from powertrain.language.connectors import Connector, Input, Output, Signal
from powertrain.language.dimensions import measure
from powertrain.language.fields import Port, Variable
from powertrain.language.laws import Connection
from powertrain.language.recorder import Place
from powertrain.language.symbols import key


class Nodes:
    """Sets of joined ports. A port has two faces: outward, to the surroundings of its component, and inward, for the component's parts."""

    def __init__(self) -> None:
        self.parent: dict[Face, Face] = {}
        self.ports: dict[Face, Connector] = {}
        self.places: dict[Face, Place] = {}

    def find(self, face: Face) -> Face:
        """The face that stands for all that are joined with this one."""
        while self.parent[face] != face:
            self.parent[face] = self.parent[self.parent[face]]
            face = self.parent[face]
        return face

    def join(self, owner: Component, row: Connection, place: Place) -> None:
        """Join the ports of a connection that ``owner`` states."""
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
        value, declared = port.default or 0.0, port.default is not None
        flat.inputs.append(ModelInput(port._path, symbol, port.unit, port.doc, value, declared))
    elif port.default is not None:
        constant = flat.recorder.hold(port._path)
        flat.parameters.append(ModelConstant(port._path, constant, port.unit, port.doc, port.default))
        flat.equations.append(Equation(symbol - constant, place))
    else:
        flat.loose_inputs.append(port._path)
