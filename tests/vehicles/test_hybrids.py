"""Parallel hybrids P0 to P4, series hybrid, plug-in, electric car with two machines: part of a cycle, energy closed, rules kept."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cases import few

import powertrain as pt
from powertrain.components.body import CentreDifferential, RollingAxle
from powertrain.components.control import OpenPedals, SetPedals
from powertrain.components.cycles import DriveCycle
from powertrain.trials import (
    ChargeSustaining,
    CycleRun,
    UtilityFactor,
    charge_corrected,
    charge_depleting,
    charge_sustaining,
    drive_cycle,
    electric_share,
    time_between,
    utility_weighted,
)
from powertrain.trials.charge import _check_reach, _from_soc
from powertrain.trials.cycle import on_cycle
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.electric_four_wheel_drive import ElectricFourWheelDriveCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid, Position
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.series_hybrid import SeriesHybrid

TOWN = DriveCycle.named("wltc").part(0, 140)
HYBRIDS: dict[str, Any] = {
    **{position: ParallelHybrid.at(position) for position in ("P0", "P1", "P2", "P3", "P4")},
    "series": SeriesHybrid(),
}
TWO = ElectricFourWheelDriveCar()


@pytest.fixture(scope="module", params=HYBRIDS)
def town(request: pytest.FixtureRequest) -> tuple[str, CycleRun]:
    return request.param, drive_cycle(HYBRIDS[request.param], TOWN, rtol=1e-6)


@pytest.mark.slow
def test_town(town: tuple[str, CycleRun]) -> None:
    """The tolerance is held, energy closes, the battery stays within its limits, and it recovers what the brakes would take."""
    name, run = town
    assert not run.message
    assert run.time_outside == 0
    assert run.audit.closure < 1e-6
    assert run.audit.violations.empty
    assert not any(count for key, count in run.result.statistics.items() if key.startswith("outside"))
    soc = run.result["battery.soc"]
    assert 0.55 < soc.min() < soc.max() < 0.65
    tau = run.result[f"{'machine' if name != 'series' else 'generator'}.tau"]
    assert tau.min() < -5  # it generates


@pytest.mark.slow
def test_who_drives(town: tuple[str, CycleRun]) -> None:
    """Machines behind the clutch and in series drive alone with the engine stopped; those at the crank cannot."""
    name, run = town
    if name in ("P0", "P1"):
        assert electric_share(run) < 0.02
    else:
        assert 0.2 < electric_share(run) < 1
        off = (run.result["engine.on"] < 0.5) & (run.speed > 2) & (run.result["engine.w"] < 1)
        assert off.any()
    if name == "series":
        drives = (run.result["genset.on"] > 0.5) & (run.result["engine.w"] > 100)
        assert np.std(run.result["engine.w"][drives] - run.result["genset.w_best"][drives]) < 25


@pytest.mark.slow
@pytest.mark.parametrize("name", few(("P2", "P3", "P4", "series"), 0))
def test_the_engine_starts_and_stops_by_its_rule_alone(name: str) -> None:
    """Also where gears shift at the same time."""
    result = drive_cycle(HYBRIDS[name], DriveCycle.named("udds").part(0, 330)).result
    (control,) = (path.removesuffix(".running") for path in result if path.endswith(".running"))
    running, demand, v = (result[f"{control}.{signal}"] for signal in ("running", "demand", "v"))
    P_on, P_off, v_on, v_off = (result.parameters[f"{control}.{limit}"] for limit in ("P_on", "P_off", "v_on", "v_off"))
    started, stopped = (np.flatnonzero(np.diff(running) == way) for way in (1.0, -1.0))
    assert started.size > 0
    assert stopped.size > 0
    assert ((demand[started] > P_on * (1 - 1e-3)) | (v[started] > v_on - 1e-3)).all()
    assert ((demand[stopped] < P_off * (1 + 1e-3)) & (v[stopped] < v_off + 1e-3)).all()


@pytest.mark.slow
def test_powers_add_up() -> None:
    """P2: what the driver asks for is what engine and machine give together, while the engine runs and the clutch is closed."""
    run = drive_cycle(HYBRIDS["P2"], TOWN)
    signals = run.result
    closed = (
        (np.abs(signals["clutch.w_rel"]) < 1e-6)
        & (signals["control.matched"] > 0.5)
        & (signals["control.accelerator"] > 0.1)
    )
    limits = signals["battery.discharge_power"] > 20e3
    given = signals["control.torque"] * signals["engine.w"] + signals["control.tau"] * signals["machine.w"]
    rows = closed & limits & (signals["machine.w"] > 60) & (signals["engine.w"] > 100)
    assert rows.any()
    np.testing.assert_allclose(given[rows], signals["control.asked"][rows], rtol=1e-6)


WEAK = {"battery.Q": 600.0, "battery.i_discharge": 20.0, "battery.i_charge": 15.0}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("car", "charges"),
    [
        (SeriesHybrid(), (0.6, 0.88)),
        (pt.replace(SeriesHybrid(), {"battery_cooling.T": 253.15}), (0.6, 0.88)),
        (ParallelHybrid.plug_in(), (0.2, 0.95)),
        (pt.replace(ParallelHybrid.plug_in(), {"machine.P_max": 15e3}), (0.2, 0.95)),
        (PowerSplitHybrid(), (0.6, 0.88)),
        (pt.replace(SeriesHybrid(), WEAK), (0.2, 0.5)),
    ],
    ids=["series", "cold", "plug-in", "plug-in, small machine", "power split", "series, weak battery"],
)
def test_a_fuller_battery_makes_no_car_slower(car: pt.Component, charges: tuple[float, float]) -> None:
    """The engine helps where the machine cannot give what the full pedal asks for.

    It stood: 0 to 100 km/h in 21.0 s with a full battery instead of 10.2 s, cold 37.7 s for 11.4 s, plug-in 11.2 s for 8.0 s, with the
    small machine and with the weak battery never.
    """
    plant = pt.compile(pt.replace(car, driver=SetPedals(accelerator_set=1.0)))
    slow, fast = (time_between(plant.simulate(22.0, starts={"battery.soc": soc}), 0, 100 / 3.6) for soc in charges)
    assert fast < 1.05 * slow


@pytest.mark.slow
@pytest.mark.parametrize("position", ["P2", "P3", "P4"])
def test_an_engine_started_on_the_road_does_not_brake_the_car(position: Position) -> None:
    """Its speed comes from its own torque: while the driver accelerates, the car does too. It was slowed down by 10 m/s2."""
    result = drive_cycle(HYBRIDS[position], DriveCycle("away", ((0, 0), (10, 12), (15, 14)))).result
    t, slip = result.time, result["clutch.w_rel"]
    (started,) = np.flatnonzero(np.diff(result["control.running"]) > 0)
    assert slip[started] > 50
    soon = (t >= t[started]) & (t < t[started] + 2)
    assert result["body.chassis.a"][soon].min() > 0.5 * result["body.chassis.a"][started]
    assert (slip[soon] < 1e-6).any()


@pytest.mark.slow
@pytest.mark.parametrize("position", ["P2", "P3", "P4"])
def test_moving_off_at_a_low_charge(position: Position) -> None:
    """The engine starts and moves the car off, the machine charges: it never turns the car backward and draws no power for that."""
    plant = pt.compile(ParallelHybrid.at(position, driver=OpenPedals()))
    pedal = {"driver.accelerator_pedal": ([0.0, 1.0, 1.2, 9.0], [0.0, 0.0, 0.2, 0.2])}
    result = plant.simulate(8.0, inputs=pedal, starts={"battery.soc": 0.3}, points=401)
    assert result["body.v"].min() > -1e-3
    assert result["body.v"][-1] > 4
    assert result["machine.power"].max() < 1
    assert result["battery.soc"][-1] > 0.31


@pytest.mark.slow
def test_positions_that_cannot_be() -> None:
    with pytest.raises(pt.ModelError, match="drives each axle from a shaft of its own"):
        pt.compile(ParallelHybrid(position="P4"))
    with pytest.raises(
        pt.ModelError, match=r"5 rows of shift speeds, for 6 gears, but gearbox \(PowerShiftGearbox\) has 3"
    ):
        pt.compile(pt.replace(ParallelHybrid(), {"gearbox.ratios": (3.9, 2.4, 1.6)}))
    with pytest.raises(pt.ModelError, match="drives each axle from a shaft of its own"):
        pt.compile(pt.replace(TWO, rear=RollingAxle()))
    with pytest.raises(pt.ModelError, match="drives each axle from a shaft of its own"):
        pt.compile(pt.replace(TWO, transfer=CentreDifferential()))


@pytest.mark.slow
def test_two_machines_share() -> None:
    run = drive_cycle(TWO, TOWN, rtol=1e-6)
    assert run.time_outside == 0
    assert run.audit.closure < 1e-6
    front, rear = (run.result[f"{end}_machine.tau"] for end in ("front", "rear"))
    pulls = np.abs(front) > 1
    np.testing.assert_allclose(rear[pulls], 1.5 * front[pulls], rtol=1e-9)
    assert run.wh_per_km > 0


@pytest.mark.slow
def test_machines_behind_other_ratios_brake_as_asked() -> None:
    """The power of both machines while they recover is the regenerated force times the speed."""
    run = drive_cycle(
        pt.replace(TWO, {"front.final_drive.ratio": 8.0, "rear.final_drive.ratio": 12.0}), TOWN, rtol=1e-6
    )
    result = run.result
    recovers = result["control.regenerated"] > 50
    front, rear = (result[f"{end}_machine.tau"] * result[f"{end}_machine.w"] for end in ("front", "rear"))
    power = front + rear
    driven = recovers & (result["driver.accelerator"] < 1e-9)
    assert driven.sum() > 20
    np.testing.assert_allclose(-power[driven], (result["control.regenerated"] * run.speed)[driven], rtol=1e-3)


@pytest.fixture(scope="module")
def sustaining() -> ChargeSustaining:
    return charge_sustaining(HYBRIDS["P2"], DriveCycle.named("wltc").part(0, 300), spread=(-0.03, 0.0, 0.03))


@pytest.mark.slow
def test_charge_sustaining_correction(sustaining: ChargeSustaining) -> None:
    """The slope is that of the least squares by the regulation's sums; it agrees with the correction by marginal efficiency."""
    tests = sustaining.tests
    E, F, n = tests["charge"], tests["consumption"], len(tests)
    K = (n * (E * F).sum() - E.sum() * F.sum()) / (n * (E**2).sum() - E.sum() ** 2)
    assert sustaining.K_fuel == pytest.approx(K, rel=1e-9)
    assert sustaining.K_fuel > 0
    nearest = tests.iloc[int(np.argmin(np.abs(E.to_numpy())))]
    assert sustaining.litres_per_100km == pytest.approx(nearest["consumption"] - K * nearest["charge"])
    run = drive_cycle(HYBRIDS["P2"], DriveCycle.named("wltc").part(0, 300))
    assert tests["net energy change"][1] == pytest.approx(-run.electricity / run.heat, rel=1e-6)
    assert charge_corrected(run) == pytest.approx(sustaining.litres_per_100km, rel=0.06)
    assert sustaining.sustains == (nearest["net energy change"] ** 2 < 1e-4)


