"""Joints between shafts at an angle: single and double universal joints, and constant-velocity joints."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Equations,
    Map,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    variable,
)
from powertrain.components.driving_side import mesh_losses
from powertrain.components.rotational.interfaces import Lossy, TwoShaftsAndSupport


def passed_on(phi: Symbol, bent: Symbol) -> tuple[Symbol, Symbol]:
    """The angle psi with tan(psi) = bent tan(phi), bent > 0, continuous over many turns, and its slope d psi/d phi."""
    sine, cosine = ca.sin(phi), ca.cos(phi)
    late = ca.atan((1 - bent) * sine * cosine / (cosine**2 + bent * sine**2))
    return phi - late, bent / (cosine**2 + bent**2 * sine**2)


class UniversalJoint(TwoShaftsAndSupport):
    """A Cardan joint between two shafts at an angle, without inertia or loss; the second shaft turns nonuniformly.

    tan(phi_b) = cos(beta) tan(phi_a),  flange_a.tau + k flange_b.tau = 0,  k = w_b/w_a = cos(beta)/(1 - sin(beta)^2 sin(phi_a)^2)

    k varies between cos(beta) and 1/cos(beta) twice per revolution. The angles are continuous over several revolutions, in the form
    phi_b = phi_a - atan((1 - cos(beta)) sin(phi_a) cos(phi_a)/(cos(phi_a)^2 + cos(beta) sin(phi_a)^2)).
    At phi_a = 0 the pin in the fork of flange_a is normal to the plane of the two shafts. The support takes the difference of the
    torques.
    """

    beta: Parameter = parameter("rad", "Angle between the shafts", min=-1.5, max=1.5)

    def equations(self) -> Equations:
        """The constraint, and the torques by virtual work."""
        yield from self._angles()
        angle, ratio = passed_on(self.phi_a, ca.cos(self.beta))
        yield self.phi_b == angle
        yield self.flange_a.tau + ratio * self.flange_b.tau == 0


class DoubleUniversalJoint(TwoShaftsAndSupport):
    """Two universal joints with a massless shaft between them; their nonuniformity cancels with equal angles and aligned forks.

    tan(phi_m) = cos(beta_a) tan(phi_a),  cos(beta_b) tan(phi_b + phase) = tan(phi_m + phase),  flange_a.tau + (w_b/w_a) flange_b.tau = 0

    All three shafts are in one plane. With ``phase`` = 0 both forks of the middle shaft are in this plane at the same time, and
    beta_a = beta_b (a Z or W arrangement, or a centred double Cardan joint) gives w_b = w_a exactly. With other angles the joint is as
    nonuniform as a single one with cos(beta) = cos(beta_a)/cos(beta_b), about beta^2 = beta_a^2 - beta_b^2; with ``phase`` = pi/2 as one
    with cos(beta) = cos(beta_a) cos(beta_b): the angles add up. Source: H. C. Seherr-Thoss, F. Schmelz, E. Aucktor, Universal Joints and
    Driveshafts, 2nd ed., Springer 2006, ch. 1.
    """

    beta_a: Parameter = parameter("rad", "Angle between the shaft at flange_a and the middle shaft", min=-1.5, max=1.5)
    beta_b: Parameter = parameter("rad", "Angle between the middle shaft and the shaft at flange_b", min=-1.5, max=1.5)
    phase: Parameter = parameter("rad", "Twist of the middle shaft's forks against alignment", default=0.0)

    def equations(self) -> Equations:
        """A joint, and another one used from its far side."""
        yield from self._angles()
        middle, first = passed_on(self.phi_a, ca.cos(self.beta_a))
        twisted, second = passed_on(middle + self.phase, 1 / ca.cos(self.beta_b))
        yield self.phi_b == twisted - self.phase
        yield self.flange_a.tau + first * second * self.flange_b.tau == 0


class ConstantVelocityJoint(TwoShaftsAndSupport, Lossy):
    """A constant-velocity joint (Rzeppa, tripod) with an efficiency that depends on its angle.

    phi_a = phi_b,  w = der(phi_a),  flange_a.tau + flange_b.tau = tauLoss
    flange_a drives: tauLoss = (1 - eta) flange_a.tau,  flange_b drives: tauLoss = (1 - 1/eta) flange_a.tau;  w = 0: between the two

    Balls and rollers slide over a distance that grows with the angle, under a force that grows with the torque, so a fraction of the power
    is lost. ``efficiency``: rows (angle rad, eta), linear between them and constant beyond the last; the default is typical of a ball
    joint. The support takes the lost torque.

    Errors: ParameterError if the rows are not a table of efficiencies in (0, 1] over angles from 0 up.
    """

    efficiency: tuple[tuple[float, float], ...] = ((0.0, 0.997), (0.1, 0.994), (0.2, 0.989), (0.4, 0.974), (0.8, 0.93))
    beta: Parameter = parameter("rad", "Angle between the shafts", default=0.1, min=-1.0, max=1.0)
    w: Variable = variable("rad/s", "Speed against the support")
    tauLoss: Variable = variable("N.m", "Torque loss")

    def equations(self) -> Equations:
        """Equal angles, and the loss depending on the driving side."""
        yield from self._angles()
        yield self.phi_b == self.phi_a
        yield self.w == der(self.phi_a)
        yield self.flange_a.tau + self.flange_b.tau == self.tauLoss
        eta = self._eta()
        yield friction(self.w, self.tauLoss, *mesh_losses(self.flange_a.tau, eta, eta))
        yield from self._dissipate()

    def _eta(self) -> Symbol:
        """The table at |beta|."""
        where = f"{self._label}.efficiency"
        rows = self.efficiency
        if not rows or any(angle < 0 or not 0 < eta <= 1 for angle, eta in rows):
            raise ParameterError(
                f"{where}: {rows!r} is not a table of rows (angle rad, efficiency) with angles not below 0 "
                "and efficiencies in (0, 1]"
            )
        angles, values = zip(*rows, strict=True)
        try:
            curve = Map.curve(angles, values, x="beta", x_unit="rad", name="efficiency", outside="clip")
        except ParameterError as error:
            raise ParameterError(f"{where}: {error}") from None
        return Symbol(curve(ca.fabs(self.beta)))

    def loss(self) -> Symbol:
        """Torque loss times speed."""
        return self.tauLoss * self.w
