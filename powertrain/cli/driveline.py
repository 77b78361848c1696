"""The map of a whole driveline: its table, its data, its picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from matplotlib.figure import Figure

import powertrain as pt
from powertrain.cli.options import progress
from powertrain.cli.text import columns, number
from powertrain.components.common_units import RPM
from powertrain.components.control import Pedals
from powertrain.trials import CycleRun, drive_cycle
from powertrain.trials.anatomy import parts_of, variators
from powertrain.trials.driveline import driveline_map
from powertrain.trials.driveline_figure import plot_driveline_map

if TYPE_CHECKING:
    import xarray as xr

    from powertrain.components.cycles import DriveCycle

LINES = 15


def mapped(
    model: pt.Component,
    speeds: Any,
    pedals: int,
    *,
    name: str,
    held: Mapping[str, float] | None = None,
    cycle: DriveCycle | None = None,
    run: CycleRun | None = None,
    draw: bool = True,
) -> tuple[str, xr.Dataset, Figure | None]:
    """The text, the data and (where it is to be drawn) the picture of the map of the vehicle ``name``, over speeds [m/s].

    The picture shows the operating points of a ``run``, or of a ``cycle`` that is driven for it.
    """
    if not any(parts_of(model, Pedals)):
        raise click.UsageError(
            f"{type(model).__name__} has no driver whose pedals could be set; choose a vehicle for `powertrain run`"
        )
    unit = next(variators(model), None)
    positions = np.linspace(0, 1, pedals + 1)[1:]
    found = driveline_map(model, speeds, positions, variator=unit, held=held, progress=progress())
    if not np.isfinite(found["efficiency"].values).any():
        raise click.ClickException("the vehicle has no tractive force at any point of this map")
    if cycle is not None and draw:
        run = drive_cycle(model, cycle, progress=progress())
    figure = None
    if draw:
        figure = Figure(figsize=(9, 6), layout="constrained")
        ax = plot_driveline_map(found, run, ax=figure.add_subplot())
        ax.set_title(f"{name}: {_told(found)}")
    return report(found, name), found, figure


def _told(found: xr.Dataset) -> str:
    """Such as "efficiency from the tank to the road"."""
    told = str(found["efficiency"].attrs["long_name"])
    return f"{told[0].lower()}{told[1:]}"


def report(found: xr.Dataset, name: str) -> str:
    """Over speed: the largest force, and the force at which the efficiency is best."""
    rows = []
    for k in range(0, found.sizes["speed"], max(found.sizes["speed"] // LINES, 1)):
        at = found.isel(speed=k)
        efficiency = at["efficiency"].values
        if not np.isfinite(efficiency).any():
            continue
        best = at.isel(accelerator=int(np.nanargmax(efficiency)))
        cells = [float(at.speed) * 3.6, float(at["force"].max()), float(best["force"]), float(best["efficiency"])]
        cells += [float(best["w"]) / RPM, float(best["tau"])]
        rows.append([*(number(cell, 4) for cell in cells), str(best["case"].values) if "case" in found else ""])
    flow = "power flow" if "case" in found else ""
    head = ("speed [km/h]", "largest force [N]", "best at [N]", "efficiency", "turns at [rpm]", "[N.m]", flow)
    solved = np.isfinite(found["force"].values).mean()
    about = f"{name}: {_told(found)}, up to {number(float(found['efficiency'].max()))}"
    return f"{about}; {solved:.0%} of {found['force'].size} points have an operating point\n\n{columns(rows, head, right=range(6))}"
