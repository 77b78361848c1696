"""Dimensions of a spherical cam differential: contact pressure, volume, mass and inertia of its cams and rollers."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.solids import shell, volume
from powertrain.components.gearless.spherical_cam.curves import Array, lowest
from powertrain.components.gearless.spherical_cam.cycle import Cycle
from powertrain.components.gearless.spherical_cam.profile import SphericalCam
from powertrain.components.gearless.spherical_cam.rollers import contact

POINTS = 721
ARC = 6
"""Steps from the bore to the profile for drawing a spherical face."""


@arguments_checked
@dataclass(frozen=True)
class CamBody:
    """A cam of a spherical cam differential as a body: the inner and the outer conjugate cam, their rollers, and the number of pairs.

    ``inner``, ``outer``: distances from the centre between which the cams extend [m]; they are conical, with all generators through the
    centre. ``bore``: radius of the hole for the shaft [m]. ``pairs``: pairs of cams around the axle. ``E`` [Pa], ``nu``,
    ``density`` [kg/m3] of cams and rollers.

    Cam and roller turn about axes through the centre, so an elastic approach grows with the distance rho from it: the load per length is
    k rho. So does the radius of relative curvature, rho c, with c the ``conformity`` of the profile. The pressure of Hertz's line contact
    is therefore constant along the line:

    p = sqrt(k rho E'/(pi rho c)),  E' = E/(2 (1 - nu^2)),  moment of the line k (rho_o^3 - rho_i^3)/3

    For a given pressure, torque and volume are in proportion. Source: K. L. Johnson, Contact Mechanics, Cambridge University Press 1985,
    ch. 4.

    Errors: ParameterError for cams inside out or overlapping, a bore as large as the cam, or impossible material data.

    >>> body = CamBody(SphericalCam(4, 5), inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
    >>> round(body.mass, 2), round(1e6 * body.spin_inertia, 1)
    (0.2, 42.9)
    """

    cam: SphericalCam
    inner: tuple[float, float]
    outer: tuple[float, float]
    bore: float = 0.0
    pairs: int = 2
    E: float = 210e9
    nu: float = 0.3
    density: float = 7850.0

    def __post_init__(self) -> None:
        radii = (*self.inner, *self.outer)
        if not (all(map(math.isfinite, radii)) and 0 <= radii[0] < radii[1] <= radii[2] < radii[3]):
            said = ", ".join(f"{rho:g}" for rho in radii)
            raise ParameterError(
                f"CamBody: the cams reach over {said} m from the centre: these must be finite and increasing, with the outer cam outside"
            )
        least = float(np.hypot(*self.cam.whole_profile()[:, :2].T).min()) * radii[0]
        if not 0 <= self.bore <= least:
            raise ParameterError(
                f"CamBody: bore = {self.bore:g} m must lie in [0, {least:.4g}] m: the inner cam is no thicker where it begins"
            )
        if self.pairs < 1 or not (self.E > 0 and -1 < self.nu <= 0.5 and self.density > 0):
            raise ParameterError(
                f"CamBody: pairs = {self.pairs}, E = {self.E:g} Pa, nu = {self.nu:g}, density = {self.density:g} kg/m3: at least one "
                "pair is needed, of a material with E > 0, -1 < nu <= 0.5 and a positive density"
            )

    @property
    def _sizes(self) -> tuple[float, float]:
        """(rho_o^3 - rho_i^3)/3 of both cams [m3]."""
        return (self.inner[1] ** 3 - self.inner[0] ** 3) / 3, (self.outer[1] ** 3 - self.outer[0] ** 3) / 3

    def _lines(self, cycle: Cycle, s: Array, torque: ArrayLike) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Moments of the line loads on the inner and the outer cam about the centre [N.m], and u of their rollers."""
        first, second = cycle.contact_force(s, 1.0, 1.0, cams=self.pairs)
        (half_stroke, phase), size = np.divmod(s, cycle.cam.half), np.abs(torque)
        on_first = half_stroke % 2 == 0
        ahead = np.where(on_first, 0.0, cycle.cam.half)
        moments = size * np.where(on_first, first, second), size * np.where(on_first, second, first)
        return moments, (phase + ahead, phase + cycle.cam.half - ahead)

    def forces(self, cycle: Cycle, s: ArrayLike, torque: ArrayLike) -> tuple[Array, Array, Array]:
        """Normal forces on the inner and the outer cam of one pair [N], and their sum on the carrier in the frame of ``Cycle`` (..., 3).

        For the torque of one side wheel [N.m] at the cam angle s, without friction, as for ``pressure``.
        """
        moments, places = self._lines(cycle, np.asarray(s, float), torque)
        reaches = (self.inner, self.outer)
        normal = [m / size * (b**2 - a**2) / 2 for m, size, (a, b) in zip(moments, self._sizes, reaches, strict=True)]
        parts = [
            force[..., None] * np.stack(np.broadcast_arrays(*contact(cycle.cam, u, 0.0).normal), -1)
            for force, u in zip(normal, places, strict=True)
        ]
        total: Array = np.sum(parts, axis=0)
        return normal[0], normal[1], total

    def pressure(self, cycle: Cycle, s: ArrayLike, torque: ArrayLike) -> tuple[Array, Array]:
        """Hertz's maximum pressure [Pa] on the inner and the outer cam at the cam angle s, for the torque of one side wheel [N.m].

        Without friction. s = 0 is the middle of a stroke of the inner cam; the period is a stroke, 2 pi/M. The rule of load sharing
        determines the share of the torque that each roller carries.
        """
        moments, places = self._lines(cycle, np.asarray(s, float), torque)
        stiff = self.E / (2 * (1 - self.nu**2)) / math.pi
        inner, outer = (
            np.sqrt(moment / size * stiff / cycle.cam.conformity(u - cycle.cam.half))
            for moment, size, u in zip(moments, self._sizes, places, strict=True)
        )
        return inner, outer

    def greatest_pressure(self, cycle: Cycle, torque: float) -> float:
        """The maximum pressure of a cycle [Pa]. Below the surface the maximum shear stress is 0.30 of it (Johnson, 4.1)."""
        s = np.linspace(0.0, 2 * cycle.cam.half, POINTS)
        return -lowest(lambda at: -np.maximum(*self.pressure(cycle, at, torque)), s)

    def sized(self, cycle: Cycle, torque: float, pressure: float) -> Self:
        """The similar body in which a torque of one side wheel [N.m] causes a pressure [Pa]: torque/(pressure^2 size^3) is constant."""
        if not (torque > 0 and pressure > 0):
            raise ParameterError(
                f"CamBody.sized: torque = {torque:g} N.m and pressure = {pressure:g} Pa must be positive"
            )
        factor = (self.greatest_pressure(cycle, torque) / pressure) ** (2 / 3)
        (a, b), (c, d) = self.inner, self.outer
        return replace(self, inner=(a * factor, b * factor), outer=(c * factor, d * factor), bore=self.bore * factor)

    @property
    def volume(self) -> float:
        """Volume of all cams [m3]."""
        return self.pairs * sum(self._moments(*reach)[0] for reach in (self.inner, self.outer))

    @property
    def mass(self) -> float:
        """Mass of all cams [kg]."""
        return self.density * self.volume

    @property
    def spin_inertia(self) -> float:
        """Moment of inertia of all cams about their shafts [kg.m2]."""
        return self.density * self.pairs * sum(self._moments(*reach)[1] for reach in (self.inner, self.outer))

    def _moments(self, low: float, high: float) -> tuple[float, float]:
        """Volume [m3] and its second moment about the shaft [m5] between two spheres, the profile and the bore.

        A wedge between azimuths extends from the bore, sin(theta) = bore/rho, to the profile at theta, and
        int rho^2 sin(theta), int rho^4 sin(theta)^3 over theta and rho are, with t = rho^2 - bore^2,
        t^(3/2)/3 - cos(theta) rho^3/3,  2 t^(5/2)/15 + bore^2 t^(3/2)/3 - (cos(theta) - cos(theta)^3/3) rho^5/5
        """
        points = self.cam.whole_profile(POINTS)
        x, y, cosine = np.vstack([points, points[:1]]).T
        azimuth = np.diff(np.unwrap(np.arctan2(y, x)))

        def around(values: Array) -> float:
            return abs(float(((values[1:] + values[:-1]) / 2 * azimuth).sum()))

        def at(rho: float) -> tuple[Array, Array]:
            t = rho**2 - self.bore**2
            area = t**1.5 / 3 - cosine * rho**3 / 3
            second = 2 * t**2.5 / 15 + self.bore**2 * t**1.5 / 3 - (cosine - cosine**3 / 3) * rho**5 / 5
            return area, second

        (area_low, second_low), (area_high, second_high) = at(low), at(high)
        return around(area_high - area_low), around(second_high - second_low)

    def _reach(self, which: Literal["inner", "outer"]) -> tuple[float, float]:
        return self.inner if which == "inner" else self.outer

    def cam_solid(self, which: Literal["inner", "outer"], points: int = 61) -> Array:
        """The closed surface of one cam as triangles (n, 3, 3) [m], its axis along z, for ``gearless.solids.write_stl``.

        ``points`` for each valley of the profile.
        """
        return cone_solid(self.cam.whole_profile(points), *self._reach(which), self.bore)

    def roller_solid(self, which: Literal["inner", "outer"], points: int = 61) -> Array:
        """The closed surface of one roller, a full cone between two spheres, its axis along z."""
        turn = np.linspace(0, 2 * math.pi, points, endpoint=False)
        s, c = math.sin(self.cam.alpha_4), math.cos(self.cam.alpha_4)
        edge = np.stack([s * np.cos(turn), s * np.sin(turn), np.full(points, c)], -1)
        return cone_solid(edge, *self._reach(which))

    @property
    def roller_mass(self) -> float:
        """Masses of one roller on the inner cam and one on the outer cam, as full cones [kg]."""
        return self.density * 2 * math.pi * (1 - math.cos(self.cam.alpha_4)) * sum(self._sizes)

    @property
    def roller_inertias(self) -> tuple[float, float]:
        """Moments of inertia of one roller on the inner and one on the outer cam about their axes, as full cones [kg.m2]."""
        c = math.cos(self.cam.alpha_4)
        around = 2 * math.pi * self.density * (2 / 3 - c + c**3 / 3) / 5
        inner, outer = (around * (high**5 - low**5) for low, high in (self.inner, self.outer))
        return inner, outer


def cone_solid(edge: Array, low: float, high: float, bore: float = 0.0) -> Array:
    """Triangles of the body between two spheres in a cone over a closed curve on the unit sphere (n, 3), around z, minus a bore."""
    azimuth, polar = np.arctan2(edge[:, 1], edge[:, 0]), np.arccos(edge[:, 2])

    def face(rho: float) -> Array:
        hole = math.asin(bore / rho) if rho > 0 else 0.0
        theta = hole + (polar - hole)[:, None] * np.linspace(0, 1, ARC + 1)
        across = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], -1)[:, None, :]
        along = np.array([0.0, 0.0, 1.0])
        return np.asarray(rho * (np.sin(theta)[..., None] * across + np.cos(theta)[..., None] * along))

    triangles = shell(np.concatenate([face(low), face(high)[:, ::-1]], axis=1))
    return triangles if volume(triangles) > 0 else triangles[:, ::-1]
