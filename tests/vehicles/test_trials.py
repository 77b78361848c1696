from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle, Wedge

import powertrain as pt
from powertrain.components.body import CoastDownBody, LumpedAxle, RollingAxle
from powertrain.components.control import SetPedals
from powertrain.components.cycles import DriveCycle
from powertrain.components.differentials import CrownGear
from powertrain.trials import (
    CycleRun,
    backward,
    charge_corrected,
    drive_cycle,
    driveline_map,
    electric_share,
    full_accelerator,
    gradeability,
    on_rolling_road,
    shifts,
)
from powertrain.trials.cycle import so_far
from powertrain.trials.figures import cycle_figure
from powertrain.trials.performance import Hill, performance, time_between
from powertrain.trials.sankey import plot_energy_flow
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar

WLTC = DriveCycle.named("wltc")


@pytest.fixture(scope="module")
def town() -> CycleRun:
    """The first hill of the WLTC and the halt after it."""
    return drive_cycle(SplitPathCar(), WLTC.part(0, 140))


@pytest.fixture(scope="module")
def start() -> pt.Result[Any]:
    """From rest with a full accelerator."""
    car = pt.replace(SplitPathCar(), driver=SetPedals(accelerator_set=1))
    return pt.simulate(car, 20, points=2000)


def test_car_stays_in_the_band_and_balances(town: CycleRun) -> None:
    assert town.message == ""
    assert town.time_outside == 0
    work = float(np.trapezoid(np.abs(town.result["engine.power"]), town.result.time))
    assert abs(town.audit.residual) < 1e-6 * work


def test_numbers_of_the_table_follow_from_signals(town: CycleRun) -> None:
    table = town.table["value"]
    distance = float(np.trapezoid(town.result["body.v"], town.result.time))
    assert table["distance"] == pytest.approx(distance / 1e3, rel=1e-3)  # trapezoidal rule at 10 Hz
    flow = float(np.trapezoid(town.result["engine.fuel_rate"], town.result.time))
    assert table["fuel"] == pytest.approx(flow, rel=1e-3)
    assert table["consumption"] == pytest.approx(table["fuel"] / 0.745 / table["distance"] * 100)
    assert table["carbon dioxide"] == pytest.approx(table["consumption"] * 0.745 * 3.17 * 10)


def test_demand_of_the_cycle_is_that_of_the_regulation(town: CycleRun) -> None:
    """UN GTR No. 15, Annex 7, 5: over steps of 1 s, road load and inertia with what turns with the wheels, where positive."""
    p, v = town.result.parameters, np.interp(np.arange(141), town.cycle.times, town.cycle.speeds)
    way, rotating = (v[1:] + v[:-1]) / 2, (p["front.wheels.J"] + p["rear.wheels.J"]) / p["front.wheels.radius"] ** 2
    air = p["body.Cd"] * p["body.A"] * p["body.rho"] / 2 * way**2
    force = p["front.wheels.Cr"] * p["body.m"] * p["body.g"] + air + (p["body.m"] + rotating) * np.diff(v)
    assert town.demand == pytest.approx(float(np.maximum(force, 0) @ way), rel=0.02)  # a driver rounds corners off


@pytest.mark.slow
def test_fuel_burnt_before_the_run_does_not_count() -> None:
    """With 1 kg from an earlier run the manual car consumed 99.6 instead of 8.1 l/100 km."""
    plant = pt.compile(pt.replace(ManualCar(), {"cycle.cycle": DriveCycle.named("udds").part(0, 60)}))
    fresh, later = (drive_cycle(plant, starts={"engine.fuel": fuel}) for fuel in (0.0, 1.0))
    assert fresh.fuel > 0.01
    assert later.fuel == pytest.approx(fresh.fuel, rel=1e-6)
    assert later.litres_per_100km == pytest.approx(fresh.litres_per_100km, rel=1e-6)
    say, path, density = so_far(plant), f"{fresh.anatomy.the('body')}.s", plant.parameters["engine.fuel_density"]
    say(cast("Any", {path: 500.0, "engine.fuel": 1.0}))
    text = say(cast("Any", {path: 1500.0, "engine.fuel": 1.0 + 0.06e-3 * density}))
    assert text == "1.0 km, 6.00 l/100 km"


@pytest.mark.slow
def test_a_cycle_too_fast_is_driven_as_far_as_it_goes() -> None:
    sprint = DriveCycle("sprint", ((0.0, 0.0), (10.0, 60.0), (12.0, 60.0)))
    run = drive_cycle(SplitPathCar(), sprint)
    assert run.message == ""
    assert run.time_outside > 5
    assert run.excess.min() < -20
    assert run.table.loc["largest deviation beyond the tolerance", "value"] == pytest.approx(run.excess.min() * 3.6)


