"""A mass that slides with Stribeck friction between two hard stops."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Equations,
    Parameter,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    unilateral,
    variable,
)
from powertrain.components.translational.interfaces import Lossy, Rigid

BREAKAWAY = 1.001
"""Break-away force relative to friction at zero speed, as in the Modelica Standard Library."""


class MassWithStopAndFriction(Rigid, Lossy):
    """A mass of length L with friction against the housing, confined to smin <= flange_a.s, flange_b.s <= smax.

    v = der(s),  a = der(v),  m a = flange_a.f + flange_b.f - f + f_min - f_max
    v > 0: f = F_prop v + F_Coulomb + F_Stribeck exp(-fexp v);  v < 0: its mirror image;
    v = 0: |f| <= 1.001 (F_Coulomb + F_Stribeck)
    flange_a.s = smin with f_min >= 0, or flange_a.s > smin with f_min = 0; likewise flange_b, smax and f_max

    A mass that hits a stop at speed v instantly rebounds at restitution v. lossPower does not include the energy lost at that instant.
    The signals stop_min and stop_max are 1 while the mass is pressed against a stop. Friction is then stuck
    (mode 0): it shares the pressing force equally with the stop until it reaches its limit; the stop takes the rest. No motion depends
    on this.
    """

    m: Parameter = parameter("kg", "Mass", min=0)
    F_prop: Parameter = parameter("N.s/m", "Speed-proportional friction", min=0)
    F_Coulomb: Parameter = parameter("N", "Constant friction", min=0)
    F_Stribeck: Parameter = parameter("N", "Friction at rest beyond F_Coulomb", min=0)
    fexp: Parameter = parameter("s/m", "Decay of the Stribeck friction with speed", min=0)
    smax: Parameter = parameter("m", "Stop for flange_b")
    smin: Parameter = parameter("m", "Stop for flange_a")
    restitution: Parameter = parameter("1", "Coefficient of restitution", default=0.0, min=0, max=1)
    s: Variable = variable("m", "Position of the middle between the flanges", start=0.0, prefer=True)
    v: Variable = variable("m/s", "Speed, der(s)", start=0.0, prefer=True)
    a: Variable = variable("m/s2", "Acceleration, der(v)")
    f: Variable = variable("N", "Friction force, positive against positive v")
    f_min: Variable = variable("N", "Force of the stop at smin on the mass")
    f_max: Variable = variable("N", "Force of the stop at smax on the mass, against positive s")

    def check(self) -> Equations:
        """It must fit between the stops."""
        yield self.smin + self.L <= self.smax  # it fits between the stops

    def equations(self) -> Equations:
        """Newton's law, friction and two rigid stops."""
        yield from self._span()
        yield self.v == der(self.s)
        yield self.a == der(self.v)
        yield self.m * self.a == self.flange_a.f + self.flange_b.f - self.f + self.f_min - self.f_max
        rub = self.F_Coulomb + self.F_Stribeck * ca.exp(-self.fexp * ca.fabs(self.v))
        viscous = self.F_prop * self.v
        yield friction(self.v, self.f, viscous - rub, viscous + rub, peak=BREAKAWAY)
        behind, ahead = self.s - self.L / 2 - self.smin, self.smax - self.s - self.L / 2
        yield unilateral(behind, self.f_min, restitution=self.restitution, name="stop_min")
        yield unilateral(ahead, self.f_max, restitution=self.restitution, name="stop_max")
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy m v^2/2."""
        return self.m * self.v**2 / 2

    def loss(self) -> Symbol:
        """Friction force times speed."""
        return self.f * self.v
