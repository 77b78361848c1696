"""Laws that hold the same motion, laws in rows, laws at rest at the start."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from core_models import Joined, ThreeClutches, row

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant, Ramp, Sine
from powertrain.vehicles.four_wheel_drive import FourWheelDriveCar

TIGHT: dict[str, Any] = {"rtol": 1e-9}


def test_three_clutches_in_series_end_as_one_shaft() -> None:
    """Momentum: the torque's impulse, 1/pi (1 - cos) over whole periods zero, so 4 w = 10 when all are locked."""
    result = pt.simulate(ThreeClutches(), 3.0, **TIGHT)
    assert [result[f"clutch{k}.mode"][-1] for k in (1, 2, 3)] == [0, 0, 0]
    assert result["J4.w"][-1] == pytest.approx(10.0 / 4.0, abs=1e-5)
    momentum = sum(result[f"J{k}.w"] for k in (1, 2, 3, 4))
    impulse = 10.0 / (2 * np.pi * 5.0) * (1 - np.cos(2 * np.pi * 5.0 * result.time))
    np.testing.assert_allclose(momentum - 10.0, impulse, atol=1e-6)


def brake_and_bearing(torque: float) -> Joined:
    return row(
        rot.Torque(), rot.Inertia(J=2.0), rot.BearingFriction(tau_pos=((0.0, 3.0),)), rot.Brake(fn_max=14.0),
        Ramp(height=torque, duration=1.0), Constant(k=1.0), joints=(("4.y", "0.tau"), ("5.y", "3.f_normalized")),
    )  # fmt: skip


def test_brake_beside_a_bearing_hold_together_and_break_together() -> None:
    """3 N.m and 7 N.m hold 10 N.m."""
    result = pt.simulate(brake_and_bearing(20.0), 1.0, **TIGHT)
    loose = result.time > 0.5 + 1e-9
    np.testing.assert_allclose(result["parts[1].w"][~loose], 0.0, atol=1e-15)
    np.testing.assert_allclose(
        result["parts[1].w"][loose],
        (10 * (result.time[loose] ** 2 - 0.25) - 10 * (result.time[loose] - 0.5)) / 2,
        atol=1e-8,
    )
    held = result["parts[2].tau"] + result["parts[3].tau"]
    np.testing.assert_allclose(held[~loose], 20.0 * result.time[~loose], atol=1e-9)


def test_lossy_gear_beside_a_bearing_at_rest() -> None:
    """The load side moves when T eta i > bearing: T = 5 t, eta 0.8, i 2, bearing 2 N.m at the load: T = 1.25."""
    model = row(
        rot.Torque(), rot.Inertia(J=1.0), rot.Gear(ratio=2.0, efficiency=0.8), rot.Inertia(J=1.0),
        rot.BearingFriction(tau_pos=((0.0, 2.0),)), Ramp(height=5.0, duration=1.0), joints=(("5.y", "0.tau"),),
    )  # fmt: skip
    result = pt.simulate(model, 1.0, **TIGHT)
    start = 1.25 / 5.0
    moving = result.time > start + 1e-9
    np.testing.assert_allclose(result["parts[3].w"][~moving], 0.0, atol=1e-12)
    t = result.time[moving]
    a2 = (0.8 * 2.0 * 5.0 * t - 2.0) / (1.0 + 0.8 * 4.0 * 1.0)
    np.testing.assert_allclose(result["parts[3].a"][moving][1:], a2[1:], atol=1e-7)


@pytest.mark.parametrize("drive", [3.0, -3.0])
def test_lossy_gear_of_ratio_one_between_equal_inertias(drive: float) -> None:
    """Whichever side drives: the torqued one. J a1 = T - t, J a1 = eta t."""
    model = row(
        rot.ConstantTorque(tau_constant=drive),
        rot.Inertia(J=1.0),
        rot.Gear(ratio=1.0, efficiency=0.7),
        rot.Inertia(J=1.0),
    )
    result = pt.simulate(model, 1.0)
    np.testing.assert_allclose(result["parts[1].w"], drive / (1 + 1 / 0.7) * result.time, atol=1e-9)


def test_lossy_gear_with_torques_on_both_sides_holds() -> None:
    """T at a against -T' at b with T eta < T' < T/eta: neither side overcomes the other."""
    model = row(
        rot.ConstantTorque(tau_constant=3.0), rot.Inertia(J=1.0), rot.Gear(ratio=1.0, efficiency=0.7), rot.Inertia(J=1.0),
        rot.ConstantTorque(tau_constant=-2.5),
    )  # fmt: skip
    result = pt.simulate(model, 1.0)
    np.testing.assert_allclose(result["parts[1].w"], 0.0, atol=1e-12)
    assert result["parts[2].mode"][-1] == 0


def planetary(torque: float) -> Joined:
    """A planetary gear at rest with a brake on every member and a clutch between sun and ring."""
    return Joined(
        parts=(
            rot.IdealPlanetary(ratio=2.0), *(rot.Inertia(J=1.0) for _ in range(3)), *(rot.Brake(fn_max=100.0) for _ in range(3)),
            rot.Clutch(fn_max=100.0), rot.Torque(), Constant(k=1.0), Sine(amplitude=torque, f=1.0),
        ),
        joints=(
            ("0.sun", "1.flange_a", "4.flange_a", "7.flange_a", "8.flange"), ("0.carrier", "2.flange_a", "5.flange_a"),
            ("0.ring", "3.flange_a", "6.flange_a", "7.flange_b"),
            ("9.y", "4.f_normalized", "5.f_normalized", "6.f_normalized", "7.f_normalized"),
            ("10.y", "8.tau"),
        ),
    )  # fmt: skip


