"""Dry friction in bearings."""

from __future__ import annotations

from powertrain import Equations, Parameter, Variable, friction, parameter, variable
from powertrain.components.friction_table import Table, at_speed
from powertrain.components.rotational.interfaces import ShaftWithFriction


class BearingFriction(ShaftWithFriction):
    """Coulomb friction of a shaft in its bearing.

    phi = flange_a.phi - support.phi = flange_b.phi - support.phi,  w = der(phi),  flange_a.tau + flange_b.tau = tau
    w > 0: tau = tau_pos(w);  w < 0: tau = -tau_pos(-w);  w = 0: |tau| <= peak tau_pos(0)

    ``tau_pos``: rows (speed rad/s, friction torque N.m), linear between them and beyond the last.
    """

    tau_pos: Table = ((0.0, 1.0),)
    peak: Parameter = parameter("1", "Break-away torque relative to tau_pos(0)", default=1.0, min=1)
    phi: Variable = variable("rad", "Angle of the shaft against the support")

    def equations(self) -> Equations:
        """A rigid shaft with friction on its support."""
        yield from self._turn()
        yield self.phi == self.flange_a.phi - self.support.phi
        limit = at_speed(self, "tau_pos", self.w, ("rad/s", "N.m"))
        yield friction(self.w, self.tau, -limit, limit, peak=self.peak)
