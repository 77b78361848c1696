"""The how-to page of cars from data sheets: file and Python give the same car, within thirty lines, and it drives."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.control import GearSchedule, PowerShiftSchedule
from powertrain.components.cycles import DriveCycle
from powertrain.presets.files import applied
from powertrain.trials import drive_cycle
from powertrain.vehicles import ManualCar

PAGE = (Path(__file__).parents[2] / "docs" / "howto" / "own_car.md").read_text(encoding="utf-8")
FILES, PROGRAMS = (re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL) for kind in ("toml", "python"))
NAMES = "leaf", "roadster", "saloon", "midsize"


def by_python() -> dict[str, Any]:
    """The cars that the programs of the page build; their runs are left out."""
    known: dict[str, Any] = {}
    for program in PROGRAMS:
        whole = program.split("  # fmt: skip")[0]
        exec(whole, known)
    return known


@pytest.mark.slow
@pytest.mark.parametrize("k", range(len(NAMES)), ids=NAMES)
def test_file_and_python_give_one_car(k: int, tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text(FILES[k], encoding="utf-8")
    for text in (FILES[k], PROGRAMS[k]):
        assert sum(bool(line.strip()) for line in text.splitlines()) <= 30
    car = pt.vehicles.load(tmp_path / "car.toml")
    assert car == by_python()[NAMES[k]]
    run = drive_cycle(car, DriveCycle("start", ((0.0, 0.0), (1.0, 0.0), (6.0, 6.0))))
    assert not run.message
    assert run.time_outside == 0


@pytest.mark.slow
@pytest.mark.parametrize(("cycle", "label"), [("udds", 125), ("hwfet", 100)])
def test_the_leaf_uses_as_much_as_the_epa_measured(cycle: str, label: float) -> None:
    """At the EPA's test mass, kerb weight and 136 kg. The label [mpge] is 0.7 times the test; 151 miles take 40 kWh from the battery."""
    gallon, mile = 33705.0, 1.609344
    charging = 40e3 / (151 * gallon / 112)
    measured = charging * 0.7 * gallon / label / mile
    run = drive_cycle(pt.replace(by_python()["leaf"], {"body.m": 1640 - 75 + 136}), cycle)
    assert run.wh_per_km == pytest.approx(measured, rel=0.04)


def test_a_row_of_parts_is_explained(tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text('class = "ManualCar"\n[gearbox]\ngears = [3.4, 2.0]\n', encoding="utf-8")
    with pytest.raises(
        pt.ParameterError, match=r"gearbox.gears has several components .IdealGear.: .*ManualGearbox.of_ratios"
    ):
        pt.vehicles.load(tmp_path / "car.toml")


@pytest.mark.parametrize("text", ["[trailers]\nbody.m = 1300", 'trailers = "Trailer"', 'trailers = ["Trailer"]'])
def test_a_row_without_parts_is_explained(tmp_path: Path, text: str) -> None:
    (tmp_path / "car.toml").write_text(f'class = "ManualCar"\n{text}\n', encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=r"trailers is a row of components: write a table \[\[trailers\]\]"):
        pt.vehicles.load(tmp_path / "car.toml")


@pytest.mark.slow
def test_gearsets_go_through_a_file(tmp_path: Path) -> None:
    text = 'class = "AutomaticCar"\ngearbox = "Automatic.ravigneaux_four_speed()"\n'
    text += "[schedule]\nspeeds = [[4.5, 3.0], [9.0, 7.0], [14.0, 11.0]]\n"
    (tmp_path / "car.toml").write_text(text, encoding="utf-8")
    car = pt.vehicles.load(tmp_path / "car.toml")
    pt.vehicles.save(car, tmp_path / "again.toml")
    assert pt.vehicles.load(tmp_path / "again.toml") == car


def test_shift_speeds_for_gears() -> None:
    """Released, the next gear takes over at w_up; pressed, the largest step begins at w_full."""
    schedule = GearSchedule.for_gears((4.0, 2.0, 1.5), 3.0, radius=0.3, w_up=100.0, w_full=500.0)
    assert schedule.speeds[0][0] * 2.0 * 3.0 / 0.3 == pytest.approx(100.0)
    assert schedule.speeds[1][1] == pytest.approx(0.75 * schedule.speeds[1][0])
    full = schedule.speeds[0][0] * (1 + float(schedule.eager)) * 4.0 * 3.0 / 0.3
    assert full == pytest.approx(500.0)
    with pytest.raises(pt.ParameterError, match="decrease from gear to gear"):
        PowerShiftSchedule.for_gears((1.0, 2.0), 3.0)
    other = GearSchedule.for_gears((4.0, 2.0, 1.5), 3.0, radius="300 mm", w_up=100.0, w_full="500 rad/s")
    np.testing.assert_allclose(other.speeds, schedule.speeds, rtol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "options", "said"),
    [
        ((3.6, 4.1), {}, r": \(3.6,\) are not two or more ratios .*give a list, as in"),
        (([3.6, "2.1"], 4.1), {}, ": ratio of gear 2 = '2.1' is a text"),
        (([3.6, 2.1], -4.1), {}, ": final_drive = -4.1 is outside its range"),
        (([3.6, 2.1], 4.1), {"radius": "205/55"}, r": radius = '205/55' is not the size of a radial tyre"),
        (([3.6, 2.1], 4.1), {"w_full": "5500 Nm"}, ": w_full = '5500 Nm'"),
        (([3.6, 2.1], 4.1), {"w_full": 300}, r": w_full = 300 rad/s is less than 308.6 rad/s, .* to w_up = 180 rad/s"),
        (([3.6, 2.1], 4.1), {"w_full": 5500}, ": w_full = 5500 rad/s is outside its range"),  # rpm without its unit
    ],
)
def test_schedules_for_what_are_no_gears(arguments: tuple[Any, ...], options: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"^GearSchedule.for_gears{said}"):
        GearSchedule.for_gears(*arguments, **options)


def test_what_a_maker_takes() -> None:
    """More arguments than it takes, in a file."""
    said = r"^schedule: GearSchedule.for_gears\(3, 2, 1\) cannot be created: .*; GearSchedule.for_gears takes ratios, final_drive, radius"
    with pytest.raises(pt.ParameterError, match=said):
        applied(ManualCar(), {"schedule": {"class": "GearSchedule.for_gears(3, 2, 1)"}})
    with pytest.raises(
        pt.ParameterError, match=r"^schedule: write GearSchedule.for_gears\(...\) with .*; it takes ratios, final"
    ):
        applied(ManualCar(), {"schedule": {"class": "GearSchedule.for_gears"}})
