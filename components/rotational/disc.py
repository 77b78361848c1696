"""A massless rigid shaft."""

from __future__ import annotations

from powertrain import Equations, Parameter, Variable, parameter, variable
from powertrain.components.rotational.interfaces import TwoFlanges


class Disc(TwoFlanges):
    """A rigid shaft without inertia whose flanges are at a fixed angle to each other.

    flange_a.phi = phi - deltaPhi/2,  flange_b.phi = phi + deltaPhi/2,  flange_a.tau + flange_b.tau = 0
    """

    deltaPhi: Parameter = parameter("rad", "Angle of flange_b ahead of flange_a", default=0.0)
    phi: Variable = variable("rad", "Mean angle of the two flanges")

    def equations(self) -> Equations:
        """Rigid and massless."""
        yield self.flange_a.phi == self.phi - self.deltaPhi / 2
        yield self.flange_b.phi == self.phi + self.deltaPhi / 2
        yield self.flange_a.tau + self.flange_b.tau == 0
