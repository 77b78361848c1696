"""The library's examples that have no reference trajectory: energy, symmetry and what the text books say."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import rotational_examples as examples
from reference import sequence
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import powertrain as pt


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "stop"),
    [
        (examples.First, 1.0),
        (examples.Friction, 3.0),
        (examples.CoupledClutches, 1.5),
        (examples.LossyGearDemo1, 0.5),
        (examples.LossyGearDemo2, 0.5),
        (examples.LossyGearDemo3, 1.0),
        (examples.EddyCurrentBrake, 1.0),
        (examples.OneWayClutch, 2.0),
        (examples.RollingWheel, 5.0),
        (examples.GenerationOfFMUs, 1.0),
        (examples.OneWayClutchDisengaged, 2.0),
        (examples.SimpleGearShift, 5.0),
        (examples.ElasticBearing, 10.0),
        (examples.Backlash, 1.0),
        (examples.HeatLosses, 1.0),
        (examples.CompareBrakingTorque, 1.0),
    ],
)
def test_energy_is_conserved(model: Callable[[], pt.Component], stop: float) -> None:
    audit = pt.energy_audit(pt.simulate(model(), stop))
    assert not audit.hidden
    assert audit.closure < 1e-5
    finer = pt.energy_audit(pt.simulate(model(), stop, rtol=1e-9))
    assert finer.closure < 2e-8


def test_clutch_locks_and_brake_stops() -> None:
    result = pt.simulate(examples.Friction(), 3.0, rtol=1e-8)
    assert result["clutch.mode"][0] == -1
    assert result["clutch.mode"][-1] == 0
    assert set(result["brake.mode"][result.time < 0.5 - 1e-9]) == {2}
    assert result["brake.mode"][-1] == 0
    np.testing.assert_allclose(result["inertia1.w"][-1], 0.0, atol=1e-10)
    assert np.abs(result["inertia3.w"][-1]) < 0.3 * 90
    slides = np.abs(result["clutch.w_rel"]) > 1e-6
    np.testing.assert_allclose(np.abs(result["clutch.tau"][slides]), 80.0, rtol=1e-9)
    assert np.abs(result["clutch.tau"]).max() < 80 + 1e-6


def test_gear_beside_a_bearing_sticks_and_slides_with_it() -> None:
    """Both lock the same motion: they hold while any distribution of the torque holds, and break loose together."""
    result = pt.simulate(examples.LossyGearDemo2(), 0.5, rtol=1e-9)
    gear = sequence(result.time, result["gear.mode"])
    assert [mode for _, mode in gear] == [-1, 0, 1, 0, -1]
    times = [t for t, _ in gear]
    moves = np.abs(result["Inertia2.w"]) > 1e-12
    np.testing.assert_array_equal(
        moves, (result["gear.mode"] != 0) & (result["bearingFriction.mode"] == result["gear.mode"]) & moves
    )
    for low, high in ((times[1], times[2]), (times[3], times[4])):
        assert not moves[(result.time > low) & (result.time < high)].any()
    # Forward: the drive less 0.5 N.m overcomes the load/0.5; backward: half the load overcomes the drive and 0.5 N.m.
    forward = brentq(lambda t: 10 * math.sin(2 * math.pi * t) - 0.5 - (10 - 2.5 * t), 0.2, 0.25)
    backward = brentq(lambda t: 4 * (10 * math.sin(2 * math.pi * t) + 0.5) - (10 - 2.5 * t), 0.4, 0.5)
    assert [times[2], times[4]] == pytest.approx([forward, backward], abs=3e-7)  # shared torques are known to 1e-7

    # First slide back, at w = Inertia2.w < 0: the load drives, the bearing takes 0.5 - w at the gear's double speed.
    def slide(t: float, w: Any) -> Any:
        return [(-10 + 2.5 * t + 4 * (10 * math.sin(2 * math.pi * t) + 0.5 - w[0])) / (1.5 + 8)]

    def rest(t: float, w: Any) -> Any:
        return w[0]

    rest.terminal, rest.direction = True, 1  # type: ignore[attr-defined]
    stop = solve_ivp(slide, (0, 0.2), [0.0], events=rest, rtol=1e-10, atol=1e-12, first_step=1e-4)
    assert stop.t_events is not None
    assert times[1] == pytest.approx(float(stop.t_events[0][0]), abs=1e-7)


def test_gear_pushes_its_elastic_bearing() -> None:
    result = pt.simulate(examples.ElasticBearing(), 10.0, points=2000)
    last = result.time > 9.5
    # Once the torque is constant, the housing rests and the shafts gain speed together.
    a = 100 / (1 + 50 / 9)
    np.testing.assert_allclose(np.polyfit(result.time[last], result["shaft.w"][last], 1)[0], a, rtol=2e-2)
    assert result["springDamper.tau"][last].mean() == pytest.approx((1 - 3) * (100 - a), rel=2e-2)
    np.testing.assert_allclose(
        result["multiSensor.power"], result["multiSensor.tau"] * result["multiSensor.w"], atol=1e-12
    )


def test_backlash_slows_the_swing_and_the_jumping_damper_takes_more() -> None:
    result = pt.simulate(examples.Backlash(), 1.0, points=2000, rtol=1e-8)
    crossings = [np.flatnonzero(np.diff(np.sign(result[f"inertia{k}.phi"]))).size for k in (1, 2, 3)]
    assert crossings[0] > crossings[1] >= crossings[2] > 2
    peaks = [np.abs(result[f"inertia{k}.phi"][result.time > 0.8]).max() for k in (2, 3)]
    assert math.pi / 8 < peaks[1] < peaks[0] < math.pi / 2
    for name in ("elastoBacklash", "elastoBacklash2"):
        assert (result[f"{name}.tau"] * result[f"{name}.tau_c"]).min() >= 0


def test_losses_of_a_whole_driveline_leave_through_one_convection() -> None:
    result = pt.simulate(examples.HeatLosses(), 1.0, rtol=1e-8)
    lossy = [
        "damper",
        "springDamper",
        "elastoBacklash",
        "bearingFriction",
        "lossyGear",
        "clutch",
        "oneWayClutch",
        "brake",
    ]
    total = sum(result[f"{name}.lossPower"] for name in lossy)
    np.testing.assert_allclose(result["convection.Q_flow"], total, atol=1e-9 * np.abs(total).max())
    np.testing.assert_allclose(result["convection.solid.T"], 298.15 + total / 20, rtol=1e-9)
    for name in lossy:
        assert result[f"{name}.lossPower"].min() > -1e-6
    assert (result["oneWayClutch.w_rel"] > -1e-9).all()
    for name in ("bearingFriction", "lossyGear"):
        assert {-1, 0, 1} <= set(result[f"{name}.mode"])


def test_disengaged_one_way_clutch_is_a_freewheel() -> None:
    result = pt.simulate(examples.OneWayClutchDisengaged(), 2.0, rtol=1e-8)
    free = result["oneWayClutch.mode"] == 1
    assert np.abs(result["oneWayClutch.tau"][free]).max() < 1e-9
    assert result["oneWayClutch.tau"].max() < 2e-9
    assert result["oneWayClutch.w_rel"].min() > -1e-9
    np.testing.assert_allclose(result["oneWayClutch.lossPower"], 0.0, atol=1e-9)


def test_four_braking_torques() -> None:
    result = pt.simulate(examples.CompareBrakingTorque(), 5.0, rtol=1e-9, atol=1e-9)
    t = result.time
    constant = t < 0.99
    np.testing.assert_allclose(result["inertia1.w"][constant], 100 * (1 - t[constant]), rtol=1e-6)
    np.testing.assert_allclose(result["inertia2.w"], 100 * np.exp(-t), rtol=1e-6)
    np.testing.assert_allclose(result["inertia3.w"], 100 / (1 + t), rtol=1e-6)
    inverse = t < 0.4999
    np.testing.assert_allclose(result["inertia4.w"][inverse], 100 * np.sqrt(1 - 2 * t[inverse]), rtol=1e-6)
