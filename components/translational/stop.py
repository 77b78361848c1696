"""A mass that slides with Stribeck friction between two hard stops."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Discrete,
    Equations,
    Parameter,
    Symbol,
    Variable,
    der,
    discrete,
    friction,
    parameter,
    reinit,
    switch,
    variable,
    when,
    within,
)
from powertrain.components.translational.interfaces import Lossy, Rigid

BREAKAWAY = 1.001
"""Force at which a resting mass breaks loose over friction at zero speed, as in the Modelica Standard Library."""
TOUCH = 1e-9
"""How far in m a mass goes into a stop before it is stopped; so it may start where it just touches one."""
OVERRUN = 1e-6
"""How far in m behind a stop it is an error."""


class MassWithStopAndFriction(Rigid, Lossy):
    """A mass of length L that rubs on the housing and cannot leave smin <= flange_a.s, flange_b.s <= smax.

    v = der(s),  a = der(v),  m a = flange_a.f + flange_b.f - f
    v > 0: f = F_prop v + F_Coulomb + F_Stribeck exp(-fexp v);  v < 0: its mirror image;
    v = 0: |f| <= 1.001 (F_Coulomb + F_Stribeck), and at a stop f holds the mass against any force into the stop

    At a stop the mass loses all its speed at once. That energy is not in lossPower, which has no value at that instant.
    What is rigidly joined to the mass stops with it; parts that must not are to be joined by a spring.
    """

    m: Parameter = parameter("kg", "Mass", min=0)
    F_prop: Parameter = parameter("N.s/m", "Speed-proportional friction", min=0)
    F_Coulomb: Parameter = parameter("N", "Constant friction", min=0)
    F_Stribeck: Parameter = parameter("N", "Friction at rest beyond F_Coulomb", min=0)
    fexp: Parameter = parameter("s/m", "Decay of the Stribeck friction with speed", min=0)
    smax: Parameter = parameter("m", "Stop for flange_b")
    smin: Parameter = parameter("m", "Stop for flange_a")
    s: Variable = variable("m", "Position of the middle between the flanges", start=0.0, prefer=True)
    v: Variable = variable("m/s", "Speed, der(s)", start=0.0, prefer=True)
    a: Variable = variable("m/s2", "Acceleration, der(v)")
    stopped: Discrete = discrete("1", "-1 at smin, 1 at smax, 0 between the stops")
    f: Variable = variable("N", "Force of the housing on the mass, positive against positive v")

    def equations(self) -> Equations:
        """Newton's law, one law for friction and stops, and the loss of speed at a stop."""
        yield from self._span()
        yield self.v == der(self.s)
        yield self.a == der(self.v)
        yield self.m * self.a == self.flange_a.f + self.flange_b.f - self.f
        behind, ahead = self.s - self.L / 2 - self.smin, self.smax - self.s - self.L / 2
        within(behind, -OVERRUN, math.inf, name="distance to smin", unit="m")
        within(ahead, -OVERRUN, math.inf, name="distance to smax", unit="m")
        rub = self.F_Coulomb + self.F_Stribeck * ca.exp(-self.fexp * ca.fabs(self.v))
        lower = switch(self.stopped < -0.5, -math.inf, self.F_prop * self.v - rub)
        upper = switch(self.stopped > 0.5, math.inf, self.F_prop * self.v + rub)
        yield friction(self.v, self.f, lower, upper, peak=BREAKAWAY)
        yield when(behind <= -TOUCH, reinit(self.v, 0.0), reinit(self.stopped, -1.0))
        yield when(ahead <= -TOUCH, reinit(self.v, 0.0), reinit(self.stopped, 1.0))
        yield when(ca.logic_and(behind > 0, ahead > 0), reinit(self.stopped, 0.0))
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy m v^2/2."""
        return self.m * self.v**2 / 2

    def loss(self) -> Symbol:
        """Friction force times speed."""
        return self.f * self.v
