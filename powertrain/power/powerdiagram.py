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
from powertrain.language.arguments import by_name
from powertrain.power.circulation import Strand
from powertrain.power.directedflow import FLOOR
from powertrain.power.paths import Branch
from powertrain.power.powergraph import PowerGraph

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Points = NDArray[np.float64]
THROUGH, AROUND, LOST, STORED = "#4c8fbd", "#e8912d", "#c0392b", "#5a9e5a"
_BOX, _BAR, _GAP, _SPACE, _LEAST, _TIP, _TEXT = 1.9, 0.14, 2.3, 0.75, 0.035, 0.22, 0.23
_INCH = 2.3 / (_BOX + _GAP)
"""Size of the unit of the diagram in a figure of its own."""


@dataclass(eq=False)
class _Bar:
    """A component, a connection, or a band passing a column: its column, its vertical centre, and the bands on either side."""

    name: str
    component: bool
    column: int = 0
    y: float = 0.0
    height: float = 0.5
    entering: list[_Band] = field(default_factory=list)
    leaving: list[_Band] = field(default_factory=list)

    @property
    def width(self) -> float:
        """Horizontal size."""
        return _BOX if self.component else _BAR

    @property
    def x(self) -> float:
        """Left side."""
        return self.column * (_BOX + _GAP) + (_BOX - self.width) / 2


