"""Forces, imposed motions, sensors and adaptors: characteristics, inverse dynamics, filters, power."""

from __future__ import annotations

import numpy as np
import pytest
from joined import joined, run
from numpy.typing import NDArray
from scipy import signal

import powertrain as pt
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Cosine, Ramp, Sine, Step


def over_speed(source: pt.Component, fastest: float = 4.0) -> tuple[pt.Result[pt.Component], NDArray[np.float64]]:
    """A source on a flange that is moved at -fastest ... fastest."""
    parts = (source, tr.Speed(exact=True), Ramp(height=2 * fastest, duration=1, offset=-fastest))
    result = run(joined(*parts, joints="0.flange=1.flange 2.y=1.v_ref"), 1.0)
    return result, fastest * (2 * result.time - 1)


@pytest.mark.parametrize("same", [True, False])
def test_forces_over_speed(same: bool) -> None:
    result, v = over_speed(tr.LinearSpeedDependentForce(f_nominal=-3, v_nominal=2, ForceDirection=same))
    np.testing.assert_allclose(result["parts[0].f"], 3 * (np.abs(v) if same else v) / 2, atol=1e-9)
    result, v = over_speed(tr.QuadraticSpeedDependentForce(f_nominal=-3, v_nominal=2, ForceDirection=same))
    np.testing.assert_allclose(result["parts[0].f"], 3 * (v**2 if same else v * np.abs(v)) / 4, atol=1e-9)
    result, v = over_speed(tr.InverseSpeedDependentForce(f_nominal=3, v_nominal=2, v0=2, ForceDirection=same))
    held = np.maximum(np.abs(v), 2)
    np.testing.assert_allclose(result["parts[0].f"], -6 / held if same else -6 * v / held**2, atol=1e-9)


def test_constant_power_accelerates_with_the_square_root_of_time() -> None:
    source = tr.InverseSpeedDependentForce(f_nominal=4, v_nominal=3, v0=0.1)
    result = run(joined(source, tr.Mass(m=2), joints="0.flange=1.flange_a"), 2.0, {"1.v": 1.0})
    np.testing.assert_allclose(result["parts[1].v"], np.sqrt(1 + 12 * result.time), rtol=1e-8)


def test_force_step() -> None:
    source = tr.ForceStep(stepForce=4, offsetForce=1, startTime=0.5)
    result = run(joined(source, tr.Mass(m=1), joints="0.flange=1.flange_a"), 1.0)
    t = result.time
    np.testing.assert_allclose(result["parts[1].v"], t + 4 * np.maximum(t - 0.5, 0), atol=1e-12)
    np.testing.assert_allclose(result["parts[0].f"][t > 0.5], -5.0)