@pytest.mark.parametrize(
    ("charges", "refused"),
    [((-122.8, -122.7, -122.6), True), ((80.0, 60.0), True), ((19.9, -54.6), False), ((-10.0, -30.0), False)],
)
def test_equal_charge_must_be_within_reach_of_the_tests(charges: tuple[float, ...], refused: bool) -> None:
    """A plug-in hybrid that drove on its battery in every test had a consumption of -14.6 l/100 km at equal charge."""
    tests = pd.DataFrame({"soc": np.linspace(0.5, 0.6, len(charges)), "charge": charges})
    with pytest.raises(pt.ParameterError, match="too far from equal charge") if refused else nullcontext():
        _check_reach(tests)


@pytest.mark.slow
def test_gears_change_while_the_engine_stands() -> None:
    """The fourth gear at 14 m/s; in the first, where it used to remain, the machine would turn at 14/0.3 x 4.1 x 3.8 = 727 rad/s."""
    cycle = DriveCycle("electric", ((0.0, 0.0), (20.0, 14.0), (30.0, 14.0)))
    run = drive_cycle(ParallelHybrid.plug_in(), cycle, starts={"battery.soc": 0.9})
    assert np.abs(run.result["engine.w"]).max() < 1e-6
    assert run.result["schedule.gear"][-1] == 4