@pytest.mark.slow
def test_a_run_that_ends_early_is_kept() -> None:
    weak = pt.replace(SplitPathCar(), {"transmission.cvu.ratio_max": 1.2})
    run = drive_cycle(weak, WLTC.part(0, 60))
    assert "speed ratio of the variable unit" in run.message
    assert run.result.time[-1] < 60
    assert run.time_outside > 60 - run.result.time[-1] - 1e-9


@pytest.mark.slow
def test_standing_has_no_consumption() -> None:
    run = drive_cycle(SplitPathCar(), WLTC.part(0, 8))
    assert run.time_outside == 0
    assert run.fuel > 0
    assert np.isnan(run.litres_per_100km)
    assert np.isnan(run.co2_per_km)


@pytest.mark.slow
def test_a_cycle_may_begin_at_any_time() -> None:
    late = DriveCycle("late", tuple((t + 30, v) for t, v in WLTC.part(0, 60).table))
    run = drive_cycle(SplitPathCar(), late)
    assert run.time_outside == 0
    assert run.result.time[[0, -1]].tolist() == [30, 90]
    assert run.distance == pytest.approx(late.distance, rel=5e-3)


def test_band_of_a_corner() -> None:
    """Speeds within a second, and 2 km/h more or less: before, at, and after the end of a ramp of 1 m/s2."""
    ramp = DriveCycle("ramp", ((5.0, 0.0), (8.0, 0.0), (18.0, 10.0), (30.0, 10.0)))
    run = CycleRun(ramp, None, None, {})  # type: ignore[arg-type]
    t, low, high = run.band
    assert t[[0, -1]].tolist() == [5, 30]
    for time, slowest, fastest in ((7.0, 0, 0), (7.5, 0, 0.5), (13.0, 4, 6), (17.5, 8.5, 10), (19.5, 10, 10)):
        k = int(np.argmin(np.abs(t - time)))
        assert (low[k], high[k]) == pytest.approx((slowest - 2 / 3.6, fastest + 2 / 3.6))


@pytest.mark.slow
def test_parameters_change_the_numbers_and_wrong_names_are_refused() -> None:
    plant = pt.compile(pt.replace(SplitPathCar(), cycle=pt.replace(SplitPathCar().cycle, cycle=WLTC.part(0, 60))))
    light = drive_cycle(plant, parameters={"body.m": 1000.0, "engine.fuel_density": 700.0})
    heavy = drive_cycle(plant, parameters={"body.m": 1600.0})
    assert light.fuel < heavy.fuel
    assert light.litres_per_100km == pytest.approx(light.fuel / 0.7 / light.distance * 1e5)
    with pytest.raises(pt.ParameterError, match=r"did you mean body"):
        drive_cycle(plant, parameters={"body.mas": 1000.0})
    with pytest.raises(pt.ParameterError, match=r"keeps its cycle"):
        drive_cycle(plant, "wltc")


def test_acceleration_time_against_newton(start: pt.Result[Any]) -> None:
    """Time = integral of dv/a over the speeds passed, from the accelerations that the model states."""
    t, v, a = start.time, start["body.v"], start["body.chassis.a"]
    low, high = 5.0, 20.0
    inside = (v >= low) & (v <= high)
    assert time_between(start, low, high) == pytest.approx(float(np.trapezoid(1 / a[inside], v[inside])), abs=0.03)
    assert np.isnan(time_between(start, low, 100.0))
    assert time_between(start, low, "72 km/h") == time_between(start, low, high)
    with pytest.raises(pt.ParameterError, match="km cannot be converted to m/s"):
        time_between(start, low, "100 km")
    assert t[-1] == 20


class Coasting(pt.Component):
    """A body that coasts."""

    body: CoastDownBody = CoastDownBody(m=1500, F_0=120, F_1=0, F_2=0.4)

    def equations(self) -> pt.Equations:
        yield from ()


def test_coast_down_times_against_the_arctangent() -> None:
    """The time from a to b is m/root(F_0 F_2) (arctan(a root(F_2/F_0)) - arctan(b root(F_2/F_0))), whatever the points of the run."""
    rate, share = 1500 / np.sqrt(120 * 0.4), np.sqrt(0.4 / 120)
    bend = (
        2 * 0.4 * 30 / 1500
    )  # |v''/v'| at most, 1/s: each of two interpolated times is off by an eighth of it times the step squared
    for points in 400, 4000:
        run = pt.simulate(Coasting(), 400.0, starts={"body.v": 30.0}, points=points, rtol=1e-9)
        for a, b in (30.0, 20.0), (25.0, 5.0), (30.0, 1.0):
            expected = rate * (np.arctan(a * share) - np.arctan(b * share))
            assert time_between(run, a, b) == pytest.approx(expected, abs=bend * (400 / points) ** 2 / 4 + 1e-5)
        stands = time_between(run, 30.0, 0.0)
        assert stands == pytest.approx(rate * np.arctan(30 * share), abs=400 / points)
        for a, b in (20.0, 25.0), (25.0, 30.0), (31.0, 10.0), (10.0, -1.0):
            assert np.isnan(time_between(run, a, b))
    coarse = pt.simulate(Coasting(), 400.0, starts={"body.v": 30.0}, points=4)
    assert 0 < time_between(coarse, 29.0, 28.0) < time_between(coarse, 29.0, 27.0)


