"""The library's examples that have no reference trajectory: energy, symmetry and what they are meant to show."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import translational_examples as examples

import powertrain as pt
from powertrain.analysis.audit import energy_audit

STOPS = {
    "CompareBrakingForce": 2,
    "CoupledByAdaptors": 1,
    "Damper": 1,
    "EddyCurrentBrake": 1,
    "ElastoGap": 5,
    "Friction": 5,
    "HeatLosses": 2,
    "InitialConditions": 5,
    "Oscillator": 1,
    "PreLoad": 100,
    "Sensors": 1,
    "Vehicle": 60,
    "WhyArrows": 1,
}


def tight(model: pt.Component, stop: float, **options: Any) -> pt.Result[pt.Component]:
    return pt.simulate(model, stop, **{"rtol": 1e-9, **options})


def drop(values: Any) -> float:
    return float(values[0] - values[-1])


def work(result: pt.Result[pt.Component], power: Any) -> float:
    return float(np.trapezoid(power, result.time))


@pytest.mark.parametrize("name", STOPS)
def test_energy_closes(name: str) -> None:
    audit = energy_audit(pt.simulate(getattr(examples, name)(), STOPS[name], rtol=1e-8))
    assert audit.closure < 1e-6
    assert not audit.hidden


def test_stribeck_friction_by_formula_and_by_table_agree() -> None:
    """stop1 has the formula, mass the same as a table of 50 rows and no 1.001 before it breaks loose."""
    result = tight(examples.Friction(), 5.0)
    span = np.ptp(result["mass.s"])
    np.testing.assert_allclose(result["stop1.s"], result["mass.s"], atol=0.01 * span)
    sliding = result["stop1.mode"] == 1
    v = result["stop1.v"][sliding]
    np.testing.assert_allclose(result["stop1.f"][sliding], v + 5 + 10 * np.exp(-2 * np.abs(v)), rtol=1e-9)


def test_a_mass_flies_against_its_stop() -> None:
    result = tight(examples.Friction(), 5.0, points=20_000)
    hit = next(e for e in result.events if e.name == "stop2.mode")
    assert result["stop2.s"].min() == pytest.approx(-0.4, abs=2e-9)
    before = result.time < hit.time
    energy = result["stop2.v"] ** 2 / 2 + 250 * (result["spring.s_rel"] - 1) ** 2
    lost = np.where(before, result["stop2.lossPower"], 0.0)
    assert drop(energy[before]) == pytest.approx(work(result, lost), rel=5e-3)
    assert result["stop2.mode"][-1] == 0


def test_a_preloaded_spool_stays_in_place_below_the_preload() -> None:
    """The spring is compressed by about 20 N/mm * 3.25 mm; below that force the spool hardly moves, above it the spring gives."""
    result = tight(examples.PreLoad(), 100.0, points=2000, rtol=1e-7)
    t, s = result.time, result["spool.s"]
    force = 150 * np.sin(2 * np.pi * 0.01 * t)
    settled = t > 2
    rest, out = settled & (np.abs(force) < 20), settled & (np.abs(force) > 120)
    centre = np.median(s[rest])
    assert np.abs(s[rest] - centre).max() < 2.5e-4
    slope = np.polyfit(force[out & (force > 0)], s[out & (force > 0)], 1)[0]
    assert 1 / slope == pytest.approx(20e3, rel=0.1)
    assert (s[out & (force > 0)] > centre).all()
    assert (s[out & (force < 0)] < centre).all()


def test_heat_losses_all_reach_the_surroundings() -> None:
    result = tight(examples.HeatLosses(), 2.0, points=4000)
    parts = [
        "springDamper",
        "damper",
        "elastoGap",
        "supportFriction",
        "brake",
        "springDamper1",
        "massWithStopAndFriction",
    ]
    losses = sum(result[f"{part}.lossPower"] for part in parts)
    assert isinstance(losses, np.ndarray)
    np.testing.assert_allclose(result["convection.Q_flow"], losses, atol=1e-9)
    np.testing.assert_allclose(result["TAmbient.port.Q_flow"], losses, atol=1e-9)
    np.testing.assert_allclose(result["convection.solid.T"] - 298.15, losses / 20, atol=1e-9)
    for part in parts:
        assert result[f"{part}.lossPower"].min() > -1e-6, part


def test_heat_losses_close_the_energy_balance() -> None:
    """Sampled finely: the blow at the stop dies out within a millisecond."""
    result = tight(examples.HeatLosses(), 2.0, points=100_000)
    stored = sum(result[f"{m}.v"] ** 2 / 2 for m in ("mass1", "mass2", "mass3", "massWithStopAndFriction"))
    stored = stored + 50 * (result["springDamper.s_rel"] ** 2 + result["spring.s_rel"] ** 2)
    stored = stored + 5000 * result["springDamper1.s_rel"] ** 2
    stored = stored + 50 * np.maximum(-0.02 - result["elastoGap.s_rel"], 0) ** 2
    driven = result["force.f"] * result["mass1.v"]
    impacts = float((stored[:-1] - stored[1:])[np.diff(result.time) == 0].sum())
    assert 1 in result["massWithStopAndFriction.stop_max"]
    assert impacts > 0
    balance = work(result, driven - result["convection.Q_flow"]) + drop(stored) - impacts
    assert balance == pytest.approx(0, abs=1e-5 * work(result, np.abs(driven)))


def test_eddy_current_brake_turns_all_energy_into_heat() -> None:
    result = tight(examples.EddyCurrentBrake(), 1.0)
    kinetic = result["mass.v"] ** 2 / 2
    heat = result["heatCapacitor.T"] - 293.15
    np.testing.assert_allclose(kinetic + heat, 200.0, rtol=1e-8)
    x = result["mass.v"] / (10 * (1 + examples.COPPER * heat))
    np.testing.assert_allclose(result["mass.a"], -200 * x / (1 + x**2), rtol=1e-9)


def test_one_chain_starts_at_rest_and_the_other_swings() -> None:
    result = tight(examples.InitialConditions(), 5.0)
    for mass, s in (("m3", 4.5), ("m4", 12.5)):
        np.testing.assert_allclose(result[f"{mass}.s"], s, atol=1e-9)
    assert (result["m1.s"][0], result["m2.s"][0]) == pytest.approx((0.0, 2.5))
    energy = (result["m1.v"] ** 2 + result["m2.v"] ** 2) / 2
    energy = energy + 500 * (result["s1.s_rel"] - 1) ** 2 + 55.5 * (result["sd1.s_rel"] - 1) ** 2
    assert energy[0] == pytest.approx(125.0)
    assert drop(energy) == pytest.approx(work(result, result["sd1.lossPower"]), rel=2e-2)


def test_four_braking_forces_in_closed_form() -> None:
    """Below v0 = 1 m/s the first and the last force are proportional to speed; the last one jumps there to a hundredth."""
    result = tight(examples.CompareBrakingForce(), 2.0)
    t = result.time
    slow1, slow4 = 0.99, (1e4 - 1) / 2e4
    expected = {
        1: np.where(t < slow1, 100 - 100 * t, np.exp(-100 * np.maximum(t - slow1, 0))),
        2: 100 * np.exp(-t),
        3: 100 / (1 + t),
        4: np.where(t < slow4, np.sqrt(np.maximum(1e4 - 2e4 * t, 0)), np.exp(-100 * np.maximum(t - slow4, 0))),
    }
    for k, v in expected.items():
        np.testing.assert_allclose(result[f"mass{k}.v"], v, atol=2e-6, err_msg=str(k))


def test_signals_between_masses_are_as_good_as_flanges() -> None:
    result = tight(examples.CoupledByAdaptors(), 1.0)
    for one, two in (("mass1a", "mass2a"), ("mass1b", "mass2b")):
        np.testing.assert_allclose(result[f"{two}.s"], result[f"{one}.s"], atol=1e-8)
        np.testing.assert_allclose(result[f"{two}.a"], result[f"{one}.a"], atol=1e-4)
    w, total = 4 * math.pi, 3.3
    momentum = 1.1 * result["mass1a.v"] + 2.2 * result["mass1b.v"]
    np.testing.assert_allclose(momentum, 10 / w * (1 - np.cos(w * result.time)), atol=1e-8 * total)


def test_arrows_show_what_a_sensor_reads() -> None:
    result = tight(examples.WhyArrows(), 1.0)
    readings = [result[f"positionSensor{k}.s"][-1] for k in (1, 2, 3)]
    assert readings == [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(result["mass1.s"], result["inertia2.s"], atol=1e-12)
    np.testing.assert_allclose(result["mass1.s"], -0.9 * (1 - np.cos(math.sqrt(11) * result.time)), atol=1e-7)
