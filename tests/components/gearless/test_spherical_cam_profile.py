"""The spherical cam's profile: against the paper's equations, and against distances that know nothing of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.spherical_cam import (
    CamGeometry,
    SphericalCam,
    checks,
    clearance,
    pressure_angle_range,
)
from powertrain.components.gearless.spherical_cam.curves import turned

PAPER = SphericalCam(4, 5)
CAMS = [
    PAPER,
    SphericalCam(3, 4),
    SphericalCam(4, 6),
    SphericalCam(3, 6),
    SphericalCam(5, 4, alpha_3=math.radians(30), alpha_4=math.radians(16)),
    SphericalCam(4, 5, alpha_1=math.radians(75), alpha_3=math.radians(36), alpha_4=math.radians(15)),
]
IDS = [f"{cam.M}-{cam.N}-{math.degrees(cam.alpha_1):.0f}" for cam in CAMS]
each = pytest.mark.parametrize("cam", CAMS, ids=IDS)
TABLE_1 = {
    (3, 4): 0.63,
    (3, 5): 0.88,
    (3, 6): 1.02,
    (3, 7): 1.1,
    (4, 5): 0.52,
    (4, 6): 0.78,
    (4, 7): 0.92,
    (4, 8): 1.02,
}
"""Printed minima; (4, 7) corrected (printed: 1.01)."""


def strokes(cam: CamGeometry, points: int = 101) -> Any:
    low, high = cam.stroke
    return np.linspace(low, high, points)


def test_kinematics_of_equation_1() -> None:
    assert PAPER.phi(0.0) == pytest.approx(0.8 * math.pi)
    assert PAPER.phi(-math.pi / 4) == pytest.approx(
        math.pi
    )  # the middle of the stroke: roller nearest to the cam's axis
    rate = -4 / 5
    assert math.tan(PAPER.beta_1) == pytest.approx(
        rate * math.sin(PAPER.alpha_1) / (rate * math.cos(PAPER.alpha_1) - 1)
    )


@each
def test_axis_of_relative_rotation(cam: SphericalCam) -> None:
    """Where carrier and cam, each at its speed, move together."""
    relative = -cam.M / cam.N * cam.e_phi - np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(np.cross(relative, cam.e_e), 0, atol=1e-15)


@each
def test_profile_is_equation_4_turned(cam: SphericalCam) -> None:
    """The printed components, in their frame at -90 degrees about z, with the sign of sin(gamma) that changes in the middle."""
    psi = strokes(cam)
    beta_1, beta_4 = cam.beta_1, cam.beta_4(psi)
    beta_3, rest = beta_4 - cam.alpha_4, cam.alpha_1 - beta_1
    cos = (math.cos(cam.alpha_3) - math.cos(rest) * np.cos(beta_4)) / (math.sin(rest) * np.sin(beta_4))
    sin = np.sqrt(np.maximum(0, 1 - cos**2)) * np.sign(psi + cam.half)
    height = np.cos(beta_1) * cos * np.sin(beta_3) + np.sin(beta_1) * np.cos(beta_3)
    printed = [
        np.cos(psi) * sin * np.sin(beta_3) - np.sin(psi) * height,
        -np.sin(psi) * sin * np.sin(beta_3) - np.cos(psi) * height,
        -np.sin(beta_1) * cos * np.sin(beta_3) + np.cos(beta_1) * np.cos(beta_3),
    ]
    np.testing.assert_allclose(
        turned(cam.profile(psi), -math.pi / 2), np.stack(printed, -1), atol=1e-7
    )  # sqrt(1 - cos^2)
    in_its_frame = turned(cam.profile(cam.sigma), -math.pi / 2)
    assert abs(in_its_frame[0]) < 1e-12  # eq. (5): the first component, not the second


@each
def test_profile_is_closed_and_symmetric(cam: SphericalCam) -> None:
    low, high = cam.stroke
    assert low == pytest.approx(-cam.sigma - 2 * math.pi / cam.M)
    start, end = cam.profile(low), cam.profile(high)
    np.testing.assert_allclose(turned(end, 2 * cam.half), start, atol=1e-12)
    s = np.linspace(0, cam.half + cam.sigma, 50)
    there, back = (turned(cam.profile(sign * s - cam.half), -cam.half) for sign in (1, -1))
    np.testing.assert_allclose(back, there * [1, -1, 1], atol=1e-12)


@each
def test_envelope_by_distance(cam: SphericalCam) -> None:
    """The least distance of a roller's axis from the finely drawn cam is the roller's half-angle, at the computed contact."""
    profile = cam.whole_profile(8001)
    for psi in strokes(cam, 23)[1:-1]:
        distance = np.arccos(profile @ cam.pitch_curve(psi))
        nearest = int(distance.argmin())
        assert distance[nearest] == pytest.approx(cam.alpha_4, abs=1e-7)
        assert (
            np.linalg.norm(profile[nearest] - cam.profile(psi)) < 2e-3
        )  # a step of the drawn profile, flat near the minimum
        np.testing.assert_allclose(np.linalg.norm(cam.profile(psi)), 1)


@each
def test_all_rollers_of_both_cams_clear_and_one_always_drives(cam: SphericalCam) -> None:
    """In the fixed frame, both conjugate pairs turned by their ratio: no roller cuts in, and each way one touches that can push."""
    outline = cam.whole_profile(1501)
    for psi in np.linspace(-2 * cam.half, 0, 25):
        pushes = set()
        for own in (psi, psi - cam.half):
            placed = turned(outline, own)
            for k in range(cam.N):
                axis = cam.roller_axis(own, k)
                cosines = placed @ axis
                gap = np.arccos(cosines.max()) - cam.alpha_4
                assert gap > -1e-9
                if gap < 2e-6:  # touches, up to the chain of points
                    side = np.cross(placed[int(cosines.argmax())], axis)  # along c x n
                    pushes.add(int(np.sign(round(float(side @ cam.e_phi), 3))))
        assert {-1, 1} <= pushes


def test_phases_of_the_conjugate_cams() -> None:
    """Turned by pi/M on the cam is turned by pi/N on the carrier."""
    assert PAPER.phi(-0.3 - PAPER.half) - PAPER.phi(-0.3) == pytest.approx(math.pi / PAPER.N)
    np.testing.assert_allclose(PAPER.roller_axis(0.1, 1), PAPER.roller_axis(0.1 - 2 * PAPER.half), atol=1e-15)


@each
def test_contact_slides_along_the_profile_only(cam: SphericalCam) -> None:
    """No relative speed along the normal; the profile's speed is what differences say."""
    psi, h = strokes(cam), 1e-6
    relative = -cam.M / cam.N * cam.e_phi - np.array([0.0, 0.0, 1.0])
    normal = cam.roller_axis(psi) - cam.contact(psi) * math.cos(cam.alpha_4)
    np.testing.assert_allclose((np.cross(relative, cam.contact(psi)) * normal).sum(-1), 0, atol=1e-13)
    motion = np.linalg.norm(cam.profile(psi + h) - cam.profile(psi - h), axis=-1) / (2 * h)
    np.testing.assert_allclose(-cam.profile_speed(psi), motion, rtol=1e-7)


