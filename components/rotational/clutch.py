"""Clutches: dry friction between two shafts, pressed by a controlled force."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, friction, parameter, signal_input, variable
from powertrain.components.friction_table import Table, at_rest, at_speed
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, Lossy


class _Pressed(CompliantWithRelativeStates, Lossy):
    """Partial: plates pressed together by a signal."""

    mue_pos: Table = ((0.0, 0.5),)
    peak: Parameter = parameter("1", "Break-away coefficient of friction relative to mue_pos(0)", default=1.0, min=1)
    cgeo: Parameter = parameter("m", "Friction radius times number of friction faces", default=1.0, min=0)
    fn_max: Parameter = parameter("N", "Normal force at f_normalized = 1", min=0)
    f_normalized: Input = signal_input("1", "Normal force over fn_max; the clutch is open where it is not positive")
    fn: Variable = variable("N", "Normal force")

    def _press(self) -> Equations:
        yield from self._transmit()
        yield self.fn == self.fn_max * self.f_normalized.value

    def _limit(self) -> Symbol:
        """Torque of the sliding plates at |w_rel|."""
        return self.cgeo * ca.fmax(self.fn, 0) * at_speed(self, "mue_pos", self.w_rel, ("rad/s", "1"))

    @property
    def capacity(self) -> Symbol:
        """Torque of the slowly sliding plates at f_normalized = 1 [N.m]."""
        return self.fn_max * self.cgeo * at_rest(self, "mue_pos")

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel


class Clutch(_Pressed):
    """Coulomb friction between two shafts, proportional to a normal force controlled by a signal.

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
        yield from self._press()
        limit = self._limit()
        yield friction(self.w_rel, self.tau, -limit, limit, peak=self.peak)
        yield from self._dissipate()


class OneWayClutch(_Pressed):
    """A clutch with a freewheel in parallel: flange_b may run ahead of flange_a, against friction, but never fall behind.

    w_rel = der(flange_b.phi - flange_a.phi) >= 0,  tau = flange_b.tau = -flange_a.tau,  fn = fn_max f_normalized
    w_rel > 0: tau = cgeo mue_pos(w_rel) fn (0 if fn <= 0);  w_rel = 0: tau <= peak cgeo mue_pos(0) fn

    ``mue_pos``: rows (relative speed rad/s, coefficient of friction), linear between them and beyond the last.
    It is a single component because the torques of a stuck clutch and a stuck freewheel in parallel are not determined individually.
    """

    def equations(self) -> Equations:
        """Friction forward, locked backward."""
        yield from self._press()
        yield friction(self.w_rel, self.tau, -math.inf, self._limit(), peak=self.peak)
        yield from self._dissipate()
