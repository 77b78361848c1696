"""Circular-arc cam tracks: their geometry, and the motion of a roller between two of them.

C. Provatidis, Power transmission using circular elements bounded by given central angle in rolling contact, Eng 4 (2023) 2309-2335.

The cylinder with a track is unrolled: x runs along the circumference in the sense of positive rotation, y along the axis of
the differential, from the lower cam (right half shaft) to the upper cam (left half shaft). The cage is at rest; theta is the angle
of the upper cam against it, and that of the lower cam is -theta.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError, arguments_checked

Array = NDArray[np.float64]


@arguments_checked
@dataclass(frozen=True)
class Track:
    """A closed track of n equal circular arcs with curvature of alternating sign, on both cams, with n rollers.

    An arc is as long as the circumference permits: 2 R_m sin(alpha_max) = pi D/n. The rollers are 2 pi/n apart. ``phase`` is the
    angle theta by which this track leads: all rollers are in the middle of their arcs (contact angle 0) at theta = -phase.

    Errors: ParameterError for an odd number of arcs (the curvature could not alternate around the circle), a contact angle outside (0, 90
    degrees), rollers that touch their neighbours, and cams that touch each other where two hills meet (lift >= 2 r). Otherwise the rollers
    are small enough for every arc: r < R_m, so the convex surfaces of radius R_m - r are never undercut.
    """

    D: float
    """Mean diameter of the track [m]."""
    r: float
    """Radius of the rollers [m]."""
    alpha_max: float
    """Maximum contact angle, at the ends of an arc: half its central angle [rad]."""
    n: int = 4
    """Number of arcs and of rollers."""
    phase: float = 0.0
    """Lead against theta [rad]."""

    def __post_init__(self) -> None:
        for name, value in (("D", self.D), ("r", self.r)):
            if not (math.isfinite(value) and value > 0):
                raise ParameterError(f"Track: {name} = {value:g} m must be positive and finite")
        check_arcs(self.n, "Track")
        if not 0 < self.alpha_max < math.pi / 2:
            raise ParameterError(
                f"Track: alpha_max = {math.degrees(self.alpha_max):g} degrees is outside (0, 90): a track without "
                "inclination transmits no torque, and none is steeper than its own axis"
            )
        if not math.isfinite(self.phase):
            raise ParameterError(f"Track: phase = {self.phase:g} rad must be finite")
        spacing = self.D * math.sin(math.pi / self.n)
        if 2 * self.r >= spacing:
            raise ParameterError(
                f"Track: rollers of radius r = {self.r:g} m touch each other: {self.n} of them on a diameter of {self.D:g} m are "
                f"{spacing:.4g} m apart; r must be less than {spacing / 2:.4g} m"
            )
        if self.lift >= 2 * self.r:
            steepest = math.degrees(steepest_angle(self.D, self.r, self.n))
            raise ParameterError(
                f"Track: the cams collide where a hill passes a hill: the lift of {self.lift:.4g} m leaves no gap with rollers of "
                f"radius r = {self.r:g} m, it must be less than 2 r; take alpha_max = {math.degrees(self.alpha_max):g} below "
                f"{steepest:.4g} degrees"
            )

    @property
    def R_m(self) -> float:
        """Mean radius of the arcs, on which the rollers' axes move against a cam [m]."""
        return math.pi * self.D / (2 * self.n * math.sin(self.alpha_max))

    @property
    def lift(self) -> float:
        """Stroke of a roller in its groove [m]: twice the height of an arc."""
        return 2 * self.R_m * (1 - math.cos(self.alpha_max))

    def arc(self, theta: ArrayLike) -> tuple[Array, Array]:
        """The arc of the upper cam at roller 0, counted backwards as theta grows, and the position u from -1 to 1 along it.

        Errors: ParameterError for an angle that is not finite; so in all that follows from it.
        """
        angle = np.asarray(theta, float)
        if not np.isfinite(angle).all():
            raise ParameterError("Track: the angle theta must be finite")
        turned = (angle + self.phase) * self.n / (2 * np.pi)
        k = np.round(turned)
        return k, 2 * (turned - k)

    def alpha(self, theta: ArrayLike) -> Array:
        """Contact angle [rad], the same for all rollers: sin(alpha) = |u| sin(alpha_max)."""
        return np.asarray(np.arcsin(np.abs(self.arc(theta)[1]) * math.sin(self.alpha_max)))

    def sense(self, theta: ArrayLike, roller: ArrayLike = 0) -> Array:
        """+1 if the arc bulges down at this roller (a valley, as in Fig. 3), -1 if it bulges up."""
        return np.asarray(1.0 - 2.0 * np.mod(self.arc(theta)[0] + np.asarray(roller), 2))

    def active(self, theta: ArrayLike, roller: ArrayLike, drive: float = 1.0) -> NDArray[np.bool_]:
        """Whether a cage torque with the sign of ``drive`` wedges the roller; none is wedged where the contact angle is zero.

        In a valley both contacts of a roller with delta > 0 are ahead of its axis (Fig. 6) and push it back: the cage pushes forward.
        """
        u = self.arc(theta)[1]
        return np.asarray(self.sense(theta, roller) * np.where(np.abs(u) < 1e-9, 0.0, u) * np.sign(drive) > 0)

    def axis(self, theta: ArrayLike, roller: ArrayLike = 0) -> Array:
        """Height of the roller's axis over the mean height [m]: eq. (10), measured from the arcs' joints, with reversed sign on hills.

        The axis is radial and moves along the groove; against each cam it describes the arc of radius R_m.
        """
        cosine = np.cos(self.alpha(theta))
        return self.sense(theta, roller) * self.R_m * (math.cos(self.alpha_max) - cosine)

    def contacts(self, theta: ArrayLike, roller: ArrayLike = 0) -> tuple[Array, Array, Array]:
        """Eqs. (11)-(13): x of both contact points against the groove's centre, y of the upper one A and of the lower one B [m].

        The instantaneous pole of the roller, eq. (14), has the same x and the height of the axis.
        """
        u, y = self.arc(theta)[1], self.axis(theta, roller)
        x = self.sense(theta, roller) * self.r * u * math.sin(self.alpha_max)
        height = self.r * np.cos(self.alpha(theta))
        return x, y + height, y - height

    def turned(self, theta: ArrayLike) -> Array:
        """Angle by which each roller has turned in the cage since the middle of arc 0 [rad], clockwise with y up.

        It rolls at the speed omega = V/(r cos(alpha)), eqs. (3) and (6), V = dx/dt of the upper cam: always in the same direction, in
        valleys and on hills, and by 2 alpha_max R_m/r per arc.
        """
        k, u = self.arc(theta)
        return self.R_m / self.r * (2 * k * self.alpha_max + np.arcsin(u * math.sin(self.alpha_max)))

    def spin(self, theta: ArrayLike) -> Array:
        """Speed of the rollers about their axes over speed of the upper cam, both against the cage: D/(2 r cos(alpha))."""
        return self.D / (2 * self.r * np.cos(self.alpha(theta)))

    def climb(self, theta: ArrayLike, roller: ArrayLike = 0) -> Array:
        """Speed of the roller's axis along its groove over angular speed of the upper cam, eqs. (1) and (4): (D/2) tan(alpha) [m]."""
        u = self.arc(theta)[1]
        return self.sense(theta, roller) * np.sign(u) * self.D / 2 * np.tan(self.alpha(theta))

    def pitch(self, x: ArrayLike) -> tuple[Array, Array]:
        """The curve of the rollers' axes on the lower cam, around its circumference x [m]: height [m] and slope angle [rad].

        The upper cam has the same curve mirrored in x, so both are cut alike.
        """
        angle = 2 * np.asarray(x, float) / self.D
        k, u = self.arc(angle)
        sense = 1.0 - 2.0 * np.mod(k, 2)
        slope = np.arcsin(u * math.sin(self.alpha_max))
        return sense * self.R_m * (math.cos(self.alpha_max) - np.cos(slope)), sense * slope

    def surface(self, x: ArrayLike, side: int) -> tuple[Array, Array]:
        """The surface at distance r above (``side`` = 1) or below (-1) the pitch curve: its points (x, y) [m].

        Its convex arcs have the radius R_m - r, the concave ones R_m + r.
        """
        y, slope = self.pitch(x)
        return np.asarray(x, float) - side * self.r * np.sin(slope), y + side * self.r * np.cos(slope)


def developed(track: Track, points: int = 721) -> dict[str, Array]:
    """The unrolled track: curve of the rollers' axes and the surface of the lower cam over one turn, (n, 2) [m], for ``write_dxf``."""
    x = np.linspace(0.0, math.pi * track.D, points)
    pitch, surface = (x, track.pitch(x)[0]), track.surface(x, -1)
    return {"axes": np.stack(pitch, -1), "cam": np.stack(surface, -1)}


def steepest_angle(D: float, r: float, n: int) -> float:
    """Contact angle alpha_max at which the cams of a track touch [rad]: lift = (pi D/n) tan(alpha_max/2) = 2 r."""
    return 2 * math.atan(2 * r * n / (math.pi * D))


def check_arcs(n: int, where: str) -> None:
    """Errors: ParameterError if n arcs do not form a closed track."""
    if n < 2 or n % 2:
        raise ParameterError(
            f"{where}: n = {n} arcs: the curvature changes its sign from arc to arc, so that only an even number (2, 4, 6 ...) "
            "closes around the circle"
        )
