"""Requirements on the tables of a ``MappedEngine``: axes, units and edges."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from powertrain import Map, ParameterError
from powertrain.components.common_units import G_KWH, RPM

RATES = {"kg/s": 1.0, "g/s": 1e-3}
SPECIFIC = {"kg/J": 1.0, "g/kWh": G_KWH}
ROUND = 1e-9
"""Allowed deviation of a table's edges."""
SLOW = 5.0
"""Speed [rad/s] that every engine exceeds; the slowest, of ships, reach 8 rad/s."""


def check_torque(table: Map) -> None:
    """Torque over speed and throttle from 0 to 1: not above zero when closed, and larger when open. Errors: ParameterError."""
    _check(table, "torque", ("rad/s", "1"), {"N.m": 1.0})
    throttle = table.axes[1]
    if abs(throttle.low) > ROUND or abs(throttle.high - 1) > ROUND:
        raise ParameterError(
            f"the torque table has throttles from {throttle.low:g} to {throttle.high:g}; they must range from 0 (motored) to 1 (full load)"
        )
    closed = table.values[:, 0]
    if closed.max() > 0:
        w = table.axes[0].points[int(closed.argmax())]
        raise ParameterError(
            f"the torque table gives {closed.max():g} N.m with closed throttle at {w:g} rad/s; a motored engine must not drive"
        )
    opened = table.values[:, -1]
    if (opened <= closed).any():
        k = int((opened - closed).argmin())
        raise ParameterError(
            f"the torque table gives {opened[k]:g} N.m at full load and {closed[k]:g} N.m motored at {table.axes[0].points[k]:g} rad/s; "
            "the torque at full load must be the larger one"
        )
    _check_fast(table, "torque")


def check_fuel(table: Map) -> None:
    """Fuel over speed and torque, not negative, also at positive torques; a specific consumption only there. Errors: ParameterError."""
    _check(table, "fuel", ("rad/s", "N.m"), {**RATES, **SPECIFIC})
    if table.values.min() < 0:
        raise ParameterError(
            f"the fuel table has {table.values.min():g} {table.unit}; the fuel flow must not be negative"
        )
    if table.axes[1].high <= 0:
        raise ParameterError(f"the fuel table ends at {table.axes[1].high:g} N.m; it must contain torques above zero")
    if table.unit in SPECIFIC and table.axes[1].low <= 0:
        raise ParameterError(
            f"the fuel table has a specific consumption at {table.axes[1].low:g} N.m, where there is no power; start above zero"
        )
    _check_idle(table)
    _check_fast(table, "fuel")


def _check_idle(table: Map) -> None:
    """The straight line through the two lowest torques, which gives the fuel below them, must not end above zero torque."""
    w, tau = np.array(table.axes[0].points), np.array(table.axes[1].points[:2])
    flow = table.values[:, :2] * (w[:, None] * tau if table.unit in SPECIFIC else 1)
    without_load = flow[:, 0] - (flow[:, 1] - flow[:, 0]) / (tau[1] - tau[0]) * tau[0]
    if tau[0] > 0 and without_load.min() < -ROUND * flow.max():
        k = int(without_load.argmin())
        raise ParameterError(
            f"the fuel table has {table.values[k, 0]:g} {table.unit} at {tau[0]:g} N.m and {table.values[k, 1]:g} {table.unit} at "
            f"{tau[1]:g} N.m and {w[k] / RPM:.0f} rpm: the straight line through both, which gives the fuel below them, would let "
            "the engine idle without fuel; add lower torques to the table"
        )


def check_reach(torque_map: Map, fuel_map: Map) -> None:
    """The tables must have speeds and torques in common: others are mostly in another unit. Errors: ParameterError."""
    speeds, fuel_speeds = torque_map.axes[0], fuel_map.axes[0]
    if fuel_speeds.low >= speeds.high or fuel_speeds.high <= speeds.low:
        raise ParameterError(
            f"the fuel table has speeds from {fuel_speeds.low:g} to {fuel_speeds.high:g} rad/s, the torque table from {speeds.low:g} to "
            f"{speeds.high:g} rad/s; check the unit of the speeds"
        )
    most, torques = float(torque_map.values.max()), fuel_map.axes[1]
    if torques.low >= most:
        raise ParameterError(
            f"the fuel table has torques from {torques.low:g} to {torques.high:g} N.m, and the torque table none above {most:g} N.m; "
            "check the unit of the torques"
        )


def check_efficiency(table: Map, heating_value: float) -> None:
    """The energy of the fuel must not be less than the work at the crank. Errors: ParameterError with the worst point."""
    speed, torque = np.meshgrid(*(axis.points for axis in table.axes), indexing="ij")
    power = np.maximum(speed * torque, 0)
    heat = (
        table.values * heating_value * (SPECIFIC[table.unit] * power if table.unit in SPECIFIC else RATES[table.unit])
    )
    lacking = power - heat
    if lacking.max() <= 0:
        return
    worst = np.unravel_index(lacking.argmax(), lacking.shape)
    raise ParameterError(
        f"the fuel table has {table.values[worst]:g} {table.unit} at {speed[worst] / RPM:.0f} rpm and {torque[worst]:g} N.m: that "
        f"fuel has {heat[worst] / 1e3:.3g} kW, but the engine gives {power[worst] / 1e3:.3g} kW. Check the unit of the fuel, zeros in "
        f"place of missing points, and heating_value = {heating_value:g} J/kg"
    )


def _check(table: Map, what: str, axes: tuple[str, ...], units: Mapping[str, float]) -> None:
    if tuple(a.unit for a in table.axes) != axes or table.unit not in units:
        said = ", ".join(f"{a.name} [{a.unit}]" for a in table.axes)
        raise ParameterError(
            f"the {what} table gives {table.name} [{table.unit}] over {said}; it must give {what} "
            f"[{'] or ['.join(units)}] over {' and '.join(f'[{unit}]' for unit in axes)}"
        )
    if min(len(a.points) for a in table.axes) < 2:
        raise ParameterError(f"the {what} table needs at least two points on every axis")
    if table.axes[0].low < 0:
        raise ParameterError(
            f"the {what} table has a speed of {table.axes[0].low:g} rad/s; speeds must not be negative"
        )


def _check_fast(table: Map, what: str) -> None:
    """No engine is as slow as one whose 6.000 rpm are read as 6 rpm."""
    if (high := table.axes[0].high) < SLOW:
        raise ParameterError(
            f"the {what} table ends at {high:.3g} rad/s, {high / RPM:g} rpm; check the unit of the speeds, and write 6000 rpm "
            "without a mark for thousands: 6.000 is 6"
        )
