"""The linkage differential in simulations: torques, energy, limits that are known, friction, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import BevelDifferential, Differential
from powertrain.components.gearless.linkage import (
    CORRECTED,
    TABLE_5_1,
    JointFriction,
    Linkage,
    LinkageDifferential,
    LinkMasses,
)
from powertrain.components.gearless.linkage.design import alternate
from powertrain.components.gearless.linkage.forces import Drive, torques
from powertrain.components.gearless.linkage.masses import LinkBody

THESIS = Linkage(0.03, 0.06)
NOTHING = LinkBody(0.0, 0.0, 0.0)
MASSLESS = LinkMasses(NOTHING, NOTHING, NOTHING)
GRIPPY = JointFriction(0.05, 0.05, 0.05, 0.05)
STIFF = JointFriction(1.2, 1.2, 1.2, 1.2)
WHEELS = "0.left=1.flange_a 0.right=2.flange_a 0.crown=3.flange_a"


def free(differential: Differential, *, left: float = 0.05, right: float = 0.05, cage: float = 0.01) -> Any:
    """With an inertia on each shaft and nothing else."""
    return joined(differential, *(rot.Inertia(J=J) for J in (left, right, cage)), joints=WHEELS)


def driven(differential: Differential, cage: float, left: float, torque: float, stop: float) -> Any:
    """Cage and left shaft turn as given, a torque acts on the right shaft."""
    parts = differential, rot.ConstantSpeed(w_fixed=cage), rot.ConstantSpeed(w_fixed=left)
    joints = "0.crown=1.flange 0.left=2.flange 0.right=3.flange"
    return run(joined(*parts, rot.ConstantTorque(tau_constant=torque), joints=joints), stop)


@pytest.mark.parametrize("linkage", [THESIS, alternate(THESIS)], ids=["thesis", "alternate"])
def test_the_bend_of_the_source(linkage: Linkage) -> None:
    """Cage 88 rad/s, one wheel 96.8 rad/s, -100 N.m on the other: it turns at 79.2 rad/s; torques and lever over one internal cycle."""
    masses = LinkMasses(CORRECTED.cage, TABLE_5_1.coupler, TABLE_5_1.lever, output=0.01, coupler_centre=0.4)
    made = LinkageDifferential.of(linkage, masses, alpha_0=0.3)
    result = driven(made, 88, 96.8, -100, 2 * np.pi / 8.8)
    alpha = result["parts[0].alpha"]
    assert alpha[-1] == pytest.approx(0.3 + 2 * np.pi)
    np.testing.assert_allclose(result["parts[0].w_diff"], 8.8)
    needed = torques(linkage, Drive.at(alpha, w=88, u=8.8), masses, right=-100)
    for shaft in "crown", "left", "right":
        np.testing.assert_allclose(result[f"parts[0].{shaft}.tau"], getattr(needed, shaft), rtol=1e-9)
    turned = result["parts[0].right.phi"][-1] / (2 * np.pi / 8.8)
    assert turned == pytest.approx(79.2)


def test_cage_held_it_is_a_coupling_of_1_to_minus_1() -> None:
    """2000 rpm in, -2000 rpm out (5.1.2); the drive only moves the links: its torque has no mean over a turn."""
    model = joined(
        LinkageDifferential(),
        rot.Fixed(),
        rot.ConstantSpeed(w_fixed=209.4),
        rot.Inertia(J=1e-3),
        joints="0.crown=1.flange 0.left=2.flange 0.right=3.flange_a",
    )
    result = run(model, 2 * np.pi / 209.4, points=400)
    np.testing.assert_allclose(result["parts[3].w"], -209.4)
    torque = result["parts[0].left.tau"]
    assert abs(np.trapezoid(torque, result.time)) < 1e-6 * np.trapezoid(np.abs(torque), result.time)
    assert np.abs(torque).max() > 1


def kinetic_energy(linkage: Linkage, masses: LinkMasses, alpha: float, u: float, w: float) -> float:
    """Of all bodies one by one, their velocities by differences of their places and axes along the motion."""
    h = 1e-6

    def state(t: float) -> list[tuple[LinkBody, np.ndarray, np.ndarray]]:
        """Body, centre, unit vectors."""
        m, phi = linkage.motion(alpha + u * t), w * t
        turn = np.array([[1, 0, 0], [0, np.cos(phi), -np.sin(phi)], [0, np.sin(phi), np.cos(phi)]])
        s, c = np.sin(alpha + u * t), np.cos(alpha + u * t)
        bodies = []
        for side in (1, -1):
            flip = np.array([side, 1, side])
            sin, cos = np.sin(m.beta), np.cos(m.beta)
            axes = np.array([[sin, c * cos, s * cos], [0, s, -c], [cos, -c * sin, -s * sin]]) * flip
            hinge = np.array([-linkage.d * side, 0, 0])
            bodies.append((masses.coupler, hinge + masses.coupler_centre * linkage.a * axes[0], axes))
        ct, st = np.cos(m.theta), np.sin(m.theta)
        bodies.append((masses.lever, np.array([0, m.S, 0]), np.array([[ct, 0, -st], [0, 1, 0], [st, 0, ct]])))
        bodies.append((masses.cage, np.zeros(3), np.eye(3)))
        return [(body, turn @ place, axes @ turn.T) for body, place, axes in bodies]

    total = masses.output * ((w + u) ** 2 + (w - u) ** 2) / 2
    for (body, _, axes), (_, before, old), (_, after, new) in zip(state(0), state(-h), state(h), strict=True):
        v, rates = (after - before) / (2 * h), (new - old) / (2 * h)
        omega = np.cross(axes, rates).sum(0) / 2
        along = omega @ axes[0]
        total += body.m * v @ v / 2 + (body.transverse * (omega @ omega - along**2) + body.axial * along**2) / 2
    return float(total)


@pytest.mark.parametrize("made", [Linkage(), Linkage(0.04, 0.05, 0.006)], ids=str)
def test_energy_of_all_bodies(made: Linkage) -> None:
    """energy() is the sum over the bodies, in free motion without friction, which keeps it and the angular momentum about the shafts."""
    masses = LinkMasses(CORRECTED.cage, TABLE_5_1.coupler, TABLE_5_1.lever, output=0.002)
    model = free(LinkageDifferential.of(made, masses, alpha_0=0.4), left=1e-3, right=2e-3, cage=1e-3)
    result = run(model, 0.4, starts={"0.w": 60.0, "0.w_diff": 9.0})
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-8
    stored = np.asarray(audit.energy["parts[0]"])
    picked = range(0, len(stored), 50)
    state = [result.at(audit.time, f"parts[0].{name}") for name in ("alpha", "w_diff", "w")]
    bodies = [kinetic_energy(made, masses, *(float(v[i]) for v in state)) for i in picked]
    np.testing.assert_allclose(stored[picked], bodies, rtol=1e-6)
    total = stored + sum(np.asarray(audit.energy[f"parts[{i}]"]) for i in (1, 2, 3))
    np.testing.assert_allclose(total, total[0], rtol=1e-8)
    assert np.ptp(result["parts[0].w_diff"]) > 1.0  # the centrifugal torque and the change of inertia are at work


def test_centrifugal_torque_holds_the_lever() -> None:
    """At speed the lever swings about its outermost place: at alpha near 0 with frequency^2 = -J''w^2/(2 M), shafts equal."""
    made = LinkageDifferential(alpha_0=0.001)
    model = free(made, left=0.0, right=0.0, cage=1e3)
    w = 100.0
    k = 0.5
    a, c, lever = 0.03, TABLE_5_1.coupler, TABLE_5_1.lever
    across = c.transverse + c.m * (a / 2) ** 2
    M = 2 * across + k**2 * lever.transverse
    curved = -2 * lever.m * a**2 + 2 * k**2 * (
        lever.transverse - lever.axial
    )  # J'' at alpha = 0, to which beta adds nothing
    period = 2 * np.pi / (w * np.sqrt(-curved / (2 * M)))
    result = run(model, period, starts={"0.w": w, "0.w_diff": 0.0})
    alpha = result["parts[0].alpha"]
    assert alpha[-1] == pytest.approx(0.001, rel=1e-4)
    assert alpha.min() == pytest.approx(-0.001, rel=1e-4)


def test_without_masses_and_friction_it_is_the_bevel_differential() -> None:
    """The same speeds and torques under the same load."""
    drives = tuple(Sine(amplitude=A, f=f) for A, f in ((5.0, 0.7), (3.0, 1.1), (8.0, 0.4)))
    times = np.linspace(0, 2, 81)
    joints = f"{WHEELS} 1.flange_b=4.flange 2.flange_b=5.flange 3.flange_b=6.flange 4.tau=7.y 5.tau=8.y 6.tau=9.y"
    results = []
    for part in LinkageDifferential.of(THESIS, MASSLESS, alpha_0=0.2), BevelDifferential():
        rotors = (rot.Inertia(J=J) for J in (0.3, 0.2, 0.5))
        results.append(run(joined(part, *rotors, *(rot.Torque(),) * 3, *drives, joints=joints), 2.0, times=times))
    for name in "left.tau", "right.tau", "crown.tau", "left.phi", "crown.phi":
        one, other = (result.at(times, f"parts[0].{name}") for result in results)
        np.testing.assert_allclose(one, other, atol=1e-7)


@pytest.mark.parametrize("torque", [50.0, -50.0])
@pytest.mark.parametrize("u", [2.0, -2.0])
def test_shares_of_the_torque(torque: float, u: float) -> None:
    """The smaller over the larger torque is eta_0(alpha); the slower side of a driven axle gets more; their difference is what is lost."""
    result = driven(LinkageDifferential.of(THESIS, MASSLESS, GRIPPY), 10, 10 + u, -torque, 2.0)
    left, right = (-result[f"parts[0].{side}.tau"] for side in ("left", "right"))
    alpha, crown = result["parts[0].alpha"], result["parts[0].crown.tau"]
    kappa = GRIPPY.kappa(THESIS, alpha)
    np.testing.assert_allclose(right - left, kappa * np.abs(crown) * np.sign(u), rtol=1e-9)
    small, large = (of(np.abs(left), np.abs(right)) for of in (np.minimum, np.maximum))
    np.testing.assert_allclose(small / large, GRIPPY.eta_0(THESIS, alpha))
    np.testing.assert_allclose(result["parts[0].lossPower"], (right - left) * u, rtol=1e-9)
    assert (result["parts[0].lossPower"] > 0).all()
    assert pt.energy_audit(result).closure < 1e-8


def on_split_ground(joints: JointFriction, crown: float) -> Any:
    """The left wheel on ice (8 N.m), the right one on dry ground; car of the inertia of a wheel."""
    parts: tuple[pt.Component, ...] = (
        LinkageDifferential.of(THESIS, MASSLESS, joints, alpha_0=0.5),
        *(rot.Inertia(J=J) for J in (1.0, 1.0, 0.1)),
        rot.Brake(mue_pos=((0.0, 1.0),), cgeo=1.0, fn_max=8.0),
        rot.Brake(mue_pos=((0.0, 1.0),), cgeo=1.0, fn_max=200.0),
        rot.ConstantTorque(tau_constant=crown),
        Sine(amplitude=0.0, f=1.0, offset=1.0),
    )
    ground = " 1.flange_b=4.flange_a 2.flange_b=5.flange_a 3.flange_b=6.flange 4.f_normalized=7.y 5.f_normalized=7.y"
    return run(joined(*parts, joints=WHEELS + ground), 1.0, starts={"0.w": 0.0, "0.w_diff": 0.0})


@pytest.mark.slow
def test_locking() -> None:
    """kappa > 1: both sides stand still or turn together, however different their grip; below 1 the side on ice spins."""
    locked = on_split_ground(STIFF, 100.0)
    assert (STIFF.kappa(THESIS, np.linspace(0, 3, 50)) > 1).all()
    assert np.abs(locked["parts[0].w_diff"]).max() < 1e-12
    assert (locked["parts[0].mode"] == 0).all()
    spinning = on_split_ground(GRIPPY, 100.0)
    assert spinning["parts[0].w_diff"][-1] > 1.0
    assert pt.energy_audit(spinning).closure < 1e-6
    assert abs(spinning["parts[2].w"][-1]) < 1e-12


def test_left_and_right_are_alike() -> None:
    """With sides exchanged and alpha of the other sign the same motion comes out, mirrored."""
    results = []
    for sign in 1, -1:
        made = LinkageDifferential.of(Linkage(0.03, 0.06, 0.003), TABLE_5_1, GRIPPY, alpha_0=sign * 0.4)
        inertias = (0.02, 0.05) if sign > 0 else (0.05, 0.02)
        results.append(
            run(free(made, left=inertias[0], right=inertias[1]), 0.5, starts={"0.w": 50.0, "0.w_diff": sign * 8.0})
        )
    one, other = results
    for name, mirrored, sign in (
        ("parts[1].w", "parts[2].w", 1),
        ("parts[0].alpha", "parts[0].alpha", -1),
        ("parts[0].left.tau", "parts[0].right.tau", 1),
    ):
        np.testing.assert_allclose(one.at(one.time, name), sign * other.at(one.time, mirrored), atol=1e-5)


def test_defaults_are_the_source() -> None:
    assert LinkageDifferential() == LinkageDifferential.of()
    assert isinstance(LinkageDifferential(), Differential)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"a": 0.12}, "(?s)does not reach.*at alpha = 90.*a = 0.12 m, b = 0.06 m"),
        ({"b": 0.01}, "a = 0.03 m, b = 0.01 m, offset = 0 m"),
        ({"a": 0.0}, r"LinkageDifferential.a = 0 m is outside"),
        ({"offset": -0.03}, "(?s)at alpha = 0.*offset = -0.03 m"),
        ({"l_rod": 0.0}, "l_rod = 0 m"),
        ({"m_lever": -1.0}, "m_lever = -1 kg"),
        ({"mu_ball": -0.1}, "mu_ball = -0.1"),
    ],
)
def test_refusals(values: dict[str, float], message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        LinkageDifferential(**values)
    if len(values) == 1 and "a" not in values:
        with pytest.raises(pt.ParameterError):
            pt.replace(LinkageDifferential(), values)


def test_lengths_that_do_not_fit_in_a_run() -> None:
    """A compiled model takes other lengths; those that cannot be assembled are refused before the simulation."""
    plant = pt.compile(free(LinkageDifferential()))
    good = plant.simulate(0.1, parameters={"parts[0].a": 0.05}, starts={"parts[0].w": 10.0, "parts[0].w_diff": 1.0})
    assert good.parameters["parts[0].a"] == 0.05
    with pytest.raises(pt.ParameterError, match=r"(?s)alpha = 90.*parts\[0\]\.a = 0\.13 m, parts\[0\]\.b = 0\.06 m"):
        plant.simulate(0.1, parameters={"parts[0].a": 0.13}, starts={"parts[0].w": 10.0, "parts[0].w_diff": 1.0})
