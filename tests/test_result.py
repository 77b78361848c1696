"""Results: signals by name, selector and pattern, events, other times, pandas, xarray, files, pickles, partial results."""

from __future__ import annotations

import errno
import gc
import importlib.util
import json
import pickle
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from small_models import CoupledClutches

import powertrain as pt
from powertrain import export
from powertrain.export import load
from powertrain.numerics.batch import TOGETHER
from powertrain.plant import Plant
from powertrain.result import Result
from powertrain.signals import BLOCK, fits_pattern, signals_of


class Shaft(pt.Connector):
    phi: pt.Variable = pt.variable("rad", "Angle")
    tau: pt.Variable = pt.flow("N.m", "Torque")


class Inertia(pt.Component):
    J: pt.Parameter = pt.parameter("kg.m2", "Moment of inertia", min=0)
    a: Shaft = pt.port(Shaft)
    b: Shaft = pt.port(Shaft)
    w: pt.Variable = pt.variable("rad/s", "Angular velocity")

    def equations(self) -> pt.Equations:
        yield self.a.phi == self.b.phi
        yield self.w == pt.der(self.a.phi)
        yield self.J * pt.der(self.w) == self.a.tau + self.b.tau


class Clutch(pt.Component):
    capacity: pt.Parameter = pt.parameter("N.m", "Torque it carries")
    a: Shaft = pt.port(Shaft)
    b: Shaft = pt.port(Shaft)
    w_rel: pt.Variable = pt.variable("rad/s", "Relative speed", prefer=True)
    tau: pt.Variable = pt.variable("N.m", "Torque")
    cube: pt.Variable = pt.variable("1", "Root of cube + cube**3 = w_rel")

    def equations(self) -> pt.Equations:
        yield self.w_rel == pt.der(self.b.phi - self.a.phi)
        yield self.b.tau == self.tau
        yield self.a.tau == -self.tau
        yield self.cube + self.cube**3 == self.w_rel
        yield pt.friction(self.w_rel, self.tau, -self.capacity, self.capacity)


class Drive(pt.Component):
    """Two inertias and a clutch that slips, then sticks."""

    scale: pt.Parameter = pt.parameter("1", "Size", default=1.0)
    flywheel: Inertia = Inertia(J=2)
    clutch: Clutch = Clutch(capacity=1)
    disc: Inertia = Inertia(J=2)
    wheels: tuple[Inertia, ...] = (Inertia(J=1), Inertia(J=1))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flywheel.b, self.clutch.a)
        yield pt.connect(self.clutch.b, self.disc.a)
        yield pt.connect(self.disc.b, *(wheel.a for wheel in self.wheels))
        yield self.flywheel.J == 2 * self.scale  # noqa: SIM300

    def initial(self) -> pt.Equations:
        yield self.flywheel.w == 3
        yield self.disc.w == 0


MEET = 4.0
"""3 - t/2 = t/4: the speeds meet and the clutch sticks."""


@pytest.fixture(scope="module")
def plant() -> Plant[Drive]:
    return pt.compile(Drive())


@pytest.fixture
def result(plant: Plant[Drive]) -> Result[Drive]:
    return plant.simulate(6, points=61)


def test_signals_by_name(result: Result[Drive]) -> None:
    t = result.time
    assert np.allclose(result["flywheel.w"], np.where(t < MEET, 3 - t / 2, 1), atol=1e-6)
    assert np.allclose(result["wheels[1].w"], np.where(t < MEET, t / 4, 1), atol=1e-6)
    assert result["time"] is result.time
    assert "clutch.tau" in result
    assert "clutch.taux" not in result
    assert list(result) == result.names()


def test_events_stand_twice_with_both_limits(result: Result[Drive]) -> None:
    assert result.time.size == 62 + 2
    (twice,) = np.flatnonzero(np.diff(result.time) == 0)
    assert result.time[twice] == pytest.approx(MEET, abs=1e-6)
    assert result["clutch.mode"][twice : twice + 2].tolist() == [-1, 0]
    assert result["clutch.tau"][twice : twice + 2] == pytest.approx([-1, 0], abs=1e-9)


