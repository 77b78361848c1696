"""The circular-cam differential as a component: friction that the load makes, locking, both bench experiments of the paper."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from cases import few
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import (
    TABLE_1,
    CircularCamDifferential,
    CircularCams,
    FrictionDisk,
    RollerMasses,
    Sharing,
    bias_ratio,
    latent_efficiency,
    with_friction,
)

SHARINGS = get_args(Sharing)
LOCKING = 0.36
"""Coefficient of friction with which the tracks of Table 1 lock at every phase."""
KINDS = [
    CircularCamDifferential(),
    CircularCamDifferential(mu=LOCKING, sharing="averaged"),
    CircularCamDifferential(mu=0.15, mu_groove=0.05),
    CircularCamDifferential(n=6, stiffness=2.0, uniform="wear"),
    CircularCamDifferential(mu=0.01, sharing="rigid"),
]
AXLE = "0.crown=1.flange_a 0.left=2.flange_a 0.right=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.flange=3.flange_b"


def axle(
    differential: Differential, torques: tuple[float, float, float], J: tuple[float, float, float] = (0.5, 1.0, 1.2)
) -> pt.Component:
    """Inertias on crown, left, right, and torques on them."""
    parts = [rot.Inertia(J=each) for each in J] + [rot.ConstantTorque(tau_constant=each) for each in torques]
    return joined(differential, *parts, joints=AXLE)


def experiment_1(differential: Differential, torque: float, assist: float) -> pt.Component:
    """The right shaft in a clamp, the left one free, a torque on the retainer; an assisting torque on the left shaft."""
    parts = rot.Fixed(), rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=torque)
    left = rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=assist)
    joints = "0.right=1.flange 0.crown=2.flange_a 2.flange_b=3.flange 0.left=4.flange_a 4.flange_b=5.flange"
    return joined(differential, *parts, *left, joints=joints)


def experiment_2(differential: Differential, torque: float, assist: float) -> pt.Component:
    """The retainer in a clamp, a torque on the left shaft; an assisting torque on the right shaft, the other way."""
    parts = rot.Fixed(), rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=torque)
    right = rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=-assist)
    joints = "0.crown=1.flange 0.left=2.flange_a 2.flange_b=3.flange 0.right=4.flange_a 4.flange_b=5.flange"
    return joined(differential, *parts, *right, joints=joints)


def shafts(result: Any) -> tuple[Any, Any, Any]:
    """Torques that come in at the crown, and go out at the left and the right."""
    return result["parts[0].crown.tau"], -result["parts[0].left.tau"], -result["parts[0].right.tau"]


@pytest.mark.parametrize("sharing", SHARINGS)
def test_locking_coefficient_is_that_of_the_design(sharing: Sharing) -> None:
    """Over several arcs both ways; the torques differ by kappa |T_C|."""
    differential = CircularCamDifferential.from_design(TABLE_1, sharing=sharing, mu_groove=0.03)
    parts = (
        differential,
        rot.ConstantSpeed(w_fixed=-9),
        rot.ConstantSpeed(w_fixed=-1),
        rot.ConstantTorque(tau_constant=100),
    )
    result = run(
        joined(*parts, joints="0.left=1.flange 0.right=2.flange 0.crown=3.flange"), 2.0, times=np.linspace(0, 2, 401)
    )
    theta, kappa = result["parts[0].theta"], result["parts[0].kappa"]
    assert theta[-1] == pytest.approx(-8)
    expected = TABLE_1.kappa(theta, sharing, mu_groove=0.03)
    smaller = np.maximum(1e-9, np.minimum(*TABLE_1.sines(theta)))
    bounded = 0.5e-6 / smaller**2 if sharing == "rigid" else 0.0  # by a sine of 0.001
    finite = np.isfinite(expected)
    assert (np.abs(kappa / expected - 1) < 1e-9 + bounded)[finite].all()
    assert np.isfinite(kappa).all()
    crown, left, right = shafts(result)
    np.testing.assert_allclose(right - left, -kappa * crown, rtol=1e-9)
    np.testing.assert_allclose(left + right, crown, rtol=1e-9)


def test_from_design_is_the_design() -> None:
    cams = CircularCams.build(
        D_out=0.12,
        D_in=0.08,
        r_out=0.01,
        r_in=0.008,
        alpha_out=0.3,
        alpha_in=0.5,
        disk=FrictionDisk(0.13, 0.06, 0.1, "wear"),
        n=6,
    )
    differential = CircularCamDifferential.from_design(cams, stiffness=1.7)
    parts = (
        differential,
        rot.ConstantSpeed(w_fixed=1),
        rot.ConstantSpeed(w_fixed=-1),
        rot.ConstantTorque(tau_constant=10),
    )
    result = run(joined(*parts, joints="0.left=1.flange 0.right=2.flange 0.crown=3.flange"), 3.0)
    np.testing.assert_allclose(result["parts[0].kappa"], cams.kappa(result["parts[0].theta"], stiffness=1.7), rtol=1e-9)


@pytest.mark.parametrize("torques", [(300.0, -60.0, -110.0), (-300.0, 60.0, 110.0), (50.0, 20.0, -70.0)])
def test_without_friction_it_is_the_bevel_differential(torques: tuple[float, float, float]) -> None:
    """In the limit too: the error goes with kappa."""
    bevel = run(axle(BevelDifferential(), torques), 1.0)
    for mu, error in ((0.0, 1e-9), (1e-6, 1e-4)):
        cam = run(axle(CircularCamDifferential(mu=mu), torques), 1.0)
        for i in (1, 2, 3):
            assert cam[f"parts[{i}].w"][-1] == pytest.approx(bevel[f"parts[{i}].w"][-1], rel=error, abs=error)


@pytest.mark.parametrize(
    "torques", [(300.0, -60.0, -110.0), (-300.0, 60.0, 110.0), (300.0, -100.0, -101.0), (0.0, 30.0, -30.0)]
)
def test_constant_coefficient_is_a_limited_slip_differential(torques: tuple[float, float, float]) -> None:
    cams = with_friction(TABLE_1, 0.1)
    bias = float(bias_ratio(cams.kappa(0.0, "averaged")))
    cam = run(axle(CircularCamDifferential.from_design(cams, sharing="averaged"), torques), 1.0)
    slip = run(axle(LimitedSlipDifferential(preload=0, bias_drive=bias, bias_coast=bias), torques), 1.0)
    assert cam["parts[0].mode"][-1] == slip["parts[0].mode"][-1]
    for i in (1, 2, 3):
        assert cam[f"parts[{i}].w"][-1] == pytest.approx(slip[f"parts[{i}].w"][-1], rel=1e-9, abs=1e-9)
    crown, left, right = shafts(cam)
    if cam["parts[0].mode"][-1]:
        shares = sorted((abs(left[-1]), abs(right[-1])))
        assert shares[1] / shares[0] == pytest.approx(bias)
        assert left[-1] + right[-1] == pytest.approx(crown[-1])


def test_constant_coefficient_is_the_mesh_law() -> None:
    """The bevel differential with eta_0 = (1 - kappa)/(1 + kappa), while both shafts are loaded the same way."""
    eta = float(latent_efficiency(TABLE_1.kappa(0.0, "averaged", mu_groove=0.02)))
    cam = CircularCamDifferential.from_design(TABLE_1, sharing="averaged", mu_groove=0.02)
    for torques in (300.0, -60.0, -200.0), (-300.0, 60.0, 200.0):
        one, other = (run(axle(each, torques), 1.0) for each in (cam, BevelDifferential(eta=eta)))
        assert one["parts[0].mode"][-1] != 0
        for i in (1, 2, 3):
            assert one[f"parts[{i}].w"][-1] == pytest.approx(other[f"parts[{i}].w"][-1], rel=1e-9)


EXPERIMENTS: dict[str, tuple[Any, Callable[[float], float]]] = {
    "1": (experiment_1, lambda k: (k - 1) / 2),
    "2": (experiment_2, lambda k: (k - 1) / (k + 1)),
}


@pytest.mark.slow
@pytest.mark.parametrize("experiment", EXPERIMENTS)
@pytest.mark.parametrize("torque", [1.0, 1e4, -40.0])
@pytest.mark.parametrize(("sharing", "theta"), [("averaged", 0.0), ("elastic", 0.0), ("elastic", 0.4), ("rigid", 0.4)])
def test_bench_experiments_of_a_locking_differential(
    experiment: str, torque: float, sharing: Sharing, theta: float
) -> None:
    """Impossible to turn whatever the torque; a torque on the other free shaft releases it, of the size that virtual work gives."""
    bench, share = EXPERIMENTS[experiment]
    cams = with_friction(TABLE_1, LOCKING)
    differential, start = CircularCamDifferential.from_design(cams, sharing=sharing), {"0.theta": theta}
    kappa = float(cams.kappa(theta, sharing))
    assert kappa > 1
    release = share(kappa) * torque
    for assist in (0.0, 0.999 * release):
        result = run(bench(differential, torque, assist), 1.0, start)
        assert (result["parts[0].mode"] == 0).all()
        assert np.abs(result["parts[0].w_rel"]).max() < 1e-9
    turning = run(bench(differential, torque, 1.001 * release), 0.01, start)
    assert turning["parts[0].mode"][0] == np.sign(torque)
    assert abs(turning["parts[0].theta"][-1] - theta) > 0
    cage, left, right = (turning[f"parts[0].{name}.phi"] for name in ("crown", "left", "right"))
    moved = left - left[0]
    if experiment == "1":  # twice as fast as the retainer
        np.testing.assert_allclose(moved, 2 * (cage - cage[0]), rtol=1e-9, atol=1e-13)
    else:  # opposite directions at the same speed
        np.testing.assert_allclose(moved, -(right - right[0]), rtol=1e-9, atol=1e-13)
    assert pt.energy_audit(turning).closure < 1e-8


@pytest.mark.parametrize("experiment", EXPERIMENTS)
@pytest.mark.parametrize(("sharing", "theta"), [("averaged", 0.0), ("elastic", 0.0), ("rigid", 0.4)])
def test_bench_experiments_with_the_paper_s_own_data(experiment: str, sharing: Sharing, theta: float) -> None:
    """Table 1 does not lock: the free shaft turns without any assistance, under the smallest torque."""
    bench, _ = EXPERIMENTS[experiment]
    differential = CircularCamDifferential.from_design(TABLE_1, sharing=sharing)
    assert TABLE_1.kappa(theta, sharing) < 1
    result = run(bench(differential, 1.0, 0.0), 0.1, {"0.theta": theta})
    assert (result["parts[0].mode"] == 1).all()
    assert result["parts[0].w_rel"][-1] > 0.1


def test_acceleration_in_experiment_1() -> None:
    """2 J_L a_C = T_L = (1 - kappa)/2 T_C + assist, J_C a_C = T - T_C."""
    for mu, assist in ((0.066, 0.0), (0.3, 60.0)):
        cams = with_friction(TABLE_1, mu)
        k = float(cams.kappa(0.0, "averaged"))
        result = run(experiment_1(CircularCamDifferential.from_design(cams, sharing="averaged"), 100.0, assist), 1.0)
        a = (assist + (1 - k) / 2 * 100) / (2 * 0.1 + (1 - k) / 2 * 0.1)
        assert result["parts[2].w"][-1] == pytest.approx(a)
        crown, left, right = shafts(result)
        assert crown[-1] == pytest.approx(100 - 0.1 * a)
        assert right[-1] - left[-1] == pytest.approx(k * crown[-1])


def test_locks_where_the_phase_comes_to_lock() -> None:
    """With a coefficient that passes one on the way it turns from a phase where it slips and stays stuck where it locks."""
    cams = with_friction(TABLE_1, 0.3)
    assert cams.kappa(0.0) < 1 < cams.kappa(0.3)
    result = run(experiment_1(CircularCamDifferential.from_design(cams), 100.0, 0.0), 1.0)
    assert result["parts[0].mode"][0] == 1
    assert result["parts[0].mode"][-1] == 0
    assert result["parts[0].kappa"][-1] > 1
    assert result["parts[0].w_rel"][-1] == 0
    assert pt.energy_audit(result).closure < 1e-8


def test_stuck_is_tried_first() -> None:
    """A light free shaft, a heavy cage: at rest it stays at rest, though a sliding motion would satisfy the law too."""
    T, J_C, J_L, assist = 100.0, 10.0, 0.01, 20.0
    cams = with_friction(TABLE_1, 0.3)
    k = float(cams.kappa(0.0, "averaged"))
    bracket = 4 / J_C + (1 - k) / J_L  # the clamped right shaft has no term
    sliding = (4 * T / J_C - 2 * assist / J_L) / bracket
    assert bracket < 0 < sliding  # consistent with T_C > 0
    assert assist < (k - 1) / 2 * T  # but the friction holds it as well
    differential = CircularCamDifferential.from_design(cams, sharing="averaged")
    model = pt.replace(experiment_1(differential, T, assist))
    parts = list(model.parts)  # type: ignore[attr-defined]
    parts[2], parts[4] = rot.Inertia(J=J_C), rot.Inertia(J=J_L)
    for sign in (1.0, -1.0):
        parts[3], parts[5] = (rot.ConstantTorque(tau_constant=sign * each) for each in (T, assist))
        model = pt.replace(model, parts=tuple(parts))
        assert (run(model, 1.0)["parts[0].mode"] == 0).all()
        # Turning halves would have to seize within no time, or could go on in two ways.
        parts[5] = rot.ConstantTorque(tau_constant=0.0)
        free = pt.replace(model, parts=tuple(parts))
        with pytest.raises(pt.PowertrainError, match=r"consistent|jams") as caught:
            run(free, 1.0, {"0.w_rel": sign * 2.0})
        assert re.search(
            r"bounds in the wrong order, 0\.131276 and -0\.131276 N\.m, speed -?2 rad/s", str(caught.value)
        )


def test_compliance_tells_how_it_seizes() -> None:
    """The same with a compliant shaft between crown and heavy cage: turning halves come to rest, and nothing is ambiguous."""
    cams = with_friction(TABLE_1, 0.3)
    differential = CircularCamDifferential.from_design(cams, sharing="averaged")
    parts = rot.Fixed(), rot.Inertia(J=10), rot.ConstantTorque(tau_constant=100), rot.SpringDamper(c=2e3, d=20)
    joints = "0.right=1.flange 0.crown=4.flange_b 4.flange_a=2.flange_a 2.flange_b=3.flange 0.left=5.flange_a"
    model = joined(differential, *parts, rot.Inertia(J=0.01), joints=joints)
    result = run(model, 0.5, {"0.w_rel": 2.0, "2.w": 1.0}, rtol=1e-8)
    assert result["parts[0].w_rel"][0] == pytest.approx(2)
    assert result["parts[0].mode"][-1] == 0
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("differential", few(KINDS), ids=repr)
def test_energy_and_mirrored_axle(differential: Differential) -> None:
    def swing(left: str, right: str, sign: float = 1.0, theta: float = 0.1) -> Any:
        parts = differential, rot.Inertia(J=0.5), rot.Inertia(J=1), rot.Inertia(J=1.2)
        drive = rot.ConstantTorque(tau_constant=sign * 20), rot.Torque(), Sine(amplitude=sign * 35, f=0.8)
        joints = f"0.crown=1.flange_a 0.{left}=2.flange_a 0.{right}=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.y=5.tau"
        return run(joined(*parts, *drive, joints=joints), 3.0, {"0.theta": theta})

    one, other, reversed_ = (
        swing("left", "right"),
        swing("right", "left", theta=-0.1),
        swing("left", "right", -1.0, -0.1),
    )
    for i in (1, 2, 3):
        end = one[f"parts[{i}].w"][-1]
        assert other[f"parts[{i}].w"][-1] == pytest.approx(end, rel=1e-6)
        assert reversed_[f"parts[{i}].w"][-1] == pytest.approx(-end, rel=1e-6)
    assert {-1.0, 1.0} & set(one["parts[0].mode"])
    audit = pt.energy_audit(one)
    assert audit.closure < 1e-8
    assert np.asarray(audit.loss).min() >= -1e-7
    crown, left, right = shafts(one)
    slides = np.abs(one["parts[0].w_rel"]) > 1e-8
    difference, kappa = right - left, one["parts[0].kappa"]
    expected = (kappa * np.abs(crown) * np.sign(one["parts[0].w_rel"]))[slides]
    np.testing.assert_allclose(difference[slides], expected, rtol=1e-6, atol=1e-6)
    assert (np.abs(difference) <= kappa * np.abs(crown) + 1e-6).all()


def test_ends_of_arcs_do_not_disturb_the_integration() -> None:
    """The corner of kappa is located: a loose tolerance gives the same end within it."""
    model = axle(CircularCamDifferential(), (300.0, -20.0, -180.0))
    loose, tight = run(model, 1.0, rtol=1e-6), run(model, 1.0)
    assert tight["parts[0].theta"][-1] > 2 * math.pi / 4  # several half arcs
    assert loose["parts[1].w"][-1] == pytest.approx(tight["parts[1].w"][-1], rel=1e-5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CircularCamDifferential(alpha_out=0.0), r"alpha_out = 0 rad is outside its range \(0, 1.5708\)"),
        (lambda: CircularCamDifferential(alpha_in=math.radians(91)), "alpha_in = 1.588"),
        (lambda: CircularCamDifferential(alpha_in=math.pi / 2), "alpha_in = 1.5708 rad is outside"),
        (lambda: CircularCamDifferential(n=3), "n = 3 arcs: .* even number"),
        (lambda: CircularCamDifferential(D_in=0.09), "(?s)the inner track lies inside.*D_out = 0.085 m, D_in = 0.09 m"),
        (lambda: CircularCamDifferential(d_in=0.1), "(?s)hole of the friction disk.*d_out = 0.095 m, d_in = 0.1 m"),
        (lambda: CircularCamDifferential(mu=-0.1), "mu = -0.1"),
        (lambda: CircularCamDifferential(sharing="all"), "sharing = 'all' is none of"),  # type: ignore[arg-type]
        (lambda: CircularCamDifferential(uniform="all"), "uniform = 'all' is none of"),  # type: ignore[arg-type]
        (lambda: pt.replace(CircularCamDifferential(), n=5), "n = 5 arcs"),
        (lambda: replace(TABLE_1.outer, n=7), "n = 7 arcs"),
    ],
)
def test_impossible_data_are_refused(make: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        make()


def test_tracks_without_room_for_rollers_are_refused() -> None:
    """Rollers that keep the cams apart need a radius of half the lift, and a fifth of it as width; given ones twice the radius."""
    with pytest.raises(pt.ParameterError, match="the tracks leave no width to the rollers"):
        CircularCamDifferential(D_out=0.085, D_in=0.084)
    masses = RollerMasses.of(TABLE_1)
    assert CircularCamDifferential(masses=masses).masses == masses
    with pytest.raises(pt.ParameterError, match="the cams collide where a hill passes a hill"):
        CircularCamDifferential(masses=pt.replace(masses, r_out=0.004))
    with pytest.raises(pt.ParameterError, match="otherwise neighbouring rollers overlap"):
        CircularCamDifferential(masses=pt.replace(masses, r_out=0.031))  # 60.1 mm apart


def test_cams_too_steep_for_their_number_of_rollers_are_refused() -> None:
    """Two arcs around the circle: as in ``Track``, no roller is larger than half the lift and smaller than half the distance."""
    limit = 2 * math.atan(2 / math.pi)
    assert CircularCamDifferential(n=2, alpha_out=0.999 * limit)
    with pytest.raises(
        pt.ParameterError, match=r"lift < spacing  # otherwise neighbouring rollers overlap(.|\n)*alpha_out"
    ):
        CircularCamDifferential(n=2, alpha_out=1.001 * limit)
