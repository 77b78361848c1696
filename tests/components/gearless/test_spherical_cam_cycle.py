"""Friction of the spherical cam differential over a cycle, by virtual work and by statics of the parts."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.spherical_cam import (
    NO_FRICTION,
    STANDARD_RATIOS,
    CamFriction,
    Cycle,
    Sharing,
    SphericalCam,
    search,
    table_2,
)

SHARINGS = get_args(Sharing)
CAMS = [SphericalCam(4, 5), SphericalCam(3, 4), SphericalCam(3, 6)]
ROUGH = CamFriction(mu_pin=1.0, pin=0.9, mu_thrust=1.0, mu_contact=0.7, mu_bearing=0.3)
by_cam = pytest.mark.parametrize("cam", CAMS, ids=["4-5", "3-4", "3-6"])
by_sharing = pytest.mark.parametrize("sharing", SHARINGS)


def phases(cam: SphericalCam, points: int = 200) -> Any:
    return (np.arange(points) + 0.37) / points * cam.half


@by_cam
@by_sharing
@pytest.mark.parametrize("cam_drives", [True, False])
def test_virtual_work_of_a_mesh(cam: SphericalCam, sharing: Sharing, cam_drives: bool) -> None:
    """What goes in and does not come out is what the pins take: friction torque f N sin(alpha_4) times spin."""
    cycle, s, turns = Cycle(cam, CamFriction(), sharing), phases(cam), 1.0 if cam_drives else -1.0
    mesh = cycle.mesh(s, cam_drives=cam_drives)
    speed = np.linalg.norm(cam.M / cam.N * cam.e_phi + [0.0, 0.0, 1.0])
    f, lost = cycle.friction.rolling(cam.alpha_4), 0.0
    for ahead, weight in zip((0.0, cam.half), cycle.weights(s), strict=True):
        beta_3 = cam.beta_4(s + ahead - cam.half) - cam.alpha_4
        spin = speed * np.abs(np.sin(beta_3)) / math.sin(cam.alpha_4)
        lost = lost + f * weight * math.sin(cam.alpha_4) * spin
    gained = mesh.carrier * -cam.M / cam.N * turns
    np.testing.assert_allclose(mesh.cam * turns - gained, lost, atol=1e-12)


@by_cam
def test_normals_from_the_drawn_profile(cam: SphericalCam) -> None:
    """Torques of the frictionless mesh with a normal from differences of the profile instead of e_e; one roller alone."""
    cycle, h = Cycle(cam, NO_FRICTION, "single"), 1e-5
    s = np.linspace(cycle.handover + 0.01, cam.half - 0.01, 40)
    psi = s - cam.half
    step = cam.profile(psi + h) - cam.profile(psi - h)
    c, sn = np.cos(psi), np.sin(psi)
    tangent = np.stack([c * step[:, 0] - sn * step[:, 1], sn * step[:, 0] + c * step[:, 1], step[:, 2]], -1)
    normal = np.cross(tangent, cam.contact(psi))
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    normal *= np.sign((normal * cam.roller_axis(psi)).sum(-1))[:, None]  # onto the roller
    moment = np.cross(cam.contact(psi), normal)
    mesh = cycle.mesh(s, cam_drives=True)
    np.testing.assert_allclose(mesh.carrier, moment @ cam.e_phi, atol=1e-8)
    np.testing.assert_allclose(mesh.cam, moment[:, 2], atol=1e-8)


@by_cam
@by_sharing
def test_cam_is_in_equilibrium_between_two_separate_carriers(cam: SphericalCam, sharing: Sharing) -> None:
    """Both carriers placed in one frame, force by force, and the torques about the cam's axis added up with that of its bearing."""
    cycle = Cycle(cam, CamFriction(), sharing)
    for s in phases(cam, 7):
        eta = float(cycle.eta_0(s))
        forces, axial = [], []
        for side, drives in ((1.0, True), (-1.0, False)):
            f, total, about_x = cycle.friction.rolling(cam.alpha_4), np.zeros(3), 0.0
            own = s if drives else -s  # of its mirror image
            phase = np.mod(own, cam.half)
            moment = np.zeros(3)
            for ahead, weight in zip((0.0, cam.half), cycle.weights(own), strict=True):
                at = cam.contact(phase + ahead - cam.half)
                axis = cam.roller_axis(phase + ahead - cam.half)
                if not drives:  # reflected in the plane of the axes, then half a turn about z: x is reversed
                    at, axis = at * [-1, 1, 1], axis * [-1, 1, 1]
                normal = (axis - at * math.cos(cam.alpha_4)) / math.sin(cam.alpha_4)
                e_phi = np.array([side, 0.0, 0.0])
                # the left carrier's rollers go up where those of the right one go down: both mesh with one cam, psi' = 1
                slip = np.cross(-cam.M / cam.N * e_phi - np.array([0.0, 0.0, 1.0]), at)
                force = float(weight) * (normal - f * slip / np.linalg.norm(slip))
                total, moment = total + force, moment + np.cross(at, force)
            about_x = moment[0]
            forces.append((total, moment[2]))
            axial.append(about_x)
        (right, right_z), (left, left_z) = forces
        share = (
            axial[0] / axial[1] / eta
        )  # of the left normal forces, that the torques about the axle have the ratio eta
        both = right + share * left
        bearing = cycle.friction.mu_bearing * (
            cycle.friction.shaft * math.hypot(both[0], both[1]) + cycle.friction.washer * abs(both[2])
        )
        # the cam gets the reactions, and its bearing holds it back
        assert -right_z - share * left_z - bearing == pytest.approx(0, abs=1e-12)


