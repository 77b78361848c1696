"""The manual car on the cycles, with and without start-stop."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import DrivenAxle
from powertrain.components.control import StartStop
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import Engine, MappedEngine, WillansEngine
from powertrain.components.transmissions import ManualGearbox
from powertrain.components.transmissions.gearbox import SYNCHRONISER
from powertrain.components.wheels import MagicFormulaWheel, SlipWheel, Wheel
from powertrain.trials import CycleRun, drive_cycle, full_accelerator
from powertrain.trials.anatomy import anatomy
from powertrain.trials.gears import in_gear
from powertrain.trials.lost_gear import lost_gear
from powertrain.trials.operating import on_rolling_road
from powertrain.trials.standing import standing
from powertrain.vehicles.manual_car import ManualCar

TOWN = DriveCycle.named("wltc").part(0, 140)
"""Rest, starts, up to the fourth gear, rest."""


def _balanced(run: CycleRun) -> None:
    """Nothing goes missing but 1e-6 of the energy that went through the engine."""
    assert not run.message
    assert not run.audit.hidden
    residual = run.audit.components["residual"].abs().max()
    assert residual < 1e-6 * float(run.table.value["work at the crank"]) * 1e6


@pytest.mark.slow
@pytest.mark.parametrize("engine", [WillansEngine(), MappedEngine.gasoline()], ids=["Willans", "mapped"])
def test_town(engine: Engine) -> None:
    run = drive_cycle(pt.replace(ManualCar(), engine=engine), TOWN, rtol=1e-7)
    _balanced(run)
    assert run.time_outside == 0
    gear, lever = run.result["schedule.gear"], run.result["schedule.lever"]
    assert gear.max() == 4
    assert set(np.abs(np.diff(gear))) == {0, 1}
    held = np.abs(lever - gear) < 1e-9
    ratios = np.array([3.6, 2.1, 1.4, 1.05, 0.84, 0.68])[gear.astype(int) - 1]
    synchronous = run.result["gearbox.input.w"] - ratios * run.result["gearbox.output.w"]
    assert np.mean(np.abs(synchronous[held]) < 1e-6) > 0.98  # the rest: synchronisers at work
    assert np.all(run.result["engine.throttle"] <= run.result["driver.accelerator"] + 1e-9)


@pytest.mark.slow
def test_start_stop_saves_what_idling_burns() -> None:
    always, stopped = (drive_cycle(car, TOWN) for car in (ManualCar(), pt.replace(ManualCar(), start_stop=StartStop())))
    t, off = stopped.result.time, np.where(stopped.result["engine.on"] < 0.5, 1.0, 0.0)
    assert stopped.time_outside == 0
    idling = 18.289 * 85 / 0.38 / 43e6  # motoring torque times speed over the indicated efficiency
    saved, rest = always.fuel - stopped.fuel, float(np.trapezoid(off, t))
    assert rest > 20
    assert saved == pytest.approx(idling * rest, rel=0.1)  # the starts cost a little
    assert stopped.result["engine.w"][off > 0].min() == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wltc", "nedc", "udds", "hwfet"])
def test_cycles(name: str) -> None:
    run = drive_cycle(ManualCar(), name)
    _balanced(run)
    assert run.time_outside == 0
    assert 4.5 < run.litres_per_100km < 7


@pytest.mark.slow
def test_an_engine_that_stalls_is_told() -> None:
    """Without idle controller and starter it runs down in the first seconds; the car stands."""
    car = pt.replace(ManualCar(), {"engine.k_idle": 0.0, "engine.tau_starter": 0.0})
    run = drive_cycle(car, DriveCycle.named("wltc").part(0, 20))
    assert run.message.startswith("the vehicle drove 0 m of the 30 m of wltc 0-20 s: its engine stands from t = 0.6")
    assert "engine.tau_starter" in run.message
    assert run.result.time[-1] == 20


@pytest.mark.slow
def test_an_engine_that_cannot_start_again_is_told() -> None:
    """StartStop stops it at 2 s. The driver begins a second early, without a starter; at the end it is switched off again."""
    cycle = DriveCycle("one hill", ((0, 0), (5, 0), (9, 5), (13, 0), (18, 0)))
    run = drive_cycle(pt.replace(ManualCar(start_stop=StartStop()), {"engine.tau_starter": 0.0}), cycle)
    assert run.result["engine.on"][-1] == 0
    assert "its engine stands from t = 4.0" in run.message
    assert "engine.tau_starter" in run.message


@pytest.mark.slow
def test_a_car_that_does_not_move_is_told_and_its_starter_is_no_efficiency() -> None:
    """An engine that has hardly more than its drag is turned by its starter for ever: that is no work of its fuel."""
    engine = WillansEngine(tau_0=70, tau_max=75, tau_low=3, P_max=32e3)
    run = drive_cycle(pt.replace(ManualCar(), engine=engine), DriveCycle.named("wltc").part(0, 30))
    assert "of wltc 0-30 s: it does not move. engine delivers at most " in run.message
    assert np.isnan(run.efficiency) or run.efficiency < 0.4


@pytest.mark.slow
def test_a_car_that_rolls_back_is_told_and_has_no_consumption() -> None:
    """A slope of 45 % is too steep for its first gear."""
    steep = pt.Map.constant(0.45, x="s", x_unit="m", name="grade")
    cycle = DriveCycle("short", ((0, 0), (5, 0), (15, 10), (30, 10), (40, 0)))
    run = drive_cycle(pt.replace(ManualCar(), {"road.profile": steep}), cycle)
    assert run.distance < -1
    assert re.search(r"drove 0 m of the 250 m of short: it rolled back by .* m\. engine delivers at most", run.message)
    assert "Check the signs of the ratios, the torque at low speed, what" in run.message
    assert np.isnan([run.litres_per_100km, run.co2_per_km, run.mpg()]).all()


@pytest.mark.slow
def test_a_gear_that_is_not_engaged_is_told() -> None:
    """Cones of a fifteenth of the torque are not done when the clutch closes; with weak dogs as well the first gear slides."""
    weak = ManualGearbox.of_ratios(
        3.6, 2.1, 1.4, 1.05, 0.84, 0.68, synchroniser=pt.replace(SYNCHRONISER, fn_max=100.0, peak=500.0)
    )
    with pytest.raises(
        pt.SimulationError, match=r"gear 2 is not engaged: from t = .* gearbox.synchronisers\[1\] slides"
    ):
        full_accelerator(ManualCar(gearbox=weak))
    assert (
        "gear 1 is not"
        in drive_cycle(
            pt.replace(ManualCar(gearbox=weak), {f"gearbox.synchronisers[{k}].peak": 10.0 for k in range(6)}), TOWN
        ).message
    )
    assert "gear 2 is not engaged" in drive_cycle(ManualCar(gearbox=weak), TOWN).message
    assert not lost_gear(drive_cycle(ManualCar(), TOWN).result)


class TurnedBack(dict[str, Any]):
    """Signals of a car whose alternator, a constant torque, turns the engine back while it is switched off."""

    time = np.linspace(0.0, 10.0, 11)


def test_an_engine_that_is_turned_backwards_is_told() -> None:
    w, zero = np.where(TurnedBack.time < 4, 85.0, 20.0 * (4.0 - TurnedBack.time)), np.zeros(11)
    signals = {"engine.w": w, "engine.on": zero, "body.s": TurnedBack.time}
    message = standing(TOWN, TurnedBack(signals), anatomy(ManualCar()))  # type: ignore[arg-type]
    assert message.startswith("its engine is turned backwards from t = 5 s on, down to -120 rad/s")


@pytest.mark.slow
def test_idling_begins_at_idle_speed() -> None:
    """The idle controller has found its throttle before the drive begins."""
    for engine in (WillansEngine(), WillansEngine(tau_0=50), MappedEngine.gasoline()):
        run = drive_cycle(pt.replace(ManualCar(), engine=engine), DriveCycle.named("wltc").part(0, 10))
        assert np.abs(run.result["engine.w"] - 85).max() < 0.1


def on_tyres(wheel: type[Wheel]) -> pt.Component:
    """The car in its third gear on a rolling road, with two tyres behind a differential, which an operating map leaves out."""
    return pt.replace(on_rolling_road(in_gear(ManualCar(), 3)), front=DrivenAxle(left=wheel(), right=wheel()))


@pytest.mark.slow
def test_a_point_before_slipping_tyres_needs_no_neighbour() -> None:
    """The engine idles before an open clutch. The first steps towards it are too long: along them the clutch closes and opens."""
    point, names = {"body.speed": 4.0, "driver.accelerator_set": 0.0}, ["engine.w", "clutch.tau", "clutch.w_rel"]
    found = pt.steady(on_tyres(SlipWheel), point, outputs=names)
    assert found.status.item() == 0
    assert [found[name].item() for name in names[:2]] == pytest.approx([85.0, 0.0], abs=1e-6)
    assert found["clutch.w_rel"].item() < -10.0


@pytest.mark.slow
@pytest.mark.parametrize("wheel", [SlipWheel, MagicFormulaWheel])
def test_a_slipping_clutch_parts_the_engine_from_the_tyres(wheel: type[Wheel]) -> None:
    """Points one by one, without neighbours: the engine's speed is that of the car whose wheels roll, at any speed of the car."""
    rolling, slipping = pt.compile(on_rolling_road(in_gear(ManualCar(), 3))), pt.compile(on_tyres(wheel))
    for v, accelerator in ((3.0, 0.0), (3.0, 0.3), (4.0, 0.6), (5.0, 0.3), (5.0, 0.6)):
        point, names = {"body.speed": v, "driver.accelerator_set": accelerator}, ["engine.w", "clutch.tau"]
        one, other = (pt.steady(plant, point, outputs=names) for plant in (rolling, slipping))
        assert one.status.item() == other.status.item() == 0
        for name in names:
            assert other[name].item() == pytest.approx(one[name].item(), rel=1e-9, abs=1e-7)
