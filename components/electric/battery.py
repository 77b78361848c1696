"""Batteries with an open-circuit voltage over the state of charge and an internal resistance."""

from __future__ import annotations

import math
from typing import Literal

import casadi as ca
import numpy as np

from powertrain import (
    Equations,
    Map,
    Output,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    parameter,
    port,
    signal_output,
    variable,
    within,
)
from powertrain.components.electric.interfaces import DCTerminal
from powertrain.components.evaluation import numbers
from powertrain.components.limited import limited
from powertrain.components.map_checks import check_units
from powertrain.components.thermal import HeatPort, Lossy

CELL = ((0.0, 3.0), (0.05, 3.35), (0.1, 3.47), (0.2, 3.56), (0.4, 3.64), (0.6, 3.78), (0.8, 3.95), (1.0, 4.15))
"""Open-circuit voltage [V] over state of charge of a fictitious lithium-ion cell."""

LOWEST = 0.55
"""Lowest voltage for a control, relative to the open-circuit voltage: at 0.5 the power is largest, 1 % more, and beyond it there is no
voltage."""


def cells_in_series(cells: float) -> Map:
    """The open-circuit voltage of generic (invented) lithium-ion cells; a state of charge outside 0..1 ends a simulation.

    Errors: ParameterError for a number of cells that is not a whole number from 1 on.
    """
    if not isinstance(cells, int | float | np.integer) or cells < 1 or cells % 1:
        raise ParameterError(f"cells_in_series: {cells!r} cells; give a whole number, such as 96 for 350 V")
    volts = [cells * volt for _, volt in CELL]
    return Map.curve([s for s, _ in CELL], volts, x="state of charge", unit="V", name="open-circuit voltage")


class _Battery(Lossy):
    """Partial: charge, open-circuit voltage and limits of a battery."""

    ocv: Map = cells_in_series(56)
    beyond: Literal["count", "error"] = "count"
    Q: Parameter = parameter("A.s", "Capacity", default=6.5 * 3600, above=0)
    i_discharge: Parameter = parameter("A", "Maximum discharge current", default=150.0, above=0)
    i_charge: Parameter = parameter("A", "Maximum charge current", default=100.0, above=0)
    overvoltage: Parameter = parameter(
        "1", "Maximum voltage in charging over the highest of ocv; the default is never reached", default=1e3, min=1
    )
    soc_min: Parameter = parameter("1", "State of charge at which discharge_power is zero", default=0.2, min=0, max=1)
    soc_max: Parameter = parameter("1", "State of charge at which charge_power is zero", default=0.9, min=0, max=1)
    B: Parameter = parameter(
        "K", "Temperature coefficient of the resistance, about 2000 K for lithium-ion cells", default=0.0, min=0
    )
    band: Parameter = parameter(
        "1", "Range of the state of charge in which discharge_power and charge_power fade out", default=0.05, above=0
    )
    bus: DCTerminal = port(DCTerminal)
    state_of_charge: Output = signal_output("1", "State of charge")
    discharge_power: Output = signal_output("W", "Maximum discharge power")
    charge_power: Output = signal_output("W", "Maximum charge power")
    soc: Variable = variable("1", "State of charge", start=0.6)
    i: Variable = variable("A", "Current, positive when charging")

    def check(self) -> Equations:
        """The limits of the state of charge must be in order, and ``ocv`` be that of a battery."""
        _checked_voltage(self.ocv, self._label)
        yield self.soc_min < self.soc_max

    def _cold(self) -> Symbol:
        """Resistance at the temperature of the heat port relative to that at 293.15 K."""
        return ca.exp(self.B * (1 / self.heat_port.T - 1 / HeatPort.reference))

    def _charge(self, R: Symbol, u: Symbol | float, at_once: Symbol) -> Equations:
        """``R`` applies at constant current; behind the instantaneous resistance ``at_once`` the voltage is ``u`` above open circuit."""
        yield self.i == self.bus.i
        yield self.Q * der(self.soc) == self.i
        yield self.state_of_charge.value == self.soc
        U, low, high = self._voltage(), self.soc - self.soc_min, self.soc_max - self.soc
        lowest = ca.fmax(U - R * self.i_discharge, LOWEST * U)
        V_max = self.overvoltage * float(self.ocv.values.max())
        accepted = limited((V_max - U) / R, 0, self.i_charge)
        yield self.discharge_power.value == lowest * (U - lowest) / R * limited(low / self.band)
        yield self.charge_power.value == (U + u + at_once * accepted) * accepted * limited(high / self.band)
        most = "voltage of the battery, which delivers its greatest power at half its open-circuit voltage"
        within(self.bus.v, U / 2, math.inf, name=most, unit="V")
        within(self.bus.v, 0, V_max, name="voltage of the battery", unit="V", action=self.beyond)
        within(self.i, -self.i_discharge, self.i_charge, name="current of the battery", unit="A", action=self.beyond)
        yield from self._dissipate()

    def full_energy(self) -> float:
        """Energy [J] between the lowest point of ``ocv`` and a state of charge of 1."""
        return float(numbers(lambda soc: self.Q * _area(self.ocv, soc), 1.0))

    def _voltage(self) -> Symbol:
        return self.ocv(self.soc)

    def _stored(self) -> Symbol:
        return self.Q * _area(self.ocv, self.soc)


