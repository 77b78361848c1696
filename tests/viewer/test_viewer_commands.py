"""The commands view, compare and convert, and --report of run."""

from __future__ import annotations

import os
import re
import signal
import webbrowser
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner
from pages import Page
from scipy.io import loadmat

import powertrain as pt
from powertrain.cli import main

SHORT = "--span", "0:40"


def called(*arguments: str, code: int = 0) -> str:
    result = CliRunner().invoke(main, list(arguments))
    assert result.exit_code == code, result.output
    return " ".join(result.output.split())


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved run of forty seconds, with its page beside it."""
    path = tmp_path_factory.mktemp("runs") / "run.nc"
    text = called("run", "ManualCar", *SHORT, "--out", str(path), "--report", str(path.with_suffix(".html")))
    assert f"wrote {path.with_suffix('.html')}" in text
    return path


def test_report_of_a_run_has_results_power_flow_and_the_engines_map(saved: Path) -> None:
    run = Page(saved.with_suffix(".html")).content["runs"][0]
    assert run["name"] == "ManualCar over wltc, 0 to 40 s" or run["name"].startswith("ManualCar over")
    assert run["results"][0][0] == "distance"
    assert "engine" in [box[0] for box in run["layouts"][""]["boxes"]]
    assert [one["path"] for one in run["maps"]] == ["engine"]


def test_a_saved_run_is_viewed(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []

    def opening(address: str) -> bool:
        opened.append(address)
        return True

    monkeypatch.setattr(webbrowser, "open", opening)
    assert "wrote" in called("view", str(saved), "--out", str(tmp_path / "a.html"))
    assert not opened
    called("view", str(saved))
    assert opened[0].startswith("file://")
    t, v = Page(tmp_path / "a.html").curve("body.v")
    data = pt.load(saved).drop_duplicates("time")
    np.testing.assert_allclose(np.interp(data.time, t, v), data["body.v"], atol=2.1e-3 * float(data["body.v"].max()))
    assert "has no model" in called("view", str(saved), "--set", "body.m=3", code=2)


@pytest.mark.slow
def test_one_vehicle_is_compared_with_itself_as_changed(tmp_path: Path) -> None:
    page = tmp_path / "c.html"
    text = called(
        "compare", "ElectricCar", *SHORT, "--set", "body.m=1500", "--signals", "body.v", "--report", str(page)
    )
    assert "as it is and body.m=1500" in text
    assert "body.m 1700 1500 kg" in text
    assert [run["name"] for run in Page(page).content["runs"]] == ["as it is", "body.m=1500"]


def test_saved_runs_are_compared_by_the_names_of_their_files(saved: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.nc"
    other.write_bytes(saved.read_bytes())
    text = called("compare", str(saved), str(other), "--signals", "body.v", "--plot", str(tmp_path / "v.png"))
    assert "run and other, 0 to 40 s" in text
    assert f"{saved} 1 and {saved} 2, 0 to 40 s" in called("compare", str(saved), str(saved), "--signals", "body.v")
    assert (tmp_path / "v.png").read_bytes().startswith(b"\x89PNG")
    assert "give two runs" in called("compare", str(saved), code=2)
    assert "give two runs" in called("compare", str(saved), str(other), "--set", "body.m=3", code=2)
    assert "there is no file" in called("compare", str(saved), "nothing.nc", code=2)


@pytest.mark.slow
def test_a_vehicle_drives_a_given_cycle_beside_a_saved_run(saved: Path) -> None:
    """It used to drive its own cycle, whatever the saved run drove, and none could be given."""
    assert "give the cycle of the vehicle with --cycle" in called("compare", str(saved), "ManualCar", code=2)
    text = called("compare", str(saved), "ManualCar", "--cycle", "wltc", *SHORT, "--signals", "cycle.v_ref")
    difference, largest = (float(text.split("cycle.v_ref")[1].split()[k]) for k in (2, 3))
    assert abs(difference) < 1e-9
    assert largest < 1e-9


def test_a_parameter_file_is_not_converted(tmp_path: Path) -> None:
    file = tmp_path / "car.toml"
    file.write_text('class = "ManualCar"\n')
    said = called("convert", str(file), str(tmp_path / "a.csv"), code=2)
    assert "is not a saved run, map or sweep (.nc); powertrain run VEHICLE --out" in said
    with pytest.raises(
        pt.ParameterError, match=r"load reads the netCDF files \(\.nc\) of runs, maps and sweeps; .*car\.toml"
    ):
        pt.load(file)


@pytest.mark.slow
def test_a_saved_run_is_converted(saved: Path, tmp_path: Path) -> None:
    data = pt.load(saved)
    for ending in ("csv", "mat", "nc", "html"):
        called("convert", str(saved), str(tmp_path / f"a.{ending}"), "--signals", "body.*")
    table = pd.read_csv(tmp_path / "a.csv", index_col="time")
    np.testing.assert_allclose(table["body.v"], data["body.v"])
    matlab = loadmat(tmp_path / "a.mat")
    np.testing.assert_array_equal(matlab["body_v"].ravel(), data["body.v"])
    info = {name: [str(cell[0][0]) for cell in matlab["info"][0, 0][name]] for name in ("variable", "name", "unit")}
    assert info["unit"][info["name"].index("body.v")] == "m/s"
    assert info["variable"][info["name"].index("body.v")] == "body_v"
    assert set(pt.load(tmp_path / "a.nc")) == {name for name in data if str(name).startswith("body.")}
    assert "body.v" in Page(tmp_path / "a.html").content["runs"][0]["curves"]
    assert "no signal body.w; did you mean body.v" in called(
        "convert", str(saved), str(tmp_path / "b.csv"), "--signals", "body.w", code=2
    )
    assert not (tmp_path / "b.csv").exists()
    assert "must end in .csv or .mat or .nc or .html" in called("convert", str(saved), str(tmp_path / "b.xyz"), code=2)


def test_names_that_matlab_does_not_allow_are_replaced(tmp_path: Path) -> None:
    names = ("φ", "info", "gear.φ", "gear_φ", "_x")
    data = xr.Dataset({name: ("time", [0.0, k]) for k, name in enumerate(names, 1)}, coords={"time": [0.0, 1.0]})
    data.to_netcdf(tmp_path / "a.nc")
    called("convert", str(tmp_path / "a.nc"), str(tmp_path / "a.mat"))
    matlab = loadmat(tmp_path / "a.mat", simplify_cells=True)
    variables = dict(zip(matlab["info"]["name"], matlab["info"]["variable"], strict=True))
    assert [matlab[variables[name]][1] for name in names] == [1, 2, 3, 4, 5]
    assert all(re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name) for name in variables.values())


@pytest.mark.slow
def test_runs_from_another_charge_are_viewed_and_compared(saved: Path, tmp_path: Path) -> None:
    """Both runs of a comparison start at the given charge; a saved run has started already."""
    page, start = tmp_path / "run.html", ("--start", "battery.soc=0.95")
    called("view", "ElectricCar", *SHORT, *start, "--out", str(page))
    assert Page(page).curve("battery.soc")[1][0] == pytest.approx(0.95)
    for runs in (("ElectricCar", "--set", "body.m=1600"), ("ElectricCar", "ElectricFourWheelDriveCar")):
        called("compare", *runs, *SHORT, *start, "--signals", "battery.soc", "--report", str(page))
        assert [Page(page).curve("battery.soc", k)[1][0] for k in (0, 1)] == pytest.approx([0.95, 0.95])
    for command in (("view", str(saved)), ("compare", str(saved), str(saved))):
        assert "--start need a vehicle" in called(*command, "--start", "body.v=1", code=2)


@pytest.mark.slow
def test_a_vehicle_that_stands_ends_its_command() -> None:
    """A run that reached its end without moving did not end there."""
    for command in ("view", "compare"):
        text = called(command, "ManualCar", *SHORT, "--set", "body.m=1e7", code=1)
        assert "it does not move" in text
        assert "the run ended" not in text


@pytest.mark.slow
@pytest.mark.parametrize("begin", [0.0, 10.0])
def test_ctrl_c_ends_every_drive_with_130(begin: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages and comparisons are those of whole runs; before the first step there is nothing to keep."""
    simulate = pt.Plant.simulate

    def interrupted(plant: Any, stop: float, *, progress: Callable[[pt.Present[Any]], None], **options: Any) -> Any:
        def watch(now: pt.Present[Any]) -> None:
            if now.time >= begin:
                os.kill(os.getpid(), signal.SIGINT)
            progress(now)

        monkeypatch.setattr("powertrain.engine.loop._throttled", lambda watch: watch)
        return simulate(plant, stop, progress=watch, **options)

    monkeypatch.setattr(pt.Plant, "simulate", interrupted)
    for command in ("view", "ManualCar"), ("compare", "ManualCar", "--set", "body.m=1500"):
        assert "interrupted" in called(*command, *SHORT, code=130)


