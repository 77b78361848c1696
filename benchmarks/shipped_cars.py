"""Every shipped car over the WLTC beside FASTSim on the same trace, and what a fresh machine waits for the first numbers of each.

FASTSim's vehicle is a conventional 2012 Ford Fusion at 1 Hz, whatever car stands beside it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import powertrain as pt
from benchmarks import native
from benchmarks.drive_cycle import WLTC, fastsim
from benchmarks.timing import Call, Row, at_most, duration, measure
from powertrain.presets.catalogue import vehicles
from powertrain.trials import CycleRun, drive_cycle
from powertrain.trials.cycle import on_cycle

NAME = "shipped cars"
RTOL = 1e-4
GOAL = 40.0
"""Times of FASTSim's conventional car."""
FIRST = 5.0
"""Seconds of processor time until ``powertrain run`` says the consumption, on a fresh machine without a compiler."""
SETTLED = 2


def run(rounds: int = 3, names: tuple[str, ...] = ()) -> list[Row]:
    """All rows of this benchmark, for the named cars or for all."""
    cars = {entry.name: entry.kind for entry in vehicles() if not names or entry.name in names}
    rows = [_first(name) for name in cars]
    if reason := native.no_compiler():
        return [*rows, Row(NAME, "compiled", reason)]
    try:
        calls: dict[str, Call] = {"fastsim": fastsim()[0]}
    except ImportError as error:
        return [*rows, Row(NAME, "FASTSim", f"skipped: {error}; install powertrain[benchmarks]")]
    for name, kind in cars.items():
        calls[name] = partial(consumption, pt.compile(on_cycle(kind(), WLTC)))
        for _ in range(SETTLED):
            calls[name]()
    times = measure(calls, rounds, inner=1, slow=rounds)
    for name in cars:
        said = f"{name}, compiled, rtol {RTOL:g}: {duration(times.median(name))}, in times of FASTSim"
        rows.append(at_most(NAME, said, times.ratio(name, "fastsim"), GOAL))
    return rows


def consumption(plant: pt.Plant[pt.Component]) -> CycleRun:
    """What is timed: a run and its consumption."""
    run = drive_cycle(plant, rtol=RTOL, compile=True)
    run.litres_per_100km  # noqa: B018
    return run


def _first(name: str) -> Row:
    """The time until ``powertrain run`` prints its first result, with an empty cache and no program on the path.

    On Linux it is the processor's, which other programs do not change much; elsewhere that of the clock.
    """
    with tempfile.TemporaryDirectory() as folder:
        alone = os.environ | {"PATH": folder, "POWERTRAIN_CACHE": folder, "PYTHONPATH": str(Path(__file__).parents[1])}
        start = time.perf_counter()
        command = [sys.executable, "-m", "powertrain", "run", name, "--cycle", "wltc"]
        with subprocess.Popen(command, env=alone, stdout=subprocess.PIPE, text=True) as program:
            assert program.stdout is not None
            program.stdout.readline()
            waited = _used(program.pid) or time.perf_counter() - start
            program.stdout.read()
    return Row(
        NAME,
        f"{name}: first numbers without compiler, processor time",
        duration(waited),
        f"<= {FIRST:g} s",
        waited <= FIRST,
    )


def _used(pid: int) -> float:
    """Processor time of a running program [s]; 0 where the system has no /proc."""
    path = Path(f"/proc/{pid}/stat")
    if not path.exists():
        return 0.0
    fields = path.read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))
