"""Joints between shafts at an angle."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Variable, parameter, variable
from powertrain.components.rotational.interfaces import TwoFlangesAndSupport


class UniversalJoint(TwoFlangesAndSupport):
    """A Cardan joint between two shafts at an angle, without inertia or loss; the second shaft turns nonuniformly.

    tan(phi_b) = cos(beta) tan(phi_a),  flange_a.tau + k flange_b.tau = 0,  k = w_b/w_a = cos(beta)/(1 - sin(beta)^2 sin(phi_a)^2)

    k varies between cos(beta) and 1/cos(beta) twice per revolution. The angles are continuous over several revolutions:
    phi_b = phi_a - atan((1 - cos(beta)) sin(phi_a) cos(phi_a)/(cos(phi_a)^2 + cos(beta) sin(phi_a)^2)), where nothing jumps. At phi_a = 0
    the pin in the fork of flange_a is normal to the plane of the two shafts. The support takes the difference of the torques.
    """

    beta: Parameter = parameter("rad", "Angle between the shafts", min=-1.5, max=1.5)
    phi_a: Variable = variable("rad", "Angle of flange_a against the support")
    phi_b: Variable = variable("rad", "Angle of flange_b against the support")

    def equations(self) -> Equations:
        """The constraint, and the torques by virtual work."""
        yield from self._balance()
        yield self.phi_a == self.flange_a.phi - self.support.phi
        yield self.phi_b == self.flange_b.phi - self.support.phi
        sine, cosine, bent = ca.sin(self.phi_a), ca.cos(self.phi_a), ca.cos(self.beta)
        yield self.phi_b == self.phi_a - ca.atan((1 - bent) * sine * cosine / (cosine**2 + bent * sine**2))
        ratio = bent / (1 - ca.sin(self.beta) ** 2 * sine**2)
        yield self.flange_a.tau + ratio * self.flange_b.tau == 0
