"""A plot of the efficiency map of an electric machine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

from powertrain.components.common_units import RPM
from powertrain.components.electric.machine import ElectricMachine

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_machine_map(
    machine: ElectricMachine,
    *,
    ax: Axes | None = None,
    levels: Sequence[float] = (0.5, 0.7, 0.8, 0.85, 0.88, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97),
) -> Axes:
    """Efficiency over speed [rpm] and torque [N.m], driving (above) and generating (below), within the limits. Returns the Axes."""
    ax = plt.subplots(layout="constrained")[1] if ax is None else ax
    w = np.linspace(0.5, float(machine.w_max), 201)
    limit = machine.full_load(w)
    tau = np.linspace(-1, 1, 241)[:, None] * limit
    speeds, efficiency = np.broadcast_to(w / RPM, tau.shape), machine.efficiency(w, tau)
    ax.contourf(speeds, tau, efficiency, [0.0, *levels, 1.0], cmap="viridis", alpha=0.4)
    lines = ax.contour(speeds, tau, efficiency, levels, colors="0.25", linewidths=0.6)
    ax.clabel(lines, [level for level in levels if level >= 0.85], fmt=lambda x: f"{100 * x:.0f} %", fontsize=8)
    ax.plot(w / RPM, limit, "k", linewidth=1.8, label="Limit")
    ax.plot(w / RPM, -limit, "k", linewidth=1.8)
    ax.axhline(0, color="0.6", linewidth=0.6)
    ax.set(xlabel="Speed [rpm]", ylabel="Torque [N.m]", xlim=(0, 1.02 * w[-1] / RPM))
    ax.set_title("Efficiency of machine and inverter: drives above, generates below", fontsize=10)
    ax.legend(loc="upper right", fontsize=8, framealpha=0.9)
    return ax
