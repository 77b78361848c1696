"""Losses of an electric machine from its efficiency over speed and torque, the usual form of a data sheet."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from powertrain import Axis, Map, ParameterError, parameter
from powertrain.components.common_units import RPM
from powertrain.components.map_checks import check_units

Array = NDArray[np.float64]
Loss: TypeAlias = "float | str | Map"
"""A loss [W], the same everywhere or a curve."""
LEAST = 0.01
"""Efficiency of a machine at its best point; fractions in a column in percent are below."""
LOSS = parameter("W", "loss", default=0.0, min=0)


def losses_of_efficiency(table: Map, no_load: Loss | None, standstill: Loss | None, where: str) -> Map:
    """The losses [W] at the points of a table of efficiencies; see ``ElectricMachine.from_efficiency``."""
    wanted = "an efficiency [1] over speed [rad/s] and torque [N.m]"
    check_units(table, f"{where}: the table", "1", ("rad/s", "N.m"), wanted)
    speed, torque = table.axes
    w, tau = np.array(speed.points), np.array(torque.points)
    if w[0] < 0:
        raise ParameterError(f"{where}: the table has a speed of {w[0] / RPM:g} rpm; speeds must not be negative")
    turns, loaded = w > 0, tau != 0
    for zero, given, name in (~loaded, no_load, "no_load"), (~turns, standstill, "standstill"):
        if zero.any() and given is None:
            what, axis = ("without torque", torque) if name == "no_load" else ("at rest", speed)
            raise ParameterError(
                f"{where}: an efficiency does not determine the loss {what}, and the table has {axis.name} = 0 {axis.unit}; "
                f"give the loss there, such as {name}='150 W'"
            )
    w, tau, eta = w[turns], tau[loaded], table.values[np.ix_(turns, loaded)]
    _check_efficiencies(w, tau, eta, where)
    power = np.outer(w, tau)
    loss = np.where(power > 0, power * (1 / eta - 1), -power * (1 - eta))
    if no_load is not None:
        place = int(np.searchsorted(tau, 0.0))
        loss = np.insert(loss, place, _along(no_load, w, "rad/s", f"{where}: no_load"), axis=1)
        tau = np.insert(tau, place, 0.0)
    if standstill is not None:
        still = _along(standstill, np.abs(tau), "N.m", f"{where}: standstill")
        if no_load is not None:
            still[tau == 0] = _along(no_load, np.zeros(1), "rad/s", f"{where}: no_load")
        loss, w = np.vstack([still, loss]), np.insert(w, 0, 0.0)
    axes = Axis(speed.name, speed.unit, w, speed.outside), Axis(torque.name, torque.unit, tau, torque.outside)
    return Map(axes, loss, "W", "loss", table.method)


def _check_efficiencies(w: Array, tau: Array, eta: Array, where: str) -> None:
    for i, j in np.argwhere((eta <= 0) | (eta > 1)):
        point = f"an efficiency of {eta[i, j]:g} at {w[i] / RPM:.4g} rpm and {tau[j]:g} N.m"
        advice = (
            "a column in percent is headed efficiency [%]"
            if eta[i, j] > 1
            else "at points beyond the limit of the machine, repeat the efficiency of the nearest point within it"
        )
        raise ParameterError(f"{where}: {point}; it must be above 0 and at most 1; {advice}")
    if eta.max() <= LEAST:
        raise ParameterError(
            f"{where}: the best efficiency is {eta.max():.2%}; a column of fractions such as {100 * eta.max():g} is headed efficiency [1]"
        )


def _along(loss: Loss, points: Array, unit: str, where: str) -> Array:
    """A loss [W] at points of an axis in ``unit``."""
    if not isinstance(loss, Map):
        return np.full(points.size, LOSS.check(loss, where))
    check_units(loss, where, "W", (unit,), f"a loss [W] over [{unit}]")
    return np.asarray(loss(points), float)
