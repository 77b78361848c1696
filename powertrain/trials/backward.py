"""A cycle calculated backward: from the road to the tank, one operating point after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.control import StartStop
from powertrain.components.cycles import DriveCycle
from powertrain.components.transmissions import NeutralIdleConverter, StartingClutch
from powertrain.language.arguments import of_kind
from powertrain.language.component import children
from powertrain.language.reals import Array
from powertrain.trials.anatomy import anatomy, value_at
from powertrain.trials.cycle import on_cycle
from powertrain.trials.driveline import SLOWEST, driveline_map
from powertrain.trials.gears import gear_maps, gears_along, in_gear, is_geared
from powertrain.trials.operating import check_stores, operating_map, remembered
from powertrain.trials.resistance import mass, resistance
from powertrain.vehicles.wheels import wheels_of

if TYPE_CHECKING:
    import xarray as xr

SPEEDS, ACCELERATORS = 46, 61
GAUSS = 5
"""Points of Gauss' formula on a piece of a road."""


@dataclass(frozen=True)
class BackwardRun:
    """Fuel flow [kg/s] and tractive force [N] at the midpoint of every row of a cycle, with the mean slope of the row.

    ``missing`` [N] is the force that the vehicle lacks; ``gears`` are those chosen by its schedule, or 1 without a schedule.
    """

    cycle: DriveCycle
    fuel_rate: Array
    force: Array
    missing: Array
    gears: NDArray[np.intp]

    @property
    def fuel(self) -> float:
        """Fuel [kg]."""
        return float(self.fuel_rate @ np.diff(self.cycle.times))


def backward(vehicle: pt.Component, cycle: DriveCycle | str, found: xr.Dataset | None = None) -> BackwardRun:
    """The fuel for a cycle from a map of operating points, without transients between them.

    force = (m + sum of J/radius^2 of the wheels) a + resistance(v) + m g sin(alpha),  fuel_rate = map(v, force)
    m: the body and its trailers, whose other resistances reduce the force of the map
    braked or in overrun: fuel_rate of accelerator 0

    The resistance is the force that pulls the body of the vehicle along a level road at constant speed. sin(alpha) is the mean over a row
    of the cycle, so rows longer than the hills of the road level them. The brakes hold the vehicle at rest. The map is that of
    ``driveline_map`` (computed here, unless ``found`` is given). Below its lowest speed the start clutch slips: force and fuel there are
    those of the lowest speed. Without a demand the engine idles, against the drag of a converter if there is one and no clutch opens behind
    it; with ``StartStop`` it is off while the vehicle stands. The engine is warm, and its inertia is neglected.
    A vehicle with a ``GearSchedule`` and a ``ManualGearbox`` has one map per gear, computed here. The schedule chooses the gears for the
    speeds of the cycle, the pedal positions for the forces and the mean slope of the row; shifts take no time and no fuel.
    Errors: ParameterError if points of the map have no operating point, for a map of a vehicle with gears, and those of
    ``check_backward``.
    """
    import xarray as xr

    check_backward(vehicle)
    if found is not None:
        of_kind("backward", found, xr.Dataset, "a map of driveline_map()")
        if is_geared(vehicle):
            raise pt.ParameterError(
                f"backward: {type(vehicle).__name__} has a map in each gear, which its schedule selects along the cycle, and one map does "
                "not tell them apart: leave found out"
            )
    cycle = DriveCycle.of(cycle)
    v, force = demand(vehicle, cycle)
    top = 1.02 * cycle.top_speed
    speeds, accelerators = np.linspace(min(SLOWEST, top / 2), top, SPEEDS), np.linspace(0, 1, ACCELERATORS)
    if is_geared(vehicle):
        maps = [_filled(one, k) for k, one in enumerate(gear_maps(vehicle, speeds, accelerators), 1)]
        gears = gears_along(vehicle, cycle.times, v, force, maps, grades=np.tan(np.arcsin(_sines(vehicle, cycle))))
    else:
        maps = [driveline_map(vehicle, speeds, accelerators) if found is None else found]
        gears = np.ones(v.size, np.intp)
    if missing := sum(int(one["force"].isnull().sum()) for one in maps):
        raise pt.ParameterError(
            f"backward: the map of {type(vehicle).__name__} has no operating point at {missing} of its points; "
            "the status in driveline_map(...) says why"
        )
    slowest = float(maps[0]["speed"][0])
    rate, most = np.empty_like(v), np.empty_like(v)
    for k, one in enumerate(maps, 1):
        rows = gears == k
        rate[rows], most[rows] = _look_up(one, np.maximum(v[rows], slowest), force[rows])
    idle = _idle(vehicle)
    rate = np.where(v < slowest, np.where(force > 0, np.maximum(rate, idle), idle), rate)
    if any(isinstance(part, StartStop) for _, part in children(vehicle)):
        rate[v == 0] = 0.0
    return BackwardRun(cycle, rate, force, np.maximum(force - most, 0), gears)


