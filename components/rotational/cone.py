"""Cone clutches and cone brakes: the wedge of the cone multiplies the pressing force."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import Equations, Parameter, Symbol, friction, parameter
from powertrain.components.friction_table import Table, at_rest
from powertrain.components.pressed import DryFaces
from powertrain.components.rotational.interfaces import FrictionCoupling, ShaftWithFriction


class _Cone(DryFaces):
    """Partial: cones pressed together by an axial force from a signal."""

    mue_pos: Table = ((0.0, 0.1),)
    radius: Parameter = parameter("m", "Mean radius of the cones", default=0.1, above=0)
    angle: Parameter = parameter(
        "rad", "Half of the cone's opening angle", default=math.radians(12.5), above=0, max=math.pi / 2
    )
    cones: Parameter = parameter("1", "Number of friction cones that act in parallel", default=1.0, above=0)

    def check(self) -> Equations:
        """The cones must release by themselves when the force ends: tan(angle) exceeds the coefficient of friction at rest."""
        yield ca.sin(self.angle) > self.peak * at_rest(self, "mue_pos") * ca.cos(self.angle)  # else the cones stick

    def _limit(self, w: Symbol) -> Symbol:
        """Torque of the cones sliding at speed w."""
        return self.cones * self.radius / ca.sin(self.angle) * self._friction(w, "rad/s")


class ConeClutch(_Cone, FrictionCoupling):
    """A cone clutch between two shafts, pressed by an axial force from a signal.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau,  fn = fn_max f_normalized
    tau_max = cones mue_pos(|w_rel|) fn radius/sin(angle);  sliding: tau = tau_max sign(w_rel);  w_rel = 0: |tau| <= peak tau_max

    The cone's normal force is fn/sin(angle), so a flat cone (angle = pi/2) is a plate. A steep cone sticks: with tan(angle) <= mue it must
    be pulled apart, which a pressing force cannot do. Such parameters are rejected. ``mue_pos``: rows (relative speed rad/s, coefficient of
    friction), linear between them and beyond the last. Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th
    ed., McGraw-Hill 2011, sec. 16-7 (uniform wear).

    Errors: ParameterError if the cone would stick.
    """

    def equations(self) -> Equations:
        """Friction in both directions."""
        yield from self._transmit()
        yield from self._press()
        limit = self._limit(self.w_rel)
        yield friction(self.w_rel, self.tau, -limit, limit, peak=self.peak)
        yield from self._dissipate()


class ConeBrake(_Cone, ShaftWithFriction):
    """A cone brake between a shaft and the support, pressed by an axial force from a signal.

    w = der(flange_a.phi - support.phi),  flange_b.phi = flange_a.phi,  flange_a.tau + flange_b.tau = tau,  fn = fn_max f_normalized
    tau_max = cones mue_pos(|w|) fn radius/sin(angle);  sliding: tau = tau_max sign(w);  w = 0: |tau| <= peak tau_max

    The law, its limits and its source are those of ``ConeClutch``. Errors: ParameterError if the cone would stick.
    """

    def equations(self) -> Equations:
        """A rigid shaft pressed against its support."""
        yield from self._turn()
        yield from self._press()
        limit = self._limit(self.w)
        yield friction(self.w, self.tau, -limit, limit, peak=self.peak)
