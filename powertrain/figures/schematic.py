"""The structure of a model as a picture: its components, the lines between their ports, and the signals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from powertrain.figures.layout import BOX, HIGH, LINES, Layout, curve, layout, signal_ends
from powertrain.figures.plot import axes_of
from powertrain.language.component import Component

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIGNAL = "0.62"
_INCHES = 0.5
_TEXT = 0.22
"""Height of the names of components in the unit of the diagram."""


def schematic(model: Component, *, signals: bool = True, ax: Axes | None = None) -> Axes:
    """Draw the components of a model and their connections.

    Blue lines are rotational, green lines translational, orange lines electrical connections; grey arrows are signals.

    Errors: ParameterError for a model without connected components, ModelError if the model is wrong.
    """
    found = layout(model, signals=signals)
    left, right, low, high = found.limits
    ax = axes_of(ax, (_INCHES * (right - left), _INCHES * (high - low) + 0.2))
    _draw(ax, found)
    ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
    ax.set_axis_off()
    return ax


def _draw(ax: Axes, found: Layout) -> None:
    from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

    from powertrain.figures.scaledtext import legend, width, write

    arrow: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 8, "lw": 0.8, "color": SIGNAL, "zorder": 1}
    for a, b in found.signals:
        start, end, bend = signal_ends(found.vertices[a], found.vertices[b])
        ax.add_patch(FancyArrowPatch(start, end, connectionstyle=f"arc3,rad={bend}", **arrow))
    for line in found.lines:
        xs, ys = zip(*curve(found.vertices[line.a], found.vertices[line.b]), strict=True)
        ax.plot(xs, ys, color=LINES[line.unit][1], lw=2.4, solid_capstyle="round", zorder=2)
    for vertex in found.shown:
        if not vertex.title:
            ax.plot(vertex.x, vertex.y, "o", ms=5, color="0.25", zorder=3)
            continue
        corner = (vertex.x - BOX / 2, vertex.y - HIGH / 2)
        style = "round,pad=0,rounding_size=0.08"
        ax.add_patch(FancyBboxPatch(corner, BOX, HIGH, boxstyle=style, fc="white", ec="0.25", lw=1, zorder=3))
        text: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 4}
        size, small = (
            min(h, 0.94 * BOX / width(said)) for h, said in ((_TEXT, vertex.title), (0.7 * _TEXT, vertex.kind or " "))
        )
        write(ax, vertex.x, vertex.y + 0.14, vertex.title, size, **text)
        write(ax, vertex.x, vertex.y - 0.17, vertex.kind, small, color="0.4", **text)
    entries, (left, right, low, _) = list(_legend(found)), found.limits
    across = sum(1.1 + 0.9 * _TEXT * width(name) for name, _ in entries) - 0.5
    legend(ax, entries, (max(left, (left + right - across) / 2), low + 0.25), right, 0.9 * _TEXT)


def _legend(found: Layout) -> Iterator[tuple[str, str]]:
    units = {line.unit for line in found.lines}
    yield from (line for unit, line in LINES.items() if unit in units)
    if found.signals:
        yield "signal", SIGNAL
