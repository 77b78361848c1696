"""Checks of a spherical cam: numbers, angles, cusps, double points, gaps, interference."""

from __future__ import annotations

import math

import numpy as np

from powertrain import ParameterError
from powertrain.components.gearless.spherical_cam.curves import FINE, Array, CamCurves

LEAST = 3
"""Minimum number of lobes or rollers for separate strokes."""
TOUCH = 1e-9
"""Interference of roller and profile within round-off [rad]."""


def check_numbers(cam: CamCurves) -> None:
    """Reject numbers without any geometry. Errors: ParameterError."""
    _check_counts(cam)
    for name in ("alpha_1", "alpha_3", "alpha_4"):
        _between(cam, name, 0.0, math.pi / 2, "it is an angle between crossing axes, or of a cone")


def _check_counts(cam: CamCurves) -> None:
    for name, value, what in (("M", cam.M, "lobes"), ("N", cam.N, "rollers")):
        if value < LEAST:
            raise _refused(cam, f"{name} = {value} {what} must be a whole number of at least {LEAST}")


def check_angles(cam: CamCurves) -> None:
    """Reject numbers and angles before anything is computed. Errors: ParameterError."""
    _check_counts(cam)
    _check_pressure(cam)
    _between(cam, "alpha_1", 0.0, math.pi / 2, "the axes of cam and carrier cross at an angle of at most 90°")
    _between(
        cam, "alpha_3", 0.0, cam.alpha_1, "the roller's axis lies between the axes of carrier and cam", open_end=True
    )
    rolling = cam.alpha_1 - cam.beta_1
    if cam.alpha_3 >= rolling:
        raise _refused(
            cam,
            f"alpha_3 = {_deg(cam.alpha_3)} must be less than alpha_1 - beta_1 = {_deg(rolling)}: at that angle the pitch curve has "
            "cusps, beyond it loops",
        )
    apart = math.asin(math.sin(cam.alpha_3) * math.sin(math.pi / cam.N))
    _between(cam, "alpha_4", 0.0, apart, f"beyond it two of {cam.N} rollers at alpha_3 overlap", open_end=True)
    if cam.alpha_3 + cam.alpha_4 >= math.pi / 2:
        total = _deg(cam.alpha_3 + cam.alpha_4)
        raise _refused(cam, f"alpha_3 + alpha_4 = {total} must be less than 90°: rollers of both carriers meet there")


def _check_pressure(cam: CamCurves) -> None:
    if cam.M == cam.N:
        raise _refused(
            cam,
            f"M = N = {cam.M}: as many lobes as rollers make the pressure angle vanish and the pitch curve nearly a cusp; change one",
        )


def check_cut(cam: CamCurves) -> None:
    """Reject a profile that cannot drive, does not close, or is undercut. Errors: ParameterError."""
    _check_pressure(cam)
    sigma = cam.sigma
    if not sigma > 0:
        end = "never" if math.isnan(sigma) else f"at sigma = {_deg(sigma)}"
        raise _refused(
            cam,
            f"the profile reaches the lobe's plane of symmetry {end}, and it must be beyond 0°: otherwise there is a gap "
            "between the strokes of the conjugate cams",
        )
    if (found := cusps(cam)).size:
        raise _refused(
            cam,
            f"the profile is undercut: it has a cusp at psi = {_deg(float(found[0]))}, where the roller's half-angle alpha_4 = "
            f"{_deg(cam.alpha_4)} is larger than the radius of curvature of the pitch curve; take smaller rollers, or a smaller alpha_3",
        )


def check_profile(cam: CamCurves) -> None:
    """Reject a cam that cannot be cut or does not keep contact. Errors: ParameterError."""
    check_cut(cam)
    if (crossings := double_points(cam)).size:
        said = " and ".join(_deg(float(psi)) for psi in crossings[0])
        raise _refused(
            cam,
            f"the profile has a double point: it crosses itself at psi = {said}, so cutting at one of them removes material at the other",
        )
    if (cut := -clearance(cam)) > TOUCH:
        raise _refused(
            cam, f"a roller cuts {_deg(cut)} into a lobe; no part of the profile may be nearer to its axis than alpha_4"
        )


def cusps(cam: CamCurves) -> Array:
    """Cam angles after the middle of a stroke at which the profile turns back [rad]; those before it are their mirror images.

    The profile's speed (see ``CamCurves.profile_speed``) changes sign there. The search extends to the lobe's tip, sigma, or to pi/M if
    the profile does not reach the tip.
    """
    psi = np.linspace(-cam.half, _end(cam), FINE)
    back = cam.profile_speed(psi) >= 0
    at = np.flatnonzero(back[1:] != back[:-1])
    found = psi[at + 1]
    return np.concatenate([psi[:1], found]) if back[0] else found


def double_points(cam: CamCurves, points: int = 400) -> Array:
    """Pairs of cam angles at which one valley of the profile intersects itself, one row each [rad], accurate to a segment of the polygon.

    The polygon is projected from the pole at -z, and all pairs of segments are tested. The tip, where two valleys meet, is not included.
    """
    psi = np.linspace(-2 * cam.half - _end(cam), _end(cam), points)
    x, y, z = cam.profile(psi).T
    place = np.stack([x, y]) / (1 + z)
    start, step = place[:, :-1], np.diff(place, axis=1)
    between = start[:, None, :] - start[:, :, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        area = _cross(step[:, :, None], step[:, None, :])
        along, other = _cross(between, step[:, None, :]) / area, _cross(between, step[:, :, None]) / area
    i, j = np.nonzero((along >= 0) & (along < 1) & (other >= 0) & (other < 1))
    apart = j > i + 1
    return np.stack([psi[i[apart]], psi[j[apart]]], axis=-1)


def _end(cam: CamCurves) -> float:
    return cam.half if math.isnan(cam.sigma) else cam.sigma - 1e-9


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def clearance(cam: CamCurves, points: int = 241, positions: int = 60) -> float:
    """Smallest distance of any of the N rollers from the whole profile, over one turn of the carrier [rad]; 0 if they just touch.

    All N rollers over one stroke are equivalent to one roller over N strokes, and by symmetry over half of them.
    """
    psi = -cam.half + np.linspace(0.0, cam.N * cam.half, cam.N * positions + 1)
    nearest = (cam.pitch_curve(psi) @ cam.valleys(points).T).max(axis=1)
    return float(np.arccos(np.clip(nearest, -1, 1)).min()) - cam.alpha_4


def _between(cam: CamCurves, name: str, low: float, high: float, reason: str, *, open_end: bool = False) -> None:
    value = float(getattr(cam, name))
    if not (low < value < high or (value == high and not open_end)):
        bracket = ")" if open_end else "]"
        raise _refused(cam, f"{name} = {_deg(value)} must lie in (0°, {_deg(high)}{bracket}: {reason}")


def _refused(cam: CamCurves, why: str) -> ParameterError:
    return ParameterError(f"{type(cam).__name__}(M={cam.M}, N={cam.N}): {why}")


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):.4g}°"
