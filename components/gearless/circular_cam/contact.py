"""Contact pressure between rollers and cams: the paper's equivalent sphere, eqs. (28)-(31), and the exact elliptic contact of Hertz.

K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, section 4.2, for the elliptic contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.circular_cam.track import Array, Track

Method = Literal["sphere", "elliptic"]


@arguments_checked
@dataclass(frozen=True)
class RollerContact:
    """A spherical roller of radius ``r`` on a cam that is curved along the track and concave across it.

    1/R_ex = 1/r -+ 1/R_x (minus where the cam is concave, plus where it is convex),  1/R_ey = 1/r - 1/R_y

    A wedged roller has both contacts at once: one cam is concave with R_x = R_m + r, the other convex with R_x = R_m - r, where the
    pressure is higher. The paper gives the concave contact. It does not state E; 200 GPa reproduces its tables.

    Errors: ParameterError for a hollow not wider than the roller (no point contact), and for impossible material data.
    """

    r: float
    """Radius of the roller [m]."""
    R_x: float
    """Radius of the cam's surface along the track [m]."""
    R_y: float
    """Radius of the cam's hollow across the track [m]."""
    convex: bool = False
    """Whether the cam bulges along the track."""
    E: float = 200e9
    """Young's modulus of the roller [Pa]."""
    nu: float = 0.3
    """Poisson's ratio of the roller [1]."""
    E_cam: float | None = None
    """Young's modulus of the cam [Pa]; by default that of the roller."""
    nu_cam: float | None = None
    """Poisson's ratio of the cam [1]; by default that of the roller."""

    def __post_init__(self) -> None:
        for name, value in (("r", self.r), ("R_x", self.R_x), ("R_y", self.R_y)):
            if not (math.isfinite(value) and value > 0):
                raise ParameterError(f"RollerContact: {name} = {value:g} m must be positive and finite")
        hollows = [("R_y", self.R_y)] if self.convex else [("R_x", self.R_x), ("R_y", self.R_y)]
        for name, value in hollows:
            if value <= self.r:
                raise ParameterError(
                    f"RollerContact: the hollow's radius {name} = {value:g} m must be greater than the roller's r = {self.r:g} m: "
                    "a roller that fills it does not touch in one point"
                )
        for E, nu in self._materials:
            if not (E > 0 and -1 < nu <= 0.5):
                raise ParameterError(
                    f"RollerContact: no material has E = {E:g} Pa (> 0 is needed) and nu = {nu:g} (-1 < nu <= 0.5)"
                )

    @property
    def _materials(self) -> tuple[tuple[float, float], tuple[float, float]]:
        E_cam = self.E if self.E_cam is None else self.E_cam
        return (self.E, self.nu), (E_cam, self.nu if self.nu_cam is None else self.nu_cam)

    @property
    def E_star(self) -> float:
        """Equivalent modulus [Pa], eq. (31)."""
        return 1 / sum((1 - nu**2) / E for E, nu in self._materials)

    @property
    def radii(self) -> tuple[float, float]:
        """R_ex and R_ey [m], eq. (28)."""
        return 1 / (1 / self.r + (1 if self.convex else -1) / self.R_x), 1 / (1 / self.r - 1 / self.R_y)

    @property
    def R_e(self) -> float:
        """Radius of the equivalent sphere [m], eq. (29)."""
        return math.sqrt(math.prod(self.radii))

    def pressure(self, force: ArrayLike, method: Method = "elliptic") -> Array:
        """Greatest pressure [Pa] under a normal force [N].

        "sphere" is eq. (30); it assumes a circular contact, and gives too low a pressure. "elliptic" is exact for smooth elastic bodies.
        """
        F = _pushing(force)
        if method == "sphere":
            return np.cbrt(6 * F * self.E_star**2 / (math.pi**3 * self.R_e**2))
        a, b = self.ellipse(F)
        area = math.pi * a * b
        return np.divide(1.5 * F, area, out=np.zeros_like(area), where=area > 0)

    def ellipse(self, force: ArrayLike) -> tuple[Array, Array]:
        """Semi-axes of the contact [m]: the longer one is in the direction of closer conformity, across or along the track."""
        F = _pushing(force)
        k = self.slenderness
        m = 1 - k**2
        K, E = ellipk(m), ellipe(m)
        shape = 1.0 if m < 1e-9 else (4 / (math.pi * m) * k**1.5 * math.sqrt((E / k**2 - K) * (K - E))) ** (1 / 3)
        mean = np.cbrt(0.75 * F * self.R_e / self.E_star) * shape
        return mean / math.sqrt(k), mean * math.sqrt(k)

    @property
    def slenderness(self) -> float:
        """Shorter over longer semi-axis: (E/k^2 - K)/(K - E) = R'/R'', K and E the complete elliptic integrals of m = 1 - k^2."""
        wanted = max(self.radii) / min(self.radii)
        if wanted < 1 + 1e-9:
            return 1.0

        def miss(log: float) -> float:
            k = math.exp(log)
            K, E = ellipk(1 - k**2), ellipe(1 - k**2)
            return math.log((E / k**2 - K) / (K - E) / wanted)

        return math.exp(float(brentq(miss, -math.log(wanted) - 1, -1e-7, xtol=1e-14)))


def _pushing(force: ArrayLike) -> Array:
    F = np.asarray(force, float)
    if not (np.isfinite(F) & (F >= 0)).all():
        raise ParameterError(
            f"RollerContact: a normal force of {float(F.min()):g} N: a contact force must be compressive and finite"
        )
    return F


def track_contacts(
    track: Track, *, hollow: float = 1.1, R_concave: float | None = None, E: float = 200e9, nu: float = 0.3
) -> tuple[RollerContact, RollerContact]:
    """The concave and the convex contact of a track's rollers.

    The paper's R_m + r = 0.220 m (outer track) does not match the contact angle of 15 degrees with which it is used: arcs that close
    on 85 mm at 15 degrees have 0.144 m.

    Parameters
    ----------
    track : Track
        The track.
    hollow : float
        Radius of the hollow relative to that of the roller [1].
    R_concave : float, optional
        R_m + r [m], instead of the radius with which the track closes.
    E : float
        Young's modulus of rollers and tracks [Pa].
    nu : float
        Their Poisson's ratio [1].

    Returns
    -------
    tuple of RollerContact
        Concave, convex.

    Raises
    ------
    ParameterError
        If the radius of the track's arcs is not greater than that of the rollers.
    """
    R_m = track.R_m if R_concave is None else R_concave - track.r
    if R_m <= track.r:
        raise ParameterError(f"track_contacts: R_m = {R_m:g} m must be greater than the roller's radius {track.r:g} m")
    concave, convex = (
        RollerContact(track.r, R_m + side * track.r, hollow * track.r, side < 0, E, nu) for side in (1, -1)
    )
    return concave, convex
