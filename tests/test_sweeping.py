"""Many runs of one plant: the same results in turn, in threads and in processes; nothing that was computed is lost."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import spin_down
import xarray as xr
from spin_down import STARTS, SpinDown, last_speed

import powertrain as pt
from powertrain.analysis import cases as worker
from powertrain.components.rotational import Damper, Inertia


class Shaped(pt.Component):
    """A part with a user's function in a structural field."""

    inertia: Inertia = Inertia(J=2.0)
    shape: Callable[[pt.Symbol], pt.Symbol] = abs
    shaped: pt.Variable = pt.variable("rad/s", "Speed through the function")

    def equations(self) -> pt.Equations:
        yield self.shaped == self.shape(self.inertia.w)


class Whole(pt.Component):
    part: Shaped = Shaped()

    def equations(self) -> pt.Equations:
        yield self.part.inertia.J == 3.0


def sweep(count: int = 3, **options: Any) -> Any:
    common: dict[str, Any] = {"stop": 1.0, "starts": STARTS}
    return pt.sweep(SpinDown(), spin_down.cases(count), **{**common, **options})


@pytest.fixture
def processes() -> Iterator[Executor]:
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        yield executor


class Counting(ThreadPoolExecutor):
    """Threads that count what is submitted and what is cancelled."""

    def __init__(self) -> None:
        super().__init__(1)
        self.futures: list[Future[Any]] = []

    def submit(self, *arguments: Any, **named: Any) -> Future[Any]:
        self.futures.append(super().submit(*arguments, **named))
        return self.futures[-1]


def test_cases_in_turn_in_threads_and_in_processes(processes: Executor) -> None:
    alone = [last_speed(run) for run in sweep(12)]
    np.testing.assert_allclose(alone, spin_down.exact(12), rtol=1e-5)
    with ThreadPoolExecutor(2) as threads:
        assert [last_speed(run) for run in sweep(12, executor=threads)] == alone
    assert [last_speed(run) for run in sweep(12, executor=processes)] == alone


def test_a_run_of_another_process_can_be_audited(processes: Executor) -> None:
    (run,) = sweep(1, executor=processes)
    assert pt.energy_audit(run).closure < 1e-6
    assert run[lambda m: 2 * m.inertia.w][-1] == 2 * last_speed(run)
    assert pt.linearize(SpinDown(), inputs=["inertia.flange_a.tau"], at=(run, 0.5)).A.shape == (2, 2)


class Weighing(Counting):
    """Threads that weigh what is sent to them."""

    sent = 0

    def submit(self, *arguments: Any, **named: Any) -> Future[Any]:
        self.sent += sum(len(a) for a in arguments if isinstance(a, bytes))
        return super().submit(*arguments, **named)


@pytest.mark.slow
def test_little_is_sent_for_a_case() -> None:
    """A scheduler keeps a thousand of its last messages."""
    with Weighing() as threads:
        sweep(4000, executor=threads, points=2, scalars={"w": last_speed})
        portions = len(threads.futures)
    assert threads.sent < 30 * 4000 + 500 * portions


def test_a_case_that_cannot_be_sent() -> None:
    cases: list[Any] = [{"parameters": {"inertia.J": 1.0}}, {"starts": {"inertia.w": (number for number in [1.0])}}]
    with ThreadPoolExecutor(1) as threads, pytest.raises(pt.ParameterError, match=r"case 1: .* cannot be sent"):
        pt.sweep(SpinDown(), cases, stop=1.0, executor=threads)


def test_a_worker_that_compiles_other_equations_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    worker._plant_of.cache_clear()
    monkeypatch.setattr(worker, "model_identity", lambda _: "another")
    with ThreadPoolExecutor(1) as threads, pytest.raises(pt.ModelError, match="a different version of powertrain"):
        sweep(executor=threads)


def test_a_failed_case_raises_or_is_kept() -> None:
    cases = [{"parameters": {"inertia.J": -1.0}}, {}]
    with pytest.raises(pt.ParameterError, match=r"inertia\.J = -1 kg\.m2") as raised:
        pt.sweep(SpinDown(), cases, stop=1.0)
    assert raised.value.__notes__ == ["case 0: {'parameters': {'inertia.J': -1.0}}"]
    failed, good = pt.sweep(SpinDown(), cases, stop=1.0, on_error="keep")
    assert isinstance(failed, pt.ParameterError)
    assert isinstance(good, pt.Result)


def test_an_error_has_the_cases_before_it_as_its_sweep() -> None:
    with pytest.raises(pt.SimulationError) as raised:
        sweep(9, scalars={"w": spin_down.broken_above_three})
    before = raised.value.sweep
    assert repr(before) == "Sweep(9 cases, 1 failed, 2 not run)"
    assert before.table["w"].notna().sum() == 6
    assert "not run" in str(before[8])