def test_selectors(result: Result[Drive]) -> None:
    assert result[lambda m: m.flywheel.w] is result.signal(lambda m: m.flywheel.w) is result["flywheel.w"]
    assert np.array_equal(result[lambda m: m.wheels[0].a.tau], result["wheels[0].a.tau"])
    slip = result[lambda m: m.disc.w - m.flywheel.w]
    assert np.allclose(slip, result["clutch.w_rel"], atol=1e-12)
    assert result.label(lambda m: m.disc.w - m.flywheel.w) == "disc.w-flywheel.w"
    assert result.unit(lambda m: m.disc.w - m.flywheel.w) == "rad/s"
    assert result.unit(lambda m: 9.55 * m.disc.w) == ""
    power = result[lambda m: m.clutch.tau * m.clutch.w_rel]
    assert np.allclose(power, result["clutch.tau"] * result["clutch.w_rel"], atol=1e-12)
    assert np.allclose(result[lambda m: pt.der(m.disc.w)][0], 0.25)
    assert result[lambda m: pt.Symbol(2)].tolist() == [2] * result.time.size


def test_parameters_of_the_run(plant: Plant[Drive]) -> None:
    run = plant.simulate(1, parameters={"scale": 2.0})
    assert run.parameters["scale"] == 2
    assert set(run["scale"]) == {2.0}
    assert set(run[lambda m: m.clutch.capacity]) == {1.0}
    assert set(run[lambda m: m.flywheel.J]) == {4.0}
    assert run.description("scale") == "Size"
    assert run["flywheel.w"][-1] == pytest.approx(3 - 1 / 4)


def test_units_and_descriptions(result: Result[Drive]) -> None:
    assert result.units["clutch.tau"] == "N.m"
    assert result.unit("clutch.tau") == "N.m"
    assert result.description("disc.w") == result.description(lambda m: m.disc.w) == "Angular velocity"


