"""The page of a run: what it holds, against the run itself; what is refused; and what a browser shows."""

from __future__ import annotations

import importlib.util
import webbrowser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_off import MovingOff
from pages import Page, in_browser

import powertrain as pt
from powertrain.viewer.recording import ERROR

RUN = pt.simulate(MovingOff(), 3.0)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return RUN.explore(tmp_path_factory.mktemp("pages") / "run.html")


def test_every_signal_is_there_within_the_stated_error(path: Path) -> None:
    page = Page(path)
    for name in RUN:
        t, y = page.curve(name)
        exact = RUN[name]
        once = np.concatenate([[True], np.diff(RUN.time) > 0]) & np.concatenate([np.diff(RUN.time) > 0, [True]])
        drawn = np.interp(RUN.time[once], t, y)
        assert np.abs(drawn - exact[once]).max() <= (ERROR + 1e-6) * np.ptp(exact) + 1e-6 * np.abs(exact).max(), name


@pytest.mark.parametrize(
    ("layout", "port", "speed"), [("", "clutch.flange_b", "disc.w"), ("driveline", "shaft.flange_b", "car.w")]
)
def test_lines_carry_the_power_of_their_connection(path: Path, layout: str, port: str, speed: str) -> None:
    """Torque times speed by the signals of the run, for a line of the whole and for one inside the composite."""
    page = Page(path)
    full = f"{layout}.{port}" if layout else port
    lines = page.content["runs"][0]["layouts"][layout]["lines"]
    sign, names = next((sign, names) for _, sign, names, _ in lines if names == [f"power({full})"])
    t, y = page.curve(names[0])
    for at in (0.5, 1.0, 2.0):
        leaving = -RUN.at(at, f"{full}.tau") * RUN.at(at, speed)
        assert sign * np.interp(at, t, y) == pytest.approx(leaving, abs=float(ERROR * np.ptp(y)) + 1e-3)


def test_power_points_from_the_engine_to_the_car(path: Path) -> None:
    """While the clutch sticks, all power goes one way, whichever end of a connection was written first."""
    page = Page(path)
    layout = page.content["runs"][0]["layouts"][""]
    boxes = {title: x for title, _, x, *_ in layout["boxes"]}
    assert len(layout["lines"]) == 5
    for _, sign, names, points in layout["lines"]:
        t, y = page.curve(names[0])
        assert points[0][0] <= points[-1][0]
        assert (sign * np.interp(2.5, t, y) > 0) == (boxes["engine"] < boxes["car"]), names


def test_events_parameters_and_energies_are_those_of_the_run(path: Path) -> None:
    run = Page(path).content["runs"][0]
    assert [(t, name) for t, name, _ in run["events"]] == [(e.time, e.name) for e in RUN.events]
    assert {name: value for name, value, *_ in run["parameters"]} == RUN.parameters
    assert ["flywheel.J", 0.15, "kg.m2", "Moment of inertia"] in run["parameters"]
    table = pt.energy_audit(RUN).components
    assert {row[0]: row[3] for row in run["energy"]} == table["lost"].to_dict()


def test_page_needs_nothing_from_outside(path: Path) -> None:
    head = Page(path).text.split('<script type="text/plain"')[0]
    assert "src=" not in head
    assert "href=" not in head
    assert "@import" not in head


def test_chosen_signals_come_first(tmp_path: Path) -> None:
    assert Page(RUN.explore(tmp_path / "a.html", "car.w", "clutch.mode")).content["show"] == ["car.w", "clutch.mode"]


def test_what_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(pt.ParameterError, match=r"must end in \.html"):
        RUN.explore(tmp_path / "run.pdf")
    with pytest.raises(pt.ParameterError, match=r"run\.html cannot be written: there is no folder"):
        RUN.explore(tmp_path / "absent" / "run.html")
    with pytest.raises(pt.ParameterError, match=r"no signal car\.v.*car\.w"):
        RUN.explore(tmp_path / "run.html", "car.v")
    with pytest.raises(pt.ParameterError, match="record="):
        pt.simulate(MovingOff(), 0.1, record=["car.w"]).explore(tmp_path / "run.html")
    real = importlib.util.find_spec
    monkeypatch.setattr("powertrain.viewer.document.find_spec", lambda name: None if name == "plotly" else real(name))
    from powertrain.viewer import document

    document._library.cache_clear()
    with pytest.raises(pt.PowertrainError, match=r"pip install 'powertrain\[viewer\]'"):
        RUN.explore(tmp_path / "run.html")
    assert not list(tmp_path.iterdir())


def test_without_a_file_the_browser_opens(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    written = RUN.explore()
    assert opened == [written.as_uri()]
    assert written.name == "MovingOff.html"


def test_a_run_that_ended_early_says_why(tmp_path: Path) -> None:
    class Pole(pt.Component):
        x: pt.Variable = pt.variable("1", "x", start=1.0)
        y: pt.Variable = pt.variable("1", "y")

        def equations(self) -> pt.Equations:
            yield pt.der(self.x) == self.x**2
            yield self.y == 2 * self.x

    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Pole(), 2.0)
    run = Page(caught.value.result.explore(tmp_path / "a.html")).content["runs"][0]
    assert run["message"]
    assert run["layouts"] == {}
    assert run["span"][1] == pytest.approx(1.0, abs=1e-3)


