"""Tables of engines from files in the formats of test benches and other programs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from powertrain import Axis, Map, ParameterError, TextTable
from powertrain.components.engines.interfaces import VOLUME
from powertrain.components.engines.tablechecks import check_fuel, check_torque
from powertrain.components.engines.tablecolumns import Column, candidates, column
from powertrain.components.engines.tablepoints import Points
from powertrain.components.engines.widetables import Asked, Roles, long_table

FUEL_ROLES = {"speed": ("speed",), "load": ("torque", "bmep", "power"), "fuel": ("flow", "specific")}
TORQUE_ROLES = {"speed": ("speed",), "throttle": ("throttle",), "torque": ("torque",)}
THROTTLES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Throttles of a table between two curves, as required for smooth interpolation."""
Outside = Literal["error", "clip"]
Method = Literal["linear", "smooth"]


def read_fuel_map(
    path: str | Path,
    *,
    speed: str | None = None,
    load: str | None = None,
    fuel: str | None = None,
    displacement: float | str | None = None,
    strokes: Literal[2, 4] = 4,
    fill: bool = False,
    outside: Outside = "clip",
    method: Method = "linear",
) -> Map:
    """The fuel map of an engine from a table of operating points in a text file.

    torque = bmep displacement/(pi strokes),  torque = power/speed

    The columns are recognised by their names and units, in any order; others are ignored. The load is a torque, a brake mean effective
    pressure (BMEP) or a power, the fuel a flow or a specific consumption; if a table has several of these, the first in this order is
    used. A wide table has the speeds in its first column and the loads in its first line. Empty cells are points without a value.

    Parameters
    ----------
    path : path
        The file, see ``pt.TextTable``.
    speed, load, fuel : str, optional
        Names of columns that are not recognised: ``"Nmot"``, or ``"Nmot [rpm]"`` if the file gives no unit.
    displacement : float or str, optional
        Displacement of the engine [m3], such as "1.6 l", required for loads as BMEP.
    strokes : {4, 2}
        Strokes per cycle.
    fill : bool
        Accept speeds with individual torques, such as those up to full load. At each speed the fuel flow is interpolated linearly to
        the torques of all speeds (of those closer than a thousandth of their range, to one); beyond its own torques it is extrapolated
        linearly, not below zero.
    outside : {"clip", "error"}
        Beyond the speeds and torques of the table, its edge value is used and the steps are counted, or the simulation ends.
    method : {"linear", "smooth"}
        Interpolation.

    Returns
    -------
    pt.Map
        Fuel flow [g/s] or specific consumption [g/kWh] over speed [rad/s] and torque [N.m].

    Raises
    ------
    ParameterError
        For columns that are not found or not unique, points that do not fill the grid, a negative flow, and a specific
        consumption at zero power; the message names the file.
    """
    sheet, columns = _columns(TextTable.read(path), FUEL_ROLES, {"speed": speed, "load": load, "fuel": fuel})
    points = _over_torque(Points.of(sheet, columns), columns[1].kind, displacement, strokes)
    kind, advice = columns[2].kind, "; fill=True continues each speed in straight lines"
    if fill:
        points, kind = _flow(points, kind).filled(), "flow"
    name = sheet.headings[columns[2].place].name
    return _table(points, name, "g/s" if kind == "flow" else "g/kWh", outside, method, advice)


