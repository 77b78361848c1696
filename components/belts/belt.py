"""Belts: spans that stretch and become slack, and pulleys that slip."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, connect, der, friction, parameter, port, variable, within
from powertrain.components.limited import limited_by
from powertrain.components.rotational.interfaces import Flange, Lossy
from powertrain.components.rotational.interfaces import TwoFlanges as TwoShafts
from powertrain.components.translational.interfaces import CompliantWithRelativeStates
from powertrain.components.translational.interfaces import Flange as BeltEnd

CONTACT = 0.999
"""Largest speed of a belt over that at which it lifts off its pulleys; 0.2 % of its grip is left there."""


class BeltSpan(CompliantWithRelativeStates, Lossy):
    """The free span of a belt between two pulleys, from flange_a to flange_b; it pulls but never pushes.

    s_rel = flange_b.s - flange_a.s,  v_rel = der(s_rel),  f = flange_b.f = -flange_a.f
    f = stretch + damping,  stretch = T_0 + c s_rel or 0 where that is negative,  damping = d v_rel within -stretch..stretch
    """

    T_0: Parameter = parameter("N", "Pretension", default=300.0, min=0)
    c: Parameter = parameter("N/m", "Stiffness", default=2e5, above=0)
    d: Parameter = parameter("N.s/m", "Damping", default=50.0, min=0)
    stretch: Variable = variable("N", "Elastic part of the tension")

    def equations(self) -> Equations:
        """A spring, and a damper that never exceeds it."""
        yield from self._transmit()
        yield self.stretch == ca.fmax(self.T_0 + self.c * self.s_rel, 0)
        yield self.f == self.stretch + self._damping()
        yield from self._dissipate()

    def _damping(self) -> Symbol:
        return limited_by(self.stretch, self.d * self.v_rel)

    def energy(self) -> Symbol:
        """Elastic energy stretch^2/(2 c)."""
        return self.stretch**2 / (2 * self.c)

    def loss(self) -> Symbol:
        """Damping force times relative speed."""
        return self._damping() * self.v_rel


class Pulley(Lossy):
    """A pulley with a belt running from belt_a to belt_b, which slips at Eytelwein's limit.

    v = der(s),  s = belt_a.s = belt_b.s,  slip = v - radius der(flange.phi)
    m der(v) = belt_a.f + belt_b.f - F,  flange.tau = -radius F
    slip > 0: F = limit;  slip < 0: F = -limit;  slip = 0: |F| <= limit
      limit = (exp(mue wrap) - 1) (T - rho v^2), not below 0, with the smaller T of the tensions -belt_a.f and belt_b.f

    Limit and centrifugal tension are those of a belt that slips on its whole wrap: (T_1 - rho v^2)/(T_2 - rho v^2) = exp(mue wrap). Where
    rho v^2 exceeds the smaller tension, the belt lifts off and has no grip; that it also stretches its spans then is not modelled. The
    belt does not stretch on the pulley, so creep is not modelled. For a V belt or a ribbed belt mue is the coefficient of friction
    divided by the sine of half the groove angle. For a toothed belt use a ``ChainDrive`` without polygon effect. Spans and pulleys in a
    ring form the accessory drive of an engine.
    Source: K. L. Johnson, Contact Mechanics, Cambridge 1985, section 8.2; R. L. Norton, Machine Design, ch. 17.
    """

    flange: Flange = port(Flange)
    belt_a: BeltEnd = port(BeltEnd)
    belt_b: BeltEnd = port(BeltEnd)
    radius: Parameter = parameter("m", "Effective radius", default=0.06, above=0)
    wrap: Parameter = parameter("rad", "Wrap angle", default=math.pi, above=0)
    mue: Parameter = parameter(
        "1", "Coefficient of friction, that of the equivalent flat belt", default=1.0, min=0, max=5
    )
    m: Parameter = parameter("kg", "Mass of the belt on the pulley and half of its spans", default=0.05, above=0)
    rho: Parameter = parameter("kg/m", "Mass of the belt over its length", default=0.1, min=0)
    s: Variable = variable("m", "Path of the belt")
    v: Variable = variable("m/s", "Speed of the belt", prefer=True)
    slip: Variable = variable("m/s", "Speed of the belt on the pulley", prefer=True)
    F: Variable = variable("N", "Friction force by which the belt drives the pulley")

    def equations(self) -> Equations:
        """The mass of the belt sticks to a rim or slips."""
        yield self.belt_a.s == self.s
        yield self.belt_b.s == self.s
        yield self.v == der(self.s)
        yield self.slip == self.v - self.radius * der(self.flange.phi)
        yield self.m * der(self.v) == self.belt_a.f + self.belt_b.f - self.F
        yield self.flange.tau == -self.radius * self.F
        tension = ca.fmin(-self.belt_a.f, self.belt_b.f) - self.rho * self.v**2
        limit = (ca.exp(self.mue * self.wrap) - 1) * ca.fmax(tension, 0)
        yield friction(self.slip, self.F, -limit, limit)
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy of the belt."""
        return self.m * self.v**2 / 2

    def loss(self) -> Symbol:
        """Friction force times slip."""
        return self.F * self.slip


