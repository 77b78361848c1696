"""Mapped engine: tables against the formulas they were computed from, files and their errors, fuel, cut-off, edges."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import few
from engine_rigs import Driven, Dyno, Loaded
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.engines import MappedEngine, best_fuel_line, pull_speeds, read_fuel_map
from powertrain.components.engines.synthetic import DIESEL, GASOLINE, SyntheticEngine, write_tables
from powertrain.components.rotational import ConstantSpeed

ENGINES = {"gasoline": (MappedEngine.gasoline(), GASOLINE), "diesel": (MappedEngine.diesel(), DIESEL)}
PAIRS = pytest.mark.parametrize(("engine", "formula"), list(ENGINES.values()), ids=list(ENGINES))
W, TAU, U = [0.0, 100.0, 200.0, 300.0], [10.0, 50.0, 110.0], [0.0, 0.5, 1.0]


def table(path: Path, head: str, *columns: NDArray[np.float64]) -> Path:
    text = "\n".join(",".join(f"{x:g}" for x in row) for row in np.column_stack(columns))
    path.write_text(f"{head}\n{text}\n", encoding="utf-8")
    return path


def written(folder: Path, *, speed: str = "rad/s", fuel: str = "g/s") -> tuple[Path, Path]:
    """torque = 120 u - 20, fuel rate = (torque + 20) w/(0.4 43e6): a Willans engine as tables."""
    factor = {"rad/s": 1.0, "rpm": 30 / np.pi}[speed]
    w, u = (x.ravel() for x in np.meshgrid(W, U, indexing="ij"))
    torque = table(folder / "torque.csv", f"speed [{speed}],throttle [1],torque [N.m]", w * factor, u, 120 * u - 20)
    w, tau = (x.ravel() for x in np.meshgrid(W, TAU, indexing="ij"))
    rate = (tau + 20) * w / 0.4 / 43e6
    specific = (tau + 20) / tau / 0.4 / 43e6
    values = {"g/s": 1e3 * rate, "kg/s": rate, "g/kWh": 3.6e9 * specific, "kg/J": specific}[fuel]
    factors = np.column_stack([w * factor, tau])
    rows = "\n".join(f"{a!r},{b!r},{c!r}" for (a, b), c in zip(factors.tolist(), values.tolist(), strict=True))
    path = folder / "fuel.csv"
    path.write_text(f"speed [{speed}],torque [N.m],fuel [{fuel}]\n{rows}\n", encoding="utf-8")
    return torque, path


@PAIRS
def test_shipped_tables_are_what_their_script_writes(
    engine: MappedEngine, formula: SyntheticEngine, tmp_path: Path
) -> None:
    write_tables(formula, tmp_path)
    shipped = files("powertrain.components").joinpath("engines", "data")
    for path in sorted(tmp_path.iterdir()):
        text = shipped.joinpath(path.name).read_text(encoding="utf-8")
        assert text == path.read_text(encoding="utf-8")
        assert text.startswith("# Synthetic")


@PAIRS
def test_tables_reproduce_their_formulas_between_the_points(engine: MappedEngine, formula: SyntheticEngine) -> None:
    w = np.linspace(80, 0.97 * max(formula.speeds), 57)
    assert np.abs(engine.full_load(w) / formula.full_load(w) - 1).max() < 5e-3
    assert np.abs(engine.motoring(w) / formula.motoring(w) - 1).max() < 1e-3
    tau = np.linspace(0, 1, 41)[:, None] * formula.full_load(w)
    flow = engine.fuel_flow(w, tau)
    assert np.abs(flow / formula.fuel_rate(w, tau) - 1).max() < 0.01


@PAIRS
def test_shipped_engines_are_plausible(engine: MappedEngine, formula: SyntheticEngine) -> None:
    w = np.linspace(80, float(engine.w_limit), 200)
    tau = np.linspace(0.05, 1, 80)[:, None] * engine.full_load(w)
    best = engine.bsfc(w, tau).min() * 3.6e9
    assert (240 < best < 270) if formula is GASOLINE else (195 < best < 215)
    idle = engine.fuel_flow(85.0, 0.0) / float(engine.fuel_density) * 3.6e6  # l/h
    assert 0.35 < idle < 0.8
    assert 80e3 < (w * engine.full_load(w)).max() < 100e3


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_throttle_gives_the_torque_of_the_table(method: str) -> None:
    engine = MappedEngine.gasoline(method=method, k_idle=0.0)
    for u in (0.0, 0.3, 1.0):
        result = pt.simulate(Dyno(engine=engine, drive=ConstantSpeed(w_fixed=250)), 0.1, inputs={"throttle": u})
        assert result["engine.tau"][-1] == pytest.approx(float(GASOLINE.torque(250, u)), rel=1e-4)


@pytest.mark.parametrize("fuel", few(["g/s", "kg/s", "g/kWh", "kg/J"]))
@pytest.mark.parametrize("speed", ["rad/s", "rpm"])
def test_units_of_the_file(tmp_path: Path, speed: str, fuel: str) -> None:
    """Fuel by hand at 200 rad/s, also below the lowest torque of the table, where the Willans line goes on."""
    engine = MappedEngine.from_csv(*written(tmp_path, speed=speed, fuel=fuel), k_idle=0.0)
    for u in (0.05, 0.1, 0.4, 0.8):
        result = pt.simulate(Dyno(engine=engine, drive=ConstantSpeed(w_fixed=150)), 10, inputs={"throttle": u})
        firing = 120 * u
        assert result["engine.tau"][-1] == pytest.approx(firing - 20, abs=1e-3)
        assert result["engine.fuel"][-1] == pytest.approx(10 * firing * 150 / 0.4 / 43e6, rel=1e-4)


def test_cut_off(tmp_path: Path) -> None:
    """No fuel in overrun; below the torque ``cut_off`` it fades, here with 1.2 N.m of 2 to 60 %."""
    engine = MappedEngine.from_csv(*written(tmp_path), k_idle=0.0)
    rig = Dyno(engine=engine, drive=ConstantSpeed(w_fixed=200))
    closed, little = (pt.simulate(rig, 1, inputs={"throttle": u}) for u in (0.0, 0.01))
    assert np.all(closed["engine.fuel_rate"] == 0)
    assert closed["engine.tau"][-1] == pytest.approx(-20)
    assert little["engine.fuel_rate"][-1] == pytest.approx(0.6 * 1.2 * 200 / 0.4 / 43e6, rel=1e-4)


def test_fuel_is_never_negative(tmp_path: Path) -> None:
    """A line through 12 and 52 g/s at 10 and 50 N.m says -8 g/s at -10 N.m: there it is none."""
    torque, _ = written(tmp_path)
    w, tau = (x.ravel() for x in np.meshgrid(W, TAU, indexing="ij"))
    fuel = table(tmp_path / "steep.csv", "speed [rad/s],torque [N.m],fuel [g/s]", w, tau, tau + 2)
    engine = MappedEngine.from_csv(torque, fuel)
    assert engine.fuel_flow(200.0, [-10, -2, 0, 30]) == pytest.approx([0, 0, 0.002, 0.032], abs=1e-12)


@pytest.mark.parametrize("unit", ["g/s", "g/kWh"])
def test_a_table_that_lets_the_engine_idle_without_fuel_is_refused(tmp_path: Path, unit: str) -> None:
    """A line through 5 and 45 g/s at 10 and 50 N.m and 1,910 rpm says -5 g/s at 0 N.m; the engine gave up to 5 N.m for nothing."""
    torque, _ = written(tmp_path)
    w, tau = (x.ravel() for x in np.meshgrid([100.0, 200.0], TAU, indexing="ij"))
    flow = np.where(w > 150, tau - 5, tau + 1)
    values = flow * 3.6e6 / (w * tau) if unit == "g/kWh" else flow
    fuel = table(tmp_path / "steep.csv", f"speed [rad/s],torque [N.m],fuel [{unit}]", w, tau, values)
    with pytest.raises(
        pt.ParameterError, match=r"steep.csv: the fuel table has .* at 50 N.m and 1910 rpm: .* idle without fuel"
    ):
        MappedEngine.from_csv(torque, fuel)


@pytest.mark.parametrize("unit", ["g/kWh", "g/s"])
@pytest.mark.parametrize("speed", ["rpm", "rad/s"])
def test_a_specific_consumption_is_held_beyond_its_table(tmp_path: Path, speed: str, unit: str) -> None:
    """300 rad/s and 110 N.m are the last points of the table; 1.5 times the speed, 1.2 times the torque, the same g/kWh.

    With the flow of the edge, three times the torque would come from the same fuel.
    """
    torque, fuel = written(tmp_path, speed=speed, fuel=unit)
    engine = MappedEngine.from_csv(torque, fuel)
    for tau in (10.0, 50.0, 110.0):
        assert engine.bsfc(450.0, tau) == pytest.approx(engine.bsfc(300.0, tau), rel=1e-9)
    assert engine.bsfc(200.0, 132.0) == pytest.approx(engine.bsfc(200.0, 110.0), rel=1e-9)
    assert engine.bsfc(450.0, 132.0) == pytest.approx(engine.bsfc(300.0, 110.0), rel=1e-9)
    assert engine.bsfc(450.0, 5.0) == pytest.approx(engine.bsfc(300.0, 5.0), rel=1e-9)  # on the Willans line


@pytest.mark.parametrize("unit", ["g/kWh", "g/s"])
def test_a_specific_consumption_is_held_below_its_speeds(unit: str) -> None:
    engine = MappedEngine.gasoline()
    speeds, torques = [100.0, 300.0], [10.0, 100.0]
    axes = pt.Axis("speed", "rad/s", speeds, "clip"), pt.Axis("torque", "N.m", torques, "clip")
    power = np.multiply.outer(speeds, torques)
    values = np.array([[400, 300], [350, 250]]) * (power / 3.6e6 if unit == "g/s" else 1)
    engine = pt.replace(engine, fuel_map=pt.Map(axes, values, unit, "fuel"))
    assert engine.bsfc(80.0, 100.0) * 3.6e9 == pytest.approx(300)
    assert engine.bsfc(450.0, 100.0) * 3.6e9 == pytest.approx(250)


def test_edges_hold_beyond_the_speeds() -> None:
    for engine, formula in ENGINES.values():
        top = max(formula.speeds)
        assert engine.motoring(top + 100) == engine.motoring(top)
        assert engine.full_load(top + 100) == engine.full_load(top)


@pytest.mark.parametrize("u", [0.0, 0.5, 1.0])
def test_a_torque_table_that_extrapolates_does_so_motored_and_at_full_load(u: float) -> None:
    """-20 to -30 N.m motored and 100 to 130 N.m at full load over 300 rad/s; at 600 rad/s -40 and 160 N.m, and the limiter is there."""
    axes = pt.Axis("speed", "rad/s", [0.0, 300.0], "linear"), pt.Axis("throttle", "1", [0.0, 1.0], "clip")
    torque_map = pt.Map(axes, [[-20, 100], [-30, 130]], "N.m", "torque")
    engine = MappedEngine(torque_map=torque_map, fuel_map=ENGINES["gasoline"][0].fuel_map, k_idle=0.0)
    assert engine.motoring(600.0) == pytest.approx(40)
    assert engine.full_load(600.0) == pytest.approx(160)
    assert engine.torque(600.0, u) == pytest.approx(-40 + 200 * u)
    held = pt.simulate(Dyno(engine=engine, drive=ConstantSpeed(w_fixed=600)), 1, inputs={"throttle": u})
    assert held["engine.firing"][-1] == pytest.approx(200 * u, abs=1e-9)
    assert held["engine.drag"][-1] == pytest.approx(40)


def test_idle_start_and_stop() -> None:
    for engine, _ in ENGINES.values():
        running = pt.simulate(Loaded(engine=engine), 20)
        assert running["engine.w"][-1] == pytest.approx(85, abs=1e-4)
        assert running["engine.fuel_rate"][-1] == pytest.approx(float(engine.fuel_flow(85.0, 0.0)), rel=1e-4)
        assert not any("outside" in name and count for name, count in running.statistics.items())
        stopped = pt.simulate(Loaded(engine=engine), 5, inputs={"on": 0.0}, starts={"engine.w": 90.0})
        assert stopped["engine.w"][-1] == 0
        assert stopped["engine.mode"][-1] == 0
        assert stopped["engine.fuel"][-1] == pytest.approx(0, abs=1e-18)  # round-off of the table


def test_outside_of_the_table_is_counted_or_refused(tmp_path: Path) -> None:
    """The tables end at 300 rad/s, and 100 N.m drive the engine beyond them."""
    torque, fuel = written(tmp_path)
    clipped = pt.simulate(Loaded(engine=MappedEngine.from_csv(torque, fuel)), 10, inputs={"load": -100.0})
    count, steps = clipped.statistics["outside torque: speed"], clipped.statistics["steps"]
    assert 0 < count < steps
    assert f"{count:.0f} of {steps:.0f} steps were outside the range of the model: torque: speed" in clipped.notes
    inside = pt.simulate(Loaded(engine=MappedEngine.from_csv(torque, fuel)), 1)
    assert not any("torque: speed" in note for note in inside.notes)
    assert clipped["engine.w"][-1] > 600
    refusing = MappedEngine.from_csv(torque, fuel, outside="error")
    with pytest.raises(pt.SimulationError, match=r"torque: speed.* 300 rad/s") as caught:
        pt.simulate(Loaded(engine=refusing), 10, inputs={"load": -100.0})
    assert caught.value.result["engine.w"][-1] == pytest.approx(300, rel=1e-6)


def test_the_limiter_keeps_the_engine_in_its_torque_table(tmp_path: Path) -> None:
    """100 N.m at 300 rad/s end the table; with the edge at a limiter of 680 rad/s the engine would give 67 kW instead of 30 kW."""
    engine = MappedEngine.from_csv(*written(tmp_path))
    run = pt.simulate(Loaded(engine=engine), 10, inputs={"throttle": 1.0})
    assert run["engine.w"].max() < 300
    assert best_fuel_line(engine).power[-1] == pytest.approx(100 * 290)  # where the limiter begins
    assert pull_speeds(engine, (3, 2)) == pytest.approx([0.98 * 290])
    cases: list[tuple[dict[str, Any], str]] = [({"w_limit": 310}, "310"), ({}, "680")]
    for given, said in cases:
        with pytest.raises(pt.ParameterError, match=rf"highest speed of the full load(.|\n)*w_limit = {said} rad/s"):
            MappedEngine(torque_map=engine.torque_map, fuel_map=engine.fuel_map, **given)
    with pytest.raises(pt.ParameterError, match=r"w_limit = 310 rad/s"):
        pt.simulate(Loaded(engine=engine), 1, parameters={"engine.w_limit": 310})


@pytest.mark.parametrize(("fuel", "outside"), [("g/kWh", "clip"), ("g/s", "error")])
def test_torques_below_the_fuel_table_are_counted(tmp_path: Path, fuel: str, outside: Any) -> None:
    """The table begins at 10 N.m: 100 N.m are inside, idle is below. Without fuel nothing is looked up."""
    engine = MappedEngine.from_csv(*written(tmp_path, fuel=fuel), k_idle=0.0, outside=outside)
    rig, below = Dyno(engine=engine, drive=ConstantSpeed(w_fixed=150)), "outside fuel: torque below the table"
    counts = [pt.simulate(rig, 1, inputs={"throttle": u}).statistics[below] for u in (0.0, 0.1, 0.2, 0.9)]
    assert [count > 0 for count in counts] == [False, True, True, False]
    assert counts[1] == pt.simulate(rig, 1, inputs={"throttle": 0.1}).statistics["steps"]


@pytest.mark.parametrize(
    ("head", "values", "said"),
    [
        (
            "speed [rad/s],pedal [deg],torque [N.m]",
            1.0,
            r"torque.csv: no column .* the throttle \(1, %\); .* 'pedal \[deg\]'",
        ),
        (
            "speed [rad/s],throttle [1],torque [kW]",
            1.0,
            r"torque.csv: no column .* the torque \(N.m, lbf.ft\); .* 'torque \[kW\]'",
        ),
        ("speed [km/h],throttle [1],torque [N.m]", 1.0, r"no column .* the speed \(rpm, .*'speed \[km/h\]'"),
        ("speed [rad/s],throttle [1],torque [N.m]", 100.0, r"throttles from 0 to 100; they must range from 0"),
        ("speed [rad/s],throttle [1],torque [N.m]", -1.0, r"gives 100 N.m with closed throttle at 0 rad/s; a motored"),
    ],
)
def test_torque_files_that_are_refused(tmp_path: Path, head: str, values: float, said: str) -> None:
    _, fuel = written(tmp_path)
    w, u = (x.ravel() for x in np.meshgrid(W, U, indexing="ij"))
    scale, torque = (values, 120 * u - 20) if values > 0 else (1.0, 100 - 120 * u)
    path = table(tmp_path / "torque.csv", head, w, u * scale, torque)
    with pytest.raises(pt.ParameterError, match=said):
        MappedEngine.from_csv(path, fuel)


@pytest.mark.parametrize(
    ("head", "tau", "sign", "said"),
    [
        (
            "speed [rad/s],torque [N.m],fuel [l/h]",
            TAU,
            1,
            r"fuel.csv: no column .* the fuel \(a flow in kg/s, .*'fuel \[l/h\]'",
        ),
        (
            "speed [rad/s],torque [N.m],fuel [g/s]",
            TAU,
            -1,
            r"fuel.csv: the fuel table has -\d+ g/s; the fuel flow must not be negative",
        ),
        (
            "speed [rad/s],torque [N.m],fuel [g/kWh]",
            [0, 50, 90],
            1,
            r"specific consumption at 0 N.m, where there is no",
        ),
        ("speed [rad/s],torque [N.m],fuel [g/s]", [50], 1, r"at least two points on every axis"),
    ],
)
def test_fuel_files_that_are_refused(tmp_path: Path, head: str, tau: list[float], sign: int, said: str) -> None:
    torque, _ = written(tmp_path)
    w, t = (x.ravel() for x in np.meshgrid(W, tau, indexing="ij"))
    path = table(tmp_path / "fuel.csv", head, w, t, sign * (t + 20))
    with pytest.raises(pt.ParameterError, match=said):
        MappedEngine.from_csv(torque, path)


def test_a_misspelt_option_is_named_before_the_files_are_read() -> None:
    with pytest.raises(pt.ParameterError, match=r"MappedEngine has no field fil; did you mean fill"):
        MappedEngine.from_csv("none.csv", "none.csv", fil=True)
    with pytest.raises(pt.ParameterError, match=r"MappedEngine.from_csv: fill = 'no' is not True or False"):
        MappedEngine.from_csv("none.csv", "none.csv", fill="no")  # type: ignore[arg-type]


@pytest.mark.parametrize("full", [-20.0, -40.0])
def test_full_load_must_be_above_the_motored_torque(tmp_path: Path, full: float) -> None:
    """Else no throttle belongs to a torque: 0/0, or more throttle for less torque."""
    _, fuel = written(tmp_path)
    path = tmp_path / "torque.csv"
    path.write_text(f"n [rad/s],full load [N.m],drag [N.m]\n0,90,-15\n300,{full},-20\n", encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=rf"torque.csv: .* {full:g} N.m at full load and -20 N.m .* 300 rad/s"):
        MappedEngine.from_csv(path, fuel)


@pytest.mark.parametrize(
    ("speeds", "torques", "said"),
    [
        ([0.0, 300.0], [10e3, 110e3], r"torques from 10000 to 110000 N.m, .* none above 100 N.m; check the unit"),
        ([1e3, 6e3], TAU, r"speeds from 1000 to 6000 rad/s, the torque table from 0 to 300 rad/s; check the unit"),
        ([-100.0, 300.0], TAU, r"the fuel table has a speed of -100 rad/s; speeds must not be negative"),
    ],
)
def test_fuel_table_beside_the_torque_table(
    tmp_path: Path, speeds: list[float], torques: list[float], said: str
) -> None:
    """kN.m for N.m and rpm for rad/s leave no common point; without this check, the edge of the table would hold everywhere."""
    torque, _ = written(tmp_path)
    w, tau = (x.ravel() for x in np.meshgrid(speeds, torques, indexing="ij"))
    path = table(tmp_path / "fuel.csv", "speed [rad/s],torque [N.m],fuel [g/kWh]", w, tau, 0 * w + 300)
    with pytest.raises(pt.ParameterError, match=said):
        pt.compile(MappedEngine.from_csv(torque, path))


def test_from_csv_fills_a_table_up_to_full_load(tmp_path: Path) -> None:
    """At 100 rad/s the flow rises by 1 g/s in 50 N.m, also beyond its last torque."""
    torque, _ = written(tmp_path)
    path = tmp_path / "own.csv"
    path.write_text(
        "speed [rad/s],torque [N.m],fuel [g/s]\n100,10,1\n100,60,2\n300,10,3\n300,110,9\n", encoding="utf-8"
    )
    with pytest.raises(pt.ParameterError, match=r"no value at .*; fill=True"):
        MappedEngine.from_csv(torque, path)
    engine = MappedEngine.from_csv(torque, path, fill=True)
    assert float(engine.fuel_map(100, 110)) == pytest.approx(3)
    assert float(engine.fuel_map(300, 60)) == pytest.approx(6)


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_measured_torques_that_are_almost_equal(tmp_path: Path, method: Any) -> None:
    """(tau + 20) w/(0.4 43e6) at 10 and 10.000001 N.m and so on; steps of that size down to -20 N.m took minutes."""
    torque, _ = written(tmp_path)
    w, tau = np.repeat([100.0, 150.0, 200.0, 300.0], 4), np.tile([10.0, 50, 80, 110], 4)
    tau = tau + np.repeat([0, 1e-6, 2e-6, 3e-6], 4)
    path = tmp_path / "scattered.csv"
    rows = "\n".join(
        f"{a!r},{b!r},{1e3 * (b + 20) * a / 0.4 / 43e6!r}" for a, b in zip(w.tolist(), tau.tolist(), strict=True)
    )
    path.write_text(f"speed [rad/s],torque [N.m],fuel [g/s]\n{rows}\n", encoding="utf-8")
    linear = MappedEngine.from_csv(torque, path, fill=True)
    engine = pt.replace(linear, fuel_map=read_fuel_map(path, fill=True, method=method))
    torques = np.linspace(-18, 110, 20)
    assert engine.fuel_flow(200.0, torques) == pytest.approx((torques + 20) * 200 / 0.4 / 43e6, rel=1e-5)


def test_tables_given_as_maps_are_checked_too() -> None:
    good = ENGINES["gasoline"][0]
    with pytest.raises(pt.ParameterError, match="MappedEngine: the torque table gives fuel rate"):
        pt.compile(MappedEngine(torque_map=good.fuel_map, fuel_map=good.fuel_map))


def test_formulas_of_another_engine(tmp_path: Path) -> None:
    """Tables of a size of one's own."""
    small = replace(GASOLINE, name="small", V=1e-3)
    write_tables(small, tmp_path)
    engine = MappedEngine.from_csv(tmp_path / "small_torque.csv", tmp_path / "small_fuel.csv")
    w = np.array([100.0, 300.0, 600.0])
    np.testing.assert_allclose(engine.full_load(w), ENGINES["gasoline"][0].full_load(w) / 1.6, rtol=1e-4)


