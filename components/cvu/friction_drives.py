"""Variable units that transmit torque by friction: their speed ratio drops under load (creep)."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, parameter, variable
from powertrain.components.cvu.interfaces import VariableUnit


class _Creeping(VariableUnit):
    """Partial: a friction contact whose torque depends on its creep.

    creep = (V w_a - w_b)/w_rolling,  w_rolling^2 = slow^2 + (V w_a)^2/2 + w_b^2/2: the sliding speed over the rolling speed
    tau = tau_max x/sqrt(1 + x^2), x = creep/creep_max;  T_b = -tau,  T_a = V tau

    tau is the torque of the contact, referred to flange_b, tau_max its limit. The power (V w_a - w_b) tau is lost in the contact and is
    never negative.
    """

    creep_max: Parameter = parameter(
        "1", "Creep at the limit force, extrapolated from the initial slope", default=0.01, above=0
    )
    slow: Parameter = parameter(
        "rad/s", "Speed at flange_b below which creep is relative to this speed", default=1.0, above=0
    )
    w_slide: Variable = variable("rad/s", "Sliding speed at flange_b, V w_a - w_b", guess=0)
    creep: Variable = variable("1", "Sliding speed over rolling speed")
    tau: Variable = variable("N.m", "Torque of the contact, seen at flange_b")

    def _contact(self, V: Symbol, tau_max: Symbol) -> Equations:
        yield from self._turn()
        yield self.w_slide == V * self.w_a - self.w_b
        rolling = ca.sqrt(self.slow**2 + (V * self.w_a) ** 2 / 2 + self.w_b**2 / 2)
        yield self.creep == self.w_slide / rolling
        x = self.creep / self.creep_max
        yield self.tau == tau_max * x / ca.sqrt(1 + x**2)
        yield self.flange_b.tau == -self.tau
        yield self.flange_a.tau == V * self.tau
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque times sliding speed."""
        return self.tau * self.w_slide


class VBelt(_Creeping):
    """A belt or chain between two pulleys of variable radius, with slip.

    r_a = V r_b,  r_a + r_b = 2 r_mean;  tau_max = r_b F_max,  F_max = 2 mue clamp/cos(angle)
    creep = (V w_a - w_b)/w_rolling,  w_rolling^2 = slow^2 + (V w_a)^2/2 + w_b^2/2
    T_b = -tau,  T_a = V tau,  tau = tau_max x/sqrt(1 + x^2),  x = creep/creep_max

    ``clamp`` is the axial clamping force of the sheaves. Both flanks of a pulley transmit friction, so the belt carries at most F_max.
    Below F_max it creeps in proportion to the load; at F_max it slips as a whole. The power tau (V w_a - w_b) is lost. That r_a + r_b is
    constant is accurate to (r_b - r_a)^2/(pi C), with C the distance of the shafts. V > 0. For bearings and belt bending add
    rotational.BearingFriction, ChurningLoss.
    """

    ratio_min: Parameter = parameter("1", "Minimum ratio of the pulleys", default=0.1, above=0)
    ratio_max: Parameter = parameter("1", "Maximum ratio of the pulleys", default=10.0, above=0)
    r_mean: Parameter = parameter("m", "Mean of the two running radii", default=0.05, above=0)
    clamp: Parameter = parameter("N", "Axial clamping force of a pulley", default=2e4, min=0)
    mue: Parameter = parameter("1", "Coefficient of friction between belt and sheave", default=0.09, min=0)
    angle: Parameter = parameter("rad", "Half angle of the groove", default=0.192, min=0, max=1.5)
    r_a: Variable = variable("m", "Running radius at flange_a")
    r_b: Variable = variable("m", "Running radius at flange_b")

    def equations(self) -> Equations:
        """Radii from the ratio, the torque from the creep."""
        V = self._ratio()
        yield self.r_b == 2 * self.r_mean / (1 + V)
        yield self.r_a == V * self.r_b
        yield from self._contact(V, 2 * self.mue * self.clamp / ca.cos(self.angle) * self.r_b)


class TractionDrive(_Creeping):
    """A full-toroidal (Perbury-type) traction drive: rollers between two toroidal discs, which turn in opposite directions.

    |V| = r_a/r_b,  r_a + r_b = 2 e (e: distance of the roller's centre from the axis);  tau_max = n mue clamp r_b
    creep = (V w_a - w_b)/w_rolling,  w_rolling^2 = slow^2 + (V w_a)^2/2 + w_b^2/2
    T_b = -tau,  T_a = V tau,  tau = tau_max x/sqrt(1 + x^2),  x = creep/creep_max

    ``clamp`` is the normal force of each of the n contacts, ``mue`` the traction coefficient at which the fluid yields (0.05 to 0.1),
    ``creep_max`` the limit divided by the initial slope of the traction curve. The sine of the rollers' tilt angle is
    (e/r_roller) (1 - |V|)/(1 + |V|), with r_roller their radius. V < 0, or V > 0 with a reversing gear behind the discs. The power
    tau (V w_a - w_b) is lost by creep; model spin and bearing losses as separate components.
    """

    ratio_min: Parameter = parameter("1", "Minimum ratio within the tilt of the rollers", default=-10.0)
    ratio_max: Parameter = parameter("1", "Maximum ratio within the tilt of the rollers", default=10.0)
    e: Parameter = parameter("m", "Distance of the roller's centre from the axis of the discs", default=0.06, above=0)
    n: Parameter = parameter("1", "Number of rollers", default=6.0, above=0)
    clamp: Parameter = parameter("N", "Normal force of a contact", default=1e4, min=0)
    mue: Parameter = parameter("1", "Maximum traction coefficient", default=0.06, min=0)
    r_a: Variable = variable("m", "Radius of the contact on the disc at flange_a")
    r_b: Variable = variable("m", "Radius of the contact on the disc at flange_b")

    def equations(self) -> Equations:
        """Radii from the ratio, the torque from the creep."""
        V = self._ratio()
        yield self.r_b == 2 * self.e / (1 + ca.fabs(V))
        yield self.r_a == ca.fabs(V) * self.r_b
        yield from self._contact(V, self.n * self.mue * self.clamp * self.r_b)
