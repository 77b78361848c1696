"""A vehicle in a bend: speeds of cage, wheels and vehicle (Madhavan 1996, (5.1)-(5.14), (A.1)-(A.8))."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError

Array = NDArray[np.float64]


class WheelSpeeds(NamedTuple):
    """Speeds in a bend [rad/s]: of the outer and inner wheel, and of the outer wheel relative to the cage."""

    outer: float
    inner: float
    differential: float


def in_bend(w_cage: float, radius: float, track: float) -> WheelSpeeds:
    """Speeds of wheels that roll in a bend of ``radius`` [m] (to the middle of the axle), ``track`` [m] apart.

    The outer wheel's centre moves at V_0 (R + x/2)/R (A.7), the inner one's at V_0 (R - x/2)/R (A.8). With rolling, the wheel speeds are in
    the same proportion (5.7), and w_outer + w_inner = 2 w_cage gives w_diff = w_cage x/(2 R) (5.12), w = w_cage (1 +- x/(2 R)) (5.13),
    (5.14). ``radius`` may be infinite; then nothing moves inside the differential. Errors: ParameterError if the radius is less than half
    the track.
    """
    _checked(radius, track)
    if not np.isfinite(w_cage):
        raise ParameterError(f"w_cage = {w_cage:g} rad/s must be finite")
    difference = w_cage * track / (2 * radius)
    return WheelSpeeds(w_cage + difference, w_cage - difference, difference)


def wheel_velocities(yaw_rate: float, radius: float, track: float) -> dict[str, Array]:
    """Velocities [m/s] of cage, outer and inner wheel's centre that turn about one point, k x r (A.1)-(A.6).

    Axes of the vehicle: n1 from the centre of the bend to the cage, n2 ahead, k up.
    """
    _checked(radius, track)
    k = np.array([0.0, 0.0, yaw_rate])
    places = {"cage": radius, "outer": radius + track / 2, "inner": radius - track / 2}
    return {name: np.cross(k, [distance, 0.0, 0.0]) for name, distance in places.items()}


def cage_turns(radius: ArrayLike, track: float) -> Array:
    """Turns of the cage in one internal cycle (alpha from 0 to 2 pi): w_cage/w_diff = 2 R/x (5.11)."""
    _checked(radius, track)
    return 2 * np.asarray(radius, float) / track


def _checked(radius: ArrayLike, track: float) -> None:
    if not 0 < track < np.inf:
        raise ParameterError(f"track = {track:g} m must be positive and finite")
    given = np.ravel(np.asarray(radius, float))
    if (bad := given[~(given > track / 2)]).size:
        raise ParameterError(
            f"radius = {bad[0]:g} m must be greater than half the track, {track / 2:g} m: the centre of the bend lies outside the axle"
        )