class Battery(_Battery):
    """A voltage that depends on the state of charge, in series with a resistance.

    Q der(soc) = i,  bus.v = ocv(soc) + R cold i,  i = bus.i > 0 charges,  loss = R cold i^2
    cold = exp(B (1/heat_port.T - 1/293.15 K))
    stored energy = Q times the integral of ocv from its lowest state of charge
    discharge_power = v (ocv - v)/(R cold) faded below soc_min + band, v = max(ocv - R cold i_discharge, 0.55 ocv)
    charge_power = (ocv + R cold i_most) i_most faded above soc_max - band,  i_most = (V_max - ocv)/(R cold) within 0..i_charge
    V_max = overvoltage max(ocv),  bus.v >= ocv/2

    ``discharge_power`` and ``charge_power`` are signals for a control, which must respect them. A current beyond i_discharge or
    i_charge, or a voltage above V_max, is counted or is an error (``beyond``). V_max limits the current in the cold and where the battery
    is nearly full; cells of 4.15 V in a full battery that may be charged to 4.2 V have overvoltage = 4.2/4.15. The axis of ``ocv``
    determines its extrapolation. The battery cannot deliver more than ocv^2/(4 R), at half its open-circuit voltage: a simulation ends
    there, and a lower voltage is not an operating point. ``discharge_power`` stays 1 % below. Machines that draw power make the voltage
    implicit; if that takes too much time, use ``PolarizedBattery(ohmic=0)``.
    Errors: ParameterError for an ocv that is not linear or not positive.
    """

    R: Parameter = parameter("Ohm", "Internal resistance", default=0.15, above=0)

    def equations(self) -> Equations:
        """A voltage behind a resistance."""
        R = self.R * self._cold()
        yield from self._charge(R, 0.0, R)
        yield self.bus.v == self._voltage() + R * self.i

    def energy(self) -> Symbol:
        """Charge times open-circuit voltage, integrated from the lowest state of charge."""
        return self._stored()

    def loss(self) -> Symbol:
        """R i^2."""
        return self.R * self._cold() * self.i**2


class PolarizedBattery(_Battery):
    """A battery whose voltage responds to current partly at once and partly with a lag: a resistance and an RC element in series.

    Q der(soc) = i,  bus.v = ocv(soc) + R_0 cold i + u,  T der(u) = R_1 i - u/cold,  R_0 = ohmic R,  R_1 = (1 - ohmic) R
    loss = R_0 cold i^2 + u^2/(R_1 cold),  cold as of ``Battery``,  stored energy as of ``Battery`` and T u^2/(2 R_1)
    charge_power = (ocv + u + R_0 cold i_most) i_most,  i_most, discharge_power and their fading as in ``Battery``

    At constant current it equals ``Battery``. Pulses shorter than T see only R_0. ``charge_power`` applies at the present voltage,
    ``discharge_power`` and the current at V_max, as in ``Battery``, for any duration: short pulses may be larger. With ohmic = 0 the
    voltage is a state, so loads on the bus need no implicit equations, but the losses of short pulses are too small.
    """

    R: Parameter = parameter("Ohm", "Resistance at constant current", default=0.15, above=0)
    ohmic: Parameter = parameter("1", "Fraction of the resistance that acts at once", default=0.5, min=0, max=0.99)
    T: Parameter = parameter("s", "Time constant of the voltage", default=1.0, above=0)
    u: Variable = variable("V", "Voltage over the RC element", start=0.0)

    def equations(self) -> Equations:
        """A voltage that responds to the current."""
        yield from self._charge(self.R * self._cold(), self.u, self._at_once())
        yield self.bus.v == self._voltage() + self._at_once() * self.i + self.u
        yield self.T * der(self.u) == self._slow() * self.i - self.u / self._cold()

    def _at_once(self) -> Symbol:
        return self.ohmic * self.R * self._cold()

    def _slow(self) -> Symbol:
        return (1 - self.ohmic) * self.R

    def energy(self) -> Symbol:
        """Charge times open-circuit voltage, and the energy of the capacitor."""
        return self._stored() + self.T * self.u**2 / (2 * self._slow())

    def loss(self) -> Symbol:
        """Losses of both resistances."""
        return self._at_once() * self.i**2 + self.u**2 / (self._slow() * self._cold())


def _checked_voltage(ocv: Map, path: str) -> None:
    check_units(ocv, f"{path}.ocv", "V", ("1",), "a voltage [V] over the state of charge [1]")
    if ocv.method != "linear":
        raise ParameterError(f"{path}.ocv is {ocv.method}; it must be linear, as its integral is the stored energy")
    axis = ocv.axes[0]
    if axis.low < -axis.slack or axis.high > 1 + axis.slack:
        raise ParameterError(
            f"{path}.ocv is over a state of charge from {axis.low:g} to {axis.high:g}; it must lie within 0 and 1. "
            "The heading of a column in percent is soc [%]"
        )
    first, last = ocv.values[[0, -1]].tolist()
    if last < first:
        raise ParameterError(
            f"{path}.ocv falls from {first:g} V at a state of charge of {axis.low:g} to {last:g} V at {axis.high:g}; a full battery has "
            "the higher voltage: a depth of discharge is 1 minus the state of charge"
        )
    if ocv.values.min() <= 0:
        raise ParameterError(f"{path}.ocv falls to {ocv.values.min():g} V; it must stay above 0 V")


def _area(curve: Map, x: Symbol) -> Symbol:
    """The integral of a piecewise linear curve from its first point to x; the curve is clipped outside its points."""
    points, values = curve.axes[0].points, curve.values.tolist()
    on = curve.axes[0].outside == "linear"
    area = Symbol(0.0)
    if not on:
        area += values[0] * ca.fmin(x - points[0], 0) + values[-1] * ca.fmax(x - points[-1], 0)
    for k in range(len(points) - 1):
        length = points[k + 1] - points[k]
        u = x - points[k]
        u = u if on and k == 0 else ca.fmax(u, 0)
        u = u if on and k == len(points) - 2 else ca.fmin(u, length)
        area += values[k] * u + (values[k + 1] - values[k]) / length * u**2 / 2
    return area
