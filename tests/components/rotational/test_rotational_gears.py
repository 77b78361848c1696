"""Gears: closed forms, limit cases and mirrored models."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rotational_line import Line, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Sine

J1, J2, RATIO = 0.5, 3.0, 4.0


def driven(gear: pt.Component, left: float, right: float) -> Line:
    """A gear between two inertias with a constant torque on each."""
    return Line(
        parts=(
            rot.ConstantTorque(tau_constant=left),
            rot.Inertia(J=J1),
            gear,
            rot.Inertia(J=J2),
            rot.ConstantTorque(tau_constant=right),
        )
    )


def shaken(gear: pt.Component, amplitude: float = 10.0) -> Line:
    """A gear between an inertia under a swinging torque and a loaded one."""
    return Line(
        parts=(rot.Torque(), rot.Inertia(J=J1), gear, rot.Inertia(J=J2), rot.ConstantTorque(tau_constant=-amplitude)),
        signals=(Sine(amplitude=amplitude, f=1),),
        wires=((0, 0, "tau"),),
    )


def test_ideal_gear_reduces_the_inertia_by_the_square_of_the_ratio() -> None:
    result = run(driven(rot.IdealGear(ratio=RATIO), 7.0, 0.0), 2.0)
    a = 7.0 / (J1 + J2 / RATIO**2)
    np.testing.assert_allclose(result["parts[1].w"], a * result.time, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(result["parts[3].w"] * RATIO, result["parts[1].w"], rtol=1e-12, atol=1e-14)


def test_support_takes_the_difference_of_the_torques() -> None:
    result = run(driven(rot.IdealGear(ratio=RATIO), 7.0, -2.0), 1.0)
    sums = result["parts[2].flange_a.tau"] + result["parts[2].flange_b.tau"] + result["parts[2].support.tau"]
    np.testing.assert_allclose(sums, 0.0, atol=1e-12)
    assert np.abs(result["parts[2].support.tau"]).min() > 1.0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    "gear",
    [rot.Gear(ratio=RATIO, efficiency=0.8), rot.LossyGear(ratio=RATIO, lossTable=((0, 0.8, 0.8, 0, 0),))],
    ids=["Gear", "LossyGear"],
)
def test_efficiency_where_a_drives_and_where_b_drives(gear: pt.Component, sign: int) -> None:
    forward = run(driven(gear, sign * 7.0, 0.0), 1.0)
    a = sign * 7.0 / (J1 + J2 / (RATIO**2 * 0.8))
    np.testing.assert_allclose(forward["parts[1].w"], a * forward.time, rtol=1e-8, atol=1e-11)
    backward = run(driven(gear, 0.0, sign * 7.0), 1.0)
    a = sign * 7.0 / (J2 / RATIO + RATIO * J1 / 0.8)
    np.testing.assert_allclose(backward["parts[1].w"], a * backward.time, rtol=1e-8, atol=1e-11)


def test_different_efficiencies_for_the_two_directions_of_power() -> None:
    gear = rot.LossyGear(ratio=RATIO, lossTable=((0, 0.9, 0.6, 0, 0),))
    forward, backward = run(driven(gear, 7.0, 0.0), 1.0), run(driven(gear, 0.0, 7.0), 1.0)
    assert forward["parts[1].w"][-1] == pytest.approx(7.0 / (J1 + J2 / (RATIO**2 * 0.9)), rel=1e-8)
    assert backward["parts[1].w"][-1] == pytest.approx(7.0 / (J2 / RATIO + RATIO * J1 / 0.6), rel=1e-8)


@pytest.mark.parametrize("load", [-13.0, -20.0, -24.9, -25.1, -28.0, -31.1, -31.4, -40.0])
def test_gear_at_rest_holds_within_its_efficiency(load: float) -> None:
    """ratio*7 = 28 N.m drives; the load is lifted below 28*0.9, drives back above 28/0.9, and is held between."""
    result = run(driven(rot.Gear(ratio=RATIO, efficiency=0.9), 7.0, load), 1.0)
    expected = 1 if load > -28 * 0.9 else -1 if load < -28 / 0.9 else 0
    assert set(result["parts[2].mode"][1:]) == {expected}
    assert result["parts[1].w"][-1] * expected > 0 or (expected == 0 and np.abs(result["parts[1].w"]).max() < 1e-12)


@pytest.mark.parametrize(
    ("lossy", "ideal"),
    [
        (rot.LossyGear(ratio=RATIO), rot.IdealGear(ratio=RATIO)),
        (rot.Gear(ratio=RATIO), rot.IdealGear(ratio=RATIO)),
        (rot.LossyGear(ratio=RATIO, lossTable=((0, 0.7, 0.7, 0, 0),)), rot.Gear(ratio=RATIO, efficiency=0.7)),
    ],
    ids=["LossyGear=IdealGear", "Gear=IdealGear", "LossyGear=Gear"],
)
def test_limit_cases(lossy: pt.Component, ideal: pt.Component) -> None:
    times = np.linspace(0, 2, 201)
    a, b = run(shaken(lossy), 2.0, times=times), run(shaken(ideal), 2.0, times=times)
    scale = np.abs(b["parts[1].w"]).max()
    assert (
        np.abs(np.interp(times, a.time, a["parts[1].w"]) - np.interp(times, b.time, b["parts[1].w"])).max()
        < 1e-7 * scale
    )


def test_gear_without_mesh_loss_is_a_bearing_on_the_side_of_flange_a() -> None:
    times = np.linspace(0, 2, 201)
    table = ((0.0, 1.0, 1.0, 2.0, 2.0), (10.0, 1.0, 1.0, 3.0, 3.0))
    lossy = run(shaken(rot.LossyGear(ratio=RATIO, lossTable=table)), 2.0, times=times)
    line = shaken(rot.IdealGear(ratio=RATIO))
    bearing = rot.BearingFriction(tau_pos=((0, 2), (10, 3)))
    split = run(pt.replace(line, parts=(*line.parts[:2], bearing, *line.parts[2:])), 2.0, times=times)
    expected = np.interp(times, split.time, split["parts[1].w"])
    assert np.abs(np.interp(times, lossy.time, lossy["parts[1].w"]) - expected).max() < 1e-6 * np.abs(expected).max()
    assert {-1, 1} <= set(lossy["parts[2].mode"])


GEARS = [
    rot.Gear(ratio=RATIO, efficiency=0.8),
    rot.LossyGear(ratio=RATIO, lossTable=((0, 0.8, 0.6, 0.5, 1.0), (5, 0.7, 0.65, 0.7, 1.5))),
]


@pytest.mark.parametrize("gear", GEARS, ids=["Gear", "LossyGear"])
def test_mirrored_torques_give_mirrored_motion(gear: pt.Component) -> None:
    times = np.linspace(0, 2, 101)
    one, other = (run(shaken(gear, amplitude), 2.0, times=times) for amplitude in (10.0, -10.0))
    a, b = (np.interp(times, r.time, r["parts[1].w"]) for r in (one, other))
    assert np.abs(a + b).max() < 1e-7 * np.abs(a).max()
    assert len(set(one["parts[2].mode"])) > 1


def test_flipped_gear_is_the_gear_of_the_inverse_ratio() -> None:
    times = np.linspace(0, 2, 101)
    line = shaken(rot.Gear(ratio=RATIO, efficiency=0.8))
    gear = rot.Gear(ratio=1 / RATIO, efficiency=0.8)
    torque, left, _, right, load = line.parts
    flipped = Line(parts=(load, right, gear, left, torque), signals=line.signals, wires=((0, 4, "tau"),))
    one, other = run(line, 2.0, times=times), run(flipped, 2.0, times=times)
    a, b = np.interp(times, one.time, one["parts[1].w"]), np.interp(times, other.time, other["parts[3].w"])
    assert np.abs(a - b).max() < 1e-7 * np.abs(a).max()


@pytest.mark.parametrize("gear", GEARS, ids=["Gear", "LossyGear"])
def test_losses_are_not_negative_in_any_quadrant(gear: pt.Component) -> None:
    result = run(shaken(gear), 3.0)
    assert result["parts[2].lossPower"].min() > -1e-6 * result["parts[2].lossPower"].max()
    power = (
        result["parts[2].flange_a.tau"] * result["parts[2].w_a"]
        + result["parts[2].flange_b.tau"] * result["parts[2].w_a"] / RATIO
    )
    np.testing.assert_allclose(power, result["parts[2].lossPower"], atol=1e-8 * np.abs(power).max())


@pytest.mark.parametrize("table", [((0, 1.2, 1, 0, 0),), ((0, 0.9, 0, 0, 0),), ((0, 1, 1, 2, 3),)], ids=str)
def test_impossible_loss_tables_are_refused(table: Any) -> None:
    with pytest.raises(pt.ParameterError, match=r"parts\[2\].lossTable"):
        run(driven(rot.LossyGear(ratio=2, lossTable=table), 1.0, 0.0), 0.1)


@pytest.mark.parametrize("efficiency", [0.0, 1e-9, 1.1])
def test_an_impossible_efficiency_is_refused(efficiency: float) -> None:
    """With 1e-9, the round-off of the torques that the mesh passes on decides which side drives."""
    with pytest.raises(pt.ParameterError, match=r"Gear.efficiency = .* is outside its range \[1e-06, 1\]"):
        rot.Gear(ratio=2, efficiency=efficiency)


def test_a_wheel_without_radius_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"IdealRollingWheel.radius = 0 m is outside its range"):
        rot.IdealRollingWheel(radius=0)


def test_rows_of_a_loss_table_have_five_numbers() -> None:
    with pytest.raises(pt.ParameterError, match=r"LossyGear.lossTable .* the row .* is not 5 finite numbers"):
        rot.LossyGear(ratio=2, lossTable=((0, 0.5, 0.5, 0),))  # type: ignore[arg-type]


class Planetary(pt.Component):
    """Three inertias on a planetary gear."""

    planetary: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.5)
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=5)
    sun: rot.Inertia = rot.Inertia(J=0.2)
    carrier: rot.Inertia = rot.Inertia(J=2)
    ring: rot.Inertia = rot.Inertia(J=1.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.sun.flange_a)
        yield pt.connect(self.sun.flange_b, self.planetary.sun)
        yield pt.connect(self.carrier.flange_a, self.planetary.carrier)
        yield pt.connect(self.ring.flange_a, self.planetary.ring)


def test_planetary_gear_moves_as_lagrange_says() -> None:
    result = run(Planetary(), 1.0)
    r = 2.5
    # Generalised coordinates: sun and ring; the carrier turns with (sun + r ring)/(1 + r).
    k = np.array([1, r]) / (1 + r)
    mass = np.diag([0.2, 1.5]) + 2 * np.outer(k, k)
    sun, ring = np.linalg.solve(mass, [5, 0])
    for name, a in (("sun", sun), ("ring", ring), ("carrier", k @ [sun, ring])):
        np.testing.assert_allclose(result[f"{name}.w"], a * result.time, rtol=1e-8, atol=1e-11)
    taus = [result[f"planetary.{port}.tau"] for port in ("sun", "ring", "carrier")]
    np.testing.assert_allclose(sum(taus), 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("wheel", "metres_per_radian"),
    [(rot.IdealRollingWheel(radius=0.3), 0.3), (rot.IdealGearR2T(ratio=5.0), 0.2)],
    ids=["IdealRollingWheel", "IdealGearR2T"],
)
def test_rotation_drives_translation(wheel: pt.Component, metres_per_radian: float) -> None:
    class Cart(pt.Component):
        torque: rot.ConstantTorque = rot.ConstantTorque(tau_constant=3)
        inertia: rot.Inertia = rot.Inertia(J=0.4)
        wheel: pt.Component
        mass: trans.Mass = trans.Mass(m=10)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.torque.flange, self.inertia.flange_a)
            yield pt.connect(self.inertia.flange_b, self.wheel.flangeR)  # type: ignore[attr-defined]
            yield pt.connect(self.wheel.flangeT, self.mass.flange_a)  # type: ignore[attr-defined]

    result = run(Cart(wheel=wheel), 1.0)
    a = 3 / (0.4 + 10 * metres_per_radian**2)
    np.testing.assert_allclose(result["inertia.w"], a * result.time, rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(result["mass.v"], metres_per_radian * result["inertia.w"], rtol=1e-8, atol=1e-11)


@pytest.mark.parametrize("driven_wheel", ["front", "rear"])
def test_two_wheels_on_one_body(driven_wheel: str) -> None:
    """A wheel set: one wheel drives, the other is pulled along by the body."""

    class WheelSet(pt.Component):
        front: rot.IdealRollingWheel = rot.IdealRollingWheel(radius=0.3)
        rear: rot.IdealRollingWheel = rot.IdealRollingWheel(radius=0.5)
        small: rot.Inertia = rot.Inertia(J=0.4)
        large: rot.Inertia = rot.Inertia(J=1.5)
        body: trans.Mass = trans.Mass(m=10)
        torque: rot.ConstantTorque = rot.ConstantTorque(tau_constant=3)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.front.flangeT, self.rear.flangeT, self.body.flange_a)
            yield pt.connect(self.front.flangeR, self.small.flange_a)
            yield pt.connect(self.rear.flangeR, self.large.flange_a)
            driven = self.small if driven_wheel == "front" else self.large
            yield pt.connect(self.torque.flange, driven.flange_b)

    result = run(WheelSet(), 1.0)
    r = 0.3 if driven_wheel == "front" else 0.5
    a = 3 / r / (10 + 0.4 / 0.3**2 + 1.5 / 0.5**2)
    np.testing.assert_allclose(result["body.v"], a * result.time, rtol=1e-8, atol=1e-11)
    np.testing.assert_allclose(result["small.w"] * 0.3, result["large.w"] * 0.5, rtol=1e-10, atol=1e-13)


def test_gearbox_is_its_gear_and_its_shaft() -> None:
    times = np.linspace(0, 2, 101)
    gear = rot.LossyGear(ratio=RATIO, lossTable=((0, 0.9, 0.8, 0.1, 0.2),))
    shaft = rot.ElastoBacklash(c=500, d=2, b=0.02)
    gearbox = rot.Gearbox.of(ratio=RATIO, lossTable=((0, 0.9, 0.8, 0.1, 0.2),), c=500, d=2, b=0.02)
    assert gearbox == rot.Gearbox(lossyGear=gear, elastoBacklash=shaft)
    line = shaken(gearbox)
    split = pt.replace(line, parts=(*line.parts[:2], gear, shaft, *line.parts[3:]))
    whole, parts = run(line, 2.0, times=times), run(split, 2.0, times=times)
    a, b = np.interp(times, whole.time, whole["parts[1].w"]), np.interp(times, parts.time, parts["parts[1].w"])
    assert np.abs(a - b).max() < 1e-6 * np.abs(b).max()
    heat = whole["parts[2].lossyGear.lossPower"] + whole["parts[2].elastoBacklash.lossPower"]
    np.testing.assert_allclose(whole["parts[2].heat_port.Q_flow"], -heat, atol=1e-9 * heat.max())
    twist = whole["parts[3].phi"] - whole["parts[1].phi"] / RATIO
    np.testing.assert_allclose(whole["parts[2].phi_rel"], twist, atol=1e-12)


def test_gear_between_an_exact_motion_and_a_torque_has_no_states() -> None:
    """The load of 4 N.m takes 4/(2*0.9) where it is driven and gives 4*0.9/2 where it drives."""
    swing = Line(
        parts=(rot.Position(exact=True), rot.Gear(ratio=2.0, efficiency=0.9), rot.ConstantTorque(tau_constant=-4.0)),
        signals=(Sine(amplitude=1.0, f=1.0),),
        wires=((0, 0, "phi_ref"),),
    )
    result = run(swing, 1.0)
    assert not result.compiled.states
    forward = np.cos(2 * np.pi * result.time) > 1e-6
    backward = np.cos(2 * np.pi * result.time) < -1e-6
    np.testing.assert_allclose(result["parts[1].flange_a.tau"][forward], 2 / 0.9, rtol=1e-9)
    np.testing.assert_allclose(result["parts[1].flange_a.tau"][backward], 2 * 0.9, rtol=1e-9)
    assert pt.energy_audit(result).closure < 1e-6
