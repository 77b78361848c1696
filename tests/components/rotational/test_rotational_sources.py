"""Torque and motion sources: closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rotational_line import Line, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Cosine, Ramp, Sine

J = 2.0


def on_inertia(source: pt.Component, signal: pt.Component | None = None, name: str = "tau") -> Line:
    line = Line(parts=(source, rot.Inertia(J=J)))
    return line if signal is None else pt.replace(line, signals=(signal,), wires=((0, 0, name),))


def test_torque_accelerates_in_its_own_direction() -> None:
    result = run(on_inertia(rot.Torque(), Constant(k=3)), 1.0)
    np.testing.assert_allclose(result["parts[1].w"], 3 / J * result.time, atol=1e-10)
    np.testing.assert_allclose(result["parts[0].support.tau"], 3.0)


def test_torque_between_two_shafts_drives_them_apart() -> None:
    line = Line(
        parts=(rot.Inertia(J=1), rot.Torque2(), rot.Inertia(J=J)), signals=(Constant(k=3),), wires=((0, 1, "tau"),)
    )
    result = run(line, 1.0)
    np.testing.assert_allclose(result["parts[0].w"], -3 * result.time, atol=1e-10)
    np.testing.assert_allclose(result["parts[2].w"], 3 / J * result.time, atol=1e-10)


def test_constant_torque_and_its_step() -> None:
    result = run(on_inertia(rot.ConstantTorque(tau_constant=-3)), 1.0)
    np.testing.assert_allclose(result["parts[1].w"], -3 / J * result.time, atol=1e-10)
    result = run(on_inertia(rot.TorqueStep(offsetTorque=1, stepTorque=3, startTime=0.5)), 1.0)
    expected = (result.time + 3 * np.maximum(result.time - 0.5, 0)) / J
    np.testing.assert_allclose(result["parts[1].w"], expected, atol=1e-10)


@pytest.mark.parametrize("sign", [1, -1])
def test_linear_brake(sign: int) -> None:
    source = rot.LinearSpeedDependentTorque(tau_nominal=-4, w_nominal=10, TorqueDirection=False)
    result = run(on_inertia(source), 5.0, {"1.w": sign * 10.0})
    np.testing.assert_allclose(result["parts[1].w"], sign * 10 * np.exp(-0.2 * result.time), rtol=1e-7)


def test_linear_torque_of_one_direction() -> None:
    """Through zero speed: w' = -|w|/5 brakes forward and drives on backward."""
    source = rot.LinearSpeedDependentTorque(tau_nominal=-4, w_nominal=10)
    result = run(on_inertia(source), 5.0, {"1.w": -1.0})
    np.testing.assert_allclose(result["parts[1].w"], -np.exp(0.2 * result.time), rtol=1e-7)


@pytest.mark.parametrize("sign", [1, -1])
def test_quadratic_brake(sign: int) -> None:
    source = rot.QuadraticSpeedDependentTorque(tau_nominal=-4, w_nominal=10, TorqueDirection=False)
    result = run(on_inertia(source), 5.0, {"1.w": sign * 10.0})
    np.testing.assert_allclose(result["parts[1].w"], sign * 10 / (1 + 0.2 * result.time), rtol=1e-7)


def test_quadratic_torque_of_one_direction() -> None:
    source = rot.QuadraticSpeedDependentTorque(tau_nominal=4, w_nominal=10)
    result = run(on_inertia(source), 4.0, {"1.w": -10.0})
    np.testing.assert_allclose(result["parts[1].w"], -10 / (1 + 0.2 * result.time), rtol=1e-7)


def test_inverse_torque_has_constant_power() -> None:
    source = rot.InverseSpeedDependentTorque(tau_nominal=4, w_nominal=10, w0=2)
    result = run(on_inertia(source), 5.0)
    fast = result["parts[1].w"] >= 2
    power = result["parts[0].tau"] * result["parts[1].w"]
    np.testing.assert_allclose(power[fast], 40.0, rtol=1e-9)
    np.testing.assert_allclose(result["parts[0].tau"][result["parts[1].w"] < 2 - 1e-9], 20.0)
    start = 2 / (20 / J)
    expected = np.sqrt(4 + 2 * 40 / J * (result.time[fast] - start))
    np.testing.assert_allclose(result["parts[1].w"][fast], expected, rtol=1e-7)


def test_inverse_torque_that_changes_sign() -> None:
    source = rot.InverseSpeedDependentTorque(tau_nominal=-4, w_nominal=10, w0=1, TorqueDirection=False)
    result = run(on_inertia(source), 5.0, {"1.w": 5.0})
    w, tau = result["parts[1].w"], result["parts[0].tau"]
    np.testing.assert_allclose(tau[w > 1 + 1e-9], -40 / w[w > 1 + 1e-9], rtol=1e-9)
    np.testing.assert_allclose(tau[w < 1 - 1e-9], -4 * w[w < 1 - 1e-9], rtol=1e-9)


