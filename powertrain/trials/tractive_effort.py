"""The tractive-effort diagram: what a vehicle pulls in each gear, and what the road resists on each grade."""

from __future__ import annotations

from collections.abc import Mapping
from reprlib import repr as short
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.components.body.path import STEEPEST
from powertrain.language.arguments import by_name, row
from powertrain.language.reals import Array
from powertrain.trials.anatomy import anatomy, value_at
from powertrain.trials.gears import gear_maps, is_geared
from powertrain.trials.operating import operating_map
from powertrain.trials.resistance import mass, resistance

if TYPE_CHECKING:
    import xarray as xr

GRADES = 0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3
"""Grades tan(alpha) of a diagram."""


def tractive_effort(
    vehicle: pt.Component,
    speeds: ArrayLike,
    grades: ArrayLike = GRADES,
    *,
    held: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Tractive force with the accelerator fully pressed in each gear, and the resistance on each grade, over speed.

      force: of all wheels on the road, at constant speed, less the rolling resistance of the wheels, and the
      resistance of trailers, on a level road
      resistance = resistance of the body(v) + m g sin(alpha),  tan(alpha) = grade,  m: the body and its trailers
      speed_on_grade: the highest speed at which the largest force of all gears equals the resistance

    The forces are operating points on a rolling road, as those of ``driveline_map``: the wheels do not slip, and batteries have their
    initial charge. Source of the diagram: H. Naunheimer et al., Automotive Transmissions, 2nd ed., Springer 2011.

    Parameters
    ----------
    vehicle : Component
        A vehicle with a body, pedals and an engine or a machine. One without a gear schedule has a single line.
    speeds : array_like
        Speeds of the vehicle [m/s], increasing. At rest rolling resistance holds any force, so they are above 0.
    grades : array_like
        Grades tan(alpha), 0.06 for 6 %.
    held : mapping of str to float, optional
        Values of discrete variables of a hybrid, as for ``driveline_map``.

    Returns
    -------
    xarray.Dataset
        ``force`` [N] over ``gear`` and ``speed``, nan where a gear has no operating point; ``resistance`` [N] over ``grade`` and ``speed``;
        ``speed_on_grade`` [m/s] over ``grade``, nan where it is not within ``speeds``.

    Raises
    ------
    ParameterError
        For speeds that are not positive or do not increase, for grades above 100 %, and for vehicles without a ``driveline_map``.
    """
    import xarray as xr

    parts, held = anatomy(vehicle), by_name("held", held)
    v, slopes = row("speeds", speeds), row("grades", grades)
    if v.size < 2 or not ((np.diff(v) > 0).all() and v[0] > 0):
        raise pt.ParameterError(f"speeds = {short(v.tolist())}: give two or more speeds [m/s] above 0 that increase")
    if (np.abs(slopes) > STEEPEST).any():
        raise pt.ParameterError(f"grades = {short(slopes.tolist())}: grades are the tangent of the slope, 0.06 for 6 %")
    pedal = np.ones(1)
    maps = (
        gear_maps(vehicle, v, pedal, held=held) if is_geared(vehicle) else [operating_map(vehicle, v, pedal, held=held)]
    )
    force = np.array([one["force"].values[:, 0] for one in maps])
    body = value_at(vehicle, parts.the("body"))
    weight = mass(vehicle) * float(body.g) * slopes / np.sqrt(1 + slopes**2)
    against = weight[:, None] + resistance(body, v)
    reached = [_highest(v, np.fmax.reduce(force) - line) for line in against]
    found = xr.Dataset(
        {
            "force": (("gear", "speed"), force, {"units": "N", "long_name": "Tractive force"}),
            "resistance": (("grade", "speed"), against, {"units": "N", "long_name": "Resistance"}),
            "speed_on_grade": ("grade", reached, {"units": "m/s", "long_name": "Highest constant speed"}),
        }
    )
    return found.assign_coords(
        gear=("gear", np.arange(1, len(maps) + 1), {"units": "1", "long_name": "Gear"}),
        speed=("speed", v, {"units": "m/s", "long_name": "Speed"}),
        grade=("grade", slopes, {"units": "1", "long_name": "Grade"}),
    )


def _highest(v: Array, surplus: Array) -> float:
    """The highest speed at which a surplus of force falls through zero, interpolated; nan if there is none."""
    (rows,) = np.nonzero((surplus[:-1] > 0) & (surplus[1:] <= 0))
    if not rows.size or surplus[-1] > 0:
        return float("nan")
    k = rows[-1]
    return float(v[k] + surplus[k] / (surplus[k] - surplus[k + 1]) * (v[k + 1] - v[k]))
