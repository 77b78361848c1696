"""Where the components of a model stand in a schematic, and the lines between their ports.

Shafts lead from left to right; components that only exchange signals stand below. What is inside a component is laid out with the
component alone, as in ``layout(car.transmission)``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from powertrain.compiler.flatten import flatten
from powertrain.errors import ParameterError
from powertrain.language.component import Component
from powertrain.language.connectors import Connector, Output, Signal
from powertrain.language.fields import Variable

LINES = {
    "N.m": ("rotation", "#2f6fa8"),
    "N": ("translation", "#4b8f4b"),
    "A": ("electric", "#d9822b"),
}
"""What the unit of a connector's flow says about a line: its name and colour. Heat is not drawn."""
BOX, HIGH, GAP, ROW = 2.0, 0.72, 0.45, 1.25
"""Width and height of a component's box, free space between columns, distance of rows."""
_SWEEPS = 24


@dataclass
class Vertex:
    """A component, a port of the whole, or (without a title) a junction of three lines and more.

    ``source``: power comes from there; ``moves``: it has a translational port; ``near``: what lines lead to; ``x``, ``y``: its middle.
    """

    title: str
    kind: str = ""
    source: bool = False
    moves: bool = False
    near: list[int] = field(default_factory=list)
    column: int = -1
    x: float = 0.0
    y: float = 0.0

    @property
    def width(self) -> float:
        """Zero for a junction."""
        return BOX if self.title else 0.0


@dataclass(frozen=True)
class Line:
    """A line from vertex ``a`` to vertex ``b``, with the unit of its flow.

    The power from ``a`` to ``b`` is ``sign`` times the sum of the powers into the components at ``ports``.
    """

    a: int
    b: int
    unit: str
    ports: tuple[str, ...]
    sign: float