def test_an_error_cancels_what_has_not_begun() -> None:
    executor = Counting()
    with executor, pytest.raises(pt.ParameterError):
        pt.sweep(SpinDown(), [{"parameters": {"inertia.J": -1.0}}, *[{}] * 99], stop=1.0, executor=executor)
    assert len(executor.futures) < 10


def test_what_a_users_function_raises_is_an_error_of_its_case(processes: Executor) -> None:
    for executor in (None, processes):
        runs = sweep(4, scalars={"w": spin_down.broken_above_three}, on_error="keep", executor=executor)
        assert list(runs.errors) == [3]
        assert "'w' failed: ZeroDivisionError" in str(runs.errors[3])
        assert "broken_above_three" in runs.errors[3].__notes__[0]
        np.testing.assert_array_equal(runs.table["w"], [1.0, 1.0, 1.0, np.nan])


def test_parameters_with_units_are_numbers_in_the_table() -> None:
    """2000 g.m2 are 2 kg.m2; a text that is no such quantity is the error of its case."""
    values = ["2000 g.m2", 4.0, "4 kg.m2", "2 s"]
    cases = [{"parameters": {"inertia.J": J}} for J in values]
    runs = pt.sweep(SpinDown(), cases, stop=1.0, starts=STARTS, scalars={"w": last_speed}, on_error="keep")
    assert runs.table["inertia.J"].tolist() == [2.0, 4.0, 4.0, "2 s"]
    assert runs.table["w"][1] == runs.table["w"][2] != runs.table["w"][0]
    assert list(runs.errors) == [3]
    assert "different quantity" in str(runs.errors[3])


def test_starts_with_units_are_numbers_in_the_table() -> None:
    """60 rpm are 2 pi rad/s; a text that is no such quantity is the error of its case."""
    cases = [{"starts": {"inertia.w": w}} for w in ("60 rpm", 10.0, "2 kg")]
    runs = pt.sweep(SpinDown(), cases, stop=1.0, scalars={"w": last_speed}, on_error="keep")
    assert runs.table["starts.inertia.w"].tolist() == [pytest.approx(2 * np.pi), 10.0, "2 kg"]
    assert "different quantity" in str(runs.errors[2])


def test_common_parameters_and_starts_count_beside_those_of_a_case() -> None:
    """w = w0 exp(-d t/J) with the damping of all cases and the inertia of each, and the other way round; what a case gives goes first."""
    common: dict[str, Any] = {
        "parameters": {"damper.d": 2.0},
        "starts": STARTS,
        "stop": 1.0,
        "scalars": {"w": last_speed},
    }
    cases: list[dict[str, Any]] = [
        {"parameters": {"inertia.J": 4.0}},
        {"parameters": {"damper.d": 1.0}},
        {"starts": {"inertia.phi": 1.0}},
    ]
    runs = pt.sweep(SpinDown(), cases, **common)
    np.testing.assert_allclose(runs.table["w"], 10 * np.exp([-2 / 4, -1 / 2, -2 / 2]), rtol=1e-5)


def test_a_table_of_parameters_and_scalars() -> None:
    runs = pt.sweep(
        SpinDown(), [{"parameters": {"damper.d": d}, "stop": d} for d in (1.0, 2.0)], scalars={"w": last_speed}
    )
    table = runs.table
    assert list(table.columns) == ["damper.d", "stop", "w", "error"]
    np.testing.assert_allclose(table["w"], 0.0)
    with pytest.raises(pt.ParameterError, match=r"not kept.*record="):
        runs[0]
    (kept,) = sweep(1, scalars={"w": last_speed}, record=["inertia.*"])
    assert set(kept) == set(kept.names("inertia.*"))
    np.testing.assert_array_equal(
        [run["inertia.w"][-1] for run in sweep(2, record="inertia.w")], sweep(2, scalars={"w": last_speed}).table["w"]
    )


def test_a_function_that_does_not_pickle_is_named() -> None:
    model = Whole(part=Shaped(shape=lambda w: -w))
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(pt.ParameterError, match=r"Whole\.part\.shape = .*lambda.* top level"),
    ):
        pt.sweep(model, [{}], executor=executor, stop=1.0)
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(pt.ParameterError, match=r"scalars: 'w': .*lambda.* top level"),
    ):
        sweep(executor=executor, scalars={"w": lambda run: 1.0})


