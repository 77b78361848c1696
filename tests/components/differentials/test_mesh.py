"""The mesh law: torques by the side that drives, limit cases, symmetries, stuck and self-locking meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from cases import few
from hypothesis import given, settings
from hypothesis import strategies as st
from joined import Joined, joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import FundamentalDifferential, Mesh

ETA = 0.95
RATIOS = [-1.7, -0.4, 0.5, 1.8]


def prescribed(mesh: pt.Component, w_a: float, w_h: float, load: float) -> Any:
    """The end of a simulation: a and the carrier turn as given, a torque acts on b."""
    speeds = rot.ConstantSpeed(w_fixed=w_a), rot.ConstantSpeed(w_fixed=w_h)
    model = joined(
        mesh, *speeds, rot.ConstantTorque(tau_constant=load), joints="0.a=1.flange 0.carrier=2.flange 0.b=3.flange"
    )
    return run(model, 0.01)


@pytest.mark.parametrize("R_o", RATIOS)
@pytest.mark.parametrize("load", [-10.0, 10.0])
@pytest.mark.parametrize("w_rel", [-5.0, 5.0])
@pytest.mark.parametrize("w_h", [-20.0, 3.0])
def test_torques_by_the_latent_power(R_o: float, load: float, w_rel: float, w_h: float) -> None:
    """Eqs. (5)-(18) and (21) in all quadrants, eta_ab other than eta_ba."""
    mesh = FundamentalDifferential(ratio=R_o, eta_ab=0.95, eta_ba=0.9)
    result = prescribed(mesh, w_h + w_rel, w_h, load)
    a, b, h = (result[f"parts[0].{name}.tau"][-1] for name in ("a", "b", "carrier"))
    assert b == pytest.approx(load)
    assert a + b + h == pytest.approx(0, abs=1e-9)
    a_drives = a * w_rel > 0
    assert b / a == pytest.approx(-R_o * 0.95 if a_drives else -R_o / 0.9, rel=1e-12)
    w_b = w_h + w_rel / R_o
    into = a * (w_h + w_rel) + b * w_b + h * w_h
    latent = a * w_rel if a_drives else b * (w_b - w_h)
    assert latent > 0
    assert into == pytest.approx(latent * (1 - (0.95 if a_drives else 0.9)), rel=1e-9)
    assert result["parts[0].lossPower"][-1] == pytest.approx(into, rel=1e-9)


def held(R_o: float, output: str) -> float:
    """The efficiency of a simulation with b held, between a and the carrier."""
    mesh = FundamentalDifferential(ratio=R_o, eta_ab=ETA, eta_ba=ETA)
    source = "a" if output == "carrier" else "carrier"
    parts = mesh, rot.ConstantSpeed(w_fixed=10), rot.Fixed(), rot.Torque()
    w_out = 10 / (1 - R_o) if output == "carrier" else 10 * (1 - R_o)
    load = rot.ConstantTorque(tau_constant=-5 * np.sign(w_out))
    result = run(joined(*parts[:3], load, joints=f"0.{source}=1.flange 0.b=2.flange 0.{output}=3.flange"), 0.01)
    powers = [result[f"parts[0].{name}.tau"][-1] * w for name, w in ((source, 10), (output, w_out))]
    return float(-powers[1] / powers[0])


@pytest.mark.parametrize("R_o", [-1.7, -0.4, 0.5, 1.8])
def test_one_degree_of_freedom_with_b_held(R_o: float) -> None:
    """The classical (1 - i0 eta0^w)/(1 - i0), w the sign of the power of a that rolls off in the mesh."""
    w = 1 if R_o < 0 or R_o > 1 else -1
    assert held(R_o, "carrier") == pytest.approx((1 - R_o * ETA**w) / (1 - R_o), rel=1e-10)
    assert held(R_o, "a") == pytest.approx((1 - R_o) / (1 - R_o * ETA**-w), rel=1e-10)


def swinging(part: pt.Component, members: str = "a b carrier", sign: float = 1.0) -> Joined:
    """Three members with inertia; a swinging torque on the first, a constant one on the second."""
    a, b, h = members.split()
    inertias = rot.Inertia(J=1), rot.Inertia(J=2), rot.Inertia(J=3)
    torques = rot.Torque(), Sine(f=0.3, amplitude=10 * sign), rot.ConstantTorque(tau_constant=5.0 * sign)
    joints = f"0.{a}=1.flange_a 0.{b}=2.flange_a 0.{h}=3.flange_a 4.flange=1.flange_b 5.y=4.tau 6.flange=2.flange_b"
    return joined(part, *inertias, *torques, joints=joints)


TIMES = np.linspace(0, 5, 101)


def speeds(model: Joined) -> Any:
    result = run(model, 5.0, times=TIMES)
    return np.array([result.at(TIMES, f"parts[{i}].w") for i in (1, 2, 3)])


@pytest.mark.parametrize("R_o", RATIOS)
def test_without_loss_it_is_the_ideal_planetary(R_o: float) -> None:
    """Also as the limit of small losses."""
    ideal = speeds(swinging(rot.IdealPlanetary(ratio=-R_o), "sun ring carrier"))
    scale = np.abs(ideal).max()
    assert np.abs(speeds(swinging(Mesh(ratio=R_o))) - ideal).max() < 1e-8 * scale
    off = [np.abs(speeds(swinging(Mesh(ratio=R_o, eta_ab=1 - e, eta_ba=1 - e))) - ideal).max() for e in (1e-4, 1e-5)]
    assert 8 < off[0] / off[1] < 12


@pytest.mark.parametrize("R_o", few(RATIOS))
def test_mirrored_and_relabelled(R_o: float) -> None:
    """Opposite torques give opposite speeds; a and b are of equal standing: R_o -> 1/R_o, eta_ab <-> eta_ba."""
    one = speeds(swinging(Mesh(ratio=R_o, eta_ab=0.9, eta_ba=0.8)))
    scale = np.abs(one).max()
    mirrored = speeds(swinging(Mesh(ratio=R_o, eta_ab=0.9, eta_ba=0.8), sign=-1.0))
    assert np.abs(mirrored + one).max() < 1e-7 * scale
    relabelled = speeds(swinging(Mesh(ratio=1 / R_o, eta_ab=0.8, eta_ba=0.9), "b a carrier"))
    assert np.abs(relabelled - one).max() < 1e-7 * scale


def test_time_reversed() -> None:
    """Without loss a motion that starts with the reversed final speeds goes back to where it came from."""
    parts = Mesh(ratio=-1.7), rot.Inertia(J=1), rot.Inertia(J=2), rot.Inertia(J=3), rot.Spring(c=7), rot.Fixed()
    joints = "0.a=1.flange_a 0.b=2.flange_a 0.carrier=3.flange_a=4.flange_a 4.flange_b=5.flange"
    model = joined(*parts, joints=joints)
    there = run(model, 2.0, starts={"1.w": 3.0, "3.w": 1.0})
    names = [f"parts[{i}].{q}" for i in (1, 3) for q in ("phi", "w")]
    end = {name: there[name][-1] * (-1 if name.endswith("w") else 1) for name in names}
    back = pt.simulate(model, 2.0, starts=end, rtol=1e-10)
    for name, value in zip(names, (0.0, -3.0, 0.0, -1.0), strict=True):
        assert back[name][-1] == pytest.approx(value, abs=1e-8)


@pytest.mark.parametrize("R_o", [-1.7, 3.0])
def test_fixed_carrier_is_the_lossy_gear(R_o: float) -> None:
    def pair(gear: pt.Component, housing: str, a: str, b: str) -> Any:
        line = joined(
            *(gear, rot.Inertia(J=1), rot.Inertia(J=2), rot.Torque(), Sine(f=0.3, amplitude=10)),
            *(rot.ConstantTorque(tau_constant=np.sign(R_o) * -3), rot.Fixed()),
            joints=f"0.{a}=1.flange_a 0.{b}=2.flange_a 3.flange=1.flange_b 4.y=3.tau 5.flange=2.flange_b 6.flange=0.{housing}",
        )
        result = run(line, 5.0, times=TIMES)
        return np.array([result.at(TIMES, f"parts[{i}].w") for i in (1, 2)]), result

    lossy, _ = pair(rot.LossyGear(ratio=R_o, lossTable=((0, 0.9, 0.8, 0, 0),)), "support", "flange_a", "flange_b")
    mesh, result = pair(Mesh(ratio=R_o, eta_ab=0.9, eta_ba=0.8), "carrier", "a", "b")
    assert np.abs(mesh - lossy).max() < 1e-7 * np.abs(lossy).max()
    assert set(result["parts[0].mode"]) >= {1, -1}


@pytest.mark.parametrize("R_o", RATIOS)
def test_energy_and_losses(R_o: float) -> None:
    result = run(swinging(Mesh(ratio=R_o, eta_ab=0.9, eta_ba=0.8)), 5.0)
    assert pt.energy_audit(result).closure < 1e-8
    assert result["parts[0].lossPower"].min() > -1e-8 * result["parts[0].lossPower"].max()


def test_no_event_where_torque_passes_zero() -> None:
    """The carrier runs ahead all the time while the torque of a changes its sign: the mode stays, the loss stays continuous."""
    parts = Mesh(ratio=-1.7, eta_ab=0.9, eta_ba=0.8), rot.ConstantSpeed(w_fixed=10), rot.ConstantSpeed(w_fixed=3)
    model = joined(
        *parts, rot.Torque(), Sine(f=1, amplitude=5), joints="0.a=1.flange 0.carrier=2.flange 0.b=3.flange 3.tau=4.y"
    )
    result = run(model, 2.0)
    assert set(result["parts[0].mode"]) == {1}
    assert len(list(result.events)) == 0
    torque = result["parts[0].a.tau"]
    expected = np.where(torque > 0, (1 - 0.9) * torque, (1 - 1 / 0.8) * torque)
    np.testing.assert_allclose(result["parts[0].tauLoss"], expected, atol=1e-9)


@pytest.mark.parametrize("push", [-12.4, -11.9, -10.0, -8.8, -8.4])
def test_stuck_within_the_cone_of_friction(push: float) -> None:
    """10 N.m at a are held by 10 eta to 10/eta at b, with R_o = -1 and the carrier held (eta = 0.85)."""
    mesh = Mesh(ratio=1.0 + 1e-9, eta_ab=0.85, eta_ba=0.85)
    parts = mesh, rot.Inertia(J=1), rot.Inertia(J=1), rot.Fixed()
    torques = rot.ConstantTorque(tau_constant=10), rot.ConstantTorque(tau_constant=push)
    joints = "0.a=1.flange_a 0.b=2.flange_a 0.carrier=3.flange 4.flange=1.flange_b 5.flange=2.flange_b"
    result = run(joined(*parts, *torques, joints=joints), 0.5)
    expected = 1 if push > -8.5 else -1 if push < -10 / 0.85 else 0
    assert set(result["parts[0].mode"][1:]) == {expected}


@pytest.mark.parametrize("kind", ["w_rel", "tau", "angle", "T"])
def test_efficiency_maps(kind: str) -> None:
    """The loss is that of the efficiency at the operating point."""
    unit = {"w_rel": "rad/s", "tau": "N.m", "angle": "rad", "T": "K"}[kind]
    grids: dict[str, list[float]] = {"w_rel": [0, 3], "tau": [0, 4], "angle": [0, 0.5, 1], "T": [273.15, 313.15]}
    points = grids[kind]
    table = pt.Map.curve(points, [0.8, 0.9, 0.8][: len(points)], x=kind, x_unit=unit, outside="clip")
    result = run(swinging(Mesh(ratio=-1.7, map_ab=table, map_ba=table)), 5.0)
    mesh = "parts[0]."
    tau, w, angle = (
        result[mesh + "a.tau"],
        result[mesh + "w_rel"],
        result[mesh + "a.phi"] - result[mesh + "carrier.phi"],
    )
    at = {"w_rel": np.abs(w), "tau": np.abs(tau), "angle": np.mod(angle, 1.0), "T": 293.15 + 0 * w}[kind]
    eta = np.asarray(table(at))
    expected = np.where(tau * w > 0, (1 - eta) * tau, (1 - 1 / eta) * tau)
    moving = np.abs(w) > 1e-3
    np.testing.assert_allclose(result[mesh + "tauLoss"][moving], expected[moving], atol=2e-6)
    assert pt.energy_audit(result).closure < 1e-6
    if kind != "T":
        assert np.ptp(eta) > 0.03


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (pt.Map.curve([0, 1], [0.9, 1.2], x="w_rel", x_unit="rad/s"), r"efficiency must be in \(0, 1\].*\[0.9, 1.2\]"),
        (pt.Map.curve([0, 1], [0.0, 0.5], x="w_rel", x_unit="rad/s"), r"efficiency must be in \(0, 1\]"),
        (
            pt.Map.curve([0, 1], [0.8, 0.9], x="angle", x_unit="rad"),
            r"must end with the values it begins with.* by up to 0.1",
        ),
        (
            pt.Map.curve([0, 1], [0.9, 0.9], x="pressure", x_unit="Pa"),
            r"cannot depend on pressure \[Pa\], only on w_rel",
        ),
        (pt.Map.curve([0, 1], [0.9, 0.9], x="T", x_unit="degC"), r"cannot depend on T \[degC\]"),
        (pt.Map.curve([0, 90], [0.8, 0.9], x="angle", x_unit="deg"), r"cannot depend on angle \[deg\]"),
        (pt.Map.curve([0, 1], [80, 90], x="angle", x_unit="rad"), r"efficiency must be in \(0, 1\]"),
        (pt.Map.curve([0, 1], [0.9, 0.9], x="T", x_unit="K", unit="W"), r"map \[W\] is not an efficiency \[1\]"),
    ],
    ids=["above 1", "zero", "jump", "axis", "unit", "degrees", "percent", "unit of values"],
)
def test_impossible_maps_are_refused(table: pt.Map, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=r"parts\[0\].map_ab: .*" + message):
        pt.compile(swinging(Mesh(ratio=-1.7, map_ab=table)))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"ratio": 0.0}, r"ratio = 0 is outside its range .* without 0 and 1"),
        ({"ratio": 1.0}, r"ratio = 1 is outside its range"),
        ({"ratio": -1.7, "eta_ab": 0.0}, r"eta_ab = 0 is outside its range \(0, 1\]"),
        ({"ratio": -1.7, "eta_ba": 1.01}, r"eta_ba = 1.01 is outside its range \(0, 1\]"),
        ({"ratio": -1.7, "eta_ab": float("nan")}, r"eta_ab = nan"),
        ({}, "ratio must be given"),
    ],
    ids=str,
)
def test_impossible_parameters_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        FundamentalDifferential(**values)


def locking(R_o: float, load: float) -> Joined:
    """a is turned at 1 rad/s, b held, a torque acts on the carrier."""
    mesh = Mesh(ratio=R_o, eta_ab=0.95, eta_ba=0.95)
    parts = mesh, rot.ConstantSpeed(w_fixed=1), rot.Fixed(), rot.ConstantTorque(tau_constant=load)
    return joined(*parts, joints="0.a=1.flange 0.b=2.flange 0.carrier=3.flange")


def test_self_locking_is_said() -> None:
    """eta < R_o < 1/eta: no torque at a moves a carrier that resists (w_h = w_a/(1 - R_o) < 0, so a positive torque does)."""
    with pytest.raises(
        pt.PowertrainError,
        match=r"\(the mechanism jams\)[^$]*parts\[0\]\.mode .*torque .* N\.m, bounds[^$]*self-locking",
    ):
        run(locking(1.02, 1.0), 1.0)
    with pytest.raises(pt.InitializationError, match=r"2 combinations of modes are possible[^$]*self-locking"):
        run(locking(1.02, -1.0), 1.0)
    points = pt.steady(locking(1.02, 1.0), {"parts[3].tau_constant": [1.0, -1.0]})
    assert list(points["status"].values) == [3, 2]
    free = pt.steady(locking(1.2, 1.0), {"parts[3].tau_constant": [1.0, -1.0]})
    assert list(free["status"].values) == [0, 0]
    np.testing.assert_allclose(free["parts[0].a.tau"], [1 / (1.2 * 0.95 - 1), -1 / (1.2 / 0.95 - 1)], rtol=1e-12)


@settings(max_examples=15, deadline=None)
@given(
    R_o=st.one_of(st.floats(-4, -0.25), st.floats(0.2, 0.6), st.floats(1.7, 5)),
    eta_ab=st.floats(0.7, 1),
    eta_ba=st.floats(0.7, 1),
    torques=st.tuples(*[st.floats(-10, 10)] * 3),
    starts=st.tuples(*[st.floats(-5, 5)] * 2),
)
def test_any_mesh_is_passive_and_closes_its_energy(
    R_o: float, eta_ab: float, eta_ba: float, torques: tuple[float, ...], starts: tuple[float, ...]
) -> None:
    mesh = Mesh(ratio=R_o, eta_ab=eta_ab, eta_ba=eta_ba)
    inertias = rot.Inertia(J=1), rot.Inertia(J=2), rot.Inertia(J=3)
    loads = [rot.ConstantTorque(tau_constant=torque) for torque in torques]
    joints = (
        "0.a=1.flange_a 0.b=2.flange_a 0.carrier=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.flange=3.flange_b"
    )
    result = run(joined(mesh, *inertias, *loads, joints=joints), 1.0, starts={"1.w": starts[0], "3.w": starts[1]})
    loss = result["parts[0].lossPower"]
    assert loss.min() >= -1e-7 * (1 + loss.max())
    audit = pt.energy_audit(result)
    assert audit.residual < 1e-7 * audit.turnover + 1e-12  # J; there may be no power at all
    assert len(result.events) <= 2
