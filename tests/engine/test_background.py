"""``compile="background"``: the first runs go on without machine code, those that begin when it is built have it."""

from __future__ import annotations

import os
import shutil
import time
from multiprocessing import get_context
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from models import COUPLED_PARAMETERS, COUPLED_START, coupled_clutches
from small_models import Ball

from powertrain.engine.simulator import Simulator
from powertrain.engine.trajectory import Trajectory
from powertrain.errors import ParameterError
from powertrain.numerics.background import Build, begin, progress
from powertrain.plant import compile as compiled_model

needs_compiler = pytest.mark.skipif(
    not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine"
)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("POWERTRAIN_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "compiled"


def final(simulator: Simulator) -> Trajectory:
    return simulator.run(COUPLED_START, COUPLED_PARAMETERS, stop=1.5)


def built() -> None:
    until = time.monotonic() + 300
    while progress():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.slow
@needs_compiler
def test_a_run_begins_without_machine_code_and_later_runs_have_it(cache: Path) -> None:
    simulator = Simulator(coupled_clutches(), compile="background")
    first = final(simulator)
    assert np.array_equal(first.final, final(Simulator(coupled_clutches())).final)
    assert simulator._builds._waiting
    built()
    later = final(simulator)
    assert not simulator._builds._waiting
    assert np.array_equal(later.final, final(Simulator(coupled_clutches(), compile=True)).final)
    assert {f.class_name() for f in simulator._functions.values()} == {"External"}
    libraries = {path.name: path.stat().st_mtime_ns for path in cache.glob("*.so")}
    other = Simulator(coupled_clutches(), compile="background")
    assert np.array_equal(final(other).final, later.final)
    assert not other._builds._waiting, "what the cache has is used at once"
    assert libraries == {path.name: path.stat().st_mtime_ns for path in cache.glob("*.so")}


def build(name: str) -> None:
    """A small library by the thread of this process."""
    x = ca.SX.sym("x")
    assert isinstance(begin({"f": ca.Function(name, [x], [2 * x])}), Build)
    built()


@needs_compiler
@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_forked_process_builds_in_a_thread_of_its_own() -> None:
    build("powertrain_parent")
    child = get_context("fork").Process(target=build, args=("powertrain_child",), daemon=True)
    child.start()
    child.join(20.0)
    child.kill()
    assert child.exitcode == 0


def test_without_a_compiler_runs_go_on_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    assert np.array_equal(
        final(Simulator(coupled_clutches(), compile="background")).final, final(Simulator(coupled_clutches())).final
    )


def test_a_compiler_that_fails_is_named_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "false")
    simulator = Simulator(coupled_clutches(), compile="background")
    first = final(simulator)
    built()
    with pytest.warns(RuntimeWarning, match="compile='background' has no effect here: the C compiler false failed"):
        again = final(simulator)
    assert np.array_equal(first.final, again.final)
    final(simulator)


def test_another_word_is_refused() -> None:
    with pytest.raises(ParameterError, match="compile = 'behind' must be True, False or \"background\""):
        compiled_model(Ball()).simulate(1.0, compile="behind")  # type: ignore[arg-type]
