"""The power flow of one point as a diagram: components from left to right, bands as wide as the power they carry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.figures.plot import axes_of
from powertrain.power.circulation import Strand
from powertrain.power.directedflow import FLOOR
from powertrain.power.paths import Branch
from powertrain.power.powergraph import PowerGraph

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Points = NDArray[np.float64]
THROUGH, AROUND, LOST, STORED = "#4c8fbd", "#e8912d", "#c0392b", "#5a9e5a"
_BOX, _BAR, _GAP, _SPACE, _LEAST, _TIP = 1.9, 0.14, 2.3, 0.75, 0.035, 0.22


@dataclass
class _Bar:
    """A component, a connection, or a band passing a column: its column, its vertical centre, and the bands on either side."""

    name: str
    component: bool
    column: int = 0
    y: float = 0.0
    height: float = 0.5
    entering: list[int] = field(default_factory=list)
    leaving: list[int] = field(default_factory=list)

    @property
    def width(self) -> float:
        """Horizontal size."""
        return _BOX if self.component else _BAR

    @property
    def x(self) -> float:
        """Left side."""
        return self.column * (_BOX + _GAP) + (_BOX - self.width) / 2


class _Drawn(Protocol):
    """The power flow of one point, as required by the diagram."""

    @property
    def branches(self) -> list[Branch]: ...
    @property
    def graph(self) -> PowerGraph: ...
    @property
    def data(self) -> xr.Dataset: ...
    def strands(self) -> tuple[list[Strand], list[Strand]]: ...


def plot_power_flow(flow: _Drawn, ax: Axes | None = None, *, names: dict[str, str] | None = None) -> Axes:
    """Sankey diagram of one point: power from component to component, circulating power in orange, losses downwards.

    ``names``: other names for components and connections. Raises ParameterError for several points, or one without a solution.
    """
    branches = flow.branches
    if not branches:
        raise ParameterError("plot: no power flows at this point; choose another instant or another point of the map")
    circulating = _circulating(flow, branches)
    vertices = _layers(flow, branches)
    largest = max(b.power for b in branches)
    width = [max(b.power / largest, _LEAST) for b in branches]
    back = [vertices[b.target].column <= vertices[b.source].column for b in branches]
    passes = _passes(vertices, branches, width, back)
    _arrange(vertices, branches, width, back, passes)
    low = min(v.y - v.height / 2 for v in vertices.values()) - 1.0
    scale, unit = _prefix(largest)
    columns = max(v.column for v in vertices.values()) + 1
    ax = axes_of(ax, (max(6.0, 2.3 * columns), 4.2))
    for k, branch in enumerate(branches):
        line, low = _centre_line(vertices, branches, k, width, back[k], low, passes[k])
        _draw_band(ax, line, width[k], circulating[k] / branch.power)
        _label_band(ax, line, f"{branch.power * scale:.4g} {unit}", width[k])
    for vertex in vertices.values():
        _draw_vertex(ax, vertex, (names or {}).get(vertex.name, vertex.name))
        if vertex.component:
            _draw_sinks(ax, flow, vertex, largest, scale, unit)
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.margins(0.02)
    ax.set_axis_off()
    _legend(ax, any(share > 0 for share in circulating))
    return ax


def _circulating(flow: _Drawn, branches: Sequence[Branch]) -> list[float]:
    """The circulating part of each branch."""
    by_port: dict[str, float] = {}
    for strand in flow.strands()[0]:
        for k in strand.edges:
            port = flow.graph.terminals[k].port
            by_port[port] = by_port.get(port, 0.0) + strand.flow
    return [min(by_port.get(port, 0.0) for port in b.ports) for b in branches]


def _layers(flow: _Drawn, branches: Sequence[Branch]) -> dict[str, _Bar]:
    """Columns by the longest path from the sources, without the edges that close loops at the vertex nearest to the source."""
    components = set(flow.graph.components)
    vertices = {n: _Bar(n, n in components) for b in branches for n in (b.source, b.target)}
    supplied = flow.data["supplied"].to_series()
    starts = [n for n in vertices if n in components and float(supplied[n]) > 0]
    starts = starts or [n for n in vertices if all(b.target != n for b in branches)] or [next(iter(vertices))]
    distance = dict.fromkeys(starts, 0)
    front = list(starts)
    while front:
        vertex = front.pop(0)
        for b in branches:
            if b.source == vertex and b.target not in distance:
                distance[b.target] = distance[vertex] + 1
                front.append(b.target)
    kept: list[Branch] = []
    for b in sorted(branches, key=lambda b: (distance.get(b.target, 0) <= distance.get(b.source, 0), -b.power)):
        if not _leads(kept, b.target, b.source):
            kept.append(b)
    for _ in vertices:
        for b in kept:
            vertices[b.target].column = max(vertices[b.target].column, vertices[b.source].column + 1)
    return vertices


def _leads(branches: Sequence[Branch], start: str, end: str) -> bool:
    reached = {start}
    for _ in branches:
        reached |= {b.target for b in branches if b.source in reached}
    return end in reached


def _passes(
    vertices: dict[str, _Bar], branches: Sequence[Branch], width: Sequence[float], back: Sequence[bool]
) -> list[list[_Bar]]:
    """For each branch its positions in the columns between its ends, so that it does not pass through other vertices."""
    return [
        []
        if leads_back
        else [
            _Bar("", False, column, height=w)
            for column in range(vertices[b.source].column + 1, vertices[b.target].column)
        ]
        for b, w, leads_back in zip(branches, width, back, strict=True)
    ]


def _arrange(
    vertices: dict[str, _Bar],
    branches: Sequence[Branch],
    width: Sequence[float],
    back: Sequence[bool],
    passes: Sequence[Sequence[_Bar]],
) -> None:
    """Heights, vertical positions and the order of the bands on both sides."""
    first = [way[0] if way else vertices[b.target] for way, b in zip(passes, branches, strict=True)]
    last = [way[-1] if way else vertices[b.source] for way, b in zip(passes, branches, strict=True)]
    ways = [[vertices[b.source], *way] for b, way in zip(branches, passes, strict=True)]
    before = {id(v): u for way in ways for u, v in pairwise(way)}
    for v in vertices.values():
        v.entering = [k for k, b in enumerate(branches) if b.target == v.name]
        v.leaving = [k for k, b in enumerate(branches) if b.source == v.name]
        least = 0.7 if v.component else 0.2
        v.height = max(sum(width[k] for k in v.entering), sum(width[k] for k in v.leaving), least)
    placed = [*vertices.values(), *(v for way in passes for v in way)]
    columns = [[v for v in placed if v.column == c] for c in range(max(v.column for v in placed) + 1)]
    for _ in range(3):
        for column in columns:
            wish = {id(v): _wish(v, last, back, before.get(id(v))) for v in column}
            column.sort(key=lambda v: -wish[id(v)])
            total = sum(v.height for v in column) + _SPACE * (len(column) - 1)
            top = total / 2 + float(np.mean(list(wish.values())))
            for v in column:
                v.y = top - v.height / 2
                top -= v.height + _SPACE
    for v in vertices.values():
        v.entering.sort(key=lambda k: (back[k], -last[k].y))
        v.leaving.sort(key=lambda k: (back[k], -first[k].y))


def _wish(v: _Bar, last: Sequence[_Bar], back: Sequence[bool], before: _Bar | None) -> float:
    """The preferred height of a vertex: that of its neighbours to the left; loads above returning bands, passing bands above."""
    if before is not None:
        return before.y + 0.1
    places = [last[k].y for k in v.entering if not back[k]]
    leading_back = any(back[k] for k in v.leaving)
    return (float(np.mean(places)) if places else 0.0) - 0.1 * leading_back


def _centre_line(
    vertices: dict[str, _Bar],
    branches: Sequence[Branch],
    k: int,
    width: Sequence[float],
    back: bool,
    low: float,
    passes: Sequence[_Bar],
) -> tuple[Points, float]:
    """The centre line of a band, and the lowest free height below it."""
    source, target = vertices[branches[k].source], vertices[branches[k].target]
    start = (source.x + source.width, _offset(source, source.leaving, k, width))
    end = (target.x, _offset(target, target.entering, k, width))
    if not back:
        ends, line = [start], [np.array([start])]
        for v in passes:
            left = v.column * (_BOX + _GAP)
            line += [_curve(ends[-1], (left, v.y))[1:], np.array([[left + _BOX, v.y]])]
            ends.append((left + _BOX, v.y))
        return np.asarray(np.vstack([*line, _curve(ends[-1], end)[1:]]), float), low
    radius = width[k] / 2 + 0.12
    lane = low - width[k] / 2
    out, into = start[0] + radius + 0.05, end[0] - radius - _TIP - 0.05
    corners = [start, (out, start[1]), (out, lane), (into, lane), (into, end[1]), end]
    return _rounded(corners, radius), lane - width[k] / 2 - 0.3


def _curve(start: tuple[float, float], end: tuple[float, float]) -> Points:
    """A curve from one point to another, horizontal at both ends."""
    s = np.linspace(0, 1, 60)[:, None]
    reach = np.array([(end[0] - start[0]) * 0.45, 0.0])
    p = [np.array(start), np.array(start) + reach, np.array(end) - reach, np.array(end)]
    line = (1 - s) ** 3 * p[0] + 3 * s * (1 - s) ** 2 * p[1] + 3 * s**2 * (1 - s) * p[2] + s**3 * p[3]
    return np.asarray(line, float)


def _offset(v: _Bar, bands: Sequence[int], k: int, width: Sequence[float]) -> float:
    before = sum(width[j] for j in bands[: bands.index(k)])
    return v.y + sum(width[j] for j in bands) / 2 - before - width[k] / 2


def _rounded(corners: Sequence[tuple[float, float]], radius: float) -> Points:
    """A polyline with rounded corners."""
    p = np.array(corners, float)
    line = [p[0]]
    for before, here, after in zip(p, p[1:], p[2:], strict=False):
        first, second = before - here, after - here
        r = min(radius, np.hypot(*first) / 2, np.hypot(*second) / 2)
        a, b = here + first / np.hypot(*first) * r, here + second / np.hypot(*second) * r
        s = np.linspace(0, 1, 16)[:, None]
        line += list((1 - s) ** 2 * a + 2 * s * (1 - s) * here + s**2 * b)
    return np.array([*line, p[-1]])


def _draw_band(ax: Axes, line: Points, width: float, around: float) -> None:
    """A band with its tip at the end; its circulating part on the lower side."""
    body = line[np.hypot(*(line - line[-1]).T) > _TIP]
    body = np.vstack([body, line[-1] - (line[-1] - body[-1]) / float(np.linalg.norm(line[-1] - body[-1])) * _TIP])
    direction = (line[-1] - body[-1]) / _TIP
    normal = np.array([-direction[1], direction[0]]) * (width / 2 + 0.09)
    tip = np.array([body[-1] + normal, line[-1], body[-1] - normal])
    colour = AROUND if around > 0.5 else THROUGH
    ax.fill(*tip.T, color=colour, linewidth=0, zorder=2)
    edge = width / 2 - width * around
    for low, high, part in ((-width / 2, -edge, AROUND), (-edge, width / 2, THROUGH)):
        if high - low > 1e-9:
            ax.fill(*_ribbon(body, low, high).T, color=part, linewidth=0, alpha=0.85, zorder=1)


def _ribbon(line: Points, low: float, high: float) -> Points:
    tangent = np.gradient(line, axis=0)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    return np.vstack([line + normal * high, (line + normal * low)[::-1]])


def _label_band(ax: Axes, line: Points, text: str, width: float) -> None:
    steps = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    middle = [np.interp(steps[-1] / 2, steps, line[:, i]) for i in range(2)]
    thin = width < 0.3
    place = middle[1] + (width / 2 + 0.06 if thin else 0.0)
    ax.text(middle[0], place, text, ha="center", va="bottom" if thin else "center", fontsize=9, zorder=5)


def _draw_vertex(ax: Axes, v: _Bar, name: str) -> None:
    from matplotlib.patches import FancyBboxPatch, Rectangle

    corner, colour = (v.x, v.y - v.height / 2), "0.25"
    if not v.component:
        ax.add_patch(Rectangle(corner, v.width, v.height, color=colour, zorder=3))
        return
    box = FancyBboxPatch(
        corner, v.width, v.height, boxstyle="round,pad=0,rounding_size=0.12", fc="white", ec=colour, lw=1.2, zorder=3
    )
    ax.add_patch(box)
    text = name.replace(".", ".\n") if len(name) > 13 else name
    ax.text(v.x + v.width / 2, v.y, text, ha="center", va="center", fontsize=9, zorder=6)


def _draw_sinks(ax: Axes, flow: _Drawn, v: _Bar, largest: float, scale: float, unit: str) -> None:
    """Losses and storage of a component, as arrows downwards."""
    values = flow.data.sel(component=v.name)
    x = v.x + v.width * 0.35
    for amount, colour in ((float(values["loss"]), LOST), (float(values["stored"]), STORED)):
        if abs(amount) <= max(FLOOR, 1e-6) * largest:
            continue
        w, top = max(abs(amount) / largest, _LEAST), v.y - v.height / 2
        line = np.array([[x, top], [x, top - 0.2], [x, top - 0.45]])
        if amount < 0:
            line = line[::-1]
        ax.fill(*_ribbon(line[:2], -w / 2, w / 2).T, color=colour, linewidth=0, zorder=2)
        tip = np.array([line[1] + [w / 2 + 0.06, 0], line[2], line[1] - [w / 2 + 0.06, 0]])
        ax.fill(*tip.T, color=colour, linewidth=0, zorder=2)
        left = colour == LOST  # the two labels side by side, pointing away from each other
        ax.text(
            x - w / 2 - 0.12 if left else x + w / 2 + 0.12,
            top - 0.3,
            f"{abs(amount) * scale:.3g} {unit}",
            fontsize=8,
            color=colour,
            ha="right" if left else "left",
            va="center",
            zorder=7,
        )
        x += v.width * 0.45


def _prefix(largest: float) -> tuple[float, str]:
    for limit, unit in ((1e6, "MW"), (1e3, "kW")):
        if largest >= limit:
            return 1 / limit, unit
    return 1.0, "W"


def _legend(ax: Axes, circulates: bool) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(color=THROUGH, label="through power")]
    if circulates:
        handles.append(Patch(color=AROUND, label="circulating power"))
    handles += [Patch(color=LOST, label="losses"), Patch(color=STORED, label="stored (up: released)")]
    ax.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), fontsize=8, frameon=False, ncols=len(handles)
    )
