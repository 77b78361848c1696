"""Forces and friction of the spherical cam differential over a cycle: torque ratios, efficiency of the relative motion, locking."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.spherical_cam.curves import Array, bisected
from powertrain.components.gearless.spherical_cam.profile import SphericalCam
from powertrain.components.gearless.spherical_cam.rollers import (
    Rollers,
    Sharing,
    elastic_weight,
    loaded,
    locking,
    rollers,
    rolling,
)


@arguments_checked
@dataclass(frozen=True)
class CamFriction:
    """Friction of rollers and cams, with relative radii.

    ``mu_pin``: coefficient of friction of the rollers' pins; ``pin``: radius of a pin relative to its roller's at the contact.
    ``mu_thrust``, ``thrust``: the same for the collar that takes the outward thrust of the conical roller. ``mu_contact``: limit of
    traction between roller and cam, at which the roller slips; with a fixed roller it is the only friction. ``mu_bearing``: of the cam on
    its shaft, with ``shaft`` and ``washer``: radius of the shaft, and mean radius of the thrust washer, relative to the distance of the
    contacts from the centre. Errors: ParameterError for negative values, or a pin as large as the roller.
    """

    mu_pin: float = 0.05
    pin: float = 0.4
    mu_thrust: float = 0.05
    thrust: float = 0.5
    mu_contact: float = 0.1
    mu_bearing: float = 0.05
    shaft: float = 0.2
    washer: float = 0.3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0):
                raise ParameterError(
                    f"CamFriction: {name} = {value:g} must be finite and not negative: it is a part of a friction torque"
                )
        if self.pin >= 1:
            raise ParameterError(f"CamFriction: pin = {self.pin:g} must be less than 1: the pin lies inside the roller")

    def rolling(self, alpha_4: float) -> float:
        """Tangential over normal force at a turning roller: its pin carries N cos(alpha_4), its collar N sin(alpha_4); or it slips."""
        return float(rolling(self, alpha_4))


NO_FRICTION = CamFriction(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class CamMesh:
    """Effect of the loaded rollers of one carrier on both shafts, per unit of ``normal`` forces, at unit distance from the centre.

    ``carrier``, ``cam``: torques on the carrier about e_phi, and from the cam about e_psi; ``force``: on the carrier, in the fixed frame.
    """

    carrier: Array
    cam: Array
    force: Array


@arguments_checked
@dataclass(frozen=True)
class Cycle:
    """A cam with its friction and its rule of load sharing, as a differential: side wheels (carriers) left and right of the cam.

    Let the cage be at rest and the cam turn with psi' > 0. The cage's torque T_C pushes the cam's shaft, and the cam pushes both carriers
    in the same direction. Relative to the motion, the roller of one carrier drives the cam, and the cam drives the roller of the other
    carrier. Let s be the cam's angle from the middle of a stroke. The driven carrier works at s in (0, pi/M + sigma); the driving carrier
    is its mirror image and works at -s. Both cams are half a stroke apart, so everything has the period pi/M.

    One contact: n is the normal on the roller; v = (phi' e_phi - psi' e_psi) x e_c is the velocity of a non-rotating roller against the
    cam, which is along the profile: v.n = 0 by conjugacy. The force on the roller is F = N (n - f v/|v|). A rolling roller spins on its
    pin at |v|/sin(alpha_4) against the friction torque f N sin(alpha_4), with f = mu_pin pin cos(alpha_4) + mu_thrust thrust
    sin(alpha_4) (or f = mu_contact: it slips). Virtual work:

    T_phi phi' - T_psi psi' = F . v = -f N |v|,  T_phi = e_phi . (e_c x F) on the carrier, T_psi = e_psi . (e_c x F) from the cam

    |v| = |phi' e_phi - psi' e_psi| |sin(beta_3)|: nothing is lost where the axis of relative rotation passes through the contact. There a
    roller reverses its rotation, and the friction of its pin changes sign: with two loaded rollers, or a rough bearing, the
    efficiency jumps slightly. With the sums over the loaded rollers, the ratio of output to input torque is -(M/N) T_phi/T_psi if the
    cam drives, -(N/M) T_psi/T_phi if the carrier drives. Between them the cam rubs on its shaft: T_psi(driving) = T_psi(driven) +
    mu_bearing (shaft |F_xy| + washer |F_z|), F the sum of both carriers' forces. eta_0 = T_phi(driven)/T_phi(driving) is the efficiency of
    the relative motion, and kappa = (1 - eta_0)/(1 + eta_0) >= 0, because contacts and bearing supply no energy. It does not depend
    on which side is faster, nor on the sign of T_C, except that the cam turning backward at s is as forward at -s.

    If friction is so large that a member would have to push with the wrong sign, no torque of the cage turns the sides against each
    other (self-locking). This is represented by kappa = 3 and eta_0 = -0.5; any kappa above 1 would do.
    """

    cam: SphericalCam
    friction: CamFriction = CamFriction()
    sharing: Sharing = "elastic"

    def __post_init__(self) -> None:
        if self.cam.alpha_1 != math.pi / 2:
            raise ParameterError(
                f"alpha_1 = {math.degrees(self.cam.alpha_1):g}° must be 90° in a differential: both side wheels turn about one axis"
            )

    @cached_property
    def handover(self) -> float:
        """Angle s at which a roller takes over from that of the other cam (for "elastic": where the leaving one is unloaded) [rad]."""
        sigma, half = self.cam.sigma, self.cam.half
        if self.sharing == "elastic":
            return sigma

        def gain(s: float) -> float:
            return float(self._arm(np.array(s)) - self._arm(np.array(s + half)))

        return bisected(gain, 0.0, sigma) if gain(sigma) > 0 else sigma

    def weights(self, s: ArrayLike) -> tuple[Array, Array]:
        """Normal forces, up to a factor, of the roller at s (in [0, pi/M)) and of the one half a stroke ahead, at s + pi/M."""
        phase: Array = np.mod(np.asarray(s, float), self.cam.half)
        if self.sharing == "single":
            taken = (phase >= self.handover).astype(float)
            return taken, 1.0 - taken
        first, second = (np.asarray(elastic_weight(self.cam, u, self._arm(u))) for u in (phase, phase + self.cam.half))
        return first, second

    def _arm(self, s: Array) -> Array:
        return np.asarray(-self.cam.lever_arms(s - self.cam.half)[0])

    def _rollers(self, s: Array) -> Rollers:
        if not np.isfinite(s).all():
            raise ParameterError("Cycle: the cam angle s must be finite")
        return rollers(self.cam, self.sharing, self.handover, s)

    def mesh(self, s: ArrayLike, *, cam_drives: bool) -> CamMesh:
        """The carrier at e_phi = (1, 0, 0), its rollers working at s > 0; the cam turns with psi' = 1 if it drives, else with -1."""
        on = self._rollers(np.asarray(s, float))
        found = loaded(on, self.friction.rolling(self.cam.alpha_4), 1 if cam_drives else -1)
        return CamMesh(np.asarray(found.carrier), np.asarray(found.cam), np.stack(found.force, -1))

    def kappa(self, s: ArrayLike) -> Array:
        """Locking coefficient (T_slow - T_fast)/T_C, cage at rest, at the cam angle s from the middle of a stroke, cam turning forward."""
        at = np.asarray(s, float)
        return np.asarray(locking(self._rollers(at), self._rollers(-at), self.cam, self.friction))

    def eta_0(self, s: ArrayLike) -> Array:
        """Efficiency of the relative motion, (1 - kappa)/(1 + kappa)."""
        kappa = self.kappa(s)
        return np.asarray((1 - kappa) / (1 + kappa))

    def contact_force(self, s: ArrayLike, torque: float, radius: float, *, cams: int = 2) -> tuple[Array, Array]:
        """Normal forces of two neighbouring rollers, without friction, from the torque of one side wheel.

        Parameters
        ----------
        s : array_like
            Angles of the first roller on the cam [rad].
        torque : float
            Torque of one side wheel, in the direction that loads the rollers ahead of the middle of their stroke, at least 0 [N.m].
        radius : float
            Distance of the contacts from the centre [m].
        cams : int
            Pairs of conjugate cams around the axle, which share the load.

        Returns
        -------
        tuple of numpy.ndarray
            Forces of the roller at ``s`` and of the one ahead [N].

        Raises
        ------
        ParameterError
            Unless the radius is positive and there is at least one pair of cams; for a negative torque, which loads the mirrored flanks
            (-s); for angles that are not finite.
        """
        if not (0 < radius < math.inf and cams >= 1):
            raise ParameterError(
                f"radius = {radius:g} m must be positive and cams = {cams} at least 1: they carry the torque"
            )
        if not 0 <= torque < math.inf:
            raise ParameterError(
                f"torque = {torque:g} N.m must be zero or positive, and finite: rollers only push; a negative one loads those at -s"
            )
        if not np.isfinite(s).all():
            raise ParameterError("Cycle: the cam angle s must be finite")
        phase: Array = np.mod(np.asarray(s, float), self.cam.half)
        first, second = self.weights(phase)
        factor = torque / radius / cams / (first * self._arm(phase) + second * self._arm(phase + self.cam.half))
        return first * factor, second * factor