@dataclass(eq=False)
class _Band:
    """The power from one bar to another, and the share of it that circulates.

    ``passes``: its positions in the columns between its ends, so that it does not pass through other bars.
    """

    source: _Bar
    target: _Bar
    power: float
    width: float
    around: float
    passes: list[_Bar] = field(init=False)

    def __post_init__(self) -> None:
        columns = () if self.back else range(self.source.column + 1, self.target.column)
        self.passes = [_Bar("", False, column, height=self.width) for column in columns]

    @property
    def back(self) -> bool:
        """Whether it leads back to the left."""
        return self.target.column <= self.source.column

    @property
    def first(self) -> _Bar:
        """What it reaches after its source."""
        return self.passes[0] if self.passes else self.target

    @property
    def last(self) -> _Bar:
        """What it comes from before its target."""
        return self.passes[-1] if self.passes else self.source


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

    Texts scale with the diagram; a figure of its own has the size at which they are readable.
    ``names``: other names for components and connections. Raises ParameterError for several points, or one without a solution.
    """
    branches, said = flow.branches, by_name("names", names)
    if not branches:
        raise ParameterError("plot: no power flows at this point; choose another instant or another point of the map")
    bars = _layers(flow, branches)
    sinks = _sinks(flow, bars)
    largest = max(b.power for b in branches)
    largest = max([largest, *(abs(amount) for amounts in sinks.values() for amount, _ in amounts)])
    bands = _bands(flow, branches, bars, largest)
    _arrange(list(bars.values()), bands)
    low = min(bar.y - bar.height / 2 for bar in bars.values()) - 1.0
    lines = []
    for band in bands:
        line, low = _centre_line(band, low)
        lines.append(line)
    high = max([bar.y + bar.height / 2 for bar in bars.values()] + [line[:, 1].max() + 0.5 for line in lines])
    right = max([bar.x + bar.width for bar in bars.values()] + [line[:, 0].max() + 0.5 for line in lines])
    ax = axes_of(ax, (_INCH * (right + 0.6), _INCH * (high - low + 1.2)))
    for band, line in zip(bands, lines, strict=True):
        _draw_band(ax, line, band)
        _label_band(ax, line, _watts(band.power, 4), band.width)
    for bar in bars.values():
        _draw_bar(ax, bar, said.get(bar.name, bar.name))
        for amount, colour in sinks.get(bar.name, ()):
            _draw_sink(ax, bar, amount, colour, largest)
    _legend(ax, low, right, any(band.around > 0 for band in bands))
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.margins(0.02)
    ax.set_axis_off()
    return ax


def _bands(flow: _Drawn, branches: Sequence[Branch], bars: dict[str, _Bar], largest: float) -> list[_Band]:
    """The bands between bars in their columns."""
    by_port: dict[str, float] = {}
    for strand in flow.strands()[0]:
        for k in strand.edges:
            port = flow.graph.terminals[k].port
            by_port[port] = by_port.get(port, 0.0) + strand.flow
    return [
        _Band(
            bars[b.source],
            bars[b.target],
            b.power,
            max(b.power / largest, _LEAST),
            min(by_port.get(port, 0.0) for port in b.ports) / b.power,
        )
        for b in branches
    ]


def _layers(flow: _Drawn, branches: Sequence[Branch]) -> dict[str, _Bar]:
    """Columns by the longest path from the sources, without the edges that close loops at the vertex nearest to the source."""
    components = set(flow.graph.components)
    bars = {n: _Bar(n, n in components) for b in branches for n in (b.source, b.target)}
    supplied = flow.data["supplied"].to_series()
    starts = [n for n in bars if n in components and float(supplied[n]) > 0]
    starts = starts or [n for n in bars if all(b.target != n for b in branches)] or [next(iter(bars))]
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
    for _ in bars:
        for b in kept:
            bars[b.target].column = max(bars[b.target].column, bars[b.source].column + 1)
    return bars


def _leads(branches: Sequence[Branch], start: str, end: str) -> bool:
    reached = {start}
    for _ in branches:
        reached |= {b.target for b in branches if b.source in reached}
    return end in reached


def _arrange(bars: list[_Bar], bands: Sequence[_Band]) -> None:
    """Heights, vertical positions and the order of the bands on both sides."""
    for bar in bars:
        bar.entering = [band for band in bands if band.target is bar]
        bar.leaving = [band for band in bands if band.source is bar]
        least = 0.7 if bar.component else 0.2
        bar.height = max(_total(bar.entering), _total(bar.leaving), least)
    before = {id(bar): last for band in bands for last, bar in pairwise([band.source, *band.passes])}
    placed = [*bars, *(bar for band in bands for bar in band.passes)]
    columns = [[bar for bar in placed if bar.column == c] for c in range(max(bar.column for bar in placed) + 1)]
    for _ in range(3):
        for column in columns:
            wish = {id(bar): _wish(bar, before.get(id(bar))) for bar in column}
            column.sort(key=lambda bar: -wish[id(bar)])
            total = sum(bar.height for bar in column) + _SPACE * (len(column) - 1)
            top = total / 2 + float(np.mean(list(wish.values())))
            for bar in column:
                bar.y = top - bar.height / 2
                top -= bar.height + _SPACE
    for bar in bars:
        bar.entering.sort(key=lambda band: (band.back, -band.last.y))
        bar.leaving.sort(key=lambda band: (band.back, -band.first.y))


def _total(bands: Sequence[_Band]) -> float:
    return sum(band.width for band in bands)


def _wish(bar: _Bar, before: _Bar | None) -> float:
    """The preferred height of a bar: that of its neighbours to the left; loads above returning bands, passing bands above."""
    if before is not None:
        return before.y + 0.1
    places = [band.last.y for band in bar.entering if not band.back]
    leading_back = any(band.back for band in bar.leaving)
    return (float(np.mean(places)) if places else 0.0) - 0.1 * leading_back


def _centre_line(band: _Band, low: float) -> tuple[Points, float]:
    """The centre line of a band, and the lowest free height below it."""
    source, target = band.source, band.target
    start = (source.x + source.width, _height(source, source.leaving, band))
    end = (target.x, _height(target, target.entering, band))
    if not band.back:
        ends, line = [start], [np.array([start])]
        for bar in band.passes:
            left = bar.column * (_BOX + _GAP)
            line += [_curve(ends[-1], (left, bar.y))[1:], np.array([[left + _BOX, bar.y]])]
            ends.append((left + _BOX, bar.y))
        return np.asarray(np.vstack([*line, _curve(ends[-1], end)[1:]]), float), low
    radius = band.width / 2 + 0.12
    lane = low - band.width / 2
    out, into = start[0] + radius + 0.05, end[0] - radius - _TIP - 0.05
    corners = [start, (out, start[1]), (out, lane), (into, lane), (into, end[1]), end]
    return _rounded(corners, radius), lane - band.width / 2 - 0.3


def _height(bar: _Bar, bands: Sequence[_Band], band: _Band) -> float:
    """Where a band meets a bar."""
    above = _total(bands[: bands.index(band)])
    return bar.y + _total(bands) / 2 - above - band.width / 2


def _curve(start: tuple[float, float], end: tuple[float, float]) -> Points:
    """A curve from one point to another, horizontal at both ends."""
    s = np.linspace(0, 1, 60)[:, None]
    reach = np.array([(end[0] - start[0]) * 0.45, 0.0])
    p = [np.array(start), np.array(start) + reach, np.array(end) - reach, np.array(end)]
    line = (1 - s) ** 3 * p[0] + 3 * s * (1 - s) ** 2 * p[1] + 3 * s**2 * (1 - s) * p[2] + s**3 * p[3]
    return np.asarray(line, float)


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


def _draw_band(ax: Axes, line: Points, band: _Band) -> None:
    """A band with its tip at the end; its circulating part on the lower side."""
    width, around = band.width, band.around
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
    from powertrain.figures.scaledtext import write

    steps = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    middle = [np.interp(steps[-1] / 2, steps, line[:, i]) for i in range(2)]
    thin = width < 0.3
    place = middle[1] + (width / 2 + 0.06 if thin else 0.0)
    write(ax, middle[0], place, text, _TEXT, ha="center", va="bottom" if thin else "center", zorder=5)


def _draw_bar(ax: Axes, v: _Bar, name: str) -> None:
    from matplotlib.patches import FancyBboxPatch, Rectangle

    from powertrain.figures.scaledtext import width, write

    corner, colour = (v.x, v.y - v.height / 2), "0.25"
    if not v.component:
        ax.add_patch(Rectangle(corner, v.width, v.height, color=colour, zorder=3))
        return
    box = FancyBboxPatch(
        corner, v.width, v.height, boxstyle="round,pad=0,rounding_size=0.12", fc="white", ec=colour, lw=1.2, zorder=3
    )
    ax.add_patch(box)
    text = name.replace(".", ".\n") if len(name) > 13 else name
    size = min(_TEXT, 0.92 * v.width / width(text), 0.75 * v.height / (text.count("\n") + 1))
    write(ax, v.x + v.width / 2, v.y, text, size, ha="center", va="center", zorder=6)


def _sinks(flow: _Drawn, bars: dict[str, _Bar]) -> dict[str, list[tuple[float, str]]]:
    """Loss and stored power of every component, with their colours, where they are not negligible."""
    found: dict[str, list[tuple[float, str]]] = {}
    least = max(FLOOR, 1e-6) * max(b.power for b in flow.branches)
    for bar in bars.values():
        if bar.component:
            values = flow.data.sel(component=bar.name)
            both = ((float(values["loss"]), LOST), (float(values["stored"]), STORED))
            found[bar.name] = [(amount, colour) for amount, colour in both if abs(amount) > least]
    return found


def _draw_sink(ax: Axes, v: _Bar, amount: float, colour: str, largest: float) -> None:
    """An arrow below a component: loss left of its middle, storage right of it (up if energy is released)."""
    from powertrain.figures.scaledtext import write

    w, top = max(abs(amount) / largest, _LEAST), v.y - v.height / 2
    side = -1 if colour == LOST else 1
    x = v.x + v.width / 2 + side * (w / 2 + 0.1)
    line = np.array([[x, top], [x, top - 0.2], [x, top - 0.45]])
    if amount < 0:
        line = line[::-1]
    ax.fill(*_ribbon(line[:2], -w / 2, w / 2).T, color=colour, linewidth=0, zorder=2)
    tip = np.array([line[1] + [w / 2 + 0.06, 0], line[2], line[1] - [w / 2 + 0.06, 0]])
    ax.fill(*tip.T, color=colour, linewidth=0, zorder=2)
    place = x + side * (w / 2 + 0.12)
    ha = "right" if side < 0 else "left"
    write(ax, place, top - 0.28, _watts(abs(amount), 3), 0.9 * _TEXT, color=colour, ha=ha, va="center", zorder=7)


def _watts(power: float, digits: int) -> str:
    for limit, unit in ((1e6, "MW"), (1e3, "kW")):
        if power >= limit:
            return f"{power / limit:.{digits}g} {unit}"
    return f"{power:.{digits}g} W"


def _legend(ax: Axes, low: float, right: float, circulates: bool) -> None:
    from powertrain.figures.scaledtext import legend

    entries = [("through power", THROUGH), ("circulating power", AROUND)][: 1 + circulates]
    entries += [("losses", LOST), ("stored (up: released)", STORED)]
    legend(ax, entries, (0.0, low - 0.3), max(right, 4.0), 0.9 * _TEXT)
