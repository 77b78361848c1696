"""Starters of combustion engines."""

from __future__ import annotations

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
    switch,
    variable,
)
from powertrain.components.electric.interfaces import DCTerminal
from powertrain.components.rotational.interfaces import Lossy, OneFlangeAndSupport


class Starter(OneFlangeAndSupport, Lossy):
    """A starter: a direct-current motor that turns the ring gear (flange) through a pinion with a roller freewheel.

    J der(w_m) = k i - tau/ratio - d w_m,  bus.v = R i + k w_m while on > 1/2, else i = 0,  flange.tau = -tau
    w_rel = der(phi) - w_m/ratio;  on > 1/2 and w_rel = 0: 0 <= tau <= tau_max,  on > 1/2 and w_rel < 0: tau = tau_max;  else tau = 0

    The solenoid retracts the pinion as soon as ``on`` falls to 1/2. Once the engine has started it overruns the motor, which then turns at
    its idle speed bus.v/k. From ratio k bus.v/R at rest, the torque at the ring gear falls linearly with its speed, and with the voltage:
    that of a battery with internal resistance drops during a start. If the motor is faster than the ring gear when it is switched on,
    because it still turns from the last start or the engine rocks back, the rollers slip with the torque tau_max until their speeds are
    equal; this heat is part of lossPower. For a start tau_max must exceed the torque of the motor and of the armature's inertia. The
    defaults are invented, for a 1.6 l engine: 90 N.m at rest at 12 V, idling at 35 rad/s. Source: Bosch Automotive Handbook, chapter
    Starting systems.
    """

    on: Input = signal_input("1", "1: pinion in and motor on, 0: off")
    bus: DCTerminal = port(DCTerminal)
    ratio: Parameter = parameter("1", "Speed of the motor over that of the ring gear", default=50.0, above=0)
    J: Parameter = parameter("kg.m2", "Moment of inertia of the armature", default=1e-4, above=0)
    k: Parameter = parameter("N.m/A", "Torque over current, and voltage over speed", default=6.8e-3, above=0)
    R: Parameter = parameter("Ohm", "Resistance of armature, brushes and leads", default=0.045, above=0)
    d: Parameter = parameter("N.m.s/rad", "Drag of the armature", default=1e-4, min=0)
    tau_max: Parameter = parameter(
        "N.m", "Torque at the ring gear with which the freewheel slips", default=1000.0, above=0
    )
    w_m: Variable = variable("rad/s", "Speed of the motor", start=0.0)
    i: Variable = variable("A", "Current of the motor")
    w_rel: Variable = variable("rad/s", "Speed by which the ring gear overruns the motor", prefer=True)
    tau: Variable = variable("N.m", "Torque that drives the ring gear")

    def equations(self) -> Equations:
        """Armature, freewheel and the switch of the solenoid."""
        yield from self._against_support()
        on = self.on.value > 0.5
        yield self.i == switch(on, (self.bus.v - self.k * self.w_m) / self.R, 0.0)
        yield self.bus.i == self.i
        yield self.J * der(self.w_m) == self.k * self.i - self.tau / self.ratio - self.d * self.w_m
        yield self.w_rel == der(self.phi) - self.w_m / self.ratio
        yield self.flange.tau == -self.tau
        yield friction(self.w_rel, self.flange.tau, switch(on, -self.tau_max, 0.0), 0.0, name="freewheel")
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy of the armature J w_m^2/2."""
        return self.J * self.w_m**2 / 2

    def loss(self) -> Symbol:
        """Heat of the current, of drag, and of slip in the freewheel."""
        return self.R * self.i**2 + self.d * self.w_m**2 - self.tau * self.w_rel
