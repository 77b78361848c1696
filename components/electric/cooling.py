"""Temperatures of batteries and electric machines in a vehicle."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, Variable, der, parameter, port, variable
from powertrain.components.thermal import HeatPort


class Cooling(Component):
    """Partial: takes the heat of a part and determines its temperature."""

    def steady(self) -> Cooling:
        """Its replacement in maps of operating points; by default itself, in thermal equilibrium at every point."""
        return self


class BatteryCooling(Cooling):
    """Partial: takes the heat of a battery and determines its temperature."""

    battery: HeatPort = port(HeatPort)


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


class MachineCooling(Cooling):
    """Partial: takes the heat of an electric machine and determines its temperature."""

    machine: HeatPort = port(HeatPort)


class ConditionedMachine(MachineCooling):
    """A machine at a constant temperature, whatever its losses: machine.T = T."""

    T: Parameter = parameter("K", "Temperature", default=293.15, above=200)

    def equations(self) -> Equations:
        """A constant."""
        yield self.machine.T == self.T


class LiquidCooledMachine(MachineCooling):
    """A machine whose winding is warmed by its losses, within a housing that is cooled by a liquid.

    C der(T) = machine.Q_flow - Q_housing,  C_housing der(T_housing) = Q_housing - G_liquid (T_housing - T_liquid)
    Q_housing = G (T - T_housing),  machine.T = T

    In the long run a loss P makes the winding warmer than the liquid by P (1/G + 1/G_liquid): that limits the continuous power, as the
    torque of an ``ElectricMachine`` falls near its T_max. For seconds the winding alone stores the heat, which allows the peak power.
    The run begins at T_liquid unless start values are given. The default values are invented, for a machine of 150 kW.
    """

    C: Parameter = parameter("J/K", "Heat capacity of the winding", default=3e3, above=0)
    C_housing: Parameter = parameter("J/K", "Heat capacity of stator core and housing", default=15e3, above=0)
    G: Parameter = parameter("W/K", "Conductance from the winding to the housing", default=80.0, above=0)
    G_liquid: Parameter = parameter("W/K", "Conductance from the housing to the liquid", default=200.0, above=0)
    T_liquid: Parameter = parameter("K", "Temperature of the liquid", default=338.15, above=200)
    T: Variable = variable("K", "Temperature of the winding", guess=338.15, nominal=100.0)
    T_housing: Variable = variable("K", "Temperature of stator core and housing", guess=338.15, nominal=100.0)
    Q_housing: Variable = variable("W", "Heat flow from the winding to the housing", nominal=1e3)

    def equations(self) -> Equations:
        """Two heat balances."""
        yield self.T == self.machine.T
        yield self.Q_housing == self.G * (self.T - self.T_housing)
        yield self.C * der(self.T) == self.machine.Q_flow - self.Q_housing
        yield self.C_housing * der(self.T_housing) == self.Q_housing - self.G_liquid * (self.T_housing - self.T_liquid)

    def initial(self) -> Equations:
        """As warm as the liquid."""
        yield self.T_liquid == self.T
        yield self.T_liquid == self.T_housing

    def steady(self) -> ConditionedMachine:
        """As warm as the liquid: it takes minutes to reach the equilibrium of an operating point."""
        return ConditionedMachine(T=float(self.T_liquid))
