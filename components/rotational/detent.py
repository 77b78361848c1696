"""Detents that hold a shaft at one of several angles."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, parameter
from powertrain.components.rotational.interfaces import OneFlangeAndSupport


class Detent(OneFlangeAndSupport):
    """A spring-loaded ball in notches around a shaft: it holds at a notch and turns the shaft towards the nearest one.

    phi = flange.phi - support.phi,  flange.tau = tau_max sin(notches (phi - phi_0)),  flange.tau + support.tau = 0

    A shaft leaves a notch at the torque tau_max and needs the energy 2 tau_max/notches. The torque has a potential; nothing is lost.
    """

    tau_max: Parameter = parameter("N.m", "Torque at which it lets go", default=1.0, min=0)
    notches: Parameter = parameter("1", "Notches in a turn", default=6.0, above=0)
    phi_0: Parameter = parameter("rad", "Angle of a notch", default=0.0)

    def equations(self) -> Equations:
        """A circle of notches."""
        yield from self._against_support()
        yield self.flange.tau == self.tau_max * ca.sin(self._phase())

    def _phase(self) -> Symbol:
        return self.notches * (self.phi - self.phi_0)

    def energy(self) -> Symbol:
        """Energy of the spring, 0 in a notch."""
        return self.tau_max / self.notches * (1 - ca.cos(self._phase()))
