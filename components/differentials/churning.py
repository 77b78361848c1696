"""Losses that do not depend on the load."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, parameter
from powertrain.components.rotational.interfaces import Dragged


class ChurningLoss(Dragged):
    """The drag of oil and air on a shaft or wheel: a torque that is a polynomial in its speed.

    w = der(flange.phi - support.phi),  flange.tau = d w + d2 w |w| + d3 w^3

    Use it as an additional component: connect it to the flange of the member that churns the oil (its support to the carrier, for a
    planet). For dry bearing friction, which holds at rest, use rotational.BearingFriction. Such losses cannot be expressed as an
    efficiency, which is not defined at zero power.
    """

    d: Parameter = parameter("N.m.s/rad", "Viscous part", default=0.0, min=0)
    d2: Parameter = parameter(
        "N.m.s2/rad2", "Part that grows with the square of the speed (churning, windage)", default=0.0, min=0
    )
    d3: Parameter = parameter("N.m.s3/rad3", "Part that grows with the cube of the speed", default=0.0, min=0)

    def equations(self) -> Equations:
        """Drag."""
        yield from self._turn()
        yield self.flange.tau == self.w * (self.d + self.d2 * ca.fabs(self.w) + self.d3 * self.w**2)
