"""Drum brakes with self-energising internal shoes."""

from __future__ import annotations

from typing import Literal

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, friction, parameter, signal_input
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import ShaftWithFriction


class DrumBrake(ShaftWithFriction):
    """Two internal shoes on hinge pins, both pressed to the drum by the same force.

    w = der(flange_a.phi - support.phi),  flange_b.phi = flange_a.phi,  flange_a.tau + flange_b.tau = tau,  F = F_max f_normalized
    T_lead = mue F lever radius S/(N - mue M),  T_trail = mue F lever radius S/(N + mue M),  S = cos(theta_1) - cos(theta_2)
    N = hinge ((theta_2 - theta_1)/2 - (sin(2 theta_2) - sin(2 theta_1))/4),  M = radius S - hinge (sin(theta_2)^2 - sin(theta_1)^2)/2
    w > 0: tau = leading T_lead + (2 - leading) T_trail;  w < 0: tau = -(leading T_trail + (2 - leading) T_lead);  w = 0: between the two

    The pressure on the lining grows with the sine of the angle from the hinge pin. Its normal forces have the moment N about the pin, its
    friction forces the moment mue M, which presses a leading shoe on and lifts a trailing shoe off. ``leading``: number of leading shoes in
    forward rotation: 1 (simplex, the same in both directions), 2 (duplex) or 0. A shoe with N <= mue M locks without any force; such
    parameters are rejected, and so are hinge pins outside the drum (hinge >= radius), about which friction forces may have the opposite
    moment. A force below 0 counts as 0, one above 1 as 1. Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design,
    9th ed., McGraw-Hill 2011, sec. 16-2, eqs. (16-2) to (16-7).

    Errors: ParameterError if the leading shoe would lock itself, and for hinge pins that are not inside the drum.

    >>> brake = DrumBrake(radius=0.15, hinge=0.1227, lever=0.212, theta_1=0.0, theta_2=2.2, mue=0.32, F_max=2280.0)
    >>> [round(torque) for torque in brake.torques()]
    [366, 162]
    """

    leading: Literal[0, 1, 2] = 1
    radius: Parameter = parameter("m", "Radius of the drum", default=0.115, above=0)
    hinge: Parameter = parameter("m", "Distance of a hinge pin from the centre of the drum", default=0.09, above=0)
    lever: Parameter = parameter("m", "Arm of the force about the hinge pin", default=0.17, above=0)
    theta_1: Parameter = parameter("rad", "Angle from the hinge pin to the heel of the lining", default=0.35, min=0)
    theta_2: Parameter = parameter("rad", "Angle from the hinge pin to the toe of the lining", default=2.35, max=3.1416)
    mue: Parameter = parameter("1", "Coefficient of friction", default=0.35, min=0)
    F_max: Parameter = parameter("N", "Force on each shoe at f_normalized = 1", default=2000.0, min=0)
    f_normalized: Input = signal_input("1", "Force over F_max, 0 to 1", default=0.0)

    def check(self) -> Equations:
        """The pins inside the drum make M positive; no shoe may lock itself: N > mue M."""
        yield self.theta_1 < self.theta_2  # the lining has a length
        yield self.hinge < self.radius  # the hinge pins are inside the drum
        _, normal, moment = self._moments()
        yield normal > self.mue * moment  # else a leading shoe locks itself

    def equations(self) -> Equations:
        """A shaft whose friction depends on the direction of rotation."""
        yield from self._turn()
        force = limited(self.f_normalized.value)
        lead, trail = self._torques()
        n = float(self.leading)
        forward, backward = n * lead + (2 - n) * trail, n * trail + (2 - n) * lead
        yield friction(self.w, self.tau, -force * backward, force * forward)

    def torques(self) -> tuple[float, float]:
        """Torques of a leading and of a trailing shoe [N.m] at full force."""
        lead, trail = self._torques()
        return float(lead), float(trail)

    def _moments(self) -> tuple[Symbol, Symbol, Symbol]:
        """S, and the moments N and M about the hinge pin per unit of b p_max/sin(theta_max) radius."""
        one, two = self.theta_1, self.theta_2
        span = ca.cos(one) - ca.cos(two)
        normal = self.hinge * ((two - one) / 2 - (ca.sin(2 * two) - ca.sin(2 * one)) / 4)
        return span, normal, self.radius * span - self.hinge * (ca.sin(two) ** 2 - ca.sin(one) ** 2) / 2

    def _torques(self) -> tuple[Symbol, Symbol]:
        span, normal, moment = self._moments()
        arm = self.mue * self.F_max * self.lever * self.radius * span
        return arm / (normal - self.mue * moment), arm / (normal + self.mue * moment)
