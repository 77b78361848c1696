"""Rotational flange and the partial components of the rotational library."""

from __future__ import annotations

from powertrain import Component, Connector, Equations, Symbol, Variable, der, flow, port, support, variable
from powertrain.components.thermal import Lossy as Lossy


class Flange(Connector):
    """The end of a shaft: its angle phi and the torque tau on the component, with the power tau der(phi)."""

    phi: Variable = variable("rad", "Absolute rotation angle")
    tau: Variable = flow("N.m", "Cut torque")

    def power(self) -> Symbol:
        """Power into the component [W]."""
        return self.tau * der(self.phi)


class TwoFlanges(Component):
    """Partial: a left and a right flange."""

    flange_a: Flange = port(Flange)
    flange_b: Flange = port(Flange)


class OneFlangeAndSupport(Component):
    """Partial: one flange that acts against a support, which is ground if nothing is connected.

    phi = flange.phi - support.phi,  flange.tau + support.tau = 0
    """

    flange: Flange = port(Flange)
    support: Flange = support(Flange)
    phi: Variable = variable("rad", "Angle of the flange against the support")

    def _against_support(self) -> Equations:
        yield self.phi == self.flange.phi - self.support.phi
        yield self.flange.tau + self.support.tau == 0


class Dragged(OneFlangeAndSupport, Lossy):
    """Partial: a flange with a torque against the support whose power is lost.

    w = der(phi),  lost = flange.tau w
    """

    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def _turn(self) -> Equations:
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque times speed."""
        return self.flange.tau * self.w


class TwoFlangesAndSupport(TwoFlanges):
    """Partial: two flanges and a support that takes the difference of their torques; ground if nothing is connected."""

    support: Flange = support(Flange)

    def _balance(self) -> Equations:
        yield self.flange_a.tau + self.flange_b.tau + self.support.tau == 0


class TwoShaftsAndSupport(TwoFlangesAndSupport):
    """Partial: two shafts whose angles phi_a and phi_b count against the support."""

    phi_a: Variable = variable("rad", "Angle of flange_a against the support")
    phi_b: Variable = variable("rad", "Angle of flange_b against the support")

    def _angles(self) -> Equations:
        yield from self._balance()
        yield self.phi_a == self.flange_a.phi - self.support.phi
        yield self.phi_b == self.flange_b.phi - self.support.phi


class ShaftWithFriction(TwoFlangesAndSupport, Lossy):
    """Partial: a rigid shaft with the friction torque tau on its support.

    w = der(flange_a.phi - support.phi),  flange_b.phi = flange_a.phi,  flange_a.tau + flange_b.tau = tau
    """

    w: Variable = variable("rad/s", "Speed of the shaft against the support")
    tau: Variable = variable("N.m", "Friction torque")

    def _turn(self) -> Equations:
        yield from self._balance()
        yield self.flange_b.phi == self.flange_a.phi
        yield self.w == der(self.flange_a.phi - self.support.phi)
        yield self.flange_a.tau + self.flange_b.tau == self.tau
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Friction torque times speed."""
        return self.tau * self.w


class Compliant(TwoFlanges):
    """Partial: a massless element that transmits one torque.

    phi_rel = flange_b.phi - flange_a.phi,  tau = flange_b.tau = -flange_a.tau
    """

    phi_rel: Variable = variable("rad", "Relative angle, flange_b.phi - flange_a.phi")
    tau: Variable = variable("N.m", "Torque between the flanges, flange_b.tau")

    def _transmit(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == self.tau
        yield self.flange_a.tau == -self.tau


class CompliantWithRelativeStates(TwoFlanges):
    """Partial: a massless element whose torque depends on relative speed. Relative angle and speed make good states.

    phi_rel = flange_b.phi - flange_a.phi,  w_rel = der(phi_rel),  tau = flange_b.tau = -flange_a.tau
    """

    phi_rel: Variable = variable("rad", "Relative angle, flange_b.phi - flange_a.phi", prefer=True)
    w_rel: Variable = variable("rad/s", "Relative speed, der(phi_rel)", prefer=True)
    tau: Variable = variable("N.m", "Torque between the flanges, flange_b.tau")

    def _transmit(self) -> Equations:
        yield self.phi_rel == self.flange_b.phi - self.flange_a.phi
        yield self.w_rel == der(self.phi_rel)
        yield self.flange_b.tau == self.tau
        yield self.flange_a.tau == -self.tau


class FrictionCoupling(CompliantWithRelativeStates, Lossy):
    """Partial: a friction torque tau between two shafts, with the loss tau w_rel."""

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel
