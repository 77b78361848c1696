"""The efficiency of a whole driveline, from the tank to the road, over speed and tractive force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.component import children
from powertrain.components.body import RoadProfile, RollingRoad
from powertrain.components.control import SetPedals
from powertrain.components.cvu import Actuator, IdealActuator
from powertrain.vehicles.trials.anatomy import anatomy, value_at

if TYPE_CHECKING:
    import xarray as xr

SLOWEST = 2 / 3.6
"""Speed at which maps begin [m/s]."""


def on_rolling_road(vehicle: pt.Component) -> pt.Component:
    """The vehicle with its body on a level rolling road, its pedals set, and its actuators at their demands.

    Errors: ParameterError for a vehicle with a component that depends on its history, such as the engaged gear.
    """
    _refuse_memory(vehicle, vehicle)
    at_rest = {
        name: IdealActuator(ratio_min=float(part.ratio_min), ratio_max=float(part.ratio_max))
        for name in vehicle._fields
        if isinstance(part := getattr(vehicle, name), Actuator)
    }
    level = {name: RoadProfile() for name in vehicle._fields if isinstance(getattr(vehicle, name), RoadProfile)}
    parts = anatomy(vehicle)
    body, pedals = parts.the("body"), parts.the("pedals")
    return pt.replace(
        vehicle, {body: RollingRoad(m=float(value_at(vehicle, body).m)), pedals: SetPedals(), **at_rest, **level}
    )


def _refuse_memory(vehicle: pt.Component, whole: pt.Component, path: str = "") -> None:
    for name, part in children(whole):
        held = [n for n, kind in part._fields.items() if isinstance(kind, pt.Discrete)]
        if held:
            raise pt.ParameterError(
                f"{type(vehicle).__name__} has no map of operating points: {path}{name} ({type(part).__name__}) depends on its history "
                f"({', '.join(held)}), so speed and accelerator alone do not determine its operation"
            )
        _refuse_memory(vehicle, part, f"{path}{name}.")


def driveline_map(
    vehicle: pt.Component,
    speeds: ArrayLike,
    accelerators: ArrayLike,
    *,
    variator: str | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Operating points of a vehicle over speed [m/s] and accelerator [1]: force, fuel and efficiency from tank to road.

    Dimensions ``speed`` and ``accelerator``; variables ``force`` [N] of the wheels on the road, ``fuel_rate`` [kg/s], ``w`` [rad/s] and
    ``tau`` [N.m] of the engine, ``efficiency`` = force speed/(fuel_rate heating_value), ``status``. With the path of a ``variator`` also
    ``K`` and the ``case`` of its power flow (Yu & Beachley 1986, Fig. 8).

    Points without an operating point are nan, and their status gives the reason. If there are several (in overrun a centrifugal clutch may
    hold, or release the engine to idle), the status says so, and the numbers are those with the clutch holding.
    The vehicle needs a body, pedals and one combustion engine. Errors: those of ``on_rolling_road``.
    Source: pt.steady of the vehicle on a rolling road.
    """
    import xarray as xr

    parts = anatomy(vehicle)
    body, engine = parts.the("body"), parts.the_engine()
    speed, pedal = f"{body}.speed", f"{parts.the('pedals')}.accelerator_set"
    names = {f"{body}.force": "force", f"{engine}.fuel_rate": "fuel_rate", f"{engine}.w": "w", f"{engine}.tau": "tau"}
    plant = pt.compile(on_rolling_road(vehicle))
    grid = {speed: np.asarray(speeds, float), pedal: np.asarray(accelerators, float)}
    outputs: dict[str, Any] = {signal: signal for signal in names}
    if variator is not None:
        flow = pt.power_flow(plant, grid, outputs=outputs, first=True, progress=progress)
        data, share = flow.data, flow.variator(variator)
        extra = {"K": share["K"], "case": share["case"]}
    else:
        data, extra = pt.steady(plant, grid, outputs=list(outputs), first=True, progress=progress), {}
    found = xr.Dataset({names[n]: data[n] for n in names} | extra | {"status": data["status"]})
    found = found.rename({"accelerator_set": "accelerator"}).drop_vars(["speed", "accelerator"], errors="ignore")
    found = found.assign_coords(
        speed=("speed", grid[speed], {"units": "m/s", "long_name": "Speed"}),
        accelerator=("accelerator", grid[pedal], {"units": "1", "long_name": "Accelerator pedal"}),
    )
    heat = found["fuel_rate"] * plant.parameters[f"{engine}.heating_value"]
    work = found["force"] * found["speed"]
    found["efficiency"] = (work / heat).where((work > 0) & (heat > 0))
    found["efficiency"].attrs = {"units": "1", "long_name": "Efficiency from the tank to the road"}
    return found
