"""Two runs side by side: numbers by hand, saved runs, plots, the page, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from moving_off import MovingOff
from pages import Page, in_browser

import powertrain as pt
from powertrain.components.blocks import Step
from powertrain.saved import Saved

PLANT = pt.compile(MovingOff())
SOFT = PLANT.simulate(3.0, parameters={"driveline.shaft.c": 4000})
STIFF = PLANT.simulate(2.5, parameters={"driveline.shaft.c": 16000}, points=1000)
BOTH = pt.compare(SOFT, STIFF, "car.w", "driveline.shaft.tau", names=("soft", "stiff"))


class Fall(pt.Component):
    """x = g t: everything is known."""

    g: pt.Parameter = pt.parameter("m/s2", "Slope", default=2.0)
    x: pt.Variable = pt.variable("m/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.g


def test_numbers_of_straight_lines() -> None:
    """Means over the common 2 s of 2 t and 3 t are 2 and 3; the largest difference is that at the end."""
    plant = pt.compile(Fall())
    both = pt.compare(plant.simulate(2.0), plant.simulate(4.0, parameters={"g": 3.0}))
    row = both.signals.loc["x"]
    assert [row["a"], row["b"], row["difference"], row["largest difference"]] == pytest.approx(
        [2.0, 3.0, 1.0, 2.0], rel=1e-9
    )
    assert str(row["unit"]) == "m/s"
    assert both.parameters.to_numpy().tolist() == [[2.0, 3.0, "m/s2"]]
    assert both.table is both.signals


def test_only_what_differs_is_listed() -> None:
    assert BOTH.parameters.index.tolist() == ["driveline.shaft.c"]
    assert BOTH.time[[0, -1]].tolist() == [0.0, 2.5]
    assert list(BOTH.signals.index) == ["car.w", "driveline.shaft.tau"]
    exact = np.abs(SOFT.at(BOTH.time, "car.w") - STIFF.at(BOTH.time, "car.w")).max()
    assert BOTH.signals["largest difference"]["car.w"] == pytest.approx(exact)
    lost = pt.energy_audit(STIFF).components["lost"]
    assert BOTH.energy["stiff"].to_dict() == pytest.approx(lost.to_dict())


def test_equal_runs_do_not_differ() -> None:
    both = pt.compare(SOFT, SOFT)
    assert both.parameters.empty
    assert not both.signals["largest difference"].any()
    assert "0 parameters differ" in repr(both)


def test_a_saved_run_is_linear_between_its_samples() -> None:
    """At an event there are two, of which the later one counts."""
    saved = Saved(xr.Dataset({"w": ("time", [0.0, 2.0, 10.0, 4.0])}, {"time": [0.0, 1.0, 1.0, 3.0]}))
    assert saved.at([0.0, 0.5, 1.0, 1.5, 3.0], ["w"])["w"].tolist() == [0.0, 1.0, 10.0, 8.5, 4.0]


@pytest.mark.slow
def test_a_saved_run_compares_like_the_run(tmp_path: Path) -> None:
    SOFT.save(tmp_path / "soft.nc")
    STIFF.save(tmp_path / "stiff.nc")
    saved = pt.compare(pt.load(tmp_path / "soft.nc"), pt.load(tmp_path / "stiff.nc"), "car.w", "clutch.mode")
    assert saved.parameters.index.tolist() == ["driveline.shaft.c"]
    assert saved.signals.a["car.w"] == pytest.approx(BOTH.signals.soft["car.w"], rel=1e-4)
    with pytest.raises(pt.ParameterError, match="no energy balance"):
        _ = saved.energy
    page = Page(saved.explore(tmp_path / "a.html", "car.w"))
    assert [run["name"] for run in page.content["runs"]] == ["a", "b"]
    assert page.content["runs"][0]["curves"]["clutch.mode"][4] == "friction"
    assert page.content["runs"][0]["layouts"] == {}


def test_a_saved_run_that_ends_with_a_step_ends_at_its_right_limit() -> None:
    run = pt.simulate(Step(startTime=1.0), stop=1.0, points=11)
    assert run.at(1.0, "y") == 1.0
    assert not pt.compare(run, run.to_xarray(), "y").signals["largest difference"].any()


def test_plots_are_overlaid() -> None:
    ax = BOTH.plot("car.w")
    assert [line.get_linestyle() for line in ax.lines] == ["-", "--"]
    np.testing.assert_array_equal(ax.lines[1].get_ydata(), STIFF["car.w"])
    assert "driveline.shaft.tau" in BOTH.plot().get_legend_handles_labels()[1][0]  # what differs most
    with pytest.raises(pt.ParameterError, match=r"one unit, not N\.m, rad/s"):
        BOTH.plot("car.w", "driveline.shaft.tau")


def test_what_is_refused() -> None:
    refused: list[tuple[list[Any], str]] = [
        ([SOFT, 3], "not a int"),
        ([SOFT, PLANT], "not a Plant"),
        ([SOFT, STIFF, "car.v"], r"no common signal car\.v.*car\.w"),
    ]
    for arguments, said in refused:
        with pytest.raises(pt.ParameterError, match=said):
            pt.compare(*arguments)
    with pytest.raises(pt.ParameterError, match="two different names"):
        pt.compare(SOFT, STIFF, names=("a", "a"))
    for attribute in "parameters", "events":
        with pytest.raises(pt.ParameterError, match="not a saved run: its attributes parameters and events"):
            pt.compare(SOFT, STIFF.to_xarray().assign_attrs({attribute: "[1]"}))
    with pytest.raises(pt.ParameterError, match="no common time"):
        pt.compare(SOFT, PLANT.simulate(5.0, start=4.0))


def test_a_browser_shows_both_runs(tmp_path: Path) -> None:
    actions = """
      const chart = document.querySelector("#signals .chart");
      const first = document.querySelector("#parameters tr:nth-child(2)");
      const choice = document.querySelector("#which select"); choice.value = 1; choice.dispatchEvent(new Event("change"));
      return { traces: chart.data.map(d => [d.name, d.line.dash]), differs: [first.className, ...[...first.cells].map(c => c.textContent)],
        results: [...document.querySelectorAll("#results tr:nth-child(2) td")].map(c => c.textContent),
        drawn: document.querySelectorAll(".drawing .part").length };"""
    seen = in_browser(BOTH.explore(tmp_path / "a.html", "car.w"), actions)
    assert seen["traces"] == [["car.w, soft", "solid"], ["car.w, stiff", "dash"]]
    assert seen["differs"][:4] == ["differs", "driveline.shaft.c", "4000", "16000"]
    assert seen["results"][0] == "mean of car.w"
    assert float(seen["results"][1]) == pytest.approx(BOTH.signals.soft["car.w"], rel=1e-3)
    assert seen["drawn"] == 7
