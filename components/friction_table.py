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

    ``units``: of speed and value. Errors: ParameterError if the rows are not a table of ``allowed`` values; a simulation ends if the
    extrapolated value is not allowed.
    """
    table, said = getattr(part, name), f"{part._path}.{name}".lstrip(".")
    try:
        speeds, values = [float(row[0]) for row in table], [float(row[column]) for row in table]
        curve = Map.curve(speeds, values, x="speed", x_unit=units[0], unit=units[1], name=name, outside="linear")
    except ParameterError as error:
        raise ParameterError(f"{said}: {error}") from None
    except (TypeError, ValueError, IndexError):
        raise ParameterError(f"{said}: {table!r} is not a table of rows (speed, value, ...)") from None
    low, high = allowed
    for speed, value in zip(speeds, values, strict=True):
        if speed < 0 or not low <= value <= high:
            limits = "not negative" if allowed == NOT_NEGATIVE else f"between {low:g} and {high:g} {units[1]}"
            raise ParameterError(
                f"{said}: {value:g} {units[1]} at {speed:g} {units[0]}, but speeds must not be negative and values must be {limits}"
            )
    found = curve(ca.fabs(w))
    slope = (values[-1] - values[-2]) / (speeds[-1] - speeds[-2]) if len(table) > 1 else 0.0
    if (slope < 0 and low > -math.inf) or (slope > 0 and high < math.inf):
        within(found, low, high, name=f"{name} continued beyond {speeds[-1]:g} {units[0]}", unit=units[1])
    return found