@by_cam
@by_sharing
def test_efficiency(cam: SphericalCam, sharing: Sharing) -> None:
    """One without friction, less with more of any friction in the mean, and with the period of half a stroke."""
    s = phases(cam)
    np.testing.assert_allclose(Cycle(cam, NO_FRICTION, sharing).eta_0(s), 1, atol=1e-14)
    base = Cycle(cam, CamFriction(), sharing).eta_0(s)
    np.testing.assert_allclose(Cycle(cam, CamFriction(), sharing).eta_0(s - 5 * cam.half), base, atol=1e-12)
    assert ((base > 0.8) & (base < 1)).all()
    for name in ("mu_pin", "mu_thrust", "mu_bearing", "pin", "shaft", "washer"):
        more = CamFriction(**{name: 1.5 * getattr(CamFriction(), name)})
        # in the mean: here and there the tangential forces relieve the cam's bearing
        assert Cycle(cam, more, sharing).eta_0(s).mean() < base.mean()
    eta = Cycle(cam, CamFriction(), sharing).eta_0(s)
    np.testing.assert_allclose(Cycle(cam, CamFriction(), sharing).kappa(s), (1 - eta) / (1 + eta))


def test_small_friction_is_lost_power_over_power() -> None:
    """To first order 1 - eta_0 is the sum of both meshes' losses over what passes."""
    cam, tiny = CAMS[0], CamFriction(mu_pin=1e-6, mu_thrust=1e-6, mu_bearing=0.0)
    cycle, s = Cycle(cam, tiny), phases(CAMS[0])
    speed = np.linalg.norm(cam.M / cam.N * cam.e_phi + [0.0, 0.0, 1.0])
    lost = np.zeros(s.shape)
    for own in (s, -s):
        phase = np.mod(own, cam.half)
        for force, ahead in zip(cycle.contact_force(own, 1.0, 1.0, cams=1), (0.0, cam.half), strict=True):
            beta_3 = cam.beta_4(phase + ahead - cam.half) - cam.alpha_4
            lost += tiny.rolling(cam.alpha_4) * force * speed * np.abs(np.sin(beta_3))
    np.testing.assert_allclose(1 - cycle.eta_0(s), lost / (cam.M / cam.N), rtol=1e-4)


def test_rollers_that_are_rough_lock() -> None:
    """The efficiency reaches zero and stays where it is bounded; kappa is at least one there."""
    cycle = Cycle(CAMS[2], ROUGH)
    eta, kappa = cycle.eta_0(phases(CAMS[2])), cycle.kappa(phases(CAMS[2]))
    assert eta.min() < 0
    assert ((kappa >= 1) == (eta <= 0)).all()
    assert kappa.max() <= 3
    assert ROUGH.rolling(0.3) == 0.7  # slips


@by_cam
@by_sharing
def test_contact_forces_carry_the_torque(cam: SphericalCam, sharing: Sharing) -> None:
    cycle, s = Cycle(cam, CamFriction(), sharing), phases(cam)
    first, second = cycle.contact_force(s, 300.0, 0.05, cams=2)
    arms = [-cam.lever_arms(s + ahead - cam.half)[0] for ahead in (0.0, cam.half)]
    np.testing.assert_allclose(2 * 0.05 * (first * arms[0] + second * arms[1]), 300.0)
    assert (first >= 0).all()
    assert (second >= 0).all()
    assert (second[s > cycle.handover] == 0).all()
    assert 0 < cycle.handover <= cam.sigma
    for radius, cams in ((0.0, 2), (1.0, 0)):
        with pytest.raises(pt.ParameterError, match="carry the torque"):
            cycle.contact_force(0.1, 1.0, radius, cams=cams)


