"""Brakes: dry friction against the housing, pressed by a controlled force."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, friction, parameter, signal_input, variable
from powertrain.components.friction_table import Table, at_rest, at_speed
from powertrain.components.rotational.interfaces import ShaftWithFriction


class Brake(ShaftWithFriction):
    """Coulomb friction between a shaft and the support, proportional to a normal force controlled by a signal.

    phi = flange_a.phi - support.phi = flange_b.phi - support.phi,  w = der(phi),  flange_a.tau + flange_b.tau = tau
    fn = fn_max f_normalized;  w > 0: tau = cgeo mue_pos(w) fn;  w < 0: tau = -cgeo mue_pos(-w) fn;
    w = 0: |tau| <= peak cgeo mue_pos(0) fn;  fn <= 0: tau = 0

    ``mue_pos``: rows (speed rad/s, coefficient of friction), linear between them and beyond the last.
    For N friction faces with radii ri, ro that have run in (uniform wear) cgeo = N (ro + ri)/2. For new, rigid faces (uniform pressure) it
    is 2 N/3 (ro^3 - ri^3)/(ro^2 - ri^2).
    Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill 2011, ch. 16.
    """

    mue_pos: Table = ((0.0, 0.5),)
    peak: Parameter = parameter("1", "Break-away coefficient of friction relative to mue_pos(0)", default=1.0, min=1)
    cgeo: Parameter = parameter("m", "Friction radius times number of friction faces", default=1.0, min=0)
    fn_max: Parameter = parameter("N", "Normal force at f_normalized = 1", min=0)
    f_normalized: Input = signal_input("1", "Normal force over fn_max; the brake is open where it is not positive")
    phi: Variable = variable("rad", "Angle of the shaft against the support")
    fn: Variable = variable("N", "Normal force")

    def equations(self) -> Equations:
        """A rigid shaft pressed against its support."""
        yield from self._turn()
        yield self.phi == self.flange_a.phi - self.support.phi
        yield self.fn == self.fn_max * self.f_normalized.value
        limit = self.cgeo * ca.fmax(self.fn, 0) * at_speed(self, "mue_pos", self.w, ("rad/s", "1"))
        yield friction(self.w, self.tau, -limit, limit, peak=self.peak)

    @property
    def capacity(self) -> Symbol:
        """Torque of the slowly sliding plates at f_normalized = 1 [N.m]."""
        return self.fn_max * self.cgeo * at_rest(self, "mue_pos")
