"""Accessories of a combustion engine: alternator, pumps, fan."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Equations,
    Input,
    Parameter,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    port,
    signal_input,
    variable,
)
from powertrain.components.electric.interfaces import DCTerminal
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import Dragged


class Accessories(Dragged):
    """Partial: alternator, pumps and fan on the belt drive. Below w_0 the torque falls to zero at rest, so the starter can overcome it."""

    P: Parameter = parameter("W", "Power", default=0.0, min=0)
    w_0: Parameter = parameter("rad/s", "Speed from which the full power is taken", default=50.0, above=0)

    def _take(self, power: Symbol) -> Equations:
        """``power`` from the crankshaft, less below w_0."""
        yield from self._turn()
        yield self.flange.tau == power * self.w / ca.fmax(ca.fabs(self.w), self.w_0) ** 2


class AccessoryDrive(Accessories):
    """A belt drive that takes constant power from the crankshaft.

    tau = P w/max(|w|, w_0)^2,  w = der(flange.phi - support.phi)
    """

    def equations(self) -> Equations:
        """A constant power."""
        yield from self._take(self.P)


class BufferedAccessories(Accessories):
    """Accessories with a battery, which supplies them while the engine is stopped and is charged afterwards.

    tau = (P + min(owed/T_charge, P_charge)) w/max(|w|, w_0)^2,  der(owed) = P - tau w,  w = der(flange.phi - support.phi)

    ``owed`` is the energy deficit of the battery, which has no losses of its own and no limit of its energy. ``charge_corrected`` leaves
    the deficit at the end of a run out unless the component is named: ``charge_corrected(run, "accessories")``.
    """

    T_charge: Parameter = parameter("s", "Time constant with which the battery is charged", default=60.0, above=0)
    P_charge: Parameter = parameter("W", "Greatest power with which the battery is charged", default=1000.0, above=0)
    owed: Variable = variable("J", "Energy that the battery has yet to receive", start=0.0, nominal=1e4)

    def equations(self) -> Equations:
        """A constant power, and the power that charges the battery."""
        yield from self._take(self.P + ca.fmin(self.owed / self.T_charge, self.P_charge))
        yield der(self.owed) == self.P - self.flange.tau * self.w

    def energy(self) -> Symbol:
        """That of the battery, zero when it is charged."""
        return -self.owed

    def loss(self) -> Symbol:
        """The power of the accessories."""
        return self.P


class Alternator(Dragged):
    """An alternator that regulates the voltage of the bus as far as its speed permits.

    w = der(flange.phi - support.phi),  flange.tau w = -bus.v bus.i/efficiency,  -bus.i = G (V - bus.v) within 0..limit
    limit = i_max (1 - exp(-(w - w_cut)/w_rise)) from the cut-in speed w_cut on, else 0

    Mount it on a pulley: its speed is that of its own shaft, two to three times the engine's. The default values are invented, for a
    14 V, 120 A alternator. Source: Bosch Automotive Handbook, chapter Alternators (characteristic of current over speed).
    """

    bus: DCTerminal = port(DCTerminal)
    V: Parameter = parameter("V", "Voltage that the regulator aims at", default=14.0, above=0)
    G: Parameter = parameter("A/V", "Current over voltage deviation of the regulator", default=100.0, above=0)
    i_max: Parameter = parameter("A", "Current at high speed", default=120.0, min=0)
    w_cut: Parameter = parameter("rad/s", "Speed from which it delivers current", default=120.0, above=0)
    w_rise: Parameter = parameter("rad/s", "Speed range in which the current rises", default=250.0, above=0)
    efficiency: Parameter = parameter("1", "Electric over mechanical power", default=0.65, above=0, max=1)
    i: Variable = variable("A", "Current delivered")

    def equations(self) -> Equations:
        """A regulator with a speed-dependent limit."""
        yield from self._turn()
        limit = self.i_max * (1 - ca.exp(-ca.fmax(self.w - self.w_cut, 0) / self.w_rise))
        yield self.i == limited(self.G * (self.V - self.bus.v), 0, limit)
        yield self.bus.i == -self.i
        yield self.flange.tau == self.bus.v * self.i / self.efficiency / ca.fmax(self.w, self.w_cut)

    def loss(self) -> Symbol:
        """Mechanical minus electric power."""
        return self.bus.v * self.i * (1 / self.efficiency - 1)


class AccessoryPump(Dragged):
    """A pump or compressor: hydraulic steering, oil or coolant pump, air conditioning.

    w = der(flange.phi - support.phi),  w > 0: flange.tau = limit;  w < 0: flange.tau = -limit;  w = 0: |flange.tau| <= limit
    limit = load displacement pressure/(2 pi efficiency) + tau_0 + tau_2 w^2,  load within 0..1

    ``displacement`` is the volume per revolution. ``pressure`` is the mean effective pressure difference; for an air-conditioning
    compressor n/(n - 1) p_in ((p_out/p_in)^((n - 1)/n) - 1), with ``load`` from its swash plate. The energy counts as lost. The defaults
    are invented, for a compressor of 120 cm3.
    """

    load: Input = signal_input("1", "Stroke over the full stroke, 0 to 1", default=1.0)
    displacement: Parameter = parameter("m3", "Volume in a revolution", default=120e-6, min=0)
    pressure: Parameter = parameter("Pa", "Mean effective pressure", default=0.5e6, min=0)
    efficiency: Parameter = parameter("1", "Hydraulic over mechanical power", default=0.85, above=0, max=1)
    tau_0: Parameter = parameter("N.m", "Torque without load", default=0.5, min=0)
    tau_2: Parameter = parameter(
        "N.m.s2/rad2", "Rise of the torque without load with speed squared", default=1e-6, min=0
    )

    def equations(self) -> Equations:
        """A torque that opposes the motion and holds at rest."""
        yield from self._turn()
        work = self.displacement * self.pressure / (2 * math.pi * self.efficiency)
        limit = limited(self.load.value) * work + self.tau_0 + self.tau_2 * self.w**2
        yield friction(self.w, self.flange.tau, -limit, limit)
