"""The structure of a model as a picture: its parts, the lines between their ports, and the signals.

Shafts lead from left to right; parts that only exchange signals stand below. What is inside of a part is drawn with the part alone, as in
``schematic(car.transmission)``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from powertrain.compiler.flatten import flatten
from powertrain.errors import ParameterError
from powertrain.language.component import Component, Variable
from powertrain.language.connectors import Connector, Output, Signal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINES = {
    "N.m": ("rotation", "#2f6fa8"),
    "N": ("translation", "#4b8f4b"),
    "A": ("electric", "#d9822b"),
}
"""What the unit of a connector's flow says about a line: its name and colour. Heat is not drawn."""
SIGNAL = "0.62"
_BOX, _HIGH, _GAP, _ROW, _INCHES = 2.0, 0.72, 0.75, 1.25, 0.55
_SWEEPS = 24


@dataclass
class _Vertex:
    """A part, a port of the whole, or (without a title) a junction of three lines and more.

    ``source``: power comes from there; ``near``: what lines lead to; ``x``, ``y``: its middle.
    """

    title: str
    kind: str = ""
    source: bool = False
    near: list[int] = field(default_factory=list)
    column: int = -1
    x: float = 0.0
    y: float = 0.0

    @property
    def width(self) -> float:
        return _BOX if self.title else 0.0


@dataclass
class _Structure:
    """Vertices, lines (pairs of vertices with the unit of the flow), signals (from, to)."""

    vertices: list[_Vertex]
    lines: list[tuple[int, int, str]]
    signals: list[tuple[int, int]]


def schematic(model: Component, *, signals: bool = True, ax: Axes | None = None) -> Axes:
    """Draw the components of a model and their connections.

    Blue lines are rotational, green lines translational, orange lines electrical connections; grey arrows are signals.

    Errors: ParameterError for a model without connected parts, ModelError if the model is wrong.
    """
    import matplotlib.pyplot as plt

    found = _structure(model)
    if not signals:
        found.signals.clear()
    shafts = [k for k, vertex in enumerate(found.vertices) if vertex.near]
    below = sorted({k for pair in found.signals for k in pair} - set(shafts))
    _place_shafts(found.vertices, shafts)
    _place_below(found, shafts, below)
    shown = [found.vertices[k] for k in (*shafts, *below)]
    if not shown:
        raise ParameterError(f"{type(model).__name__} has no connected parts: there is nothing to draw")
    (left, right), (low, high) = ([f(getattr(v, side) for v in shown) for f in (min, max)] for side in "xy")
    left, right, low, high = left - 0.6 * _BOX, right + 0.6 * _BOX, low - 1.1 * _ROW, high + 0.6 * _ROW
    if ax is None:
        size = _INCHES * (right - left), _INCHES * (high - low) + 0.2
        ax = plt.subplots(figsize=size, layout="constrained")[1]
    _draw(ax, found, shown)
    ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
    ax.set_axis_off()
    return ax


def _structure(model: Component) -> _Structure:
    flat = flatten(model)
    parts = {c._path: c for c in flat.components[1:] if not isinstance(c, Connector) and "." not in c._path}
    ports = {c._path: c for c in flat.components if isinstance(c, Connector)}
    found = _Structure([_Vertex(path, type(part).__name__, part.boundary) for path, part in parts.items()], [], [])
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
                found.vertices.append(_Vertex(name, "port"))
            ends.append((numbers[name], isinstance(ports[path], Output) is not inner))
        _join(found, ports[faces[0][0]], ends)
    return found


def _join(found: _Structure, port: Connector, ends: Sequence[tuple[int, bool]]) -> None:
    """Adds what a node of the model joins; ``ends``: vertices, and whether they give the signal."""
    if isinstance(port, Signal):
        sources, targets = ({k for k, gives in ends if gives is wanted} for wanted in (True, False))
        found.signals += [(a, b) for a in sources for b in targets if a != b and (a, b) not in found.signals]
        return
    unit = next(q.unit for q in port._fields.values() if isinstance(q, Variable) and q.flow)
    joined = list(dict.fromkeys(k for k, _ in ends))
    if unit not in LINES or len(joined) < 2:
        return
    if len(joined) == 2:
        pairs = [(joined[0], joined[1])]
    else:
        found.vertices.append(_Vertex(""))
        pairs = [(k, len(found.vertices) - 1) for k in joined]
    for a, b in pairs:
        found.lines.append((a, b, unit))
        found.vertices[a].near.append(b)
        found.vertices[b].near.append(a)


def _place_shafts(vertices: list[_Vertex], shafts: Sequence[int]) -> None:
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
        row -= highest - lowest + _ROW
        left -= set(connected)


def _layers(vertices: list[_Vertex], connected: Iterable[int]) -> list[list[int]]:
    """The vertices by column, from that end of the longest chain from which power comes, or that was declared first."""
    from_any = _distances(vertices, min(connected))
    one = max(from_any, key=from_any.__getitem__)
    far = _distances(vertices, one)
    other = max(far, key=far.__getitem__)
    distances = _distances(vertices, min((one, other), key=lambda k: (not vertices[k].source, k)))
    layers: list[list[int]] = [[] for _ in range(max(distances.values()) + 1)]
    for k, column in distances.items():
        layers[column].append(k)
        vertices[k].column = column
    x = 0.0
    for layer in layers:
        width = max(vertices[k].width for k in layer)
        for k in layer:
            vertices[k].x = x + width / 2
        x += width + _GAP
    return layers