def test_names_fit_patterns(result: Result[Drive]) -> None:
    assert result.names("wheels[0].*") == [
        "wheels[0].w", "wheels[0].a.phi", "wheels[0].a.tau", "wheels[0].b.phi", "wheels[0].b.tau"
    ]  # fmt: skip
    assert result.names("*.w_rel") == ["clutch.w_rel"]
    assert fits_pattern("a[1].x", "a[?].x")
    assert not fits_pattern("a1.x", "a[1].x")


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("flywheel.ww", "no signal flywheel.ww; did you mean flywheel.w"),
        ("clutch.mod", "did you mean clutch.mode"),
        ("der(flywheel.w)", r"no signal der\(flywheel.w\); a selector gives derivatives: lambda m: powertrain.der\("),
        (lambda m: m.flywheel.ww, "Inertia has no field ww; did you mean w"),
        (lambda m: m.gear, r"Drive has no field gear \(its fields: scale, flywheel, clutch, disc, wheels\)"),
        (lambda m: m.flywheel, "not a Inertia"),
        (3, "by its path or a selector"),
        (lambda m: pt.Symbol.sym("alien"), "alien is not a signal"),
    ],
)
def test_unknown_signals(result: Result[Drive], what: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        result[what]


def test_misspelt_selector_is_seen_by_type_checkers(result: Result[Drive]) -> None:
    with pytest.raises(pt.ParameterError):
        result[lambda m: m.flywheel.ww]  # type: ignore[attr-defined]
    with pytest.raises(pt.ParameterError):
        result.signal(lambda m: m.flywheel.ww)  # type: ignore[attr-defined]


def test_another_unit_is_a_string(result: Result[Drive]) -> None:
    with pytest.raises(pt.ParameterError, match="unit = None is not a string"):
        result.converted("flywheel.w", None)  # type: ignore[arg-type]


def test_pattern_without_signal(result: Result[Drive]) -> None:
    with pytest.raises(pt.ParameterError, match=r"no signal clatch\.\*"):
        result.to_dataframe("clatch.*")


def test_algebraic_unknowns_fulfil_their_equation(plant: Plant[Drive]) -> None:
    run = plant.simulate(6, points=1000, rtol=1e-3)
    cube, slip = run["clutch.cube"], run["clutch.w_rel"]
    assert plant.compiled.dae.z.numel()
    assert np.abs(cube + cube**3 - slip).max() < 1e-9
    assert run.at(1.2345, lambda m: m.clutch.cube + m.clutch.cube**3 - m.clutch.w_rel) == pytest.approx(0, abs=1e-9)


def test_values_at_any_time(result: Result[Drive]) -> None:
    assert result.at(1.234, "disc.w") == pytest.approx(1.234 / 4)
    assert isinstance(result.at(1.234, lambda m: m.disc.w), float)
    assert result.at([1, 2], "disc.w") == pytest.approx([1 / 4, 1 / 2])
    assert result.at(np.array([[2.0, 1.0]]), lambda m: 2 * m.disc.w) == pytest.approx(np.array([[1, 1 / 2]]))
    both = result.at(1.0, ["disc.w", "scale"])
    assert both == {"disc.w": pytest.approx(0.25), "scale": 1.0}
    assert result.at(result.events[0].time, "clutch.mode") == 0
    with pytest.raises(pt.ParameterError, match=r"t = 6.5 s lies outside the simulated span \[0, 6\] s"):
        result.at([1, 6.5], "disc.w")


def test_times_beyond_the_end_by_round_off_are_the_end(plant: Plant[Drive]) -> None:
    """3 * 0.1 is 0.30000000000000004."""
    result = plant.simulate("0.3 s", times=np.arange(4) * 0.1)
    assert result.time[-1] == result.trajectory.end == 0.3
    assert result.at(3 * 0.1, "disc.w") == result.at(0.3, "disc.w")
    with pytest.raises(pt.ParameterError, match=r"t = 0.300000001 s lies outside the simulated span \[0, 0.3\] s"):
        result.at(0.300000001, "disc.w")


def test_arrays_are_read_only_and_own_their_data(plant: Plant[Drive]) -> None:
    times = np.linspace(0, 1, 5)
    run = plant.simulate(1, times=times)
    for values in (run.time, run["disc.w"], run["clutch.tau"], run["scale"], run[lambda m: 2 * m.disc.w]):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1
    times[:] = 0
    assert run.time[-1] == 1
    table = run.to_dataframe()
    table.loc[:, :] = 5
    run.to_xarray()["disc.w"][0] = 5
    assert run["disc.w"][0] == 0


def test_evaluate_takes_symbols_of_the_model(plant: Plant[Drive], result: Result[Drive]) -> None:
    root = plant.compiled.source.model
    assert isinstance(root, Drive)
    values = result.evaluate([root.clutch.tau, root.disc.w * root.scale])
    assert values.shape == (result.time.size, 2)
    assert np.allclose(values[:, 0], result["clutch.tau"])


@pytest.mark.parametrize("n", [1, TOGETHER - 1, TOGETHER, TOGETHER + 1, 3 * TOGETHER + 7])
def test_any_number_of_samples(plant: Plant[Drive], n: int) -> None:
    run = plant.simulate(1, times=np.linspace(0, 1, n))
    assert np.allclose(run["wheels[0].b.phi"], run.time**2 / 8, atol=1e-6)
    assert np.allclose(run[lambda m: 2 * m.disc.w], 2 * run["disc.w"])


class Many(pt.Component):
    """More signals than one block has."""

    parts: tuple[Inertia, ...]

    def equations(self) -> pt.Equations:
        yield pt.connect(*(part.a for part in self.parts))


def test_signals_of_many_blocks() -> None:
    run = pt.simulate(Many(parts=tuple(Inertia(J=1) for _ in range(40))), stop=1, starts={"parts[0].w": 2.0}, points=2)
    assert len(run.names()) > 2 * BLOCK
    assert all(np.allclose(run[name], 2) for name in run.names("*.w"))
    assert np.allclose(run.to_dataframe("*.phi").iloc[-1], 2)


def test_record_keeps_what_is_named(plant: Plant[Drive]) -> None:
    run = plant.simulate(6, record=["disc.*", "clutch.mode"])
    full = plant.simulate(6)
    assert run.names() == [*full.names("disc.*"), "clutch.mode"]
    assert np.array_equal(run["disc.w"], full["disc.w"])
    assert run[lambda m: m.disc.a.tau] is run["disc.a.tau"]
    assert run.parameters == full.parameters
    assert run.events == full.events
    assert run.statistics == full.statistics
    assert list(run.to_dataframe().columns) == run.names()
    assert "flywheel.w" not in run
    with pytest.raises(pt.ParameterError, match=r"flywheel.w was not recorded: record=... kept disc.w, "):
        run["flywheel.w"]
    with pytest.raises(pt.ParameterError, match="was not recorded"):
        run[lambda m: m.disc.w - m.flywheel.w]
    with pytest.raises(pt.ParameterError, match="was not recorded"):
        run.to_xarray("flywheel.w")
    with pytest.raises(pt.ParameterError, match="only samples of the named signals"):
        run.at(1, "disc.w")
    with pytest.raises(pt.ParameterError, match=r"no signal dics\.\*"):
        plant.simulate(1, record=["dics.*"])


def test_events_read_as_a_table(result: Result[Drive]) -> None:
    assert [(e.name, e.kind, e.old, e.new) for e in result.events] == [("clutch.mode", "friction", -1, 0)]
    head, row = str(result.events).splitlines()
    assert head.split() == ["time", "[s]", "name", "change"]
    assert row.endswith("clutch.mode  backward -> stuck")
    assert result.events["clutch"] == result.events["cl*"] == result.events[:]
    assert len(result.events[1:]) == 0
    assert str(result.events[1:]) == "no events"
    assert result.events.names == ["clutch.mode"]
    assert result.events.times == pytest.approx([MEET], abs=1e-6)
    table = result.events.to_dataframe()
    assert list(table.columns) == ["time", "name", "kind", "old", "new", "change"]
    assert table["change"].tolist() == ["backward -> stuck"]
    with pytest.raises(pt.ParameterError, match=r"did you mean clutch\.mode"):
        result.events["clutch.mod"]


def test_dataframe(result: Result[Drive]) -> None:
    table = result.to_dataframe("clutch.*", "disc.w")
    assert list(table.columns) == [n for n in result.names() if n.startswith("clutch.") or n == "disc.w"]
    assert table.index.name == "time"
    assert np.array_equal(table["disc.w"].to_numpy(), result["disc.w"])
    assert table.attrs["units"]["disc.w"] == "rad/s"


def test_xarray(result: Result[Drive]) -> None:
    data = result.to_xarray()
    assert set(data.data_vars) == set(result.names())
    assert data["time"].attrs == {"units": "s", "long_name": "Time"}
    assert data["disc.w"].attrs == {"units": "rad/s", "long_name": "Angular velocity"}
    assert np.array_equal(data["disc.w"], result["disc.w"])
    mode = data["clutch.mode"]
    assert mode.dtype == np.int8
    assert dict(zip(mode.attrs["flag_values"], mode.attrs["flag_meanings"].split(), strict=True))[0] == "stuck"
    assert data.attrs["model"] == "Drive"
    assert data.attrs["powertrain_version"] == pt.__version__
    assert json.loads(data.attrs["parameters"]) == result.parameters
    assert json.loads(data.attrs["events"])[0][1:] == ["clutch.mode", "backward -> stuck"]


@pytest.mark.skipif(importlib.util.find_spec("netCDF4") is None, reason="needs netCDF4")
def test_files(result: Result[Drive], tmp_path: Path) -> None:
    result.save(tmp_path / "run.nc")
    assert load(tmp_path / "run.nc").identical(result.to_xarray())
    result.save(tmp_path / "few.nc", "disc.*")
    assert set(load(tmp_path / "few.nc").data_vars) == set(result.names("disc.*"))


def test_files_without_their_library(result: Result[Drive], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("powertrain.export.find_spec", lambda name: None)
    for act in (lambda: result.save("never.nc"), lambda: load("never.nc")):
        with pytest.raises(pt.PowertrainError, match=r"pip install 'powertrain\[netcdf\]'"):
            act()
    assert not Path("never.nc").exists()


def test_the_ending_of_a_file_says_its_format(result: Result[Drive], tmp_path: Path) -> None:
    result.save(tmp_path / "run.CSV", "disc.w")
    text = (tmp_path / "run.CSV").read_text().splitlines()
    assert text[0] == "time,disc.w"
    assert len(text) == 1 + len(result.time)
    with pytest.raises(pt.ParameterError, match=r"pandas\.read_csv"):
        load(tmp_path / "run.CSV")
    for name in "run.xlsx", "run.parquet", "run":
        for act, said in ((result.save, r"must end in \.nc or \.csv"), (load, r"load reads the netCDF files \(\.nc\)")):
            with pytest.raises(pt.ParameterError, match=said):
                act(str(tmp_path / name))
    assert [path.name for path in tmp_path.iterdir()] == ["run.CSV"]


@pytest.mark.parametrize("name", ["run.csv", "run.nc"])
def test_files_that_cannot_be_written_are_named(result: Result[Drive], tmp_path: Path, name: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"{name} cannot be written: there is no folder {tmp_path}/absent"):
        result.save(tmp_path / "absent" / name)
    (tmp_path / name).mkdir()
    with pytest.raises(pt.ParameterError, match=f"{name} cannot be written"):
        result.save(tmp_path / name)


def test_a_folder_that_cannot_be_entered_is_named(
    result: Result[Drive], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bool:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "is_dir", refuse)
    with pytest.raises(pt.ParameterError, match=r"run\.csv cannot be written: Permission denied"):
        result.save(tmp_path / "run.csv")


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "text.nc").write_text("no netCDF")
    for name in "text.nc", "none.nc":
        with pytest.raises(pt.ParameterError, match=f"{name} cannot be read"):
            load(tmp_path / name)
    with pytest.raises(pt.ParameterError, match="path = 3 is not the path of a file"):
        load(3)  # type: ignore[arg-type]


class Clock(pt.Component):
    time: pt.Variable = pt.variable("s", "Its time", start=0.0)
    φ: pt.Variable = pt.variable("rad", "Its hand")

    def equations(self) -> pt.Equations:
        yield pt.der(self.time) == 1.0
        yield self.φ == 2.0 * self.time


def test_a_variable_called_time(tmp_path: Path) -> None:
    run = pt.simulate(Clock(), 1.0)
    assert run["time"][-1] == pytest.approx(1.0)
    for act in run.to_xarray, run.to_dataframe, run.netcdf:
        with pytest.raises(pt.ParameterError, match="a variable called time"):
            act()
    run.save(tmp_path / "clock.nc", "φ")
    assert float(load(tmp_path / "clock.nc")["φ"][-1]) == pytest.approx(2.0)
    (tmp_path / "classic.nc").write_bytes(run.netcdf("φ"))
    assert load(tmp_path / "classic.nc").identical(run.to_xarray("φ"))


def test_names_that_netcdf_does_not_allow() -> None:
    column = {"φ" * 129: (np.zeros(1), "rad", "")}
    with pytest.raises(pt.ParameterError, match="names of 256 bytes"):
        export.classic(np.zeros(1), column, {}, {})
    with pytest.raises(pt.ParameterError, match="names of 256 bytes"):
        export.save(export.dataset(np.zeros(1), column, {}, {}), "never.nc")


def test_pickled_result(result: Result[Drive]) -> None:
    tau = result["clutch.tau"]
    again: Result[Drive] = pickle.loads(pickle.dumps(result))
    assert again.model == Drive()
    assert np.array_equal(again["clutch.tau"], tau)
    assert np.array_equal(again.time, result.time)
    assert np.allclose(again[lambda m: m.disc.w - m.flywheel.w], result["clutch.w_rel"], atol=1e-12)
    assert set(again[lambda m: m.flywheel.J]) == {2.0}
    assert again.at(1.0, "disc.w") == pytest.approx(0.25)
    assert again.events == result.events
    assert str(again.report) == str(result.report)
    assert repr(again) == repr(result)
    assert again.to_xarray().identical(result.to_xarray())
    assert pt.energy_audit(again).closure == pt.energy_audit(result).closure
    assert np.array_equal(pickle.loads(pickle.dumps(again))["clutch.tau"], tau)


def test_pickled_record(plant: Plant[Drive]) -> None:
    run = plant.simulate(6, record="disc.*")
    again: Result[Drive] = pickle.loads(pickle.dumps(run))
    assert np.array_equal(again["disc.w"], run["disc.w"])
    assert again.names() == run.names()
    assert again.events == run.events


def test_threads_have_their_own_functions(plant: Plant[Drive]) -> None:
    runs = [plant.simulate(6, points=3000) for _ in range(4)]
    expected = plant.simulate(6, points=3000)["disc.a.tau"]
    found: list[bool] = []

    def read(run: Result[Drive]) -> None:
        for _ in range(20):
            other: Result[Drive] = Result(
                plant.compiled, run.trajectory, np.linspace(0, 6, 3001), plant.parameter_vector(), run.report
            )
            found.append(bool(np.array_equal(other["disc.a.tau"], expected)))

    threads = [threading.Thread(target=read, args=(run,)) for run in runs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [True] * 80


def test_signals_are_shared_by_runs_and_leave_with_the_model() -> None:
    plant = pt.compile(Drive())
    first, second = plant.simulate(1), plant.simulate(1)
    assert signals_of(first.compiled) is signals_of(second.compiled)
    gone = weakref.ref(plant.compiled)
    del plant, first, second
    gc.collect()
    assert gone() is None


class Runaway(pt.Component):
    """Its speed must not pass 2."""

    w: pt.Variable = pt.variable("rad/s", "Speed")

    def equations(self) -> pt.Equations:
        pt.within(self.w, -1, 2, name="w", unit="rad/s")
        yield pt.der(self.w) == 1


def test_partial_result() -> None:
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Runaway(), stop=10, points=10)
    reached: Result[Runaway] = caught.value.result
    assert not reached.ok
    assert reached.message == str(caught.value)
    assert reached.time[-1] == pytest.approx(2)
    assert reached["w"][-1] == pytest.approx(2)
    assert "ended early" in repr(reached)
    assert "Ended early" in reached._repr_html_()
    assert "leaves its range" in reached.to_xarray().attrs["message"]


def test_complete_result_is_ok(result: Result[Drive]) -> None:
    assert result.ok
    assert result.message == ""
    assert result.statistics["steps"] > 0
    assert repr(result).startswith("Result(Drive: 0 .. 6 s, 64 samples, ")
    assert "flywheel" in str(result.report)


def test_notebook(result: Result[Drive]) -> None:
    text = result._repr_html_()
    assert [cell in text for cell in (">disc.w</td>", ">rad/s</td>", ">Angular velocity</td>")] == [True] * 3
    assert ">backward -&gt; stuck</td>" in text
    assert result._ipython_key_completions_() == result.names()


def test_result_costs_nothing_before_it_is_asked(plant: Plant[Drive]) -> None:
    """The constructor does not touch the trajectory."""
    untouched: Any = SimpleNamespace()
    Result(plant.compiled, untouched, [0, 1], plant.parameter_vector(), None)


def test_reading_signals_imports_nothing_heavy() -> None:
    program = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "import test_result as t, powertrain as pt\n"
        "r = pt.simulate(t.Drive(), stop=1); r['disc.a.tau']; repr(r); repr(r.events); r._repr_html_()\n"
    )
    program += "print(*(n for n in ('xarray', 'pandas', 'matplotlib', 'netCDF4') if n in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


