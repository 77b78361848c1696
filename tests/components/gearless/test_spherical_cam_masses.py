"""The inertia of cams and rollers of a spherical cam differential: kinetic energy of bodies that roll on each other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from cases import few
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.gearless.solids import volume
from powertrain.components.gearless.spherical_cam import (
    NO_FRICTION,
    CamBody,
    CamMasses,
    SphericalCam,
    SphericalCamDifferential,
)
from powertrain.components.gearless.spherical_cam.rollers import roller_spin

BODY = CamBody(SphericalCam(4, 5), inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
JOINTS = "0.left=1.flange_a 0.right=2.flange_a 0.crown=3.flange"
SIDE = 2e-4


def coasting(masses: CamMasses | None, cam: SphericalCam = BODY.cam) -> Any:
    """Equal sides that turn against each other and a cage that is held: nothing drives, nothing rubs."""
    differential = SphericalCamDifferential(cam=cam, friction=NO_FRICTION, masses=masses)
    parts = [rot.Inertia(J=SIDE), rot.Inertia(J=SIDE), rot.Fixed()]
    return run(joined(differential, *parts, joints=JOINTS), 0.1, {"0.w_rel": 120.0}, rtol=1e-9, atol=1e-9)


def about_the_pin(cam: SphericalCam, u: float) -> float:
    """Speed of a roller about its axis for psi' = 1: it carries its axis with it and does not slide on the cam at the line of contact."""
    psi, h = u - cam.half, 1e-6
    axis, contact = cam.roller_axis(psi), cam.contact(psi)
    moved = (cam.roller_axis(psi + h) - cam.roller_axis(psi - h)) / (2 * h)
    across = np.cross(axis, moved)  # the part of its angular velocity that turns the axis
    slides = np.cross(np.array([0.0, 0.0, 1.0]) - across, contact)
    found = np.linalg.lstsq(np.cross(axis, contact)[:, None], slides, rcond=None)
    assert np.linalg.norm(np.cross(axis, contact) * found[0][0] - slides) < 1e-8
    return float(found[0][0])


@pytest.mark.parametrize("cam", [SphericalCam(4, 5), SphericalCam(3, 4), SphericalCam(3, 6), SphericalCam(5, 6)])
def test_rollers_roll(cam: SphericalCam) -> None:
    for u in np.linspace(-cam.half, cam.half, 15):
        assert abs(float(roller_spin(cam, u))) == pytest.approx(abs(about_the_pin(cam, float(u))), abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("cam", few([SphericalCam(4, 5), SphericalCam(3, 4)]))
def test_energy_is_that_of_cams_and_rollers(cam: SphericalCam) -> None:
    """Rollers of both sides on inner and outer cams, the latter half a stroke apart."""
    masses = CamMasses(J_cam=1e-5, J_inner=8e-6, J_outer=3e-6)
    result = coasting(masses, cam)
    psi, spin = result["parts[0].psi"], result["parts[0].w_cam"]
    u = np.mod(psi + cam.half, 2 * cam.half) - cam.half
    v = np.mod(psi, 2 * cam.half) - cam.half
    Q = [np.array([about_the_pin(cam, float(x)) for x in at]) for at in (u, v)]
    inside = (1e-5 + 8e-6 * Q[0] ** 2 + 3e-6 * Q[1] ** 2) * spin**2 / 2
    total = SIDE / 2 * (result["parts[1].w"] ** 2 + result["parts[2].w"] ** 2) + inside
    assert total.max() / total.min() - 1 < 1e-6
    assert inside.max() / inside.min() > 1.01  # the rollers take and give
    assert pt.energy_audit(result).closure < 1e-6
    np.testing.assert_allclose(coasting(None)["parts[0].w_rel"], 120.0)


def test_masses_of_a_design() -> None:
    """The cone's moment of inertia from its surface, by the divergence theorem; two sides and two pairs of cams."""
    made = CamMasses.of(BODY)
    assert made._values["J_cam"] == BODY.spin_inertia
    for which, name in (("inner", "J_inner"), ("outer", "J_outer")):
        body: Any = BODY.roller_solid(which, 721)  # type: ignore[arg-type]
        assert volume(body) > 0
        a, b, c = (body[:, k] for k in range(3))
        six = np.einsum("ij,ij->i", a, np.cross(b, c))
        squares = sum((p[:, k] * q[:, k]) for k in (0, 1) for p in (a, b, c) for q in (a, b, c)) + sum(
            (p[:, k] ** 2) for k in (0, 1) for p in (a, b, c)
        )
        wanted = 7850 * float((six * squares).sum()) / 120
        assert made._values[name] == pytest.approx(4 * wanted, rel=2e-3)
    assert math.isfinite(made._values["J_inner"])
