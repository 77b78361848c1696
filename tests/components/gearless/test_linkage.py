"""Motion, bend and masses of the linkage: the source's numbers, its formulas, and what must hold at every angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.linkage import (
    CORRECTED,
    TABLE_5_1,
    Linkage,
    cage_turns,
    cylinder,
    cylinder_mass,
    in_bend,
    ratio_from_theta,
    scaled,
    wheel_velocities,
)
from powertrain.components.gearless.linkage.kinematics import closed_loop
from powertrain.components.gearless.linkage.masses import CYLINDERS, GRAM_CM2, inertia

THESIS = Linkage(0.03, 0.06)
LINKAGES = [THESIS, Linkage(0.03, 0.0151), Linkage(0.03, 0.5), Linkage(0.03, 0.06, 0.004), Linkage(0.1, 0.06, -0.03)]
ALPHA = np.linspace(-7, 7, 1401)


def test_printed_angles() -> None:
    """Lever +-0.5 rad and +-3 cm (5.1.2); a/b = 0.5176 for 30 degrees (6.4)."""
    m = THESIS.motion(ALPHA)
    assert round(THESIS.theta_max, 1) == 0.5
    assert np.abs(m.theta).max() == pytest.approx(
        THESIS.theta_max, abs=1e-5
    )  # the grid misses 90 degrees by up to 0.005 rad
    assert np.abs(m.S).max() == pytest.approx(0.03, rel=1e-15)
    assert round(ratio_from_theta(np.radians(30)), 4) == 0.5176
    assert np.arccos(1 - 0.5**2 / 2) == pytest.approx(THESIS.theta_max)


def test_start_of_the_thesis() -> None:
    """At alpha = 0: beta = 0, theta = 0, S = a."""
    m = THESIS.motion(0.0)
    assert (float(m.beta), float(m.theta), float(m.S)) == (0.0, 0.0, 0.03)


@pytest.mark.parametrize("linkage", LINKAGES, ids=str)
def test_the_loop_is_closed(linkage: Linkage) -> None:
    """Coupler and lever keep their lengths, and their common end is the same point by (5.15)-(5.17) and (5.18)-(5.20)."""
    m, p = linkage.motion(ALPHA), linkage.points(ALPHA)
    for side in "left", "right":
        coupler, lever = (np.linalg.norm(p[f"S_{side}"] - p[end], axis=-1) for end in (f"R_{side}", "C"))
        np.testing.assert_allclose(coupler, linkage.a, rtol=1e-13)
        np.testing.assert_allclose(lever, linkage.b, rtol=1e-13)
    a = linkage.a
    along = [a * np.sin(m.beta), a * np.cos(ALPHA) * np.cos(m.beta), a * np.sin(ALPHA) * np.cos(m.beta)]
    np.testing.assert_allclose(p["S_left"] - p["R_left"], np.transpose(along), atol=1e-15)


@pytest.mark.parametrize("k", [0.01, 0.5, 1.0, 1.99])
def test_smooth_forms_without_offset(k: float) -> None:
    """sin(theta/2) = k s/sqrt(2 (1 + D)), sin(beta) = k s^2/(1 + D), S = a c cos(beta), S^2 + 4 b^2 sin(theta/2)^2 = a^2."""
    linkage = Linkage(k * 0.06, 0.06)
    m, s, c = linkage.motion(ALPHA), np.sin(ALPHA), np.cos(ALPHA)
    D = np.sqrt(1 - (k * s * c) ** 2)
    np.testing.assert_allclose(np.sin(m.theta / 2), k * s / np.sqrt(2 * (1 + D)), atol=2e-15)
    np.testing.assert_allclose(np.sin(m.beta), k * s**2 / (1 + D), atol=2e-15)
    np.testing.assert_allclose(m.S, linkage.a * c * np.cos(m.beta), rtol=1e-12)
    invariant = m.S**2 + 4 * linkage.b**2 * np.sin(m.theta / 2) ** 2
    np.testing.assert_allclose(invariant, linkage.a**2, rtol=1e-12)


def test_printed_formulas_where_they_hold() -> None:
    """(5.30), (5.39) away from 0, 90 and 180 degrees; at 90 degrees (5.38) has no digits left."""
    alpha = np.array([0.3, 1.0, 2.0, 2.7])
    s, c, k = np.sin(alpha), np.cos(alpha), 0.5
    theta = np.arccos((-(s**2) + np.sqrt(1 - (k * s * c) ** 2)) / c**2)
    m = THESIS.motion(alpha)
    np.testing.assert_allclose(m.theta, theta, rtol=1e-13)
    np.testing.assert_allclose(m.S, 0.06 * np.sin(theta) / np.tan(alpha), rtol=1e-13)
    near = np.pi / 2 - 1e-8
    s, c = np.sin(near), np.cos(near)
    printed = (-(s**2) + np.sqrt(1 - (k * s * c) ** 2)) / c**2
    exact = 1 - k**2 / 2
    assert abs(printed - exact) > 0.1
    assert np.cos(THESIS.motion(near).theta) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize("linkage", LINKAGES, ids=str)
def test_derivatives(linkage: Linkage) -> None:
    """First and second derivatives against differences of fourth order; relative to the sharpest change."""
    h, m = 1e-3, linkage.motion(ALPHA)
    for name in "theta", "beta", "S":
        for low, high in (name, f"{name}1"), (f"{name}1", f"{name}2"):
            near, far = (
                getattr(linkage.motion(ALPHA + k * h), low) - getattr(linkage.motion(ALPHA - k * h), low)
                for k in (1, 2)
            )
            change = (8 * near - far) / (12 * h)
            exact = getattr(m, high)
            assert np.abs(change - exact).max() < 2e-4 * np.abs(exact).max()  # a/b = 1.99 turns within 0.1 rad
            calm = np.abs(change - exact) < 1e-9 * np.abs(exact).max()
            assert calm.mean() > 0.8


def test_mirrored_and_periodic() -> None:
    """theta is odd, beta and S are even; theta and S change sign in half a turn, beta does not. One branch, no singular place."""
    one, other, half = (THESIS.motion(v) for v in (ALPHA, -ALPHA, ALPHA + np.pi))
    for name, parity in ("theta", -1), ("beta", 1), ("S", 1):
        np.testing.assert_allclose(getattr(other, name), parity * getattr(one, name), atol=1e-15)
    for name, sign in ("theta", -1), ("beta", 1), ("S", -1):
        np.testing.assert_allclose(getattr(half, name), sign * getattr(one, name), atol=1e-14)
    assert np.abs(np.diff(one.theta)).max() < 0.01


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0.12, 0.06), r"a/b = 2 is outside \(0, 2\)"),
        ((0.03, 0.01), r"a/b = 3 is outside"),
        ((0.0, 0.06), "a = 0 m must be positive and finite"),
        ((-0.03, 0.06), "a = -0.03 m must be positive and finite"),
        ((0.03, 0.0), "b = 0 m must be positive and finite"),
        ((0.03, np.nan), "b = nan m must be positive and finite"),
        ((np.inf, 0.06), "a = inf m must be positive and finite"),
        ((0.03, 0.06, 0.03), "must be less than a = 0.03 m in size.*at alpha = 0"),
        ((0.03, 0.06, np.nan), "offset = nan"),
        ((0.11, 0.06, 0.02), r"outside \(0, 1.66667\)"),
    ],
)
def test_linkages_that_cannot_be_assembled(values: tuple[float, ...], message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        Linkage(*values)


def test_refused_is_exactly_what_cannot_turn() -> None:
    """Lengths at random: accepted where the loop closes at every angle, refused where it does not at some angle."""
    rng, refused = np.random.default_rng(4), 0
    for a, b, share in zip(*rng.uniform([[0.01], [0.01], [-1.5]], [[0.1], [0.1], [1.5]], (3, 400)), strict=True):
        d = b - share * a
        with np.errstate(invalid="ignore", divide="ignore"):
            loop = closed_loop(np.linspace(0, np.pi / 2, 201), a, b, d)
        closes = d > 0 and np.isfinite(loop.R).all() and np.isfinite(loop.cos_beta).all()
        try:
            Linkage(a, b, share * a)
        except pt.ParameterError:
            refused += 1
            assert not closes, (a, b, d)
        else:
            assert closes, (a, b, d)
    assert 100 < refused < 300


def test_words_of_the_source() -> None:
    """The lever turns fastest at the ends of its slide, where it does not slide, and slides fastest in the middle, where it does not turn
    (5.1.2); it reaches 90 degrees at a/b = sqrt(2) (6.1)."""
    alpha = np.linspace(0, np.pi, 181)
    m = THESIS.motion(alpha)
    assert np.argmax(np.abs(m.theta1)) in (0, 180)
    assert np.argmax(np.abs(m.S1)) == 90
    assert (abs(m.S1[0]), abs(m.theta1[90])) == pytest.approx((0, 0), abs=1e-15)
    assert Linkage(0.06 * np.sqrt(2), 0.06).theta_max == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("theta", [0.0, -1.0, np.pi, 4.0, np.nan])
def test_angles_that_no_lever_has(theta: float) -> None:
    with pytest.raises(pt.ParameterError, match="theta_max"):
        ratio_from_theta(theta)


def test_printed_bend() -> None:
    """Cage 88 rad/s, radius 7 m, track 1.4 m: 96.8 and 79.2 rad/s, 8.8 rad/s inside, ten turns of the cage for one cycle."""
    assert in_bend(88, 7, 1.4) == pytest.approx((96.8, 79.2, 8.8))
    assert cage_turns(7.0, 1.4) == pytest.approx(10)
    assert in_bend(88, np.inf, 1.4) == (88, 88, 0)


def test_velocities_in_a_bend() -> None:
    """The wheels' centres turn about one point (A.1)-(A.8); rolling without slip they turn as (5.13), (5.14) say."""
    r, v = 0.3, wheel_velocities(2.0, 7.0, 1.4)
    assert v["cage"][1] == pytest.approx(14)
    assert v["outer"][1] / v["cage"][1] == pytest.approx((7 + 0.7) / 7)
    assert v["inner"][1] / v["cage"][1] == pytest.approx((7 - 0.7) / 7)
    speeds = in_bend(v["cage"][1] / r, 7, 1.4)
    assert [speeds.outer * r, speeds.inner * r] == pytest.approx([v["outer"][1], v["inner"][1]])
    assert speeds.outer / speeds.inner == pytest.approx((7 + 0.7) / (7 - 0.7))
    with pytest.raises(pt.ParameterError, match=r"radius = 0\.5 m must be greater than half the track, 0.7 m"):
        in_bend(88, 0.5, 1.4)
    with pytest.raises(pt.ParameterError, match="track"):
        in_bend(88, 7, 0)
    with pytest.raises(pt.ParameterError, match="w_cage = nan rad/s must be finite"):
        in_bend(np.nan, 7, 1.4)
    with pytest.raises(pt.ParameterError, match="radius = -7 m must be greater than half the track"):
        cage_turns([7.0, -7.0], 1.4)


def test_table_5_1() -> None:
    """The table's inertias are those of cylinders of its masses; its cage has the minus sign of (B.4), the right value is 134 200."""
    cage, coupler, lever = (CYLINDERS[name] for name in ("cage", "coupler", "lever"))
    for given, body in (coupler, TABLE_5_1.coupler), (lever, TABLE_5_1.lever):
        one = cylinder(body.m, given[0], given[1])
        assert one.transverse == pytest.approx(body.transverse, rel=1e-12)
        assert one.axial == pytest.approx(body.axial, rel=2e-3)  # 179.7 printed as 180
        assert cylinder_mass(given[0], given[1]) == pytest.approx(body.m, rel=0.035)  # 582 g printed as 600
    radius, length, inner = cage
    assert cylinder_mass(radius, length, inner=inner) == pytest.approx(4.4, rel=0.01)
    assert TABLE_5_1.cage.axial == pytest.approx(4.4 * (radius**2 - inner**2) / 2)
    assert TABLE_5_1.cage.axial / GRAM_CM2 == pytest.approx(24200)
    assert CORRECTED.cage.axial / GRAM_CM2 == pytest.approx(134200)
    assert round(CORRECTED.cage.transverse / GRAM_CM2, 2) == 93866.67
    assert replace(CORRECTED, cage=TABLE_5_1.cage) == TABLE_5_1


def test_cylinders() -> None:
    """Against integrals over slices; refused where there is none."""
    body = cylinder(2.0, 0.03, 0.1, inner=0.01, transverse="exact")
    r, z = np.meshgrid(np.linspace(0.01, 0.03, 401), np.linspace(-0.05, 0.05, 401))
    weight = r / r.sum()
    assert body.axial == pytest.approx(2 * (weight * r**2).sum(), rel=1e-2)
    assert body.transverse == pytest.approx(2 * (weight * (r**2 / 2 + z**2)).sum(), rel=1e-2)
    for bad in (0.03, 0.1, 0.03), (0.03, 0.0, 0.0), (0.0, 0.1, 0.0):
        with pytest.raises(pt.ParameterError, match="inner < radius"):
            cylinder(1.0, bad[0], bad[1], inner=bad[2])
        with pytest.raises(pt.ParameterError, match=r"cylinder_mass: .*inner < radius"):
            cylinder_mass(bad[0], bad[1], inner=bad[2])
    with pytest.raises(pt.ParameterError, match="density = -7900 kg/m3 must be positive"):
        cylinder_mass(0.01, 0.1, density=-7900.0)
    with pytest.raises(pt.ParameterError, match="transverse"):
        cylinder(1.0, 1.0, 1.0, transverse="thin")
    with pytest.raises(pt.ParameterError, match="m = -1"):
        cylinder(-1.0, 1.0, 1.0)


def test_masses_of_other_lengths() -> None:
    """At the thesis's lengths its cylinders come out."""
    found = scaled(THESIS)
    assert found.coupler == cylinder(cylinder_mass(0.0125, 0.06), 0.0125, 0.06)
    assert found.lever == cylinder(cylinder_mass(0.0125, 0.15), 0.0125, 0.15)
    assert scaled(Linkage(0.06, 0.12)).lever.m > found.lever.m


@pytest.mark.parametrize("linkage", [THESIS, Linkage(0.05, 0.04, 0.01)], ids=str)
def test_slopes_of_the_inertia(linkage: Linkage) -> None:
    """J1 and M1 against differences of J and M."""
    masses, h = replace(CORRECTED, output=0.01, coupler_centre=0.4), 1e-3
    near, far = (
        [
            np.subtract(
                *(inertia(linkage.loop(ALPHA + d), linkage.a, linkage.b, linkage.d, masses)[i] for d in (k, -k))
            )
            for i in (0, 1)
        ]
        for k in (h, 2 * h)
    )
    found = inertia(linkage.loop(ALPHA), linkage.a, linkage.b, linkage.d, masses)
    for i in (0, 1):
        slope = (8 * near[i] - far[i]) / (12 * h)
        np.testing.assert_allclose(found[2 + i], slope, atol=1e-8 * np.abs(slope).max())