@pytest.fixture(scope="module")
def depleting() -> pd.DataFrame:
    small = pt.replace(ParallelHybrid.plug_in(), {"battery.Q": 3600 * 2.0, "battery.R": 0.4})
    return charge_depleting(small, DriveCycle.named("wltc").part(0, 300))


@pytest.mark.slow
def test_charge_depleting(depleting: pd.DataFrame) -> None:
    """First on the battery alone, then less and less, at last with the charge sustained."""
    assert depleting["consumption"].iloc[0] == 0
    assert depleting["consumption"].iloc[-1] > 4
    assert (depleting["soc"].diff().iloc[1:-1] < 0).all()
    assert depleting["relative change"].iloc[-1] < 0.04 <= depleting["relative change"].iloc[-2]
    assert 0.12 < depleting["soc"].iloc[-1] < 0.25
    assert depleting["distance"].iloc[-1] == pytest.approx(len(depleting) * depleting["distance"].iloc[0], rel=1e-2)


@pytest.mark.slow
def test_both_tests_are_weighted_by_the_utility_factor(depleting: pd.DataFrame) -> None:
    """All but the last cycle are charge-depleting; the sum is written out for a factor 1 - exp(-d/10 km)."""
    equal = {"charge": 0.0, "consumption": 6.0, "carbon dioxide": 140.0}
    found = utility_weighted(depleting, ChargeSustaining(pd.DataFrame([equal]), 0.0, 0.0), UtilityFactor((1.0,), 10.0))
    left, electricity, fuel = 1.0, 0.0, 0.0
    for _, cycle in depleting.iloc[:-1].iterrows():
        share = left - np.exp(-cycle["distance"] / 10.0)
        left, electricity, fuel = (
            left - share,
            electricity + share * cycle["from the battery"],
            fuel + share * cycle["consumption"],
        )
    assert found["utility factor"] == pytest.approx(1 - left, rel=1e-12)
    assert found["from the battery"] == pytest.approx(electricity, rel=1e-12)
    assert found["consumption"] == pytest.approx(fuel + left * 6.0, rel=1e-12)


