"""Friction characteristics given by tables over speed."""

from __future__ import annotations

from typing import TypeAlias

import casadi as ca

from powertrain import Map, Symbol

Table: TypeAlias = tuple[tuple[float, ...], ...]
"""Rows (speed in rad/s from 0 on, value, ...)."""


def at_speed(table: Table, w: Symbol, unit: str, name: str, column: int = 1) -> Symbol:
    """A column of ``table`` at |w|: linear between the rows and continued by the last two; one row is a constant."""
    speeds, values = [row[0] for row in table], [row[column] for row in table]
    return Map.curve(speeds, values, x="w", x_unit="rad/s", unit=unit, name=name, outside="linear")(ca.fabs(w))
