"""Gears without loss."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, parameter, port
from powertrain.components.rotational.interfaces import Flange, TwoShaftsAndSupport


class IdealGear(TwoShaftsAndSupport):
    """A gear pair in a housing (the support) without inertia, elasticity or loss.

    phi_a = flange_a.phi - support.phi = ratio phi_b,  phi_b = flange_b.phi - support.phi
    ratio flange_a.tau + flange_b.tau = 0
    """

    ratio: Parameter = parameter("1", "Transmission ratio, speed of flange_a over speed of flange_b", exclude=(0.0,))

    def equations(self) -> Equations:
        """One ratio for angles and torques."""
        yield from self._angles()
        yield self.phi_a == self.ratio * self.phi_b
        yield self.ratio * self.flange_a.tau + self.flange_b.tau == 0


class IdealPlanetary(Component):
    """A planetary gear with sun, carrier and ring, without inertia, elasticity or loss.

    (1 + ratio) carrier.phi = sun.phi + ratio ring.phi,  ring.tau = ratio sun.tau,  carrier.tau = -(1 + ratio) sun.tau
    """

    ratio: Parameter = parameter("1", "Teeth of the ring over teeth of the sun", exclude=(-1.0, 0.0))
    sun: Flange = port(Flange)
    carrier: Flange = port(Flange)
    ring: Flange = port(Flange)

    def equations(self) -> Equations:
        """Willis' equation and the corresponding torques."""
        yield (1 + self.ratio) * self.carrier.phi == self.sun.phi + self.ratio * self.ring.phi
        yield self.ring.tau == self.ratio * self.sun.tau
        yield self.carrier.tau == -(1 + self.ratio) * self.sun.tau