@pytest.mark.slow
def test_a_battery_that_is_not_depleted_is_told() -> None:
    with pytest.warns(
        RuntimeWarning, match="after 1 cycles, 0.* km, the charge still changes by .* the range is longer"
    ):
        charge_depleting(ParallelHybrid.plug_in(), DriveCycle.named("wltc").part(0, 60), most=1)


@pytest.mark.slow
def test_tests_start_at_their_charge_and_where_starts_say() -> None:
    cycle = DriveCycle.named("wltc").part(0, 12)
    plant = pt.compile(on_cycle(HYBRIDS["P2"], cycle))
    run = _from_soc(plant, "battery", 0.5, starts={"body.s": "2 km"})
    assert [run.result[name][0] for name in ("battery.soc", "body.s")] == [0.5, 2000.0]
    for trial in (charge_sustaining, charge_depleting):
        with pytest.raises(pt.ParameterError, match=r"give battery\.soc = 0\.4 as soc"):
            trial(HYBRIDS["P2"], cycle, starts={"battery.soc": 0.4})


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", [ElectricCar(), ManualCar()])
def test_tests_of_hybrids_need_hybrids(vehicle: pt.Component) -> None:
    for trial in (charge_sustaining, charge_depleting):
        with pytest.raises(pt.ParameterError, match="needs a vehicle with one battery and an engine"):
            trial(vehicle)
    with pytest.raises(pt.ParameterError, match="two or more different"):
        charge_sustaining(HYBRIDS["P2"], spread=(0.0,))


@pytest.mark.slow
def test_the_table_tells_miles_per_gallon() -> None:
    """40 CFR 600: a litre per 100 km is 235.2 mpg."""
    run = drive_cycle(ManualCar(), DriveCycle.named("wltc").part(0, 60))
    value, unit = run.table.loc["fuel economy"]
    assert unit == "mpg"
    assert value == pytest.approx(235.2145833 / run.litres_per_100km, rel=1e-9)


@pytest.mark.parametrize("most", [0, -1, 2.5])
def test_a_charge_depleting_test_has_at_least_one_cycle(most: Any) -> None:
    """Without a cycle the table used to be empty, with a warning of a charge that changes by inf %."""
    with pytest.raises(pt.ParameterError, match=r"charge_depleting: most = .* must be"):
        charge_depleting(ParallelHybrid.plug_in(), DriveCycle.named("wltc").part(0, 60), most=most)
