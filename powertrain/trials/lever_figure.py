"""The lever diagrams of a gearset, one per gear.

Theory: H. L. Benford, M. B. Leising, The lever analogy: a new tool in transmission analysis, SAE 810102, 1981.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from powertrain.components.transmissions import HOUSING, GearScheme, Lever
from powertrain.figures.plot import axes_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GAP = 1.6
"""Distance between levers."""
SHAFT = "0.3"


def plot_levers(scheme: GearScheme, gear: str, *, ax: Axes | None = None) -> Axes:
    """The levers of a gearset in one gear: a line over the positions of its members, at the heights of their speeds.

    Members are placed so that the three speeds lie on a line: from the carrier, a is R_o times as far away as b, on the other side if R_o
    is negative; all levers are drawn equally wide. Heights are speeds over input speed; dotted lines mark input and output. The legend
    tells which members the engaged elements join or hold, in parentheses those that do so in overrun only.
    """
    ax = axes_of(ax, (6, 4))
    speeds = scheme.speeds(gear) | {HOUSING: 0.0}
    left = 0.0
    ax.axhline(0, color="0.6", linewidth=0.8)
    for lever in scheme.levers:
        x = dict(zip((lever.a, lever.b, lever.carrier), left + _places(lever), strict=True))
        low, high = min(x, key=lambda name: x[name]), max(x, key=lambda name: x[name])
        ax.plot([x[low], x[high]], [speeds[low], speeds[high]], color="0.55", linewidth=3, solid_capstyle="round")
        aside = -1 if speeds[high] > speeds[low] else 1  # labels stand across the line, not on it
        for name, place in x.items():
            ax.plot(place, speeds[name], "o", color=SHAFT, markersize=5)
            _label(ax, name, (place, speeds[name]), aside)
        left += GAP
    row = scheme.gear(gear)
    for name in (*row.engaged, *row.coast):
        element = next(each for each in scheme.elements if each.name == name)
        shafts = [shaft for shaft in element.joint if shaft != HOUSING]
        joined = "-".join(shafts) if not element.is_brake else f"{shafts[0]} held"
        ax.plot([], [], " ", label=f"({name}: {joined})" if name in row.coast else f"{name}: {joined}")
    ax.axhline(speeds[scheme.input], color="C0", linewidth=0.8, linestyle=":")
    ax.axhline(speeds[scheme.output], color="C2", linewidth=0.8, linestyle=":")
    ax.set_title(f"Gear {gear}: ratio {scheme.ratio(gear):.3f}", fontsize=9)
    ax.set_ylabel("Speed over input speed", fontsize=8)
    ax.set_xticks(
        [GAP * k + 0.5 for k in range(len(scheme.levers))], [lever.name for lever in scheme.levers], fontsize=8
    )
    ax.legend(fontsize=7, handlelength=0, loc="best", framealpha=0.6)
    ax.margins(0.2, 0.3)
    return ax


def _label(ax: Axes, name: str, at: tuple[float, float], aside: int) -> None:
    """A name that runs from a point upwards (1) or downwards (-1)."""
    va: Literal["bottom", "top"] = "bottom" if aside > 0 else "top"
    offset = (1, 4 * aside)
    ax.annotate(name, at, textcoords="offset points", xytext=offset, fontsize=7, rotation=50 * aside, va=va)


def plot_lever_diagrams(scheme: GearScheme) -> list[Axes]:
    """``plot_levers`` of all gears on one page."""
    import matplotlib.pyplot as plt

    columns = min(3, len(scheme.gears))
    rows = math.ceil(len(scheme.gears) / columns)
    grid = plt.subplots(rows, columns, figsize=(4.4 * columns, 3.2 * rows), layout="constrained", squeeze=False)[1]
    drawn = [plot_levers(scheme, gear.name, ax=ax) for gear, ax in zip(scheme.gears, grid.flat, strict=False)]
    for ax in list(grid.flat)[len(drawn) :]:
        ax.set_axis_off()
    return drawn


def _places(lever: Lever) -> np.ndarray:
    """Positions of a, b and the carrier within 0..1: w_a - w_c = R_o (w_b - w_c) puts a R_o times as far from the carrier as b."""
    x = np.array([lever.ratio, 1.0, 0.0])
    return np.asarray((x - x.min()) / np.ptp(x))
