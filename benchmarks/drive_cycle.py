"""The split-path car over the WLTC, 1,800 s with 18,001 outputs, against real time and against FASTSim over the same trace.

FASTSim (National Renewable Energy Laboratory) is a quasi-static model at 1 Hz, its vehicle a conventional 2012 Ford Fusion; the car here
is a hybrid differential-algebraic system with its events. Beside each time stands how exact the run is: the difference of its fuel from
that at rtol 1e-8, and what its energy audit leaves of the work of the engine.
"""

from __future__ import annotations

import importlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from itertools import product
from typing import Any

import numpy as np

import powertrain as pt
from benchmarks import native
from benchmarks.timing import Call, Row, Timings, at_least, duration, measure, seconds
from powertrain.components.cycles import DriveCycle
from powertrain.trials import CycleRun, drive_cycle
from powertrain.vehicles.split_path_car import SplitPathCar

NAME = "drive cycle"
WLTC = DriveCycle.named("wltc")
TOLERANCES = (1e-6, 1e-4)
OTHER = {"body.m": 1400.0}
SETTLED = 12
"""Runs after which modes that come often have steps of their own."""
GOAL = 5000
FUSION = "2012_Ford_Fusion.yaml"


def car() -> SplitPathCar:
    """The car with the cycle of this benchmark."""
    return pt.replace(SplitPathCar(), {"cycle.cycle": WLTC})


def litres(plant: pt.Plant[SplitPathCar], **options: Any) -> CycleRun:
    """What is timed: a run, its consumption, and its states at every output instant."""
    run = drive_cycle(plant, **options)
    run.litres_per_100km  # noqa: B018
    run.result.to_dataframe(*plant.compiled.states)
    return run


def fastsim() -> tuple[Callable[[], Any], str]:
    """A run of FASTSim over the same trace, which keeps its history, and its version. ImportError where it is not installed."""
    library = importlib.import_module("fastsim")
    trace = {"name": "wltc", "time_seconds": WLTC.times.tolist(), "speed_meters_per_second": WLTC.speeds.tolist()}
    cycle, car = library.Cycle.from_dict(trace), library.Vehicle.from_resource(FUSION)
    car.set_save_interval(1)
    return lambda: library.SimDrive(car, cycle).run(), version("fastsim")


def accuracy(run: CycleRun, reference: float) -> str:
    """Fuel and energy audit of a run in words."""
    work = float(np.trapezoid(np.abs(run.result["engine.power"]), run.result.time))
    fuel, left = run.fuel / reference - 1, abs(run.audit.residual) / work
    return f"{run.litres_per_100km:.4f} l/100 km, fuel {fuel:+.1e}, audit {left:.1e}, {run.time_outside:g} s outside the speed tolerance"


def run(rounds: int = 7, settled: int = SETTLED, tolerances: tuple[float, ...] = TOLERANCES) -> list[Row]:
    """All rows of this benchmark."""
    reference = drive_cycle(car(), rtol=1e-8)
    rows = [Row(NAME, "rtol 1e-8", accuracy(reference, reference.fuel))]
    reason = native.no_compiler()
    variants = list(product((False,) if reason else (False, True), tolerances))
    calls: dict[str, Call] = {}
    with _empty_cache():
        for compiled, rtol in variants:
            rows += _prepared(calls, compiled, rtol, settled, reference.fuel)
        missing, release = "", ""
        try:
            calls["fastsim"], release = fastsim()
        except ImportError as error:
            missing = f"skipped: {error}; install powertrain[benchmarks]"
        times = measure(calls, rounds, inner=1, slow=rounds)
    rows += [Row(NAME, "FASTSim", missing)] if missing else [_fastsim(times, release)]
    for compiled, rtol in variants:
        rows += _measured(times, _said(compiled, rtol), not missing)
    if reason:
        return [*rows, Row(NAME, "compiled steps", reason)]
    best = min(times.median(_said(True, rtol)) for rtol in tolerances)
    return [*rows, at_least(NAME, "repeated run, compiled steps, times real time", WLTC.duration / best, GOAL)]


def _prepared(calls: dict[str, Call], compiled: bool, rtol: float, settled: int, reference: float) -> list[Row]:
    """Rows of a fresh car's first run and of its accuracy; puts what is measured in turns into ``calls``."""
    said = _said(compiled, rtol)
    plants: list[pt.Plant[SplitPathCar]] = []

    def fresh() -> None:
        plants.append(pt.compile(car()))
        litres(plants[0], rtol=rtol, compile=compiled)

    first = seconds(fresh)
    calls[said] = partial(litres, plants[0], rtol=rtol, compile=compiled)
    calls[f"{said}, other mass"] = partial(litres, plants[0], rtol=rtol, compile=compiled, parameters=OTHER)
    second = seconds(calls[said])
    last = [litres(plants[0], rtol=rtol, compile=compiled) for _ in range(max(settled, 1))][-1]
    return [
        Row(NAME, f"{said}: model, build and first run; second run", f"{duration(first)}; {duration(second)}"),
        Row(NAME, f"{said}: accuracy", accuracy(last, reference)),
    ]


def _measured(times: Timings, said: str, compare: bool) -> list[Row]:
    rows = []
    for name, what in ((said, "repeated run"), (f"{said}, other mass", "the same with another mass")):
        measured = f"{duration(times.median(name))}, {WLTC.duration / times.median(name):,.0f} x real time"
        if compare:
            measured += f", {times.ratio(name, 'fastsim'):.3g} x FASTSim's time"
        rows.append(Row(NAME, f"{said}: {what}", measured))
    return rows


def _fastsim(times: Timings, release: str) -> Row:
    median = times.median("fastsim")
    return Row(
        NAME, f"FASTSim {release}, {FUSION}, 1 Hz", f"{duration(median)}, {WLTC.duration / median:,.0f} x real time"
    )


def _said(compiled: bool, rtol: float) -> str:
    return f"{'compiled steps' if compiled else 'no compiler'}, rtol {rtol:g}"


@contextmanager
def _empty_cache() -> Iterator[None]:
    """Nothing that was compiled before counts."""
    before = os.environ.get("POWERTRAIN_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["POWERTRAIN_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["POWERTRAIN_CACHE"]
            else:
                os.environ["POWERTRAIN_CACHE"] = before
