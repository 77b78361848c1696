"""Sliding masses and massless rods."""

from __future__ import annotations

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, variable
from powertrain.components.translational.interfaces import Rigid


class Mass(Rigid):
    """A rigid sliding mass of length L between its two flanges.

    flange_a.s = s - L/2,  flange_b.s = s + L/2,  v = der(s),  a = der(v),  m a = flange_a.f + flange_b.f
    """

    m: Parameter = parameter("kg", "Mass", min=0)
    s: Variable = variable("m", "Position of the middle between the flanges", start=0.0)
    v: Variable = variable("m/s", "Speed, der(s)", start=0.0)
    a: Variable = variable("m/s2", "Acceleration, der(v)")

    def equations(self) -> Equations:
        """Newton's law."""
        yield from self._span()
        yield self.v == der(self.s)
        yield self.a == der(self.v)
        yield self.m * self.a == self.flange_a.f + self.flange_b.f

    def energy(self) -> Symbol:
        """Kinetic energy m v^2/2."""
        return self.m * self.v**2 / 2


class Rod(Rigid):
    """A rigid rod of length L without mass.

    flange_a.s = s - L/2,  flange_b.s = s + L/2,  flange_a.f + flange_b.f = 0
    """

    def equations(self) -> Equations:
        """Rigid and massless."""
        yield from self._span()
        yield self.flange_a.f + self.flange_b.f == 0
