"""Forces, contact pressures and shaking of gearless differentials in a simulated run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from cases import few
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.gearless import contact_of, reactions_of, shaking_of
from powertrain.components.gearless.circular_cam import TABLE_1, CircularCamDifferential, RollerMasses, Track
from powertrain.components.gearless.circular_cam import forces as cam_forces
from powertrain.components.gearless.linkage import CORRECTED, JointFriction, Linkage, LinkageDifferential, LinkMasses
from powertrain.components.gearless.linkage.masses import LinkBody
from powertrain.components.gearless.spherical_cam import (
    NO_FRICTION,
    CamBody,
    CamMasses,
    SphericalCam,
    SphericalCamDifferential,
)

BODY = CamBody(SphericalCam(4, 5), inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
AT = "parts[0]"
AXLE = "0.crown=1.flange_a 0.left=2.flange_a 0.right=3.flange_a 1.flange_b=4.flange 2.flange_b=5.flange 3.flange_b=6.flange"


def axle(
    differential: pt.Component, torques: tuple[float, float, float] = (200.0, -60.0, -110.0), fast: float = 13.0
) -> Any:
    """Inertias and torques on crown, left and right."""
    parts = [rot.Inertia(J=J) for J in (0.5, 1.0, 1.2)] + [rot.ConstantTorque(tau_constant=T) for T in torques]
    starts = {"1.w": 10.0, "2.w": fast}
    return run(joined(differential, *parts, joints=AXLE), 0.5, starts, times=np.linspace(0, 0.5, 201))


def test_circular_cams() -> None:
    """Forces are those of the design at the run's phases; the friction of the disks is that of the simulated torque."""
    differential = CircularCamDifferential.from_design(TABLE_1, masses=True)
    result = axle(differential)
    found, theta, torque = reactions_of(result, path=AT), result[f"{AT}.theta"], result[f"{AT}.crown.tau"]
    wanted = cam_forces(TABLE_1, theta, torque)
    for name in ("F_u_out", "F_n_in", "F_ax", "M_friction"):
        np.testing.assert_allclose(found[name], getattr(wanted, name), rtol=1e-9)
    assert found.units == {**found.units, "F_ax": "N", "alpha_in": "rad", "share": "1", "M_cam": "N.m"}
    slides = np.abs(result[f"{AT}.w_rel"]) > 1e-6
    np.testing.assert_allclose(found["M_friction"][slides], np.abs(result[f"{AT}.tau"][slides]), rtol=1e-6)
    pressures = contact_of(result, path=AT)
    assert set(pressures) == {"outer_concave", "outer_convex", "inner_concave", "inner_convex"}
    assert (pressures["outer_convex"] >= pressures["outer_concave"]).all()
    plain = contact_of(axle(CircularCamDifferential.from_design(TABLE_1)), TABLE_1, path=AT)
    assert plain["inner_convex"].max() == pytest.approx(pressures["inner_convex"].max(), rel=0.01)
    with pytest.raises(pt.ParameterError, match="design must be its CircularCams, not None"):
        contact_of(axle(CircularCamDifferential.from_design(TABLE_1)), path=AT)


@pytest.mark.parametrize("n", [2, 4])
def test_rollers_of_circular_cams_shake_as_they_climb(n: int) -> None:
    """Two rollers make a couple, four are balanced; one roller's force is its mass times the second difference of its place."""
    masses = RollerMasses(r_out=0.015, r_in=0.012, m_out=0.08, J_out=1e-5, m_in=0.05, J_in=1e-5)
    differential = CircularCamDifferential(n=n, masses=masses, alpha_out=0.2, alpha_in=0.3, mu=0.01)
    result = axle(differential, (20.0, 30.0, -60.0), fast=80.0)
    found = shaking_of(result, path=AT)
    assert np.abs(found["force_x"]).max() < 1e-9
    couple = np.hypot(found["moment_y"], found["moment_z"])
    assert couple.max() < 1e-9 if n == 4 else couple.max() > 0.05
    theta, m, h, u = result[f"{AT}.theta"], 0.08, 1e-4, result[f"{AT}.w_rel"] / 2
    du = np.asarray(result[lambda model: pt.der(model.parts[0].w_rel)]) / 2
    outer = Track(0.085, 0.015, 0.2, n)
    slope = (outer.axis(theta + h) - outer.axis(theta - h)) / 2 / h
    curve = (outer.axis(theta + h) - 2 * outer.axis(theta) + outer.axis(theta - h)) / h**2
    smooth = np.abs(np.abs(outer.arc(theta)[1]) - 1) > 0.01
    bound = m * np.abs(slope * du + curve * u**2)[smooth]
    np.testing.assert_allclose(found["roller"][smooth], bound, rtol=1e-5)  # an outer roller is always the worse one
    assert found.units["roller"] == "N"


