"""The tractive-effort diagram."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from powertrain.figures.plot import axes_of
from powertrain.language.reals import Array

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def plot_tractive_effort(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """The diagram of ``tractive_effort``: a line [kN] for each gear and for each grade over speed [km/h]; dots mark the highest speeds."""
    ax = axes_of(ax, (7.5, 5))
    speed = found["speed"].values * 3.6
    pull = found["force"] / 1e3
    several = pull.sizes["gear"] > 1
    for k, line in zip(found["gear"].values, pull.values, strict=True):
        ax.plot(speed, line, color=f"C{(k - 1) % 10}", lw=1.5, label=f"gear {k}" if several else "full accelerator")
    top = 1.05 * float(pull.max())
    for grade, line in zip(found["grade"].values, found["resistance"].values / 1e3, strict=True):
        ax.plot(speed, line, color="0.5", lw=0.8)
        _label(ax, f"{100 * grade:.3g} %", speed, line, top)
    reached = found["speed_on_grade"]
    pairs = zip(found["resistance"].values / 1e3, reached.values * 3.6, strict=True)
    ax.plot(reached.values * 3.6, [np.interp(v, speed, line) for line, v in pairs], "o", ms=4, color="k")
    ax.set(xlabel="Speed [km/h]", ylabel="Force [kN]", xlim=(0, speed[-1]), ylim=(0, top))
    ax.grid(visible=True, alpha=0.3)
    ax.legend(loc="upper right", ncols=2 if several else 1, fontsize=8)
    return ax


def _label(ax: Any, text: str, speed: Array, line: Array, top: float) -> None:
    """The grade at the left end of its line, if the line is in the plot."""
    if 0 <= line[0] <= top:
        ax.annotate(text, (speed[0], line[0]), xytext=(2, 2), textcoords="offset points", fontsize=7, color="0.3")
