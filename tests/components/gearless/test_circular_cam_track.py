"""Circular-arc cam tracks: Theorem 1 of Provatidis 2023, rolling without slip by arc length, closed tracks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.circular_cam import TABLE_1, CircularCams, FrictionDisk, Track
from powertrain.components.gearless.circular_cam.track import steepest_angle

OUTER, INNER = TABLE_1.outer, TABLE_1.inner
TRACKS = [
    OUTER,
    INNER,
    Track(0.1, 0.012, math.radians(40), n=6),
    Track(0.06, 0.01, math.radians(5), n=2, phase=math.pi / 2),
]
EIGHTHS = np.arange(9) * np.pi / 8


def numeric(f: Any, x: Any, h: float = 1e-6) -> Any:
    return (f(x + h) - f(x - h)) / (2 * h)


@pytest.mark.parametrize("track", TRACKS)
def test_rollers_touch_both_cams_and_do_not_slip(track: Track) -> None:
    """The contact points wander along both cams as far as along the roller, arc lengths integrated from the printed points (11), (12)."""
    theta = np.linspace(0.001, 0.999, 4001) * math.pi / track.n - track.phase
    x, upper, lower = track.contacts(theta)
    y, shift = track.axis(theta), theta * track.D / 2
    for roller_x, height in ((x, upper), (x, lower)):
        np.testing.assert_allclose(np.hypot(roller_x, height - y), track.r, rtol=1e-12)
    turned = track.turned(theta)
    # In the frame of a cam its contact point runs along its surface, in the frame of the roller along its rim.
    for cam, height in ((1, upper), (-1, lower)):
        on_cam = np.hypot(np.diff(x - cam * shift), np.diff(height))
        angle = np.unwrap(np.arctan2(height - y, x)) + turned
        np.testing.assert_allclose(on_cam, np.abs(track.r * np.diff(angle)), rtol=1e-6)
    np.testing.assert_allclose(numeric(track.turned, theta[5:-5]), track.spin(theta[5:-5]), rtol=1e-7)
    np.testing.assert_allclose(numeric(track.axis, theta[5:-5]), track.climb(theta[5:-5]), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("track", TRACKS)
def test_speeds_of_both_surfaces_at_the_contacts(track: Track) -> None:
    """Velocity of the roller at A is that of the upper cam (+V, 0), at B that of the lower (-V, 0): eqs. (1), (3), (4), (6)."""
    theta = np.linspace(-3, 3, 401)
    V = track.D / 2
    for roller in range(track.n):
        x, upper, lower = track.contacts(theta, roller)
        y, omega, climb = track.axis(theta, roller), track.spin(theta), track.climb(theta, roller)
        for height, speed in ((upper, V), (lower, -V)):
            np.testing.assert_allclose(omega * (height - y), speed, rtol=1e-12)
            np.testing.assert_allclose(climb - omega * x, 0, atol=1e-12)
        # Eq. (14): the pole, where the roller has no speed, lies at the contacts' x and at the axis' height.
        np.testing.assert_allclose(x, climb / omega, atol=1e-12)


@pytest.mark.parametrize("track", TRACKS)
def test_rollers_go_on_turning_from_arc_to_arc(track: Track) -> None:
    theta = np.linspace(-3, 3, 200_001)
    spin = track.spin(theta)
    whole = np.concatenate([[0.0], np.cumsum((spin[1:] + spin[:-1]) / 2 * np.diff(theta))])
    np.testing.assert_allclose(track.turned(theta) - track.turned(-3.0), whole, atol=1e-6 * whole[-1])


def test_theorem_1_in_the_paper_s_coordinates() -> None:
    """Eqs. (2), (10)-(15), with the origin in the common centre of the arcs, parts 2 to 5 of the theorem."""
    R, r, alpha_max = OUTER.R_m, OUTER.r, OUTER.alpha_max
    delta = np.linspace(0, R * math.sin(alpha_max) * (1 - 1e-12), 50)
    theta = 2 * delta / OUTER.D
    sin, cos = delta / R, np.sqrt(1 - (delta / R) ** 2)
    x, upper, lower = OUTER.contacts(theta)
    centre = -R * math.cos(alpha_max)  # the paper's origin lies this far over the mean height, for a valley
    np.testing.assert_allclose(OUTER.alpha(theta), np.arcsin(sin), atol=1e-12)
    np.testing.assert_allclose(OUTER.axis(theta) + centre, -R * cos)
    np.testing.assert_allclose(x, r * sin, atol=1e-15)
    np.testing.assert_allclose(upper + centre, (r - R) * cos)
    np.testing.assert_allclose(lower + centre, -(R + r) * cos)
    np.testing.assert_allclose((x / r) ** 2 + ((OUTER.axis(theta) + centre) / R) ** 2, 1)
    assert OUTER.alpha(math.pi / 4) == pytest.approx(alpha_max)  # part 5: the ends of both arcs meet
    assert 2 * R * math.sin(alpha_max) == pytest.approx(math.pi * OUTER.D / 4)


@pytest.mark.parametrize("track", TRACKS)
def test_track_closes_with_reversed_curvature(track: Track) -> None:
    """Height and slope are continuous around the circle, the curvature is +-1/R_m with n changes of sign."""
    around = math.pi * track.D
    x = np.linspace(0, around, 200 * track.n + 1)
    y, slope = track.pitch(x)
    assert y[0] == pytest.approx(y[-1], abs=1e-12)
    assert slope[0] == pytest.approx(slope[-1], abs=1e-9)
    assert np.abs(np.diff(slope)).max() < 0.02 * math.pi / track.n * 4
    np.testing.assert_allclose(np.diff(y), np.tan((slope[1:] + slope[:-1]) / 2) * np.diff(x), atol=1e-5 * track.lift)
    ends = (2 * np.arange(track.n) + 1) * around / (2 * track.n) - track.phase * track.D / 2
    before, after = ends - 1e-4 * around / track.n, ends + 1e-4 * around / track.n
    for points, sign in ((before, 1), (after, -1)):
        second = numeric(lambda x: np.sin(track.pitch(x)[1]), points, 1e-9 * around)
        np.testing.assert_allclose(second * (-1.0) ** np.arange(track.n) * sign, 1 / track.R_m, rtol=1e-3)
    assert y.max() - y.min() == pytest.approx(track.lift, rel=1e-3)
    for side in (1, -1):
        surface = np.array(track.surface(x, side))
        np.testing.assert_allclose(np.hypot(*(surface - [x, y])), track.r)


def test_every_roller_lies_on_both_cams_all_around() -> None:
    """The lower cam turned by -theta and the upper, its mirror image, by theta: the pitch curves meet in every groove."""
    for track in TRACKS:
        for theta in np.linspace(-4, 4, 37):
            groove = np.arange(track.n) * math.pi * track.D / track.n
            lower = track.pitch(groove + theta * track.D / 2)[0]
            upper = track.pitch(-(groove - theta * track.D / 2))[0]
            np.testing.assert_allclose(lower, upper, atol=1e-12)
            np.testing.assert_allclose(lower, track.axis(theta, np.arange(track.n)), atol=1e-12)


def test_active_rollers_of_figure_15() -> None:
    rollers = np.arange(4)
    for drive in (1.0, -1.0):
        counts = [sum(int(t.active(theta, rollers, drive).sum()) for t in (OUTER, INNER)) for theta in EIGHTHS]
        assert counts == [2, 4, 2, 4, 2, 4, 2, 4, 2]
    for theta in np.linspace(0.1, 6, 50):
        for track in (OUTER, INNER):  # either rollers 1 and 3, or 2 and 4, and the others where the torque is reversed
            forward = track.active(theta, rollers)
            assert tuple(forward) in {(True, False, True, False), (False, True, False, True)}
            assert (forward != track.active(theta, rollers, -1.0)).all()


def test_wedges_narrow_where_the_cage_pushes() -> None:
    """Fig. 6: a small step ahead of the cage between held cams closes the gap of its active rollers, and opens that of the others."""
    for track in (OUTER, INNER):
        for theta in (0.3, 0.6, 1.1, 2.0):
            for roller in range(4):
                groove, step = roller * math.pi * track.D / 4, 1e-7
                lower = numeric(lambda x, t=track, a=theta: t.pitch(x + a * t.D / 2)[0], groove, step)
                upper = numeric(lambda x, t=track, a=theta: t.pitch(-(x - a * t.D / 2))[0], groove, step)
                assert (lower - upper > 0) == track.active(theta, roller)
                assert abs(lower - upper) == pytest.approx(2 * math.tan(track.alpha(theta)), rel=1e-5)


def test_phases_of_the_tracks() -> None:
    """Half an arc apart: one level where the other is steepest (8.5); the picture repeats after half a turn."""
    np.testing.assert_allclose(np.degrees(OUTER.alpha(EIGHTHS[::2])), [0, 15, 0, 15, 0], atol=1e-12)
    np.testing.assert_allclose(np.degrees(INNER.alpha(EIGHTHS[::2])), [27.25, 0, 27.25, 0, 27.25], atol=1e-12)
    theta = np.linspace(-2, 2, 101)
    for track in (OUTER, INNER):
        np.testing.assert_allclose(track.axis(theta), track.axis(theta + math.pi), atol=1e-12)
        np.testing.assert_allclose(track.alpha(theta), track.alpha(theta + math.pi / 2), atol=1e-9)
    quarter = OUTER.alpha(np.pi / 8), INNER.alpha(np.pi / 8)  # 8.5: about a quarter of the central angle is swept
    assert np.degrees(quarter) == pytest.approx([15 / 2, 27.25 / 2], rel=0.03)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"alpha_max": 0.0}, r"alpha_max = 0 degrees is outside \(0, 90\)"),
        ({"alpha_max": math.radians(95)}, "alpha_max = 95 degrees"),
        ({"alpha_max": math.nan}, "alpha_max = nan"),
        ({"n": 3}, "n = 3 arcs: the curvature changes its sign .* even"),
        ({"n": 0}, "n = 0"),
        ({"n": 4.0}, "n = 4.0 is not an integer"),
        ({"D": -0.1}, "D = -0.1 m must be positive"),
        ({"r": 0.0}, "r = 0 m must be positive"),
        ({"r": 0.031}, "r = 0.031 m touch each other: .* r must be less than 0.03005 m"),
        ({"phase": math.inf}, "phase = inf"),
        (
            {"alpha_max": math.radians(60)},
            r"the lift of 0\.03854 m leaves no gap .* take alpha_max = 60 below 48\.4 degrees",
        ),
    ],
)
def test_tracks_that_cannot_be_are_refused(change: dict[str, Any], message: str) -> None:
    given = {"D": 0.085, "r": 0.015, "alpha_max": math.radians(15), **change}
    with pytest.raises(pt.ParameterError, match=message):
        Track(**given)


@pytest.mark.parametrize("n", [2, 4, 6, 20])
def test_rollers_that_fit_do_not_undercut(n: int) -> None:
    r = 0.05 * math.sin(math.pi / n) * 0.9999
    for alpha_max in (0.01, 0.9, steepest_angle(0.1, r, n) - 1e-9):
        track = Track(0.1, r, alpha_max, n)
        assert track.R_m > track.r


def test_cams_of_the_steepest_track_touch_where_hills_meet() -> None:
    """Gap of both surfaces from their points, over all phases."""
    steepest = steepest_angle(0.085, 0.015, 4)
    for share in (0.7, 1 - 1e-12):
        track = Track(0.085, 0.015, share * steepest)
        x = np.linspace(0, math.pi * track.D, 4001)
        lower, upper = track.surface(x, -1), track.surface(x, 1)
        gaps = []
        for theta in np.linspace(0, math.pi / 4, 46):
            at, height = track.D * theta - upper[0], upper[1]  # mirrored, and turned by 2 theta against the lower cam
            order = np.argsort(at)
            gaps.append((np.interp(lower[0], at[order], height[order], period=math.pi * track.D) - lower[1]).min())
        assert min(gaps) == pytest.approx(2 * track.r - track.lift, abs=2e-5)
    assert steepest == pytest.approx(math.radians(48.37), abs=1e-3)


def cams(outer: Track = OUTER, inner: Track = INNER) -> CircularCams:
    return CircularCams(outer, inner, TABLE_1.disk)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: cams(outer=Track(0.049, 0.012, 0.2)),
            "inner track's diameter 0.05 m must be less than the outer track's 0.049 m",
        ),
        (lambda: cams(inner=Track(0.05, 0.01, 0.4, n=2, phase=math.pi / 4)), "tracks have 4 and 2 arcs"),
        (lambda: cams(inner=Track(0.05, 0.012, 0.4)), "leads by 0 degrees; it must be half an arc, 45 degrees"),
        (lambda: FrictionDisk(0.045, 0.095, 0.1), r"d_in = 0.095 m and d_out = 0.045 m: .* 0 <= d_in < d_out"),
        (lambda: FrictionDisk(0.095, 0.045, -0.1), "mu = -0.1"),
        (
            lambda: cams(outer=Track(0.0505, 0.012, 0.2), inner=replace(INNER, D=0.05)),
            r"leave slices of 0\.00025 m to rollers of radius 0\.012 m; they need 0\.2 of it",
        ),
        (lambda: TABLE_1.kappa(0.1, mu_groove=-0.5), r"mu_groove = -0\.5 must be zero or positive"),
        (lambda: TABLE_1.kappa(0.1, stiffness=-1), "stiffness = -1, inner over outer contact, must be positive"),
        (lambda: TABLE_1.share(0.1, stiffness=0), "stiffness = 0"),
        (lambda: FrictionDisk(0.095, 0.045, 0.1, "even"), "uniform = 'even' is not one of pressure, wear"),  # type: ignore[arg-type]
    ],
)
def test_designs_that_cannot_be_are_refused(make: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        make()
