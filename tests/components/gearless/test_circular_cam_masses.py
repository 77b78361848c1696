"""The inertia of the rollers of a circular cam differential: kinetic energy of bodies that roll on the drawn tracks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.gearless.circular_cam import TABLE_1, CircularCamDifferential, RollerMasses, with_friction

MASSES = RollerMasses.of(TABLE_1)
JOINTS = "0.left=1.flange_a 0.right=2.flange_a 0.crown=3.flange"


def coasting(masses: RollerMasses | None, speed: float = 60.0) -> Any:
    """Equal sides that turn against each other and a cage that is held: nothing drives, nothing rubs."""
    differential = pt.replace(CircularCamDifferential.from_design(with_friction(TABLE_1, 0.0)), masses=masses)
    parts = [rot.Inertia(J=1e-4), rot.Inertia(J=1e-4), rot.Fixed()]
    return run(joined(differential, *parts, joints=JOINTS), 0.2, {"0.w_rel": 2 * speed}, rtol=1e-9, atol=1e-9)


def kinetic(theta: Any, speed: Any) -> Any:
    """Of all rollers, from differences of where they are and how far they have turned."""
    total, h = 0.0, 1e-6
    bodies = (
        (TABLE_1.outer, MASSES._values["m_out"], MASSES._values["J_out"]),
        (
            TABLE_1.inner,
            MASSES._values["m_in"],
            MASSES._values["J_in"],
        ),
    )
    for track, m, J in bodies:
        for roller in range(track.n):
            climb = (track.axis(theta + h, roller) - track.axis(theta - h, roller)) / (2 * h)
            turn = (track.turned(theta + h) - track.turned(theta - h)) / (2 * h)
            total = total + (m * climb**2 + J * turn**2) * speed**2 / 2
    return total


def test_energy_of_the_rollers_is_that_of_bodies_on_their_tracks() -> None:
    result = coasting(MASSES)
    theta, speed = result["parts[0].theta"], result["parts[0].w_rel"] / 2
    sides = 1e-4 / 2 * (result["parts[1].w"] ** 2 + result["parts[2].w"] ** 2)
    total = sides + kinetic(theta, speed)
    assert total.max() / total.min() - 1 < 1e-6
    assert sides.max() / sides.min() > 1.01  # the rollers take and give
    assert pt.energy_audit(result).closure < 1e-6
    free = coasting(None)
    np.testing.assert_allclose(free["parts[0].w_rel"], 120.0)


def test_masses_of_slices() -> None:
    """By rings of a sphere's slice."""
    r, b = TABLE_1.outer.r, 0.0175
    x = b * ((np.arange(20000) + 0.5) / 20000 - 0.5)
    area = math.pi * (r**2 - x**2)
    assert MASSES._values["m_out"] == pytest.approx(7850 * area.mean() * b, rel=1e-6)
    assert MASSES._values["J_out"] == pytest.approx(7850 * (area * (r**2 - x**2) / 2).mean() * b, rel=1e-6)


def test_masses_are_numbers_of_the_model() -> None:
    differential = CircularCamDifferential.from_design(TABLE_1, masses=True)
    model = joined(differential, rot.Inertia(J=0.1), rot.Inertia(J=0.1), rot.Fixed(), joints=JOINTS)
    plant = pt.compile(model)
    assert "parts[0].masses.m_in" in plant.parameters
    with pytest.raises(pt.ParameterError, match="m_in = 0"):
        RollerMasses(r_out=1, r_in=1, m_out=1, J_out=1, m_in=0, J_in=1)