@by_cam
def test_elastic_sharing_is_continuous(cam: SphericalCam) -> None:
    """Over the ends of the overlap: a roller comes and goes without load."""
    cycle = Cycle(cam)
    start, end = cycle.contact_force(1e-7, 1.0, 1.0), cycle.contact_force(cam.half - 1e-7, 1.0, 1.0)
    assert float(start[0]) < 1e-5  # comes
    assert start[1] == pytest.approx(end[0], rel=1e-5)  # half a stroke later the first is the second
    before, after = (cycle.contact_force(cam.sigma + side, 1.0, 1.0) for side in (-1e-7, 1e-7))
    assert float(before[1]) < 1e-10 == 1e-10 + float(after[1])  # goes
    assert before[0] == pytest.approx(after[0], rel=1e-5)


def test_single_roller_hands_over_where_the_other_is_better_or_at_the_tip() -> None:
    paper, wide = Cycle(CAMS[0], sharing="single"), Cycle(CAMS[1], sharing="single")
    assert paper.handover == CAMS[0].sigma  # the intersection, at 30.9 degrees, lies beyond the tip at 24.3
    assert wide.handover <= CAMS[1].sigma
    loose = SphericalCam(4, 5, alpha_3=math.radians(48), alpha_4=math.radians(23))
    cycle = Cycle(loose, sharing="single")
    mu = [float(loose.pressure_angle_p(cycle.handover + ahead - loose.half)) for ahead in (0.0, loose.half)]
    assert cycle.handover == loose.sigma or mu[0] == pytest.approx(mu[1], abs=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mu_pin": -0.1}, "mu_pin = -0.1 must be"),
        ({"pin": 1.0}, "pin = 1 must be less than 1"),
        ({"shaft": math.inf}, "shaft = inf"),
    ],
)
def test_impossible_friction_is_refused(given: dict[str, float], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        CamFriction(**given)


def test_impossible_cycles_are_refused() -> None:
    with pytest.raises(pt.ParameterError, match="sharing = 'half' is not one of elastic, single"):
        Cycle(CAMS[0], sharing="half")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="alpha_1 = 75° must be 90°"):
        Cycle(SphericalCam(4, 5, alpha_1=math.radians(75), alpha_3=math.radians(36), alpha_4=math.radians(15)))


def test_impossible_states_are_refused() -> None:
    """A state that is no state is not "locked", and no roller pulls."""
    cycle = Cycle(CAMS[0])
    for at in math.nan, [0.1, math.inf]:
        for ask in (cycle.kappa, cycle.eta_0, lambda s: cycle.contact_force(s, 1.0, 1.0)):
            with pytest.raises(pt.ParameterError, match="cam angle s must be finite"):
                ask(at)
    for torque in -100.0, math.nan:
        with pytest.raises(pt.ParameterError, match="must be zero or positive, and finite: rollers only push"):
            cycle.contact_force(0.1, torque, 0.036)
    with pytest.raises(pt.ParameterError, match="radius = nan m must be positive"):
        cycle.contact_force(0.1, 100.0, math.nan)


TABLE_2 = """3 3 1 3.05 3.29 3.73 4.1 4.56
3 4 0.75 2.28 2.46 2.79 3.07 3.42
3 5 0.6 1.83 1.97 2.23 2.46 2.73
3 6 0.5 1.52 1.64 1.86 2.05 2.28
3 7 0.42 1.3 1.41 1.59 1.75 1.95
4 4 1 3.05 3.29 3.73 4.1 4.56
4 5 0.8 2.44 2.63 2.98 3.28 3.64
4 6 0.66 2.03 2.19 2.48 2.73 3.04
4 7 0.57 1.74 1.88 2.13 2.34 2.6
4 8 0.5 1.52 1.64 1.86 2.05 2.28"""


def test_table_2_as_arithmetic() -> None:
    rows = [[float(x) for x in line.split()] for line in TABLE_2.splitlines()]
    assert {(int(M), int(N)): tuple(rest) for M, N, *rest in rows} == table_2()
    assert STANDARD_RATIOS == (3.05, 3.29, 3.73, 4.1, 4.56)


def test_search_finds_the_paper_s_choice() -> None:
    """{4, 5} first, {3, 4} second; off the standard ratios by 0.01 and 0.02 (0.025 before it is cut off)."""
    found = search()
    first, second = found[:2]
    assert [(c.M, c.N) for c in (first, second)] == [(4, 5), (3, 4)]
    assert first.off_standard == pytest.approx(0.01)
    assert second.off_standard == pytest.approx(0.025)
    assert first.minimum_pressure_angle < second.minimum_pressure_angle
    assert first.mean_eta > second.mean_eta
    refused = {(c.M, c.N): c.refused for c in found if c.refused}
    assert set(refused) == {(3, 3), (4, 4), (3, 7), (3, 8), (4, 7), (4, 8)}
    assert "M = N = 4" in refused[4, 4]
    assert "7 rollers" in refused[3, 7]
    more = search((3, 4, 5))
    assert (more[0].M, more[0].N) == (5, 6)
