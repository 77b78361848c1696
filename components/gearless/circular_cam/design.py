"""The design of a circular-cam differential: two tracks out of phase, and the friction disks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.circular_cam.disk import FrictionDisk
from powertrain.components.gearless.circular_cam.locking_law import (
    Sharing,
    check_sharing,
    disk_coefficient,
    groove_coefficient,
    outer_share,
)
from powertrain.components.gearless.circular_cam.track import Array, Track

LEAST_WIDTH = 0.2
"""Least width of a roller, a slice of a sphere, relative to its radius: the rollers of both tracks turn side by side in one groove."""


@arguments_checked
@dataclass(frozen=True)
class CircularCams:
    """Two concentric tracks on each cam, half an arc out of phase: one is steepest where the other cannot transmit torque.

    At theta = 0 the outer rollers are in the middle of their arcs (Fig. 15a). Rollers of both tracks share the grooves of the cage;
    they are slices of spheres, two per groove, which turn independently.

    Errors: ParameterError if the inner track is not smaller or leaves no width for the rollers, if the numbers of arcs differ, or if
    the tracks are not half an arc apart.
    """

    outer: Track
    inner: Track
    disk: FrictionDisk

    def __post_init__(self) -> None:
        outer, inner = self.outer, self.inner
        if inner.D >= outer.D:
            raise ParameterError(
                f"CircularCams: the inner track's diameter {inner.D:g} m must be less than the outer track's {outer.D:g} m"
            )
        if inner.n != outer.n:
            raise ParameterError(
                f"CircularCams: the tracks have {outer.n} and {inner.n} arcs; both tracks need the same number"
            )
        width, radius = (outer.D - inner.D) / 2, max(outer.r, inner.r)
        if width < LEAST_WIDTH * radius:
            raise ParameterError(
                f"CircularCams: tracks of {outer.D:g} and {inner.D:g} m leave slices of {width:g} m to rollers of radius {radius:g} m; "
                f"they need {LEAST_WIDTH:g} of it, {LEAST_WIDTH * radius:.4g} m: increase the difference of the diameters"
            )
        apart = (inner.phase - outer.phase) * outer.n / math.pi
        if abs(apart % 2 - 1) > 1e-9:
            raise ParameterError(
                f"CircularCams: the inner track leads by {math.degrees(inner.phase - outer.phase):g} degrees; it must be half an arc, "
                f"{180 / outer.n:g} degrees, so that at every phase one track can transmit"
            )

    @classmethod
    @arguments_checked
    def build(
        cls,
        *,
        D_out: float,
        D_in: float,
        r_out: float,
        r_in: float,
        alpha_out: float,
        alpha_in: float,
        disk: FrictionDisk,
        n: int = 4,
    ) -> Self:
        """Two tracks with the same number of rollers, half a pitch apart, and friction discs.

        Parameters
        ----------
        D_out, D_in : float
            Diameters of the outer and the inner track [m].
        r_out, r_in : float
            Radii of their rollers [m].
        alpha_out, alpha_in : float
            Maximum contact angles [rad].
        disk : FrictionDisk
            The friction discs.
        n : int
            Number of rollers per track.

        Raises
        ------
        ParameterError
            For tracks that cannot be built.
        """
        outer = Track(D_out, r_out, alpha_out, n)
        return cls(outer, Track(D_in, r_in, alpha_in, n, math.pi / n), disk)

    @property
    def xi(self) -> float:
        """Inner over outer track diameter, eqs. (19) and (44)."""
        return self.inner.D / self.outer.D

    def sines(self, theta: ArrayLike, sharing: Sharing = "elastic") -> tuple[Array, Array]:
        """Sines of the contact angles of the outer and the inner track; for "averaged" sharing those of their mean angles."""
        if sharing == "averaged":
            ones = np.ones_like(np.asarray(theta, float))
            return math.sin(self.outer.alpha_max / 2) * ones, math.sin(self.inner.alpha_max / 2) * ones
        return np.sin(self.outer.alpha(theta)), np.sin(self.inner.alpha(theta))

    def share(self, theta: ArrayLike, sharing: Sharing = "elastic", stiffness: float = 1.0) -> Array:
        """lambda: the share of the cage's torque that the outer track carries."""
        check_sharing(sharing, stiffness)
        return np.asarray(outer_share(sharing, *self.sines(theta, sharing), self.xi, stiffness), float)

    def kappa(
        self, theta: ArrayLike, sharing: Sharing = "elastic", *, stiffness: float = 1.0, mu_groove: float = 0.0
    ) -> Array:
        """Locking coefficient (T_R - T_L)/T_C of halves in relative motion. They lock if it is at least 1.

        With the rigid rule it is infinite where one track's angle is zero.

        Parameters
        ----------
        theta : array_like
            Phases [rad].
        sharing : {"elastic", "rigid", "averaged"}
            How the tracks share the torque (``Sharing``).
        stiffness : float
            Stiffness of the inner contacts relative to the outer ones [1].
        mu_groove : float
            Coefficient of friction in the grooves [1].

        Returns
        -------
        numpy.ndarray
            One value [1] per phase.

        Raises
        ------
        ParameterError
            For an unknown rule, and for an impossible stiffness or friction.
        """
        check_sharing(sharing, stiffness)
        if not (math.isfinite(mu_groove) and mu_groove >= 0):
            raise ParameterError(f"CircularCams.kappa: mu_groove = {mu_groove:g} must be zero or positive, and finite")
        sines, friction = self.sines(theta, sharing), self.disk.mu * self.disk.D_R
        with np.errstate(divide="ignore"):
            disks = disk_coefficient(sharing, *sines, self.outer.D, self.inner.D, friction, stiffness=stiffness)
        return np.asarray(disks + groove_coefficient(sharing, *sines, self.xi, mu_groove, stiffness=stiffness), float)


TABLE_1 = CircularCams.build(
    D_out=0.085,
    D_in=0.050,
    r_out=0.015,
    r_in=0.012,
    alpha_out=math.radians(15.0),
    alpha_in=math.radians(27.25),
    disk=FrictionDisk(d_out=0.095, d_in=0.045, mu=0.066),
)
"""The data of Table 1 of the paper."""
TORQUE = 260.0
"""Torque of the cage in Table 1 [N.m]."""
