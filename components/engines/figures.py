"""A plot of the operating map of an engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np

from powertrain.components.common_units import G_KWH, RPM
from powertrain.components.engines.interfaces import Engine
from powertrain.components.engines.operation import FuelLine, best_fuel_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ABOVE_BEST = (1.01, 1.025, 1.05, 1.1, 1.2, 1.35, 1.6, 2.0, 3.0)
"""Contours of equal consumption, relative to the best point."""


def plot_engine_map(
    engine: Engine,
    *,
    ax: Axes | None = None,
    levels: Sequence[float] | None = None,
    line: FuelLine | None = None,
    powers: Sequence[float] = (10e3, 20e3, 40e3, 60e3, 80e3),
    share: float = 1.0,
) -> Axes:
    """Specific fuel consumption [g/kWh] over speed [rpm] and torque [N.m], with full load, motoring, and the line of lowest consumption.

    ``levels`` of the contours [g/kWh] (by default relative to the best point), ``line`` an operating line (by default that of lowest
    consumption up to ``share`` of full load), ``powers`` [W] for which hyperbolas are drawn. Returns the Axes.
    """
    ax = plt.subplots(layout="constrained")[1] if ax is None else ax
    line = best_fuel_line(engine, share=share) if line is None else line
    w = np.linspace(float(engine.w_idle) * 0.8, float(engine.w_limit), 161)
    full, motored = engine.full_load(w), -engine.motoring(w)
    tau = np.linspace(0.02, 1.0, 120)[:, None] * full
    used = engine.bsfc(w, tau) / G_KWH
    best = float(used.min())
    steps = [round(best * x) for x in ABOVE_BEST] if levels is None else list(levels)
    speeds = np.broadcast_to(w / RPM, tau.shape)
    ax.contourf(speeds, tau, used, [best * 0.99, *steps], cmap="viridis_r", alpha=0.35, extend="max")
    lines = ax.contour(speeds, tau, used, steps, colors="0.25", linewidths=0.6)
    ax.clabel(lines, fmt="%.0f", fontsize=8)
    ax.plot(w / RPM, full, "k", linewidth=1.8, label="Full load")
    ax.plot(w / RPM, motored, "k--", linewidth=1.0, label="Motored, no fuel")
    ax.plot(line.speed / RPM, line.torque, color="C3", linewidth=1.8, label="Least fuel")
    for power in powers:
        torque = power / w
        if (inside := torque <= full).any():
            ax.plot(w[inside] / RPM, torque[inside], color="0.75", linewidth=0.7, zorder=0)
            k = int(np.flatnonzero(inside)[-1])
            beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "annotation_clip": False}
            ax.annotate(f"{power / 1e3:.0f} kW", (w[k] / RPM, torque[k]), (5, 0), color="0.45", fontsize=8, **beside)
    y, x = np.unravel_index(int(used.argmin()), used.shape)
    ax.plot(w[x] / RPM, tau[y, x], "+", color="k")
    ax.annotate(
        f"{best:.0f} g/kWh", (w[x] / RPM, tau[y, x]), (-4, 6), textcoords="offset points", fontsize=8, ha="right"
    )
    ax.set(xlabel="Engine speed [rpm]", ylabel="Torque [N.m]", xlim=(0, w[-1] / RPM))
    ax.set_ylim(motored.min() - 0.25 * full.max(), 1.12 * full.max())
    ax.set_title(f"{type(engine).__name__}: specific fuel consumption [g/kWh]", fontsize=10)
    ax.axhline(0, color="0.6", linewidth=0.6)
    ax.legend(loc="lower right", fontsize=8, framealpha=0.9)
    return ax
