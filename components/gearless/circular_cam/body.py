"""The cams and rollers of a circular-cam differential as closed bodies."""

from __future__ import annotations

import math

import numpy as np

from powertrain.components.gearless.circular_cam.design import CircularCams
from powertrain.components.gearless.circular_cam.track import Array, Track
from powertrain.components.gearless.solids import shell


def cam_solids(cams: CircularCams, thickness: float = 0.008, points: int = 361) -> tuple[Array, Array]:
    """The outer and the inner ring of the lower cam as triangles (n, 3, 3) [m], with the axis along z, for ``gearless.solids.write_stl``.

    ``thickness``: of the disk below the deepest point of the tracks [m]. Both cams are equal; the upper one is the lower one turned
    over and rotated by one arc. The rings meet halfway between the tracks and extend equally inward and outward from them, but no further
    than the roller's radius. The shallow transverse hollow of the tracks is not modelled.
    """
    middle, apart = (cams.outer.D + cams.inner.D) / 4, (cams.outer.D - cams.inner.D) / 4
    back = (
        min(float(track.surface(_around(track, points), -1)[1].min()) for track in (cams.outer, cams.inner)) - thickness
    )
    rim = cams.outer.D / 2 + min(apart, cams.outer.r)
    hole = cams.inner.D / 2 - min(apart, cams.inner.r)
    return _ring(cams.outer, middle, rim, back, points), _ring(cams.inner, hole, middle, back, points)


def _around(track: Track, points: int) -> Array:
    return np.linspace(0.0, math.pi * track.D, points, endpoint=False)


def _ring(track: Track, low: float, high: float, back: float, points: int) -> Array:
    """Between two cylinders of radius ``low`` and ``high``, from the flat back to the track."""
    x, y = track.surface(_around(track, points), -1)
    azimuth = 2 * x / track.D

    def line(radius: float, height: Array) -> Array:
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], -1)

    flat = np.full_like(y, back)
    return shell(np.stack([line(low, flat), line(high, flat), line(high, y), line(low, y)], axis=1))


def roller_solid(track: Track, width: float, points: int = 36) -> Array:
    """A roller as a short cylinder [m] with its axis along x, in the middle of its track."""
    turn = np.linspace(0, 2 * math.pi, points, endpoint=False)
    y, z, zero = track.r * np.cos(turn), track.r * np.sin(turn), np.zeros(points)
    low, high = track.D / 2 - width / 2, track.D / 2 + width / 2

    def ring(x: float, size: float) -> Array:
        return np.stack([zero + x, size * y, size * z], -1)

    return shell(np.stack([ring(low, 0.0), ring(low, 1.0), ring(high, 1.0), ring(high, 0.0)], axis=1))
