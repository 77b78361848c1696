"""Worm, rack, screw, band brake, universal joint and dog clutch against their closed forms."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, TimeTable

RHO = math.atan(0.1 / math.cos(math.radians(20)))


def worm(lead: float, tau_a: float, tau_b: float, w: float = 0.0, stop: float = 1.0) -> Any:
    """A worm of ratio 30 between inertias of 0.01 and 2 kg.m2 with a torque on each."""
    parts = rot.WormGear(ratio=30, lead=lead, mue=0.1), rot.Inertia(J=0.01), rot.Inertia(J=2)
    torques = rot.ConstantTorque(tau_constant=tau_a), rot.ConstantTorque(tau_constant=tau_b)
    wired = "0.flange_a=1.flange_a 1.flange_b=3.flange 0.flange_b=2.flange_a 2.flange_b=4.flange"
    return run(joined(*parts, *torques, joints=wired), stop, {"1.w": w})


@pytest.mark.parametrize("lead", [0.05, 0.3])
def test_a_worm_lifts_with_its_efficiency(lead: float) -> None:
    """tau_a - J_a a = (load + J_b a/ratio)/(ratio eta): the wheel's torque and inertia through tan(lead)/tan(lead + rho)."""
    eta = math.tan(lead) / math.tan(lead + RHO)
    result = worm(lead, 20.0, -60.0)
    a = (20 - 60 / 30 / eta) / (0.01 + 2 / 30**2 / eta)
    assert result["parts[1].w"][-1] == pytest.approx(a, rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-8


def test_a_worm_of_small_lead_locks_itself() -> None:
    """lead < rho: no torque of the wheel moves it; running down it needs load |eta_2| at the worm, else it stops."""
    lead = 0.05
    assert lead < RHO
    for load in (-600.0, 600.0):
        assert np.abs(worm(lead, 0.0, load)["parts[1].w"]).max() < 1e-9
    eta_2 = math.tan(lead - RHO) / math.tan(lead)
    assert eta_2 < 0
    stopped = worm(lead, 0.0, -60.0, w=-100.0, stop=5.0)
    assert abs(stopped["parts[1].w"][-1]) < 1e-9
    lowered = worm(lead, 4.0 * eta_2, -60.0, stop=1.0)["parts[1].w"][-1]
    a = (4 * eta_2 - 2 * eta_2) / (0.01 + eta_2 * 2 / 30**2)
    assert lowered == pytest.approx(a, rel=1e-6)


def test_a_worm_of_large_lead_is_driven_by_its_wheel() -> None:
    lead = 0.5
    eta_2 = math.tan(lead - RHO) / math.tan(lead)
    result = worm(lead, 0.0, -60.0)
    assert result["parts[1].w"][-1] == pytest.approx(-2 * eta_2 / (0.01 + eta_2 * 2 / 30**2), rel=1e-6)


@pytest.mark.parametrize(("push", "force"), [(50.0, -400.0), (0.0, -400.0), (30.0, -290.0)])
def test_rack_and_pinion(push: float, force: float) -> None:
    """radius 0.1 m, efficiency 0.8: 400 N hold against 32 to 50 N.m."""
    parts = rot.RackAndPinion(radius=0.1, efficiency=0.8), rot.Inertia(J=0.02), tr.Mass(m=3)
    loads = rot.ConstantTorque(tau_constant=push), tr.ConstantForce(f_constant=force)
    wired = "0.flangeR=1.flange_a 1.flange_b=3.flange 0.flangeT=2.flange_a 2.flange_b=4.flange"
    result = run(joined(*parts, *loads, joints=wired), 1.0)
    load = -force * 0.1
    if load * 0.8 <= push <= load / 0.8:
        assert np.all(result["parts[2].v"] == 0)
    else:
        eta = 1 / 0.8 if push > load else 0.8
        a = (push - load * eta) / (0.02 / 0.1 + 3 * 0.1 * eta)
        assert result["parts[2].v"][-1] == pytest.approx(a, rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-8


def test_a_screw_holds_and_lifts() -> None:
    """A trapezoidal thread Tr 20 x 4, mue 0.12: what 1 kN takes, and that it locks itself."""
    lead, rho = math.atan(4 / (math.pi * 18)), math.atan(0.12 / math.cos(math.radians(15)))
    lift = 1000 * 0.018 / 2 * math.tan(lead + rho)
    for torque, moves in ((1.01 * lift, True), (0.99 * lift, False), (0.0, False)):
        parts = rot.Screw(p=4e-3, d=18e-3, mue=0.12, alpha=math.radians(15)), rot.Inertia(J=1e-3), tr.Mass(m=100)
        loads = rot.ConstantTorque(tau_constant=torque), tr.ConstantForce(f_constant=-1000)
        wired = "0.flangeR=1.flange_a 1.flange_b=3.flange 0.flangeT=2.flange_a 2.flange_b=4.flange"
        result = run(joined(*parts, *loads, joints=wired), 1.0)
        assert bool(result["parts[2].v"][-1] > 0) == moves


@pytest.mark.parametrize("side", [1, -1])
def test_a_left_handed_thread_and_a_rack_on_the_other_side_move_backward(side: int) -> None:
    """Against 1 kN, with 1.5 times the torque at which they start; the screw with its loss, the rack with an efficiency of 0.8."""
    lead, rho = math.atan(4 / (math.pi * 18)), math.atan(0.12 / math.cos(math.radians(15)))
    wired = "0.flangeR=1.flange_a 1.flange_b=3.flange 0.flangeT=2.flange_a 2.flange_b=4.flange"
    for part, path, factor in (
        (
            rot.Screw(p=side * 4e-3, d=18e-3, mue=0.12, alpha=math.radians(15)),
            4e-3 / (2 * math.pi),
            math.tan(lead + rho) / math.tan(lead),
        ),
        (rot.RackAndPinion(radius=side * 0.1, efficiency=0.8), 0.1, 1 / 0.8),
    ):
        torque = 1.5 * 1000 * path * factor
        loads = rot.ConstantTorque(tau_constant=side * torque), tr.ConstantForce(f_constant=-1000)
        result = run(joined(part, rot.Inertia(J=1e-3), tr.Mass(m=100), *loads, joints=wired), 1.0)
        a = (torque - 1000 * path * factor) / (1e-3 / path + 100 * path * factor)
        assert result["parts[2].v"][-1] == pytest.approx(a, rel=1e-6)
        assert result["parts[1].w"][-1] == pytest.approx(side * a / path, rel=1e-6)
        assert pt.energy_audit(result).closure < 1e-8


def test_a_thread_too_steep_to_be_driven_by_its_shaft_is_rejected() -> None:
    """Up to lead + rho = pi/2 the torque that lifts grows without limit; from there on it would have the wrong sign."""
    steepest, d, alpha = math.pi / 2 - RHO, 0.02, math.radians(20)
    rot.Screw(p=math.pi * d * math.tan(0.999 * steepest), d=d, mue=0.1, alpha=alpha)
    for hand in (1, -1):
        with pytest.raises(pt.ParameterError, match=r"(?s)Screw: .*p = -?0\.59\d* m"):
            rot.Screw(p=hand * math.pi * d * math.tan(1.001 * steepest), d=d, mue=0.1, alpha=alpha)
    rot.WormGear(ratio=2, lead=1.2, mue=math.cos(alpha) * math.tan(0.999 * (math.pi / 2 - 1.2)))
    with pytest.raises(pt.ParameterError, match=r"(?s)WormGear: .*lead = 1\.2 rad, mue = 0\.5"):
        rot.WormGear(ratio=2, lead=1.2, mue=0.5)


def test_a_steep_worm_loses_and_never_gains() -> None:
    """lead + rho = 1.56 of 1.5708 rad: driven from either side."""
    part = rot.WormGear(ratio=2, lead=1.2, mue=math.cos(math.radians(20)) * math.tan(0.36))
    for tau_a, tau_b, w in ((10.0, -5.0, 0.0), (-10.0, 5.0, 0.0), (10.0, -5.0, 30.0), (0.0, -5.0, 30.0)):
        torques = rot.ConstantTorque(tau_constant=tau_a), rot.ConstantTorque(tau_constant=tau_b)
        wired = "0.flange_a=1.flange_a 1.flange_b=3.flange 0.flange_b=2.flange_a 2.flange_b=4.flange"
        result = run(joined(part, rot.Inertia(J=1), rot.Inertia(J=1), *torques, joints=wired), 1.0, {"1.w": w})
        assert result["parts[0].lossPower"].min() > -1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_band_brake_energises_itself(sign: float) -> None:
    """1 kg.m2 from 100 rad/s: F r (exp(mue wrap) - 1) forward, F r (1 - exp(-mue wrap)) backward."""
    brake = rot.BandBrake(radius=0.1, wrap=math.radians(300), mue=0.3, F_max=500)
    parts = brake, rot.Inertia(J=1), Constant(k=0.4)
    result = run(joined(*parts, joints="0.flange_a=1.flange_a 2.y=0.f_normalized"), 0.5, {"1.w": 100 * sign})
    growth = math.exp(0.3 * math.radians(300))
    torque = 200 * 0.1 * (growth - 1 if sign > 0 else 1 - 1 / growth)
    assert result["parts[1].w"][-1] == pytest.approx(sign * (100 - torque * 0.5), rel=1e-8)


@pytest.mark.parametrize("beta", [0.3, -0.6])
def test_universal_joint_turns_on_and_on(beta: float) -> None:
    """Ten turns: tan(phi_b) = cos(beta) tan(phi_a) without a jump, k within cos(beta)..1/cos(beta), no power lost."""
    parts = rot.UniversalJoint(beta=beta), rot.ConstantSpeed(w_fixed=20), rot.Inertia(J=0.5)
    result = run(joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange_a"), math.pi, max_step=0.01)
    a, b = result["parts[0].phi_a"], result["parts[0].phi_b"]
    np.testing.assert_allclose(np.sin(b) * np.cos(a), math.cos(beta) * np.sin(a) * np.cos(b), atol=1e-7)
    assert np.abs(b - a).max() < 0.25
    assert b[-1] == pytest.approx(20 * math.pi, abs=1e-6)
    k = result["parts[2].w"] / 20
    assert k.min() == pytest.approx(math.cos(beta), rel=5e-3)
    assert k.max() == pytest.approx(1 / math.cos(beta), rel=5e-3)
    np.testing.assert_allclose(k, math.cos(beta) / (1 - (math.sin(beta) * np.sin(a)) ** 2), rtol=1e-6)


def test_two_universal_joints_cancel() -> None:
    """In a Z with the forks of the middle shaft in one plane the second joint takes the unevenness of the first away."""
    first, second = rot.UniversalJoint(beta=0.4), rot.UniversalJoint(beta=0.4)
    parts = first, second, rot.Inertia(J=0.2), rot.Inertia(J=1), rot.ConstantSpeed(w_fixed=10)
    # The second joint is passed from its even side: flange_a outside, flange_b at the middle shaft.
    wired = "4.flange=0.flange_a 0.flange_b=2.flange_a 2.flange_b=1.flange_b 1.flange_a=3.flange_a"
    result = run(joined(*parts, joints=wired), 2.0, max_step=0.01)
    np.testing.assert_allclose(result["parts[3].w"], 10, rtol=1e-6)


@pytest.mark.parametrize("start", [0.0, 7.0])
@pytest.mark.parametrize(("w", "common"), [(3.0, True), (-3.0, True), (0.0, True), (-6.0, False)])
def test_dog_clutch_that_is_asked_in_at_the_start(start: float, w: float, common: bool) -> None:
    """In at once where the speeds are alike, at whatever time a run begins: then 10 N.m move both of 1 and 3 kg.m2."""
    parts = rot.DogClutch(), rot.Inertia(J=1), rot.Inertia(J=3), Constant(k=1), rot.ConstantTorque(tau_constant=-10)
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.engage 4.flange=1.flange_b"
    result = run(joined(*parts, joints=wired), start + 0.2, {"1.w": w, "2.w": 0.0}, start=start)
    assert set(result["parts[0].inside"]) == {float(common)}
    assert result["parts[2].w"][-1] == pytest.approx((w - 10 * 0.2) / 4 if common else 0.0, abs=1e-9)
    assert pt.energy_audit(result).closure < 1e-9


def test_dog_clutch_goes_in_at_equal_speed_and_out_without_torque() -> None:
    """0.5 N.m slow the loose side of 1 kg.m2 down from 12 rad/s: in at 5 rad/s, t = 14 s. Asked out at 20 s, out when the load ends."""
    parts = (
        rot.DogClutch(w_in=5, tau_out=20, tau_max=2000),
        rot.Inertia(J=1),
        rot.Inertia(J=100),
        TimeTable(table=((0, 1), (20, 1), (20, 0))),
        rot.Torque(),
        TimeTable(table=((0, -0.5), (16, -0.5), (16, 50), (25, 50), (25, 0))),
    )
    wired = "0.flange_a=1.flange_a 0.flange_b=2.flange_a 3.y=0.engage 4.flange=1.flange_b 5.y=4.tau"
    result = run(joined(*parts, joints=wired), 30.0, {"1.w": 12.0, "2.w": 0.0})
    inside = result["parts[0].inside"]
    np.testing.assert_allclose(
        np.interp([13.9, 14.1, 20.1, 24.9, 25.1], result.time, inside), [0, 1, 1, 1, 0], atol=1e-6
    )
    together = (result.time > 14.1) & (result.time < 25)
    np.testing.assert_allclose(result["parts[1].w"][together], result["parts[2].w"][together], atol=1e-9)
    assert pt.energy_audit(result).closure < 1e-7


def turned(joint: Any, w: float = 10.0, stop: float = math.pi) -> Any:
    parts = joint, rot.ConstantSpeed(w_fixed=w), rot.Inertia(J=0.5)
    model = joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange_a")
    return pt.simulate(model, stop, max_step=0.01, rtol=1e-8)


@pytest.mark.parametrize(
    ("beta_a", "beta_b", "phase", "single"),
    few(
        [
            (0.5, 0.3, 0.0, math.cos(0.5) / math.cos(0.3)),
            (0.2, 0.6, 0.0, math.cos(0.2) / math.cos(0.6)),
            (0.4, 0.4, math.pi / 2, math.cos(0.4) ** 2),
            (0.3, 0.0, 0.7, math.cos(0.3)),
            (0.3, -0.3, 0.0, 1.0),
            (0.4, 0.4, 0.0, 1.0),
        ],
        5,
    ),
)
def test_double_joint_is_as_uneven_as_a_single_one(beta_a: float, beta_b: float, phase: float, single: float) -> None:
    """Its speed swings from ``single`` to 1/``single``: evenly for equal angles, at both angles together for crossed forks."""
    result = turned(rot.DoubleUniversalJoint(beta_a=beta_a, beta_b=beta_b, phase=phase))
    k = result["parts[2].w"] / 10
    low, high = sorted((single, 1 / single))
    assert k.min() == pytest.approx(low, rel=2e-3)
    assert k.max() == pytest.approx(high, rel=2e-3)
    if single == 1.0:
        np.testing.assert_allclose(k, 1.0, rtol=1e-9)
    assert np.abs(result["parts[0].phi_b"] - result["parts[0].phi_a"]).max() < 0.4  # no turn is lost in five
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-6


def test_double_joint_is_two_joints() -> None:
    """The same motion as two single joints, their middle forks twisted by 0.6 rad, from any angle."""
    result = turned(rot.DoubleUniversalJoint(beta_a=0.5, beta_b=0.3, phase=0.6))
    a, b = result["parts[0].phi_a"], result["parts[0].phi_b"] + 0.6
    x, y = np.cos(a), math.cos(0.5) * np.sin(a)  # the middle fork's direction
    x, y = x * math.cos(0.6) - y * math.sin(0.6), x * math.sin(0.6) + y * math.cos(0.6)
    np.testing.assert_allclose(x * math.cos(0.3) * np.sin(b), y * np.cos(b), atol=1e-7)


@pytest.mark.parametrize("beta", [0.0, 0.15, -0.15, 0.9])
@pytest.mark.parametrize("driver", ["a", "b"])
def test_constant_velocity_joint_loses_by_its_angle(beta: float, driver: str) -> None:
    """w_a = w_b; the driven side gets the efficiency of the table at the size of the angle, held beyond its end."""
    eta = float(np.interp(abs(beta), [0.0, 0.1, 0.2, 0.4, 0.8], [0.997, 0.994, 0.989, 0.974, 0.93]))
    joint, sides = rot.ConstantVelocityJoint(beta=beta), (rot.Inertia(J=0.2), rot.Inertia(J=0.3))
    torque = rot.ConstantTorque(tau_constant=40.0)
    ends = "0.flange_a=1.flange_a 0.flange_b=2.flange_a"
    result = run(joined(joint, *sides, torque, joints=f"{ends} 3.flange={1 if driver == 'a' else 2}.flange_b"), 0.5)
    own, other = (0.2, 0.3) if driver == "a" else (0.3, 0.2)
    assert result["parts[2].w"][-1] == pytest.approx(40 / (own + other / eta) * 0.5, rel=1e-9)
    assert pt.energy_audit(result).closure < 1e-9
    with pytest.raises(pt.ParameterError, match="efficiencies in"):
        pt.compile(rot.ConstantVelocityJoint(efficiency=((0.0, 1.2),)))
    with pytest.raises(pt.ParameterError, match=r"parts\[0\].efficiency: \(\) is not a table"):
        pt.compile(joined(rot.ConstantVelocityJoint(efficiency=()), *sides, joints=ends))
    with pytest.raises(pt.ParameterError, match=r"parts\[0\].efficiency: .* the points must increase"):
        pt.compile(joined(rot.ConstantVelocityJoint(efficiency=((0.2, 0.98), (0.1, 0.99))), *sides, joints=ends))


def test_an_angle_that_jumps_is_rejected() -> None:
    """atan(tan(phi)) in a constraint would jump by pi in every turn."""

    class Naive(rot.TwoFlanges):
        def equations(self) -> pt.Equations:
            yield self.flange_b.phi == ca.atan(math.cos(0.4) * ca.tan(self.flange_a.phi))
            yield self.flange_a.tau + self.flange_b.tau == 0

    with pytest.raises(pt.ModelError, match=r"tan\(.*\) makes this jump"):
        turned(Naive())


class Jack(pt.Component):
    """A power screw at a constant speed under a load of 6.4 kN."""

    drive: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=1)
    screw: rot.Screw = rot.Screw(p=8e-3, d=30e-3, mue=0.08, d_collar=40e-3, mue_collar=0.08)
    load: tr.ConstantForce = tr.ConstantForce(f_constant=-6400)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.screw.flangeR)
        yield pt.connect(self.screw.flangeT, self.load.flange)


@pytest.mark.parametrize("hand", [1, -1])
def test_the_collar_of_a_screw_rubs_in_both_directions(hand: int) -> None:
    """Example 8-1 of Shigley's Mechanical Engineering Design, 9th ed.: 26.18 N.m to raise the load, 9.77 N.m to lower it."""
    jack = pt.replace(Jack(), {"screw.p": hand * 8e-3})
    raised, lowered = pt.steady(jack, {"drive.w_fixed": [hand * 1.0, -hand * 1.0]})["screw.flangeR.tau"].values * hand
    assert (raised, -lowered) == pytest.approx((26.18, 9.77), abs=5e-3)
    collar = 0.08 * 0.04 / 2 * 6400
    assert raised == pytest.approx(6400 * 0.015 * math.tan(math.atan(8 / (30 * math.pi)) + math.atan(0.08)) + collar)
