"""Clutches: dry friction between two shafts, pressed by a controlled force."""

from __future__ import annotations

import math

from powertrain import Equations, Parameter, Symbol, friction, parameter
from powertrain.components.friction_table import at_rest
from powertrain.components.pressed import DryFaces
from powertrain.components.rotational.interfaces import FrictionCoupling


class Plates(DryFaces):
    """Partial: plates pressed together by a signal."""

    cgeo: Parameter = parameter("m", "Friction radius times number of friction faces", default=1.0, min=0)

    def _limit(self, w: Symbol) -> Symbol:
        """Torque of the plates sliding at a speed w."""
        return self.cgeo * self._friction(w, "rad/s")

    @property
    def capacity(self) -> Symbol:
        """Torque of the slowly sliding plates at f_normalized = 1 [N.m]."""
        return self.fn_max * self.cgeo * at_rest(self, "mue_pos")

    def force(self, torque: Symbol) -> Symbol:
        """Pressing force [N] with which the slowly sliding plates have a torque [N.m]."""
        return torque / (self.cgeo * at_rest(self, "mue_pos"))


class Clutch(Plates, FrictionCoupling):
    """Coulomb friction between two shafts, proportional to a pressing force controlled by a signal.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau
    fn = fn_max f_normalized;  w_rel > 0: tau = cgeo mue_pos(w_rel) fn;  w_rel < 0: tau = -cgeo mue_pos(-w_rel) fn;
    w_rel = 0: |tau| <= peak cgeo mue_pos(0) fn;  fn <= 0: tau = 0

    ``mue_pos``: rows (relative speed rad/s, coefficient of friction), linear between them and beyond the last.
    For N friction faces with radii ri, ro that have run in (uniform wear) cgeo = N (ro + ri)/2. For new, rigid faces (uniform pressure) it
    is 2 N/3 (ro^3 - ri^3)/(ro^2 - ri^2).
    Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill 2011, ch. 16.
    """

    def equations(self) -> Equations:
        """Friction in both directions."""
        yield from self._transmit()
        yield from self._press()
        limit = self._limit(self.w_rel)
        yield friction(self.w_rel, self.tau, -limit, limit, peak=self.peak)
        yield from self._dissipate()


class OneWayClutch(Plates, FrictionCoupling):
    """A clutch with a freewheel in parallel: flange_b may run ahead of flange_a, against friction, but never fall behind.

    w_rel = der(flange_b.phi - flange_a.phi) >= 0,  tau = flange_b.tau = -flange_a.tau,  fn = fn_max f_normalized
    w_rel > 0: tau = cgeo mue_pos(w_rel) fn (0 if fn <= 0);  w_rel = 0: tau <= peak cgeo mue_pos(0) fn

    ``mue_pos``: rows (relative speed rad/s, coefficient of friction), linear between them and beyond the last.
    It is a single component because the torques of a stuck clutch and a stuck freewheel in parallel are not determined individually.
    """

    def equations(self) -> Equations:
        """Friction forward, locked backward."""
        yield from self._transmit()
        yield from self._press()
        yield friction(self.w_rel, self.tau, -math.inf, self._limit(self.w_rel), peak=self.peak)
        yield from self._dissipate()
