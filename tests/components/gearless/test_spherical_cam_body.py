"""Contact pressure, volume and inertia of a spherical cam's body, and its spin in motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.gearless.spherical_cam import (
    NO_FRICTION,
    CamBody,
    CamMasses,
    Cycle,
    SphericalCam,
    SphericalCamDifferential,
)

CAM = SphericalCam(4, 5)
BODY = CamBody(CAM, inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
CAMS = [CAM, SphericalCam(3, 6), SphericalCam(5, 4, alpha_3=math.radians(30), alpha_4=math.radians(16))]
SPUN = "0.left=1.flange 0.right=2.flange 2.flange=4.flange_a 0.crown=3.flange"


@pytest.mark.parametrize("cam", CAMS)
def test_conformity_from_the_drawn_profile(cam: SphericalCam) -> None:
    """Geodesic curvature of the profile from differences, and that of the roller's circle."""
    psi, h = np.linspace(*cam.stroke, 30)[1:-1], 1e-4
    before, at, after = (cam.profile(psi + step) for step in (-h, 0.0, h))
    to_roller = cam.pitch_curve(psi) - at * math.cos(cam.alpha_4)
    to_roller /= np.linalg.norm(to_roller, axis=-1, keepdims=True)
    speed, change = (after - before) / 2 / h, (after - 2 * at + before) / h**2
    curvature = -(change * to_roller).sum(-1) / (speed**2).sum(-1)
    np.testing.assert_allclose(cam.conformity(psi), 1 / (1 / math.tan(cam.alpha_4) + curvature), rtol=1e-6)


def test_inner_and_outer_cam_alternate_at_every_half_stroke() -> None:
    """The forces are continuous there, also where the angle over half a stroke is a whole number but for round-off."""
    cycle = Cycle(BODY.cam)
    s = np.arange(1, 200) * BODY.cam.half
    inner, outer, _ = BODY.forces(cycle, s, 100.0)
    after = BODY.forces(cycle, s + 1e-7, 100.0)
    np.testing.assert_allclose(inner, after[0], atol=0.1)
    np.testing.assert_allclose(outer, after[1], atol=0.1)


def test_pressure_of_a_line_contact() -> None:
    """By slices of the line: each a pair of cylinders of its own radius, and their moments carry the torque."""
    cycle, torque = Cycle(CAM), 150.0
    reduced = BODY.E / (2 * (1 - BODY.nu**2))
    for s in np.linspace(0.05, 2 * CAM.half, 12):
        carried = 0.0
        for pressure, (low, high), start in zip(
            BODY.pressure(cycle, s, torque), (BODY.inner, BODY.outer), (0.0, CAM.half), strict=True
        ):
            u = (s + start) % (2 * CAM.half)
            arm = -float(CAM.lever_arms(u - CAM.half)[0])
            rho = low + (high - low) * (np.arange(2000) + 0.5) / 2000
            per_length = (
                math.pi * pressure**2 * float(CAM.conformity(u - CAM.half)) * rho / reduced
            )  # p^2 = w E'/(pi R)
            carried += float((per_length * rho).mean() * (high - low)) * arm
        assert BODY.pairs * carried == pytest.approx(torque, rel=1e-6)


def test_size_for_a_pressure() -> None:
    """Torque over volume goes with the square of the pressure: 27 % less volume takes 17 % more."""
    cycle = Cycle(CAM)
    p = BODY.greatest_pressure(cycle, 150.0)
    grid = np.array(BODY.pressure(cycle, np.linspace(0, 2 * CAM.half, 3001), 150.0))
    assert grid.max() <= p * (1 + 1e-9)
    assert grid.max() == pytest.approx(p, rel=1e-5)
    smaller = BODY.sized(cycle, 150.0, p / math.sqrt(0.73))
    assert smaller.volume / BODY.volume == pytest.approx(0.73, rel=1e-6)
    assert p / math.sqrt(0.73) / p == pytest.approx(1.17, abs=0.001)
    assert smaller.greatest_pressure(cycle, 150.0) == pytest.approx(p / math.sqrt(0.73), rel=1e-9)


@pytest.mark.slow
def test_volume_and_inertia_by_cells() -> None:
    azimuth = (np.arange(720) + 0.5) / 720 * 2 * math.pi
    points = CAM.whole_profile(2001)
    order = np.argsort(np.arctan2(points[:, 1], points[:, 0]))
    edge = np.interp(
        azimuth, np.arctan2(points[order, 1], points[order, 0]), np.arccos(points[order, 2]), period=2 * math.pi
    )
    volume = second = 0.0
    for low, high in (BODY.inner, BODY.outer):
        rho = low + (high - low) * (np.arange(60) + 0.5) / 60
        share = (np.arange(400) + 0.5) / 400
        theta = edge[:, None] * share
        for r in rho:
            inside = r * np.sin(theta) > BODY.bore
            cell = r**2 * np.sin(theta) * inside * edge[:, None] / 400 * (2 * math.pi / 720) * (high - low) / 60
            volume, second = volume + cell.sum(), second + (cell * (r * np.sin(theta)) ** 2).sum()
    assert pytest.approx(2 * volume, rel=2e-3) == BODY.volume
    assert pytest.approx(2 * second * BODY.density, rel=2e-3) == BODY.spin_inertia


def spun(masses: CamMasses | None) -> Any:
    """One side at rest, the other one an inertia under a torque, the crown wheel free of torque."""
    parts = [SphericalCamDifferential(masses=masses, friction=NO_FRICTION), rot.ConstantSpeed(w_fixed=0.0)]
    parts += [rot.ConstantTorque(tau_constant=T) for T in (2.0, 0.0)] + [rot.Inertia(J=0.1)]
    return run(joined(*parts, joints=SPUN), 1.0)


@pytest.mark.slow
def test_cams_have_to_be_spun_up() -> None:
    """w_cam = (N/M) w_rel/2 makes them an inertia of J (N/M)^2/4 between the sides."""
    result = spun(CamMasses(J_cam=0.04))
    assert result["parts[4].w"][-1] == pytest.approx(2.0 / (0.1 + 0.04 * (5 / 4) ** 2 / 4), rel=1e-9)
    assert spun(None)["parts[4].w"][-1] == pytest.approx(20.0, rel=1e-9)
    assert pt.energy_audit(result).closure < 1e-9


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"inner": (0.03, 0.02)}, "must be finite and increasing"),
        ({"outer": (0.025, 0.036)}, "with the outer cam outside"),
        ({"bore": 0.02}, "bore = 0.02 m must lie in"),
        ({"pairs": 0}, "pairs = 0"),
        ({"nu": 0.7}, "nu = 0.7"),
    ],
)
def test_impossible_bodies_are_refused(given: dict[str, Any], said: str) -> None:
    values: dict[str, Any] = {"inner": (0.020, 0.029), "outer": (0.030, 0.036), **given}
    with pytest.raises(pt.ParameterError, match=said):
        CamBody(CAM, **values)
