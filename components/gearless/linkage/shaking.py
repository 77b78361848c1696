"""Reactions of the moving links on the housing: shaking force and moment about the centre, where C axis and shaft axis meet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.components.gearless.linkage.forces import Drive, X, Y, acceleration, coupler_rates, lever_rate
from powertrain.components.gearless.linkage.kinematics import Linkage
from powertrain.components.gearless.linkage.masses import TABLE_5_1, LinkMasses

Array = NDArray[np.float64]


class Shaking(NamedTuple):
    """Force [N] and moment [N.m] on the housing, (..., 3)."""

    force: Array
    moment: Array


def shaking(linkage: Linkage, drive: Drive, masses: LinkMasses = TABLE_5_1, *, phi: ArrayLike | None = None) -> Shaking:
    """Force and moment about the centre on the shafts' bearings: minus the rates of change of momentum and angular momentum.

    In axes of the cage or, if its angle ``phi`` is given, of the housing. The common centre of mass of lever and couplers stays on
    the C axis: the force is that of one mass m_lever + 2 coupler_centre m_coupler at S. There is none along x. The moment about x is the
    sum of the torques on the three shafts, which does not act on the housing and is left out. Torques between the shafts have no effect.
    """
    m = linkage.motion(drive.alpha)
    place, place1, place2 = (v[..., None] * Y for v in (m.S, m.S1, m.S2))
    lever = masses.lever.m * acceleration(drive, place, place1, place2)
    slide = acceleration(drive, place, place1, place2) * masses.coupler_centre * masses.coupler.m
    force = -lever - 2 * slide
    moment = -lever_rate(linkage, drive, masses) - np.cross(place, lever)
    for rate, momentum, side in coupler_rates(linkage, drive, masses):
        moment = moment - rate - np.cross(side * linkage.d * X, momentum)
    across = np.array([0.0, 1.0, 1.0])
    if phi is None:
        return Shaking(force * across, moment * across)
    return Shaking(*(turned(v * across, phi) for v in (force, moment)))


def turned(v: Array, phi: ArrayLike) -> Array:
    """Transform vectors from axes of the cage to axes of the housing; the cage is turned by ``phi`` about x."""
    s, c = np.sin(phi), np.cos(phi)
    x, y, z = np.moveaxis(v, -1, 0)
    return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)


def turns(force: Array) -> float:
    """The number of turns of a force in the plane y z about x, along a finely sampled record."""
    angle = np.unwrap(np.arctan2(force[..., 2], force[..., 1]))
    return float((angle[-1] - angle[0]) / (2 * np.pi))
