"""The capacitor of a direct-current link."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, Symbol, Variable, der, parameter, port, variable
from powertrain.components.electric.interfaces import DCTerminal


class Capacitor(Component):
    """An ideal capacitor at the bus.

    C der(v) = i,  v = bus.v,  i = bus.i;  stored energy C v^2/2

    It makes the voltage of the bus a state, so machines with constant power are explicit.
    """

    bus: DCTerminal = port(DCTerminal)
    C: Parameter = parameter("F", "Capacitance", default=5e-3, above=0)
    v: Variable = variable("V", "Voltage", start=400.0)

    def equations(self) -> Equations:
        """Charge."""
        yield self.v == self.bus.v
        yield self.C * der(self.v) == self.bus.i

    def energy(self) -> Symbol:
        """C v^2/2."""
        return self.C * self.v**2 / 2
