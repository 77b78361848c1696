"""Planetary gear sets: closed forms, sets made of single meshes against the mesh law of the whole, four-shaft Ravigneaux sets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import Joined, joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine
from powertrain.components.differentials import (
    ChurningLoss,
    DoublePinionPlanetaryGear,
    PlanetaryGear,
    PlanetTrain,
    RavigneauxGear,
    SteppedPlanetaryGear,
)

TIMES = np.linspace(0, 5, 101)


def swinging(part: pt.Component, members: str = "sun ring carrier", *extra: pt.Component, joints: str = "") -> Joined:
    """Shafts with inertia; a swinging torque on the first, a constant one on the second. Extra parts are number 7 on."""
    sun, ring, carrier = members.split()
    inertias = rot.Inertia(J=1), rot.Inertia(J=2), rot.Inertia(J=3)
    torques = rot.Torque(), Sine(f=0.3, amplitude=10), rot.ConstantTorque(tau_constant=5.0)
    wired = f"0.{sun}=1.flange_a 0.{ring}=2.flange_a 0.{carrier}=3.flange_a 4.flange=1.flange_b 5.y=4.tau 6.flange=2.flange_b"
    return joined(part, *inertias, *torques, *extra, joints=f"{wired} {joints}")


def speeds(model: Joined) -> Any:
    result = run(model, 5.0, times=TIMES)
    assert pt.energy_audit(result).closure < 1e-7
    return np.array([result.at(TIMES, f"parts[{i}].w") for i in (1, 2, 3)])


@pytest.mark.parametrize(
    ("gear", "R_o"),
    [
        (PlanetaryGear(ratio=1.7), -1.7),
        (SteppedPlanetaryGear(ratio=25 / 3), -25 / 3),
        (DoublePinionPlanetaryGear(ratio=2.4), 2.4),
        (PlanetTrain(sun_ratio=31 / 90, ring_ratio=153 / 31), -1.7),
    ],
    ids=lambda value: type(value).__name__,
)
def test_kinematics_and_ideal_limit(gear: pt.Component, R_o: float) -> None:
    sun, ring, carrier = found = speeds(swinging(gear))
    np.testing.assert_allclose(sun - carrier, R_o * (ring - carrier), atol=1e-9)
    ideal = speeds(swinging(rot.IdealPlanetary(ratio=-R_o)))
    assert np.abs(found - ideal).max() < 1e-8 * np.abs(ideal).max()


@pytest.mark.parametrize("gear", [PlanetaryGear, SteppedPlanetaryGear])
def test_two_meshes_around_a_planet_are_the_mesh_law_with_the_product(gear: Any) -> None:
    """Planets without inertia: eta = eta_sun eta_ring, R_o = -sun_ratio ring_ratio, stuck phases included."""
    train = speeds(swinging(PlanetTrain(sun_ratio=0.5, ring_ratio=4, eta_sun=0.9, eta_ring=0.85)))
    whole = speeds(swinging(gear(ratio=2.0, eta_ab=0.9 * 0.85, eta_ba=0.9 * 0.85)))
    assert np.abs(train - whole).max() < 1e-6 * np.abs(whole).max()


def test_planets_take_kinetic_energy() -> None:
    """Lagrange with the sun's and the ring's angle: w_planet = w_h + ring_ratio (w_ring - w_h)."""
    model = swinging(PlanetTrain(sun_ratio=0.5, ring_ratio=4, J=0.8))
    result = run(model, 1.0)
    k = np.array([1, 2]) / 3
    planet = np.array([0, 4]) - 3 * k
    mass = np.diag([1.0, 2.0]) + 3 * np.outer(k, k) + 0.8 * np.outer(planet, planet)
    at_start = np.linalg.solve(mass, [0, 5])
    np.testing.assert_allclose([result[f"parts[{i}].a"][0] for i in (1, 2)], at_start, rtol=1e-9)
    np.testing.assert_allclose(
        result["parts[0].planet.w"], planet @ [result["parts[1].w"], result["parts[2].w"]], atol=1e-8
    )


def test_inertia_of_planets_from_teeth_is_that_of_all() -> None:
    """As the parameter J: however many planets there are, with the carrier held the energy is J w_planet^2/2."""
    for n in (1, 3):
        gear = PlanetTrain.from_teeth(90, 153, 31, n=n, J=0.8)
        parts = gear, rot.ConstantSpeed(w_fixed=10), rot.Fixed()
        result = run(joined(*parts, joints="0.ring=1.flange 0.carrier=2.flange"), 0.01)
        planet = result["parts[0].planet.w"][-1]
        assert planet == pytest.approx(10 * 153 / 31)
        assert result[lambda m: m.parts[0].planet.energy()][-1] == pytest.approx(0.8 * planet**2 / 2)


@pytest.mark.parametrize(
    ("driving", "held", "driven", "backward", "efficiency"),
    [
        ("sun", "ring", "carrier", True, np.nan),
        ("ring", "sun", "carrier", False, np.nan),
        ("carrier", "ring", "sun", True, 0.95 * (1.02 - 1) / (1.02 - 0.95)),
        ("carrier", "sun", "ring", False, (1.02 - 1) / (1.02 - 0.95)),
        ("sun", "carrier", "ring", False, 0.95),
        ("ring", "carrier", "sun", False, 0.95),
    ],
)
def test_self_locking_pairs_of_planets(driving: str, held: str, driven: str, backward: bool, efficiency: float) -> None:
    """0.95 < R_o = 1.02 < 1/0.95: nothing drives the carrier; it drives the ring with (R_o - 1)/(R_o - eta), the sun with eta of that."""
    gear = DoublePinionPlanetaryGear(ratio=1.02, eta_ab=0.95, eta_ba=0.95)
    load = rot.ConstantTorque(tau_constant=20 if backward else -20)
    joints = f"0.{driving}=1.flange 0.{held}=2.flange 0.{driven}=3.flange"
    parts = joined(gear, rot.ConstantSpeed(w_fixed=10), rot.Fixed(), load, joints=joints)
    found = pt.steady(parts, {}, outputs=[f"parts[0].{driving}.tau", "parts[0].mesh.lossPower"])
    into = 10 * float(found[f"parts[0].{driving}.tau"])
    assert 1 - float(found["parts[0].mesh.lossPower"]) / into == pytest.approx(efficiency, rel=1e-9, nan_ok=True)


RAVIGNEAUX = {"large": 38, "small": 30, "ring": 86, "long": 24, "short": 20}


@pytest.mark.parametrize(
    ("driven", "held", "ratio"),
    [
        ("sun_small", "sun_large", (86 / 30 + 86 / 38) / (1 + 86 / 38)),
        ("sun_small", "carrier", 86 / 30),
        ("sun_large", "carrier", -86 / 38),
        ("sun_large", "sun_small", (86 / 38 + 86 / 30) / (86 / 30 - 1)),
    ],
)
def test_ravigneaux_speed_ratios(driven: str, held: str, ratio: float) -> None:
    """To the ring, by Willis: w_large - w_h = -(86/38) (w_ring - w_h), w_small - w_h = (86/30) (w_ring - w_h)."""
    gear = RavigneauxGear.from_teeth(**RAVIGNEAUX, n=2)
    parts = gear, rot.ConstantSpeed(w_fixed=10), rot.Fixed(), rot.Inertia(J=1)
    result = run(joined(*parts, joints=f"0.{driven}=1.flange 0.{held}=2.flange 0.ring=3.flange_a"), 0.1)
    assert 10 / result["parts[3].w"][-1] == pytest.approx(ratio, rel=1e-9)


def test_ravigneaux_loses_in_every_mesh_that_carries_power() -> None:
    """Small sun to ring with the carrier held: three meshes; large sun to ring: two."""
    gear = RavigneauxGear.from_teeth(**RAVIGNEAUX, n=2, eta=0.98)
    for sun, meshes in (("sun_small", 3), ("sun_large", 2)):
        parts = gear, rot.ConstantSpeed(w_fixed=10), rot.Fixed()
        load = rot.ConstantTorque(tau_constant=-20 if sun == "sun_small" else 20)
        result = run(joined(*parts, load, joints=f"0.{sun}=1.flange 0.carrier=2.flange 0.ring=3.flange"), 0.01)
        into = result[f"parts[0].{sun}.tau"][-1] * 10
        out = result["parts[0].ring.tau"][-1] * result["parts[0].at_ring.w_rel"][-1] * 24 / 86
        assert -out / into == pytest.approx(0.98**meshes, rel=1e-9)


def test_ravigneaux_with_both_suns_loaded() -> None:
    """Large sun held, small sun driving: T_b on the large, by the balance of the long planets eta^2/30 = (T_b/38 + (1 + T_b)/86)/eta."""
    eta = 0.98
    gear = RavigneauxGear.from_teeth(**RAVIGNEAUX, n=2, eta=eta)
    parts = gear, rot.ConstantSpeed(w_fixed=10), rot.Fixed(), rot.ConstantTorque(tau_constant=-20)
    result = run(joined(*parts, joints="0.sun_small=1.flange 0.sun_large=2.flange 0.ring=3.flange"), 0.01)
    held = (eta**3 / 30 - 1 / 86) / (1 / 38 + 1 / 86)
    assert 20 / result["parts[0].sun_small.tau"][-1] == pytest.approx(1 + held, rel=1e-9)


@pytest.mark.slow
def test_ravigneaux_with_four_free_shafts() -> None:
    gear = RavigneauxGear.from_teeth(**RAVIGNEAUX, n=2, eta=0.98)
    model = swinging(gear, "sun_large ring carrier", rot.Inertia(J=1.0), joints="0.sun_small=7.flange_a")
    result = run(model, 5.0)
    assert pt.energy_audit(result).closure < 1e-8
    large, ring, carrier, small = (result[f"parts[{i}].w"] for i in (1, 2, 3, 7))
    np.testing.assert_allclose(large - carrier, -86 / 38 * (ring - carrier), atol=1e-8)
    np.testing.assert_allclose(small - carrier, 86 / 30 * (ring - carrier), atol=1e-8)
    assert result["parts[0].at_ring.lossPower"].min() > -1e-7


def test_churning_and_bearing_are_parts_of_their_own() -> None:
    """A planetary gear whose ring stirs the oil and whose carrier has a bearing: losses add up, energy closes."""
    extra = ChurningLoss(d=0.05, d2=0.01, d3=1e-3), rot.BearingFriction(tau_pos=((0, 0.3),))
    gear = PlanetaryGear(ratio=1.7, eta_ab=0.97, eta_ba=0.97)
    model = swinging(gear, "sun ring carrier", *extra, joints="7.flange=2.flange_b 8.flange_a=3.flange_b")
    result = run(model, 5.0)
    assert pt.energy_audit(result).closure < 1e-7
    w = result["parts[2].w"]
    np.testing.assert_allclose(result["parts[7].flange.tau"], 0.05 * w + 0.01 * w * np.abs(w) + 1e-3 * w**3, atol=1e-12)
    for part in ("parts[0].mesh", "parts[7]", "parts[8]"):
        assert result[f"{part}.lossPower"].max() > 1e-3
        assert result[f"{part}.lossPower"].min() > -1e-8
