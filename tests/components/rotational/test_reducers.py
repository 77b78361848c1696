"""Harmonic and cycloidal drives: a maker's torsion, ratios of all three members, efficiencies, and the no-load torques."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot

DRIVE = rot.HarmonicDrive.of(200, 202)


def test_a_makers_torsion() -> None:
    """Harmonic Drive's example, size 32 and ratio 100: 60 N.m twist it by 7.15e-4 rad = 2.5 arcmin; and all three segments."""
    parts = rot.StiffeningSpring(stiffness=DRIVE.windup.stiffness), rot.Fixed(), rot.ConstantSpeed(w_fixed=3e-3)
    turned = joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange")
    result = pt.simulate(turned, 1.0, times=np.linspace(0, 1, 2001), starts={"parts[2].flange.phi": -1.5e-3}, rtol=1e-9)
    angles = np.interp([-60.0, 20.0, 60.0, 115.0], result["parts[0].tau"], result["parts[0].phi_rel"])
    assert angles[2] == pytest.approx(7.15e-4, abs=0.005e-4)
    assert angles[2] * 180 * 60 / math.pi == pytest.approx(2.5, abs=0.05)
    third = 29 / 6.7e4 + (108 - 29) / 1.1e5 + (115 - 108) / 1.2e5
    np.testing.assert_allclose(angles, [-angles[2], 20 / 6.7e4, 29 / 6.7e4 + 31 / 1.1e5, third], rtol=1e-4)
    stored = np.trapezoid(result["parts[0].tau"] * 3e-3, result.time)
    assert stored == pytest.approx(0.0, abs=1e-9)


def driven(drive: Any, tau_a: float, tau_b: float, w: float = 0.0, stop: float = 0.5) -> Any:
    """1e-4 kg.m2 at the fast shaft, 1 kg.m2 at the slow one, with a torque on each."""
    ratio = float(drive.mesh.ratio)
    parts = drive, rot.Inertia(J=1e-4), rot.Inertia(J=1.0)
    torques = rot.ConstantTorque(tau_constant=tau_a), rot.ConstantTorque(tau_constant=tau_b)
    wired = "0.flange_a=1.flange_a=3.flange 0.flange_b=2.flange_a=4.flange"
    return run(joined(*parts, *torques, joints=wired), stop, {"1.w": w, "2.w": w / ratio}, rtol=1e-8)


def acceleration(result: Any) -> float:
    """Of the output, after the spring has come to rest."""
    return float(np.diff(result.at([0.2, 0.5], "parts[2].w"))[0] / 0.3)


def test_efficiency_if_the_wave_generator_drives() -> None:
    """3 N.m lift 150 N.m: 0.8 of what exceeds the starting torque comes out."""
    result = driven(DRIVE, 3.0, 150.0)
    a = (100 * 0.8 * (3.0 - 0.1) - 150) / (1.0 + 100**2 * 1e-4 * 0.8)
    assert acceleration(result) == pytest.approx(-a, rel=1e-4)
    assert pt.energy_audit(result).closure < 1e-7


def test_efficiency_if_the_flexspline_drives() -> None:
    """150 N.m turn the wave generator against 0.5 N.m: 0.7 of what exceeds the back-driving torque of 12 N.m comes out."""
    result = driven(DRIVE, -0.5, -150.0)
    a = (150 - 12 - 100 / 0.7 * 0.5) / (1.0 + 100**2 * 1e-4 / 0.7)
    assert acceleration(result) == pytest.approx(-a, rel=1e-4)
    assert pt.energy_audit(result).closure < 1e-7


@pytest.mark.parametrize(("tau_b", "turns"), [(11.9, False), (12.1, True), (-11.9, False), (-12.1, True)])
def test_no_load_back_driving(tau_b: float, turns: bool) -> None:
    """12 N.m at the flexspline turn a free wave generator, less does not."""
    result = driven(DRIVE, 0.0, tau_b)
    assert bool(abs(result["parts[1].w"][-1]) > 1e-6) == turns


@pytest.mark.parametrize(
    ("drive", "starting"),
    [(DRIVE, 0.1), (rot.HarmonicDrive(), 0.1), (rot.CycloidalDrive.of(29, 30), 0.15), (rot.CycloidalDrive(), 0.15)],
)
def test_no_load_starting(drive: Any, starting: float) -> None:
    """With the output free, the fast shaft rests below the starting torque and turns above it."""
    for tau_a, turns in ((0.99 * starting, False), (1.01 * starting, True), (-1.01 * starting, True)):
        assert bool(abs(driven(drive, tau_a, 0.0)["parts[1].w"][-1]) > 1e-6) == turns


