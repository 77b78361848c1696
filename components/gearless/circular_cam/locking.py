"""Whether and at which phases a circular-cam differential locks: eqs. (37)-(42), and an evaluation over all phases."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from powertrain import ParameterError
from powertrain.components.gearless.circular_cam.design import CircularCams
from powertrain.components.gearless.circular_cam.locking_law import Sharing
from powertrain.components.gearless.circular_cam.track import Array, steepest_angle

_SAMPLES = 721


def bias_ratio(kappa: ArrayLike) -> Array:
    """Larger over smaller torque of the half shafts during relative motion: (1 + kappa)/(1 - kappa).

    The slower shaft has the larger one if the cage drives, the faster one in overrun. Infinite for kappa >= 1, where the faster side may
    receive no torque at all. Errors: ParameterError for kappa < 0.
    """
    k = _coefficient(kappa)
    return np.asarray(np.where(k < 1, (1 + k) / np.where(k < 1, 1 - k, 1.0), np.inf))


def latent_efficiency(kappa: ArrayLike) -> Array:
    """eta_0 = (1 - kappa)/(1 + kappa): efficiency from one half to the other with the cage fixed; 0 if they lock.

    Errors: ParameterError for kappa < 0.
    """
    k = np.minimum(_coefficient(kappa), 1.0)
    return np.asarray((1 - k) / (1 + k))


def _coefficient(kappa: ArrayLike) -> Array:
    k = np.asarray(kappa, float)
    if not (k >= 0).all():
        raise ParameterError(f"kappa must be zero or positive, not {k[~(k >= 0)].ravel()[0]:g}: friction takes power")
    return k


def optimal_outer_angle(alpha_m: float, xi: float) -> float:
    """Eq. (41): the contact angle of the outer track that minimises the force on the disks for small angles with the sum alpha_m [rad].

    ``xi``: inner over outer diameter [1]. Errors: ParameterError unless both are positive and finite.
    """
    _check("optimal_outer_angle", ("alpha_m", alpha_m, " rad"), ("xi", xi, ""))
    return alpha_m / (1 + math.sqrt(xi))


def critical_angle(D_R: float, D_out: float, xi: float, mu: float) -> float:
    """Sum of both contact angles up to which a pair of tracks locks at the phase of eq. (41), for small angles and the rigid rule.

        D_R/D_out (1 + sqrt(xi))^2/(1 + xi^2) mu                               (42)

    It does not cover the phases at which one track carries alone; ``single_track_limit`` is stricter.

    Parameters
    ----------
    D_R : float
        Effective friction diameter of the discs [m].
    D_out : float
        Diameter of the outer track [m].
    xi : float
        Inner diameter relative to outer diameter [1].
    mu : float
        Coefficient of friction of the discs [1].

    Returns
    -------
    float
        The sum of the angles [rad].

    Raises
    ------
    ParameterError
        Unless diameters and ratio are positive and finite, and mu at least 0.
    """
    _check("critical_angle", ("D_R", D_R, " m"), ("D_out", D_out, " m"), ("xi", xi, ""), mu=mu)
    return D_R / D_out * (1 + math.sqrt(xi)) ** 2 / (1 + xi**2) * mu


def single_track_limit(D_R: float, D: float, mu: float) -> float:
    """Contact angle up to which a track of diameter D locks by itself: tan(alpha) = mu D_R/D [rad]; eq. (A5) where D_R = D.

    Errors: ParameterError unless the diameters are positive and finite, and mu at least 0.
    """
    _check("single_track_limit", ("D_R", D_R, " m"), ("D", D, " m"), mu=mu)
    return math.atan(mu * D_R / D)


def _check(function: str, *positive: tuple[str, float, str], mu: float = 0.0) -> None:
    for name, value, unit in positive:
        if not 0 < value < math.inf:
            raise ParameterError(f"{function}: {name} = {value:g}{unit} must be positive and finite")
    if not 0 <= mu < math.inf:
        raise ParameterError(f"{function}: mu = {mu:g} must be zero or positive, and finite")


@dataclass(frozen=True)
class Locking:
    """The result of ``locking``."""

    every_phase: bool
    """Whether it locks at every phase."""
    never: bool
    """Whether it locks at no phase."""
    least: float
    """Smallest kappa over all phases, including those at which one track carries alone."""
    theta: float
    """The phase of the smallest kappa [rad]."""
    interior: float
    """Smallest kappa over the phases at which both tracks carry, the case of eq. (37) and its minimum (42)."""
    theta_interior: float
    """The phase of the smallest interior kappa [rad]."""
    outer_alone: float
    """kappa where the outer track carries alone, at its maximum angle."""
    inner_alone: float
    """kappa where the inner track carries alone, at its maximum angle."""
    mu_interior: float
    """Coefficient of friction with which it locks at all phases at which both tracks carry."""
    mu_every_phase: float
    """Coefficient of friction with which it locks at every phase."""

    def __str__(self) -> str:
        answer = "at every phase" if self.every_phase else "at no phase" if self.never else "at some phases only"
        return (
            f"locks {answer}: least kappa {self.least:.3f} at theta = {math.degrees(self.theta):.1f} degrees "
            f"(both tracks: {self.interior:.3f}, outer alone: {self.outer_alone:.3f}, inner alone: {self.inner_alone:.3f}); "
            f"mu of {self.mu_every_phase:.4f} would lock it at every phase"
        )


def locking(cams: CircularCams, sharing: Sharing = "elastic", stiffness: float = 1.0) -> Locking:
    """Whether it locks at every phase, without friction in the grooves.

    With the rigid rule kappa grows without limit towards the phases at which one track's angle is zero. At these phases themselves the
    other track carries alone with any rule, and kappa is mu D_R/(D tan(alpha_max)) of that track.
    """
    mu, unit = cams.disk.mu, with_friction(cams, 1.0)
    half = math.pi / cams.outer.n
    inset = 1e-6 * half
    grid = np.linspace(inset, half - inset, _SAMPLES) - cams.outer.phase

    def per_mu(angle: ArrayLike) -> Array:
        return unit.kappa(angle, sharing, stiffness=stiffness)

    values = per_mu(grid)
    i = int(np.argmin(values))
    bounds = grid[max(i - 1, 0)], grid[min(i + 1, grid.size - 1)]
    found = minimize_scalar(lambda x: float(per_mu(x)), bounds=bounds, method="bounded", options={"xatol": 1e-12})
    interior, theta_interior = min((float(found.fun), float(found.x)), (float(values[i]), float(grid[i])))
    alone = [unit.disk.D_R / (track.D * math.tan(track.alpha_max)) for track in (cams.outer, cams.inner)]
    phases = [(interior, theta_interior)]
    if sharing != "averaged":
        phases += [(alone[0], half - cams.outer.phase), (alone[1], 0.0 - cams.outer.phase)]
    least, theta = min(phases)
    greatest = max(float(values.max()), *(k for k, _ in phases))
    return Locking(
        every_phase=mu * least >= 1,
        never=mu * greatest < 1,
        least=mu * least,
        theta=theta,
        interior=mu * interior,
        theta_interior=theta_interior,
        outer_alone=mu * alone[0],
        inner_alone=mu * alone[1],
        mu_interior=1 / interior,
        mu_every_phase=1 / least,
    )


def similar(cams: CircularCams, alpha_m: float) -> CircularCams:
    """The same differential with both tracks at the maximum contact angle alpha_m [rad], as eq. (38) assumes.

    The rollers keep their radii. Errors: ParameterError if such tracks are impossible.
    """
    outer, inner = (replace(track, alpha_max=alpha_m) for track in (cams.outer, cams.inner))
    return replace(cams, outer=outer, inner=inner)


def with_friction(cams: CircularCams, mu: float) -> CircularCams:
    """The same differential with another coefficient of friction of the disks."""
    return replace(cams, disk=replace(cams.disk, mu=mu))


def all_phase_limit(cams: CircularCams, sharing: Sharing = "elastic", *, interior: bool = False) -> float:
    """Largest angle alpha_m of similar tracks [rad] up to which they lock at every phase, with exact sines and tangents.

    If they lock even there, it is the steepest angle that can be built.
    ``interior``: only at phases where both tracks carry, the exact counterpart of eq. (42).
    """

    def excess(alpha_m: float) -> float:
        found = locking(similar(cams, alpha_m), sharing)
        return math.log(found.interior if interior else found.least)

    if cams.disk.mu == 0:
        return 0.0
    steepest = (1 - 1e-9) * min(steepest_angle(track.D, track.r, track.n) for track in (cams.outer, cams.inner))
    if excess(steepest) >= 0:
        return steepest
    lower = (
        single_track_limit(cams.disk.D_R, cams.outer.D, cams.disk.mu) / 2
    )  # even the outer track alone locks below twice that
    return float(brentq(excess, lower, steepest, xtol=1e-9 * lower))


def locking_map(
    cams: CircularCams, alpha_m: ArrayLike, mu: ArrayLike, sharing: Sharing = "elastic", *, interior: bool = False
) -> Array:
    """Smallest locking coefficient over the phases of similar tracks. They lock at every phase if it is at least 1.

    Parameters
    ----------
    cams : CircularCams
        The design on which the similar tracks are based.
    alpha_m : array_like
        Maximum contact angles [rad].
    mu : array_like
        Coefficients of friction of the discs [1].
    sharing : {"elastic", "rigid", "averaged"}
        How the tracks share the torque (``Sharing``).
    interior : bool
        Whether to consider only the phases at which both tracks carry.

    Returns
    -------
    numpy.ndarray
        One row per ``alpha_m``, one column per ``mu`` [1].

    Raises
    ------
    ParameterError
        For tracks that cannot be built, and for a negative coefficient of friction.
    """
    frictions = np.atleast_1d(np.asarray(mu, float))
    for each in frictions.ravel():
        _check("locking_map", mu=each)
    found = [locking(with_friction(similar(cams, float(a)), 1.0), sharing) for a in np.atleast_1d(alpha_m)]
    per_mu = np.array([each.interior if interior else each.least for each in found])
    return np.outer(per_mu, frictions)
