"""Plots of a shift: speeds, torques, acceleration and slip power; and of all shifts of a run: jerk and slip energy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import powertrain as pt
from powertrain.components.common_units import RPM
from powertrain.figures.plot import axes_of
from powertrain.trials.anatomy import anatomy
from powertrain.trials.shifts import AFTER, clutch_to_clutch, duration, shift_quality, shifts

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE = 0.2
"""Time shown before a shift [s]."""
POINTS = 2001
CARRIES = 1.0
"""Torque [N.m] above which a shift element is shown."""


def plot_shift(result: pt.Result[Any], number: int = 1, *, axes: Any = None) -> list[Axes]:
    """One shift of a run: speeds, torques of the shift elements, acceleration of the vehicle, slip power over time.

    ``number`` counts the shifts of ``trials.shifts`` from 1. Returns the four Axes. Errors: ParameterError if there is no such shift.
    """
    import matplotlib.pyplot as plt

    table, model = shifts(result), result.model
    if number not in table.index:
        raise pt.ParameterError(f"the run has {len(table)} shift{'s' * (len(table) != 1)}; there is no shift {number}")
    row, box = table.loc[number], clutch_to_clutch(model)
    axes = plt.subplots(4, 1, figsize=(7.5, 9), sharex=True, layout="constrained")[1] if axes is None else axes
    stop = row["time"] + duration(result) + AFTER
    t = np.linspace(max(row["time"] - BEFORE, result.time[0]), min(stop, result.time[-1]), POINTS)
    speed, torque, acceleration, slip = axes
    for engine in anatomy(model).engines:
        speed.plot(t, result.at(t, f"{engine}.w") / RPM, label=engine)
    speed.plot(t, result.at(t, f"{box}.w_in") / RPM, label="input of the gearbox")
    speed.plot(t, result.at(t, f"{box}.w_ref") / RPM, "k--", linewidth=0.8, label="reference")
    speed.set_ylabel("Speed [rpm]")
    speed.set_title(f"Shift from gear {row['from']:.0f} to gear {row['to']:.0f}", fontsize=10)
    for name, path in model._values[box].friction_elements().items():
        tau = result.at(t, f"{box}.{path}.tau")
        if np.abs(tau).max() > CARRIES:
            torque.plot(t, tau, label=name)
            slip.plot(t, result.at(t, f"{box}.{path}.lossPower") / 1e3, label=name)
    torque.set_ylabel("Torque [N.m]")
    v = result.at(t, f"{anatomy(model).the('body')}.v")
    acceleration.plot(t, np.gradient(v, t))
    acceleration.set_ylabel("Acceleration [m/s²]")
    slip.set_ylabel("Slip power [kW]")
    slip.set_xlabel("Time [s]")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.axvspan(row["time"], stop - AFTER, color="0.92", zorder=0)
    for ax in (speed, torque):
        ax.legend(fontsize=8, loc="best")
    return list(axes)


def plot_shift_quality(result: pt.Result[Any], *, ax: Axes | None = None) -> Axes:
    """Jerk over slip energy of all shifts of a run: upshifts and downshifts, labelled with their gears.

    Errors: ParameterError for a run without shifts.
    """
    table = shift_quality(result)
    if table.empty:
        raise pt.ParameterError("plot_shift_quality: the run has no shifts")
    ax = axes_of(ax, (7, 4.5))
    up = table["to"] > table["from"]
    for part, marker, said in ((table[up], "^", "upshifts"), (table[~up], "v", "downshifts")):
        ax.scatter(part["slip energy"] / 1e3, part["jerk"], marker=marker, label=said, alpha=0.8)
    for _, row in table.nlargest(5, "jerk").iterrows():
        ax.annotate(
            f"{row['from']:.0f}-{row['to']:.0f}",
            (row["slip energy"] / 1e3, row["jerk"]),
            textcoords="offset points",
            xytext=(5, 3),
            fontsize=8,
        )
    ax.set_xlabel("Slip energy [kJ]")
    ax.set_ylabel("Jerk [m/s³]")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8)
    return ax
