"""Quality of the shifts of a run: jerk and slip energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

import powertrain as pt
from powertrain.components.control import Shifting, SpeedSchedule
from powertrain.components.transmissions import ClutchToClutch
from powertrain.language.arguments import of_kind
from powertrain.language.component import children
from powertrain.trials.anatomy import anatomy

RATE = 1000
"""Samples per second."""
SPAN = 0.1
"""Time [s] over which accelerations and their changes are averaged: about what a person resolves."""
AFTER = 0.3
"""Time [s] after the end of a shift that still belongs to a shift."""


def shifts(result: pt.Result[Any]) -> pd.DataFrame:
    """The gear changes of a run: one row per shift, with its time [s] and the gears before and after it.

    Errors: ParameterError for a vehicle without a schedule that shifts.
    """
    of_kind("shifts", result, pt.Result, "the result of a simulation, run.result of a drive cycle")
    schedule = shifting(result.model)
    if not isinstance(result.model._values[schedule], SpeedSchedule):
        raise pt.ParameterError(f"{type(result.model).__name__}.{schedule} does not shift")
    time, gear = result.time, result[f"{schedule}.gear"]
    at = np.flatnonzero(np.diff(gear))
    rows = {"time": time[at + 1], "from": gear[at].astype(int), "to": gear[at + 1].astype(int)}
    return pd.DataFrame(rows, index=pd.RangeIndex(1, at.size + 1, name="shift"))


def shift_quality(result: pt.Result[Any]) -> pd.DataFrame:
    """Jerk and slip energy of every shift of a run with a ``ClutchToClutch`` gearbox.

    Columns besides those of ``shifts``: "jerk" [m/s3], the largest change of the vehicle's acceleration (averaged over 0.1 s) within 0.1 s,
    divided by 0.1 s; "slip energy" [J], the heat of the clutches and brakes of the gearbox; "slip time" [s], the time for which they
    slip. A shift counts until 0.3 s after its end, or until the next one begins.
    Errors: ParameterError for a vehicle without such a gearbox, or without a schedule that shifts.
    """
    table, box, model = shifts(result), clutch_to_clutch(result.model), result.model
    lasting = duration(result) + AFTER
    speed = f"{anatomy(model).the('body')}.v"
    losses = [f"{box}.{path}.lossPower" for path in model._values[box].friction_elements().values()]
    found: dict[str, list[float]] = {"jerk": [], "slip energy": [], "slip time": []}
    for start, next_one in zip(table["time"], [*table["time"][1:], result.time[-1]], strict=False):
        stop = min(start + lasting, next_one)
        t = np.arange(start, stop, 1 / RATE)
        heat = np.sum(list(result.at(t, losses).values()), axis=0)
        found["slip energy"].append(float(np.trapezoid(heat, t)))
        found["slip time"].append(float((heat > 1e-3).sum()) / RATE)
        found["jerk"].append(_jerk(result, speed, start, stop))
    return table.assign(**found)


def _jerk(result: pt.Result[Any], speed: str, start: float, stop: float) -> float:
    """Largest second difference of the speed over ``SPAN`` [m/s3]."""
    middle = np.arange(max(start, result.time[0] + SPAN), stop - SPAN, 1 / RATE)
    before, now, after = (result.at(middle + k * SPAN, speed) for k in (-1, 0, 1))
    return float(np.abs(after - 2 * now + before).max(initial=0.0)) / SPAN**2


def duration(result: pt.Result[Any]) -> float:
    """The time that a shift takes [s]."""
    name = shifting(result.model)
    return float(sum(result.parameters[f"{name}.{stage}"] for stage in result.model._values[name].stages))


def shifting(model: pt.Component) -> str:
    """The field with the schedule."""
    return _field(model, Shifting, "a schedule that shifts")


def clutch_to_clutch(model: pt.Component) -> str:
    """The field with the gearbox. Errors: ParameterError for a vehicle whose gearbox has no clutch-to-clutch shifts."""
    return _field(model, ClutchToClutch, "a gearbox of clutches that hand over, an Automatic or a DualClutchGearbox")


def _field(model: pt.Component, kind: type[pt.Component], said: str) -> str:
    for name, part in children(model):
        if isinstance(part, kind):
            return name
    raise pt.ParameterError(f"{type(model).__name__} does not have {said}")
