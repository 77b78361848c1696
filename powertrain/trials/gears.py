"""Vehicles with a gear schedule, gear by gear: their maps, and the gears that the schedule selects along a cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.control import FixedGear, GearSchedule, PowerShiftSchedule
from powertrain.components.transmissions import Shiftable
from powertrain.trials.operating import operating_map
from powertrain.vehicles.car import GearedCar

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]


SCHEDULES = GearSchedule, PowerShiftSchedule


def is_geared(vehicle: pt.Component) -> bool:
    """Whether a schedule changes the gears of its gearbox."""
    return bool(_named(vehicle, *SCHEDULES) and _named(vehicle, Shiftable))


def _named(vehicle: pt.Component, *kinds: type[pt.Component]) -> str:
    return next((name for name in vehicle._fields if isinstance(getattr(vehicle, name), kinds)), "")


def numbers(vehicle: pt.Component) -> range:
    """Its gear numbers, from 1."""
    box = getattr(vehicle, _named(vehicle, Shiftable))
    return range(1, box.gear_count + 1)


def in_gear(vehicle: pt.Component, k: int) -> pt.Component:
    """The vehicle with gear k permanently engaged."""
    shifting, name = _named(vehicle, *SCHEDULES), _named(vehicle, Shiftable)
    schedule, box = getattr(vehicle, shifting), getattr(vehicle, name)
    held = FixedGear(gear=k, w_open=float(schedule.w_open), w_closed=float(schedule.w_closed))
    return pt.replace(vehicle, {shifting: held, name: box.in_gear(k)})


def held_gears(vehicle: pt.Component, speeds: Array, accelerators: Array, maps: list[xr.Dataset]) -> NDArray[np.intp]:
    """The highest gear that the schedule keeps, over speed [m/s] and accelerator; ``maps`` are those of the gears."""
    last = numbers(vehicle)[-1]
    return np.array([[_Shifter(vehicle, maps, last).kept(float(v), float(p)) for p in accelerators] for v in speeds])


def gear_maps(vehicle: pt.Component, speeds: Array, accelerators: Array) -> list[xr.Dataset]:
    """``operating_map`` of the vehicle in each of its gears.

    Isolated points without an operating point, such as near idle speed where the start clutch begins to hold, are interpolated.
    Errors: ParameterError for such points at the edge of the map, and those of ``operating_map``.
    """
    maps = []
    for k in numbers(vehicle):
        found = operating_map(in_gear(vehicle, k), speeds, accelerators)[["force", "fuel_rate", "w"]]
        found = found.interpolate_na("accelerator").interpolate_na("speed")
        if missing := int(found["force"].isnull().sum()):
            raise pt.ParameterError(f"backward: {missing} points of the map in gear {k} have no operating point")
        maps.append(found)
    return maps


def gears_along(vehicle: Any, times: Array, v: Array, force: Array, maps: list[xr.Dataset]) -> NDArray[np.intp]:
    """The gear, from 1, in every row between two times [s], for speeds [m/s] and forces [N] in the rows.

    The schedule chooses it for the pedal position that gives the force; a long row has the gear in which it ends.
    """
    shifter, gears = _Shifter(vehicle, maps), []
    for begin, end, speed, push in zip(times[:-1], times[1:], v, force, strict=True):
        for t in np.arange(begin, end, min(shifter.dwell, end - begin)):
            shifter.decide(float(t), float(speed), accelerator(maps[shifter.gear - 1], float(speed), float(push)))
        gears.append(shifter.gear)
    return np.array(gears)


class _Shifter:
    """State and rules of a gear schedule."""

    def __init__(self, vehicle: pt.Component, maps: list[xr.Dataset], gear: int = 1) -> None:
        schedule = getattr(vehicle, _named(vehicle, *SCHEDULES))
        self.up, self.down = np.array(schedule.speeds).T
        self.eager, self.relaxed, self.dwell, self.kick, self.patience = (
            float(getattr(schedule, name)) for name in ("eager", "relaxed", "dwell", "kick", "patience")
        )
        self.gear, self.began, self.kicked = gear, -np.inf, -np.inf
        self.per_speed = [_per_speed(found) for found in maps]
        pulls = vehicle.pull_speeds() if isinstance(vehicle, GearedCar) else ([], [])
        if isinstance(schedule, GearSchedule):
            pulls = pulls[0], []
        self.w_up, self.w_down = (values or [0.0] * len(self.up) for values in pulls)

    def kept(self, v: float, pedal: float) -> int:
        """The gear kept at a speed [m/s] and an accelerator position, coming from a higher gear."""
        before = self.gear + 1
        while self.gear < before:
            before, self.began, self.kicked = self.gear, -np.inf, 0.0
            self.decide(0.0, v, pedal)
        return before

    def decide(self, t: float, v: float, pedal: float) -> None:
        """Update the gear at time t [s] for the speed v [m/s] and the accelerator ``pedal``."""
        if t - self.began < self.dwell:
            return
        pressed = max(pedal - self.relaxed, 0) / (1 - self.relaxed)
        now, before = 1 + self.eager * pressed, self.gear
        up, down = self._limits()
        calm = t > self.kicked + self.patience or v > up * (1 + self.eager)
        deep, w = max(pedal - self.kick, 0) / max(1 - self.kick, 1e-6), v * self.per_speed[before - 1]
        spent = before > len(self.up) or w > deep * self.w_up[before - 1]
        over = v > up and w > self.w_up[before - 1] > 0 if before <= len(self.up) else False
        pulls = before > 1 and w < deep * self.w_down[before - 2] * self.down[before - 2] / self.up[before - 2]
        if (v > up * now and calm and spent) or over:
            self.gear += 1
        elif v < min(down * now, self._middle()):
            self.gear -= 1
        elif pedal > self.kick and (v < down * now or pulls):
            self.gear, self.kicked = self.gear - 1, t
        self.began = t if self.gear != before else self.began

    def _limits(self) -> tuple[float, float]:
        up = float(self.up[self.gear - 1]) if self.gear <= len(self.up) else np.inf
        return up, float(self.down[self.gear - 2]) if self.gear > 1 else -np.inf

    def _middle(self) -> float:
        return float(self.up[self.gear - 2] + self.down[self.gear - 2]) / 2 if self.gear > 1 else -np.inf


def _per_speed(found: xr.Dataset) -> float:
    """Engine speed over vehicle speed [rad/m] in a gear, with the start device closed: it only slips the engine faster."""
    moving = found.sel(speed=found["speed"] > 0)
    return float((moving["w"] / moving["speed"]).min())


def accelerator(found: xr.Dataset, v: float, force: float) -> float:
    """The pedal position for a force [N] at the nearest speed of a map; 1 if the force is too large."""
    row = int(np.argmin(np.abs(found["speed"].values - v)))
    forces = np.maximum.accumulate(found["force"].values[row])
    return float(np.interp(force, forces, found["accelerator"].values))