@pytest.mark.parametrize(
    ("reg", "half"),
    [("linear", 0.5), ("sine", math.sin(math.pi / 4)), ("cosine", 1 - math.cos(math.pi / 4)), ("exp", 1.0)],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_sign_torque(reg: str, half: float, sign: int) -> None:
    source = rot.SignTorque(tau_nominal=-4, w0=1, reg=reg)  # type: ignore[arg-type]
    result = run(on_inertia(source), 6.0, {"1.w": sign * 5.0})
    w, tau = result["parts[1].w"], result["parts[0].tau"]
    fast = np.abs(w) > 1 + 1e-9
    np.testing.assert_allclose(tau[fast], -sign * 4.0, rtol=1e-9)
    np.testing.assert_allclose(w[fast], sign * (5 - 2 * result.time[fast]), rtol=1e-8)
    assert np.interp(-0.5, -np.abs(w), np.abs(tau)) == pytest.approx(4 * half, rel=2e-2)
    assert abs(w[-1]) < 0.2


def test_exact_position_needs_the_torque_of_its_acceleration() -> None:
    result = run(on_inertia(rot.Position(exact=True), Sine(amplitude=0.3, f=2), "phi_ref"), 1.0)
    omega = 4 * math.pi
    np.testing.assert_allclose(result["parts[1].phi"], 0.3 * np.sin(omega * result.time), atol=1e-12)
    np.testing.assert_allclose(result["parts[1].w"], 0.3 * omega * np.cos(omega * result.time), atol=1e-10)
    np.testing.assert_allclose(
        result["parts[0].flange.tau"], J * 0.3 * omega**2 * np.sin(omega * result.time), atol=1e-8
    )


def test_filtered_position_follows_like_a_bessel_filter() -> None:
    f, f_crit = 2.0, 10.0
    result = run(on_inertia(rot.Position(f_crit=f_crit), Sine(amplitude=0.3, f=f), "phi_ref"), 2.0)
    s = 1j * f / f_crit
    gain = 1 / (1 + 1.3617 * s + 0.6180 * s**2)
    late = result.time > 1
    expected = 0.3 * (gain * np.exp(2j * math.pi * f * result.time[late])).imag
    np.testing.assert_allclose(result["parts[1].phi"][late], expected, atol=1e-7)


def test_filtered_position_starts_on_its_signal() -> None:
    result = run(on_inertia(rot.Position(), Constant(k=0.7), "phi_ref"), 1.0)
    np.testing.assert_allclose(result["parts[1].phi"], 0.7, rtol=1e-9)


def test_exact_speed() -> None:
    result = run(on_inertia(rot.Speed(exact=True), Ramp(height=6, duration=3, offset=1), "w_ref"), 2.0)
    np.testing.assert_allclose(result["parts[1].w"], 1 + 2 * result.time, atol=1e-12)
    np.testing.assert_allclose(result["parts[1].phi"], result.time + result.time**2, atol=1e-9)
    np.testing.assert_allclose(result["parts[0].flange.tau"], -J * 2.0, rtol=1e-9)


def test_filtered_speed_follows_a_ramp_with_a_lag() -> None:
    result = run(on_inertia(rot.Speed(f_crit=5), Ramp(height=6, duration=3, offset=1), "w_ref"), 2.0)
    lag = 1 / (10 * math.pi)
    expected = 1 + 2 * (result.time - lag * (1 - np.exp(-result.time / lag)))
    np.testing.assert_allclose(result["parts[1].w"], expected, atol=1e-8)


def test_acceleration_and_constant_speed() -> None:
    result = run(on_inertia(rot.Accelerate(), Constant(k=3), "a_ref"), 2.0)
    np.testing.assert_allclose(result["parts[1].phi"], 1.5 * result.time**2, atol=1e-9)
    np.testing.assert_allclose(result["parts[0].flange.tau"], -3 * J, rtol=1e-9)
    result = run(on_inertia(rot.ConstantSpeed(w_fixed=4)), 2.0)
    np.testing.assert_allclose(result["parts[1].phi"], 4 * result.time, atol=1e-9)


def test_move_follows_its_three_signals() -> None:
    omega = 2 * math.pi
    line = Line(
        parts=(rot.Move(), rot.Inertia(J=J)),
        signals=(Sine(f=1), Cosine(amplitude=omega, f=1), Sine(amplitude=-(omega**2), f=1)),
        wires=((0, 0, "u_phi"), (1, 0, "u_w"), (2, 0, "u_a")),
    )
    result = run(line, 1.0)
    np.testing.assert_allclose(result["parts[1].phi"], np.sin(omega * result.time), atol=1e-8)
    np.testing.assert_allclose(result["parts[1].w"], omega * np.cos(omega * result.time), atol=1e-7)


def test_sources_turn_with_their_support() -> None:
    """A constant speed against a support that itself is turned."""

    class OnTurntable(pt.Component):
        table: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=2)
        motor: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=5)
        shaft: rot.Inertia = rot.Inertia(J=J)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.table.flange, self.motor.support)
            yield pt.connect(self.motor.flange, self.shaft.flange_a)

    result = run(OnTurntable(), 1.0)
    np.testing.assert_allclose(result["shaft.w"], 7.0, rtol=1e-12)
