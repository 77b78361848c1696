"""Translational flange and the partial components of the translational library."""

from __future__ import annotations

from powertrain import (
    Component,
    Connector,
    Equations,
    Parameter,
    Symbol,
    Variable,
    der,
    flow,
    parameter,
    port,
    support,
    variable,
)
from powertrain.components.thermal import Lossy as Lossy


class Flange(Connector):
    """The end of a rod: its position s and the force f on the component, with the power f der(s)."""

    s: Variable = variable("m", "Absolute position")
    f: Variable = flow("N", "Cut force")

    def power(self) -> Symbol:
        """Power into the component [W]."""
        return self.f * der(self.s)


class TwoFlanges(Component):
    """Partial: a left and a right flange."""

    flange_a: Flange = port(Flange)
    flange_b: Flange = port(Flange)


class OneFlangeAndSupport(Component):
    """Partial: one flange that acts against a support, which is ground if nothing is connected.

    s = flange.s - support.s,  flange.f + support.f = 0
    """

    flange: Flange = port(Flange)
    support: Flange = support(Flange)
    s: Variable = variable("m", "Position of the flange against the support")

    def _against_support(self) -> Equations:
        yield self.s == self.flange.s - self.support.s
        yield self.flange.f + self.support.f == 0


class Dragged(OneFlangeAndSupport, Lossy):
    """Partial: a flange with a force against the support whose power is lost.

    v = der(s),  lost = flange.f v
    """

    v: Variable = variable("m/s", "Speed of the flange against the support")

    def _move(self) -> Equations:
        yield from self._against_support()
        yield self.v == der(self.s)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Force times speed."""
        return self.flange.f * self.v


class TwoFlangesAndSupport(TwoFlanges):
    """Partial: two flanges and a support that takes the sum of their forces; ground if nothing is connected."""

    support: Flange = support(Flange)

    def _balance(self) -> Equations:
        yield self.flange_a.f + self.flange_b.f + self.support.f == 0


class Rigid(TwoFlanges):
    """Partial: a rigid rod of length L whose middle is at s.

    flange_a.s = s - L/2,  flange_b.s = s + L/2
    """

    L: Parameter = parameter("m", "Length from flange_a to flange_b", default=0.0)
    s: Variable = variable("m", "Position of the middle between the flanges")

    def _span(self) -> Equations:
        yield self.flange_a.s == self.s - self.L / 2
        yield self.flange_b.s == self.s + self.L / 2


class Compliant(TwoFlanges):
    """Partial: a massless element that transmits one force.

    s_rel = flange_b.s - flange_a.s,  f = flange_b.f = -flange_a.f
    """

    s_rel: Variable = variable("m", "Relative position, flange_b.s - flange_a.s")
    f: Variable = variable("N", "Force between the flanges, flange_b.f (positive pulls)")

    def _transmit(self) -> Equations:
        yield self.s_rel == self.flange_b.s - self.flange_a.s
        yield self.flange_b.f == self.f
        yield self.flange_a.f == -self.f


class CompliantWithRelativeStates(TwoFlanges):
    """Partial: a massless element whose force depends on relative speed. Relative position and speed make good states.

    s_rel = flange_b.s - flange_a.s,  v_rel = der(s_rel),  f = flange_b.f = -flange_a.f
    """

    s_rel: Variable = variable("m", "Relative position, flange_b.s - flange_a.s", prefer=True)
    v_rel: Variable = variable("m/s", "Relative speed, der(s_rel)", prefer=True)
    f: Variable = variable("N", "Force between the flanges, flange_b.f (positive pulls)")

    def _transmit(self) -> Equations:
        yield self.s_rel == self.flange_b.s - self.flange_a.s
        yield self.v_rel == der(self.s_rel)
        yield self.flange_b.f == self.f
        yield self.flange_a.f == -self.f
