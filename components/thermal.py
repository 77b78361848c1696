"""Lumped thermal components: sinks for losses, heat conduction and storage.

The energy audit follows mechanical energy, which ends in the losses of the components. Heat ports carry this lost power away and are
not counted again.
"""

from __future__ import annotations

from typing import ClassVar

from powertrain import (
    Component,
    Connector,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    der,
    flow,
    parameter,
    port,
    signal_input,
    signal_output,
    support,
    variable,
)

__all__ = [
    "Convection",
    "FixedHeatFlow",
    "FixedTemperature",
    "HeatCapacitor",
    "HeatPort",
    "Lossy",
    "PrescribedHeatFlow",
    "PrescribedTemperature",
    "TemperatureSensor",
    "ThermalConductor",
]


class HeatPort(Connector):
    """A port with the temperature T and the heat flow Q_flow into the component.

    An optional heat port that is not connected is held at 293.15 K (20 degC).
    """

    reference: ClassVar[float] = 293.15
    T: Variable = variable("K", "Temperature", guess=293.15)
    Q_flow: Variable = flow("W", "Heat flow into the component")

    def power(self) -> Symbol:
        """Zero: the heat is the loss of the component from which it comes, and is counted there."""
        return Symbol(0)


class Lossy(Component):
    """Partial: dissipates into a heat port, which is held at its reference temperature if nothing is connected."""

    lossPower: Variable = variable("W", "Dissipated power")
    heat_port: HeatPort = support(HeatPort)

    def _dissipate(self) -> Equations:
        yield self.lossPower == self.loss()
        yield self.heat_port.Q_flow == -self.lossPower


class HeatCapacitor(Component):
    """A body with uniform temperature that stores heat.

    C der(T) = port.Q_flow
    """

    C: Parameter = parameter("J/K", "Heat capacity", min=0)
    T: Variable = variable("K", "Temperature of the body", start=293.15, guess=293.15)
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """Balance of heat."""
        yield self.T == self.port.T
        yield self.C * der(self.T) == self.port.Q_flow


class _TwoHeatPorts(Component):
    """Partial: heat flows from port_a to port_b."""

    port_a: HeatPort = port(HeatPort)
    port_b: HeatPort = port(HeatPort)
    dT: Variable = variable("K", "Temperature difference, port_a.T - port_b.T")
    Q_flow: Variable = variable("W", "Heat flow from port_a to port_b")

    def _pass(self) -> Equations:
        yield self.dT == self.port_a.T - self.port_b.T
        yield self.port_a.Q_flow == self.Q_flow
        yield self.port_b.Q_flow == -self.Q_flow


class ThermalConductor(_TwoHeatPorts):
    """Conducts heat without storing it.

    Q_flow = G dT
    """

    G: Parameter = parameter("W/K", "Thermal conductance", min=0)

    def equations(self) -> Equations:
        """Conduction."""
        yield from self._pass()
        yield self.Q_flow == self.G * self.dT


class Convection(Component):
    """Convection from a solid surface to a fluid, with a conductance given by a signal.

    dT = solid.T - fluid.T,  Q_flow = Gc dT = solid.Q_flow = -fluid.Q_flow
    """

    solid: HeatPort = port(HeatPort)
    fluid: HeatPort = port(HeatPort)
    Gc: Input = signal_input("W/K", "Convective thermal conductance (coefficient times area)")
    dT: Variable = variable("K", "Temperature difference, solid.T - fluid.T")
    Q_flow: Variable = variable("W", "Heat flow from solid to fluid")

    def equations(self) -> Equations:
        """Newton's law of cooling."""
        yield self.dT == self.solid.T - self.fluid.T
        yield self.solid.Q_flow == self.Q_flow
        yield self.fluid.Q_flow == -self.Q_flow
        yield self.Q_flow == self.Gc.value * self.dT


class FixedTemperature(Component):
    """Surroundings at constant temperature.

    port.T = T
    """

    boundary: ClassVar[bool] = True
    T: Parameter = parameter("K", "Temperature", default=293.15, min=0)
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """A constant."""
        yield self.port.T == self.T


class PrescribedTemperature(Component):
    """Surroundings at a temperature given by a signal.

    port.T = T
    """

    boundary: ClassVar[bool] = True
    T: Input = signal_input("K", "Temperature")
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """The signal."""
        yield self.T.value == self.port.T


class FixedHeatFlow(Component):
    """A heat source with constant flow; with alpha it depends on the temperature.

    port.Q_flow = -Q_flow (1 + alpha (port.T - T_ref))
    """

    boundary: ClassVar[bool] = True
    Q_flow: Parameter = parameter("W", "Heat flow out of the source at T_ref")
    T_ref: Parameter = parameter("K", "Reference temperature of Q_flow", default=293.15, min=0)
    alpha: Parameter = parameter("1/K", "Temperature coefficient of the heat flow", default=0.0)
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """Constant, except for its temperature coefficient."""
        yield self.port.Q_flow == -self.Q_flow * (1 + self.alpha * (self.port.T - self.T_ref))


class PrescribedHeatFlow(Component):
    """A heat source with a flow given by a signal; with alpha it depends on the temperature.

    port.Q_flow = -Q_flow (1 + alpha (port.T - T_ref))
    """

    boundary: ClassVar[bool] = True
    Q_flow: Input = signal_input("W", "Heat flow out of the source at T_ref")
    T_ref: Parameter = parameter("K", "Reference temperature of Q_flow", default=293.15, min=0)
    alpha: Parameter = parameter("1/K", "Temperature coefficient of the heat flow", default=0.0)
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """The signal, with its temperature coefficient."""
        yield self.port.Q_flow == -self.Q_flow.value * (1 + self.alpha * (self.port.T - self.T_ref))


class TemperatureSensor(Component):
    """Reads a temperature: T = port.T."""

    T: Output = signal_output("K", "Temperature")
    port: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """The reading; the sensor takes no heat."""
        yield self.T.value == self.port.T
        yield self.port.Q_flow == 0
