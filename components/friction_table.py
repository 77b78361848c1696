"""Friction characteristics from tables over speed."""

from __future__ import annotations

import math
from typing import TypeAlias

import casadi as ca

from powertrain import Component, Map, ParameterError, Symbol, within

Table: TypeAlias = tuple[tuple[float, ...], ...]
"""Rows (speed from 0 up, value, ...)."""


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

    ``units``: of speed and value. Errors: ParameterError if the rows are not a table of ``allowed`` values that begins at rest; a
    simulation ends if the extrapolated value is not allowed.
    """
    said, (speeds, values) = _said(part, name), _columns(part, name, column)
    try:
        curve = Map.curve(speeds, values, x="speed", x_unit=units[0], unit=units[1], name=name, outside="linear")
    except ParameterError as error:
        raise ParameterError(f"{said}: {error}") from None
    if speeds[0] != 0:
        raise ParameterError(
            f"{said} begins at {speeds[0]:g} {units[0]}; the first row must be at 0 {units[0]}, its value holds at rest"
        )
    low, high = allowed
    for speed, value in zip(speeds, values, strict=True):
        if not low <= value <= high:
            limits = "not be negative" if allowed == NOT_NEGATIVE else f"be between {low:g} and {high:g} {units[1]}"
            raise ParameterError(f"{said}: {value:g} {units[1]} at {speed:g} {units[0]}; values must {limits}")
    found = curve(ca.fabs(w))
    slope = (values[-1] - values[-2]) / (speeds[-1] - speeds[-2]) if len(speeds) > 1 else 0.0
    if (slope < 0 and low > -math.inf) or (slope > 0 and high < math.inf):
        within(found, low, high, name=f"{name} continued beyond {speeds[-1]:g} {units[0]}", unit=units[1])
    return found


def at_rest(part: Component, name: str) -> float:
    """The first value of the table ``name`` of ``part``. Errors: ParameterError if it has no rows of two values."""
    return _columns(part, name, 1)[1][0]


def _columns(part: Component, name: str, column: int) -> tuple[list[float], list[float]]:
    table = getattr(part, name)
    try:
        speeds, values = [float(row[0]) for row in table], [float(row[column]) for row in table]
    except (TypeError, ValueError, IndexError):
        speeds, values = [], []
    if not speeds:
        raise ParameterError(f"{_said(part, name)}: {table!r} is not a table of rows (speed, value, ...)")
    return speeds, values


def _said(part: Component, name: str) -> str:
    return f"{part._path or type(part).__name__}.{name}"
