"""The flywheel hybrid: what its ratio accelerates and recovers, against the same car that brakes by friction alone."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import DrivenAxle
from powertrain.components.control import FlywheelCharge, FlywheelDrive
from powertrain.components.cycles import DriveCycle
from powertrain.components.rotational import IdealGear
from powertrain.components.wheels import MagicFormulaWheel
from powertrain.trials import CycleRun, charge_corrected, drive_cycle
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid

TOWN = DriveCycle.named("wltc").part(0, 140)


@lru_cache
def town(recovery: float) -> CycleRun:
    car = pt.replace(FlywheelHybrid(), {"cycle.cycle": TOWN})
    return drive_cycle(car, parameters={"drive.recovery": recovery}, rtol=1e-8)


def _balanced(run: CycleRun) -> None:
    """Nothing goes missing but 1e-6 of the energy that went through the engine."""
    assert not run.message
    assert not run.audit.hidden
    residual = run.audit.components["residual"].abs().max()
    assert residual < 1e-6 * float(run.table.value["work at the crank"]) * 1e6


@pytest.mark.slow
@pytest.mark.parametrize("recovery", [1.0, 0.0])
def test_town(recovery: float) -> None:
    run = town(recovery)
    _balanced(run)
    assert run.time_outside == 0
    on = run.result["engine.on"] > 0.5
    assert 0.02 < on.mean() < 0.3
    assert np.all(run.result["flywheel.w"] * 0.5 < 560 * 3)


def _braked(run: CycleRun) -> float:
    """Energy lost in the brakes [J]."""
    lost = run.audit.components["lost"]
    return float(lost["front.brakes"] + lost["rear.brakes"])


@pytest.mark.slow
def test_recovery_is_what_the_brakes_do_not_get() -> None:
    """The flywheel gets back most of what the brakes take without recovery; losses of the transmission are between."""
    with_, without = town(1.0), town(0.0)
    spared = _braked(without) - _braked(with_)
    assert spared > 0.7 * _braked(without)
    kept = [
        run.audit.components.loc["flywheel", "stored"] - run.table.value["work at the crank"] * 1e6
        for run in (with_, without)
    ]
    assert 0.5 * spared < kept[0] - kept[1] < spared
    braking = with_.result["driver.brake"] > 0.05
    assert with_.result["transmission.flange_a.tau"][braking].min() < -20  # the transmission drives the flywheel
    assert charge_corrected(with_, "flywheel") < 0.85 * charge_corrected(without, "flywheel")


def test_correction_of_the_consumption() -> None:
    run = town(1.0)
    gained = 1.1 / 2 * (run.result["flywheel.w"][-1] ** 2 - run.result["flywheel.w"][0] ** 2)
    efficiency = run.marginal_efficiency
    assert efficiency == pytest.approx(0.38)  # the slope of the engine's Willans line
    assert efficiency > 1.1 * float(run.table.value["mean efficiency of the engine"])
    litres = (run.fuel - gained / efficiency / 43e6) / 0.745 / run.distance * 1e5
    assert charge_corrected(run, "flywheel") == pytest.approx(litres, rel=1e-6)
    assert charge_corrected(run) == charge_corrected(run, "flywheel")
    half = charge_corrected(run, "flywheel", path=0.5)
    assert run.litres_per_100km - half == pytest.approx(2 * (run.litres_per_100km - litres), rel=1e-6)


def test_the_flywheel_alone_burns_nothing() -> None:
    run = drive_cycle(FlywheelHybrid(), DriveCycle.named("wltc").part(0, 20))
    assert run.fuel == 0
    assert run.distance > 10
    assert run.litres_per_100km == 0
    assert np.isnan(charge_corrected(run))
    assert np.isnan(run.table.value["mean efficiency of the engine"])


@pytest.mark.parametrize(
    ("u", "b", "w_in", "w_out", "now", "ratio", "clutch", "friction"),
    [
        (0.5, 0.0, 400, 200, 0.5, (200 + 4.2) / 400, 1 + 0.3, 0.0),
        (0.0, 0.5, 400, 200, 0.5, (200 - 4.2) / 400, 1.0, 0.0),
        (0.0, 1.0, 400, 200, 0.5, (200 - 8.4) / 400, 1.0, 0.4),  # 60 % of the pedal recover
        (0.0, 0.5, 540, 200, 0.5, (200 - 4.2) / 540, 1.0, 0.25),  # half of the room is left
        (0.2, 0.0, 400, 10, 0.15, 0.15, 0.12, 0.0),  # start: the clutch slips
        (0.0, 0.5, 400, 10, 0.15, 0.15, 0.0, 0.5),  # stop: the brakes do it
        (1.0, 0.0, 260, 390, 1.5, (390 + 4.2) / 260, 1.6, 0.0),  # half empty
        (0.0, 0.0, 400, 60.6, 0.1515, 0.1515, 0.0, 0.0),  # 3 % of the band: open
        (0.0, 0.0, 400, 70.5, 0.17625, 0.17625, 0.5, 0.0),  # 52.5 %: half closed
        (1.0, 0.0, 300, 599, 1.9, 2.0, 1.6, 0.0),
    ],
)
def test_drive(
    u: float, b: float, w_in: float, w_out: float, now: float, ratio: float, clutch: float, friction: float
) -> None:
    inputs = {"accelerator": u, "brake": b, "w_in": w_in, "w_out": w_out, "w_before": now * w_in}
    result = pt.simulate(FlywheelDrive(), stop=1, inputs=inputs)
    got = [result[name][-1] for name in ("ratio", "clutch", "friction")]
    assert got == pytest.approx([ratio, clutch, friction])


def test_a_flywheel_that_is_full_before_it_is_empty_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match="w_full = 560 rad/s, w_empty = 600 rad/s"):
        FlywheelDrive(w_empty=600)


def test_without_recovery_the_brake_pedal_opens_the_clutch() -> None:
    inputs = {"accelerator": 0.0, "brake": 0.3, "w_in": 400.0, "w_out": 200.0, "w_before": 200.0}
    result = pt.simulate(FlywheelDrive(recovery=0), stop=1, inputs=inputs)
    assert (result["clutch"][-1], result["friction"][-1]) == pytest.approx((0.0, 0.3))


def test_charge_has_hysteresis() -> None:
    """At rest on below 320, off above 420 rad/s; at 20 m/s 10 rad/s lower. The clutch closes over the last tenth of the slip."""
    w_in = ([0, 10, 20, 30], [400, 300, 440, 300])
    run = pt.simulate(FlywheelCharge(), stop=30, inputs={"w_in": w_in, "v": 20.0, "w": 285.0}, max_step=0.5)
    t = run.time[np.flatnonzero(np.diff(run["on"]))]
    np.testing.assert_allclose(t, [9, 10 + 110 / 14, 20 + 130 / 14], atol=1e-6)
    assert run.at([10.0], "clutch")[0] == pytest.approx(0.5)
    assert run.at([10.0], "throttle")[0] == pytest.approx(0.9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wltc", "udds"])
def test_cycles(name: str) -> None:
    run = drive_cycle(FlywheelHybrid(), name, compile=True, rtol=1e-8)
    _balanced(run)
    assert run.time_outside == 0
    assert 3.5 < charge_corrected(run, "flywheel") < 6.5


@pytest.mark.slow
def test_two_driven_axles_start() -> None:
    """The axle loads follow from accelerations, which have no value at a speed ratio of zero, its guess."""
    axle = DrivenAxle(final_drive=IdealGear(ratio=3.3), left=MagicFormulaWheel(), right=MagicFormulaWheel())
    plant = pt.compile(pt.replace(FlywheelHybrid(), {"rear": axle, "cycle.cycle": TOWN}))
    result = plant.simulate(1.0)
    assert result["rear.left.Fz"][0] == pytest.approx(result["rear.left.fn"][0])
    assert result["actuator.ratio"][0] == pytest.approx(-0.35)


@pytest.mark.slow
def test_charges_a_flywheel_from_rest() -> None:
    """Its energy is the work of the engine's crank less what the parts between them lose and store; it ends like one that begins slowly."""
    runs = [drive_cycle(FlywheelHybrid(), TOWN.part(0, 40), starts={"flywheel.w": w}, rtol=1e-7) for w in (0.0, 0.1)]
    for run in runs:
        _balanced(run)
    assert runs[0].result["flywheel.w"][0] == 0
    ends = [run.result["flywheel.w"][-1] for run in runs]
    assert ends[0] > 600
    assert ends[0] == pytest.approx(ends[1], rel=2e-3)
