"""Joint forces, shaking, friction and design of the linkage: the source's numbers and relations, corrected where they need it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.gearless.linkage import (
    JointFriction,
    Linkage,
    LinkageDifferential,
    LinkMasses,
    Motion,
    ratio_from_theta,
    scaled,
)
from powertrain.components.gearless.linkage.design import (
    DifferentialDuty,
    Space,
    alternate,
    ball_force,
    guided,
    over_length,
    pareto,
    peaks,
    rod_force,
)
from powertrain.components.gearless.linkage.forces import Drive, Reactions, reactions, torques
from powertrain.components.gearless.linkage.masses import CORRECTED, LinkBody, cylinder
from powertrain.components.gearless.linkage.shaking import shaking, turns

THESIS = Linkage(0.03, 0.06)
NOTHING = LinkBody(0.0, 0.0, 0.0)
MASSLESS = LinkMasses(NOTHING, NOTHING, NOTHING)
ALPHA = np.linspace(0, 2 * np.pi, 361)


def static(linkage: Linkage = THESIS, torque: float = 200.0) -> Reactions:
    return reactions(linkage, Drive.at(ALPHA), MASSLESS, crown=torque)


def test_printed_torques() -> None:
    """18 kW at 88 rad/s: 204.5 N.m, rounded to 200 in print; half of it on each wheel (5.45)."""
    assert round(DifferentialDuty.cruising(18000, 88).torque, 1) == 204.5
    found = torques(THESIS, Drive.at(ALPHA, w=88, u=8.8), MASSLESS, crown=200)
    np.testing.assert_allclose(found.left, -100)
    np.testing.assert_allclose(found.right, -100)


def test_torques_of_the_source_vary_little() -> None:
    """100 N.m on one wheel: the drives of cage and other wheel stay within 1.5 % of 200 and 100 N.m in spite of inertia."""
    found = torques(THESIS, DifferentialDuty().drive(ALPHA), right=-100)
    assert np.abs(found.left + 100).max() < 1.5
    assert np.abs(found.crown - 200).max() < 1.5
    with pytest.raises(pt.ParameterError, match="crown or right"):
        torques(THESIS, Drive.at(0.0))
    with pytest.raises(pt.ParameterError, match="crown or right"):
        torques(THESIS, Drive.at(0.0), crown=1, right=1)


@pytest.mark.parametrize("linkage", [THESIS, alternate(THESIS), Linkage(0.03, 0.02)], ids=str)
def test_static_forces(linkage: Linkage) -> None:
    """(7.1) under the convention; (5.48) in the lever's axes; (5.50); C-pair force along z only, of size 2 tau |cos alpha|/(a cos beta)."""
    found, m = static(linkage), linkage.motion(ALPHA)
    across = 100 / (linkage.a * np.cos(m.beta))
    for force in found.S_left, found.S_right:
        np.testing.assert_allclose(np.linalg.norm(force, axis=-1), across)
    np.testing.assert_allclose(found.axial, 0, atol=1e-9)
    np.testing.assert_allclose(found.C_force[:, :2], 0, atol=1e-9)
    np.testing.assert_allclose(found.C_force[:, 2], 2 * across * np.cos(ALPHA), atol=1e-8)
    z = np.stack([np.sin(m.theta), 0 * ALPHA, np.cos(m.theta)], -1)
    balance = [np.sum(force * z, -1) for force in (found.S_left, found.S_right, found.C_force)]
    np.testing.assert_allclose(np.sum(balance, 0), 0, atol=1e-8)
    on_cage = -found.C_moment[:, 0] - m.S * found.C_force[:, 2]
    np.testing.assert_allclose(on_cage, -200, rtol=1e-12)


def test_moment_of_the_rod() -> None:
    """(5.49) with signs: M_z = b (F_x1 - F_x3), which is 2 b F_x1 statically; 2 b (F_x1 + F_x2) as printed would be zero."""
    found, m = static(), THESIS.motion(ALPHA)
    z = np.stack([np.sin(m.theta), 0 * ALPHA, np.cos(m.theta)], -1)
    moment = np.sum(found.C_moment * z, -1)
    one, other = found.S_left[:, 1], found.S_right[:, 1]
    np.testing.assert_allclose(moment, 0.06 * (one - other), atol=1e-9)
    np.testing.assert_allclose(moment, 2 * 0.06 * one, atol=1e-9)
    np.testing.assert_allclose(one + other, 0, atol=1e-9)


def test_virtual_work_of_the_joints() -> None:
    """For a turn of the left shaft, cage held, the couplers do on the lever the work of the shafts' torques: none together."""
    found, h = static(), 1e-6
    p, q = THESIS.points(ALPHA - h), THESIS.points(ALPHA + h)
    work = [np.sum(getattr(found, side) * (q[side] - p[side]), -1) / (2 * h) for side in ("S_left", "S_right")]
    np.testing.assert_allclose(work[0], found.torques.left, rtol=1e-6)
    np.testing.assert_allclose(work[1], -found.torques.right, rtol=1e-6)


