"""Dry friction against the housing: guides and brakes."""

from __future__ import annotations

from powertrain import (
    Equations,
    Parameter,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    variable,
)
from powertrain.components.friction_table import Table, at_speed
from powertrain.components.pressed import DryFaces
from powertrain.components.translational.interfaces import Lossy, TwoFlangesAndSupport


class _SlidesOnSupport(TwoFlangesAndSupport, Lossy):
    """Partial: a massless rod between two flanges with the friction force f on its support."""

    s: Variable = variable("m", "Position of the rod against the support")
    v: Variable = variable("m/s", "Speed of the rod against the support")
    f: Variable = variable("N", "Friction force, positive against positive v")

    def _slide(self) -> Equations:
        yield from self._balance()
        yield self.s == self.flange_a.s - self.support.s
        yield self.flange_b.s == self.flange_a.s
        yield self.v == der(self.s)
        yield self.flange_a.f + self.flange_b.f == self.f
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Friction force times speed."""
        return self.f * self.v


class SupportFriction(_SlidesOnSupport):
    """Coulomb friction of a rod in its guide.

    s = flange_a.s - support.s = flange_b.s - support.s,  v = der(s),  flange_a.f + flange_b.f = f
    v > 0: f = f_pos(v);  v < 0: f = -f_pos(-v);  v = 0: |f| <= peak f_pos(0)

    ``f_pos``: rows (speed m/s, friction force N), linear between them and beyond the last.
    """

    f_pos: Table = ((0.0, 1.0),)
    peak: Parameter = parameter("1", "Break-away force relative to f_pos(0)", default=1.0, min=1)

    def equations(self) -> Equations:
        """A rod with friction on its support."""
        yield from self._slide()
        limit = at_speed(self, "f_pos", self.v, ("m/s", "N"))
        yield friction(self.v, self.f, -limit, limit, peak=self.peak)


class Brake(DryFaces, _SlidesOnSupport):
    """Coulomb friction between a rod and the support, proportional to a pressing force controlled by a signal.

    s = flange_a.s - support.s = flange_b.s - support.s,  v = der(s),  flange_a.f + flange_b.f = f
    fn = fn_max f_normalized;  v > 0: f = cgeo mue_pos(v) fn;  v < 0: f = -cgeo mue_pos(-v) fn;
    v = 0: |f| <= peak cgeo mue_pos(0) fn;  fn <= 0: f = 0

    ``mue_pos``: rows (speed m/s, coefficient of friction), linear between them and beyond the last.
    """

    cgeo: Parameter = parameter("1", "Geometry factor, such as the number of friction faces", default=1.0, min=0)

    def equations(self) -> Equations:
        """A rod pressed against its support."""
        yield from self._slide()
        yield from self._press()
        limit = self.cgeo * self._friction(self.v, "m/s")
        yield friction(self.v, self.f, -limit, limit, peak=self.peak)
