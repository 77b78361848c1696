"""The choice of lobes and rollers: the paper's tables, and the search for which they are made."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import ROUND_DOWN, Decimal
from fractions import Fraction

import numpy as np

from powertrain import ParameterError
from powertrain.components.gearless.spherical_cam.curves import FINE, Array, bisected, lowest
from powertrain.components.gearless.spherical_cam.cycle import CamFriction, Cycle
from powertrain.components.gearless.spherical_cam.final_drive import STANDARD_RATIOS
from powertrain.components.gearless.spherical_cam.profile import CamGeometry, SphericalCam

COMBINATIONS = tuple((M, N) for M in (3, 4) for N in range(M, 9) if (M, N) != (3, 8))
"""Lobes and rollers in the tables of the paper."""


def pressure_angle_range(cam: CamGeometry) -> tuple[float, float]:
    """(smallest mu_n, mu_n at which two conjugate cams half a stroke apart are equal) [rad]; nan if no such angle is reached.

    The minimum is that of Table 1 for alpha_3 = 44 and alpha_4 = 19 degrees, which the paper does not state, to 0.01 rad ((3, 7): 1.12,
    printed 1.1; (4, 7): 0.92, printed 1.01; 0 for M = N). The maxima of Table 1 are not reproducible, neither as this intersection nor as
    that with the next stroke of the same cam; "16.62" is not an angle in radians. The values here are what the equations give.
    """
    s = np.linspace(0.0, 3 * cam.half, FINE)[1:-1]

    def angle(at: float | Array) -> Array:
        return cam.pressure_angle_n(-cam.half - np.asarray(at))

    def difference(at: float) -> float:
        return float(angle(at) - angle(at + cam.half))

    within = s[s < cam.half]
    falls = np.flatnonzero(np.diff(np.sign(angle(within) - angle(within + cam.half))) < 0)
    most = float(angle(bisected(difference, *within[falls[0] : falls[0] + 2]))) if falls.size else math.nan
    return lowest(angle, s), most


def table_2(standard: Iterable[float] = STANDARD_RATIOS) -> dict[tuple[int, int], tuple[float, ...]]:
    """For each (M, N): the "differential ratio" M/N, then M/N times each standard ratio, truncated to two decimals, as printed.

    These numbers say nothing about a vehicle: for any M and N, the mean speed of both sides is that of the cage.
    """
    exact = [Fraction(str(ratio)) for ratio in (1, *standard)]
    return {(M, N): tuple(_cut(Fraction(M, N) * ratio) for ratio in exact) for M, N in COMBINATIONS}


def _cut(value: Fraction) -> float:
    quotient = Decimal(value.numerator) / Decimal(value.denominator)
    return float(quotient.quantize(Decimal("0.01"), rounding=ROUND_DOWN))


@dataclass(frozen=True)
class Choice:
    """One combination: its properties, or why it is rejected."""

    M: int
    N: int
    minimum_pressure_angle: float
    off_standard: float
    mean_eta: float
    refused: str = ""


def search(
    lobes: Iterable[int] = (3, 4),
    rollers: Iterable[int] = range(3, 9),
    *,
    alpha_3: float = math.radians(44),
    alpha_4: float = math.radians(19),
    friction: CamFriction | None = None,
) -> list[Choice]:
    """All combinations with at least as many rollers as lobes, by their smallest pressure angle; infeasible ones come last.

    With the default angles the first is {M = 4, N = 5}, before {3, 4}, the paper's choice. M = N is rejected, and so are 7 and 8 rollers,
    which overlap at these angles. More than four lobes, which the paper omits, have even smaller pressure angles ({5, 6}), but smaller
    lobes.

    Parameters
    ----------
    lobes, rollers : iterable of int
        Numbers of lobes M and of rollers N.
    alpha_3, alpha_4 : float
        Angles of the cam [rad].
    friction : CamFriction, optional
        Friction for the efficiency; by default that of the component.

    Returns
    -------
    list of Choice
        ``off_standard`` is the smallest distance of M/N times a standard final-drive ratio from a standard ratio, the paper's second
        criterion; ``mean_eta`` is the efficiency of the relative motion, averaged over a cycle.
    """
    rollers = tuple(rollers)
    found = [_judged(M, N, alpha_3, alpha_4, friction or CamFriction()) for M in lobes for N in rollers if N >= M]
    return sorted(found, key=lambda choice: (bool(choice.refused), choice.minimum_pressure_angle))


def _judged(M: int, N: int, alpha_3: float, alpha_4: float, friction: CamFriction) -> Choice:
    scaled = [M / N * ratio for ratio in STANDARD_RATIOS]
    off = min(abs(a - b) for a in scaled for b in STANDARD_RATIOS) if M != N else 0.0
    try:
        cam = SphericalCam(M, N, alpha_3=alpha_3, alpha_4=alpha_4)
    except ParameterError as error:
        return Choice(M, N, math.nan, off, math.nan, str(error))
    s = np.linspace(0.0, cam.half, 360, endpoint=False)
    return Choice(M, N, cam.minimum_pressure_angle, off, float(Cycle(cam, friction).eta_0(s).mean()))
