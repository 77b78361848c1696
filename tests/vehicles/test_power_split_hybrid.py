"""The power-split hybrid: speeds and torques of its gear, its rules, and a charge that stays."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.control import PowerSplitControl
from powertrain.components.cycles import DriveCycle
from powertrain.trials import CycleRun, charge_corrected, drive_cycle
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid

TOWN = DriveCycle.named("wltc").part(0, 140)


@lru_cache
def town() -> CycleRun:
    return drive_cycle(PowerSplitHybrid(), TOWN, rtol=1e-7)


def _balanced(run: CycleRun) -> None:
    """Nothing goes missing but 1e-6 of the energy that went through the engine."""
    assert not run.message
    assert not run.audit.hidden
    residual = run.audit.components["residual"].abs().max()
    assert residual < 1e-6 * float(run.table.value["work at the crank"]) * 1e6


@pytest.mark.slow
def test_town() -> None:
    run = town()
    _balanced(run)
    assert run.time_outside == 0
    soc, on = run.result["battery.soc"], run.result["engine.on"]
    assert 0.55 < soc.min() < soc.max() < 0.65
    assert set(on) == {0, 1}
    assert np.interp(5.0, run.result.time, on) == 0
    assert not any(count for name, count in run.result.statistics.items() if name.startswith("outside"))
    assert 2.5 < charge_corrected(run, "battery") < 4


@pytest.mark.slow
def test_speeds_and_torques_of_the_gear() -> None:
    """3.6 w_carrier = w_sun + 2.6 w_ring; the engine runs near the speed of its line, with the torque that the control reckons with."""
    result = town().result
    carrier = result["engine.w"] + result["damper.w_rel"]
    np.testing.assert_allclose(3.6 * carrier, result["machine_1.w"] + 2.6 * result["machine_2.w"], atol=1e-6)
    fires = (
        (result["engine.on"] > 0.5)
        & (result["engine.w"] > 100)
        & (np.abs(result["engine.w"] - result["control.w_ref"]) < 5)
    )
    assert fires.mean() > 0.1
    held = result["control.w_ref"] - result["engine.w"]
    reckoned = 3.6 * (held - result["control.tau_1"])
    np.testing.assert_allclose(result["engine.tau"][fires], reckoned[fires], rtol=0.03, atol=0.5)  # a coarse table


@pytest.mark.slow
def test_brakes_recover() -> None:
    """The friction brakes get little; the machine at the ring generates while the car brakes."""
    run = town()
    lost = run.audit.components["lost"]
    assert lost["front.brakes"] + lost["rear.brakes"] < 0.05 * 1450 / 2 * run.cycle.top_speed**2
    braking = run.result["driver.brake"] > 0.1
    fast = run.result["body.v"] > 4
    assert np.all(run.result["machine_2.power"][braking & fast] < 0)
    assert run.result["battery.i"][braking & fast].max() > 20


@pytest.mark.slow
def test_the_engine_turns_with_the_wheels_where_machine_1_would_be_too_fast() -> None:
    """Off at 42 m/s, 550 rad/s of the ring: it turns at (2.6 550 - 1000)/3.6 = 120 rad/s, without fuel; coasting, it turns less and less.

    A stopped engine would let machine 1 turn at 1,430 rad/s: at no torque, so it could not be started.
    """
    rules = {"control.v_on": 60.0, "control.v_off": 55.0, "control.P_on": 30e3, "control.P_off": 20e3}
    car = pt.replace(PowerSplitHybrid(), rules)
    cycle = DriveCycle("down", ((0, 42), (30, 30), (60, 16), (80, 20), (92, 34)))
    run = drive_cycle(car, cycle, starts={"body.v": 42.0})
    result = run.result
    _balanced(run)
    off = result["control.running"] < 0.5
    least = np.maximum((2.6 * result["machine_2.w"] - 1000) / 3.6, 0)
    assert result["engine.w"][0] == pytest.approx(least[0])
    assert least[0] == pytest.approx(119.6, abs=0.1)
    np.testing.assert_allclose(result["engine.w"][off & (result.time < 60)], least[off & (result.time < 60)], atol=6)
    assert np.abs(result["machine_1.w"]).max() < 1000 + 3.6 * 6
    assert result["engine.fuel_rate"][off].max() == 0
    assert result["control.running"][-1] == 1
    assert run.time_outside == 0


def test_machine_1_needs_a_torque_at_its_highest_speed() -> None:
    with pytest.raises(pt.PowertrainError, match=r"control\.w_sun = 1000 rad/s, machine_1\.w_max = 1000 rad/s"):
        pt.compile(pt.replace(PowerSplitHybrid(), {"machine_1.w_max": 1000.0}))


def control(**inputs: float | tuple[list[float], list[float]]) -> pt.Result[PowerSplitControl]:
    """With an engine of 115 N.m whose torque is half open."""
    given = {"accelerator": 0.0, "brake": 0.0, "v": 10.0, "w": 0.0, "w_ring": 100.0, "soc": 0.6}
    given |= {"w_best": 240.0, "tau_open": 115.0, "opening": 0.5, "limit": 450.0}
    return pt.simulate(PowerSplitControl(), stop=20, inputs={**given, **inputs}, max_step=0.5)


def _last(result: pt.Result[PowerSplitControl], *names: str) -> list[float]:
    return [float(result[name][-1]) for name in names]


def test_drives_by_the_machine_at_low_power() -> None:
    result = control(accelerator=0.1)  # 45 N.m at 100 rad/s: 4.5 kW
    assert _last(result, "demand", "on", "throttle", "tau_1", "tau_2", "friction") == pytest.approx(
        [4500, 0, 0, 0, 45, 0]
    )


def test_engine_gives_the_power_that_is_asked_for() -> None:
    """22.5 kW at 200 rad/s are 112.5 N.m: 1/3.6 to machine 1, 2.6/3.6 to the ring; the charge asks for 1 kW more."""
    result = control(accelerator=0.5, w=200.0, soc=0.59)
    torque, held = min(23.5e3 / 200, 115.0), min(240 - 200, 30.0)
    assert _last(result, "demand", "on", "power") == pytest.approx([23500, 1, 23500])
    assert _last(result, "torque", "throttle", "tau_1") == pytest.approx([torque, 0.5, held - torque / 3.6])
    assert result["tau_2"][-1] == pytest.approx(225 - 2.6 * (torque / 3.6 - held))


def test_engine_starts_and_stops_with_hysteresis() -> None:
    """On above 9 kW (accelerator 0.2), off below 4 kW (0.089); 4 s between them at least."""
    u = ([0.0, 5.0, 15.0, 20.0], [0.0, 0.3, 0.0, 0.0])
    on = control(accelerator=u)
    t = on.time[np.flatnonzero(np.diff(on["on"]))]
    np.testing.assert_allclose(t, [5 * 2 / 3, 15 - 10 * 4 / 45 / 0.3], atol=1e-6)
    assert control(v=25.0)["on"][-1] == 1  # always at speed
    assert control(soc=0.5)["on"][-1] == 1  # an empty battery


@pytest.mark.parametrize(("accelerator", "on"), [(0.3, 0), (0.44, 0), (0.45, 1), (0.6, 1)])
def test_a_full_battery_keeps_the_engine_off_up_to_its_power(accelerator: float, on: int) -> None:
    """45 kW times the accelerator at 100 rad/s, the charge counts as -30 kW; the battery gives 20 kW."""
    assert _last(control(accelerator=accelerator, soc=0.9, battery_power=20e3), "on") == [on]


def test_the_engine_gives_what_the_battery_does_not() -> None:
    """25 of 45 kW; it runs on until the driver asks for less than 10 kW: 45 u."""
    u = ([0.0, 5.0, 5.0, 15.0, 20.0], [0.0, 0.0, 1.0, 0.0, 0.0])
    result = control(accelerator=u, soc=0.9, battery_power=20e3)
    assert result["demand"].max() == pytest.approx(25e3)
    (stopped,) = result.time[np.flatnonzero(np.diff(result["on"]) < 0)]
    assert stopped == pytest.approx(15 - 10 * 10 / 45, abs=1e-6)


def test_recovers_what_the_battery_takes() -> None:
    """Brakes of 15 kN, of which machine 2 gives 5 kN, or 450 N.m, which are 4.5 kN; it fades out below 3 m/s and 20 rad/s."""
    assert _last(control(brake=0.2), "tau_2", "friction") == pytest.approx([-300, 0])
    assert _last(control(brake=0.4), "tau_2", "friction") == pytest.approx([-450, 0.1])
    assert _last(control(brake=0.4, limit=600.0), "tau_2", "friction") == pytest.approx([-500, 1 / 15])
    full = control(brake=0.4, charge_power=4500.0)
    assert _last(full, "tau_2", "friction") == pytest.approx([-45, 0.37])
    assert _last(control(brake=0.2, v=1.5, w_ring=15.0), "tau_2", "friction") == pytest.approx([-150, 0.1])
    assert _last(control(accelerator=0.15, discharge_power=5000.0), "tau_2") == pytest.approx([50])
    losing = control(accelerator=0.15, discharge_power=5000.0, limit=100.0, added_loss=2500.0)
    assert _last(losing, "tau_2") == pytest.approx([40])  # 100 N.m draw 12.5 kW


def test_engine_gives_no_more_than_car_and_battery_take() -> None:
    """P_min is 5 kW; 45 N.m at 100 rad/s are 4.5 kW."""
    assert _last(control(v=25.0, charge_power=2e3), "on", "power") == pytest.approx([1, 2e3])
    assert _last(control(v=25.0, charge_power=-100.0), "on", "power") == pytest.approx([1, 0])
    assert _last(control(v=25.0, charge_power=0.0, accelerator=0.1), "on", "power") == pytest.approx([1, 4500])
    assert _last(control(v=25.0, charge_power=2e3, accelerator=0.1), "on", "power") == pytest.approx([1, 5e3])


def test_engine_gives_no_more_than_machine_2_takes_from_machine_1() -> None:
    """At 200 rad/s the sun turns with 3.6 * 200 - 2.6 * 100 = 460 rad/s and gives 460/720 of the power; machine 2 takes 50 N.m."""
    given = {"accelerator": 0.5, "w": 200.0, "charge_power": 1e3, "limit": 50.0}
    assert _last(control(**given), "power") == pytest.approx([(1e3 + 50 * 100) * 720 / 460])


@pytest.mark.parametrize(("w_ring", "w_ref"), [(100.0, 240.0), (800.0, (2.6 * 800 - 1000) / 3.6)])
def test_machine_1_turns_no_faster_than_it_may_in_either_direction(w_ring: float, w_ref: float) -> None:
    """At 800 rad/s of the ring and 240 rad/s of the engine it would turn with -1216 rad/s."""
    assert _last(control(v=25.0, w_ring=w_ring, w=300.0), "w_ref") == pytest.approx([w_ref])


@pytest.mark.slow
def test_consumption_corrected_for_the_charge_hardly_depends_on_where_it_began() -> None:
    """A kilogram of fuel more leaves what the marginal efficiency of 0.4 and the way through machine and battery make of it."""
    plant = pt.compile(pt.replace(PowerSplitHybrid(), {"cycle.cycle": DriveCycle.named("wltc").part(0, 589)}))
    low, high = (drive_cycle(plant, starts={"battery.soc": soc}) for soc in (0.57, 0.63))
    gained = [float(run.audit.components["stored"].loc["battery"]) for run in (low, high)]
    path = (gained[0] - gained[1]) / (low.fuel - high.fuel) / 43e6 / low.marginal_efficiency
    assert low.marginal_efficiency == pytest.approx(0.4)
    assert 0.8 < path < 0.92
    assert charge_corrected(low, path=path) == pytest.approx(charge_corrected(high, path=path), rel=1e-3)
    assert low.litres_per_100km > 1.1 * high.litres_per_100km


@pytest.mark.slow
def test_charge_is_sustained_over_the_wltc() -> None:
    """From wherever it starts, the charge ends at the same state; started there, the consumption needs no correction."""
    plant = pt.compile(PowerSplitHybrid())
    runs = [drive_cycle(plant, starts={"battery.soc": soc}, compile=True) for soc in (0.5, 0.6, 0.7)]
    ends = [float(run.result["battery.soc"][-1]) for run in runs]
    np.testing.assert_allclose(ends, ends[0], atol=1e-5)
    balanced = drive_cycle(plant, starts={"battery.soc": ends[0]}, compile=True)
    for run in (*runs, balanced):
        _balanced(run)
        assert run.time_outside == 0
        assert charge_corrected(run, "battery", path=0.9) == pytest.approx(balanced.litres_per_100km, rel=0.02)
    assert balanced.litres_per_100km == pytest.approx(4.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nedc", "udds", "hwfet"])
def test_cycles(name: str) -> None:
    run = drive_cycle(PowerSplitHybrid(), name, compile=True)
    _balanced(run)
    assert run.time_outside == 0
