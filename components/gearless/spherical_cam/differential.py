"""The spherical cam differential as an acausal component."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Self

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    der,
    friction,
    parameter,
    switch,
    variable,
)
from powertrain.components.differentials.interfaces import SymmetricDifferential
from powertrain.components.gearless.spherical_cam.body import CamBody
from powertrain.components.gearless.spherical_cam.cycle import CamFriction, Cycle
from powertrain.components.gearless.spherical_cam.profile import SphericalCam
from powertrain.components.gearless.spherical_cam.rollers import Algebra, Sharing, locking, roller_spin, rollers
from powertrain.components.limited import magnitude
from powertrain.components.rotational.interfaces import Lossy

_FRICTION = CamFriction()
_LAWS = Algebra(ca, lambda condition, a, b, name: switch(condition, a, b, name=name))


class CamMasses(Component):
    """Moving masses inside a spherical cam differential while the sides turn against each other: cams, and rollers on their pins.

    On either side each cam has one roller in its stroke, which rolls. A roller between two strokes coasts at the speed at which it
    left; at constant speed it enters the next stroke at just that speed, and other slip at the entry is neglected.
    Rollers as rigid parts of their carriers belong to the inertia of the side wheels, except for their moments of inertia about the
    pins, which belong to that of the cage.
    """

    J_cam: Parameter = parameter("kg.m2", "Moment of inertia of all cams about their shafts", above=0)
    J_inner: Parameter = parameter(
        "kg.m2", "Moment of inertia about their pins of all rollers in a stroke of an inner cam", default=0.0, min=0
    )
    J_outer: Parameter = parameter("kg.m2", "The same for the outer cams", default=0.0, min=0)

    def equations(self) -> Equations:
        """None: the differential moves these masses."""
        yield from ()

    @classmethod
    @arguments_checked
    def of(cls, body: CamBody) -> Self:
        """The masses of a design, with full conical rollers."""
        inner, outer = (2 * body.pairs * J for J in body.roller_inertias)
        return cls(J_cam=body.spin_inertia, J_inner=inner, J_outer=outer)


class SphericalCamDifferential(SymmetricDifferential, Lossy):
    """The differential with carriers of conical rollers as side wheels, and pairs of conjugate spherical cams as planets.

    w_left + w_right = 2 w_crown,  left.tau + right.tau + crown.tau = 0,  w_rel = w_left - w_right,  tau = (left.tau - right.tau)/2
      w_cam = (N/M) (w_left - w_crown): the spin of a cam of M lobes between carriers of N rollers, on its shaft in the cage
    w_rel > 0: tau = kappa(psi) |crown.tau|/2;  w_rel < 0: tau = -kappa(-psi) |crown.tau|/2;  w_rel = 0: anything between

    Conjugate profiles keep the speeds exact at every angle. The equality of the halves does not depend on M and N, which only determine the
    spin of the cams. Friction depends on the angle psi of the cam. With eta_0(psi), the efficiency of the relative motion (cage at
    rest, from one side wheel through the cam to the other), kappa = (1 - eta_0)/(1 + eta_0), and the torque-bias ratio is 1/eta_0. This is
    the mesh law with R_o = -1. eta_0 follows by virtual work from the pressure angles and the friction of the rollers' pins and of the cam
    on its shaft; the derivation is given in ``Cycle``, and the simulation uses that law itself. It repeats every pi/M of the cam, where one
    of the two conjugate cams takes over from the other: with a jump for ``sharing`` = "single", continuously for "elastic". Where a roller
    reverses its rotation it jumps slightly. Relative motion in the other direction is the mirror image: psi becomes -psi. psi = 0 is the
    middle of a stroke on both sides.

    If friction is so large that the sides are locked (kappa = 3), halves at rest remain so under any torque of the cage.

    Without friction it is the open bevel differential. ``masses``: the inertia of cams and rollers, as ``CamMasses.of(body)``; otherwise it
    has none: connect inertias to its flanges. The geometry is structural. Friction consists of
    parameters: ``friction`` = CamFriction(...) at construction sets all eight. The default cam is the paper's choice {M = 4, N = 5};
    its friction is assumed. Source: M. Chaudhary, J. Angeles, A. Morozov, Design of a spherical cam mechanism for an automotive
    differential, McGill University, 2014. Errors: ParameterError for a cam that cannot be built, axes not at right angles, or an unknown
    rule of sharing.
    """

    cam: SphericalCam = SphericalCam(4, 5)
    sharing: Sharing = "elastic"
    mu_pin: Parameter = parameter("1", "Friction of the rollers' pins", default=_FRICTION.mu_pin, min=0)
    pin: Parameter = parameter(
        "1", "Radius of a pin over that of its roller", default=_FRICTION.pin, min=0, max=1, exclude=(1.0,)
    )
    mu_thrust: Parameter = parameter("1", "Friction of the rollers' collars", default=_FRICTION.mu_thrust, min=0)
    thrust: Parameter = parameter(
        "1", "Mean radius of a collar over that of its roller", default=_FRICTION.thrust, min=0
    )
    mu_contact: Parameter = parameter(
        "1", "Friction between roller and cam, beyond which the roller slips", default=_FRICTION.mu_contact, min=0
    )
    mu_bearing: Parameter = parameter("1", "Friction of a cam on its shaft", default=_FRICTION.mu_bearing, min=0)
    shaft: Parameter = parameter(
        "1", "Radius of the cam's shaft over the contacts' distance from the centre", default=_FRICTION.shaft, min=0
    )
    washer: Parameter = parameter(
        "1", "Radius of the thrust washer over the contacts' distance", default=_FRICTION.washer, min=0
    )
    masses: CamMasses | None = None
    w_rel: Variable = variable("rad/s", "Speed of the left side against the right side", prefer=True)
    theta: Variable = variable("rad", "Angle of the left side against the crown wheel", prefer=True)
    psi: Variable = variable("rad", "Angle of the cam on its shaft, from the middle of a stroke")
    w_cam: Variable = variable("rad/s", "Spin of the cam on its shaft")
    tau: Variable = variable("N.m", "Friction torque, half the difference of the sides' torques")
    kappa: Variable = variable("1", "Locking coefficient for the left side ahead")
    kappa_back: Variable = variable("1", "Locking coefficient for the right side ahead")

    if TYPE_CHECKING:
        friction: CamFriction = _FRICTION
    else:

        def __init__(self, **given: Any) -> None:
            whole = given.pop("friction", None)
            if not isinstance(whole, CamFriction | None):
                raise ParameterError(f"{type(self).__name__}.friction = {whole!r} is not a CamFriction")
            super().__init__(**(given if whole is None else given | vars(whole)))

        @property
        def friction(self) -> CamFriction:
            """Its friction, for ``Cycle``."""
            return CamFriction(**{field.name: self._values[field.name] for field in fields(CamFriction)})

    def check(self) -> Equations:
        """The cam's axes must be at right angles, and the rule of sharing known."""
        _ = self.cycle
        yield from ()

    @property
    def cycle(self) -> Cycle:
        """Its forces and efficiency over a cycle."""
        return Cycle(self.cam, self.friction, self.sharing)

    def equations(self) -> Equations:
        """Symmetric kinematics, and load-dependent friction."""
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield 2 * self.theta == self.left.phi - self.right.phi
        yield self.w_rel == 2 * der(self.theta)
        yield self.psi == self.cam.N / self.cam.M * self.theta
        yield self.w_cam == self.cam.N / self.cam.M * self.w_rel / 2
        spin = self._inertial()
        yield self.left.tau == self.tau + spin - self.crown.tau / 2
        yield self.right.tau == -self.tau - spin - self.crown.tau / 2
        handover = Cycle(self.cam, sharing=self.sharing).handover
        ahead, behind = (rollers(self.cam, self.sharing, handover, side * self.psi, _LAWS) for side in (1, -1))
        yield self.kappa == locking(ahead, behind, self.cam, self, _LAWS)
        yield self.kappa_back == locking(behind, ahead, self.cam, self, _LAWS)
        load = self.crown.tau / 2
        size = magnitude(load)
        yield friction(self.w_rel, self.tau, -self.kappa_back * size, self.kappa * size)
        yield from self._dissipate()

    def _inertia(self) -> Symbol:
        """I(psi) of the relative motion over the spin of the cams [kg.m2]: I psi'^2/2 is its kinetic energy.

        I = J_cam + J_inner Q(u)^2 + J_outer Q(pi/M - u)^2, u the distance of the roller on an inner cam from the middle of its stroke. A
        roller turns about its pin at Q psi': its rolling on the cam relative to the carrier, plus the rotation of the carrier.

        Q = |(M/N) e_phi + e_psi| sin(beta_3)/sin(alpha_4) + (M/N) cos(alpha_3)
        """
        cam, masses = self.cam, self.masses
        assert masses is not None
        sine = ca.sin(cam.M * self.psi)
        u = ca.atan2(magnitude(sine), ca.cos(cam.M * self.psi)) / cam.M
        Q_inner, Q_outer = roller_spin(cam, u, ca), roller_spin(cam, cam.half - u, ca)
        return Symbol(masses.J_cam + masses.J_inner * Q_inner**2 + masses.J_outer * Q_outer**2)

    def _inertial(self) -> Symbol:
        """Torque that the inertia of cams and rollers adds to tau."""
        if self.masses is None:
            return Symbol(0)
        inertia = self._inertia()
        slope = ca.gradient(inertia, self.psi)
        return Symbol(inertia * der(self.w_cam) + slope * self.w_cam**2 / 2) * self.cam.N / self.cam.M / 2

    def energy(self) -> Symbol:
        """Kinetic energy of cams and rollers."""
        return Symbol(0) if self.masses is None else self._inertia() * self.w_cam**2 / 2

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel
