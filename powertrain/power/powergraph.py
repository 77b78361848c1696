"""The components and connections of a model as a graph on which power flows, found from the connections of any topology."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from powertrain.analysis.energy_terms import Part
from powertrain.compiler.flat import Face
from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import names, text
from powertrain.signals import fits_pattern


@dataclass(frozen=True)
class Terminal:
    """A port at which a component meets a node; the indices of both."""

    port: str
    component: int
    node: int


@dataclass(frozen=True)
class PowerGraph:
    """Components, the connections (nodes) between them, and the terminals where they meet.

    A composite is resolved into its parts, unless it is treated as one. ``members``: for every component, the parts of the model whose
    losses, sources and storages count as its own.
    """

    components: tuple[str, ...]
    members: tuple[tuple[int, ...], ...]
    nodes: tuple[str, ...]
    terminals: tuple[Terminal, ...]

    def component(self, name: str) -> int:
        """The index of a component. ParameterError if the graph has none of that name."""
        if text("component", name) not in self.components:
            known = ", ".join(self.components)
            raise ParameterError(
                f"the power flow has no component {name}{suggestion(name, self.components)} (components: {known})"
            )
        return self.components.index(name)

    def at_node(self, node: int) -> list[int]:
        """The indices of the terminals that meet at a node."""
        return [k for k, terminal in enumerate(self.terminals) if terminal.node == node]

    def of_component(self, component: int) -> list[int]:
        """The indices of the terminals of a component."""
        return [k for k, terminal in enumerate(self.terminals) if terminal.component == component]


def power_graph(
    connections: Sequence[Sequence[Face]], parts: Sequence[Part], ports: Sequence[str], whole: str | Sequence[str] = ()
) -> PowerGraph:
    """The graph of a model. ``ports`` carry power; composites that match a pattern in ``whole`` are treated as one."""
    patterns = names("whole", whole)
    for pattern in patterns:
        if not any(part.path and fits_pattern(part.path, pattern) for part in parts):
            raise ParameterError(f"whole: no component matches {pattern}{suggestion(pattern, [p.path for p in parts])}")
    shown = [_shown(part.path, patterns) for part in parts]
    joined, inward = _joined(connections, {path for path in shown if any(fits_pattern(path, p) for p in patterns)})
    owners = {ports[k]: part.path for part in parts for k in part.ports}
    outer = [name for name in ports if (name, True) not in inward and (name, False) in joined]
    at_node = _collected((joined[name, False], name) for name in outer)
    nodes = {root: there for root, there in at_node.items() if len(there) > 1}
    standing = {owners[name] for there in nodes.values() for name in there}
    components = [path for path in dict.fromkeys(shown) if path in standing]
    names_of = _collected((root, name) for (name, _), root in joined.items())
    return PowerGraph(
        tuple(components),
        tuple(tuple(i for i, path in enumerate(shown) if path == c) for c in components),
        tuple(min(names_of[root], key=lambda name: (name.count("."), (name, True) not in inward)) for root in nodes),
        tuple(
            Terminal(name, components.index(owners[name]), n)
            for n, there in enumerate(nodes.values())
            for name in there
        ),
    )


def _collected(pairs: Iterable[tuple[Face, str]]) -> dict[Face, list[str]]:
    """The names of every face, in their order."""
    found: dict[Face, list[str]] = {}
    for face, name in pairs:
        found.setdefault(face, []).append(name)
    return found


def _shown(path: str, patterns: Sequence[str]) -> str:
    """The outermost composite treated as one that contains a component, or the component itself."""
    names = path.split(".")
    for i in range(1, len(names)):
        outer = ".".join(names[:i])
        if any(fits_pattern(outer, pattern) for pattern in patterns):
            return outer
    return path


def _joined(nodes: Sequence[Sequence[Face]], closed: set[str]) -> tuple[dict[Face, Face], set[Face]]:
    """For every face the representative of its node, and the inner faces; both faces of a resolved composite's port are in one node.

    ParameterError if a connection reaches into a ``closed`` composite.
    """
    parent: dict[Face, Face] = {}

    def find(face: Face) -> Face:
        while parent.setdefault(face, face) != face:
            face = parent[face]
        return face

    inward: set[Face] = set()
    for faces in nodes:
        inside = [next((c for c in closed if f"{owner}.".startswith(f"{c}.")), "") for owner in map(_inside_of, faces)]
        seen = [face for face, c in zip(faces, inside, strict=True) if not c]
        for (name, _), c in zip(faces, inside, strict=True):
            if c and seen:
                raise ParameterError(
                    f"whole: {c} cannot be treated as one, because {seen[0][0]} is connected to {name} inside it; "
                    f"connect {seen[0][0]} to a port of {c}"
                )
        for face in seen:
            parent[find(face)] = find(seen[0])
            if face[1]:
                inward.add(face)
                parent[find((face[0], False))] = find(face)
    return {face: find(face) for face in list(parent)}, inward


def _inside_of(face: Face) -> str:
    """The composite from whose inside a face is seen."""
    owner = face[0].rpartition(".")[0]
    return owner if face[1] else owner.rpartition(".")[0]