class BeltDrive(TwoShafts):
    """An open belt drive of two pulleys, which turn in the same direction.

    wrap_a = pi - 2 asin((radius_b - radius_a)/distance),  wrap_b = 2 pi - wrap_a
      stiffness of a span = EA/root(distance^2 - (radius_b - radius_a)^2),  speed ratio w_a/w_b = radius_b/radius_a where nothing slips

    Both spans have the tension T_0 at rest. They share the load: T_1 + T_2 = 2 T_0 until one is slack, so the largest force is
    2 (T_0 - rho v^2) (exp(mue wrap) - 1)/(exp(mue wrap) + 1) with the smaller wrap and the speed v of the belt. At v = root(T_0/rho) the
    belt would lift off its pulleys; a simulation ends just below, at 0.999 of that speed. The shafts run in a housing at rest.
    Errors: ParameterError for pulleys that overlap. The defaults are invented, for a ribbed belt with six ribs.
    """

    pulley_a: Pulley = Pulley()
    pulley_b: Pulley = Pulley()
    tight: BeltSpan = BeltSpan()
    loose: BeltSpan = BeltSpan()
    radius_a: Parameter = parameter("m", "Effective radius of pulley a", default=0.075, above=0)
    radius_b: Parameter = parameter("m", "Effective radius of pulley b", default=0.03, above=0)
    distance: Parameter = parameter("m", "Distance of the axes", default=0.3, above=0)
    T_0: Parameter = parameter("N", "Pretension", default=300.0, above=0)
    EA: Parameter = parameter("N", "Stiffness of the belt, force over strain", default=6e4, above=0)
    d: Parameter = parameter("N.s/m", "Damping of a span", default=50.0, min=0)
    mue: Parameter = parameter(
        "1", "Coefficient of friction, that of the equivalent flat belt", default=1.0, min=0, max=5
    )
    rho: Parameter = parameter("kg/m", "Mass of the belt over its length", default=0.1, above=0)

    def check(self) -> Equations:
        """The pulleys must not overlap."""
        yield self.radius_a + self.radius_b < self.distance  # the pulleys do not overlap

    def equations(self) -> Equations:
        """Two pulleys and two spans in a ring; on the slack side, if a drives forward, the belt runs from a to b."""
        a, b = self.pulley_a, self.pulley_b
        step = self.radius_b - self.radius_a
        fastest = CONTACT * ca.sqrt(self.T_0 / self.rho)
        length, angle = ca.sqrt(self.distance**2 - step**2), 2 * ca.asin(step / self.distance)
        for pulley, radius, wrap in ((a, self.radius_a, math.pi - angle), (b, self.radius_b, math.pi + angle)):
            yield pulley.radius == radius
            yield pulley.wrap == wrap
            yield pulley.mue == self.mue
            yield pulley.rho == self.rho
            yield pulley.m == self.rho * (radius * wrap + length)
            within(pulley.v, -fastest, fastest, name="speed of the belt, which centrifugal force lifts off", unit="m/s")
        for span in (self.tight, self.loose):
            yield span.T_0 == self.T_0
            yield span.c == self.EA / length
            yield span.d == self.d
        yield connect(self.flange_a, a.flange)
        yield connect(self.flange_b, b.flange)
        yield connect(a.belt_b, self.loose.flange_a)
        yield connect(self.loose.flange_b, b.belt_a)
        yield connect(b.belt_b, self.tight.flange_a)
        yield connect(self.tight.flange_b, a.belt_a)
