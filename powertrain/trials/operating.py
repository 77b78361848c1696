"""Operating points of a whole driveline on a rolling road, over speed and accelerator."""

from __future__ import annotations

from collections.abc import Container, Mapping
from functools import reduce
from operator import add
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.components.body import Axle, RoadProfile, RollingRoad, TransferCase
from powertrain.components.control import AlwaysOn, EngineSwitch, SetPedals
from powertrain.components.cvu import Actuator, IdealActuator
from powertrain.components.electric import Cooling
from powertrain.components.engines import EngineCooling, WarmEngine
from powertrain.components.transmissions import Shiftable, StartingDevice
from powertrain.language.component import children
from powertrain.language.reals import Array
from powertrain.trials.anatomy import Anatomy, anatomy, charge_at_start, value_at
from powertrain.trials.resistance import mass

if TYPE_CHECKING:
    import xarray as xr


RUNNING = 250.0
"""Initial guess of the speed [rad/s] of a running engine."""


def on_rolling_road(vehicle: pt.Component, held: Container[str] = ()) -> pt.Component:
    """The vehicle with its body on a level rolling road, fixed pedals, a warm running engine, and actuators at their targets.

    ``WarmEngine`` replaces a ``CoolantCircuit``, which may settle above 120 degC at full load and low speed. Wheels do not slip, and those
    of an axle turn together, so losses of tyres and differentials are not included. The brakes are released, so the clutch of a
    ``NeutralIdleConverter`` is closed.
    Errors: ParameterError for a vehicle with discrete variables that are not ``held``, such as the engaged gear, and for a body that moves
    like another mass than its parameter ``m``.
    """
    anatomy(vehicle)  # what is not a vehicle is rejected as everywhere
    _refuse_memory(vehicle, held)
    vehicle = at_constant_speed(vehicle)
    found = anatomy(vehicle)
    body, pedals = found.the("body"), found.the("pedals")
    mass(vehicle)  # what moves like another mass is rejected
    loads: dict[str, Any] = {name: float(getattr(value_at(vehicle, body), name)) for name in ("m", "front_share", "g")}
    return pt.replace(vehicle, {body: RollingRoad(**loads), pedals: SetPedals()})


def at_constant_speed(vehicle: pt.Component) -> pt.Component:
    """The vehicle with parts for a constant speed on a level road."""
    parts = {name: getattr(vehicle, name) for name in vehicle._fields}
    return pt.replace(vehicle, {name: part for name, old in parts.items() if (part := _steady(old)) is not old})


def mapped_model(vehicle: pt.Component, held: Container[str] = ()) -> pt.Component:
    """``on_rolling_road`` of a vehicle that has operating points.

    Errors: ParameterError for a vehicle with energy stores other than batteries, and those of ``on_rolling_road``.
    """
    check_stores(vehicle)
    return on_rolling_road(vehicle, held)


def check_stores(vehicle: pt.Component) -> None:
    """Errors: ParameterError for a vehicle with energy stores other than batteries."""
    parts = anatomy(vehicle)
    for store in set(parts.stores) - set(parts.batteries):
        raise pt.ParameterError(
            f"{parts.vehicle} has no map of operating points: {store} takes and gives power only while its speed changes"
        )


def _steady(part: Any) -> Any:
    """The replacement of a part at constant speed on a level road."""
    if isinstance(part, Actuator):
        return IdealActuator(ratio_min=float(part.ratio_min), ratio_max=float(part.ratio_max))
    if isinstance(part, Axle | TransferCase | Shiftable | StartingDevice):
        return part.lumped()
    if isinstance(part, RoadProfile):
        return RoadProfile()
    if isinstance(part, EngineCooling):
        return WarmEngine()
    if isinstance(part, Cooling):
        return part.steady()
    return AlwaysOn() if isinstance(part, EngineSwitch) else part


def _refuse_memory(vehicle: pt.Component, held: Container[str]) -> None:
    part, left = remembered(vehicle, held)
    if left:
        options = " ".join(f"--held {name}=1" for name in left)
        raise pt.ParameterError(
            f"{type(vehicle).__name__} has no map of operating points over speed and accelerator alone: {part} "
            f"depends on its history. Give a value for {' and '.join(left)}: held={dict.fromkeys(left, 1)}, or powertrain map {options}"
        )