def test_force_between_two_masses_keeps_momentum() -> None:
    parts = (tr.Mass(m=1), tr.Force2(), tr.Mass(m=3), Constant(k=6))
    result = run(joined(*parts, joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 3.y=1.f"), 1.0)
    np.testing.assert_allclose(result["parts[0].v"], -6 * result.time, atol=1e-12)
    np.testing.assert_allclose(result["parts[2].v"], 2 * result.time, atol=1e-12)


def test_force_acts_against_its_support() -> None:
    parts = (tr.Mass(m=1), tr.Force(), tr.Mass(m=4), Constant(k=8))
    result = run(joined(*parts, joints="0.flange_b=1.flange 1.support=2.flange_a 3.y=1.f"), 1.0)
    np.testing.assert_allclose(result["parts[0].v"], 8 * result.time, atol=1e-12)
    np.testing.assert_allclose(result["parts[2].v"], -2 * result.time, atol=1e-12)


def test_exact_position_asks_the_force_of_the_motion() -> None:
    parts = (tr.Position(exact=True), tr.Mass(m=3), Sine(amplitude=0.2, f=2))
    result = run(joined(*parts, joints="0.flange=1.flange_a 2.y=0.s_ref"), 1.0)
    w, t = 4 * np.pi, result.time
    np.testing.assert_allclose(result["parts[1].v"], 0.2 * w * np.cos(w * t), atol=1e-12)
    np.testing.assert_allclose(result["parts[1].flange_a.f"], -3 * 0.2 * w**2 * np.sin(w * t), atol=1e-10)


def test_filtered_position_is_a_bessel_filter() -> None:
    parts = (tr.Position(f_crit=5), Step(startTime=0.1), tr.Mass(m=1))
    result = run(joined(*parts, joints="0.flange=2.flange_a 1.y=0.s_ref"), 0.6)
    w = 2 * np.pi * 5
    late = result.time > 0.1
    fine, response = signal.step(([1.0], [0.6180 / w**2, 1.3617 / w, 1.0]), T=np.linspace(0, 0.5, 20_001))
    expected = np.interp(result.time[late] - 0.1, fine, response)
    np.testing.assert_allclose(result["parts[2].s"][late], expected, atol=1e-6)


def test_filtered_position_starts_on_its_signal() -> None:
    parts = (tr.Position(), Constant(k=0.7), tr.Mass(m=1))
    result = run(joined(*parts, joints="0.flange=2.flange_a 1.y=0.s_ref"), 0.1)
    np.testing.assert_allclose(result["parts[2].s"], 0.7, rtol=1e-12)


def test_filtered_speed_lags_and_starts_on_its_signal() -> None:
    parts = (tr.Speed(f_crit=5), Step(height=2, offset=1, startTime=0.1), tr.Mass(m=1))
    result = run(joined(*parts, joints="0.flange=2.flange_a 1.y=0.v_ref"), 0.6)
    t = result.time
    expected = 3 - 2 * np.exp(-2 * np.pi * 5 * np.maximum(t - 0.1, 0))
    np.testing.assert_allclose(result["parts[2].v"], expected, rtol=1e-8)


def test_exact_speed_and_constant_speed() -> None:
    parts = (tr.Speed(exact=True), tr.Mass(m=2), Ramp(height=3, duration=1), tr.ConstantSpeed(v_fixed=-2), tr.Mass(m=1))
    result = run(joined(*parts, joints="0.flange=1.flange_a 2.y=0.v_ref 3.flange=4.flange_a"), 0.9)
    np.testing.assert_allclose(result["parts[1].v"], 3 * result.time, atol=1e-12)
    np.testing.assert_allclose(result["parts[1].flange_a.f"], 6.0, rtol=1e-12)
    np.testing.assert_allclose(result["parts[4].s"], -2 * result.time, atol=1e-12)


def test_accelerate_and_move_agree() -> None:
    w = 2 * np.pi
    parts = (
        tr.Accelerate(),
        tr.Mass(m=1),
        tr.Move(),
        tr.Mass(m=1),
        Sine(amplitude=-(w**2), f=1),
        Sine(f=1),
        Cosine(amplitude=w, f=1),
    )
    joints = "0.flange=1.flange_a 2.flange=3.flange_a 4.y=0.a_ref=2.u_a 5.y=2.u_s 6.y=2.u_v"
    result = run(joined(*parts, joints=joints), 1.0, {"0.v": w})
    np.testing.assert_allclose(result["parts[1].s"], np.sin(w * result.time), atol=1e-8)
    np.testing.assert_allclose(result["parts[3].s"], result["parts[1].s"], atol=1e-8)


def test_sensors_read_and_do_not_disturb() -> None:
    parts = (
        tr.Force(),
        tr.ForceSensor(),
        tr.PowerSensor(),
        tr.MultiSensor(),
        tr.Mass(m=2, L=0.3),
        tr.Spring(c=80),
        tr.Mass(m=1),
        tr.RelPositionSensor(),
        tr.RelSpeedSensor(),
        tr.RelAccSensor(),
        tr.SpeedSensor(),
        tr.AccSensor(),
        tr.PositionSensor(),
        Sine(amplitude=5, f=1),
    )
    joints = (
        "13.y=0.f 0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a 3.flange_b=4.flange_a "
        "4.flange_b=5.flange_a=7.flange_a=8.flange_a=9.flange_a=10.flange=11.flange=12.flange "
        "5.flange_b=6.flange_a=7.flange_b=8.flange_b=9.flange_b"
    )
    result = run(joined(*parts, joints=joints), 2.0)
    bare = run(
        joined(tr.Force(), tr.Mass(m=2, L=0.3), tr.Spring(c=80), tr.Mass(m=1), Sine(amplitude=5, f=1),
               joints="4.y=0.f 0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a"),
        2.0,
    )  # fmt: skip
    assert result["parts[6].s"][-1] == pytest.approx(bare["parts[3].s"][-1], rel=1e-8)
    left, right = "parts[4]", "parts[6]"
    force, v = 5 * np.sin(2 * np.pi * result.time), result[f"{left}.v"]
    expected = {
        "parts[1].f": force,
        "parts[2].power": force * v,
        "parts[3].f": force,
        "parts[3].v": v,
        "parts[3].power": force * v,
        "parts[7].s_rel": result[f"{right}.s"] - result[f"{left}.s"] - 0.15,
        "parts[8].v_rel": result[f"{right}.v"] - v,
        "parts[9].a_rel": result[f"{right}.a"] - result[f"{left}.a"],
        "parts[10].v": v,
        "parts[11].a": result[f"{left}.a"],
        "parts[12].s": result[f"{left}.s"] + 0.15,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(result[name], values, atol=1e-10, err_msg=name)


def test_adaptors_pass_motion_one_way_and_force_the_other() -> None:
    parts = (
        tr.Mass(m=1),
        tr.ForceToPositionAdaptor(),
        tr.PositionToForceAdaptor(),
        tr.SpringDamper(c=40, d=3),
        tr.Fixed(),
    )
    joints = "0.flange_b=1.flange 1.s=2.s 2.f=1.f 2.flange=3.flange_a 3.flange_b=4.flange"
    adapted = run(joined(*parts, joints=joints), 2.0, {"0.s": 0.5, "0.v": 0.0}, points=50)
    direct = run(
        joined(parts[0], parts[3], parts[4], joints="0.flange_b=1.flange_a 1.flange_b=2.flange"),
        2.0, {"0.s": 0.5, "0.v": 0.0}, points=50,
    )  # fmt: skip
    np.testing.assert_allclose(adapted["parts[0].s"], direct["parts[0].s"], atol=1e-9)
    np.testing.assert_allclose(adapted["parts[1].a"], adapted["parts[0].a"], atol=1e-12)


def test_a_shift_actuator_supplies_the_work_of_its_force() -> None:
    """800 N move its own mass and another one, 1 kg each, by 20 mm: 16 J, half of it in either mass."""
    parts = tr.ShiftActuator(m=1, f_max=800, d=0), tr.Mass(m=1), Constant(k=1)
    result = run(joined(*parts, joints="0.flange=1.flange_a 2.y=0.s_ref"), 0.01)
    shares = pt.energy_audit(result).components
    assert result["parts[1].s"][-1] == pytest.approx(0.02)
    assert shares["sources"]["parts[0]"] == pytest.approx(16)
    assert [shares["stored"][f"parts[{k}]"] for k in (0, 1)] == pytest.approx([8, 8])