@dataclass
class Layout:
    """Vertices with their places, lines, signals (from, to), and the vertices that are shown."""

    vertices: list[Vertex]
    lines: list[Line]
    signals: list[tuple[int, int]]
    shown: list[Vertex] = field(default_factory=list)

    @property
    def limits(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper end of the drawing with a margin."""
        (left, right), (low, high) = ([f(getattr(v, side) for v in self.shown) for f in (min, max)] for side in "xy")
        return left - 0.6 * BOX, right + 0.6 * BOX, low - 1.1 * ROW, high + 0.6 * ROW


def layout(model: Component, *, signals: bool = True) -> Layout:
    """Places for the components of a model and lines for their connections.

    Errors: ParameterError for a model without connected components, ModelError if the model is wrong.
    """
    found = _structure(model)
    if not signals:
        found.signals.clear()
    shafts = [k for k, vertex in enumerate(found.vertices) if vertex.near]
    below = sorted({k for pair in found.signals for k in pair} - set(shafts))
    _place_shafts(found.vertices, shafts)
    _place_below(found, shafts, below)
    found.shown = [found.vertices[k] for k in (*shafts, *below)]
    if not found.shown:
        raise ParameterError(f"{type(model).__name__} has no connected parts: there is nothing to draw")
    return found


def _structure(model: Component) -> Layout:
    flat = flatten(model)
    parts = {c._path: c for c in flat.components[1:] if not isinstance(c, Connector) and "." not in c._path}
    ports = {c._path: c for c in flat.components if isinstance(c, Connector)}
    found = Layout([Vertex(path, type(part).__name__, part.boundary) for path, part in parts.items()], [], [])
    numbers = {path: k for k, path in enumerate(parts)}
    for faces in flat.nodes:
        if not all((path.count(".") == 0) if inner else ("." in path) for path, inner in faces):
            continue  # inside of a part
        if not any(path.count(".") < 2 for path, _ in faces):
            continue
        ends = []
        for path, inner in faces:
            name = path if inner else path.partition(".")[0]
            if name not in numbers:
                numbers[name] = len(found.vertices)
                found.vertices.append(Vertex(name, "port"))
            ends.append((numbers[name], path))
        if isinstance(ports[faces[0][0]], Signal):
            gives = [isinstance(ports[path], Output) is not inner for path, inner in faces]
            _add_signals(found, [k for k, _ in ends], gives)
        else:
            _join(found, ports[faces[0][0]], ends)
    return found


def _add_signals(found: Layout, ends: Sequence[int], gives: Sequence[bool]) -> None:
    """Adds the signals from the vertices that give them to the others of a node."""
    sources, targets = ({k for k, given in zip(ends, gives, strict=True) if given is way} for way in (True, False))
    found.signals += [(a, b) for a in sources for b in targets if a != b and (a, b) not in found.signals]


def _join(found: Layout, port: Connector, ends: Sequence[tuple[int, str]]) -> None:
    """Adds the lines of a node between the vertices at its ``ends``, whose ports are given by their paths."""
    unit = next(q.unit for q in port._fields.values() if isinstance(q, Variable) and q.flow)
    joined = list(dict.fromkeys(k for k, _ in ends))
    if unit not in LINES or len(joined) < 2:
        return
    if len(joined) == 2:
        pairs = [(joined[0], joined[1])]
    else:
        found.vertices.append(Vertex(""))
        pairs = [(k, len(found.vertices) - 1) for k in joined]
    for a, b in pairs:
        ports = tuple(path for k, path in ends if k == a)
        found.lines.append(Line(a, b, unit, ports, 1.0 if found.vertices[a].kind == "port" else -1.0))
        for vertex, neighbour in ((found.vertices[a], b), (found.vertices[b], a)):
            vertex.near.append(neighbour)
            vertex.moves |= unit == "N"


def _place_shafts(vertices: list[Vertex], shafts: Sequence[int]) -> None:
    """Columns by the distance from one end of the longest chain; rows by what stands beside."""
    row = 0.0
    left = set(shafts)
    while left:
        connected = list(_distances(vertices, min(left)))
        layers = _layers(vertices, connected)
        _order(vertices, layers)
        highest, lowest = (f(vertices[k].y for k in connected) for f in (max, min))
        for k in connected:
            vertices[k].y += row - highest
        row -= highest - lowest + ROW
        left -= set(connected)


def _layers(vertices: list[Vertex], connected: Iterable[int]) -> list[list[int]]:
    """The vertices by column, beginning at the power source of the longest chain, or at the end declared first.

    The order is reversed if only this end is on the road.
    """
    from_any = _distances(vertices, min(connected))
    one = max(from_any, key=from_any.__getitem__)
    far = _distances(vertices, one)
    other = max(far, key=far.__getitem__)
    start, end = sorted((one, other), key=lambda k: (not vertices[k].source, k))
    distances = _distances(vertices, start)
    layers: list[list[int]] = [[] for _ in range(max(distances.values()) + 1)]
    for k, column in distances.items():
        layers[column].append(k)
        vertices[k].column = column
    x = 0.0
    for layer in layers:
        width = max(vertices[k].width for k in layer)
        for k in layer:
            vertices[k].x = x + width / 2
        x += width + GAP
    if vertices[start].moves and not vertices[end].moves:
        for k in distances:
            vertices[k].x = x - GAP - vertices[k].x
    return layers


def _distances(vertices: list[Vertex], start: int) -> dict[int, int]:
    """Steps from a vertex to all that can be reached."""
    distances, front = {start: 0}, [start]
    while front:
        k = front.pop(0)
        for other in vertices[k].near:
            if other not in distances:
                distances[other] = distances[k] + 1
                front.append(other)
    return distances


def _order(vertices: list[Vertex], layers: Sequence[Sequence[int]]) -> None:
    """Heights: order by the middle of all neighbours, then each beside what stands on its left, so that chains are straight."""
    for layer in layers:
        _spread(vertices, layer, dict.fromkeys(layer, 0.0))
    for sweep in range(_SWEEPS):
        for layer in layers if sweep % 2 else layers[::-1]:
            _spread(vertices, layer, {k: _mean(vertices[other].y for other in vertices[k].near) for k in layer})
    for before, layer in pairwise(layers):
        _spread(vertices, layer, {k: _mean(vertices[o].y for o in vertices[k].near if o in before) for k in layer})


def _spread(vertices: list[Vertex], layer: Sequence[int], wanted: dict[int, float]) -> None:
    """Puts the vertices of a column as near as can be (least squares) to where they are wanted, a row apart at least."""
    order = sorted(layer, key=lambda k: (round(wanted[k], 6), vertices[k].y, -k))
    blocks: list[list[float]] = []  # of vertices a row apart, by where each would put the lowest vertex of the column
    for place, k in enumerate(order):
        blocks.append([wanted[k] - place * ROW])
        while len(blocks) > 1 and _mean(blocks[-2]) > _mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    heights = [_mean(block) for block in blocks for _ in block]
    for place, k in enumerate(order):
        vertices[k].y = heights[place] + place * ROW


def _place_below(found: Layout, shafts: Sequence[int], below: Sequence[int]) -> None:
    """Parts with signals only: in rows below, each near what it is joined with."""
    vertices = found.vertices
    lowest = min((vertices[k].y for k in shafts), default=0.0)
    right = max((vertices[k].x for k in shafts), default=4 * (BOX + GAP))
    wanted = {k: _mean(vertices[b if a == k else a].x for a, b in found.signals if k in (a, b)) for k in below}
    order = sorted(below, key=lambda k: wanted[k])
    room = int(right // (BOX + GAP)) + 1
    for number, start in enumerate(range(0, len(order), room)):
        row = order[start : start + room]
        free, last = -BOX, right
        for k in row:
            vertices[k].x = max(wanted[k], free)
            free = vertices[k].x + BOX + GAP
            vertices[k].y = lowest - (number + 1.6) * ROW
        for k in row[::-1]:
            vertices[k].x = min(vertices[k].x, last)
            last = vertices[k].x - BOX - GAP


def _mean(values: Iterable[float]) -> float:
    known = list(values)
    return sum(known) / len(known)


def signal_ends(start: Vertex, end: Vertex) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Where an arrow begins and ends, at the sides that face each other, and how much it is bent: below parts of one height."""
    right = 1 if end.x > start.x else -1
    if abs(start.y - end.y) < ROW / 2:
        return (start.x, start.y - HIGH / 2), (end.x, end.y - HIGH / 2), right * min(0.18, 0.9 / abs(end.x - start.x))
    down, shift = (1 if start.y > end.y else -1), 0.12 * BOX * right
    return (start.x + shift, start.y - down * HIGH / 2), (end.x - shift, end.y + down * HIGH / 2), 0.06


def curve(one: Vertex, other: Vertex) -> list[tuple[float, float]]:
    """A line that leaves and arrives level, or bulges between two vertices of one column."""
    one, other = sorted((one, other), key=lambda vertex: vertex.x)
    if one.column == other.column:
        (x0, y0), (x1, y1) = (one.x + one.width / 2, one.y), (other.x + other.width / 2, other.y)
        middle = (max(x0, x1) + 0.6, max(x0, x1) + 0.6)
    else:
        (x0, y0), (x1, y1) = (one.x + one.width / 2, one.y), (other.x - other.width / 2, other.y)
        middle = ((x0 + x1) / 2, (x0 + x1) / 2)
    points = []
    for k in range(25):
        t = k / 24
        weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
        points.append(
            (
                sum(w * x for w, x in zip(weights, (x0, *middle, x1), strict=True)),
                sum(w * y for w, y in zip(weights, (y0, y0, y1, y1), strict=True)),
            )
        )
    return points