def test_a_browser_shows_the_power_at_a_time(path: Path) -> None:
    """Widths and directions are those of torque times speed at 1.5 s, found by the name of the port."""
    actions = """
      const band = document.querySelector('[data-powers="power(clutch.flange_b)"]');
      return { width: Number(band.getAttribute("stroke-width")), clock: document.querySelector("#clock").textContent,
        widest: Math.max(...[...document.querySelectorAll(".drawing [data-powers]")].map(b => Number(b.getAttribute("stroke-width")))),
        label: [...document.querySelectorAll(".drawing .power")].map(x => x.textContent),
        charts: document.querySelectorAll(".js-plotly-plot").length, rows: document.querySelectorAll("#parameters tr").length };"""
    seen = in_browser(path, actions, "#t=1.5")
    power = -RUN.at(1.5, "clutch.flange_b.tau") * RUN.at(1.5, "disc.w")
    assert seen["clock"] == "1.500 s"
    assert min(abs(float(text.removesuffix(" kW")) - power / 1e3) for text in seen["label"]) < ERROR * 40 + 0.05
    most = max(abs(y).max() for y in (RUN["clutch.flange_a.tau"] * RUN["flywheel.w"], 120 * RUN["flywheel.w"]))
    assert seen["width"] == pytest.approx(24 * power / most, rel=0.1)
    assert seen["charts"] >= 2
    assert seen["rows"] == len(RUN.parameters) + 1


def test_a_browser_plays_scrubs_searches_and_looks_inside(path: Path) -> None:
    actions = """
      const clock = () => Number.parseFloat(document.querySelector("#clock").textContent), slider = document.querySelector("#slider");
      slider.value = 0.25; slider.dispatchEvent(new Event("input"));
      const scrubbed = clock();
      document.querySelector("#speed").value = "1"; document.querySelector("#play").click();
      for (let k = 0; k < 300 && clock() < 0.35; k++) await wait(100);
      document.querySelector("#play").click();
      const played = clock();
      const search = document.querySelector("#signals input"); search.value = "clutch mode"; search.dispatchEvent(new Event("input"));
      const listed = [...document.querySelectorAll("#signals .list label:not(:has(output))")].map(l => l.dataset.name);
      document.querySelector("#signals .list label[data-name='clutch.mode'] input").click();
      const traces = document.querySelector("#signals .chart").data.map(d => d.name);
      document.querySelector("[data-path='driveline']").dispatchEvent(new MouseEvent("dblclick"));
      const inside = [...document.querySelectorAll(".drawing .part")].map(p => p.dataset.path);
      const event = document.querySelector("#events tr[data-t]"); event.click();
      return { scrubbed, played, listed, traces, inside, event: Number(event.dataset.t), after: clock() };"""
    seen = in_browser(path, actions)
    assert seen["scrubbed"] == 0.25
    assert 0.25 < seen["played"] < 3.0
    assert "clutch.mode" in seen["listed"]
    assert all("clutch" in name and "mode" in name for name in seen["listed"])
    assert "clutch.mode" in seen["traces"]
    assert seen["inside"] == ["driveline.gear", "driveline.shaft"]
    assert seen["after"] == pytest.approx(seen["event"], abs=1e-3)


class Pump(pt.Component):
    """A part of a user with a map of its own."""

    w: pt.Variable = pt.variable("rad/s", "Speed", start=10.0)
    p: pt.Variable = pt.variable("Pa", "Pressure")
    k: pt.Parameter = pt.parameter("1", "Gain", default=2.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == -self.w
        yield self.p == self.k * self.w**2

    def operating_map(self) -> pt.OperatingMap:
        w, p = np.linspace(0, 12, 5), np.linspace(0, 600, 4)
        values = np.where(p[:, None] <= 500, float(self.k) * w + p[:, None], np.nan)
        return pt.OperatingMap(
            "Flow [l/min]", "w", "p", "Speed [rpm]", "Pressure [Pa]", w * 9.55, p, values, (0.0, 300.0), x_scale=9.55
        )


class Rig(pt.Component):
    pump: Pump = Pump()

    def equations(self) -> pt.Equations:
        yield from ()


def test_a_users_component_brings_its_map_with_the_runs_parameters(tmp_path: Path) -> None:
    run = pt.simulate(Rig(), 1.0, parameters={"pump.k": 3.0})
    (shown,) = Page(run.explore(tmp_path / "a.html")).content["runs"][0]["maps"]
    assert shown["x"][0] == "pump.w"
    assert shown["values"][0] == pytest.approx([3.0 * w for w in np.linspace(0, 12, 5)])
    assert shown["values"][3] == [None] * 5
    place: Any = in_browser(
        tmp_path / "a.html", 'return document.querySelector("#maps .js-plotly-plot").layout.shapes[0];', "#t=1"
    )
    assert place["xanchor"] == pytest.approx(9.55 * 10 * np.exp(-1), rel=3e-3)
    assert place["yanchor"] == pytest.approx(3 * 100 * np.exp(-2), rel=1e-2)


@pytest.mark.slow
def test_a_wltc_fits_into_five_megabytes(tmp_path: Path) -> None:
    from powertrain.trials import drive_cycle
    from powertrain.vehicles.manual_car import ManualCar

    run = drive_cycle(ManualCar())
    written = run.result.explore(tmp_path / "car.html", "body.v", "engine.w")
    assert written.stat().st_size < 5e6
    seen = in_browser(
        written, 'return [...document.querySelectorAll(".drawing .power")].map(x => x.textContent);', "#t=1560"
    )
    assert f"{run.result.at(1560.0, 'engine.power') / 1e3:.0f}" in "".join(seen)
