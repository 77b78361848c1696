"""An engine described by two tables: torque over speed and throttle, fuel over speed and torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Literal, Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain import Axis, Equations, Map, Parameter, ParameterError, Symbol, arguments_checked, parameter, within
from powertrain.components.engines.interfaces import Engine
from powertrain.components.engines.tablechecks import (
    RATES,
    SPECIFIC,
    check_efficiency,
    check_fuel,
    check_reach,
    check_torque,
)
from powertrain.components.engines.tablefiles import read_fuel_map, read_torque_map
from powertrain.components.limited import limited

THROTTLES, PARTS = 401, 41
"""Throttles at which a torque is evaluated, and points of the inverse table from torque to throttle."""
Array = NDArray[np.float64]


class MappedEngine(Engine):
    """An engine with measured or computed tables of torque and fuel.

    firing = torque_map(w, u) - torque_map(w, 0),  motoring(w) = -torque_map(w, 0),  full load(w) = torque_map(w, 1)
    fuel_rate = fuel_map(w, firing - motoring), not below zero, times firing/cut_off within 0..1: without firing no fuel

    ``torque_map`` [N.m] is over speed [rad/s] and throttle [1] from 0 (motored, not above zero) to 1. ``fuel_map`` is over speed and
    torque [N.m]: a fuel flow [kg/s] or [g/s], or a specific consumption [g/kWh] or [kg/J] (with positive torques only). Below its
    lowest torque the fuel flow continues the straight line through the two lowest torques at each speed (a Willans line), whatever the
    axis says; if that torque is above zero, the steps below it are counted. Otherwise the axes of a table determine its
    extrapolation: an error, or the torque or specific consumption at the edge, with a count of the steps. Beyond a fuel table the flow
    therefore grows with the power, also if the table gives a flow. ``gasoline`` and ``diesel`` have synthetic tables, see ``synthetic``;
    ``from_csv`` reads files. Errors: ParameterError for tables with other axes, units or edges, and for a rev limiter ``w_limit`` above
    the speeds of the torque table, unless this extrapolates linearly: with the torque of its edge, the power would grow with the speed.
    """

    torque_map: Map
    fuel_map: Map
    cut_off: Parameter = parameter("N.m", "Combustion torque below which the fuel is cut off", default=2.0, above=0)

    @classmethod
    @arguments_checked
    def from_csv(
        cls,
        torque: str | Path,
        fuel: str | Path,
        *,
        displacement: float | str | None = None,
        fill: bool = False,
        outside: Literal["error", "clip"] = "clip",
        method: Literal["linear", "smooth"] = "linear",
        **parameters: Any,
    ) -> Self:
        """An engine from tables such as ``speed [rpm], throttle [%], torque [Nm]`` and ``speed [rpm], torque [Nm], BSFC [g/kWh]``.

        The columns are recognised by their names and units, in any order; see ``read_torque_map`` and ``read_fuel_map``, which also read
        tables whose columns must be named: ``MappedEngine(torque_map=..., fuel_map=...)`` accepts their results.

        Parameters
        ----------
        torque, fuel : path
            The files.
        displacement : float or str, optional
            Displacement of a four-stroke engine [m3], such as "1.6 l", for loads that are given as mean effective pressures.
        fill : bool
            Complete a fuel table whose speeds have torques of their own, see ``read_fuel_map``.
        outside : {"clip", "error"}
            Beyond the speeds and torques of a table, the torque or the specific consumption of its edge is used and the steps are counted,
            or the simulation ends.
        method : {"linear", "smooth"}
            Interpolation.
        **parameters
            Other parameters of the engine; ``w_limit`` is by default the highest speed of the torque table.

        Raises
        ------
        ParameterError
            For errors of these functions, with the file.
        """
        cls._check_names(parameters, "displacement", "fill", "outside", "method")
        torque_map = read_torque_map(torque, outside=outside, method=method)
        fuel_map = read_fuel_map(fuel, displacement=displacement, fill=fill, outside=outside, method=method)
        return cls(torque_map=torque_map, fuel_map=fuel_map, **{"w_limit": torque_map.axes[0].high, **parameters})

    @classmethod
    def gasoline(cls, **parameters: Any) -> Self:
        """A fictitious gasoline engine of 1.6 l, 83 kW. Smooth tables, unless ``method`` says otherwise."""
        return cls._packaged("gasoline_1600", parameters)

    @classmethod
    def diesel(cls, **parameters: Any) -> Self:
        """A fictitious turbocharged diesel engine of 2.0 l, 97 kW."""
        own = {"heating_value": 42.7e6, "fuel_density": 835.0, "co2_per_fuel": 3.16, "w_limit": 490.0, "J": 0.25}
        return cls._packaged("diesel_2000", {**own, "tau_starter": 100.0, **parameters})

    @classmethod
    def _packaged(cls, name: str, parameters: Mapping[str, Any]) -> Self:
        folder = files("powertrain.components").joinpath("engines", "data")
        with as_file(folder / f"{name}_torque.csv") as torque, as_file(folder / f"{name}_fuel.csv") as fuel:
            return cls.from_csv(torque, fuel, **{"method": "smooth", "w_limit": cls.w_limit.default, **parameters})

    def check(self) -> Equations:
        """The engine fires only at speeds of its torque table."""
        yield from super().check()
        yield from self._fires_within(self.torque_map.axes[0])

    def equations(self) -> Equations:
        """The equations of every engine, with these laws."""
        try:
            check_torque(self.torque_map)
            check_fuel(self.fuel_map)
            check_reach(self.torque_map, self.fuel_map)
            if isinstance(heating_value := self._values["heating_value"], float):
                check_efficiency(self.fuel_map, heating_value)
        except ParameterError as error:
            raise ParameterError(f"{self._label}: {error}") from None
        yield from self._run()
        self._count_below(self.fuel_map.axes[1])

    def _count_below(self, axis: Axis) -> None:
        """Count the steps with fuel at a torque below the table, where ``_rates`` extrapolates linearly.

        A table that starts at zero torque is complete: below it the engine burns fuel only in passing.
        """
        if axis.outside != "linear" and axis.low > 0:
            torque = ca.if_else(self.firing > self.cut_off, self.firing - self._motoring(self.w), axis.low)
            name = f"{self.fuel_map.name}: {axis.name} below the table"
            within(torque, axis.low - axis.slack, math.inf, name=name, unit=axis.unit, action="count")

    def _motoring(self, w: Symbol) -> Symbol:
        return -_along_speed(self.torque_map, 0, w)

    def _full_load(self, w: Symbol) -> Symbol:
        return _along_speed(self.torque_map, -1, w)

    def _firing(self, w: Symbol, u: Symbol) -> Symbol:
        return self.torque_map(w, u) + self._motoring(w)

    def _opening(self, w: Symbol, part: Symbol) -> Symbol:
        table = _openings(self.torque_map)
        return table(table.axes[0].clipped(w), limited(part))

    def _fuel_power(self, w: Symbol, firing: Symbol) -> Symbol:
        lowest = float(self.torque_map.values[:, 0].min())
        torque = firing - self._motoring(w)
        speeds, torques = self.fuel_map.axes
        rate = (
            _rates(self.fuel_map, lowest)(w, torque)
            * _beyond(speeds, w)
            * _beyond(torques, ca.fmax(torque, torques.low))
        )
        burning = limited(firing / self.cut_off)
        return burning * ca.fmax(rate, 0) * self.heating_value


def _beyond(axis: Axis, value: Symbol) -> Symbol:
    """A value divided by the edge of the axis that it exceeds; 1 within the edges, and if the table extrapolates."""
    if axis.outside == "linear":
        return Symbol(1.0)
    above = ca.fmax(value / axis.high, 1)
    return above * ca.fmin(value / axis.low, 1) if axis.low > 0 else above


def _along_speed(table: Map, k: int, w: Symbol) -> Symbol:
    """The torque at one throttle; beyond the speeds that at the edge, unless the table extrapolates. Only the table counts steps there."""
    axis = table.axes[0]
    return _column(table, k)(w if axis.outside == "linear" else axis.clipped(w))


@lru_cache(maxsize=64)
def _column(table: Map, k: int) -> Map:
    speeds = table.axes[0]
    axis = Axis(speeds.name, speeds.unit, speeds.points, "linear")
    return Map((axis,), table.values[:, k], "N.m", table.name, table.method)


@lru_cache(maxsize=64)
def _openings(table: Map) -> Map:
    """The throttle over speed and share of the torque of combustion at full load; the smallest if several give it."""
    axis, throttles, parts = table.axes[0], np.linspace(0, 1, THROTTLES), np.linspace(0, 1, PARTS)
    torque = np.asarray(table(np.array(axis.points)[:, None], throttles))
    share = (torque - torque[:, :1]) / (torque[:, -1:] - torque[:, :1])
    rising = np.maximum.accumulate(share, axis=1)
    rows = [np.interp(parts, *_strictly(row, throttles)) for row in rising]
    axes = Axis(axis.name, axis.unit, axis.points, "clip"), Axis("part", "1", parts, "clip")
    return Map(axes, rows, "1", "throttle")


def _strictly(shares: Array, throttles: Array) -> tuple[Array, Array]:
    """The points at which the share is larger than at all points before."""
    first = np.concatenate([[True], np.diff(shares) > 0])
    return shares[first], throttles[first]


@lru_cache(maxsize=64)
def _rates(table: Map, lowest: float) -> Map:
    """The fuel flow in kg/s, extended to a torque below all that occur by the straight line through the two lowest."""
    w, tau = np.array(table.axes[0].points), np.array(table.axes[1].points)
    values = table.values * {**RATES, **SPECIFIC}[table.unit]
    if table.unit in SPECIFIC:
        values = values * w[:, None] * tau
    step = tau[1] - tau[0]
    below = tau[0] - step * np.arange(max(math.ceil((tau[0] - lowest) / step), 0), 0, -1)
    slope = (values[:, 1] - values[:, 0]) / step
    lower = values[:, :1] + slope[:, None] * (below - tau[0])
    axes = table.axes[0], Axis("torque", "N.m", np.concatenate([below, tau]), table.axes[1].outside)
    return Map(axes, np.hstack([lower, values]), "kg/s", table.name, table.method)
