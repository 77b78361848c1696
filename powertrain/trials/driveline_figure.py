"""A plot of the map of a whole driveline, with the operating points of a cycle and the cases of its power flow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from powertrain.components.wheels import Wheel
from powertrain.errors import ParameterError
from powertrain.figures.plot import axes_of
from powertrain.trials.anatomy import parts_of
from powertrain.trials.cycle_run import CycleRun

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

HATCHES = {"split": "", "series": "--", "positive recirculation": "//", "negative recirculation": "\\\\"}
"""Cases of a variator's power flow."""
STEP, CROWDED = 0.01, 0.2
"""Contour spacing of the efficiency, and the share of the operating points, those of least efficiency, where lines would crowd."""
CLEAR = 0.04
"""Least distance of a contour label from the edge and from others, relative to the axes."""
FAINT = (1, 1, 1, 0.35)


def plot_driveline_map(found: xr.Dataset, run: CycleRun | None = None, *, ax: Axes | None = None) -> Axes:
    """Efficiency from the tank or the battery to the road over speed and tractive force, up to the largest force of the vehicle.

    ``found`` is the result of ``driveline_map``. The plot shows the speeds at which all points have an operating point; the cases of a
    power flow are hatched if they are known. The dots are the operating points of a cycle, one per second with a tractive force.
    Raises ParameterError if fewer than two such speeds or two positions of the accelerator are left, or if no force is tractive.
    """
    found = found.isel(speed=found["force"].notnull().all("accelerator").values).sortby(["speed", "accelerator"])
    if min(found["force"].shape) < 2 or not (found["force"] > 0).any():
        raise ParameterError(
            "a driveline map is drawn over two speeds, at which all points have an operating point, and two positions of the accelerator "
            f"at least, and needs a tractive force somewhere; this one has {found.sizes['speed']} and {found.sizes['accelerator']}, and "
            f"forces up to {float(found['force'].max()):.6g} N"
        )
    ax = axes_of(ax, (7.5, 5))
    force = found["force"].values
    speed = np.broadcast_to(found["speed"].values[:, None] * 3.6, force.shape)
    efficiency = np.where(force > 0, found["efficiency"].values, 0.0)
    levels = np.arange(0, np.nanmax(efficiency) + STEP, STEP)
    filled = ax.contourf(speed, force, efficiency, levels=levels, cmap="viridis")
    drawn = levels[levels >= np.quantile(efficiency[force > 0], CROWDED)]
    lines = ax.contour(speed, force, efficiency, levels=drawn, colors="k", linewidths=0.4)
    top = np.nanmax(force, axis=1)
    ax.set(xlim=(0, speed.max()), ylim=(0, 1.05 * np.nanmax(force)))
    _label(ax, lines, drawn[::2], np.vstack([np.column_stack([speed[:, 0], edge]) for edge in (top, 0 * top)]))
    bar = ax.figure.colorbar(filled, ax=ax)
    told = str(found["efficiency"].attrs["long_name"])
    bar.set_label(f"{told[0].lower()}{told[1:]} [1]")
    ax.plot(speed[:, 0], top, color="k", lw=1.5, label="full accelerator")
    handles = _hatch(ax, found, speed, force) if "case" in found else []
    if run is not None:
        _points(ax, run)
    ax.set(xlabel="Speed [km/h]", ylabel="Tractive force [N]")
    ax.legend(handles=[*ax.get_legend_handles_labels()[0], *handles], loc="upper right", fontsize=8)
    return ax


def _label(ax: Axes, lines: Any, levels: Any, edge: Any) -> None:
    """A label on each contour where it is farthest from the edge of the map and from other labels; none where it would touch them."""
    size = np.array([ax.get_xlim()[1], ax.get_ylim()[1]])
    taken, places = edge / size, []
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        if level in levels and len(path.vertices):
            distance = np.hypot(*(path.vertices[:, None] / size - taken).T).min(axis=0)
            if distance.max() > CLEAR:
                places.append(path.vertices[distance.argmax()])
                taken = np.vstack([taken, places[-1] / size])
    if places:
        ax.clabel(lines, levels, fmt="%.2f", fontsize=7, manual=places)


def _hatch(ax: Axes, found: xr.Dataset, speed: Any, force: Any) -> list[Any]:
    from matplotlib.patches import Patch

    handles, cases = [], found["case"].values
    for case, hatch in HATCHES.items():
        if (cases == case).any():
            inside = np.where(cases == case, 1.0, 0.0)
            drawn = ax.contourf(speed, force, inside, levels=[0.5, 1.5], colors="none", hatches=[hatch])
            drawn.set(edgecolor=FAINT, linewidth=0)
            handles.append(Patch(facecolor="none", edgecolor="0.5", hatch=hatch, label=f"variable unit: {case}"))
    return handles


def _points(ax: Axes, run: CycleRun) -> None:
    wheels = list(parts_of(run.plant.model, Wheel))
    time = run.result.time
    seconds = np.searchsorted(time, np.arange(time[0], time[-1]))  # events add samples
    v, pull = run.speed[seconds] * 3.6, np.sum([run.result[f"{wheel}.f"][seconds] for wheel in wheels], axis=0)
    driven = pull > 0
    name = run.cycle.name.upper() if len(run.cycle.name) < 6 else run.cycle.name
    ax.plot(v[driven], pull[driven], ".", ms=3, color="C3", alpha=0.5, label=f"{name}, every second")
