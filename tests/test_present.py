"""What a run tells of itself while it goes on: the same numbers as its result."""

from __future__ import annotations

import pytest
from small_models import CoupledClutches

import powertrain as pt
from powertrain.components import DriveCycle
from powertrain.present import Bar
from powertrain.trials import drive_cycle
from powertrain.vehicles import ManualCar, PowerSplitHybrid


@pytest.fixture
def told_always(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("powertrain.engine.loop._throttled", lambda tell: tell)


@pytest.mark.usefixtures("told_always")
def test_signals_of_the_present_are_those_of_the_result() -> None:
    kept: list[tuple[float, float, float, float]] = []

    def watch(now: pt.Present[CoupledClutches]) -> None:
        kept.append((now.time, now["J1.w"], now[lambda m: m.J1.w - m.J2.w], now["clutch1.mode"]))

    result = pt.simulate(CoupledClutches(), 1.5, progress=watch)
    assert (kept[0][0], kept[-1][0]) == (0.0, 1.5)
    assert len(kept) > 20
    steps = [values for values in kept if all(values[0] != event.time for event in result.events)]
    for t, w, relative, _ in steps:
        assert w == pytest.approx(result.at(t, "J1.w"), abs=1e-12)
        assert relative == pytest.approx(result.at(t, lambda m: m.J1.w - m.J2.w), abs=1e-12)
    assert {mode for *_, mode in kept} == set(result["clutch1.mode"])


def test_unknown_names_are_answered_with_similar_ones() -> None:
    with pytest.raises(pt.ParameterError, match=r"J1\.w"):
        pt.simulate(CoupledClutches(), 0.1, progress=lambda now: now["J1.ww"])


@pytest.mark.slow
@pytest.mark.usefixtures("told_always")
def test_a_vehicle_shows_how_far_it_is_and_what_it_consumed(capsys: pytest.CaptureFixture[str]) -> None:
    run = drive_cycle(PowerSplitHybrid(), part(), rtol=1e-3, progress=True)
    shown = capsys.readouterr().err.rsplit("\r", 1)[-1]
    assert f"{run.distance / 1e3:.1f} km, {run.litres_per_100km:.2f} l/100 km" in shown
    assert f"battery {run.result['battery.soc'][-1]:.1%}" in shown


@pytest.mark.slow
@pytest.mark.usefixtures("told_always")
def test_a_consumption_is_told_from_a_hundred_metres_on(capsys: pytest.CaptureFixture[str]) -> None:
    drive_cycle(ManualCar(), part(15.0), rtol=1e-3, progress=True)
    shown = capsys.readouterr().err
    assert "0.0 km]" in shown
    assert "l/100" not in shown


def test_the_bar_of_a_run_that_ends_early_is_closed() -> None:
    def interrupted(now: pt.Present[CoupledClutches]) -> str:
        raise KeyboardInterrupt

    bar = Bar(0.0, 1.5, interrupted)
    with pytest.raises(KeyboardInterrupt):
        pt.simulate(CoupledClutches(), 1.5, progress=bar)
    assert bar._bar.disable  # by which tqdm knows that it is closed


def part(end: float = 60.0) -> DriveCycle:
    """The beginning of the WLTC."""
    return DriveCycle.named("wltc").part(0.0, end)
