"""Shafts with play: an elastic contact on either side of a gap."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, parameter, switch, variable
from powertrain.components.limited import limited_at
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, Lossy

NO_PLAY = 1e-10
"""Backlash in rad up to which the element is a plain spring and damper."""


class _Play(CompliantWithRelativeStates, Lossy):
    """Partial: a spring behind a gap of width b around phi_rel0."""

    c: Parameter = parameter("N.m/rad", "Stiffness of the contact", above=0)
    d: Parameter = parameter("N.m.s/rad", "Damping of the contact", min=0)
    b: Parameter = parameter("rad", "Backlash from contact to contact", default=0.0, min=0)
    phi_rel0: Parameter = parameter("rad", "Relative angle in the middle of the gap", default=0.0)
    tau_c: Variable = variable("N.m", "Spring torque")

    def _gap(self, offset: Symbol | float = 0.0) -> tuple[Symbol, Symbol, Symbol]:
        """The angle from the middle of the gap ``offset`` rad beyond phi_rel0, and whether it is beyond the gap or before it."""
        x = self.phi_rel - self.phi_rel0 - offset
        return x, x > self.b / 2, x < -self.b / 2

    def _spring(self, x: Symbol, beyond: Symbol, before: Symbol) -> Symbol:
        """Spring torque: zero in the gap, linear on either side."""
        left = switch(before, self.c * (x + self.b / 2), 0.0, continuous=True)
        right = switch(beyond, self.c * (x - self.b / 2), left, continuous=True)
        return switch(self.b <= NO_PLAY, self.c * x, right)

    def _limited_damping(self, beyond: Symbol, before: Symbol) -> Symbol:
        """Damper torque, limited to the spring torque: in the gap also its slope is zero."""
        limit = ca.fabs(self.tau_c)
        limited = limited_at(self.d * self.w_rel, -limit, limit)
        return switch(beyond, limited, switch(before, limited, 0.0, continuous=True), continuous=True)

    def energy(self) -> Symbol:
        """Elastic energy of the contact tau_c^2/(2 c)."""
        return self.tau_c**2 / (2 * self.c)

    def loss(self) -> Symbol:
        """Power of the torque beyond the spring's: (tau - tau_c) w_rel."""
        return (self.tau - self.tau_c) * self.w_rel


class ElastoBacklash(_Play):
    """Backlash in series with a spring and damper; the torque is continuous and never pulls.

    x = phi_rel - phi_rel0,  tau_c = c (x - b/2) for x > b/2,  c (x + b/2) for x < -b/2,  else 0
    tau = tau_c + tau_d with tau_d = d w_rel limited to [-|tau_c|, |tau_c|]

    The limit makes the damper torque grow from zero at contact and end at zero when the sides separate (the law of the Modelica
    Standard Library 4.0.0). lossPower = tau_d w_rel; unlike in that library, this includes the energy of the spring that is lost if the
    sides separate before it is relaxed. Up to b = 1e-10 rad the element is a SpringDamper.
    """

    def equations(self) -> Equations:
        """Spring behind the gap, and a damper limited to the spring torque."""
        yield from self._transmit()
        x, beyond, before = self._gap()
        yield self.tau_c == self._spring(x, beyond, before)
        damping = switch(self.b <= NO_PLAY, self.d * self.w_rel, self._limited_damping(beyond, before))
        yield self.tau == self.tau_c + damping
        yield from self._dissipate()


class ElastoBacklash2(_Play):
    """Backlash in series with a spring and damper; the torque jumps at contact and never pulls.

    x = phi_rel - phi_rel0,  tau_c = c (x - b/2) for x > b/2,  c (x + b/2) for x < -b/2,  else 0
    tau = tau_c + d w_rel, or 0 if this opposes tau_c;  lossPower = (tau - tau_c) w_rel

    Up to b = 1e-10 rad the element is a SpringDamper.
    """

    def equations(self) -> Equations:
        """Spring and damper behind the gap."""
        yield from self._transmit()
        x, beyond, before = self._gap()
        yield self.tau_c == self._spring(x, beyond, before)
        full = self.tau_c + self.d * self.w_rel
        push = switch(full > 0, full, 0.0, continuous=True)
        pull = switch(full < 0, full, 0.0, continuous=True)
        contact = switch(beyond, push, switch(before, pull, 0.0))
        yield self.tau == switch(self.b <= NO_PLAY, full, contact)
        yield from self._dissipate()
