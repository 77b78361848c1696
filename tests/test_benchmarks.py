"""The benchmarks run, and what they compare agrees. No times are asserted."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.measured.published import OTHERS, PREDICTIONS

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks import by_hand, chain, coupled_clutches, drive_cycle, driveline, measured_cars, native, run, timing

needs_gcc = pytest.mark.skipif(bool(native.no_compiler()), reason="there is no gcc")


def clutches() -> tuple[pt.Plant[coupled_clutches.CoupledClutches], coupled_clutches.Array]:
    plant = pt.compile(coupled_clutches.CoupledClutches())
    return plant, coupled_clutches.speeds(plant.simulate(coupled_clutches.STOP, times=coupled_clutches.GRID, rtol=1e-9))


@needs_gcc
@pytest.mark.parametrize("checks", [True, False])
def test_clutches_in_c_agree(checks: bool) -> None:
    rows, events = coupled_clutches.floor(checks)()
    plant, speeds = clutches()
    assert np.abs(np.cumsum(rows[:, 1::2], axis=1) - speeds).max() < 1e-4
    assert events == len(set(plant.simulate(coupled_clutches.STOP).events.times))


def test_clutches_by_hand_agree() -> None:
    rows, _ = by_hand.simulate_by_hand()
    assert np.abs(rows[:, 4:] - clutches()[1]).max() < 1e-3


def test_perturbed_clutches_switch_alike() -> None:
    assert coupled_clutches.same_sequences(pt.compile(coupled_clutches.CoupledClutches()), 3) == 3


def test_chain_by_hand_agrees() -> None:
    rows = chain.run(rounds=1, n=3, stop=0.1, points=11)
    assert [row.benchmark for row in rows] == ["chain of 3"] * 3


@pytest.mark.slow
@needs_gcc
def test_driveline_in_c_agrees() -> None:
    plant = pt.compile(driveline.Driveline(engine=driveline.Engine(torque_map=driveline.engine_map())))
    ours = plant.simulate(driveline.STOP, times=driveline.GRID).at(driveline.GRID, driveline.signals())
    hand = driveline.whole_run_in_c(*driveline.by_hand())()[:, driveline.places()]
    exact = np.column_stack(list(ours.values()))
    assert (np.abs(hand - exact).max(axis=0) < 1e-4 * np.abs(exact).max(axis=0)).all()


@pytest.mark.slow
def test_drive_cycle_without_fastsim(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fastsim", None)
    monkeypatch.setattr(drive_cycle, "WLTC", DriveCycle.named("wltc").part(0, 40))
    monkeypatch.setattr(native, "no_compiler", lambda: "no compiler for this test")
    rows = drive_cycle.run(rounds=1, settled=1, tolerances=(1e-4,))
    assert any(row.what == "FASTSim" and "powertrain[benchmarks]" in row.measured for row in rows)
    assert rows[-1].measured == "no compiler for this test"


def test_sections_that_were_not_measured_stay_on_the_page() -> None:
    page = timing.sections([timing.Row("a", "x", "1 s"), timing.Row("b", "x", "1 s")])
    found = run.renewed(f"# Title\n\nText.\n\n{page}\n", timing.sections([timing.Row("a", "x", "2 s")]))
    assert found == page.replace("1 s", "2 s", 1)


def test_table_and_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [timing.at_most("a", "b", 3.0, 2.0), timing.at_least("a", "c", 3.0, 2.0)]
    assert [row.met for row in rows] == [False, True]
    assert timing.table(rows).count("\n") == 3
    assert timing.sections([*rows, timing.Row("b", "d", "1 s")]).count("## ") == 2
    with pytest.raises(SystemExit):
        run.main(["nothing"])
    assert "coupled_clutches" in capsys.readouterr().err


def test_what_is_published_of_measured_cars_is_written_where_it_is_read() -> None:
    for name in (PREDICTIONS, OTHERS):
        assert (measured_cars.DATA / name).read_text(encoding="utf-8").startswith("car,test_vehicle,")
