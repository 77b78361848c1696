"""The energy of a cycle as a Sankey diagram: from the tank to the road, with the loss of each part branching off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import powertrain as pt
from powertrain.figures.plot import axes_of
from powertrain.language.component import children
from powertrain.trials.cycle_run import CycleRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALL = 2e-3
"""Losses below this share of the supply are not drawn separately."""
BEND, GAP, DOWN = 0.04, 0.2, 0.12
"""Inner radius of a branch, distance to the next one, and its length, relative to the initial height of the band."""


def plot_energy_flow(run: CycleRun, *, ax: Axes | None = None) -> Axes:
    """The energy supplied over a cycle [MJ], from left to right through the components, from engines and stores to the road.

    The height of the band is the remaining energy, initially ``run.supplied``: fuel, and the decrease of stored energy.
    The loss of each component branches off downwards, with its share of the supply. At the end remain losses too small to be drawn, and
    energy stored in parts (charge, height, heat). Source: the energy audit of the run.
    """
    ax = axes_of(ax, (11, 4.5))
    table, supplied = run.audit.components, run.supplied
    shown = [(name, float(table["lost"][name]) / supplied) for name in _from_tank_to_road(run) if name in table.index]
    shown = [(name, share) for name, share in shown if share > SMALL]
    ax.text(0.03, 0.5, f"supplied\n{supplied / 1e6:.3g} MJ", va="center", fontsize=9)
    left, x = 1.0, 0.35
    _band(ax, 0, x, left)
    for k, (name, share) in enumerate(shown):
        left -= share
        _branch(ax, x, 1 - left, share, f"C{k % 10}")
        text = f"{name}\n{share * supplied / 1e6:.3g} MJ\n{share:.1%}"
        ax.text(x + BEND + share / 2, 1 - left - share - BEND - DOWN - 0.02, text, va="top", ha="center", fontsize=7.5)
        _band(ax, x, x + share + GAP, left)
        x += share + GAP
    ax.set(xlim=(0, x), ylim=(-BEND - DOWN - 0.2, 1.03), aspect="equal")
    ax.set_title(f"{run.title}: {abs(left):.1%} of the energy is stored or lost in small parts", fontsize=10)
    ax.axis("off")
    return ax


def _from_tank_to_road(run: CycleRun) -> list[str]:
    """The components of the vehicle by their distance from engines and stores along the connections; those without power come last."""
    graph = pt.power_flow(run.result, at=run.result.time[0]).graph
    whole = [name.partition(".")[0].partition("[")[0] for name in graph.components]
    meets = [{whole[t.component] for t in graph.terminals if t.node == k} for k in range(len(graph.nodes))]
    starts = (*run.anatomy.engines, *run.anatomy.stores)
    distance = dict.fromkeys((path.partition(".")[0] for path in starts), 0)
    for step in range(1, len(whole) + 1):
        reached = {name for names in meets if any(n in distance for n in names) for name in names}
        distance |= {name: step for name in reached if name not in distance}
    return sorted((name for name, _ in children(run.plant.model)), key=lambda name: distance.get(name, len(whole) + 1))


def _band(ax: Axes, start: float, end: float, height: float) -> None:
    """The remaining energy, with its upper edge at 1."""
    ax.fill([start, end, end, start], [1, 1, 1 - height, 1 - height], color="0.85", lw=0)


def _branch(ax: Axes, x: float, top: float, share: float, colour: str) -> None:
    """A loss whose upper edge is at ``top``, turning downwards."""
    from matplotlib.patches import Rectangle, Wedge

    centre = (x, top - share - BEND)
    ax.add_patch(Wedge(centre, BEND + share, 0, 90, width=share, color=colour, lw=0))
    ax.add_patch(Rectangle((x + BEND, centre[1] - DOWN), share, DOWN, color=colour, lw=0))
