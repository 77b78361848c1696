"""Self-energising brakes."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, friction, parameter, signal_input
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import ShaftWithFriction


class BandBrake(ShaftWithFriction):
    """A band around a drum with one fixed end and one end pulled by a force.

    Forward rotation tightens the band, backward rotation slackens it.

    w = der(flange_a.phi - support.phi),  flange_b.phi = flange_a.phi,  flange_a.tau + flange_b.tau = tau,  F = F_max f_normalized
    w > 0: tau = F radius (exp(mue wrap) - 1);  w < 0: tau = -F radius (1 - exp(-mue wrap))
    w = 0: tau anywhere between the two

    By Eytelwein's equation the tension grows around the drum by the factor exp(mue wrap). In forward rotation the fixed end has the
    larger tension, so the brake is self-energising; the two torques differ by the factor exp(mue wrap), 4.8 for mue = 0.3 on 300
    degrees. A force below 0 counts as 0, one above 1 as 1.
    """

    radius: Parameter = parameter("m", "Radius of the drum", default=0.1, above=0)
    wrap: Parameter = parameter("rad", "Wrap angle of the band", default=5.2, above=0)
    mue: Parameter = parameter("1", "Coefficient of friction", default=0.12, min=0)
    F_max: Parameter = parameter("N", "Force at the pulled end at f_normalized = 1", default=2000.0, min=0)
    f_normalized: Input = signal_input("1", "Force over F_max, 0 to 1", default=0.0)

    def equations(self) -> Equations:
        """A shaft whose friction depends on the direction of rotation."""
        yield from self._turn()
        pull, wound = self.F_max * limited(self.f_normalized.value) * self.radius, self.mue * self.wrap
        yield friction(self.w, self.tau, -pull * (1 - ca.exp(-wound)), pull * (ca.exp(wound) - 1))
