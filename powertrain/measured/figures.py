"""Predicted over measured fuel economy as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from powertrain.figures.plot import axes_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CYCLES = {"udds": "o", "hwfet": "s"}
COLOURS = {
    "manual": "C0", "automatic": "C1", "dual clutch": "C2", "belt": "C3", "power split": "C4", "electric": "C5"
}  # fmt: skip
BANDS = 0.03, 0.08


def plot_parity(found: pd.DataFrame, *, ax: Axes | None = None) -> Axes:
    """Predicted over measured miles per gallon, logarithmic, from a table with the columns car, transmission, cycle, measured, predicted.

    Circles are the UDDS, squares the HWFET; the bands are 3 % and 8 % on either side of the diagonal.
    """
    ax = axes_of(ax, (7, 6.4))
    ends = np.array([0.93 * found.measured.min(), 1.07 * found.measured.max()])
    for band in BANDS:
        ax.fill_between(ends, ends * (1 - band), ends * (1 + band), color="0.5", alpha=0.15, lw=0)
    ax.plot(ends, ends, color="0.4", lw=0.8)
    for (kind, cycle), rows in found.groupby(["transmission", "cycle"], sort=False):
        label = str(kind) if cycle == "udds" else None
        ax.plot(rows.measured, rows.predicted, CYCLES[str(cycle)], color=COLOURS[str(kind)], ms=5, label=label)
    ax.set(xscale="log", yscale="log", xlim=ends, ylim=ends, aspect="equal")
    ax.set(xlabel="Measured [miles per US gallon]", ylabel="Predicted [miles per US gallon]")
    ticks = [30, 40, 50, 60, 80, 100, 150]
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_ticks(ticks, [str(t) for t in ticks])
        axis.set_ticks([], minor=True)
    for cycle, marker in CYCLES.items():
        ax.plot([], [], marker, color="0.5", ms=5, label=cycle.upper())
    ax.legend(fontsize=8, loc="upper left", title="bands: 3 % and 8 %", title_fontsize=8)
    return ax