def test_what_is_not_determined() -> None:
    """Couplers fitted under stress: no torque changes, (5.50) does not either, but the C-pair's force along x and along z do."""
    found, m = static(), THESIS.motion(ALPHA)
    stressed = found.with_prestress(500.0)
    np.testing.assert_allclose(
        found.prestress["C_force"],
        -2 * np.stack([np.sin(m.beta), 0 * ALPHA, np.sin(ALPHA) * np.cos(m.beta)], -1),
        atol=1e-15,
    )
    for moment, force in (stressed.C_moment, stressed.C_force), (found.C_moment, found.C_force):
        np.testing.assert_allclose(moment[:, 0] + m.S * force[:, 2], 200, rtol=1e-12)
    for one, other in zip(stressed.across, found.across, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
    for side, sign in ("S_left", 1), ("S_right", -1):
        arm = getattr(found, side)
        grown = np.linalg.norm(getattr(stressed, side), axis=-1)
        np.testing.assert_allclose(grown, np.hypot(np.linalg.norm(arm, axis=-1), 500 * sign))
    assert np.abs(stressed.C_force[:, 0]).max() > 100


def test_forces_of_inertia_are_small() -> None:
    """The source: the effect of the moving masses on the joints is small beside that of the torque (here up to 2 %)."""
    loaded, idle = (reactions(THESIS, DifferentialDuty().drive(ALPHA), crown=crown) for crown in (200, 0))
    for name in "S_left", "C_force":
        share = (
            np.linalg.norm(getattr(idle, name), axis=-1).max() / np.linalg.norm(getattr(loaded, name), axis=-1).max()
        )
        assert share < 0.025


def test_shaking_force_turns_eleven_times() -> None:
    """Not ten, as printed: the part that turns with cage and shaft, (w + u)/u = 11, is greater than the one with (w - u)/u = 9."""
    alpha = np.linspace(0, 2 * np.pi, 4001)
    found = shaking(THESIS, DifferentialDuty().drive(alpha), phi=10 * alpha)
    assert turns(found.force) == pytest.approx(11, abs=1e-9)
    assert np.abs(found.force[:, 0]).max() == 0


def test_shaking_of_the_coupling() -> None:
    """Cage held, 209.4 rad/s: force and moment along y only; at alpha = 0 the force is (m_lever + m_coupler) a u^2."""
    found = shaking(THESIS, Drive.at(ALPHA, u=209.4))
    for v in found:
        assert np.abs(v[:, [0, 2]]).max() < 1e-12 * np.abs(v).max()
    assert found.force[0, 1] == pytest.approx((0.6 + 0.23) * 0.03 * 209.4**2)
    differential = shaking(THESIS, DifferentialDuty().drive(ALPHA))
    assert np.linalg.norm(differential.force, axis=-1).max() < 0.2 * np.abs(found.force).max()


def test_torques_do_not_shake() -> None:
    """However large the torques, the housing's forces are those of inertia (5.2.2): the momentum does not know about them."""
    drive = DifferentialDuty().drive(ALPHA)
    for crown in 0.0, 200.0, 5000.0:
        found = reactions(THESIS, drive, crown=crown)
        bearings = found.R_left + found.R_right + found.C_force
        np.testing.assert_allclose(-bearings[:, 1:], shaking(THESIS, drive).force[:, 1:], atol=1e-8)


def test_guideline() -> None:
    """30 degrees and 3 cm give a/b = 0.5176, b = 5.8 cm (6.4)-(6.7); the slide's greatest value is a (6.3)."""
    found = guided()
    assert round(found.b * 100, 1) == 5.8
    assert found.a == 0.03
    assert found.theta_max == pytest.approx(np.radians(30))
    assert np.abs(found.motion(ALPHA).S).max() == pytest.approx(0.03)


def test_forces_over_length() -> None:
    """Figs. 6.2, 6.3: at one a/b the static forces go as 1/a; shaking rises with a."""
    lengths = np.array([0.015, 0.02, 0.03])
    found = over_length(lengths)
    ratio = ratio_from_theta(np.pi / 6)
    for name, exact in ("ball_force", ball_force), ("rod_force", rod_force):
        expected = [exact(Linkage(a, a / ratio), 100) for a in lengths]
        np.testing.assert_allclose(found[name], expected, rtol=5e-3)  # the rest is inertia
        np.testing.assert_allclose(np.array(expected) * lengths, expected[0] * lengths[0])
    assert (np.diff(found["shaking_force"]) > 0).all()
    assert ball_force(guided(), 100) == pytest.approx(100 / 0.03 / np.cos(np.radians(15)))
    assert ball_force(THESIS, 100) == pytest.approx(3442.65, abs=0.005)
    assert rod_force(THESIS, 100) == pytest.approx(2 * 100 / 0.03)
    np.testing.assert_allclose(np.linalg.norm(static().C_force, axis=-1).max(), rod_force(THESIS, 100))


@pytest.mark.parametrize(
    ("a", "offset"),
    [(1.9, 0.0), (1.3, -0.3), (1.7, -0.6), (2.3, -1.2), (1.6, -1.4), (1.2, 0.3), (0.5, 0.0), (0.3, -0.25)],
)
def test_greatest_static_forces_of_any_linkage(a: float, offset: float) -> None:
    """Long couplers and an axis that is moved away: the C-pair carries most between alpha = 0 and 90 degrees."""
    linkage = Linkage(0.05 * a, 0.05, 0.05 * offset)
    found = reactions(linkage, Drive.at(np.linspace(0, np.pi / 2, 200_001)), MASSLESS, crown=200.0)
    for exact, force in (rod_force, found.C_force), (ball_force, found.S_left):
        greatest = np.linalg.norm(force, axis=-1).max()
        assert exact(linkage, 100.0) == pytest.approx(greatest, rel=1e-6)
        assert exact(linkage, -100.0) == exact(linkage, 100.0)


def test_impossible_duties_are_refused() -> None:
    for make, said in (
        (lambda: DifferentialDuty(torque=np.nan), r"DifferentialDuty: torque = nan N\.m must be finite"),
        (lambda: DifferentialDuty(w=np.inf), "DifferentialDuty: w = inf rad/s must be finite"),
        (lambda: DifferentialDuty(radius=0.5), r"radius = 0\.5 m must be greater than half the track"),
        (lambda: DifferentialDuty.cruising(np.nan, 88.0), r"torque = nan N\.m must be finite"),
        (lambda: DifferentialDuty().accelerating(2.0, 1000.0, -0.3), r"wheel_radius = -0\.3 m must be positive"),
        (lambda: rod_force(THESIS, np.nan), r"torque = nan N\.m must be finite"),
        (lambda: ball_force(THESIS, np.inf), r"torque = inf N\.m must be finite"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            make()


def test_alternate_design() -> None:
    """Table 7.1 with an even swing; S-pair force 2.3 % lower, C-pair force higher."""
    other = alternate(THESIS)
    m: Motion = other.motion(np.radians([0, 90, 180, 270, 360]))
    top = other.beta_range[1]
    np.testing.assert_allclose(m.beta, np.array([-1, 1, -1, 1, -1]) * top, atol=1e-12)
    assert top == pytest.approx(THESIS.beta_range[1] / 2, rel=0.05)  # the table's half is approximate
    assert other.d == pytest.approx(0.06 - 0.03 * np.sin(top))
    assert round(100 * (1 - ball_force(other, 100) / ball_force(THESIS, 100)), 1) == 2.3
    assert rod_force(other, 100) / rod_force(THESIS, 100) == pytest.approx(1 / np.cos(top))
    assert peaks(other).rod_force > peaks(THESIS).rod_force
    with pytest.raises(pt.ParameterError, match=r"a/b = 1.5 is above 2/sqrt\(3\)"):
        alternate(Linkage(0.09, 0.06))


def test_accelerating() -> None:
    """The case 7.2 leaves open: at 3 m/s2 with 1200 kg on wheels of 0.3 m the joint forces are 6.4 times those of cruising."""
    cruising = DifferentialDuty()
    fast = cruising.accelerating(3.0, 1200, 0.3)
    assert (fast.torque, fast.dw) == pytest.approx((200 + 1080, 10))
    one, other = (peaks(THESIS, duty=duty) for duty in (cruising, fast))
    assert other.ball_force / one.ball_force == pytest.approx(6.4, rel=1e-2)
    assert other.rod_force / one.rod_force == pytest.approx(6.4, rel=1e-2)
    assert other.shaking_force == pytest.approx(one.shaking_force, rel=1e-5)  # 10 rad/s2 beside 88^2 rad2/s2


def test_front() -> None:
    """No design of the front is better in both, none of many others is; the source's design is not on it."""
    space = Space()
    found = pareto(space=space, points=6)
    shaken, ball = found.values("shaking_force"), found.values("ball_force")
    assert len(found.designs) == 6
    assert (np.diff(shaken) > 0).all()
    assert (np.diff(ball) < 0).all()
    rng = np.random.default_rng(1)
    tried = 0
    while tried < 150:
        a, b, shift = (rng.uniform(*limits) for limits in (space.a, space.b, space.shift))
        if a * (1 + shift) >= 2 * b or Linkage(a, b, shift * a).theta_max > space.theta_max:
            continue
        one = Linkage(a, b, shift * a)
        tried += 1
        peak = peaks(one, scaled(one), points=33)
        assert not ((peak.shaking_force < shaken * 0.999) & (peak.ball_force < ball * 0.999)).any()
    source = peaks(guided(), scaled(guided()))
    assert np.interp(source.ball_force, ball[::-1], shaken[::-1]) < 0.9 * source.shaking_force
    for design in found.designs:
        assert design.theta_max < space.theta_max + 1e-5


def test_front_refuses() -> None:
    with pytest.raises(pt.ParameterError, match="two different names"):
        pareto(("shaking_force", "shaking_force"))
    with pytest.raises(pt.ParameterError, match=r"a = \(0.05, 0.01\) are not valid bounds"):
        Space(a=(0.05, 0.01))
    with pytest.raises(pt.ParameterError, match="theta_max"):
        Space(theta_max=4)


def test_friction_is_the_work_at_the_joints() -> None:
    """kappa T_crown is the sum over the joints of coefficient x load x way, with loads and ways taken from forces and places."""
    joints, h = JointFriction(0.05, 0.08, 0.1, 0.06), 1e-5
    found, m = static(), THESIS.motion(ALPHA)
    load = np.linalg.norm(found.R_left, axis=-1)
    shaft = 2 * joints.mu_shaft * joints.r_shaft * load
    tilt = np.linalg.norm(found.R_left_moment, axis=-1)
    np.testing.assert_allclose(tilt, 0.03 * load)
    pin = 2 * joints.mu_pin * joints.r_pin * (load + 2 * tilt / joints.l_pin) * np.abs(m.beta1)
    n = np.stack([0 * ALPHA, np.sin(ALPHA), -np.cos(ALPHA)], -1)
    turn = np.array([1, 0, 0]) + m.beta1[:, None] * n - m.theta1[:, None] * np.array([0, 1, 0])
    sliding = np.linalg.norm(np.cross(turn, found.S_left), axis=-1)
    ball = 2 * joints.mu_ball * joints.r_ball * sliding
    force, moment = (np.linalg.norm(v, axis=-1) for v in (found.C_force, found.C_moment))
    slide = (THESIS.motion(ALPHA + h).S - THESIS.motion(ALPHA - h).S) / (2 * h)
    way = np.hypot(slide, joints.r_rod * m.theta1)
    rod = joints.mu_rod * np.hypot(force, 2 * moment / joints.l_rod) * way
    np.testing.assert_allclose(joints.kappa(THESIS, ALPHA) * 200, shaft + pin + ball + rod, rtol=1e-8)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: LinkBody(1.0, 0.003, 0.001), r"axial = 0\.003 kg\.m2 must not exceed 2 transverse = 0\.002"),
        (lambda: cylinder(1.0, 0.1, 0.02), "use the exact one"),
        (lambda: LinkBody(0.0, 0.0, 0.001), "needs a mass"),
        (lambda: LinkBody(-1.0, 0.0, 0.0), "m = -1 kg must be zero or positive"),
        (lambda: replace(CORRECTED, output=-0.1), r"output = -0\.1 kg\.m2 must be zero or positive"),
        (lambda: replace(CORRECTED, coupler_centre=-0.1), r"coupler_centre = -0\.1 must be zero or positive"),
        (lambda: LinkageDifferential(centre_coupler=-0.1), r"centre_coupler = -0\.1 is outside"),
        (lambda: pt.simulate(LinkageDifferential(axial_lever=1.0), stop=0.1), "axial_lever"),
    ],
)
def test_impossible_bodies_are_refused(make: Any, said: str) -> None:
    """No disk is thinner than none: axial <= 2 transverse."""
    with pytest.raises(pt.PowertrainError, match=said):
        make()
    assert cylinder(1.0, 0.1, 0.02, transverse="exact").axial == pytest.approx(0.005)


def test_friction_numbers() -> None:
    """No friction: eta_0 = 1. eta_0 falls with mu and varies over alpha; it may vanish. Wrong data are refused."""
    assert (JointFriction().eta_0(THESIS, ALPHA) == 1).all()
    one, two = (JointFriction(mu, mu, mu, mu).eta_0(THESIS, ALPHA) for mu in (0.05, 0.1))
    assert ((two < one) & (one < 1)).all()
    assert one.max() - one.min() > 0.1
    assert (JointFriction(0.9, 0.9, 0.9, 0.9).eta_0(THESIS, np.pi / 2)) < 0
    with pytest.raises(pt.ParameterError, match="mu_pin = -1 must be zero or positive"):
        JointFriction(mu_pin=-1)
    with pytest.raises(pt.ParameterError, match="l_rod = 0 m must be positive"):
        JointFriction(l_rod=0)