def read_torque_map(
    path: str | Path,
    *,
    speed: str | None = None,
    throttle: str | None = None,
    torque: str | None = None,
    full_load: str | None = None,
    motored: str | None = None,
    outside: Outside = "clip",
    method: Method = "linear",
) -> Map:
    """The torque map of an engine from a table over speed and throttle, or from two curves over speed, in a text file.

    torque = motored + throttle (full load - motored) for two curves; the motored torque must not be above zero

    The columns are recognised as in ``read_fuel_map``. A wide table has the speeds in its first column and the throttles in its first
    line. The curves are used if no column gives a throttle and one gives a torque at full load.

    Parameters
    ----------
    path : path
        The file, see ``pt.TextTable``.
    speed, throttle, torque, full_load, motored : str, optional
        Names of columns that are not recognised, with their unit if the file gives none: ``"alpha [%]"``.
    outside : {"clip", "error"}
        Beyond the speeds of the table, its edge value is used and the steps are counted, or the simulation ends.
    method : {"linear", "smooth"}
        Interpolation.

    Returns
    -------
    pt.Map
        Torque [N.m] over speed [rad/s] and throttle [1].

    Raises
    ------
    ParameterError
        For columns that are not found or not unique, points that do not fill the grid, throttles that do not range from 0
        to 1, and an engine that drives with closed throttle; the message names the file.
    """
    sheet = TextTable.read(path)
    if throttle is None and (full_load or (candidates(sheet, "full load") and not candidates(sheet, "throttle"))):
        return _table(_between(sheet, speed, full_load, motored), "torque", "N.m", outside, method)
    sheet, columns = _columns(sheet, TORQUE_ROLES, {"speed": speed, "throttle": throttle, "torque": torque})
    points = replace(Points.of(sheet, columns), x_name="throttle", x_unit="")
    return _table(points, sheet.headings[columns[2].place].name, "N.m", outside, method)


def _between(sheet: TextTable, speed: str | None, full_load: str | None, motored: str | None) -> Points:
    """Torques at throttles between the motored and the full-load curve."""
    at = column(sheet, "speed", ["speed"], speed)
    full = Points.of(sheet, (at, at, column(sheet, "full load", ["full load"], full_load)))
    closed = Points.of(sheet, (at, at, column(sheet, "motored", ["motored"], motored)))
    if full.lines != closed.lines:
        line = min(set(full.lines) ^ set(closed.lines))
        raise ParameterError(f"{sheet.path}:{line}: one of the torques at full load and motored is missing")
    u = np.repeat(THROTTLES, len(full.lines))
    w, low, high = (np.tile(values, len(THROTTLES)) for values in (full.w, closed.values, full.values))
    return Points(sheet, full.lines * len(THROTTLES), w, u, low + u * (high - low), "throttle", "")


def _columns(sheet: TextTable, roles: Roles, asked: Asked) -> tuple[TextTable, list[Column]]:
    sheet, asked = long_table(sheet, roles, asked)
    return sheet, [column(sheet, role, kinds, asked[role]) for role, kinds in roles.items()]


def _over_torque(points: Points, kind: str, displacement: float | str | None, strokes: int) -> Points:
    """The points over torque instead of mean effective pressure [Pa] or power [W]."""
    path = points.sheet.path
    if strokes not in (2, 4):
        raise ParameterError(f"strokes = {strokes!r}: choose 2 or 4")
    if kind == "bmep":
        if displacement is None:
            raise ParameterError(f"{path}: the load is a mean effective pressure; pass displacement='1.6 l'")
        V = VOLUME.check(displacement, "displacement")
        return replace(points, x=points.x * V / (math.pi * strokes))
    if kind == "power":
        if points.w.min() <= 0:
            raise ParameterError(
                f"{path}:{points.lines[int(points.w.argmin())]}: the load is a power, which gives no torque at 0 rpm"
            )
        return replace(points, x=np.round(points.x / points.w, 9))
    return points


def _flow(points: Points, kind: str) -> Points:
    """The points with their flow [g/s] instead of a specific consumption [g/kWh]."""
    if kind == "flow":
        return points
    if points.x.min() <= 0:
        k = int(points.x.argmin())
        raise ParameterError(
            f"{points.sheet.path}:{points.lines[k]}: a specific consumption at {points.at(k)}, where there is no power; "
            "leave the cell empty"
        )
    return replace(points, values=points.values * points.w * points.x / 3.6e6)


def _table(points: Points, name: str, unit: str, outside: Outside, method: Method, advice: str = "") -> Map:
    w, x, values = points.grid(advice)
    second = Axis(points.x_name, points.x_unit.strip() or "1", x, outside)
    table = Map((Axis("speed", "rad/s", w, outside), second), values, unit, name, method)
    try:
        (check_torque if unit == "N.m" else check_fuel)(table)
    except ParameterError as error:
        raise ParameterError(f"{points.sheet.path}: {error}") from None
    return table