def remembered(vehicle: pt.Component, held: Container[str] = ()) -> tuple[str, list[str]]:
    """A part with discrete variables that are not ``held``, and their paths; most vehicles have none.

    Instants of past events make no difference to an operating point; other discrete variables do.
    """
    parts = [(name, getattr(vehicle, name)) for name in vehicle._fields]
    parts = [(name, part) for name, part in parts if isinstance(part, pt.Component) and _steady(part) is part]
    while parts:
        path, part = parts.pop(0)
        own = [
            f"{path}.{name}"
            for name, kind in part._fields.items()
            if isinstance(kind, pt.Discrete) and kind.unit != "s"
        ]
        if left := [name for name in own if name not in held]:
            return f"{path} ({type(part).__name__})", left
        parts = [(f"{path}.{name}", inner) for name, inner in children(part)] + parts
    return "", []


def operating_map(
    vehicle: pt.Component,
    speeds: ArrayLike,
    accelerators: ArrayLike,
    *,
    variator: str | None = None,
    held: Mapping[str, float] | None = None,
    among: Mapping[str, xr.DataArray] | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """``driveline_map`` of a vehicle without gears to shift, also over the parameters ``among``."""
    import xarray as xr

    parts, plant = anatomy(vehicle), pt.compile(mapped_model(vehicle, held or {}))
    body, pedals, mover = parts.the("body"), parts.the("pedals"), _first_mover(parts)
    fuel = [f"{engine}.fuel_rate" for engine in parts.engines]
    electric = [f"{machine}.{name}" for machine in parts.machines for name in ("power", "lossPower")]
    speed, pedal = np.asarray(speeds, float), np.asarray(accelerators, float)
    grid: dict[str, Any] = {f"{body}.speed": speed, f"{pedals}.accelerator_set": pedal}
    grid |= {f"{battery}.soc": charge_at_start(vehicle, battery) for battery in parts.batteries} | dict(held or {})
    grid |= among or {}
    names = {f"{body}.force": "force", f"{mover}.w": "w", f"{mover}.tau": "tau"}
    outputs = [*names, *fuel, *electric]
    given = {name: one.value for name, one in plant.compiled.inputs.items()}
    options: dict[str, Any] = {"first": True, "progress": progress, "inputs": given}
    if held and any(held.values()):  # a running engine is far from the initial state of a hybrid at rest
        options["guesses"] = {f"{engine}.w": RUNNING for engine in parts.engines}
    if variator is not None:
        flow = pt.power_flow(plant, grid, outputs={signal: signal for signal in outputs}, **options)
        data, share = flow.data, flow.variator(variator)
        extra = {"K": share["K"], "case": share["case"]}
    else:
        data, extra = pt.steady(plant, grid, outputs=outputs, **options), {}
    found = xr.Dataset({names[n]: data[n] for n in names} | extra | {"status": data["status"]})
    heat = [data[name] * plant.parameters[name.replace("fuel_rate", "heating_value")] for name in fuel]
    if fuel:
        found["fuel_rate"] = reduce(add, (data[name] for name in fuel))
    power = reduce(add, [*heat, *(data[name] for name in electric)])
    found["power"] = power.assign_attrs(units="W", long_name=f"Power from the {parts.tank}")
    return with_efficiency(_labelled(found, speed, pedal))


def _labelled(found: xr.Dataset, speed: Array, pedal: Array) -> xr.Dataset:
    """A map with the coordinates speed [m/s] and accelerator."""
    found = found.rename({"accelerator_set": "accelerator"}).drop_vars(["speed", "accelerator"], errors="ignore")
    return found.assign_coords(
        speed=("speed", speed, {"units": "m/s", "long_name": "Speed"}),
        accelerator=("accelerator", pedal, {"units": "1", "long_name": "Accelerator pedal"}),
    )


def with_efficiency(found: xr.Dataset) -> xr.Dataset:
    """The map with the efficiency: tractive power over power from the tank or battery."""
    work, power = found["force"] * found["speed"], found["power"]
    told = power.attrs["long_name"].replace("Power", "Efficiency")
    efficiency = (work / power).where((work > 0) & (power > 0))
    return found.assign(efficiency=efficiency.assign_attrs(units="1", long_name=f"{told} to the road"))


def _first_mover(parts: Anatomy) -> str:
    """The path of the prime mover whose speed and torque a map shows."""
    if not parts.prime_movers:
        raise pt.ParameterError(
            f"{parts.vehicle} has no map of operating points: it has neither an engine nor a machine"
        )
    return parts.prime_movers[0]
