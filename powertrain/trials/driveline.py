"""The efficiency of a whole driveline, from the tank or the battery to the road, over speed and tractive force."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr as short
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.language.arguments import by_name, row
from powertrain.trials.anatomy import anatomy
from powertrain.trials.gears import gear_maps, held_gears, in_gear, is_geared
from powertrain.trials.operating import mapped_model, operating_map

if TYPE_CHECKING:
    import xarray as xr

SLOWEST = 2 / 3.6
"""Lowest speed of the maps [m/s]."""


def driveline_map(
    vehicle: pt.Component,
    speeds: ArrayLike,
    accelerators: ArrayLike,
    *,
    variator: str | None = None,
    held: Mapping[str, float] | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Operating points of a vehicle over speed and accelerator: force, input power and efficiency to the road.

    For a vehicle with a gear schedule the map also has the ``gear``: the highest that the schedule keeps at that speed and accelerator.
    Values without an operating point are nan, and the status gives the reason. If there are several (in overrun a centrifugal clutch may
    hold, or release the engine to idle), the status says so, and the values are those with the clutch holding.
    Source: pt.steady of the vehicle on a rolling road.

    Parameters
    ----------
    vehicle : Component
        A vehicle with a body, pedals and one engine or machine.
    speeds : array_like
        Speeds of the vehicle [m/s].
    accelerators : array_like
        Positions of the accelerator [1].
    variator : str, optional
        The path of a variator, whose ``K`` and ``case`` of power flow are added (Yu & Beachley 1986, Fig. 8).
    held : mapping of str to float, optional
        Values of discrete variables of a hybrid, such as ``{"control.running": 1}`` for a running engine.
    progress : bool
        Show a progress bar.

    Returns
    -------
    xarray.Dataset
        Dimensions ``speed`` and ``accelerator``; variables ``force`` [N] of the wheels on the road, ``w`` [rad/s] and ``tau`` [N.m] of
        the engine or machine, ``power`` [W] from the tank (``fuel_rate`` [kg/s] times the heating value) or from the battery at its
        initial charge, ``efficiency`` = force speed/power, and ``status``.

    Raises
    ------
    ParameterError
        For negative speeds, for a vehicle without pedals or body, one whose flywheel has no operating points, and a hybrid whose
        history is not ``held``.
    """
    import xarray as xr

    anatomy(vehicle)  # what is not a vehicle is rejected as everywhere
    held = by_name("held", held)
    speeds, accelerators = row("speeds", speeds), row("accelerators", accelerators)
    if (speeds < 0).any() or not (speeds > 0).any():
        raise pt.ParameterError(
            f"speeds = {short(speeds.tolist())}: give speeds [m/s] from 0 on, at least one of them above 0"
        )
    if not is_geared(vehicle):
        return operating_map(vehicle, speeds, accelerators, variator=variator, held=held, progress=progress)
    maps = gear_maps(vehicle, speeds, accelerators, variator=variator, held=held, progress=progress)
    v, pedal = maps[0]["speed"].values, maps[0]["accelerator"].values
    gear = xr.DataArray(
        held_gears(vehicle, v, pedal, maps), dims=("speed", "accelerator"), attrs={"units": "1", "long_name": "Gear"}
    )
    at = xr.DataArray(np.asarray(gear) - 1, dims=gear.dims)
    return xr.concat(maps, "gear", combine_attrs="override").isel(gear=at).assign(gear=gear)


def check_map(vehicle: pt.Component) -> None:
    """The errors of ``driveline_map`` for such a vehicle with nothing held, before anything is computed."""
    mapped_model(in_gear(vehicle, 1) if is_geared(vehicle) else vehicle)