@pytest.mark.slow
def test_a_vehicle_that_stands_has_no_performance() -> None:
    """Ten thousand tonnes: friction holds them, and a top speed of 1e-13 km/h is no result."""
    text = called("performance", "ManualCar", "--set", "body.m=1e7", code=1)
    assert "ManualCar does not move" in text
    assert "km/h" not in text


def test_an_unknown_variant_names_those_there_are() -> None:
    from powertrain.components import MappedEngine

    with pytest.raises(AttributeError, match=r"MappedEngine has no attribute 'petrol'.*from_csv, gasoline, diesel"):
        MappedEngine.petrol()  # type: ignore[attr-defined]
    text = called("run", "ManualCar", "--set", "engine=MappedEngine.petrol()", code=2)
    assert "no variant 'petrol'; choose from from_csv, gasoline, diesel" in text


def test_progress_has_few_digits(capsys: pytest.CaptureFixture[str]) -> None:
    from powertrain.present import Bar

    bar = Bar(0.0, 1800.0, lambda now: f"{now.time / 100:.1f} km")
    bar(SimpleNamespace(time=1234.56789012345))  # type: ignore[arg-type]
    bar.close()
    shown = capsys.readouterr().err
    assert "1235 of 1800 s" in shown
    assert "1234.5" not in shown
    assert "12.3 km]" in shown
