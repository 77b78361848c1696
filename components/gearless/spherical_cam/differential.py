"""The spherical cam differential as an acausal component."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Symbol, Variable, der, friction, switch, variable
from powertrain.components.differentials.interfaces import Differential
from powertrain.components.gearless.spherical_cam.cycle import CamFriction, Cycle, Sharing
from powertrain.components.gearless.spherical_cam.profile import SphericalCam
from powertrain.components.gearless.spherical_cam.wave import kappa_wave
from powertrain.components.rotational.interfaces import Lossy


class SphericalCamDifferential(Differential, Lossy):
    """The differential whose side wheels are carriers of conical rollers, and whose planets are pairs of conjugate spherical cams.

    w_left + w_right = 2 w_crown,  left.tau + right.tau + crown.tau = 0,  w_rel = w_left - w_right,  tau = (left.tau - right.tau)/2
    w_cam = (N/M) (w_left - w_crown): the spin of a cam of M lobes between carriers of N rollers, on its shaft in the cage
    w_rel > 0: tau = kappa(psi) |crown.tau|/2;  w_rel < 0: tau = -kappa(-psi) |crown.tau|/2;  w_rel = 0: anything between

    Conjugate profiles keep the speeds exact at every angle; that both halves turn alike does not depend on M and N, which only say how
    fast the cams spin. What changes with the angle psi of the cam is friction: with eta_0(psi) the efficiency of the relative motion (cage
    at rest, from one side wheel to the cam to the other), kappa = (1 - eta_0)/(1 + eta_0), and the torque-bias ratio is 1/eta_0. This is
    the mesh law with R_o = -1. eta_0 follows by virtual work from the pressure angles, the friction of the rollers' pins, and that of the
    cam on its shaft; the derivation stands at ``Cycle``. It repeats every pi/M of the cam, where one of the two conjugate cams hands over
    to the other, with a jump for ``sharing`` = "single", smoothly (a few harmonics, see ``Wave``) for "elastic".
    Turning the other way is the mirror image: psi becomes -psi. psi = 0 is the middle of a stroke on both sides.

    Where kappa >= 1 over a part of the cycle (steep flanks, rough rollers), halves at rest stay so under any torque of the cage.

    Without friction it is the open bevel differential. Without inertia: put inertias at its flanges. Geometry and friction are structure,
    checked and solved where it is built. The cam by default is the paper's choice {M = 4, N = 5}; its friction is assumed. Source:
    M. Chaudhary, J. Angeles, A. Morozov, Design of a spherical cam mechanism for an automotive differential, Trans. CSME (2014).
    Errors: ParameterError for a cam that cannot be built, axes not at right angles, or an unknown rule of sharing.
    """

    cam: SphericalCam = SphericalCam(4, 5)
    friction: CamFriction = CamFriction()
    sharing: Sharing = "elastic"
    w_rel: Variable = variable("rad/s", "Speed of the left side against the right side", prefer=True)
    theta: Variable = variable("rad", "Angle of the left side against the crown wheel", prefer=True)
    psi: Variable = variable("rad", "Angle of the cam on its shaft, from the middle of a stroke")
    w_cam: Variable = variable("rad/s", "Spin of the cam on its shaft")
    tau: Variable = variable("N.m", "Friction torque, half the difference of the sides' torques")
    kappa: Variable = variable("1", "Locking coefficient for the left side ahead")
    kappa_back: Variable = variable("1", "Locking coefficient for the right side ahead")

    def check(self) -> Equations:
        """Cam and friction give a locking coefficient over the whole cycle."""
        kappa_wave(self.cycle)
        yield from ()

    @property
    def cycle(self) -> Cycle:
        """Its forces and efficiency over a cycle."""
        return Cycle(self.cam, self.friction, self.sharing)

    def equations(self) -> Equations:
        """Symmetric kinematics, and friction that the load makes."""
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield 2 * self.theta == self.left.phi - self.right.phi
        yield self.w_rel == 2 * der(self.theta)
        yield self.psi == self.cam.N / self.cam.M * self.theta
        yield self.w_cam == self.cam.N / self.cam.M * self.w_rel / 2
        yield self.left.tau == self.tau - self.crown.tau / 2
        yield self.right.tau == -self.tau - self.crown.tau / 2
        forward, backward = kappa_wave(self.cycle)(2 * self.cam.M * self.psi)
        yield self.kappa == forward
        yield self.kappa_back == backward
        load = self.crown.tau / 2
        size = switch(load >= 0, load, -load, continuous=True)
        # While the branch of the switch is not yet that of the load, the bounds stand the wrong way round. Stuck halves do not break
        # loose for that.
        peak = ca.if_else(size < 0, -1, 1)
        yield friction(self.w_rel, self.tau, -self.kappa_back * size, self.kappa * size, peak=peak)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel
