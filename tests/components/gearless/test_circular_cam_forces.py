"""Forces, contact pressure and locking of the circular-cam differential against Provatidis 2023 and against independent sums."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from scipy.integrate import dblquad

import powertrain as pt
from powertrain.components.gearless.circular_cam import (
    TABLE_1,
    TORQUE,
    CircularCams,
    FrictionDisk,
    RollerContact,
    Sharing,
    all_phase_limit,
    bias_ratio,
    critical_angle,
    forces,
    forces_at,
    friction_diameter,
    latent_efficiency,
    locking,
    locking_map,
    optimal_outer_angle,
    similar,
    single_track_limit,
    track_contacts,
    with_friction,
)
from powertrain.components.gearless.circular_cam.contact import Method
from powertrain.components.gearless.circular_cam.track import steepest_angle

OUTER, INNER, DISK = TABLE_1.outer, TABLE_1.inner, TABLE_1.disk
RADII = {"outer": 0.220, "inner": 0.058}
"""R_2x of eq. (47)."""
HEXAGON = CircularCams.build(
    D_out=0.12, D_in=0.08, r_out=0.01, r_in=0.008, alpha_out=0.3, alpha_in=0.5, disk=FrictionDisk(0.13, 0.06, 0.1), n=6
)
THETA = np.linspace(0.02, 6, 97)


def table(outer: float = 1.0, inner: float = 1.0, hollow: float = 1.1, radius: float = 1.0) -> tuple[Any, Any]:
    """Pressures in GPa of the concave contact, equivalent sphere, with both tracks at (a multiple of) their greatest angle."""
    found = forces_at(TABLE_1, outer * OUTER.alpha_max, inner * INNER.alpha_max, TORQUE, "rigid")
    contacts = (
        track_contacts(track, hollow=hollow, R_concave=radius * RADII[name])[0]
        for name, track in (("outer", OUTER), ("inner", INNER))
    )
    outer, inner = (
        float(c.pressure(F, "sphere")) / 1e9 for c, F in zip(contacts, (found.F_n_out, found.F_n_in), strict=True)
    )
    return outer, inner


def test_equations_43_to_46() -> None:
    assert 1000 * friction_diameter(0.095, 0.045) == pytest.approx(72.9762, abs=5e-5)
    assert TABLE_1.xi == pytest.approx(0.5882, abs=5e-5)
    alpha_m = math.degrees(critical_angle(DISK.D_R, OUTER.D, TABLE_1.xi, DISK.mu))
    assert alpha_m == pytest.approx(7.53, abs=0.005)
    assert 2 * alpha_m == pytest.approx(15.1, abs=0.05)


def test_friction_diameter_by_integration() -> None:
    """Moment of friction over force, ring by ring, for equal pressure and for pressure in proportion to 1/radius."""
    r = np.linspace(0.0225, 0.0475, 200_001)
    for uniform, pressure in (("pressure", np.ones_like(r)), ("wear", 1 / r)):
        moment, force = (np.trapezoid(pressure * r**power, r) for power in (2, 1))
        assert friction_diameter(0.095, 0.045, uniform) == pytest.approx(2 * moment / force)  # type: ignore[arg-type]
    worn = FrictionDisk(0.095, 0.045, 0.066, "wear")
    assert abs(worn.D_R - 0.07) < 1e-12
    assert DISK.torque(1000.0) == pytest.approx(0.066 * 1000 * 0.0729762 / 2, rel=1e-6)


def test_table_2_and_4() -> None:
    """Printed to four decimals; "1.6 MPa" in the text is 1.6 GPa."""
    assert table() == pytest.approx((1.6, 1.2), abs=0.05)
    for factor, printed in ((1.1, (1.5211, 1.1611)), (1.0, (1.5690, 1.1953)), (0.9, (1.6239, 1.2351))):
        assert table(factor, factor) == pytest.approx(printed, abs=5e-5)


def test_table_3() -> None:
    """Two entries of the outer track are truncated in print: 1.4654 and 1.4060 stand as 1.46 and 1.40."""
    outer = {1.10: 1.57, 1.09: 1.52, 1.08: 1.46, 1.07: 1.40, 1.06: 1.34, 1.05: 1.26, 1.04: 1.18}
    inner = {1.10: 1.20, 1.09: 1.16, 1.08: 1.12, 1.07: 1.07, 1.06: 1.02, 1.05: 0.96, 1.04: 0.90}
    for hollow in outer:
        found = table(hollow=hollow)
        assert found[1] == pytest.approx(inner[hollow], abs=0.005)
        assert found[0] == pytest.approx(outer[hollow], abs=0.01 if hollow in (1.08, 1.07) else 0.005)
    assert (table(hollow=1.08)[0], table(hollow=1.07)[0]) == pytest.approx((1.4654, 1.4060), abs=5e-5)


def test_the_radius_along_the_track_matters_little() -> None:
    """+-10 % of R_2x: less than 1 % of pressure."""
    for radius in (0.9, 1.1):
        assert np.abs(np.array(table(radius=radius)) / np.array(table()) - 1).max() < 0.01


def test_exact_contact_and_convex_contact_are_worse() -> None:
    found = forces_at(TABLE_1, OUTER.alpha_max, INNER.alpha_max, TORQUE, "rigid")
    for name, track, force in (("outer", OUTER, found.F_n_out), ("inner", INNER, found.F_n_in)):
        concave, convex = track_contacts(track, R_concave=RADII[name])
        assert 1.12 < concave.pressure(force) / concave.pressure(force, "sphere") < 1.145  # 12 to 14 %
        assert convex.R_x == pytest.approx(RADII[name] - 2 * track.r)
        for method in get_args(Method):
            assert convex.pressure(force, method) > concave.pressure(force, method)


def test_pressures_at_the_real_phases() -> None:
    """Never are both tracks at their greatest angle at once. Half-way sin(alpha) is half of it: twice the force of the tables."""
    found = forces(TABLE_1, math.pi / 8, TORQUE, "rigid")
    at_once = forces_at(TABLE_1, OUTER.alpha_max, INNER.alpha_max, TORQUE, "rigid")
    assert found.F_n_out == pytest.approx(2 * at_once.F_n_out)
    assert found.F_n_in == pytest.approx(2 * at_once.F_n_in)
    pressures = [
        float(track_contacts(track, R_concave=RADII[name])[0].pressure(force, "sphere")) / 1e9
        for name, track, force in (("outer", OUTER, found.F_n_out), ("inner", INNER, found.F_n_in))
    ]
    assert pressures == pytest.approx([2 ** (1 / 3) * 1.5690, 2 ** (1 / 3) * 1.1953], abs=1e-4)
    # A track that carries alone, at its greatest angle, has the whole torque.
    alone = forces(TABLE_1, [math.pi / 4, 0.0], TORQUE)
    assert alone.F_n_out[0] == pytest.approx(TORQUE / 0.085 / (2 * math.sin(OUTER.alpha_max)))
    assert alone.F_n_in[1] == pytest.approx(TORQUE / 0.050 / (2 * math.sin(INNER.alpha_max)))


def test_arcs_that_close_have_another_radius_than_the_printed_one() -> None:
    """85 mm and 15 degrees close with R_m + r = 144 mm, not 220 mm; 50 mm and 27.25 degrees with 54.9 mm, near the printed 58 mm."""
    assert track_contacts(OUTER)[0].R_x == pytest.approx(0.1440, abs=5e-5)
    assert track_contacts(INNER)[0].R_x == pytest.approx(0.0549, abs=5e-5)


@pytest.mark.parametrize("R_y", [0.0165, 0.05, 0.0156])
@pytest.mark.parametrize("convex", [False, True])
def test_ellipse_of_contact_by_integration(R_y: float, convex: bool) -> None:
    """Boussinesq: the surfaces sink in by integral p/(pi E* distance); sunk in they must fit, x**2/(2 R_ex) + y**2/(2 R_ey) less."""
    contact = RollerContact(0.015, 0.144, R_y, convex)
    force = 5000.0
    long, short = (float(axis) for axis in contact.ellipse(force))
    # The longer axis lies along the larger of both relative radii.
    R_long, R_short = max(contact.radii), min(contact.radii)
    p0 = float(contact.pressure(force))
    assert 2 / 3 * math.pi * long * short * p0 == pytest.approx(force)

    def sunk(x: float, y: float) -> float:
        """In polar coordinates about the point the distance cancels: the integral of p over each chord is closed form."""

        def chord(distance: float, angle: float) -> float:
            u = (x + distance * math.cos(angle)) / long
            v = (y + distance * math.sin(angle)) / short
            return math.sqrt(max(0.0, 1 - u * u - v * v))

        def end(angle: float) -> float:
            cos, sin = math.cos(angle) / long, math.sin(angle) / short
            a, b, c = cos**2 + sin**2, x / long * cos + y / short * sin, (x / long) ** 2 + (y / short) ** 2 - 1
            return (-b + math.sqrt(b * b - a * c)) / a

        total, _ = dblquad(chord, 0, 2 * math.pi, 0, end, epsabs=1e-9, epsrel=1e-7)
        return p0 * total / (math.pi * contact.E_star)

    middle = sunk(0, 0)
    for x, y in ((0.6 * long, 0.0), (0.0, 0.6 * short), (0.4 * long, 0.5 * short)):
        assert middle - sunk(x, y) == pytest.approx(x**2 / (2 * R_long) + y**2 / (2 * R_short), rel=2e-3)


def test_round_contact_is_the_sphere() -> None:
    ball = RollerContact(0.015, 0.03, 0.03)
    assert ball.slenderness == 1
    for force in (0.0, 1.0, 5000.0):
        assert ball.pressure(force) == pytest.approx(ball.pressure(force, "sphere"))
    nearly = RollerContact(0.015, 0.03, 0.03 * (1 + 1e-6))
    assert nearly.pressure(100.0) == pytest.approx(ball.pressure(100.0), rel=1e-5)
    steel_on_bronze = RollerContact(0.015, 0.03, 0.03, E=200e9, nu=0.3, E_cam=110e9, nu_cam=0.34)
    assert 1 / steel_on_bronze.E_star == pytest.approx(0.91 / 200e9 + (1 - 0.34**2) / 110e9)


@pytest.mark.parametrize("sharing", get_args(Sharing))
@pytest.mark.parametrize("cams", [TABLE_1, HEXAGON], ids=["four", "six"])
def test_balances_of_forces_and_torques(cams: CircularCams, sharing: Sharing) -> None:
    """Eqs. (16)-(27), (32), (33), (36), with the active rollers counted; and kappa is the disks' friction over the cams' torque."""
    found = forces(cams, THETA, TORQUE, sharing)
    active = [np.sum([track.active(THETA, j) for j in range(track.n)], axis=0) for track in (cams.outer, cams.inner)]
    assert (active[0] == cams.outer.n // 2).all()
    outer = (cams.outer, active[0], found.F_u_out, found.F_n_out, found.P_ax_out, found.alpha_out)
    inner = (cams.inner, active[1], found.F_u_in, found.F_n_in, found.P_ax_in, found.alpha_in)
    torque, axial = np.zeros_like(THETA), np.zeros_like(THETA)
    for track, count, F_u, F_n, P_ax, alpha in (outer, inner):
        torque += count * F_u * track.D / 2
        axial += count * P_ax
        np.testing.assert_allclose(2 * F_n * np.sin(alpha), F_u, rtol=1e-12)
        np.testing.assert_allclose(F_n * np.cos(alpha), P_ax, rtol=1e-12)
    np.testing.assert_allclose(torque, TORQUE)
    np.testing.assert_allclose(found.M_cam, TORQUE / 2)
    np.testing.assert_allclose(axial, found.F_ax)
    np.testing.assert_allclose(found.M_friction / found.M_cam, cams.kappa(THETA, sharing), rtol=1e-9)
    np.testing.assert_allclose(found.share, cams.share(THETA, sharing))


def test_rigid_rule() -> None:
    """Eqs. (19), (24), (25): F_in/F_out = xi at every phase; lambda = 1/(1 + xi**2)."""
    found, xi = forces(TABLE_1, THETA, TORQUE, "rigid"), TABLE_1.xi
    np.testing.assert_allclose(found.F_u_in / found.F_u_out, xi)
    np.testing.assert_allclose(found.F_u_out, TORQUE / (0.085 * (1 + xi**2)))
    np.testing.assert_allclose(found.F_u_in, xi * TORQUE / (0.085 * (1 + xi**2)))
    level = forces(TABLE_1, 0.0, TORQUE, "rigid")
    assert level.F_n_out == np.inf  # a level track cannot carry its share
    assert TABLE_1.kappa(0.0, "rigid") == np.inf


def test_elastic_rule_is_finite_and_continuous() -> None:
    """Also it is what two equal springs along the contact normals do when the cage is turned a little against held cams."""
    fine = np.linspace(-0.01, math.pi / 2, 20_001)
    for cams in (TABLE_1, HEXAGON):
        for values in (cams.kappa(fine), cams.share(fine), forces(cams, fine, TORQUE).F_n_out):
            assert np.isfinite(values).all()
            assert np.abs(np.diff(values)).max() < 0.002 * np.abs(values).max()
    theta, c, turn = 0.2, 1e8, 1e-6
    torques = []
    for track in (OUTER, INNER):
        closing = turn * track.D / 2 * math.sin(track.alpha(theta))
        torques.append(
            2 * 2 * c * closing * math.sin(track.alpha(theta)) * track.D / 2
        )  # two rollers, two contacts each
    assert TABLE_1.share(theta) == pytest.approx(torques[0] / sum(torques))
    assert TABLE_1.share([0.0, math.pi / 4]) == pytest.approx([0, 1], abs=1e-12)


def test_axial_force_by_virtual_work() -> None:
    """Cams held against turning are pushed apart by dz where the cage goes ahead by dx, by the geometry alone: P_ax dz = F_u dx."""
    for track, name in ((OUTER, "out"), (INNER, "in")):
        for theta in (0.15, 0.5, 1.0):
            found = forces(TABLE_1, theta, TORQUE)
            wedged = next(j for j in range(4) if track.active(theta, j))
            groove, shift, dx = wedged * math.pi * track.D / 4, theta * track.D / 2, 1e-7

            def gap(x: float, t: Any = track, s: float = shift) -> float:
                """Height of the lower cam's pitch curve over the upper cam's: by so much these must move apart."""
                return float(t.pitch(x + s)[0] - t.pitch(-(x - s))[0])

            dz = (gap(groove + dx) - gap(groove - dx)) / (2 * dx)
            # Both cams together give way by dz, each has P_ax.
            assert getattr(found, f"P_ax_{name}") * dz == pytest.approx(getattr(found, f"F_u_{name}"), rel=1e-5)


def test_groove_friction_by_its_power() -> None:
    """Sum over the wedged rollers of friction force times sliding speed of the rim at the groove = (T_R - T_L) theta'."""
    mu_g = 0.08
    for cams in (TABLE_1, HEXAGON):
        for sharing in ("rigid", "elastic"):
            frictionless = with_friction(cams, 0.0)
            kappa = frictionless.kappa(THETA, sharing, mu_groove=mu_g)
            found, power = forces(cams, THETA, 1.0, sharing), np.zeros_like(THETA)
            for track, F_u in ((cams.outer, found.F_u_out), (cams.inner, found.F_u_in)):
                for j in range(track.n):
                    # The cage pushes ahead, from behind: there the rim of a roller that turns clockwise moves up.
                    slide = track.climb(THETA, j) + track.r * track.spin(THETA)
                    power += np.where(track.active(THETA, j), mu_g * F_u * np.abs(slide), 0)
            np.testing.assert_allclose(kappa, power, rtol=1e-9)


def test_paper_s_own_data_do_not_lock() -> None:
    """By the rigid rule the least kappa is 0.399; 0.1655 is the friction that eq. (37) needs, where both tracks carry."""
    found = locking(TABLE_1, "rigid")
    assert not found.every_phase
    assert found.interior == pytest.approx(0.399, abs=5e-4)
    assert found.mu_interior == pytest.approx(0.1655, abs=5e-5)
    assert locking(with_friction(TABLE_1, 0.1655), "rigid").interior == pytest.approx(1, abs=1e-3)
    # Where one track carries alone it takes still more.
    assert found.outer_alone == pytest.approx(0.066 * 72.9762 / 85 / math.tan(math.radians(15)), rel=1e-6)
    assert found.inner_alone == pytest.approx(0.066 * 72.9762 / 50 / math.tan(math.radians(27.25)), rel=1e-6)
    assert found.least == found.inner_alone
    assert found.mu_every_phase == pytest.approx(0.353, abs=5e-4)
    assert "locks at some phases only" in str(found)
    assert locking(with_friction(TABLE_1, 0.0), "rigid").mu_every_phase == pytest.approx(found.mu_every_phase)
    elastic = locking(TABLE_1)
    assert elastic.never
    assert "locks at no phase" in str(elastic)
    assert elastic.least == pytest.approx(found.least, rel=1e-4)
    enough = locking(with_friction(TABLE_1, 1.0001 * elastic.mu_every_phase))
    assert enough.every_phase
    assert "at every phase" in str(enough)


@pytest.mark.parametrize("sharing", get_args(Sharing))
def test_least_coefficient_by_brute_force(sharing: Sharing) -> None:
    for cams in (TABLE_1, HEXAGON):
        phases = np.linspace(1e-5, math.pi / cams.outer.n - 1e-5, 200_001)
        values = cams.kappa(phases, sharing)
        found = locking(cams, sharing)
        assert found.interior == pytest.approx(values.min(), rel=1e-4)
        assert cams.kappa(found.theta_interior, sharing) == pytest.approx(found.interior)


def test_critical_angles() -> None:
    """Eqs. (41), (42) against the sum that they minimise; for small angles the search over all phases agrees."""
    xi, D_R, D, mu = TABLE_1.xi, DISK.D_R, OUTER.D, DISK.mu
    alpha_m = critical_angle(D_R, D, xi, mu)
    grid = np.linspace(0.001, 0.999, 100_001) * alpha_m
    values = 1 / grid + xi / (alpha_m - grid)
    assert grid[values.argmin()] == pytest.approx(optimal_outer_angle(alpha_m, xi), rel=1e-4)
    assert values.min() == pytest.approx(D * (1 + xi**2) / (mu * D_R))
    assert all_phase_limit(TABLE_1, "rigid", interior=True) == pytest.approx(alpha_m, rel=1e-3)
    for mu in (0.001, 0.01):
        exact = all_phase_limit(with_friction(TABLE_1, mu), "rigid", interior=True)
        assert exact == pytest.approx(critical_angle(D_R, D, xi, mu), rel=1e-4)


@pytest.mark.parametrize("force", [-100.0, math.nan, [1.0, -1.0]])
def test_contacts_only_push(force: Any) -> None:
    with pytest.raises(pt.ParameterError, match="a contact force must be compressive"):
        RollerContact(0.015, 0.144, 0.0165).pressure(force)


def test_limit_over_all_phases() -> None:
    """3.243 degrees where the outer track carries alone, not 7.53."""
    alone = single_track_limit(DISK.D_R, OUTER.D, DISK.mu)
    assert math.degrees(alone) == pytest.approx(3.243, abs=5e-4)
    for sharing in ("rigid", "elastic"):
        limit = all_phase_limit(TABLE_1, sharing)
        assert limit == pytest.approx(alone, rel=1e-5)
        assert locking(similar(TABLE_1, 0.999 * limit), sharing).every_phase
        assert not locking(similar(TABLE_1, 1.001 * limit), sharing).every_phase
    assert math.tan(single_track_limit(0.08, 0.08, 0.1)) == pytest.approx(0.1)  # eq. (A5)
    assert all_phase_limit(with_friction(TABLE_1, 0.0)) == 0
    assert all_phase_limit(with_friction(TABLE_1, 100.0)) == pytest.approx(steepest_angle(OUTER.D, OUTER.r, 4))


def test_locking_map() -> None:
    alpha, mu = np.radians([2.0, 5.0, 10.0]), [0.05, 0.1]
    found = locking_map(TABLE_1, alpha, mu, "rigid")
    assert found.shape == (3, 2)
    for i, a in enumerate(alpha):
        for j, m in enumerate(mu):
            assert found[i, j] == pytest.approx(locking(with_friction(similar(TABLE_1, a), m), "rigid").least)
            assert (found[i, j] >= 1) == (a <= single_track_limit(DISK.D_R, OUTER.D, m))
    assert (locking_map(TABLE_1, alpha, mu, "rigid", interior=True) > found).all()


def test_bias_and_latent_efficiency() -> None:
    kappa = np.array([0.0, 0.399, 0.99, 1.0, 2.0])
    np.testing.assert_allclose(bias_ratio(kappa), [1, 1.399 / 0.601, 199, np.inf, np.inf])
    np.testing.assert_allclose(latent_efficiency(kappa), [1, 0.601 / 1.399, 1 / 199, 0, 0], atol=1e-12)


def test_rigid_rule_at_a_level_track_is_locked() -> None:
    """kappa is infinite there: no efficiency, not NaN."""
    kappa = TABLE_1.kappa(0.0, "rigid")
    assert math.isinf(kappa)
    assert latent_efficiency(kappa) == 0
    assert bias_ratio(kappa) == math.inf


def test_friction_diameter_of_a_thin_ring() -> None:
    assert friction_diameter(0.08, 0.08) == pytest.approx(0.08)
    assert friction_diameter(0.09, 0.0) == pytest.approx(0.06)


@pytest.mark.parametrize("mu", [1e-8, 1e-5])
def test_limit_of_slippery_disks(mu: float) -> None:
    assert all_phase_limit(with_friction(TABLE_1, mu)) == pytest.approx(single_track_limit(DISK.D_R, OUTER.D, mu))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: forces_at(TABLE_1, 0.0, 0.0, 1.0), "both 0"),
        (lambda: forces_at(TABLE_1, -0.1, 0.1, 1.0), r"alpha_out = -5.7.* must lie in \[0, 90\)"),
        (lambda: forces_at(TABLE_1, 0.1, 1.6, 1.0), "alpha_in = 91.6"),
        (lambda: forces(TABLE_1, 0.1, 1.0, "equal"), "sharing = 'equal' is not one of elastic, rigid, averaged"),  # type: ignore[arg-type]
        (lambda: RollerContact(0.015, 0.1, 0.015), "R_y = 0.015 m must be greater than the roller's r = 0.015 m"),
        (lambda: RollerContact(0.015, 0.01, 0.02), "R_x = 0.01 m must be greater"),
        (lambda: RollerContact(0.015, -0.1, 0.02, convex=True), "R_x = -0.1 m must be positive"),
        (lambda: RollerContact(0.015, 0.1, 0.02, nu=0.6), "no material has E = 2e.11 Pa .* and nu = 0.6"),
        (lambda: track_contacts(OUTER, R_concave=0.02), "R_m = 0.005 m must be greater than the roller's radius"),
        (lambda: similar(TABLE_1, 0.0), "alpha_max = 0 degrees"),
        (lambda: bias_ratio([0.2, -0.5]), "kappa must be zero or positive, not -0.5"),
        (lambda: bias_ratio(math.nan), "kappa must be zero or positive"),
        (lambda: latent_efficiency(-0.5), "kappa must be zero or positive"),
        (lambda: optimal_outer_angle(0.1, -0.5), "optimal_outer_angle: xi = -0.5 must be positive"),
        (lambda: critical_angle(0.07, 0.085, -0.5, 0.1), "critical_angle: xi = -0.5 must be positive"),
        (lambda: critical_angle(0.07, 0.0, 0.5, 0.1), "critical_angle: D_out = 0 m must be positive"),
        (lambda: critical_angle(0.07, 0.085, 0.5, -0.1), "critical_angle: mu = -0.1 must be zero or positive"),
        (lambda: single_track_limit(0.07, 0.0, 0.1), "single_track_limit: D = 0 m must be positive"),
        (lambda: single_track_limit(0.07, 0.085, math.nan), "single_track_limit: mu = nan must be"),
        (lambda: locking_map(TABLE_1, 0.1, [0.1, -0.1]), "locking_map: mu = -0.1 must be zero or positive"),
        (lambda: friction_diameter(0.08, 0.04, "run-in"), "uniform = 'run-in' is not one of"),  # type: ignore[arg-type]
        (lambda: forces(TABLE_1, math.nan, 260.0), "theta must be finite"),
        (lambda: TABLE_1.kappa([0.1, math.inf]), "theta must be finite"),
        (lambda: forces_at(TABLE_1, math.nan, 0.1, 260.0), r"alpha_out = nan degrees must lie in \[0, 90\)"),
        (lambda: forces(TABLE_1, 0.1, math.nan), "torque of the cage must be finite, not nan N.m"),
        (lambda: replace(TABLE_1, inner=replace(INNER, phase=0.1)), "must be half an arc"),
    ],
)
def test_impossible_data_are_refused(make: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        make()