def test_locked_set_that_is_redundant_but_not_in_pairs() -> None:
    result = pt.simulate(planetary(20.0), 1.0)
    for k in range(1, 4):
        np.testing.assert_allclose(result[f"parts[{k}].w"], 0.0, atol=1e-14)
    torques = np.array([result[f"parts[{k}].tau"] for k in (4, 5, 6, 7)])
    assert np.isfinite(torques).all()
    assert np.abs(torques).max() <= 50.0 + 1e-6
    sun = result["parts[8].tau"] - result["parts[4].tau"] + result["parts[7].tau"] - result["parts[0].sun.tau"]
    np.testing.assert_allclose(sun, 0.0, atol=1e-6)
    np.testing.assert_allclose(result["parts[5].tau"], 3 * result["parts[0].sun.tau"], atol=1e-6)


def test_planetary_shifts_from_brake_to_clutch() -> None:
    """Brake on the ring: w_s = 3 w_c. Then clutch sun-ring: all as one; momentum about the common axis is kept by no one else."""
    model = Joined(
        parts=(
            rot.IdealPlanetary(ratio=2.0), *(rot.Inertia(J=1.0) for _ in range(3)), rot.Brake(fn_max=200.0), rot.Clutch(fn_max=200.0),
            Constant(k=1.0), Ramp(height=-1.0, duration=0.2, startTime=0.3, offset=1.0), Ramp(height=1.0, duration=0.2, startTime=0.6),
        ),
        joints=(
            ("0.sun", "1.flange_a", "5.flange_a"), ("0.carrier", "2.flange_a"), ("0.ring", "3.flange_a", "4.flange_a", "5.flange_b"),
            ("7.y", "4.f_normalized"), ("8.y", "5.f_normalized"),
        ),
    )  # fmt: skip
    result = pt.simulate(model, 1.5, starts={"parts[1].w": 9.0, "parts[3].w": 0.0}, **TIGHT)
    early = result.time < 0.25
    np.testing.assert_allclose(result["parts[3].w"][early], 0.0, atol=1e-12)
    np.testing.assert_allclose(result["parts[2].w"][early], 3.0, atol=1e-9)
    np.testing.assert_allclose(result["parts[1].w"][-1], result["parts[2].w"][-1], atol=1e-9)
    assert result["parts[1].w"][-1] == pytest.approx((9.0 + 3.0) / 3, abs=1e-7)


@pytest.mark.parametrize("force", [5.0, -5.0])
def test_hard_stop_with_friction_holds_at_the_start(force: float) -> None:
    """A mass between its stops: 5 N against 8 N of friction stays; at the stop 20 N stay as well."""
    stop = trans.MassWithStopAndFriction(
        L=1.0, m=1.0, F_prop=1.0, F_Coulomb=8.0, F_Stribeck=0.0, fexp=1.0, smin=-2.0, smax=2.0
    )
    model = row(trans.ConstantForce(f_constant=force), stop)
    result = pt.simulate(model, 1.0, starts={"parts[1].s": 0.0})
    np.testing.assert_allclose(result["parts[1].v"], 0.0, atol=1e-14)
    pressed = pt.simulate(
        pt.replace(model, {"parts[0].f_constant": 4 * force}), 1.0, starts={"parts[1].s": np.sign(force) * 1.5}
    )
    np.testing.assert_allclose(pressed["parts[1].v"], 0.0, atol=1e-12)


class Loop(pt.Component):
    """Three bodies and a clutch between every two of them."""

    w1: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    w2: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    w3: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    a: pt.Variable = pt.variable("N.m", "Torque from 1 to 2")
    b: pt.Variable = pt.variable("N.m", "Torque from 2 to 3")
    c: pt.Variable = pt.variable("N.m", "Torque from 3 to 1")

    def equations(self) -> pt.Equations:
        yield pt.friction(self.w1 - self.w2, self.a, -1.0, 1.0, name="clutch_a")
        yield pt.friction(self.w2 - self.w3, self.b, -1.0, 1.0, name="clutch_b")
        yield pt.friction(self.w3 - self.w1, self.c, -1.0, 1.0, name="clutch_c")
        yield pt.der(self.w1) == 0.3 - self.a + self.c
        yield pt.der(self.w2) == self.a - self.b
        yield pt.der(self.w3) == self.b - self.c


def test_a_loop_of_stuck_clutches() -> None:
    """Any torque may go round: clutches of equal compliance let none go round, and carry what their neighbours do not."""
    result = pt.simulate(Loop(), 1.0)
    assert result["w2"][-1] == pytest.approx(0.1)
    assert [result[name][-1] for name in "abc"] == pytest.approx([0.1, 0.0, -0.1], abs=1e-6)


@pytest.mark.slow
def test_notes_of_a_car_are_short() -> None:
    for note in pt.simulate(FourWheelDriveCar(), 1.0).notes:
        assert len(note) < 300
        assert "yield" not in note
