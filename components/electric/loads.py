"""Loads of the bus: accessories, and converters between two voltages."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, parameter, port, signal_input, variable
from powertrain.components.electric.interfaces import DCTerminal
from powertrain.components.thermal import Lossy


class AccessoryLoad(Lossy):
    """Draws a given power at any voltage: lamps, fans, control units.

    bus.v bus.i = P demand = lossPower

    All of it becomes heat. A negative demand counts as zero.
    """

    bus: DCTerminal = port(DCTerminal)
    demand: Input = signal_input("1", "Fraction of P that is switched on", default=1.0)
    P: Parameter = parameter("W", "Power", default=300.0, min=0)

    def equations(self) -> Equations:
        """A constant power."""
        yield self.bus.v * self.bus.i == self.loss()
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """All the power that it draws."""
        return self.P * ca.fmax(self.demand.value, 0)


class DCDCConverter(Lossy):
    """Connects two buses with different voltages: ``low`` has a constant voltage as long as ``high`` supplies the power.

    low.v = V,  P = -low.v low.i,  high.v high.i = P + lossPower,  lossPower = (1/eta - 1) P for P > 0, (1 - eta) |P| for P < 0
    """

    high: DCTerminal = port(DCTerminal)
    low: DCTerminal = port(DCTerminal)
    V: Parameter = parameter("V", "Voltage of the side low", default=14.0, above=0)
    eta: Parameter = parameter("1", "Efficiency", default=1.0, above=0, max=1)
    P: Variable = variable("W", "Power that flows out at the side low")

    def equations(self) -> Equations:
        """A power balance."""
        yield self.low.v == self.V
        yield self.low.v * self.low.i == -self.P
        yield self.high.v * self.high.i == self.P + self.lossPower
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Power in minus power out."""
        return (1 / self.eta - 1) * ca.fmax(self.P, 0) + (1 - self.eta) * ca.fmax(-self.P, 0)
