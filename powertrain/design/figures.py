"""Figures of split-path transmissions: the shafts of a network, a design over its ratios, efficiency against the size of the unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from powertrain.components.transmissions import HOUSING, Flow, Lever, Network
from powertrain.design.duty import Vector
from powertrain.design.space import SplitPathSpace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#2f6fa8", "#d9822b", "#4b8f4b", "#8c5aa8", "#b04a4a", "#5a5a5a", "#2a9d8f", "#b5883a")
_BEHIND = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
_PANELS = ("Efficiency", "Share of the unit, K", "Speed of the unit's shafts [rad/s]", "Torque [N.m]")
MARKS = ("o", "^", "D", "v", "P")
SPLIT, BACK = "#b7dfb2", "#d8c7e6"


def network_schematic(network: Network, ax: Axes | None = None) -> Axes:
    """The shafts of a network as vertical lines, from input to output; every planetary, gear pair and the unit as a horizontal bar.

    A dot marks a member attached to the shaft, with its letter: a, b, H (carrier). Numbers are basic ratios and ratios of gear pairs.
    """
    axes = ax or plt.subplots(figsize=(6.0, 3.6), layout="constrained")[1]
    place = _places(network)
    levers = [x for x in network.levers if not _is_direct(x)]
    bars = [*levers, None]
    height = len(bars)
    for node, x in place.items():
        names = [n for n, k in network.nodes.items() if k == node]
        strong = {network.input, network.output} & set(names)
        axes.plot(
            [x, x], [0.2, height + 0.35], color="black" if strong else "0.55", lw=2.4 if strong else 1.2, zorder=1
        )
        axes.text(
            x,
            height + 0.45,
            _named(names, network),
            ha="center",
            va="bottom",
            fontsize=7,
            rotation=30 if len(place) > 6 else 0,
        )
    for k, lever in enumerate(bars):
        _bar(axes, network, place, lever, height - k - 0.3)
    axes.set_xlim(-0.7, max(place.values()) + 0.7)
    axes.set_ylim(0, height + 1.2)
    axes.axis("off")
    return axes


def _is_direct(lever: Lever) -> bool:
    return lever.carrier == HOUSING and lever.ratio == 1.0


def _places(network: Network) -> dict[int, float]:
    """Positions of the shafts: the input on the left, the output on the right, the unit's shafts before the output, the others in order."""
    first, last = network.nodes[network.input], network.nodes[network.output]
    unit = [network.nodes[x] for x in network.unit]
    others = [n for n in dict.fromkeys(network.nodes.values()) if n not in (first, last, -1, *unit)]
    inner = [n for n in dict.fromkeys(unit) if n not in (first, last, -1)]
    half = len(others) // 2
    return {n: float(x) for x, n in enumerate([first, *others[:half], *inner, *others[half:], last])}


def _named(names: list[str], network: Network) -> str:
    shown = [n for n in names if n in (network.input, network.output)] or names[:1]
    return {network.input: "input", network.output: "output"}.get(shown[0], shown[0])


def _bar(axes: Axes, network: Network, place: dict[int, float], lever: Lever | None, y: float) -> None:
    """A lever, a pair of gears, or the unit."""
    if lever is None:
        ends, colour, said = dict(zip(("V", "V "), network.unit, strict=True)), COLOURS[1], "unit"
    elif lever.carrier == HOUSING:
        ends, colour, said = {"": lever.a, " ": lever.b}, COLOURS[5], f"{lever.ratio:.3g} : 1"
    else:
        ends, colour, said = {"a": lever.a, "b": lever.b, "H": lever.carrier}, COLOURS[0], f"$R_o$ = {lever.ratio:.3g}"
    at = {letter: place[network.nodes[n]] for letter, n in ends.items() if network.nodes[n] in place}
    axes.plot(
        [min(at.values()), max(at.values())],
        [y, y],
        color=colour,
        lw=4 if lever is None else 3,
        zorder=2,
        solid_capstyle="round",
    )
    for letter, x in at.items():
        axes.plot(x, y, "o", ms=9 if letter.strip() in ("a", "b", "H") else 6, color=colour, zorder=3)
        if letter.strip() in ("a", "b", "H"):
            axes.text(x, y - 0.02, letter, ha="center", va="center", fontsize=6, color="white", zorder=4)
    axes.text(
        (min(at.values()) + max(at.values())) / 2,
        y + 0.2,
        said,
        ha="center",
        va="bottom",
        fontsize=7,
        color=colour,
        bbox=_BEHIND,
    )


Part = tuple[Vector, Flow, Network]
"""r, the operating points there, and the network of a range."""


def design_figure(space: SplitPathSpace, line: int = 0, path: str | Path | None = None) -> Figure:
    """A row of the table of a ``SplitPathSpace``, drawn as by ``ranges_figure``. ``path`` saves the figure."""
    row = space.table.iloc[line]
    parts = [(r, at, network) for (r, at), (_, _, network) in zip(space.flows(line), space.ranges(line), strict=True)]
    title = (
        f"{row.structure}, unit {row.unit}: mean efficiency {100 * row.mean_efficiency:.1f} %, "
        f"unit of {row.unit_size:.2f} times the power"
    )
    return ranges_figure(parts, title, path)