def test_a_long_drive_is_cheap() -> None:
    """Half an hour of pulling and coasting without a single event."""
    rows = tuple((20.0 * k, -0.05 if k % 2 else 0.35) for k in range(91))
    result = pt.simulate(Driven(engine=ENGINES["gasoline"][0], rows=rows, d=0.1), 1800, starts={"engine.w": 85.0})
    assert not list(result.events)
    assert result.statistics["steps"] < 20_000


@pytest.mark.parametrize(
    ("unit", "value", "said"),
    [
        (
            "g/kWh",
            0.25,
            "0.25 g/kWh at 5730 rpm and 100 N.m: that fuel has 0.179 kW, but the engine gives 60 kW",
        ),  # kg/kWh
        ("g/s", 0.0, "0 g/s at 5730 rpm and 100 N.m: that fuel has 0 kW"),  # a hole filled with zeros
    ],
)
def test_fuel_with_less_energy_than_the_work_is_refused(unit: str, value: float, said: str) -> None:
    axes = [pt.Axis("w", "rad/s", (100.0, 600.0), "clip"), pt.Axis("tau", "N.m", (10.0, 100.0), "clip")]
    good = 250.0 if unit == "g/kWh" else 9.0
    fuel_map = pt.Map(axes, [[good, good], [good, value]], unit, "fuel")
    engine = MappedEngine(torque_map=MappedEngine.gasoline().torque_map, fuel_map=fuel_map)
    with pytest.raises(pt.ParameterError, match=f"{said}.*Check the unit of the fuel.*heating_value = 4.3e.07 J/kg"):
        pt.compile(Dyno(engine=engine, drive=ConstantSpeed(w_fixed=200.0)))
