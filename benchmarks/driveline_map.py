"""The map of a whole driveline from the tank to the road: the split-path car on a rolling road over 100 speeds and 100 accelerators.

Modes and unknowns are solved together at every point, from the same starts. Times are those of the processor.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np
import xarray as xr

import powertrain as pt
from benchmarks import native
from benchmarks.timing import Call, Row, duration
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles.split_path_car import SplitPathCar

NAME = "driveline map"
SPEED, PEDAL = "body.speed", "driver.accelerator_set"
SIGNALS = ["body.force", "engine.fuel_rate", "engine.w", "engine.tau"]
GOAL = 1.0


def whole_map(plant: pt.Plant[Any], n: int, compile: bool = False) -> xr.Dataset:
    """``n`` speeds from 2 to 140 km/h by ``n`` positions of the accelerator."""
    grid = {SPEED: np.linspace(2, 140, n) / 3.6, PEDAL: np.linspace(0, 1, n)}
    return pt.steady(plant, grid, outputs=SIGNALS, compile=compile, progress=False)


def busy(call: Call) -> float:
    """Seconds of the processor for one call."""
    start = time.process_time()
    call()
    return time.process_time() - start


def run(rounds: int = 5, n: int = 100) -> list[Row]:
    """All rows of this benchmark."""
    plants: list[pt.Plant[Any]] = []

    def fresh() -> None:
        plants.append(pt.compile(on_rolling_road(SplitPathCar())))
        whole_map(plants[0], n)

    first = busy(fresh)
    found = whole_map(plants[0], n)
    counts = [
        f"{int((found['status'] == code).sum()):,} {said}" for code, said in ((0, "ok"), (2, "several solutions"))
    ]
    median = statistics.median(busy(lambda: whole_map(plants[0], n)) for _ in range(rounds))
    goal = f"<= {duration(GOAL)}"
    rows = [
        Row(NAME, f"{n * n:,} points of a whole car, no compiler", duration(median), goal, median <= GOAL),
        Row(NAME, "model, build and first map", duration(first)),
        Row(NAME, "status of the points", ", ".join(counts)),
    ]
    reason = native.no_compiler()
    if not reason:
        whole_map(plants[0], n, compile=True)
        median = statistics.median(busy(lambda: whole_map(plants[0], n, compile=True)) for _ in range(rounds))
    return [*rows, Row(NAME, f"{n * n:,} points of a whole car, compiled", reason or duration(median))]
