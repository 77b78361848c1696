"""Differentials of an axle and their crown wheel: kinematics, torque shares, limited slip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential, LimitedSlipDifferential

KINDS = [
    BevelDifferential(),
    BevelDifferential(eta=0.9),
    LimitedSlipDifferential(preload=0, bias_drive=1, bias_coast=1),
    LimitedSlipDifferential(preload=1.0, bias_drive=2.5, bias_coast=1.5),
]


def driven(differential: Differential, cage: float, left: float, right: float, torque: float) -> Any:
    """The sides turn as given, the cage is driven by a torque; the end of a simulation."""
    parts = differential, rot.ConstantSpeed(w_fixed=left), rot.ConstantSpeed(w_fixed=right)
    model = joined(
        *parts, rot.ConstantTorque(tau_constant=torque), joints="0.left=1.flange 0.right=2.flange 0.crown=3.flange"
    )
    result = run(model, 0.01)
    assert (left + right) / 2 == pytest.approx(cage)
    return {name: result[f"parts[0].{name}.tau"][-1] for name in ("crown", "left", "right")}


@pytest.mark.parametrize("differential", KINDS, ids=repr)
def test_car_in_a_bend(differential: Differential) -> None:
    """Cage 88 rad/s, radius 7 m, track 1.4 m: the outer wheel turns at 96.8 rad/s, the inner at 79.2 rad/s."""
    outer, inner = (88 * (1 + side * 0.7 / 7) for side in (1, -1))
    assert (outer, inner) == pytest.approx((96.8, 79.2))
    parts = differential, rot.ConstantSpeed(w_fixed=88), rot.ConstantSpeed(w_fixed=outer), rot.Inertia(J=1)
    drag = rot.ConstantTorque(tau_constant=-50)
    joints = "0.crown=1.flange 0.left=2.flange 0.right=3.flange_a 3.flange_b=4.flange"
    assert run(joined(*parts, drag, joints=joints), 0.1)["parts[3].w"][-1] == pytest.approx(inner, rel=1e-12)


@pytest.mark.parametrize("torque", [100.0, -100.0])
@pytest.mark.parametrize("faster", ["left", "right"])
def test_shares_of_the_torque(torque: float, faster: str) -> None:
    """The slower side of a driven axle gets the larger share; a coasting axle brakes the faster side more."""
    w = {"left": 12.0, "right": 8.0} if faster == "left" else {"left": 8.0, "right": 12.0}
    slower = "right" if faster == "left" else "left"
    large, small = (slower, faster) if torque > 0 else (faster, slower)
    open_one = driven(BevelDifferential(), 10, w["left"], w["right"], torque)
    assert open_one["left"] == pytest.approx(open_one["right"]) == pytest.approx(-torque / 2)
    lossy = driven(BevelDifferential(eta=0.9), 10, w["left"], w["right"], torque)
    assert lossy[large] / lossy[small] == pytest.approx(1 / 0.9)
    torsen = driven(
        LimitedSlipDifferential(preload=0, bias_drive=2.5, bias_coast=1.5), 10, w["left"], w["right"], torque
    )
    assert torsen[large] / torsen[small] == pytest.approx(2.5 if torque > 0 else 1.5)
    plates = driven(
        LimitedSlipDifferential(preload=30.0, bias_drive=1, bias_coast=1), 10, w["left"], w["right"], torque
    )
    assert abs(plates[large]) - abs(plates[small]) == pytest.approx(60.0)
    for found in (open_one, lossy, torsen, plates):
        assert sum(found.values()) == pytest.approx(0, abs=1e-9)


def car(differential: Differential, loads: tuple[float, float], drive: float) -> Any:
    parts = differential, rot.Inertia(J=0.5), rot.Inertia(J=1), rot.Inertia(J=1.2)
    torques = rot.ConstantTorque(tau_constant=drive), *(rot.ConstantTorque(tau_constant=t) for t in loads)
    joints = "0.crown=1.flange_a 0.left=2.flange_a 0.right=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.flange=3.flange_b"
    return run(joined(*parts, *torques, joints=joints), 1.0)


@pytest.mark.parametrize(("difference", "mode"), [(-74, -1), (-72, 0), (0, 0), (57, 0), (60, 1)])
def test_sides_stick_together_within_preload_and_bias(difference: float, mode: int) -> None:
    """Stuck, all accelerate with 100/2.7 rad/s2: half the difference of the side torques is then difference/2 + 0.1*100/2.7."""
    a = 100 / 2.7
    limit = 20 + 0.2 / 2.2 * (300 - 0.5 * a) / 2
    assert (abs(difference / 2 + 0.1 * a) > limit) == (mode != 0)
    differential = LimitedSlipDifferential(preload=20, bias_drive=1.2, bias_coast=1.2)
    result = car(differential, (-100 + difference / 2, -100 - difference / 2), 300)
    tau, torque = result["parts[0].tau"][-1], result["parts[0].crown.tau"][-1]
    assert result["parts[0].mode"][-1] == mode
    assert np.sign(np.round(result["parts[0].w_rel"][-1], 9)) == mode
    if mode:
        assert tau == pytest.approx(mode * (20 + 0.2 / 2.2 * torque / 2))
    else:
        assert tau == pytest.approx(difference / 2 + 0.1 * a)


def test_torque_bias_is_the_inverse_efficiency_of_the_mesh_law() -> None:
    for drive in (300.0, -300.0):
        loads = (-np.sign(drive) * 60, -np.sign(drive) * 110)
        bevel = car(BevelDifferential(eta=0.8), loads, drive)
        bias = car(LimitedSlipDifferential(preload=0, bias_drive=1 / 0.8, bias_coast=1 / 0.8), loads, drive)
        for i in (1, 2, 3):
            assert bevel[f"parts[{i}].w"][-1] == pytest.approx(bias[f"parts[{i}].w"][-1], rel=1e-8)


@pytest.mark.parametrize("differential", KINDS, ids=repr)
def test_energy_and_mirrored_axle(differential: Differential) -> None:
    def swing(left: str, right: str) -> Any:
        parts = differential, rot.Inertia(J=0.5), rot.Inertia(J=1), rot.Inertia(J=1.2)
        drive = rot.ConstantTorque(tau_constant=20), rot.Torque(), Sine(amplitude=15, f=0.8)
        joints = f"0.crown=1.flange_a 0.{left}=2.flange_a 0.{right}=3.flange_a 4.flange=1.flange_b 5.flange=2.flange_b 6.y=5.tau"
        return run(joined(*parts, *drive, joints=joints), 3.0)

    one, other = swing("left", "right"), swing("right", "left")
    for i in (1, 2, 3):
        assert one[f"parts[{i}].w"][-1] == pytest.approx(other[f"parts[{i}].w"][-1], rel=1e-7)
    audit = pt.energy_audit(one)
    assert audit.closure < 1e-8
    assert np.asarray(audit.loss).min() >= -1e-7


@pytest.mark.parametrize("ratio", [3.7, 1.0, -1.0, 0.5])
@pytest.mark.parametrize("torque", [10.0, -10.0])
def test_crown_gear(torque: float, ratio: float) -> None:
    """Out comes 0.96 of what the pinion puts in, and 0.94 of what the crown wheel puts in; mitre gears (ratio 1) included."""
    gear = CrownGear(ratio=ratio, eta_ab=0.96, eta_ba=0.94)
    parts = gear, rot.ConstantSpeed(w_fixed=100), rot.ConstantTorque(tau_constant=torque)
    result = run(joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange"), 0.01)
    pinion, wheel = 100 * result["parts[0].flange_a.tau"][-1], 100 / ratio * torque
    assert pinion == pytest.approx(-wheel / 0.96 if wheel < 0 else -wheel * 0.94)
    assert result["parts[0].lossPower"][-1] == pytest.approx(pinion + wheel)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BevelDifferential(eta=1.1), "eta = 1.1"),
        (lambda: LimitedSlipDifferential(bias_drive=0.5), r"bias_drive = 0.5 is outside its range \[1, inf\)"),
        (lambda: LimitedSlipDifferential(preload=-1.0), "preload = -1"),
        (lambda: CrownGear(ratio=0.0), "ratio = 0"),
    ],
)
def test_impossible_data_are_refused(make: Any, message: str) -> None:
    with pytest.raises(pt.ParameterError, match=message):
        make()
