"""Friction characteristics given by tables over speed."""

from __future__ import annotations

import math
from typing import TypeAlias

import casadi as ca

from powertrain import Map, Symbol

Table: TypeAlias = tuple[tuple[float, float], ...]
"""Rows (speed in m/s from 0 on, value)."""


def at_speed(table: Table, v: Symbol, unit: str, name: str) -> Symbol:
    """The value at |v|: linear between the rows and continued by the last two; one row is a constant."""
    speeds, values = [row[0] for row in table], [row[1] for row in table]
    return Map.curve(speeds, values, x="v", x_unit="m/s", unit=unit, name=name, outside="linear")(ca.fabs(v))


def stribeck_table(
    F_prop: float, F_Coulomb: float, F_Stribeck: float, fexp: float, v_max: float, rows: int = 100
) -> Table:
    """Friction force F_Coulomb + F_prop v + F_Stribeck exp(-fexp v) at equally spaced speeds from 0 to v_max.

    Units: N.s/m, N, N, s/m, m/s.
    """
    speeds = [v_max * i / (rows - 1) for i in range(rows)]
    return tuple((v, F_Coulomb + F_prop * v + F_Stribeck * math.exp(-fexp * v)) for v in speeds)
