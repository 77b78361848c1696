"""Cooling of combustion engines, and the friction of cold oil."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    der,
    parameter,
    port,
    signal_input,
    signal_output,
    variable,
)
from powertrain.components.limited import limited
from powertrain.components.thermal import HeatPort

T_40, T_100 = 313.15, 373.15
"""Temperatures [K] for which data sheets give the viscosity of an oil."""
WARM = 363.15
"""Temperature [K] of a warm engine."""


class EngineCooling(Component):
    """Partial: takes the heat of an engine and determines how much its friction increases with cold oil."""

    engine: HeatPort = port(HeatPort)
    v: Input = signal_input("m/s", "Speed of the air at the radiator", default=0.0)
    warmth: Output = signal_output("1", "Friction over that of the warm engine")


class WarmEngine(EngineCooling):
    """An engine that is warm from the start: engine.T = 363.15 K, warmth = 1."""

    def equations(self) -> Equations:
        """Two constants."""
        yield self.engine.T == WARM
        yield self.warmth.value == 1


class CoolantCircuit(EngineCooling):
    """Engine block, coolant and oil as one thermal mass that warms up, with thermostat and radiator.

    C der(T) = engine.Q_flow - radiator - (G_block + G_heater) (T - T_air),  engine.T = T
    radiator = opening (G_fan + G_wind |v|) (T - T_air),  opening = (T - T_opens)/(T_open - T_opens) within 0..1
    warmth = (nu(T)/nu(T_open))^k,  log10(log10(nu/cSt + 0.7)) = a - b log10(T/K)

    a and b follow from the viscosities nu_40 and nu_100 in the oil's data sheet (Walther). With a closed thermostat and constant heat the
    mass warms up exponentially with the time constant C/(G_block + G_heater). T_air is the ambient temperature; ``T`` starts from it unless
    a start value is given. The defaults are for a 1.6 l engine with SAE 5W-30 oil; its
    heat capacity is that of 100 kg of metal and 6 kg of coolant and oil. A warm restart is ``starts={"cooling.T": 363}``.

    Sources: P. J. Shayler, D. Leong, M. Murphy, Contributions to engine friction during cold, low speed running and the dependence on oil
    viscosity, SAE 2005-01-1654 (friction as a function of the oil's viscosity; the default of k is an estimate of ours); ASTM D341
    (Walther's equation).
    """

    C: Parameter = parameter("J/K", "Heat capacity of block, coolant and oil", default=75e3, above=0)
    T_air: Parameter = parameter("K", "Temperature of the surroundings", default=293.15, above=200, max=350)
    G_block: Parameter = parameter("W/K", "Conductance from the block to the air", default=15.0, min=0)
    G_heater: Parameter = parameter("W/K", "Conductance of the cabin heater", default=0.0, min=0)
    G_fan: Parameter = parameter("W/K", "Conductance of the radiator at rest", default=300.0, min=0)
    G_wind: Parameter = parameter(
        "W.s/(K.m)", "Rise of the radiator's conductance with the air speed", default=40.0, min=0
    )
    T_opens: Parameter = parameter("K", "Temperature from which the thermostat opens", default=358.15, above=200)
    T_open: Parameter = parameter(
        "K", "Temperature from which the thermostat is open, of a warm engine", default=368.15, above=200
    )
    nu_40: Parameter = parameter("mm2/s", "Viscosity of the oil at 40 degC", default=62.0, above=2)
    nu_100: Parameter = parameter("mm2/s", "Viscosity of the oil at 100 degC", default=10.5, above=1.5)
    k: Parameter = parameter("1", "Exponent of friction over viscosity", default=0.24, min=0, max=1)
    T: Variable = variable("K", "Temperature of block, coolant and oil", guess=293.15, nominal=100.0)
    opening: Variable = variable("1", "Opening of the thermostat")
    radiator: Variable = variable("W", "Heat to the air through the radiator")

    def check(self) -> Equations:
        """The thermostat must open upwards, and the oil become thinner with temperature."""
        yield self.T_opens < self.T_open
        yield self.nu_100 < self.nu_40

    def equations(self) -> Equations:
        """A heat balance, and Walther's equation."""
        over = self.T - self.T_air
        yield self.T == self.engine.T
        yield self.opening == limited((self.T - self.T_opens) / (self.T_open - self.T_opens))
        yield self.radiator == self.opening * (self.G_fan + self.G_wind * ca.fabs(self.v.value)) * over
        yield self.C * der(self.T) == self.engine.Q_flow - self.radiator - (self.G_block + self.G_heater) * over
        yield self.warmth.value == (self.viscosity(self.T) / self.viscosity(self.T_open)) ** self.k

    def initial(self) -> Equations:
        """A cold start."""
        yield self.T_air == self.T

    def viscosity(self, T: Symbol) -> Symbol:
        """Kinematic viscosity [mm2/s] of the oil at T [K]."""
        low, high = (ca.log10(ca.log10(nu + 0.7)) for nu in (self.nu_40, self.nu_100))
        slope = (low - high) / ca.log10(T_100 / T_40)
        return 10 ** (10 ** (low - slope * ca.log10(T / T_40))) - 0.7