@pytest.mark.parametrize("sign", few([1.0, -1.0]))
def test_spherical_cam(sign: float) -> None:
    """Line loads carry what the side wheels get, by the flank that the torque's sign says; pairs shake with J w_cam x w_cage each."""
    result = axle(SphericalCamDifferential(friction=NO_FRICTION), (200.0 * sign, -60.0 * sign, -110.0 * sign))
    found, pressures = reactions_of(result, BODY, path=AT), contact_of(result, BODY, path=AT)
    psi, cam = result[f"{AT}.psi"], BODY.cam
    for name, side in (("left", 1.0), ("right", -1.0)):
        carried, torque = np.zeros_like(psi), -result[f"{AT}.{name}.tau"]
        for which, reach, start in (("inner", BODY.inner, 0.0), ("outer", BODY.outer, cam.half)):
            u = np.mod(sign * side * psi + start, 2 * cam.half)
            distance = 2 / 3 * (reach[1] ** 3 - reach[0] ** 3) / (reach[1] ** 2 - reach[0] ** 2)
            carried = carried + 2 * found[f"{name}_{which}"] * distance * -cam.lever_arms(u - cam.half)[0]
            assert pressures[f"{name}_{which}"].max() > 1e8
            assert ((pressures[f"{name}_{which}"] > 0) == (found[f"{name}_{which}"] > 0)).all()
        np.testing.assert_allclose(carried, sign * torque, rtol=1e-9)
    shaken = shaking_of(result, BODY, path=AT)
    turning = result["parts[1].w"] * result[f"{AT}.w_cam"]
    np.testing.assert_allclose(shaken["pair"], np.abs(BODY.spin_inertia / 2 * turning), rtol=1e-9)
    assert np.abs(shaken["moment_z"]).max() < 1e-15 < np.abs(shaken["pair"]).max()
    with pytest.raises(pt.ParameterError, match="design must be its CamBody"):
        reactions_of(result, path=AT)


def test_spherical_cams_shake_with_the_inertia_of_the_run() -> None:
    """The model's own masses, as parameters of the run, count before those of the design."""
    heavy = CamMasses(J_cam=10 * BODY.spin_inertia)
    result = axle(SphericalCamDifferential(friction=NO_FRICTION, masses=heavy))
    turning = result["parts[1].w"] * result[f"{AT}.w_cam"]
    np.testing.assert_allclose(
        shaking_of(result, BODY, path=AT)["pair"], np.abs(5 * BODY.spin_inertia * turning), rtol=1e-9
    )


def test_bearing_of_a_spherical_cam_under_equal_torques() -> None:
    """In the middle of a stroke both sides' forces are mirror images: the bearing gets what pushes along the cage's turning, twice."""
    differential = SphericalCamDifferential(friction=NO_FRICTION)
    parts = rot.Fixed(), rot.Fixed(), rot.ConstantTorque(tau_constant=200.0)
    result = run(joined(differential, *parts, joints="0.left=1.flange 0.right=2.flange 0.crown=3.flange"), 0.01)
    assert result[f"{AT}.left.tau"][-1] == pytest.approx(-100.0)
    inner, outer, force = BODY.forces(differential.cycle, 0.0, 100.0)
    assert inner == pytest.approx(0, abs=1e-6)
    found = reactions_of(result, BODY, path=AT)
    assert found["left_outer"][-1] == pytest.approx(float(outer))
    assert found["bearing_radial"][-1] == pytest.approx(2 * abs(float(force[1])))
    assert found["bearing_axial"][-1] == pytest.approx(2 * abs(float(force[2])))


def test_linkage() -> None:
    """(7.1) where nothing is heavy; the pin's pressure from its force; a fast cage shakes."""
    nothing = LinkBody(0.0, 0.0, 0.0)
    light = LinkMasses(LinkBody(1.0, 1e-9, 1e-9), nothing, nothing)
    result = axle(LinkageDifferential.of(masses=light))
    found, motion = reactions_of(result, path=AT), Linkage().motion(result[f"{AT}.alpha"])
    across = np.abs(result[f"{AT}.crown.tau"]) / 2 / (0.03 * np.cos(motion.beta))
    assert (found["S_left"] >= across * (1 - 1e-6)).all()
    assert found["S_left"].min() == pytest.approx(across.min(), rel=0.05)
    sizes = JointFriction()
    pressures = contact_of(result, path=AT)
    np.testing.assert_allclose(pressures["pin_left"], found["R_left"] / (2 * sizes.r_pin * sizes.l_pin))
    np.testing.assert_allclose(pressures["ball_right"], found["S_right"] / (math.pi * sizes.r_ball**2))
    np.testing.assert_allclose(pressures["rod"], found["C_force"] / (2 * sizes.r_rod * sizes.l_rod))
    assert np.abs(shaking_of(result, path=AT)["force_y"]).max() < 1e-9
    heavy = shaking_of(axle(LinkageDifferential.of(masses=CORRECTED)), path=AT)
    assert np.abs(heavy["force_y"]).max() > 1.0
    still = axle(LinkageDifferential.of(masses=CORRECTED, alpha_0=0.5), (0.0, 0.0, 0.0), fast=10.0)
    alone = shaking_of(still, path=AT)  # cage and shafts turn as one: centrifugal force along the C axis alone
    assert np.abs(alone["force_y"]).min() > max(1.0, 1e3 * np.abs(alone["force_z"]).max())
    assert "force_z" in str(heavy)
    assert len(heavy) == 4


def test_what_is_no_gearless_differential_is_refused() -> None:
    result = axle(LinkageDifferential.of())
    with pytest.raises(pt.ParameterError, match="is a Inertia, not a gearless differential"):
        reactions_of(result, path="parts[1]")
    with pytest.raises(pt.ParameterError, match="path = 'differential' is not a component"):
        contact_of(result)
