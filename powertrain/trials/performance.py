"""Full-load performance of a vehicle: acceleration, top speed, gradeability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.common_units import KM_H, MPH
from powertrain.components.control import SetPedals
from powertrain.language.arguments import number, of_kind
from powertrain.trials.anatomy import anatomy
from powertrain.trials.lost_gear import lost_gear
from powertrain.trials.starting import checked_starts, empty

MOVES = 1.0
"""Distance [m] within the first minute above which a vehicle moves."""
LEFT = 0.1
"""Distance [m] from which a vehicle has left its place: more than what its tyres and half shafts yield."""
CLIMB = 20.0
"""Time [s] within which a vehicle moves off on a slope."""
SETTLED = 1e-3
"""Acceleration [m/s2] below which the top speed is reached."""
STEEPEST = 1.0
"""The steepest slope tan(alpha) tried: 45 degrees."""
ROUND = 1e-9
"""Speeds that differ by less, relatively or in m/s, are equal."""
ACCURACY = pt.parameter("1", "accuracy of the slope", above=0, max=0.5)
"""Accuracy of a gradeability."""


def full_accelerator(
    vehicle: pt.Component, *, starts: Mapping[str, Any] | None = None, **options: Any
) -> pt.Result[Any]:
    """Accelerate from rest with the pedal fully pressed until the top speed is reached, in steps of one minute.

    ``starts``: initial values by name, such as ``{"battery.soc": 0.95}``. ``options`` are those of ``plant.simulate``.
    Errors: SimulationError if that takes more than ten minutes, if the vehicle does not move forward, and if a gear is not engaged.
    """
    if taken := sorted({"stop", "points", "times"} & options.keys()):
        raise pt.ParameterError(f"full_accelerator: {taken[0]} cannot be given: the run ends at the top speed")
    parts = anatomy(vehicle)
    parts.the("body")  # before it is driven
    plant = pt.compile(pt.replace(vehicle, {parts.the("pedals"): SetPedals(accelerator_set=1)}))
    begun, reached = checked_starts(plant, starts), 0.0
    for minutes in range(1, 11):
        result = plant.simulate(60.0 * minutes, starts=begun, points=6000 * minutes, **options)
        t, v = result.time, _speed(result)
        if lost := lost_gear(result):
            raise pt.SimulationError(lost, result)
        _check_moving(result)
        if v[-1] - v[np.searchsorted(t, t[-1] - 5)] < 5 * SETTLED:
            return result
        reached = float(v[-1])
    raise pt.SimulationError(f"the vehicle still accelerates after ten minutes, at {reached / KM_H:.1f} km/h")


def _check_moving(result: pt.Result[Any]) -> None:
    """SimulationError, with the run, if the vehicle does not move forward."""
    parts, way = anatomy(result.model), _covered(result)
    if way <= -MOVES:
        raise pt.SimulationError(
            f"{parts.vehicle} moves backward: with the accelerator fully pressed it covers {way:.3g} m in {result.time[-1]:.0f} s. "
            "Check the signs of the ratios between engine or machine and wheels",
            result,
        )
    if way < MOVES:
        check = "Check the torque at low speed, what closes the clutch and selects the gear, and what holds the brakes"
        reason = next(filter(None, (empty(result, battery) for battery in parts.batteries)), check)
        raise pt.SimulationError(
            f"{parts.vehicle} does not move: with the accelerator fully pressed it covers {abs(way):.2g} m in "
            f"{result.time[-1]:.0f} s. {reason}",
            result,
        )


def time_between(result: pt.Result[Any], begin: float | str, end: float | str) -> float:
    """Time [s] from passing the speed ``begin`` to passing the speed ``end`` [m/s], rising or falling; nan if the vehicle does not.

    Speeds may be texts such as "60 mph". A run that begins at the speed ``begin`` passes it there. Both are the first times, interpolated
    between the points of the run.
    """
    of_kind("time_between", result, pt.Result, "the result of a simulation, run.result of a drive cycle")
    begin, end = number("begin", begin, "m/s"), number("end", end, "m/s")
    sign = 1.0 if end >= begin else -1.0
    t, v = result.time, sign * _speed(result)
    starts = math.isclose(v[0], sign * begin, rel_tol=ROUND, abs_tol=ROUND)
    first = float(t[0]) if starts else _passed(t, v, sign * begin)
    return _passed(t, v, sign * end, after=first) - first


def _passed(t: NDArray[np.float64], v: NDArray[np.float64], level: float, after: float = -math.inf) -> float:
    """When v first rises through a level; nan if it never does."""
    (rows,) = np.nonzero((v[:-1] < level) & (v[1:] >= level) & (t[1:] >= after))
    if not rows.size:
        return float("nan")
    k = rows[0]
    return float(t[k] + (level - v[k]) / (v[k + 1] - v[k]) * (t[k + 1] - t[k]))


@dataclass(frozen=True)
class Hill:
    """A vehicle on a slope with the accelerator fully pressed. The slope is an input, so one compiled vehicle serves for all slopes."""

    plant: pt.Plant[Any]
    slope: str
    starts: dict[str, float]

    @classmethod
    def of(cls, vehicle: pt.Component, starts: Mapping[str, Any] | None = None) -> Hill:
        """The vehicle without its road, with these initial values."""
        parts = anatomy(vehicle)
        pressed = pt.replace(vehicle, {parts.the("pedals"): SetPedals(accelerator_set=1)})
        plant = pt.compile(pt.bench(pressed, without=[parts.the("road")]))
        return cls(plant, f"{parts.the('road')}.grade", checked_starts(plant, starts))

    def climbed(self, grade: float) -> bool:
        """Whether the vehicle moves off on a slope tan(alpha) = ``grade`` within 20 s.

        Even where the force hardly exceeds the weight: it has left its place, and has not come to rest again.
        """
        try:
            result = self.plant.simulate(CLIMB, inputs={self.slope: grade}, starts=self.starts, points=100)
        except pt.SimulationError as error:
            error.args = (f"on a slope of {100 * grade:.4g} % with the accelerator fully pressed: {error}",)
            raise
        covered = _covered(result)
        return bool(covered > LEFT and _speed(result)[-1] * CLIMB > covered / 2)


def _covered(result: pt.Result[Any]) -> float:
    """Distance from the start [m], negative backward."""
    path = result[f"{anatomy(result.model).the('body')}.s"]
    return float(path[-1] - path[0])


def _speed(result: pt.Result[Any]) -> NDArray[np.float64]:
    """Speed of the vehicle [m/s]."""
    return np.asarray(result[f"{anatomy(result.model).the('body')}.v"])


def gradeability(
    vehicle: pt.Component,
    accuracy: float | str = 0.005,
    *,
    starts: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> float:
    """The steepest slope tan(alpha) on which the vehicle moves off, by bisection. The tyres limit the grip; rigid wheels do not slip.

    ``starts``: initial values by name.

    For a vehicle that moves off on a slope of 1 (45 degrees) the result is 1, which means "at least".
    Errors: ParameterError for an accuracy that is not above 0 and at most 0.5; SimulationError, with the slope, if wheels lift off.
    """
    from tqdm.auto import tqdm

    steps = math.ceil(math.log2(1 / ACCURACY.check(accuracy, "accuracy")))
    hill = Hill.of(vehicle, starts)
    low, high = 0.0, STEEPEST
    for _ in tqdm(range(steps), desc="slopes", disable=not progress):
        middle = (low + high) / 2
        low, high = (middle, high) if hill.climbed(middle) else (low, middle)
    return STEEPEST if high == STEEPEST and hill.climbed(STEEPEST) else low


def performance(
    vehicle: pt.Component,
    run: pt.Result[Any] | None = None,
    *,
    starts: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> pd.DataFrame:
    """Acceleration times (nan if a speed is not passed), top speed and gradeability: value and unit.

    ``starts``: initial values by name, such as ``{"battery.soc": 0.95}``.
    ``run`` is the result of ``full_accelerator``; by default it is computed here. The vehicle needs a body, pedals and a road.
    The top speed is the highest speed reached; an energy store may increase it. A gradeability of 100 % or more is not determined further;
    its unit is then "% or more".
    """
    result = run or full_accelerator(vehicle, starts=starts, progress=progress)
    grade = gradeability(vehicle, starts=starts, progress=progress)
    rows = {
        "0 to 50 km/h": (time_between(result, 1e-3, 50 * KM_H), "s"),
        "0 to 60 mph": (time_between(result, 1e-3, 60 * MPH), "s"),
        "0 to 100 km/h": (time_between(result, 1e-3, 100 * KM_H), "s"),
        "80 to 120 km/h": (time_between(result, 80 * KM_H, 120 * KM_H), "s"),
        "top speed": (float(_speed(result).max()) / KM_H, "km/h"),
        "gradeability": (100 * grade, "% or more" if grade >= STEEPEST else "%"),
    }
    return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "unit"])
