"""What the parts of gearless differentials carry in a car that starts, drives round a bend and brakes: 20 s with driver and gearbox."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.gearless import contact_of, reactions_of, shaking_of
from powertrain.components.gearless.circular_cam import TABLE_1, CircularCamDifferential
from powertrain.components.gearless.linkage import CORRECTED, JointFriction, Linkage, LinkageDifferential
from powertrain.components.gearless.spherical_cam import CamBody, SphericalCam, SphericalCamDifferential
from powertrain.vehicles.rear_drive import RearDriveCar

pytestmark = pytest.mark.slow
AT = "rear.differential"
BEND = ((0.0, 0.0), (1.0, 0.0), (11.0, 10.0), (14.0, 10.0), (19.0, 0.0), (20.0, 0.0))
"""Time [s] and speed [m/s]."""
BODY = CamBody(SphericalCam(4, 5), inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
HELD = dataclasses.replace(CORRECTED, coupler_centre=0.0)
"""Couplers that turn about their own centres: the lever alone shakes."""


def driven(differential: Any) -> Any:
    """From rest to 36 km/h in a bend of 20 m to the left, and back."""
    speeds = CycleSpeed(cycle=DriveCycle("bend", BEND))
    car = pt.replace(RearDriveCar(cycle=speeds), {AT: differential})
    result = pt.simulate(car, 20.0, inputs={"curvature": 0.05}, rtol=1e-7, atol=1e-8)
    assert pt.energy_audit(result).closure < 1e-6
    assert result["body.v"].max() > 9.5
    return result


def check(found: Any, result: Any) -> None:
    """Series on the run's times, finite, with a unit each."""
    np.testing.assert_array_equal(found.time, result.time)
    assert set(found.units) == set(found)
    assert all(np.isfinite(values).all() and values.shape == result.time.shape for values in found.values())


def test_circular_cams_in_a_car() -> None:
    """Rollers push both cams round with half of the crown wheel's torque each; disks hold what the simulation says where they slide."""
    result = driven(CircularCamDifferential.from_design(TABLE_1, masses=True))
    found, crown = reactions_of(result, path=AT), result[f"{AT}.crown.tau"]
    for each in (found, contact_of(result, path=AT), shaking_of(result, path=AT)):
        check(each, result)
    outer, inner = (
        found[f"F_n_{s}"] * np.sin(found[f"alpha_{s}"]) for s in ("out", "in")
    )  # along the track, per roller
    pushed = 2 * (outer * TABLE_1.outer.D + inner * TABLE_1.inner.D) / 2
    np.testing.assert_allclose(pushed, np.abs(crown) / 2, rtol=1e-9, atol=1e-6)
    slides = np.abs(result[f"{AT}.w_rel"]) > 0.1
    assert slides.mean() > 0.5
    np.testing.assert_allclose(found["M_friction"][slides], np.abs(result[f"{AT}.tau"][slides]), rtol=1e-6, atol=1e-6)
    pressure, force = contact_of(result, path=AT)["outer_concave"], found["F_n_out"]
    assert pressure.max() > 1e9
    pressed = force > 1.0  # Hertz: pressure cubed grows with the force, on arcs of one radius
    np.testing.assert_allclose(pressure[pressed] ** 3 / force[pressed], pressure.max() ** 3 / force.max(), rtol=1e-9)
    masses: Any = result.model.rear.differential.masses
    assert float(masses.m_out) > 0
    assert shaking_of(result, path=AT)["roller"].max() > 0


def test_spherical_cam_in_a_car() -> None:
    """Line loads on the flanks carry what each side shaft gets, in traction and overrun, ahead and in the bend."""
    result = driven(SphericalCamDifferential())
    found, cam = reactions_of(result, BODY, path=AT), BODY.cam
    for each in (found, contact_of(result, BODY, path=AT), shaking_of(result, BODY, path=AT)):
        check(each, result)
    for name, side in (("left", 1.0), ("right", -1.0)):
        torque, carried = -result[f"{AT}.{name}.tau"], np.zeros_like(result.time)
        assert torque.max() > 100 > -50 > torque.min()
        s = np.where(torque >= 0, side, -side) * result[f"{AT}.psi"]
        for which, reach, start in (("inner", BODY.inner, 0.0), ("outer", BODY.outer, cam.half)):
            u = np.mod(s + start, 2 * cam.half)
            distance = 2 / 3 * (reach[1] ** 3 - reach[0] ** 3) / (reach[1] ** 2 - reach[0] ** 2)
            carried = carried + 2 * found[f"{name}_{which}"] * distance * -cam.lever_arms(u - cam.half)[0]
        np.testing.assert_allclose(carried, np.abs(torque), rtol=1e-6, atol=1e-6)


def test_linkage_in_a_car() -> None:
    """The lever shakes the housing with its mass times the acceleration of its centre, S along the cage's radius (differences of S)."""
    linkage = Linkage(0.03, 0.06)
    joints = JointFriction(mu_shaft=0.1, mu_pin=0.1, mu_ball=0.1, mu_rod=0.1)
    result = driven(LinkageDifferential.of(linkage, HELD, joints))
    found = shaking_of(result, path=AT)
    for each in (found, reactions_of(result, path=AT), contact_of(result, path=AT)):
        check(each, result)
    alpha, u, w, h = result[f"{AT}.alpha"], result[f"{AT}.w_diff"], result[f"{AT}.w"], 1e-4
    du, dw = (np.asarray(result[lambda m, n=n: pt.der(getattr(m.rear.differential, n))]) for n in ("w_diff", "w"))
    S, ahead, behind = (linkage.motion(alpha + d).S for d in (0.0, h, -h))
    slope, curve = (ahead - behind) / 2 / h, (ahead - 2 * S + behind) / h**2
    radial = slope * du + curve * u**2 - w**2 * S
    across = 2 * w * slope * u + dw * S
    m = float(HELD.lever.m)
    scale = np.abs(found["force_y"]).max()
    assert scale > 1.0
    np.testing.assert_allclose(found["force_y"], -m * radial, rtol=1e-5, atol=1e-6 * scale)
    np.testing.assert_allclose(found["force_z"], -m * across, rtol=1e-5, atol=1e-6 * scale)
