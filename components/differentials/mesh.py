"""The mesh law: one law for every differential with two degrees of freedom, from planetary gears to cam differentials.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986) 9-16, 48.
"""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, Symbol, Variable, der, friction, parameter, port, switch, variable
from powertrain.components.rotational.interfaces import Flange


class ThreeMembers(Component):
    """Partial: the three members of a fundamental differential.

    The basic speed ratio R_o = (w_a - w_h)/(w_b - w_h) holds for the speeds against the carrier (eq. 1); no torque reacts to ground:
    T_a + T_b + T_h = 0 (eq. 21).
    """

    a: Flange = port(Flange)
    b: Flange = port(Flange)
    carrier: Flange = port(Flange)


class Mesh(ThreeMembers):
    """Two central members a and b that mesh through planets on a carrier, with loss by latent power.

    w_rel = w_a - w_h = R_o (w_b - w_h);  T_a + T_b + T_h = 0;  T_b = -R_o (T_a - tauLoss)

    With the carrier at rest in thought, P_a^h = T_a w_rel is the latent power of a (eq. 5). Where a drives (P_a^h > 0) the efficiency
    eta_ab gives T_b/T_a = -R_o eta_ab (eqs. 11-12), where b drives (P_a^h < 0) T_b/T_a = -R_o/eta_ba (eqs. 17-18):
    tauLoss = (1 - eta_ab) T_a or (1 - 1/eta_ba) T_a, and the loss tauLoss w_rel is never negative. Without relative motion nothing is lost:
    the mesh is stuck, tauLoss lies anywhere between its values forward and backward, and the members turn as one block.

    R_o < 0 is the type 2K-H(-), R_o > 0 the types 2K-H(+) and KHV. For eta < R_o < 1/eta the carrier locks itself; a torque that would have
    to pass it has no solution, or several, and the simulation says so.
    """

    ratio: Parameter = parameter("1", "Basic speed ratio R_o = (w_a - w_h)/(w_b - w_h)", exclude=(0.0, 1.0))
    eta_ab: Parameter = parameter("1", "Efficiency from a to b, carrier fixed", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency from b to a, carrier fixed", default=1.0, above=0, max=1)
    w_rel: Variable = variable("rad/s", "Speed of a against the carrier", prefer=True)
    tauLoss: Variable = variable("N.m", "Torque loss, counted at a")

    def equations(self) -> Equations:
        """Kinematics, balance and the loss that opposes the relative motion."""
        relative = self.a.phi - self.carrier.phi
        yield relative == self.ratio * (self.b.phi - self.carrier.phi)
        yield self.w_rel == der(relative)
        yield self.a.tau + self.b.tau + self.carrier.tau == 0
        yield self.b.tau == -self.ratio * (self.a.tau - self.tauLoss)
        a_drives, b_drives = (1 - self.eta_ab) * self.a.tau, (1 - 1 / self.eta_ba) * self.a.tau
        pushed = self.a.tau >= 0
        upper = switch(pushed, a_drives, b_drives, continuous=True)
        lower = switch(pushed, b_drives, a_drives, continuous=True)
        yield friction(self.w_rel, self.tauLoss, lower, upper)

    def loss(self) -> Symbol:
        """Torque loss times relative speed."""
        return self.tauLoss * self.w_rel
