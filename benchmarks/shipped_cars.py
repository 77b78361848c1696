"""Every shipped car over the WLTC beside FASTSim on the same trace, and what a fresh machine waits for the first numbers of each.

FASTSim's vehicle is a conventional 2012 Ford Fusion at 1 Hz, whatever car stands beside it.
"""

from __future__ import annotations

import os
import re
import struct
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
"""Seconds of processor time until ``powertrain run`` says a consumption, that so far, on a fresh machine without a compiler."""
SO_FAR = re.compile(r"(?!0\.0 )\d+\.\d km, ")
"""How its progress bar says what a car has driven and consumed."""
SETTLED = 2


def run(rounds: int = 3, names: tuple[str, ...] = ()) -> list[Row]:
    """All rows of this benchmark, for the named cars or for all."""
    cars = {entry.name: entry.kind for entry in vehicles() if not names or entry.name in names}
    rows = [_first(name) for name in cars] if os.name == "posix" else []
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
    """How long ``powertrain run`` takes on a terminal until it shows a distance with a consumption, and until its results.

    With an empty cache and no program on the path. On Linux it is the processor's time, which other programs do not change much; elsewhere
    that of the clock.
    """
    terminal, end = _terminal()
    seen, waited, start = "", list[float](), time.perf_counter()
    command = [sys.executable, "-m", "powertrain", "run", name, "--cycle", "wltc"]
    with tempfile.TemporaryDirectory() as folder:
        alone = os.environ | {"PATH": folder, "POWERTRAIN_CACHE": folder, "PYTHONPATH": str(Path(__file__).parents[1])}
        with subprocess.Popen(command, env=alone, stdout=end, stderr=end) as program:
            os.close(end)
            for sign in (SO_FAR, re.compile(f"{name} over")):
                while not sign.search(seen):
                    seen += os.read(terminal, 65536).decode(errors="replace")
                waited.append(_used(program.pid) or time.perf_counter() - start)
            program.kill()
    os.close(terminal)
    return Row(
        NAME,
        f"{name}: first numbers without compiler, processor time (results)",
        f"{duration(waited[0])} ({duration(waited[1])})",
        f"<= {FIRST:g} s",
        waited[0] <= FIRST,
    )


def _terminal() -> tuple[int, int]:
    """The two ends of a terminal of 80 columns."""
    import fcntl
    import termios

    ends = os.openpty()
    fcntl.ioctl(ends[1], termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    return ends


def _used(pid: int) -> float:
    """Processor time of a running program [s]; 0 where the system has no /proc."""
    path = Path(f"/proc/{pid}/stat")
    if not path.exists():
        return 0.0
    fields = path.read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / float(os.sysconf("SC_CLK_TCK"))
