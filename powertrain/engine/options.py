"""Checks the options of a run: times, inputs, compilation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from powertrain.dae.hybrid import TimeSignal
from powertrain.dae.tolerances import NOW
from powertrain.engine.prepared import Compile
from powertrain.engine.trajectory import within_span
from powertrain.errors import ParameterError
from powertrain.language.arguments import count, flag, number, positive, row
from powertrain.language.labelled import check_unit
from powertrain.language.reals import Array, sealed

InputValue: TypeAlias = "float | tuple[ArrayLike, ArrayLike]"
"""The value of an input: a number, or (times in s, values); linear between, constant outside, a jump at a repeated time."""


def run_span(start: Any, stop: Any) -> tuple[float, float]:
    """Start and end of a run [s], given as numbers or as texts with a unit."""
    first, last = number("start", start, "s"), number("stop", stop, "s")
    if last < first:
        raise ParameterError(f"stop = {last:g} s is before start = {first:g} s")
    return first, last


def run_times(first: float, last: float, times: ArrayLike | None, points: int) -> Array:
    """The times of the results [s]: those given, or equally spaced ones. ParameterError if they leave the span or decrease."""
    if times is None:
        return np.linspace(first, last, count("points", points) + 1)
    grid = row("times", times)
    if not grid.size:
        return grid
    if not (grid[1:] >= grid[:-1]).all():
        raise ParameterError("times must not decrease")
    return within_span("times: ", grid, first, last)


def longest_step(given: Any, time: float) -> float:
    """The largest step [s]. ParameterError for one that would not advance ``time`` [s]."""
    step, shortest = positive("max_step", given), NOW * max(1.0, abs(time))
    if step < shortest:
        raise ParameterError(
            f"max_step = {step:g} s is shorter than {shortest:g} s, within which instants are the same"
        )
    return step


def scheduled(schedule: TimeSignal, inputs: Mapping[str, InputValue], unit: str) -> TimeSignal:
    """The time signal with the values of the input of its name, in ``unit``. ParameterError for anything but numbers over times."""
    if schedule.name not in inputs:
        return schedule
    value, what = inputs[schedule.name], f"input {schedule.name}"
    wanted = "give a finite number, or (times, values) of equal length with times that do not decrease"
    if callable(value):
        raise ParameterError(
            f"{what} is a function; {wanted}: (times, [{schedule.name.rpartition('.')[2]}(t) for t in times])"
        )
    if isinstance(value, tuple) and len(value) != 2:
        raise ParameterError(f"{what}: {wanted}")
    for part, own in zip(value, ("s", unit), strict=True) if isinstance(value, tuple) else ((value, unit),):
        check_unit(what, part, own)
    try:
        times, values = (row(what, v) for v in (value if isinstance(value, tuple) else ([0.0], [number(what, value)])))
    except ParameterError as error:
        raise ParameterError(f"{error}; {wanted}") from None
    if times.size != values.size or not times.size or (np.diff(times) < 0).any():
        raise ParameterError(f"{what}: {wanted}")
    return replace(schedule, times=sealed(times.copy()), values=sealed(values.copy()))  # results quote their inputs


def compile_option(value: Any) -> Compile:
    """The option ``compile``."""
    return "background" if value == "background" else flag("compile", value, 'True, False or "background"')
