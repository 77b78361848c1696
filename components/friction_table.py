"""Friction characteristics from tables over speed."""

from __future__ import annotations

import math
from typing import TypeAlias

import casadi as ca

from powertrain import Component, Map, ParameterError, Symbol, within

Table: TypeAlias = tuple[tuple[float, float], ...]
"""Rows (speed from 0 up, value)."""

NOT_NEGATIVE = (0.0, math.inf)


def at_speed(
    part: Component,
    name: str,
    w: Symbol,
    units: tuple[str, str],
    column: int = 1,
    allowed: tuple[float, float] = NOT_NEGATIVE,
) -> Symbol:
    """A column of the table ``name`` of ``part`` at |w|: linear between rows, extrapolated by the last two; a single row is a constant.

    ``units``: of speed and value. Errors: ParameterError without rows, and if they do not begin at rest or have a value that is not
    ``allowed``; a simulation ends if the extrapolated value is not allowed.
    """
    where, rows = f"{part._label}.{name}", _rows(part, name)
    speeds, values = [row[0] for row in rows], [row[column] for row in rows]
    try:
        curve = Map.curve(speeds, values, x="speed", x_unit=units[0], unit=units[1], name=name, outside="linear")
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None
    if speeds[0] != 0:
        raise ParameterError(
            f"{where} begins at {speeds[0]:g} {units[0]}; the first row must be at 0 {units[0]}, its value holds at rest"
        )
    (low, high), unit = allowed, f" {units[1]}" if units[1] != "1" else ""
    for speed, value in zip(speeds, values, strict=True):
        if not low <= value <= high:
            limits = "not be negative" if allowed == NOT_NEGATIVE else f"be between {low:g} and {high:g}{unit}"
            raise ParameterError(f"{where}: {value:g}{unit} at {speed:g} {units[0]}; values must {limits}")
    found = curve(ca.fabs(w))
    slope = (values[-1] - values[-2]) / (speeds[-1] - speeds[-2]) if len(speeds) > 1 else 0.0
    if (slope < 0 and low > -math.inf) or (slope > 0 and high < math.inf):
        within(found, low, high, name=f"{name} continued beyond {speeds[-1]:g} {units[0]}", unit=units[1])
    return found


def at_rest(part: Component, name: str) -> float:
    """The first value of the table ``name`` of ``part``. Errors: ParameterError if it has no rows."""
    return _rows(part, name)[0][1]


def _rows(part: Component, name: str) -> tuple[tuple[float, ...], ...]:
    rows: tuple[tuple[float, ...], ...] = getattr(part, name)
    if not rows:
        raise ParameterError(f"{part._label}.{name}: {rows!r} is not a table of rows; give at least one")
    return rows