@each
def test_pressure_angles_are_one_by_virtual_work(cam: SphericalCam) -> None:
    """The same normal force: sin(alpha_3) cos(mu_p) phi' on the carrier is sin(angle of the contact) cos(mu_n) psi' on the cam."""
    psi = strokes(cam)
    lever = np.linalg.norm(cam.contact(psi)[:, :2], axis=-1)
    on_carrier = math.sin(cam.alpha_3) * np.cos(cam.pressure_angle_p(psi)) * cam.M / cam.N
    on_cam = -lever * np.cos(cam.pressure_angle_n(psi))  # the reaction
    np.testing.assert_allclose(on_carrier, on_cam, atol=1e-12)
    a_phi, a_psi = cam.lever_arms(psi)
    np.testing.assert_allclose(-a_phi * cam.M / cam.N, on_carrier, atol=1e-12)
    np.testing.assert_allclose(a_psi, on_cam, atol=1e-12)


def test_pressure_angle_is_smooth_where_the_paper_s_form_is_0_over_0() -> None:
    """beta_3 = 0 on the (3, 4) cam: e_c = e_e, and e_e x e_c vanishes."""
    cam = SphericalCam(3, 4)
    psi = np.linspace(-cam.half, 0, 20_001)[1:]
    at = int(np.abs(cam.beta_4(psi) - cam.alpha_4).argmin())
    assert abs(cam.beta_4(psi[at]) - cam.alpha_4) < 1e-4
    assert np.abs(np.diff(cam.pressure_angle_n(psi[at - 5 : at + 5]), 2)).max() < 1e-6


