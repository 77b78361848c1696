"""Brakes: dry friction against the housing, pressed by a controlled force."""

from __future__ import annotations

from powertrain import Equations, Variable, friction, variable
from powertrain.components.rotational.clutch import Plates
from powertrain.components.rotational.interfaces import ShaftWithFriction


class Brake(Plates, ShaftWithFriction):
    """Coulomb friction between a shaft and the support, proportional to a pressing force controlled by a signal.

    phi = flange_a.phi - support.phi = flange_b.phi - support.phi,  w = der(phi),  flange_a.tau + flange_b.tau = tau
    fn = fn_max f_normalized;  w > 0: tau = cgeo mue_pos(w) fn;  w < 0: tau = -cgeo mue_pos(-w) fn;
    w = 0: |tau| <= peak cgeo mue_pos(0) fn;  fn <= 0: tau = 0

    ``mue_pos``: rows (speed rad/s, coefficient of friction), linear between them and beyond the last.
    For N friction faces with radii ri, ro that have run in (uniform wear) cgeo = N (ro + ri)/2. For new, rigid faces (uniform pressure) it
    is 2 N/3 (ro^3 - ri^3)/(ro^2 - ri^2).
    Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill 2011, ch. 16.
    """

    phi: Variable = variable("rad", "Angle of the shaft against the support")

    def equations(self) -> Equations:
        """A rigid shaft pressed against its support."""
        yield from self._turn()
        yield self.phi == self.flange_a.phi - self.support.phi
        yield from self._press()
        limit = self._limit(self.w)
        yield friction(self.w, self.tau, -limit, limit, peak=self.peak)