@pytest.mark.slow
def test_steep_slopes_stop_the_car() -> None:
    """Full force in the lowest ratio is some 9 kN; the weight of 1,300 kg is 12.7 kN, of which a slope of 100 % asks 71 %."""
    hill = Hill.of(SplitPathCar())
    assert hill.climbed(0.5)
    assert not hill.climbed(1.0)


def test_a_hill_is_climbed_from_where_the_car_starts() -> None:
    hill = Hill.of(ElectricCar(), {"body.chassis.path": 1000.0})
    assert hill.climbed(0.3)
    assert not hill.climbed(0.9)


def test_a_slope_on_which_wheels_lift_off_is_named() -> None:
    """A short, tall car with a rear axle that pulls too hard, as a motorcycle in first gear."""
    rear = LumpedAxle(final_drive=CrownGear(ratio=8.0))
    car = pt.replace(ElectricCar(front=RollingAxle(), rear=rear), {"body.wheelbase": 1.4, "body.h": 0.8})
    with pytest.raises(pt.SimulationError, match=r"on a slope of 50 % with the accelerator .*load .*front"):
        gradeability(car)


@pytest.mark.slow
def test_gradeability_against_the_balance_of_forces() -> None:
    """sin(alpha) + Cr cos(alpha) = 310 N.m 2.5 3.6 0.97/(0.3 m m g): a car that accelerates by a mm/s2 moves off."""
    car = pt.replace(ElectricCar(), {"body.m": 1711.0})
    pull = 310 * 2.5 * 3.6 * 0.97 / 0.3 / (1711 * 9.80665)
    steepest = np.tan(np.arcsin(pull / np.hypot(1, 0.01)) - np.arctan(0.01))
    assert gradeability(car, 1e-3) == pytest.approx(steepest, abs=1e-3)


def test_energy_flow_shows_every_loss_in_scale(town: CycleRun) -> None:
    ax = plot_energy_flow(town)
    supplied = float(town.audit.components["sources"][""])
    shown = {text.get_text().split("\n")[0] for text in ax.texts}
    lost = town.audit.components["lost"]
    wanted = {n for n in lost.index if n and "." not in n and lost[n] > 2e-3 * supplied}
    assert shown == {"supplied", *wanted}
    places = {text.get_text().split("\n")[0]: text.get_position()[0] for text in ax.texts}
    along = [name for name in ("engine", "transmission", "front", "body", "rear") if name in places]
    assert sorted(along, key=lambda name: places[name]) == along
    widths = [w.width or 0.0 for w in ax.patches if isinstance(w, Wedge)]
    assert max(widths) == pytest.approx(float(lost["engine"]) / supplied)
    bands = [patch.get_xy()[:, 1].min() for patch in ax.patches if isinstance(patch, Polygon)]
    wedges = [patch for patch in ax.patches if isinstance(patch, Wedge)]
    ends = [patch.get_bbox() for patch in ax.patches if isinstance(patch, Rectangle)]
    # What is taken from the band turns down.
    for before, after, wedge, end in zip(bands, bands[1:], wedges, ends, strict=False):
        outer, width = wedge.center[1] + wedge.r, wedge.width or 0.0
        assert [outer - width, outer] == pytest.approx([before, after])
        assert [end.width, end.y1, end.x1] == pytest.approx([width, wedge.center[1], wedge.center[0] + wedge.r])