@pytest.mark.parametrize(("M", "N"), TABLE_1)
def test_minima_of_table_1(M: int, N: int) -> None:
    """alpha_3 = 44, alpha_4 = 19 degrees: to 0.01 rad; "1.1" has one digit."""
    printed = TABLE_1[M, N]
    assert pressure_angle_range(CamGeometry(M, N))[0] == pytest.approx(printed, abs=0.025 if printed == 1.1 else 0.01)


@pytest.mark.parametrize("M", [3, 4])
def test_as_many_lobes_as_rollers_have_no_pressure_angle(M: int) -> None:
    """As printed: 0 rad. With alpha_3 = 44 the pitch curve is one degree from its cusp."""
    cam = CamGeometry(M, M)
    assert pressure_angle_range(cam)[0] < 1e-4
    assert np.degrees(cam.beta_4(-cam.half)) == pytest.approx(1.0)


def test_maxima_of_table_1_are_not_reproducible() -> None:
    """Printed for {4, 5}: 0.57 rad. The curves of both conjugate cams intersect at 0.71 rad; those of one cam not at all."""
    least, most = pressure_angle_range(PAPER)
    assert least == pytest.approx(0.525, abs=1e-3)
    assert most == pytest.approx(0.713, abs=1e-3)
    assert pressure_angle_range(CamGeometry(3, 3))[1] == pytest.approx(0.6946124, abs=1e-7)  # steep: a grid says 0.6957
    beyond = PAPER.stroke[1] + 1e-3  # the stroke of one cam ends before the next one has begun to push
    assert beyond < PAPER.half


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"M": 2}, "M = 2 lobes must be a whole number of at least 3"),
    ({"N": 0}, "N = 0 rollers must be a whole number of at least 3"),
    ({"M": 4.5}, "M = 4.5 is not an integer"),
    ({"N": True}, "N = True is not an integer"),
    ({"N": 4}, "M = N = 4.*pressure angle vanish"),
    ({"alpha_1": math.radians(100)}, r"alpha_1 = 100° must lie in \(0°, 90°\]"),
    ({"alpha_3": -0.1}, r"alpha_3 = -5.73° must lie in \(0°, 90°\)"),
    ({"alpha_3": math.nan}, "alpha_3 = nan° must lie in"),
    (
        {"alpha_3": math.radians(52)},
        "alpha_3 = 52° must be less than alpha_1 - beta_1 = 51.34°.*cusps, beyond it loops",
    ),
    ({"alpha_4": 0.0}, r"alpha_4 = 0° must lie in \(0°, 24.1°\)"),
    ({"N": 7}, r"alpha_4 = 19° must lie in \(0°, 17.54°\): beyond it two of 7 rollers at alpha_3 overlap"),
    (
        {"M": 3, "N": 5, "alpha_3": math.radians(58.5), "alpha_4": math.radians(29.9)},
        r"at sigma = -59.89°, and it must be beyond 0°",
    ),
    ({"alpha_3": math.radians(50.5)}, "undercut: it has a cusp at psi = -32.93°.*alpha_4 = 19°"),
    ({"alpha_3": math.radians(51), "alpha_4": math.radians(5)}, "symmetry never.*gap between the strokes"),
    (
        {"M": 3, "N": 8, "alpha_3": math.radians(69), "alpha_4": math.radians(20.9)},
        "undercut: it has a cusp at psi = -50.7",
    ),
]