def test_a_lost_worker_is_replaced_and_its_cases_run_again(
    processes: Executor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("POWERTRAIN_TEST_FLAG", str(tmp_path / "flag"))
    runs = sweep(40, scalars={"w": spin_down.deadly_once}, executor=processes)
    assert (tmp_path / "flag").exists()
    np.testing.assert_allclose(runs.table["w"], spin_down.exact(40), rtol=1e-5)


@pytest.mark.slow
def test_a_case_that_ends_its_process_is_found_and_the_others_are_kept(processes: Executor) -> None:
    runs = sweep(6, scalars={"w": spin_down.deadly_above_three}, executor=processes, on_error="keep")
    assert list(runs.errors) == [4, 5]
    assert "case 4: the process that ran it ended 2 times without an answer (BrokenProcessPool" in str(runs.errors[4])
    np.testing.assert_allclose(runs.table["w"][:4], spin_down.exact(6)[:4], rtol=1e-5)


def test_an_interrupt_keeps_what_was_reached() -> None:
    with pytest.raises(KeyboardInterrupt) as raised:
        sweep(9, scalars={"w": spin_down.interrupted_above_three})
    assert raised.value.sweep.table["w"].notna().sum() == 6  # type: ignore[attr-defined]
    runs = sweep(9, scalars={"w": spin_down.interrupted_above_three}, on_error="keep")
    assert list(runs.errors) == [6, 7, 8]
    with ThreadPoolExecutor(1) as threads, pytest.raises(KeyboardInterrupt):
        sweep(9, scalars={"w": spin_down.interrupted_above_three}, executor=threads)


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_folder_holds_every_case(tmp_path: Path, processes: Executor) -> None:
    alone = sweep(5, record=["inertia.w"])
    for name, executor in ("in turn", None), ("processes", processes):
        folder = tmp_path / name
        runs = sweep(5, to=folder, record=["inertia.w"], executor=executor)
        assert [name[:6] for name in files(folder)] == [f"{k:06d}" for k in range(5)]
        for run, data in zip(alone, runs, strict=True):
            assert isinstance(data, xr.Dataset)
            np.testing.assert_array_equal(data["inertia.w"], run["inertia.w"])
            assert data["inertia.w"].attrs["units"] == "rad/s"
        with xr.open_dataset(folder / files(folder)[0], decode_times=False) as data:
            assert data.attrs["case"] == '{"parameters": {"inertia.J": 1.0}}'


def test_a_sweep_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interrupted = {"w": spin_down.interrupted_above_three}
    with pytest.raises(KeyboardInterrupt):
        sweep(9, scalars=interrupted, to=tmp_path)
    assert len(files(tmp_path)) == 6
    (tmp_path / files(tmp_path)[0]).write_bytes(b"")  # what a loss of power may leave
    (tmp_path / f".{files(tmp_path)[1]}.77.part").write_bytes(b"half of a fi")
    simulated: list[int] = []

    def counted(plant: Any, job: Any, case: Any) -> Any:
        simulated.append(case.number)
        return worker.run_case(plant, job, case)

    monkeypatch.setattr("powertrain.analysis.sweeping.run_case", counted)
    monkeypatch.setenv("POWERTRAIN_TEST_FLAG", "no interrupts")
    runs = sweep(9, scalars=interrupted, to=tmp_path)
    assert simulated == [0, 6, 7, 8]
    np.testing.assert_allclose(runs.table["w"], spin_down.exact(9), rtol=1e-5)


@pytest.mark.parametrize(
    "changed",
    [
        {"stop": 2.0},
        {"rtol": 1e-7},
        {"record": ["inertia.phi"]},
        {"scalars": {"w": lambda run: 2.0}},
        {"starts": {"inertia.w": 11.0}},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_a_folder_of_another_sweep_is_refused(tmp_path: Path, changed: dict[str, Any]) -> None:
    same: dict[str, Any] = {"record": ["inertia.w"], "scalars": {"w": lambda run: 1.0}}
    sweep(2, to=tmp_path, **same)
    before = files(tmp_path)
    with pytest.raises(pt.ParameterError, match=r"case \d of another sweep"):
        sweep(2, to=tmp_path, **{**same, **changed})
    with pytest.raises(pt.ParameterError, match=r"case \d of another sweep"):
        pt.sweep(SpinDown(damper=Damper(d=0.6)), spin_down.cases(2), to=tmp_path, stop=1.0, starts=STARTS, **same)
    assert files(tmp_path) == before


def test_failed_cases_in_a_folder(tmp_path: Path) -> None:
    scalars = {"w": spin_down.broken_above_three}
    runs = sweep(4, scalars=scalars, to=tmp_path, on_error="keep")
    assert [name.endswith(".failed.nc") for name in files(tmp_path)] == [False, False, False, True]
    again = sweep(4, scalars=scalars, to=tmp_path, on_error="keep")
    for found in runs, again:
        assert list(found.errors) == [3]
        assert "ZeroDivisionError" in str(found[3])
        np.testing.assert_array_equal(found.table["w"], [1.0, 1.0, 1.0, np.nan])
    with pytest.raises(pt.SimulationError, match="ZeroDivisionError"):
        sweep(4, scalars=scalars, to=tmp_path)


@pytest.mark.parametrize(
    ("case", "said"),
    [
        ({"inertia.J": 2.0, "stop": 1.0}, r"case 1: inertia\.J is not an option .*parameters"),
        ({}, r"case 1: stop \(s\)"),
        (3, "case 1: 3 is not a mapping"),
        ({"stop": 1.0, "record": ["inertia.w"]}, "case 1: record is the same for all cases"),
    ],
)
def test_a_case_that_simulate_does_not_know_is_refused_before_any_run(case: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        pt.sweep(SpinDown(), [{"stop": 1.0}, case])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"executor": 4}, "executor = 4 is not an executor"),
        ({"on_error": "ignore"}, "on_error='ignore' must be one of raise, keep"),
        ({"scalars": ["w"]}, "scalars = "),
        ({"scalars": {"w": 3}}, "'w': 3 is not a named function"),
        ({"scalars": {"inertia.J": last_speed}}, "'inertia.J' is already a column"),
        ({"scalars": {"w": spin_down.two_numbers}}, "'w' returns 2 numbers"),
        ({"record": 3}, "record = 3: pass a list"),
        ({"record": ["nothing"]}, "no signal nothing"),
        ({"to": 3}, "to = 3"),
        ({"to": "/dev/null/x"}, "cannot write to"),
        ({"to": "a\0b"}, "is not the path"),
    ],
)
def test_wrong_arguments_are_named(options: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        sweep(2, **options)


def test_an_executor_that_was_shut_down_is_named() -> None:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(pt.ParameterError, match="executor: cannot schedule"):
        sweep(executor=executor)


def test_no_cases_at_all(tmp_path: Path, processes: Executor) -> None:
    for options in {}, {"to": tmp_path}, {"executor": processes}:
        assert list(sweep(0, **options)) == []


def above(limit: float) -> Callable[[Any], float]:
    """A function that holds a value of its own."""
    return lambda run: float((run["inertia.w"] > limit).sum())


def test_scalars_are_told_apart_by_their_code_and_what_they_hold(tmp_path: Path) -> None:
    both = {"w": last_speed, "count": above(8.0)}
    first = sweep(2, to=tmp_path, scalars=both)
    again = sweep(2, to=tmp_path, scalars=dict(reversed(both.items())))
    assert list(again.table.columns) == ["inertia.J", "count", "w", "error"]
    for name in both:
        np.testing.assert_array_equal(first.table[name], again.table[name])
    with pytest.raises(pt.ParameterError, match="another sweep"):
        sweep(2, to=tmp_path, scalars={"w": last_speed, "count": above(9.0)})

    class Odd:
        def __call__(self, run: Any) -> float:
            return 1.0

    with pytest.raises(pt.ParameterError, match="cannot tell whether"):
        sweep(2, to=tmp_path, scalars={"odd": Odd()})


LIMIT = 8.0


def beyond(run: pt.Result[Any], *, least: float = 0.0) -> float:
    """A function that names a constant of its module."""
    return float((run["inertia.w"] > LIMIT + least).sum())


def beyond_by_way_of_another(run: pt.Result[Any]) -> float:
    """A function that names another one."""
    return beyond(run)


@pytest.mark.parametrize("scalar", [beyond, beyond_by_way_of_another, lambda run: 2 * beyond(run)])
def test_scalars_are_told_apart_by_the_constants_they_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scalar: Callable[[Any], float]
) -> None:
    """An edited script must not continue a sweep with numbers of the old constants, defaults or functions."""
    first = sweep(2, to=tmp_path, scalars={"count": scalar})
    again = sweep(2, to=tmp_path, scalars={"count": scalar})
    assert again.table["count"].tolist() == first.table["count"].tolist()
    for change in (sys.modules[__name__], "LIMIT", 9.0), (beyond, "__kwdefaults__", {"least": 1.0}):
        with monkeypatch.context() as changed:
            changed.setattr(*change)
            with pytest.raises(pt.ParameterError, match="another sweep"):
                sweep(2, to=tmp_path, scalars={"count": scalar})


class OwnError(pt.ParameterError):
    """A user's own class, which does not pickle by its message."""

    def __init__(self, a: int, b: int) -> None:
        super().__init__(f"{a} and {b}")


def refusing(run: pt.Result[Any]) -> float:
    raise OwnError(1, 2)


def test_errors_of_a_users_own_class(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as threads:
        for executor in None, threads:
            runs = sweep(2, to=tmp_path / str(executor), scalars={"w": refusing}, executor=executor, on_error="keep")
            assert "'w' failed: 1 and 2" in str(runs[0])
            assert type(runs[0]) is pt.ParameterError
