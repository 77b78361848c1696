"""Dry friction in bearings."""

from __future__ import annotations

from powertrain import Equations, Parameter, Symbol, Variable, der, friction, parameter, variable
from powertrain.components.friction_table import Table, at_speed
from powertrain.components.rotational.interfaces import Lossy, TwoFlangesAndSupport


class BearingFriction(TwoFlangesAndSupport, Lossy):
    """Coulomb friction of a shaft in its bearing.

    phi = flange_a.phi - support.phi = flange_b.phi - support.phi,  w = der(phi),  flange_a.tau + flange_b.tau = tau
    w > 0: tau = tau_pos(w);  w < 0: tau = -tau_pos(-w);  w = 0: |tau| <= peak tau_pos(0)

    ``tau_pos``: rows (speed rad/s, friction torque N.m), linear between them and beyond the last.
    """

    tau_pos: Table = ((0.0, 1.0),)
    peak: Parameter = parameter("1", "Break-away torque relative to tau_pos(0)", default=1.0, min=1)
    phi: Variable = variable("rad", "Angle of the shaft against the support")
    w: Variable = variable("rad/s", "Speed of the shaft against the support")
    tau: Variable = variable("N.m", "Friction torque")

    def equations(self) -> Equations:
        """A rigid shaft with friction on its support."""
        yield from self._balance()
        yield self.phi == self.flange_a.phi - self.support.phi
        yield self.flange_b.phi == self.flange_a.phi
        yield self.w == der(self.phi)
        yield self.flange_a.tau + self.flange_b.tau == self.tau
        limit = at_speed(self, "tau_pos", self.w, ("rad/s", "N.m"))
        yield friction(self.w, self.tau, -limit, limit, peak=self.peak)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Friction torque times speed."""
        return self.tau * self.w
