"""An elastic contact that can lift off."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, parameter, switch, variable
from powertrain.components.limited import limited_at
from powertrain.components.translational.interfaces import CompliantWithRelativeStates, Lossy

TOUCH = 1e-30
"""Smallest penetration in m that is raised to a power: at zero the derivative of x^n with respect to n is not finite."""


class ElastoGap(CompliantWithRelativeStates, Lossy):
    """A spring and damper that act while two parts are in contact.

    s_rel < s_rel0: f = f_c + f_d with f_c = -c (s_rel0 - s_rel)^n and f_d = d v_rel limited to [f_c, -f_c];
    else f = 0.  lossPower = f_d v_rel

    The limit makes the damper force grow from zero at contact, and prevents tension when the parts separate. The exponent n is 1.5 for
    Hertz' contact of spheres. Source: Modelica Standard Library 4.0.0.
    """

    c: Parameter = parameter("N/m", "Stiffness (N/m^n)", min=0)
    d: Parameter = parameter("N.s/m", "Damping", min=0)
    s_rel0: Parameter = parameter("m", "Relative position at which the parts touch", default=0.0)
    n: Parameter = parameter("1", "Exponent of the spring force", default=1.0, min=1)
    f_c: Variable = variable("N", "Spring force, not positive")
    f_d: Variable = variable("N", "Damper force, never larger than the spring force")

    def equations(self) -> Equations:
        """Spring and limited damper while the parts touch."""
        yield from self._transmit()
        contact = self.s_rel < self.s_rel0
        yield self.f_c == switch(contact, -self.c * self._penetration() ** self.n, 0.0, continuous=True)
        limited = limited_at(self.d * self.v_rel, self.f_c, -self.f_c)
        yield self.f_d == switch(contact, limited, 0.0, continuous=True)  # in the gap also the slope is zero
        yield self.f == self.f_c + self.f_d
        yield from self._dissipate()

    def _penetration(self) -> Symbol:
        return ca.fmax(self.s_rel0 - self.s_rel, TOUCH)

    def energy(self) -> Symbol:
        """Elastic energy c x^(n+1)/(n+1) of the penetration x."""
        return self.c * self._penetration() ** (self.n + 1) / (self.n + 1)

    def loss(self) -> Symbol:
        """Damper force times relative speed."""
        return self.f_d * self.v_rel
