"""1,000 runs of CoupledClutches: against as many fresh builds, and by ``pt.sweep`` against the bare runs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

import powertrain as pt
from benchmarks.coupled_clutches import STOP, CoupledClutches
from benchmarks.timing import Row, at_most, duration, measure, seconds
from powertrain.components.rotational import Inertia

NAME = "sweep"


def run(runs: int = 1000, rounds: int = 3) -> list[Row]:
    """All rows of this benchmark; chunks of both sides take turns."""
    inertias = np.linspace(0.5, 2.0, runs).tolist()
    chunks = [inertias[i::10] for i in range(10)]
    once, fresh = 0.0, 0.0
    plant: pt.Plant[CoupledClutches] | None = None

    def reuse(values: list[float]) -> None:
        nonlocal plant
        plant = plant or pt.compile(CoupledClutches())
        for J in values:
            plant.simulate(STOP, parameters={"J4.J": J})["J1.w"]

    def rebuild(values: list[float]) -> None:
        for J in values:
            pt.compile(pt.replace(CoupledClutches(), J4=Inertia(J=J))).simulate(STOP)["J1.w"]

    for chunk in chunks:
        once += seconds(lambda chunk=chunk: reuse(chunk))  # type: ignore[misc]
        fresh += seconds(lambda chunk=chunk: rebuild(chunk))  # type: ignore[misc]
    return [
        Row(NAME, f"{runs} runs over a parameter, its one build included", duration(once)),
        Row(NAME, f"{runs} fresh builds, each run once", duration(fresh)),
        Row(NAME, "build once against build every time", f"{fresh / once:.3g} x faster"),
        *against_bare_runs(inertias, rounds),
    ]


def against_bare_runs(inertias: Sequence[float], rounds: int) -> list[Row]:
    """What ``pt.sweep`` adds to the runs: in this process, in another one, and with a file for every case."""
    plant = pt.compile(CoupledClutches())
    sets = [{"J4.J": J} for J in inertias]
    cases = [{"parameters": parameters} for parameters in sets]
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(1) as process:

        def swept(**options: Any) -> Callable[[], object]:
            return lambda: pt.sweep(plant, cases, stop=STOP, scalars={"w": last_speed}, **options).table

        def written() -> object:
            return swept(to=tempfile.mkdtemp(dir=Path(folder)), executor=process)()

        calls = {
            "the bare runs": lambda: [last_speed(plant.simulate(STOP, parameters=parameters)) for parameters in sets],
            "pt.sweep": swept(),
            "pt.sweep on a process": swept(executor=process),
            "pt.sweep on a process, each case in a file": written,
        }
        timings = measure(calls, rounds, inner=1, slow=rounds)
    bare, *others = calls
    what = f"{len(cases)} runs by {{}} against {bare}"
    return [at_most(NAME, what.format(name), timings.ratio(name, bare), 1.3) for name in others]


def last_speed(run: pt.Result[Any]) -> float:
    """What is kept of a run."""
    return float(run["J1.w"][-1])