def _distances(vertices: list[_Vertex], start: int) -> dict[int, int]:
    """Steps from a vertex to all that can be reached."""
    distances, front = {start: 0}, [start]
    while front:
        k = front.pop(0)
        for other in vertices[k].near:
            if other not in distances:
                distances[other] = distances[k] + 1
                front.append(other)
    return distances


def _order(vertices: list[_Vertex], layers: Sequence[Sequence[int]]) -> None:
    """Heights: order by the middle of all neighbours, then each beside what stands on its left, so that chains are straight."""
    for layer in layers:
        _spread(vertices, layer, dict.fromkeys(layer, 0.0))
    for sweep in range(_SWEEPS):
        for layer in layers if sweep % 2 else layers[::-1]:
            _spread(vertices, layer, {k: _mean(vertices[other].y for other in vertices[k].near) for k in layer})
    for before, layer in pairwise(layers):
        _spread(vertices, layer, {k: _mean(vertices[o].y for o in vertices[k].near if o in before) for k in layer})


def _spread(vertices: list[_Vertex], layer: Sequence[int], wanted: dict[int, float]) -> None:
    """Puts the vertices of a column as near as can be (least squares) to where they are wanted, a row apart at least."""
    order = sorted(layer, key=lambda k: (round(wanted[k], 6), vertices[k].y, -k))
    blocks: list[list[float]] = []  # of vertices a row apart, by where each would put the lowest vertex of the column
    for place, k in enumerate(order):
        blocks.append([wanted[k] - place * _ROW])
        while len(blocks) > 1 and _mean(blocks[-2]) > _mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    heights = [_mean(block) for block in blocks for _ in block]
    for place, k in enumerate(order):
        vertices[k].y = heights[place] + place * _ROW


def _place_below(found: _Structure, shafts: Sequence[int], below: Sequence[int]) -> None:
    """Parts with signals only: in rows below, each near what it is joined with."""
    vertices = found.vertices
    lowest = min((vertices[k].y for k in shafts), default=0.0)
    right = max((vertices[k].x for k in shafts), default=4 * (_BOX + _GAP))
    wanted = {k: _mean(vertices[b if a == k else a].x for a, b in found.signals if k in (a, b)) for k in below}
    order = sorted(below, key=lambda k: wanted[k])
    room = int(right // (_BOX + _GAP)) + 1
    for number, start in enumerate(range(0, len(order), room)):
        row = order[start : start + room]
        free, last = -_BOX, right
        for k in row:
            vertices[k].x = max(wanted[k], free)
            free = vertices[k].x + _BOX + _GAP
            vertices[k].y = lowest - (number + 1.6) * _ROW
        for k in row[::-1]:
            vertices[k].x = min(vertices[k].x, last)
            last = vertices[k].x - _BOX - _GAP


def _mean(values: Iterable[float]) -> float:
    known = list(values)
    return sum(known) / len(known)


def _draw(ax: Axes, found: _Structure, shown: Iterable[_Vertex]) -> None:
    from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

    arrow: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 8, "lw": 0.8, "color": SIGNAL, "zorder": 1}
    for a, b in found.signals:
        start, end, bend = _signal_ends(found.vertices[a], found.vertices[b])
        ax.add_patch(FancyArrowPatch(start, end, connectionstyle=f"arc3,rad={bend}", **arrow))
    for a, b, unit in found.lines:
        xs, ys = zip(*_curve(found.vertices[a], found.vertices[b]), strict=True)
        ax.plot(xs, ys, color=LINES[unit][1], lw=2.4, solid_capstyle="round", zorder=2)
    for vertex in shown:
        if not vertex.title:
            ax.plot(vertex.x, vertex.y, "o", ms=5, color="0.25", zorder=3)
            continue
        corner = (vertex.x - _BOX / 2, vertex.y - _HIGH / 2)
        style = "round,pad=0,rounding_size=0.08"
        ax.add_patch(FancyBboxPatch(corner, _BOX, _HIGH, boxstyle=style, fc="white", ec="0.25", lw=1, zorder=3))
        text: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 4}
        ax.text(vertex.x, vertex.y + 0.14, vertex.title, fontsize=8, **text)
        ax.text(vertex.x, vertex.y - 0.17, vertex.kind, fontsize=5.5, color="0.4", **text)
    for name, color in _legend(found):
        ax.plot([], [], color=color, lw=2, label=name)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower center", ncols=4, fontsize=7, frameon=False)


def _legend(found: _Structure) -> Iterator[tuple[str, str]]:
    units = {unit for _, _, unit in found.lines}
    yield from (line for unit, line in LINES.items() if unit in units)
    if found.signals:
        yield "signal", SIGNAL


def _signal_ends(start: _Vertex, end: _Vertex) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Where an arrow begins and ends, at the sides that face each other, and how much it is bent: below parts of one height."""
    right = 1 if end.x > start.x else -1
    if abs(start.y - end.y) < _ROW / 2:
        return (start.x, start.y - _HIGH / 2), (end.x, end.y - _HIGH / 2), right * min(0.18, 0.9 / abs(end.x - start.x))
    down, shift = (1 if start.y > end.y else -1), 0.12 * _BOX * right
    return (start.x + shift, start.y - down * _HIGH / 2), (end.x - shift, end.y + down * _HIGH / 2), 0.06


def _curve(one: _Vertex, other: _Vertex) -> list[tuple[float, float]]:
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
