"""Drives a vehicle over a cycle."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.language.arguments import by_name
from powertrain.present import Bar, Watch
from powertrain.trials.anatomy import anatomy, value_at
from powertrain.trials.cycle_run import RATE, CycleRun
from powertrain.trials.lost_gear import lost_gear
from powertrain.trials.standing import standing
from powertrain.trials.starting import checked_starts

TOLD = 100.0
"""Distance [m] above which the consumption so far is displayed."""


def drive_cycle(
    vehicle: pt.Component | pt.Plant[Any],
    cycle: DriveCycle | str | PathLike[str] | None = None,
    *,
    parameters: dict[str, float] | None = None,
    starts: Mapping[str, Any] | None = None,
    progress: bool | Watch = False,
    name: str = "",
    **options: Any,
) -> CycleRun:
    """Drive a vehicle over a cycle.

    Grades or heights of a cycle become the road of the vehicle. If the vehicle cannot follow a cycle, it drives as well as it can. If the
    simulation ends early, the run so far is kept and ``message`` gives the reason; it also reports an engine that stands although it is on,
    a vehicle that did not move, and a gear that was not engaged.

    Parameters
    ----------
    vehicle : Component or Plant
        A vehicle with a body, a driver and a cycle.
    cycle : DriveCycle or str, optional
        A cycle, the name of a legislated one, or a CSV file (``DriveCycle.from_csv``); by default the one of the vehicle.
    parameters : mapping of str to float, optional
        Values that replace those of the vehicle.
    starts : mapping of str to float, optional
        Initial values by name: ``{"battery.soc": 0.95}`` starts with a charged battery, ``{"cooling.T": "20 degC"}`` with a cold engine.
    progress : bool or callable
        A progress bar with distance and consumption so far, or a function that is given the run at the time reached (``pt.Present``).
    name : str
        The name of the vehicle in figures and pages; by default that of its class.
    **options
        Other options of ``pt.simulate``.

    Returns
    -------
    CycleRun
        Has ``table``, ``audit``, ``result`` and ``litres_per_100km``.

    Raises
    ------
    ParameterError
        For wrong names, and for a state of charge outside of 0 to 1.
    ModelError
        If the vehicle cannot be compiled.

    Examples
    --------
    >>> drive_cycle(ManualCar(), "wltc", parameters={"body.m": 1400}).table  # doctest: +SKIP
    """
    if taken := sorted({"stop", "start", "times"} & options.keys()):
        raise pt.ParameterError(
            f"drive_cycle: {taken[0]} is that of the cycle; DriveCycle.part(0, 505) is a part of one"
        )
    anatomy(vehicle.model if isinstance(vehicle, pt.Plant) else vehicle).the("body")  # before it is driven
    if isinstance(vehicle, pt.Plant):
        if cycle is not None:
            raise pt.ParameterError(
                "a compiled vehicle keeps its cycle: pass the vehicle itself to drive another cycle"
            )
        plant = vehicle
    else:
        plant = pt.compile(on_cycle(vehicle, cycle))
    driven: DriveCycle = value_at(plant.model, anatomy(plant.model).the("cycle")).cycle
    start, stop = float(driven.times[0]), float(driven.times[-1])
    times = np.linspace(start, stop, round((stop - start) * RATE) + 1)
    asked = by_name("parameters", parameters)
    values = dict(zip(plant.parameters, plant.parameter_vector(asked).tolist(), strict=True))
    given, message = {name: values[name] for name in asked}, ""
    begun = checked_starts(plant, starts)
    watch = Bar(start, stop, so_far(plant, given)) if progress is True else progress
    try:
        result = plant.simulate(
            stop, start=start, parameters=given, starts=begun, times=times, progress=watch, **options
        )
    except pt.SimulationError as error:
        if not isinstance(error.result, pt.Result) or error.result.time.size < 2:
            raise
        result, message = error.result, str(error)
    message = message or lost_gear(result) or standing(driven, result, anatomy(plant.model))
    return CycleRun(driven, plant, result, given, message, name)


def so_far(plant: pt.Plant[Any], parameters: Mapping[str, float] | None = None) -> Callable[[pt.Present[Any]], str]:
    """A text with distance and consumption at the time that a run has reached; called first at the start of the run."""
    parts, values = anatomy(plant.model), plant.parameters | dict(parameters or {})
    path, begin = f"{parts.the('body')}.s", (math.nan, math.nan)

    def say(now: pt.Present[Any]) -> str:
        nonlocal begin
        litres = sum(now[f"{engine}.fuel"] / values[f"{engine}.fuel_density"] for engine in parts.engines) * 1e3
        begin = (now[path], litres) if math.isnan(begin[0]) else begin
        driven, burnt = now[path] - begin[0], litres - begin[1]
        texts = [f"{driven / 1e3:.1f} km"]
        if parts.engines and driven > TOLD:
            texts.append(f"{burnt / driven * 1e5:.2f} l/100 km")
        texts += [f"{battery} {now[f'{battery}.soc']:.1%}" for battery in parts.batteries]
        return ", ".join(texts)

    return say


def on_cycle(vehicle: pt.Component, cycle: DriveCycle | str | PathLike[str] | None) -> pt.Component:
    """The vehicle on a cycle, by default its own. The road of the cycle becomes its own; that of the earlier cycle is removed."""
    parts = anatomy(vehicle)
    path = parts.the("cycle")
    own: DriveCycle = value_at(vehicle, path).cycle
    driven = own if cycle is None else DriveCycle.of(cycle)
    if driven is not own:
        vehicle = pt.replace(vehicle, {f"{path}.cycle": driven})
    if not (driven.has_road or own.has_road):
        return vehicle
    profile = f"{parts.the('road')}.profile"
    is_own = driven.has_road or value_at(vehicle, parts.the("road")).profile == own.slope()
    return pt.replace(vehicle, {profile: driven.slope()}) if is_own else vehicle
