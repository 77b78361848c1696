"""Rotating bodies."""

from __future__ import annotations

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, variable
from powertrain.components.rotational.interfaces import TwoFlanges


class Inertia(TwoFlanges):
    """A rigid shaft with a moment of inertia between its two flanges.

    phi = flange_a.phi = flange_b.phi,  w = der(phi),  a = der(w),  J a = flange_a.tau + flange_b.tau
    """

    J: Parameter = parameter("kg.m2", "Moment of inertia", min=0)
    phi: Variable = variable("rad", "Rotation angle", start=0.0)
    w: Variable = variable("rad/s", "Angular velocity, der(phi)", start=0.0)
    a: Variable = variable("rad/s2", "Angular acceleration, der(w)")

    def equations(self) -> Equations:
        """Newton's law for a rotating body."""
        yield self.phi == self.flange_a.phi
        yield self.phi == self.flange_b.phi
        yield self.w == der(self.phi)
        yield self.a == der(self.w)
        yield self.J * self.a == self.flange_a.tau + self.flange_b.tau

    def energy(self) -> Symbol:
        """Kinetic energy J w^2/2."""
        return self.J * self.w**2 / 2
