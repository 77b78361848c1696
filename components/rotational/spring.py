"""Linear springs and dampers between two shafts."""

from __future__ import annotations

from powertrain import Equations, Parameter, Symbol, parameter
from powertrain.components.rotational.interfaces import Compliant, CompliantWithRelativeStates, Lossy


class Spring(Compliant):
    """A linear torsion spring.

    tau = c (phi_rel - phi_rel0)
    """

    c: Parameter = parameter("N.m/rad", "Stiffness", min=0)
    phi_rel0: Parameter = parameter("rad", "Relative angle of the unstretched spring", default=0.0)

    def equations(self) -> Equations:
        """Hooke's law."""
        yield from self._transmit()
        yield self.tau == self.c * (self.phi_rel - self.phi_rel0)

    def energy(self) -> Symbol:
        """Elastic energy c (phi_rel - phi_rel0)^2/2."""
        return self.c * (self.phi_rel - self.phi_rel0) ** 2 / 2


class Damper(CompliantWithRelativeStates, Lossy):
    """A linear (viscous) damper.

    tau = d w_rel,  lossPower = d w_rel^2
    """

    d: Parameter = parameter("N.m.s/rad", "Damping", min=0)

    def equations(self) -> Equations:
        """Viscous friction."""
        yield from self._transmit()
        yield self.tau == self.d * self.w_rel
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Damping torque times relative speed."""
        return self.d * self.w_rel**2


class SpringDamper(CompliantWithRelativeStates, Lossy):
    """A linear torsion spring and a linear damper in parallel.

    tau = c (phi_rel - phi_rel0) + d w_rel,  lossPower = d w_rel^2
    """

    c: Parameter = parameter("N.m/rad", "Stiffness", min=0)
    d: Parameter = parameter("N.m.s/rad", "Damping", min=0)
    phi_rel0: Parameter = parameter("rad", "Relative angle of the unstretched spring", default=0.0)

    def equations(self) -> Equations:
        """Sum of spring and damper torque."""
        yield from self._transmit()
        yield self.tau == self.c * (self.phi_rel - self.phi_rel0) + self.d * self.w_rel
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Elastic energy c (phi_rel - phi_rel0)^2/2."""
        return self.c * (self.phi_rel - self.phi_rel0) ** 2 / 2

    def loss(self) -> Symbol:
        """Damping torque times relative speed."""
        return self.d * self.w_rel**2
