"""Vehicles with a gear schedule, gear by gear: their maps, and the gears that the schedule selects along a cycle."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.control import FixedGear, SpeedSchedule
from powertrain.components.control.shift_rule import RESUMED, Driving
from powertrain.components.transmissions import Shiftable
from powertrain.language.component import descendants
from powertrain.language.reals import Array
from powertrain.trials.operating import at_constant_speed, operating_map
from powertrain.vehicles.car import ShiftedCar

if TYPE_CHECKING:
    import xarray as xr

CLOSED = 1e-6
"""Slip of a start device that counts as none."""


def is_geared(vehicle: pt.Component) -> bool:
    """Whether a schedule changes the gears of its gearbox."""
    return bool(_named(vehicle, SpeedSchedule) and _named(vehicle, Shiftable))


def _named(vehicle: pt.Component, *kinds: type[pt.Component]) -> str:
    return next((name for name in vehicle._fields if isinstance(getattr(vehicle, name), kinds)), "")


def numbers(vehicle: pt.Component) -> range:
    """Its gear numbers, from 1."""
    box = getattr(vehicle, _named(vehicle, Shiftable))
    return range(1, box.gear_count + 1)


def in_gear(vehicle: pt.Component, k: int) -> pt.Component:
    """The vehicle with gear k permanently engaged."""
    shifting, name = _named(vehicle, SpeedSchedule), _named(vehicle, Shiftable)
    schedule, box = getattr(vehicle, shifting), getattr(vehicle, name)
    alone = box.in_gear(k)
    held = FixedGear(
        gear=min(k, alone.gear_count),
        w_open=float(schedule.w_open),
        w_closed=float(schedule.w_closed),
        kick=float(schedule.kick),
        launch=float(schedule.launch) if k == 1 else 0.0,
    )
    return pt.replace(vehicle, {shifting: held, name: alone})


def held_gears(vehicle: pt.Component, speeds: Array, accelerators: Array, maps: list[xr.Dataset]) -> NDArray[np.intp]:
    """The highest gear that the schedule keeps, over speed [m/s] and accelerator; ``maps`` are those of the gears."""
    shape, shifts = (speeds.size, accelerators.size), _shifts(vehicle)
    v, pedal = np.repeat(speeds, accelerators.size), np.tile(accelerators, speeds.size)
    gear = np.full(v.size, numbers(vehicle)[-1])
    for k in numbers(vehicle)[:0:-1]:
        _, down, kick_down, *_ = shifts(v[None], v[None] * per_speed(maps[k - 1]), pedal[None], k, 0.0, 0.0, 0.0)
        gear[(gear == k) & np.any([down, kick_down], axis=(0, 1))] = k - 1
    return gear.reshape(shape)


def gear_maps(vehicle: pt.Component, speeds: Array, accelerators: Array, **options: Any) -> list[xr.Dataset]:
    """``operating_map`` of the vehicle in each of its gears.

    Gears that differ in nothing but parameters are solved together, which takes half the time. Others, such as those that freewheels
    hold, are solved one at a time.
    """
    cars = [at_constant_speed(in_gear(vehicle, k)) for k in numbers(vehicle)]
    if changes := _changes(cars):
        with suppress(pt.ParameterError):  # what is wrong in every gear is raised below
            found = operating_map(cars[0], speeds, accelerators, among=changes, **options)
            return [found.isel(gear=k, drop=True) for k in range(len(cars))]
    return [operating_map(car, speeds, accelerators, **options) for car in cars]


def _changes(cars: list[pt.Component]) -> dict[str, xr.DataArray]:
    """The parameters in which cars differ, by path along the dimension "gear"; empty if they differ in anything else."""
    import xarray as xr

    values = [_parameters(car) for car in cars]
    if any(one.keys() != values[0].keys() for one in values):
        return {}
    changed = [path for path in values[0] if len({one[path] for one in values}) > 1]
    for car, one in zip(cars, values, strict=True):
        if pt.replace(cars[0], {path: one[path] for path in changed}) != car:
            return {}
    return {path: xr.DataArray([one[path] for one in values], dims="gear") for path in changed}


def _parameters(car: pt.Component) -> dict[str, float]:
    """The parameters of all parts, by path."""
    return {
        f"{path}.{name}".lstrip("."): float(part._values[name])
        for path, part in (("", car), *descendants(car))
        for name, kind in part._fields.items()
        if isinstance(kind, pt.Parameter)
    }


def gears_along(
    vehicle: Any, times: Array, v: Array, force: Array, maps: list[xr.Dataset], *, grades: Array
) -> NDArray[np.intp]:
    """The gear, from 1, in every row between two times [s], for speeds [m/s], forces [N] and slopes tan(alpha) in the rows.

    The schedule chooses it for the pedal position that gives the force; a long row has the gear in which it ends.
    """
    shifter, gears = _Shifter(vehicle, maps), []
    for begin, end, speed, push, grade in zip(times[:-1], times[1:], v, force, grades, strict=True):
        for t in np.arange(begin, end, min(shifter.dwell, end - begin)):
            found = maps[shifter.gear - 1]
            braked = bool(push < overrun(found, float(speed)))
            pedal = accelerator(found, float(speed), float(push))
            shifter.decide(float(t), float(speed), pedal, braked=braked, grade=float(grade))
        gears.append(shifter.gear)
    return np.array(gears)


class _Shifter:
    """A schedule that follows a drive, for engine speeds proportional to the vehicle speed: ``per_speed`` of each gear [rad/m]."""

    def __init__(self, vehicle: pt.Component, maps: list[xr.Dataset]) -> None:
        schedule = getattr(vehicle, _named(vehicle, SpeedSchedule))
        self.dwell, self.per_speed = float(schedule.dwell), [per_speed(found) for found in maps]
        self.shifts = _shifts(vehicle)
        self.gear, self.began, self.kicked, self.slowing = 1, -np.inf, -np.inf, False

    def decide(self, t: float, v: float, pedal: float, *, braked: bool, grade: float) -> None:
        """Update the gear at time t [s] for the speed v [m/s], the pedal position, or the brakes, and the slope tan(alpha)."""
        self.slowing = braked or (self.slowing and pedal <= RESUMED)
        if t - self.began < self.dwell:
            return
        w = v * self.per_speed[self.gear - 1]
        up, down, kick_down, above, below = self.shifts(v, w, pedal, self.gear, t - self.kicked, self.slowing, grade)
        if up or down or kick_down:
            self.gear = int(above if up else below if down else self.gear - 1)
            self.began, self.kicked = t, t if kick_down else self.kicked


def _shifts(vehicle: pt.Component) -> ca.Function:
    """The rule of the schedule as a function of ``Driving``: ``Shifts`` as numbers."""
    schedule = getattr(vehicle, _named(vehicle, SpeedSchedule))
    now = Driving(*(pt.Symbol.sym(name) for name in Driving._fields))
    limits = schedule.kick_limits(now.gear, (), ())
    if isinstance(vehicle, ShiftedCar):
        limits = vehicle.kick_limits(schedule, now.gear)
    return ca.Function("shifts", [*now], [*schedule.shifts(now, limits)])


def per_speed(found: xr.Dataset) -> float:
    """Engine speed over vehicle speed [rad/m] in a gear, with the start device closed: then it is the same for all pedal positions.

    An open clutch lets a pulling engine turn faster, and a converter lets a braking one turn slower.
    """
    moving = found.sel(speed=found["speed"] > 0)
    ratio = moving["w"] / moving["speed"]
    slip = ratio.max("accelerator") / ratio.min("accelerator") - 1
    return float(ratio.where(slip <= slip.min() + CLOSED).min())


def overrun(found: xr.Dataset, v: float) -> float:
    """The force [N] with the accelerator released at the nearest speed of a map; the brakes give what is below it."""
    row = int(np.argmin(np.abs(found["speed"].values - v)))
    return float(found["force"].values[row].min())


def accelerator(found: xr.Dataset, v: float, force: float) -> float:
    """The pedal position for a force [N] at the nearest speed of a map; 1 if the force is too large."""
    row = int(np.argmin(np.abs(found["speed"].values - v)))
    forces = np.maximum.accumulate(found["force"].values[row])
    return float(np.interp(force, forces, found["accelerator"].values))