def ranges_figure(parts: Sequence[Part], title: str, path: str | Path | None = None) -> Figure:
    """The schematic of every range, efficiency, share of the unit, and speeds and torques of its shafts over r.

    Green, between the mechanical points of the unit's shafts: power splits, and the share is drawn as positive. Violet, beyond them: power
    recirculates through the unit or past it. If a mesh is stuck, the band of the efficiency shows both ends. ``path`` saves the figure.
    """
    figure = plt.figure(figsize=(11.0, 9.0), layout="constrained")
    n = len(parts)
    grid = figure.add_gridspec(3, 2 * n, height_ratios=(1.25, 1, 1))
    for k, (r, _, network) in enumerate(parts):
        axes = network_schematic(network, figure.add_subplot(grid[0, 2 * k : 2 * k + 2]))
        axes.set_title(f"r from {r[0]:.3g} to {r[-1]:.3g}", fontsize=9)
    panels = [figure.add_subplot(grid[i, j * n : (j + 1) * n]) for i in (1, 2) for j in (0, 1)]
    for axes, name in zip(panels, _PANELS, strict=True):
        axes.set_ylabel(name)
        axes.set_xlim(parts[0][0][0], parts[-1][0][-1])
        axes.set_xlabel("r, output speed over input speed")
        for r, _, _ in parts[:-1]:
            axes.axvline(r[-1], color="0.6", lw=0.8, ls=":")
    for part in parts:
        _draw(panels, part)
    panels[0].set_ylim(None, 1)
    largest = max(1.2, min(3.0, float(max(np.nanmax(np.abs(at.K)) for _, at, _ in parts))))
    panels[1].set_ylim(-largest, largest)
    for axes in panels[1:]:
        axes.axhline(0, color="0.3", lw=0.8)
    for axes in panels[2:]:
        axes.legend([axes.lines[_first(axes, COLOURS[s])] for s in (0, 1)], ["a", "b"], fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=10)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def _draw(panels: Sequence[Axes], part: Part) -> None:
    """The curves of a range."""
    r, at, network = part
    panels[0].fill_between(r, at.efficiency[0], at.efficiency[1], color=COLOURS[0], alpha=0.3, lw=0)
    panels[0].plot(r, at.efficiency[0], color=COLOURS[0])
    m_a, m_b = (network.mechanical_point(name) for name in network.unit)
    K = np.sign(m_a - m_b) * at.K  # positive between the mechanical points
    panels[1].plot(r, K, color=COLOURS[1])
    panels[1].fill_between(r, 0, K, where=(K > 0) & (K < 1), color=SPLIT, lw=0)
    panels[1].fill_between(r, 0, K, where=(K < 0) | (K > 1), color=BACK, lw=0)
    for s in (0, 1):
        panels[2].plot(r, at.w[s], color=COLOURS[s])
        panels[3].plot(r, at.tau[s], color=COLOURS[s])


def _first(axes: Axes, colour: str) -> int:
    return next(
        k for k, line in enumerate(axes.lines) if line.get_color() == colour and len(np.asarray(line.get_xdata())) > 2
    )


def front_figure(space: SplitPathSpace, path: str | Path | None = None) -> Figure:
    """Mean efficiency against the size of the unit: the Pareto front of every structure, and the overall front as a line.

    Colours distinguish structures, markers units. ``path`` saves the figure.
    """
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    figure, axes = plt.subplots(figsize=(9.0, 5.0), layout="constrained")
    table = space.table.assign(kind=space.table.structure.map(kind_of))
    kinds, units = sorted(table.kind.unique()), list(dict.fromkeys(table.unit))
    for (kind, unit), rows in table.groupby(["kind", "unit"]):
        colour, mark = COLOURS[kinds.index(str(kind)) % len(COLOURS)], MARKS[units.index(str(unit)) % len(MARKS)]
        axes.plot(rows.unit_size, 100 * rows.mean_efficiency, mark, ms=5, color=colour, mec="white", mew=0.4)
    best = space.pareto.sort_values("unit_size")
    axes.step(best.unit_size, 100 * best.mean_efficiency, where="post", color="black", lw=1.0, zorder=0)
    axes.set_xlabel("Size of the unit: torque times speed at most, over the power delivered at most")
    axes.set_ylabel("Mean efficiency over the duty [%]")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())
    low, high = axes.get_xlim()
    axes.set_xticks([x for x in (0.05, 0.1, 0.2, 0.3, 0.5, 1, 2, 3, 5, 10, 20, 50) if low <= x <= high])
    said = [axes.plot([], [], "s", color=COLOURS[k % len(COLOURS)], label=kind)[0] for k, kind in enumerate(kinds)]
    said += [axes.plot([], [], MARKS[k % len(MARKS)], color="0.4", label=unit)[0] for k, unit in enumerate(units)]
    figure.legend(handles=said, fontsize=8, frameon=False, loc="outside right upper")
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def kind_of(structure: str) -> str:
    """The kind of a structure from its text: input-coupled, output-coupled, compound, with its number of ranges."""
    names = []
    for ends in structure.split(" | "):
        a, b = ends.split("-")
        names.append("input-coupled" if a == "input" else "output-coupled" if b == "output" else "compound")
    return f"{len(names)} ranges {names[0]}" if len(names) > 1 and len(set(names)) == 1 else ", then ".join(names)
