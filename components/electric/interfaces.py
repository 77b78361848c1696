"""The terminal of the direct-current bus, and an ideal source at it."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Component, Connector, Equations, Parameter, Symbol, Variable, flow, parameter, port, variable


class DCTerminal(Connector):
    """A terminal of a direct-current bus: voltage v against the return, and current i into the component; power v i."""

    v: Variable = variable("V", "Voltage against the return", guess=200.0)
    i: Variable = flow("A", "Current into the component", nominal=100.0)

    def power(self) -> Symbol:
        """Power into the component [W]."""
        return self.v * self.i


class VoltageSource(Component):
    """A constant voltage source for any current in either direction.

    bus.v = V
    """

    boundary: ClassVar[bool] = True
    V: Parameter = parameter("V", "Voltage", default=200.0, above=0)
    bus: DCTerminal = port(DCTerminal)

    def equations(self) -> Equations:
        """A constant."""
        yield self.bus.v == self.V