@pytest.mark.parametrize("lobes", [6, 29, 87])
def test_no_load_starting_without_mesh_loss(lobes: int) -> None:
    """Only bearing friction: the same torque at the eccentric in both directions of power, whatever the rounding of its ratio."""
    drive = rot.CycloidalDrive.of(lobes, lobes + 1, efficiency=1.0, back=1.0, starting=0.05)
    for tau_a, turns in ((0.0495, False), (0.0505, True)):
        assert bool(abs(driven(drive, tau_a, 0.0)["parts[1].w"][-1]) > 1e-6) == turns
        assert bool(abs(driven(drive, 0.0, lobes * tau_a)["parts[1].w"][-1]) > 1e-6) == turns


def test_no_load_torques_of_no_mesh_are_rejected() -> None:
    """The larger torque of the two directions would hold in both: 6 N.m/29 at 90 % are 0.186 N.m at the eccentric."""
    with pytest.raises(pt.ParameterError, match=r"starting = 0.15 N.m .* backdriving = 6 N.m.* = 0.1862 N.m and"):
        rot.CycloidalDrive.of(29, 30, backdriving=6.0)
    with pytest.raises(pt.ParameterError, match=r"starting = 0.2 N.m .* and .* = 0.15 N.m"):
        rot.HarmonicDrive.of(200, 202, starting=0.2, backdriving=12.0)
    with pytest.raises(pt.ParameterError, match=r"efficiency = 0.8 and back = 0 must be in"):
        rot.HarmonicDrive.of(200, 202, back=0.0)


def test_ratios_of_all_members() -> None:
    """Circular spline at rest: -100; flexspline at rest, output at the circular spline: 101."""
    free = rot.HarmonicDrive.of(200, 202, starting=0.0, backdriving=0.0, efficiency=1.0, back=1.0)
    turns = rot.ConstantSpeed(w_fixed=10.0)
    slow = run(
        joined(free, turns, rot.Inertia(J=1), joints="0.flange_a=1.flange 0.flange_b=2.flange_a"), 1.0, {"2.w": -0.1}
    )
    assert slow["parts[2].w"][-1] == pytest.approx(-0.1, rel=1e-6)
    held = joined(
        free,
        turns,
        rot.Inertia(J=1),
        rot.Fixed(),
        joints="0.flange_a=1.flange 0.flange_b=3.flange 0.support=2.flange_a",
    )
    assert run(held, 1.0, {"2.w": 10 / 101})["parts[2].w"][-1] == pytest.approx(10 / 101, rel=1e-6)
    assert float(rot.CycloidalDrive.of(lobes=28, pins=30).mesh.ratio) == -14


def test_the_output_swings_on_its_windup() -> None:
    """Wave generator held: small swings of 2 kg.m2 with sqrt(K_1/J), as no part of the first segment is backlash."""
    drive = rot.CycloidalDrive.of(29, 30, efficiency=1.0, back=1.0, starting=0.0, backdriving=0.0, d=0.0)
    parts = drive, rot.Fixed(), rot.Inertia(J=2.0)
    model = joined(*parts, joints="0.flange_a=1.flange 0.flange_b=2.flange_a")
    frequency = math.sqrt(5e4 / 2.0)
    result = run(model, 0.1, {"2.w": 1e-3})
    np.testing.assert_allclose(result["parts[2].w"], 1e-3 * np.cos(frequency * result.time), atol=1e-8)


def test_what_cannot_be_is_rejected() -> None:
    with pytest.raises(pt.ParameterError, match="202 teeth does not fit round a flexspline of 202"):
        rot.HarmonicDrive.of(202, 202)
    with pytest.raises(pt.ParameterError, match="30 lobes does not turn in 29 pins"):
        rot.CycloidalDrive.of(30, 29)
    with pytest.raises(pt.ParameterError, match=r"CycloidalDrive.of: lobes = 29.5 is not an integer"):
        rot.CycloidalDrive.of(29.5, 30)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"HarmonicDrive.of: circular = 202.5 is not an integer"):
        rot.HarmonicDrive.of(200, 202.5)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"HarmonicDrive.of: starting = '0.1 N.m' is not a number"):
        rot.HarmonicDrive.of(200, 202, starting="0.1 N.m")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=r"starting = -0.1 N.m must be zero or positive, and finite"):
        rot.HarmonicDrive.of(200, 202, starting=-0.1)
    with pytest.raises(pt.ParameterError, match=r"backdriving = nan N.m must be zero or positive, and finite"):
        rot.HarmonicDrive.of(200, 202, backdriving=float("nan"))
    for wrong in (((1.0, 1e4),), ((0.0, 1e4), (0.0, 2e4)), ((0.0, 0.0),)):
        with pytest.raises(pt.ParameterError, match="torques that increase from 0"):
            pt.compile(rot.StiffeningSpring(stiffness=wrong))
    with pytest.raises(pt.ParameterError, match=r"stiffness .* is not 2 finite numbers"):
        rot.StiffeningSpring(stiffness=((0.0, 1e4, 2e4),))  # type: ignore[arg-type]
