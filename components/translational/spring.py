"""Linear springs and dampers between two rods."""

from __future__ import annotations

from powertrain import Equations, Parameter, Symbol, parameter
from powertrain.components.translational.interfaces import Compliant, CompliantWithRelativeStates, Lossy


class Spring(Compliant):
    """A linear spring.

    f = c (s_rel - s_rel0)
    """

    c: Parameter = parameter("N/m", "Stiffness", min=0)
    s_rel0: Parameter = parameter("m", "Length of the unstretched spring", default=0.0)

    def equations(self) -> Equations:
        """Hooke's law."""
        yield from self._transmit()
        yield self.f == self.c * (self.s_rel - self.s_rel0)

    def energy(self) -> Symbol:
        """Elastic energy c (s_rel - s_rel0)^2/2."""
        return self.c * (self.s_rel - self.s_rel0) ** 2 / 2


class Damper(CompliantWithRelativeStates, Lossy):
    """A linear (viscous) damper.

    f = d v_rel,  lossPower = d v_rel^2
    """

    d: Parameter = parameter("N.s/m", "Damping", min=0)

    def equations(self) -> Equations:
        """Viscous friction."""
        yield from self._transmit()
        yield self.f == self.d * self.v_rel
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Damping force times relative speed."""
        return self.d * self.v_rel**2


class SpringDamper(CompliantWithRelativeStates, Lossy):
    """A linear spring and a linear damper in parallel.

    f = c (s_rel - s_rel0) + d v_rel,  lossPower = d v_rel^2
    """

    c: Parameter = parameter("N/m", "Stiffness", min=0)
    d: Parameter = parameter("N.s/m", "Damping", min=0)
    s_rel0: Parameter = parameter("m", "Length of the unstretched spring", default=0.0)

    def equations(self) -> Equations:
        """Sum of spring and damper force."""
        yield from self._transmit()
        yield self.f == self.c * (self.s_rel - self.s_rel0) + self.d * self.v_rel
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Elastic energy c (s_rel - s_rel0)^2/2."""
        return self.c * (self.s_rel - self.s_rel0) ** 2 / 2

    def loss(self) -> Symbol:
        """Damping force times relative speed."""
        return self.d * self.v_rel**2
