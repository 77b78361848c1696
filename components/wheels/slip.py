"""Tyres with slip: the common equations, and the linear tyre."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, friction, parameter, variable, within
from powertrain.components.wheels.interfaces import Wheel

SLOW = 3.0
"""Speed v_low [m/s] below which a tyre counts as standing rather than rolling: about walking pace."""

LEFT = 1e-3
"""Share of the grip that remains along the road if the side force would take all of it."""
ROUND = 1e-15
"""Grip of a road without friction."""


class SlippingWheel(Wheel):
    """Partial: a wheel with a tyre, whose slip speed is the sum of three parts in series with the same force f.

    v_slip = radius w - v = der(u) + v_creep + v_slide
    u: the tyre is a spring and a damper in parallel;  v_creep = |v| f (slip per force): loaded rubber leaves the contact
    and unloaded rubber enters it;  v_slide: sliding beyond the limit of friction

    The limit of friction is load root(grip^2 - side^2), by Kamm's circle, with ``side`` the side force over the load. Steps in which the
    side force alone exceeds the grip, which falls as the tyre slides, are counted: the vehicle would leave its path there.
    Nothing is divided by the speed. At standstill there is no creep: the tyre is a spring that holds the vehicle, also on a slope. As the
    creep that damps a rolling tyre is then missing, the damping increases by d_low towards standstill (Pacejka, section 8.6):
    damping = d + d_low (1 + cos(pi |v|/v_low))/2 for |v| < v_low = 3 m/s,  else damping = d
    The loss consists of the damper's, the tension of the rubber that leaves the contact, and friction; each is positive.
    """

    mu: Parameter = parameter("1", "Factor on the friction coefficient", default=1.0, min=0)
    d: Parameter = parameter("N.s/m", "Damping of the tyre along the road", default=1000.0, above=0)
    d_low: Parameter = parameter("N.s/m", "Additional damping at standstill", default=1e4, min=0)
    u: Variable = variable("m", "Deflection of the tyre along the road", start=0.0)
    v_slip: Variable = variable("m/s", "Slip speed, radius w - v", start=0.0)
    v_creep: Variable = variable("m/s", "Slip speed due to creep in the contact")
    v_slide: Variable = variable("m/s", "Sliding speed beyond the friction limit")

    def _slip(self, stiffness: Symbol, slip_per_force: Symbol, grip: Symbol, load: Symbol) -> Equations:
        yield from self._roll()
        yield self.v_slip == self.radius * self.w - self.v
        yield der(self.u) == self.v_slip - self.v_creep - self.v_slide
        yield self.f == stiffness * self.u + self._damping() * der(self.u)
        yield self.v_creep == ca.fabs(self.v) * self.f * slip_per_force
        limit = load * ca.sqrt(ca.fmax(grip**2 - self.side.value**2, (LEFT * grip) ** 2 + ROUND**2))
        yield friction(self.v_slide, self.f, -limit, limit, name="sliding")

    def _count_beyond(self, grip: Symbol) -> None:
        """``grip``: that of the present slip."""
        within(self.side.value, -grip, grip, name="side force over load", unit="1", action="count")

    def _loss(self) -> Symbol:
        stretching = self.v_slip - self.v_creep - self.v_slide
        return self.tau_roll * self.w + self._damping() * stretching**2 + self.f * (self.v_creep + self.v_slide)

    def _damping(self) -> Symbol:
        return self.d + self.d_low * (1 + ca.cos(math.pi * ca.fmin(ca.fabs(self.v) / SLOW, 1))) / 2


class SlipWheel(SlippingWheel):
    """A wheel with a force proportional to slip up to the friction limit, with a relaxation length.

    steady: f = C v_slip/|v|, at most limit;  otherwise the deflection u relaxes over the distance sigma (1 + d |v|/C):
    f = C/sigma u + damping der(u),  der(u) = v_slip - |v| f/C - v_slide
    v_slide > 0: f = limit;  v_slide < 0: f = -limit;  v_slide = 0: |f| <= limit,  limit = fn root(mu^2 - side^2)
    stored energy = C/sigma u^2/2,  loss = |v| f^2/C + f v_slide + damping der(u)^2 + tau_roll w

    For C to infinity at fixed sigma it rolls like a rigid wheel, up to the friction limit.
    Source of the relaxation: H. B. Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, ch. 7 (sigma der(u) + |v| u = sigma v_slip).
    """

    C: Parameter = parameter("N", "Slip stiffness, force over slip", default=6e4, above=0)
    sigma: Parameter = parameter("m", "Relaxation length", default=0.3, above=0)

    def equations(self) -> Equations:
        """Creep in proportion to the force."""
        yield from self._slip(self.C / self.sigma, 1 / self.C, self.mu, self.fn)
        self._count_beyond(self.mu)

    def energy(self) -> Symbol:
        """Kinetic energy and the tyre's deflection."""
        return self.J * self.w**2 / 2 + self.C / self.sigma * self.u**2 / 2

    def loss(self) -> Symbol:
        """Rolling, damping, creep and sliding."""
        return self._loss()