def test_expressions_may_use_casadi(result: Result[Drive]) -> None:
    assert np.allclose(result[lambda m: ca.sin(m.disc.w)], np.sin(result["disc.w"]))


def test_times_in_no_order_give_what_each_gives_alone() -> None:
    """States and held values of the run, also where a time is asked for twice."""
    trajectory = pt.simulate(CoupledClutches(), stop=1.2).trajectory
    asked = np.array([1.1, 0.2, 0.75, 0.2, 0.0, 0.5])
    times, x, z, held = trajectory.at(asked, with_events=False)
    np.testing.assert_array_equal(times, asked)
    assert len(np.unique(held, axis=0)) > 2
    for k, t in enumerate(asked):
        alone = trajectory.at([t], with_events=False)
        for values, value in zip((x, z, held), alone[1:], strict=True):
            np.testing.assert_array_equal(values[k], value[0])


class Pair(pt.Component):
    """Two unknowns that stay implicit; what each does to the equation of the other differs."""

    x: pt.Variable = pt.variable("1", "State", start=0.6)
    u: pt.Variable = pt.variable("1", "Implicit unknown")
    v: pt.Variable = pt.variable("1", "Other implicit unknown")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.x
        yield self.u + ca.tanh(3 * self.v + self.u) == self.x
        yield self.v - 0.2 * ca.tanh(self.u - self.v) == 0.5 * self.x


def test_algebraic_unknowns_are_corrected_by_newtons_method() -> None:
    """From 1e-2 off to round-off, which takes the right slopes."""
    result = pt.simulate(Pair(), 1.0)
    samples = result.samples_at([0.2, 0.7])
    assert samples.z.shape == (2, 2)
    found = signals_of(result.compiled).corrected(samples._replace(z=samples.z + 1e-2), result.p).z
    np.testing.assert_allclose(found, samples.z, rtol=1e-13)