@pytest.mark.parametrize(("given", "said"), REFUSED, ids=[str(given) for given, _ in REFUSED])
def test_what_cannot_be_built_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        SphericalCam(**{"M": 4, "N": 5, **given})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"M": 0}, r"CamGeometry\(M=0, N=5\): M = 0 lobes must be"),
        ({"N": 2.5}, r"N = 2\.5 is not an integer"),
        ({"alpha_4": math.radians(91)}, r"alpha_4 = 91° must lie in \(0°, 90°\]"),
        ({"alpha_3": math.nan}, "alpha_3 = nan°"),
    ],
)
def test_no_geometry_at_all(given: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        CamGeometry(**{"M": 4, "N": 5, **given})
    with pytest.raises(pt.ParameterError, match="undercut"):
        CamGeometry(4, 5, alpha_3=math.radians(50.5)).whole_profile()
    with pytest.raises(pt.ParameterError, match=r"CamGeometry\(M=4, N=4\): M = N = 4.*pressure angle vanish"):
        CamGeometry(4, 4).whole_profile()


@pytest.mark.parametrize("alpha_3", [49.0, 50.0, 50.25, 50.5, 50.9])
def test_undercut_is_a_profile_that_turns_back(alpha_3: float) -> None:
    """Independent of the formula: two steps of the profile with an obtuse angle between them are a cusp."""
    cam = CamGeometry(4, 5, alpha_3=math.radians(alpha_3))
    steps = np.diff(cam.profile(np.linspace(-cam.half, cam.sigma, 20_001)), axis=0)
    turns_back = bool(((steps[1:] * steps[:-1]).sum(-1) < 0).any())
    assert turns_back == bool(cam.profile_speed(np.linspace(-cam.half, cam.sigma, 2001)).max() >= 0)
    if turns_back:
        with pytest.raises(pt.ParameterError, match="undercut"):
            checks.check_profile(cam)
    else:
        checks.check_profile(cam)


def test_double_points_are_found() -> None:
    """An undercut profile crosses itself beside its cusps, in its plane of symmetry and beside it; a good one nowhere."""
    for cam in CAMS:
        assert checks.double_points(cam).size == 0
    undercut = CamGeometry(4, 5, alpha_3=math.radians(50.5))
    assert checks.cusps(undercut).size
    pairs = checks.double_points(undercut)
    assert len(pairs) >= 1
    step = (undercut.stroke[1] - undercut.stroke[0]) / 599
    for one, other in pairs:
        there, back = undercut.profile([one, other])
        assert np.linalg.norm(there - back) < 4 * step


def test_double_points_are_refused() -> None:
    class Smooth(CamGeometry):
        def profile_speed(self, psi: Any) -> Any:
            return -np.ones(np.shape(psi))  # let the cusps pass

    with pytest.raises(pt.ParameterError, match=r"double point: it crosses itself at psi = -.*° and -"):
        checks.check_profile(Smooth(4, 5, alpha_3=math.radians(50.5)))


def test_a_roller_that_cuts_in_is_found() -> None:
    """The profile of a smaller roller with a larger one."""

    class Thick(CamGeometry):
        def valleys(self, points: int = 361) -> Any:
            return SphericalCam(4, 5, alpha_4=math.radians(18)).valleys(points)

    assert clearance(PAPER) == pytest.approx(0, abs=1e-12)
    assert clearance(Thick(4, 5)) == pytest.approx(-math.radians(1), abs=1e-6)
    with pytest.raises(pt.ParameterError, match=r"a roller cuts 1° into a lobe"):
        checks.check_profile(Thick(4, 5))
