"""Masses and moments of inertia of the links (Madhavan 1996, App. B and Table 5.1), and the inertia of the whole mechanism."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.linkage.kinematics import Linkage, Loop

STEEL = 7900.0
"""Density of steel in App. B [kg/m3]."""


ROUNDING = 1e-9
"""Relative tolerance on the limit of an inertia."""


@arguments_checked
@dataclass(frozen=True)
class LinkBody:
    """A body of revolution: mass [kg], moments of inertia about its axis and across it, through its centre [kg.m2]."""

    m: float
    axial: float
    transverse: float

    def __post_init__(self) -> None:
        """Checks the values."""
        for name, unit in ("m", "kg"), ("axial", "kg.m2"), ("transverse", "kg.m2"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ParameterError(f"body: {name} = {value:g} {unit} must be zero or positive, and finite")
        if self.axial > 2 * self.transverse * (1 + ROUNDING):
            raise ParameterError(
                f"body: axial = {self.axial:g} kg.m2 must not exceed 2 transverse = {2 * self.transverse:g} kg.m2, the value of a "
                "thin disk; the thin-rod formula violates this for a short cylinder: use the exact one"
            )
        if self.m == 0 and self.transverse > 0:
            raise ParameterError(f"body: transverse = {self.transverse:g} kg.m2 needs a mass: give m")


def cylinder(mass: float, radius: float, length: float, *, inner: float = 0.0, transverse: str = "rod") -> LinkBody:
    """A cylinder, solid (B.1)-(B.3) or hollow (B.4)-(B.6), with its length along its axis.

    The axial moment of inertia is m (r_2^2 + r_1^2)/2; (B.4) is printed with a minus sign, which ``thesis_cage`` repeats. The transverse
    one is m L^2/12, that of a thin rod, as in the thesis; ``transverse="exact"`` adds m (r_2^2 + r_1^2)/4.

    Parameters
    ----------
    mass : float
        Mass [kg].
    radius, inner : float
        Outer and inner radius [m].
    length : float
        Length [m].
    transverse : {"rod", "exact"}
        The formula for the transverse moment of inertia.

    Returns
    -------
    LinkBody

    Raises
    ------
    ParameterError
        For impossible lengths, or an unknown formula.
    """
    _check_lengths("cylinder", radius, length, inner)
    if transverse not in {"rod", "exact"}:
        raise ParameterError(f'cylinder: transverse = {transverse!r} must be "rod" or "exact"')
    squares = radius**2 + inner**2
    thick = squares / 4 if transverse == "exact" else 0.0
    return LinkBody(mass, mass * squares / 2, mass * (length**2 / 12 + thick))


def _check_lengths(what: str, radius: float, length: float, inner: float) -> None:
    if not (0 <= inner < radius < np.inf and 0 < length < np.inf):
        raise ParameterError(
            f"{what}: radius = {radius:g} m, inner = {inner:g} m, length = {length:g} m: 0 <= inner < radius and length > 0 are needed, "
            "all finite"
        )


def cylinder_mass(radius: float, length: float, *, inner: float = 0.0, density: float = STEEL) -> float:
    """Mass of a cylinder, pi (r_2^2 - r_1^2) L rho.

    Parameters
    ----------
    radius, inner : float
        Outer and inner radius [m].
    length : float
        Length [m].
    density : float
        Density [kg/m3]; by default that of steel.

    Returns
    -------
    float
        Mass [kg].

    Raises
    ------
    ParameterError
        For impossible lengths, or a density that is not positive.
    """
    _check_lengths("cylinder_mass", radius, length, inner)
    if not 0 < density < np.inf:
        raise ParameterError(f"cylinder_mass: density = {density:g} kg/m3 must be positive and finite")
    return density * float(np.pi) * (radius**2 - inner**2) * length


@arguments_checked
@dataclass(frozen=True)
class LinkMasses:
    """The moving masses: cage, coupler (two of them), lever; and the moment of inertia of each output shaft about its axis [kg.m2].

    ``coupler_centre``: distance of a coupler's centre from its R-pair over a; the thesis puts it in the middle of the cylinder.
    """

    cage: LinkBody
    coupler: LinkBody
    lever: LinkBody
    output: float = 0.0
    coupler_centre: float = 0.5

    def __post_init__(self) -> None:
        """Checks the values."""
        for name, unit in ("output", " kg.m2"), ("coupler_centre", ""):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ParameterError(f"link masses: {name} = {value:g}{unit} must be zero or positive, and finite")


GRAM_CM2 = 1e-7
TABLE_5_1 = LinkMasses(
    cage=LinkBody(4.4, 24200 * GRAM_CM2, 93866.67 * GRAM_CM2),
    coupler=LinkBody(0.23, 180 * GRAM_CM2, 690 * GRAM_CM2),
    lever=LinkBody(0.6, 468.75 * GRAM_CM2, 11250 * GRAM_CM2),
)
"""The data set of the thesis as printed (the cage's I_yy, printed as 93866.76, is 93866.67 like I_zz). It has no values for outputs."""

CYLINDERS = {"cage": (0.06, 0.16, 0.05), "coupler": (0.0125, 0.06, 0.0), "lever": (0.0125, 0.15, 0.0)}
"""Radius, length and inner radius [m] of the cylinders in Table 5.1 (the figures are missing; derived from the numbers)."""

OVERHANG = 0.03
"""Excess length of coupler and lever over the distance of their pairs in the thesis, both ends together [m]."""

CORRECTED = replace(TABLE_5_1, cage=cylinder(4.4, 0.06, 0.16, inner=0.05))
"""Table 5.1 with the correct formula for a hollow cylinder: 134 200 g.cm2 for the cage about its axis."""


def scaled(linkage: Linkage, radius: float = 0.0125, density: float = STEEL) -> LinkMasses:
    """Masses of couplers and lever with other lengths, as in the thesis: steel cylinders with the thesis's overhang.

    The cage is unchanged: at constant speed it has no effect.
    """
    coupler, lever = (
        cylinder(cylinder_mass(radius, length, density=density), radius, length)
        for length in (linkage.a + OVERHANG, 2 * linkage.b + OVERHANG)
    )
    return replace(CORRECTED, coupler=coupler, lever=lever)


class ReflectedInertia(NamedTuple):
    """Kinetic energy (J w^2 + M u^2)/2 of the mechanism, w the cage speed, u = d alpha/dt; J1, M1 = dJ/d alpha, dM/d alpha [kg.m2]."""

    J: Any
    M: Any
    J1: Any
    M1: Any


def inertia(loop: Loop, a: Any, b: Any, d: Any, masses: LinkMasses) -> ReflectedInertia:
    """Moments of inertia of the mechanism as functions of alpha, from the kinetic energies of cage, couplers, lever and outputs.

    Coupler left, centre h = coupler_centre a from its R-pair, J_t = transverse + m h^2: it turns about its fixed point at (w + u) about
    x and at d beta/dt across, 2 T = (J_t cos_beta^2 + axial sin_beta^2) (w + u)^2 + J_t (d beta/dt)^2. On the right w - u: in the sum
    the products w u cancel. Lever: its centre moves at d S/dt along y and w S across, 2 T = m ((d S/dt)^2 + w^2 S^2) + transverse
    (d theta/dt)^2 + w^2 (transverse sin(theta)^2 + axial cos(theta)^2). Outputs: J_o ((w + u)^2 + (w - u)^2). Cage: J_c w^2.
    The derivatives use those of ``Loop`` and dQ/d alpha = -a Q s c (3 sin_beta - c^2 cos_beta Q)/R.
    """
    s, c, X, C, R, Q = loop
    coupler, lever = masses.coupler, masses.lever
    sc, cc, slide = s * c, c**2, lever.m * d**2
    across = coupler.transverse + coupler.m * (masses.coupler_centre * a) ** 2
    thin, long = coupler.axial - across, (lever.transverse - lever.axial) / b**2
    swing = 2 * (across + thin * X**2 + masses.output)
    moving = (2 * across * cc + slide) * s**2 + lever.transverse * cc
    J = masses.cage.axial + lever.axial + swing + (a * C) ** 2 * (lever.m * cc + long * s**2)
    J1 = 2 * Q * sc * C * (2 * thin * X + a * (long * (d - a * X) - lever.m * d))
    change = 2 * across * (cc - s**2) + slide - lever.transverse - a / R * (3 * X - cc * C * Q) * moving
    return ReflectedInertia(J, swing + Q**2 * moving, J1, 2 * Q * sc * (2 * thin * X * C + Q * change))
