"""Temperature of a battery in a vehicle."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, Variable, der, parameter, port, variable
from powertrain.components.thermal import HeatPort


class BatteryCooling(Component):
    """Partial: takes the heat of a battery and determines its temperature."""

    battery: HeatPort = port(HeatPort)

    def steady(self) -> BatteryCooling:
        """Its replacement in maps of operating points; by default itself, in thermal equilibrium at every point."""
        return self


class ConditionedBattery(BatteryCooling):
    """A battery at a constant temperature, whatever its losses: battery.T = T."""

    T: Parameter = parameter("K", "Temperature", default=293.15, above=200, max=350)

    def equations(self) -> Equations:
        """A constant."""
        yield self.battery.T == self.T


class PassivelyCooledBattery(BatteryCooling):
    """A battery that is warmed by its losses and cooled by the air around it.

    C der(T) = battery.Q_flow - G (T - T_air),  battery.T = T

    Warmed by constant losses, it approaches its final temperature with the time constant C/G. ``T`` starts from T_air unless a start value
    is given: ``starts={"battery_cooling.T": "20 degC"}`` for a car from a garage. The defaults are estimates for a pack of 350 kg with
    1,000 J/(kg.K), as of a compact electric car.
    """

    C: Parameter = parameter("J/K", "Heat capacity of cells and case", default=350e3, above=0)
    G: Parameter = parameter("W/K", "Conductance from the cells to the air", default=10.0, min=0)
    T_air: Parameter = parameter("K", "Temperature of the surroundings", default=293.15, above=200, max=350)
    T: Variable = variable("K", "Temperature of the battery", guess=293.15, nominal=100.0)

    def equations(self) -> Equations:
        """A heat balance."""
        yield self.T == self.battery.T
        yield self.C * der(self.T) == self.battery.Q_flow - self.G * (self.T - self.T_air)

    def initial(self) -> Equations:
        """As warm as the air."""
        yield self.T_air == self.T

    def steady(self) -> ConditionedBattery:
        """As warm as the air: it takes hours to reach the equilibrium of an operating point."""
        return ConditionedBattery(T=float(self.T_air))
