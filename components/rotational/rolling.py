"""From rotation to translation."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, parameter, port, support
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.translational.interfaces import Flange as LinearFlange


class RotationToTranslation(Component):
    """Partial: a shaft and a rod, each with its support."""

    flangeR: Flange = port(Flange)
    flangeT: LinearFlange = port(LinearFlange)
    supportR: Flange = support(Flange)
    supportT: LinearFlange = support(LinearFlange)

    def _against_supports(self) -> Equations:
        yield self.flangeR.tau + self.supportR.tau == 0
        yield self.flangeT.f + self.supportT.f == 0


class IdealRollingWheel(RotationToTranslation):
    """A wheel without inertia or mass that rolls without slip.

    radius (flangeR.phi - supportR.phi) = flangeT.s - supportT.s,  radius flangeT.f + flangeR.tau = 0
    """

    radius: Parameter = parameter("m", "Rolling radius", default=0.3, exclude=(0.0,))

    def equations(self) -> Equations:
        """Path = radius times angle."""
        yield from self._against_supports()
        yield (self.flangeR.phi - self.supportR.phi) * self.radius == self.flangeT.s - self.supportT.s
        yield self.radius * self.flangeT.f + self.flangeR.tau == 0


class IdealGearR2T(RotationToTranslation):
    """A rack and pinion (or a screw) without inertia, mass or loss.

    flangeR.phi - supportR.phi = ratio (flangeT.s - supportT.s),  ratio flangeR.tau + flangeT.f = 0
    """

    ratio: Parameter = parameter("rad/m", "Angle of flangeR over path of flangeT", default=1.0, exclude=(0.0,))

    def equations(self) -> Equations:
        """Angle = ratio times path."""
        yield from self._against_supports()
        yield self.flangeR.phi - self.supportR.phi == self.ratio * (self.flangeT.s - self.supportT.s)
        yield self.ratio * self.flangeR.tau + self.flangeT.f == 0