def check_backward(vehicle: pt.Component) -> None:
    """Errors: ParameterError for a vehicle without an engine, and for one whose operating points depend on its history."""
    name = type(vehicle).__name__
    if not anatomy(vehicle).engines:
        raise pt.ParameterError(
            f"backward: {name} has no engine, so it burns no fuel; drive_cycle gives its battery energy"
        )
    check_stores(vehicle)
    part, left = remembered(in_gear(vehicle, 1) if is_geared(vehicle) else vehicle)
    if left:
        raise pt.ParameterError(
            f"backward: the operating points of {name} depend on the history of {part}: {', '.join(left)}. Simulate it with drive_cycle"
        )


def _filled(found: xr.Dataset, gear: int) -> xr.Dataset:
    """The map with isolated points without an operating point interpolated, such as near idle speed where the start clutch begins to hold.

    Errors: ParameterError for such points at its edge.
    """
    found = found[["force", "fuel_rate", "w"]].interpolate_na("accelerator").interpolate_na("speed")
    if missing := int(found["force"].isnull().sum()):
        raise pt.ParameterError(f"backward: {missing} points of the map in gear {gear} have no operating point")
    return found


def demand(vehicle: pt.Component, cycle: DriveCycle) -> tuple[Array, Array]:
    """Speed [m/s] and tractive force [N] of all wheels at the midpoint of every row; of the rotating parts only wheels count."""
    v, a = (cycle.speeds[1:] + cycle.speeds[:-1]) / 2, np.diff(cycle.speeds) / np.diff(cycle.times)
    body = value_at(vehicle, anatomy(vehicle).the("body"))
    return v, _pull(vehicle, v, a) + mass(vehicle) * float(body.g) * _sines(vehicle, cycle)


def _pull(vehicle: Any, v: Array, a: Array) -> Array:
    """The force to pull the body at v, and the force to accelerate the vehicle's mass and the inertia of its wheels by a."""
    body = value_at(vehicle, anatomy(vehicle).the("body"))
    wheels = sum(float(w.J) / float(w.radius) ** 2 for _, w in wheels_of(vehicle))
    return (mass(vehicle) + wheels) * a + resistance(body, v)


def _sines(vehicle: Any, cycle: DriveCycle) -> Array:
    """The mean sin(alpha) of the road in every row; none at rest, where the brakes hold the vehicle."""
    vehicle, places = on_cycle(vehicle, cycle), cycle.places
    steps = np.diff(places)
    road = value_at(vehicle, anatomy(vehicle).the("road"))
    return np.asarray(np.divide(_rises(road.profile, places), steps, out=np.zeros_like(steps), where=steps > 0))


def _rises(profile: pt.Map, places: Array) -> Array:
    """The heights climbed from place to place [m]: the integral of sin(alpha), by Gauss' formula between the points of the map."""
    ends = np.union1d(places, np.clip(profile.axes[0].points, places[0], places[-1]))
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    lengths = np.diff(ends)
    slope = np.asarray(profile(ends[:-1, None] + lengths[:, None] * (1 + nodes) / 2))
    rises = lengths / 2 * (slope / np.sqrt(1 + slope**2) @ weights)
    return np.diff(np.interp(places, ends, np.append(0.0, np.cumsum(rises))))


def _idle(vehicle: Any) -> float:
    """The fuel flow [kg/s] at standstill: against the drag of a converter; of the engine alone if a start clutch opens."""
    braked = {path: StartingClutch() for path, part in children(vehicle) if isinstance(part, NeutralIdleConverter)}
    car = pt.replace(vehicle, braked)  # with the brake pressed a clutch opens behind such a converter
    standing = operating_map(in_gear(car, 1) if is_geared(car) else car, np.zeros(1), np.zeros(1))
    engine, found = value_at(vehicle, anatomy(vehicle).the_engine()), float(standing["fuel_rate"].item())
    return found if np.isfinite(found) else float(engine.fuel_flow(float(engine.w_idle), 0.0))


def _look_up(found: xr.Dataset, v: Array, force: Array) -> tuple[Array, Array]:
    """Fuel flow at (v, force) and the greatest force at v: linear in force along the accelerator, then in speed."""
    speeds, forces, rates = (np.asarray(found[name].values) for name in ("speed", "force", "fuel_rate"))
    k = np.clip(np.searchsorted(speeds, v) - 1, 0, len(speeds) - 2)
    share = (v - speeds[k]) / (speeds[k + 1] - speeds[k])
    rate, most = np.empty_like(v), np.empty_like(v)
    for i in range(len(v)):
        rows = [np.interp(force[i], forces[j], rates[j]) for j in (k[i], k[i] + 1)]
        rate[i] = rows[0] + share[i] * (rows[1] - rows[0])
        most[i] = forces[k[i]].max() + share[i] * (forces[k[i] + 1].max() - forces[k[i]].max())
    return rate, most