@pytest.mark.slow
def test_figures_and_pages_have_the_name_of_the_vehicle(town: CycleRun, tmp_path: Path) -> None:
    """It is that of its class unless the run has another."""
    named, title = replace(town, name="my car"), f"my car over {town.cycle.name}"
    assert town.title == f"SplitPathCar over {town.cycle.name}"
    assert plot_energy_flow(named, ax=Figure().add_subplot()).get_title().startswith(title)
    assert cycle_figure(named).get_suptitle().startswith(title)
    assert f"<title>{title}" in named.explore(tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_whole_wltc() -> None:
    run = drive_cycle(SplitPathCar(), "wltc")
    assert run.message == ""
    assert run.time_outside == 0
    assert run.distance == pytest.approx(WLTC.distance, rel=2e-3)
    work = float(np.trapezoid(np.abs(run.result["engine.power"]), run.result.time))
    assert abs(run.audit.residual) < 1e-6 * work
    assert 5.0 < run.litres_per_100km < 7.0


@pytest.mark.parametrize(("limit", "found", "unit"), [(0.3, 30, "%"), (0.998, 99.6, "%"), (5.0, 100, "% or more")])
def test_gradeability_beyond_the_steepest_slope(
    limit: float, found: float, unit: str, monkeypatch: pytest.MonkeyPatch, start: pt.Result[Any]
) -> None:
    """A vehicle that climbs every slope is told from one at the end of the bisection."""
    monkeypatch.setattr(Hill, "of", lambda vehicle, starts: SimpleNamespace(climbed=lambda grade: grade <= limit))
    table = performance(SplitPathCar(), start)
    assert list(table.loc["top speed"]) == [pytest.approx(start["body.v"].max() * 3.6), "km/h"]
    row = table.loc["gradeability"].to_dict()
    assert row["value"] == pytest.approx(found, abs=0.4)
    assert row["unit"] == unit


def test_what_is_not_a_vehicle_is_refused_with_what_to_write() -> None:
    with pytest.raises(pt.ParameterError, match=r"SplitPathCar'> is not a vehicle; write SplitPathCar\(\)"):
        drive_cycle(SplitPathCar, "wltc")  # type: ignore[arg-type]
    with pytest.raises(
        pt.ParameterError, match=r"'ManualCar' is not a vehicle; pt.vehicles.load\('ManualCar'\) makes one"
    ):
        performance("ManualCar")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def electric() -> CycleRun:
    """Ten seconds of an electric car, with a parameter in another unit."""
    given: Any = {"body.m": "1.5 t"}
    return drive_cycle(ElectricCar(), WLTC.part(0, 10), parameters=given, progress=True)


def test_parameters_of_a_run_are_numbers(electric: CycleRun) -> None:
    assert electric.parameters == {"body.m": 1500.0}


@pytest.mark.parametrize(
    ("trial", "said"),
    [
        (
            lambda run: full_accelerator(ElectricCar(), stop=30),
            "full_accelerator: stop cannot be given: the run ends at",
        ),
        (lambda run: gradeability(ElectricCar(), "steep"), "accuracy = 'steep' is not a number"),
        (lambda run: gradeability(ElectricCar(), 0), r"accuracy = 0 is outside its range \(0, 0.5\]"),
        (lambda run: driveline_map(ElectricCar(), "fast", [0.3]), "speeds = 'fast' is not a sequence of numbers"),
        (lambda run: driveline_map(ElectricCar(), [-5, 5], [0.3]), r"speeds = \[-5.0, 5.0\]: give speeds .* from 0 on"),
        (lambda run: driveline_map(ElectricCar(), [0], [0.3]), r"speeds = \[0.0\]: .* at least one of them above 0"),
        (
            lambda run: driveline_map(ElectricCar, [5], [0.3]),  # type: ignore[arg-type]
            r"is not a vehicle; write ElectricCar\(\)",
        ),
        (lambda run: on_rolling_road(run.plant), r"Plant\(ElectricCar: .* is not a vehicle"),
        (
            lambda run: time_between(run, 0, 10),
            r"time_between\(\) takes the result of a simulation, run.result of a drive",
        ),
        (
            shifts,
            r"shifts\(\) takes the result of a simulation, run.result of a drive cycle, not CycleRun",
        ),
        (lambda run: charge_corrected(run.result), r"charge_corrected\(\) takes a run of drive_cycle\(\), not Result"),
        (lambda run: charge_corrected(run, path=90), r"path = 90 is outside its range \(0, 1\]"),
        (lambda run: VariatorCar(w_least=1200), r"with w_least = 1200 rad/s, engine.w_limit = 680 rad/s"),
        (
            lambda run: driveline_map(ElectricCar(), [5], [0.3], held="charging"),  # type: ignore[arg-type]
            "held = 'charging': pass a dictionary",
        ),
        (
            lambda run: backward(ManualCar(), run.cycle, [1, 2]),  # type: ignore[arg-type]
            r"backward\(\) takes a map of driveline_map\(\), not \[1, 2\]",
        ),
        (
            lambda run: electric_share("run"),  # type: ignore[arg-type]
            r"electric_share\(\) takes a run of drive_cycle\(\), not 'run'",
        ),
    ],
)
def test_arguments_of_trials_that_are_refused(electric: CycleRun, trial: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        trial(electric)


def test_a_cycle_has_its_own_stop() -> None:
    with pytest.raises(pt.ParameterError, match=r"drive_cycle: stop is that of the cycle; DriveCycle.part"):
        drive_cycle(ElectricCar(), "udds", stop=300)
    with pytest.raises(pt.ParameterError, match=r"parameters = 5: pass a dictionary"):
        drive_cycle(ElectricCar(), "udds", parameters=5)  # type: ignore[arg-type]
