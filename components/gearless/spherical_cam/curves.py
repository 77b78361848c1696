"""The spherical cam and its rollers: kinematics, profile, pressure angles; Chaudhary, Angeles & Morozov 2014, eqs. (1)-(8).

Frame: the axes of cam and roller carrier cross at the origin, e_psi = (0, 0, 1), e_phi = (sin alpha_1, 0, cos alpha_1); everything is on
the unit sphere. The middle of a stroke, where a roller is deepest between two lobes, is psi = -pi/M.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

Array = NDArray[np.float64]
FINE = 721
"""Points over half a stroke for checking a profile."""


@dataclass(frozen=True)
class CamCurves:
    """The equations of a cam with M lobes in mesh with a carrier of N conical rollers, without checks of the numbers.

    phi = -(M/N) psi + phi_0,  phi_0 = (1 - 1/N) pi;  tan(beta_1) = M sin(alpha_1)/(M cos(alpha_1) + N)  (1)

    ``alpha_1``: angle between the axes of cam and carrier; ``alpha_3``: of a roller's axis e_p against the carrier's axis; ``alpha_4``:
    half-angle of the roller's cone. e_e = (sin beta_1, 0, cos beta_1) is the axis of relative rotation of carrier and cam;
    every contact normal passes through it. The contact e_c is on the great circle from e_p to e_e, at alpha_4 from e_p:

    cos(beta_4) = e_e . e_p,  beta_3 = beta_4 - alpha_4,  e_c = (sin(beta_3) e_p + sin(alpha_4) e_e)/sin(beta_4),  s_c = Q_z(-psi) e_c

    These are eqs. (2)-(4) in vectors (the paper's eq. (2) has e_c for e_e; its (4) is turned by -90 degrees about z against its
    own unit vectors, and takes sin(gamma) < 0 for psi < -pi/M). beta_3 < 0 where e_e is inside the roller. The profile ends where it
    meets that of the next stroke in the plane of symmetry of a lobe, at psi = sigma (5)-(6).
    """

    M: int
    N: int
    alpha_1: float = math.pi / 2
    alpha_3: float = math.radians(44)
    alpha_4: float = math.radians(19)

    @property
    def half(self) -> float:
        """Half a stroke on the cam, pi/M [rad]: the period of both conjugate cams together."""
        return math.pi / self.M

    @property
    def e_phi(self) -> Array:
        """Axis of the roller carrier."""
        return np.array([math.sin(self.alpha_1), 0.0, math.cos(self.alpha_1)])

    @property
    def beta_1(self) -> float:
        """Angle from the cam's axis to the axis of relative rotation [rad]."""
        return math.atan2(self.M * math.sin(self.alpha_1), self.M * math.cos(self.alpha_1) + self.N)

    @property
    def e_e(self) -> Array:
        """Axis of relative rotation of cam and carrier."""
        return np.array([math.sin(self.beta_1), 0.0, math.cos(self.beta_1)])

    def phi(self, psi: ArrayLike) -> Array:
        """Angle of the roller carrier [rad]."""
        return -self.M / self.N * np.asarray(psi, float) + (1 - 1 / self.N) * math.pi

    def roller_axis(self, psi: ArrayLike, roller: int = 0) -> Array:
        """Unit vector e_p of the roller this many pitches after the first one."""
        phi = self.phi(psi) + 2 * math.pi * roller / self.N
        along, across = math.cos(self.alpha_3), math.sin(self.alpha_3)
        x, y = across * np.cos(phi), across * np.sin(phi)
        c, s = math.cos(self.alpha_1), math.sin(self.alpha_1)
        return np.stack([c * x + s * along, y, c * along - s * x], -1)

    def beta_4(self, psi: ArrayLike) -> Array:
        """Angle between the roller's axis and the axis of relative rotation [rad]."""
        axis = self.roller_axis(psi)
        return np.asarray(np.arctan2(np.linalg.norm(np.cross(axis, self.e_e), axis=-1), axis @ self.e_e))

    def contact(self, psi: ArrayLike) -> Array:
        """Unit vector e_c along the line of contact, in the fixed frame."""
        beta_4 = self.beta_4(psi)[..., None]
        return np.asarray(
            (np.sin(beta_4 - self.alpha_4) * self.roller_axis(psi) + math.sin(self.alpha_4) * self.e_e) / np.sin(beta_4)
        )

    def profile(self, psi: ArrayLike) -> Array:
        """Point s_c of the cam's profile, in the frame of the cam; also beyond the lobe's tip."""
        return turned(self.contact(psi), -np.asarray(psi, float))

    def pitch_curve(self, psi: ArrayLike) -> Array:
        """The roller's axis in the frame of the cam."""
        return turned(self.roller_axis(psi), -np.asarray(psi, float))

    def profile_speed(self, psi: ArrayLike) -> Array:
        """Arc length of the profile per cam angle: normally negative; zero at a cusp and positive on an undercut part.

        It is the component of ds_c/dpsi along e_e x e_p (unit vector), to which the profile is parallel.
        """
        axis, beta_4, contact = self.roller_axis(psi), self.beta_4(psi)[..., None], self.contact(psi)
        motion = -self.M / self.N * np.cross(self.e_phi, axis)
        turning = -(motion @ self.e_e)[..., None] / np.sin(beta_4)
        change = math.sin(self.alpha_4) * (axis - np.cos(beta_4) * self.e_e) / np.sin(beta_4) ** 2 * turning
        change = change + np.sin(beta_4 - self.alpha_4) / np.sin(beta_4) * motion
        against_cam = change - np.cross([0.0, 0.0, 1.0], contact)
        return np.asarray((against_cam * unit(np.cross(self.e_e, axis))).sum(-1))

    def conformity(self, psi: ArrayLike) -> Array:
        """Radius of the relative curvature of roller and cam at their contact, divided by its distance from the centre; 0 at a cusp.

        On the sphere the roller is a circle with the curvature cot(alpha_4), and the profile is parallel to the pitch curve at the distance
        alpha_4. With kappa_p the curvature of the pitch curve, positive if its centre is on the cam's side, the profile has the curvature
        cot(arccot(kappa_p) - alpha_4), and the sum is 1/(sin(alpha_4)^2 (cot(alpha_4) - kappa_p)).
        """
        axis, beta_4 = self.roller_axis(psi), self.beta_4(psi)[..., None]
        turning = -self.M / self.N * self.e_phi
        relative = turning - [0.0, 0.0, 1.0]
        speed = np.cross(relative, axis)
        change = np.cross(relative, np.cross(turning, axis)) - np.cross([0.0, 0.0, 1.0], speed)
        towards = (self.e_e - np.cos(beta_4) * axis) / np.sin(beta_4)
        curvature = (change * towards).sum(-1) / (speed**2).sum(-1)
        return np.asarray(math.sin(self.alpha_4) ** 2 * (1 / math.tan(self.alpha_4) - curvature))

    @cached_property
    def sigma(self) -> float:
        """Cam angle beyond psi = 0 at which the profile reaches the lobe's plane of symmetry, eq. (5) [rad]."""
        psi = np.linspace(-self.half, self.half, 2 * FINE)[1:]
        side = self.profile(psi)[:, 1]
        after = np.flatnonzero((side[:-1] > 0) & (side[1:] <= 0))
        if not after.size:
            return math.nan
        i = int(after[0])
        return bisected(lambda x: float(self.profile(x)[1]), psi[i], psi[i + 1])

    @property
    def stroke(self) -> tuple[float, float]:
        """(psi_min, psi_max), eq. (6): the range in which one roller touches one valley of the cam [rad]."""
        return -self.sigma - 2 * self.half, self.sigma

    def valleys(self, points: int = 361) -> Array:
        """The profile of all M lobes: ``points`` per valley; it closes only if sigma > 0."""
        valley = self.profile(np.linspace(self.stroke[1], self.stroke[0], points))
        return np.concatenate([turned(valley, 2 * self.half * i) for i in range(self.M)])

    def lever_arms(self, psi: ArrayLike) -> tuple[Array, Array]:
        """Torques of a unit normal force at unit distance from the centre: on the carrier, and on the cam (reversed).

        A_phi = e_phi . (e_c x n), A_psi = e_psi . (e_c x n) with n the normal on the roller. No slip along n: -M A_phi = N A_psi.
        """
        moment = unit(np.cross(self.e_e, self.roller_axis(psi)))  # e_c x n
        return np.asarray(moment @ self.e_phi), np.asarray(moment[..., 2])

    def pressure_angle_p(self, psi: ArrayLike) -> Array:
        """mu_p: between the cam's force on the roller and the velocity of the roller's axis, cam driving (7) [rad].

        It exceeds 90 degrees in the first half of the stroke, where the cam cannot drive for psi' > 0.
        """
        axis = self.roller_axis(psi)
        force = np.cross(axis, np.cross(axis, self.e_e))
        return _angle(force, np.cross(axis, self.e_phi))

    def pressure_angle_n(self, psi: ArrayLike) -> Array:
        """mu_n: between the roller's force on the cam and the velocity of the cam at the contact, roller driving (8) [rad].

        v_c = e_psi x e_c (printed: e_phi x e_c). The force is normal to e_e x e_p, which unlike e_e x e_c does not vanish at beta_3 = 0.
        The roller drives for psi' > 0 before the middle of its stroke, so this exceeds 90 degrees after it; by symmetry
        mu_n(-2 pi/M - psi) = pi - mu_n(psi).
        """
        contact = self.contact(psi)
        force = np.cross(contact, np.cross(self.e_e, self.roller_axis(psi)))
        return _angle(force, np.cross([0.0, 0.0, 1.0], contact))

    @cached_property
    def minimum_pressure_angle(self) -> float:
        """Smallest mu_n of the stroke, the minimum of Fig. 5 and Table 1 [rad]."""
        psi = np.linspace(-2 * self.half - self.sigma, -self.half, FINE)[:-1]
        return lowest(self.pressure_angle_n, psi)


def turned(vectors: Array, angle: ArrayLike) -> Array:
    """Vectors turned about z."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack(np.broadcast_arrays(c * x - s * y, s * x + c * y, z), -1)


def unit(vectors: Array) -> Array:
    """Vectors of length one."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def bisected(function: Callable[[float], float], low: float, high: float) -> float:
    """The place where a function changes sign, once, to round-off."""
    sign = function(low) > 0
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if (function(middle) > 0) == sign else (low, middle)
    return middle


def lowest(function: Callable[[Any], Array], grid: Array) -> float:
    """The smallest value of a function of arrays, searched around the smallest one on a grid."""
    values = function(grid)
    i = int(values.argmin())
    bounds = grid[max(i - 1, 0)], grid[min(i + 1, grid.size - 1)]
    found = minimize_scalar(lambda x: float(function(x)), bounds=bounds, method="bounded", options={"xatol": 1e-10})
    return min(float(found.fun), float(values[i]))


def _angle(a: Any, b: Any) -> Array:
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))
