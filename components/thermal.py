"""Lumped thermal components: sinks for losses, conduction, convection, radiation, storage and sensors.

The energy audit follows mechanical energy, which ends in the losses of the components. Heat ports carry this lost power away and are
not counted again.
"""

from __future__ import annotations

import math
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
    within,
)

__all__ = [
    "STEFAN_BOLTZMANN",
    "BodyRadiation",
    "Convection",
    "FixedHeatFlow",
    "FixedTemperature",
    "HeatCapacitor",
    "HeatFlowSensor",
    "HeatPort",
    "Lossy",
    "PrescribedHeatFlow",
    "PrescribedTemperature",
    "RelTemperatureSensor",
    "TemperatureSensor",
    "ThermalConductor",
    "ThermalResistor",
]

STEFAN_BOLTZMANN = 5.670374419e-8
"""Stefan-Boltzmann constant [W/(m2.K4)] (CODATA 2018)."""


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


class ThermalResistor(_TwoHeatPorts):
    """Conducts heat without storing it; the resistance is given, as in data sheets of machines and power electronics.

    dT = R Q_flow

    Without resistance connect the ports directly.
    """

    R: Parameter = parameter("K/W", "Thermal resistance", above=0)

    def equations(self) -> Equations:
        """Conduction."""
        yield from self._pass()
        yield self.dT == self.R * self.Q_flow


class BodyRadiation(_TwoHeatPorts):
    """Heat exchanged by radiation between two grey surfaces.

    Q_flow = Gr sigma (port_a.T^4 - port_b.T^4)

    ``sigma`` is the Stefan-Boltzmann constant, 5.670374419e-8 W/(m2.K4). Gr is an area times an exchange factor, from the emissivities
    e_1, e_2 (0 to 1) and the areas of the surfaces:
    surface 2 around surface 1: Gr = A_1/(1/e_1 + (1/e_2 - 1) A_1/A_2)
    parallel plates: Gr = A/(1/e_1 + 1/e_2 - 1)
    surface 2 large: Gr = e_1 A_1

    The first is exact for concentric spheres and long coaxial cylinders; the last serves for a brake disc or a housing in the
    open air.

    Sources: Modelica Standard Library 4.0.0, Thermal.HeatTransfer.Components.BodyRadiation; T. L. Bergman, A. S. Lavine, F. P. Incropera,
    D. P. DeWitt, Fundamentals of Heat and Mass Transfer, 7th ed., Wiley 2011, Table 13.3 (exchange factors); CODATA 2018 (sigma).
    """

    Gr: Parameter = parameter("m2", "Radiation conductance: area times exchange factor", min=0)

    def equations(self) -> Equations:
        """The law of Stefan and Boltzmann."""
        yield from self._pass()
        yield self.Q_flow == self.Gr * STEFAN_BOLTZMANN * (self.port_a.T**4 - self.port_b.T**4)


class Convection(Component):
    """Convection from a solid surface to a fluid, with a conductance given by a signal.

    dT = solid.T - fluid.T,  Q_flow = Gc dT = solid.Q_flow = -fluid.Q_flow

    A negative Gc, with which heat would flow from cold to hot, ends a simulation with an error.
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
        within(self.Gc.value, 0, math.inf, name="thermal conductance", unit="W/K")
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


class RelTemperatureSensor(Component):
    """Reads a temperature difference: T_rel = port_a.T - port_b.T."""

    T_rel: Output = signal_output("K", "Temperature difference, port_a.T - port_b.T")
    port_a: HeatPort = port(HeatPort)
    port_b: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """The reading; the sensor takes no heat."""
        yield self.T_rel.value == self.port_a.T - self.port_b.T
        yield self.port_a.Q_flow == 0
        yield self.port_b.Q_flow == 0


class HeatFlowSensor(Component):
    """Reads a heat flow: Q_flow = port_a.Q_flow = -port_b.Q_flow, without a difference of temperature."""

    Q_flow: Output = signal_output("W", "Heat flow from port_a to port_b")
    port_a: HeatPort = port(HeatPort)
    port_b: HeatPort = port(HeatPort)

    def equations(self) -> Equations:
        """The reading; both ports have one temperature."""
        yield self.port_a.T == self.port_b.T
        yield self.port_a.Q_flow + self.port_b.Q_flow == 0
        yield self.Q_flow.value == self.port_a.Q_flow
