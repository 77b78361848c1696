"""Accessories of a combustion engine: alternator, pumps, fan."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, variable
from powertrain.components.rotational.interfaces import Lossy, OneFlangeAndSupport


class AccessoryDrive(OneFlangeAndSupport, Lossy):
    """A belt drive that takes a constant power from the crank.

    Below w_0 its torque falls to zero at rest, so that the starter can overcome it.

    tau = P w/max(|w|, w_0)^2,  w = der(flange.phi - support.phi)
    """

    P: Parameter = parameter("W", "Power", default=0.0, min=0)
    w_0: Parameter = parameter("rad/s", "Speed from which the full power is taken", default=50.0, above=0)
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """A constant power."""
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield self.flange.tau == self._torque()
        yield from self._dissipate()

    def _torque(self) -> Symbol:
        return self.P * self.w / ca.fmax(ca.fabs(self.w), self.w_0) ** 2

    def loss(self) -> Symbol:
        """All that it takes."""
        return self._torque() * self.w
