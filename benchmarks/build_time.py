"""From the text to a model that runs, by size; and the import."""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import powertrain as pt
from benchmarks.chain import chain
from benchmarks.coupled_clutches import CoupledClutches
from benchmarks.timing import Row, duration, measure, seconds

SIZES = (10, 30, 100, 300, 1000, 3000)
NAME = "model to ready-to-run"


def ready(build: Callable[[], pt.Component]) -> None:
    """Builds the model's text, compiles it, and starts a run, which builds the functions of the steps."""
    pt.compile(build()).simulate(1e-9, points=1)


def import_time(module: str) -> float:
    """Seconds that a fresh interpreter takes to import a module, beyond its own start."""
    program = f"import time; t = time.perf_counter(); import {module}; print(time.perf_counter() - t)"
    return float(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout)


def _ready_chain(n: int) -> tuple[float, float]:
    """Wall-clock and processor time until a chain of n inertias runs."""
    start = time.process_time()
    wall = seconds(lambda: ready(lambda: chain(n)))
    return wall, time.process_time() - start


def run(rounds: int = 7, sizes: tuple[int, ...] = SIZES) -> list[Row]:
    """All rows of this benchmark."""
    calls = {"two": lambda: ready(lambda: chain(2)), "clutches": lambda: ready(CoupledClutches)}
    times = measure(calls, rounds, inner=1)
    two, clutches = times.median("two"), times.median("clutches")
    needed = statistics.median(import_time("powertrain") for _ in range(rounds))
    casadi = statistics.median(import_time("casadi") for _ in range(rounds))
    rows = [
        Row(NAME, "two inertias", duration(two), "<= 0.1 s", two <= 0.1),
        Row(NAME, "CoupledClutches", duration(clutches), "<= 0.3 s", clutches <= 0.3),
        Row(NAME, f"import powertrain (casadi alone: {duration(casadi)})", duration(needed), "<= 0.7 s", needed <= 0.7),
    ]
    found = {}
    for n in sizes:
        repeats = 3 if n < 1000 else 1
        both = [_ready_chain(n) for _ in range(repeats)]
        found[n] = min(cpu for _, cpu in both)
        said = f"{duration(min(wall for wall, _ in both))} ({duration(found[n])} of processor time)"
        rows.append(Row(NAME, f"chain of {n} inertias", said))
    for first in (min(sizes), 100):
        last = max(sizes)
        if first in found and first < last:
            growth = math.log(found[last] / found[first]) / math.log(last / first)
            rows.append(
                Row(
                    NAME,
                    f"growth exponent of processor time, {first} to {last} inertias",
                    f"{growth:.2f}",
                    "<= 1.2",
                    growth <= 1.2,
                )
            )
    return rows
