"""Runs the benchmarks, prints their table and writes it for the documentation."""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks import (
    build_time,
    chain,
    coupled_clutches,
    design_space,
    drive_cycle,
    driveline,
    driveline_map,
    driven_axle,
    gradient,
    implicit_map,
    shipped_cars,
    steady_map,
    sweep,
    sweep_on_dask,
)
from benchmarks.native import no_compiler
from benchmarks.timing import Row, sections, table

Runner = Callable[[], list[Row]]
FULL: dict[str, Runner] = {
    "coupled_clutches": coupled_clutches.run,
    "driveline": driveline.run,
    "chain": chain.run,
    "build_time": build_time.run,
    "sweep": sweep.run,
    "sweep_on_dask": sweep_on_dask.run,
    "steady_map": steady_map.run,
    "implicit_map": implicit_map.run,
    "driveline_map": driveline_map.run,
    "drive_cycle": drive_cycle.run,
    "driven_axle": driven_axle.run,
    "shipped_cars": shipped_cars.run,
    "gradient": gradient.run,
    "design_space": design_space.run,
}
QUICK: dict[str, Runner] = {
    "coupled_clutches": partial(coupled_clutches.run, rounds=5, variants=10),
    "driveline": partial(driveline.run, rounds=3),
    "chain": partial(chain.run, rounds=5),
    "build_time": partial(build_time.run, rounds=3, sizes=(10, 100, 300)),
    "sweep": partial(sweep.run, runs=50),
    "implicit_map": partial(implicit_map.run, rounds=2, n=30),
    "driveline_map": partial(driveline_map.run, rounds=2, n=30),
    "drive_cycle": partial(drive_cycle.run, rounds=3, settled=2, tolerances=(1e-4,)),
    "shipped_cars": partial(shipped_cars.run, rounds=2, names=("ElectricCar", "SplitPathCar")),
    "gradient": partial(gradient.run, rounds=2, cycle=200.0),
    "design_space": partial(design_space.run, candidates=64),
}
HEAD = """# Benchmarks

Measured by `python -m benchmarks --write`, which needs `gcc` for the baselines in C.

- Both sides of a ratio run alternately in the same process. A ratio is the median over the rounds.
- Tolerances are 1e-6 relative and 1e-8 absolute on both sides unless stated otherwise.
- The time for powertrain is that of `Plant.simulate` as a user calls it, including initialisation and reading the states at every output
  instant. The baselines return their states at the same instants.
- "C" is compiled with `-O3 -march=native` from a program written or generated for the model. "ODE reduced by hand" means that the time for
  deriving the equations is not counted. `solve_ivp` evaluates hand-written equations in NumPy with one event function per law.
- "Ready to run" ends when a run has started.
- Errors are relative to powertrain's own runs at tolerances of 1e-10 or 1e-11, and so are the event sequences of the perturbed models (with
  steps of at most 1 ms). The programs in C are independent of powertrain's event handling; these references are not.
- Times are wall-clock times where they are not said to be processor time; "x" is a ratio of two times.
- The sections are measured one at a time, not always on the same day or processor; compare ratios, not times, between them.

"""


def machine() -> str:
    """What the numbers were measured on."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30 if hasattr(os, "sysconf") else 0.0
    cpu = next((v for k, v in _cpu() if k == "model name"), platform.processor() or platform.machine())
    versions = f"Python {platform.python_version()}, CasADi {version('casadi')}, NumPy {np.__version__}"
    if not no_compiler():
        versions += f", gcc {subprocess.run(['gcc', '-dumpfullversion'], capture_output=True, text=True, check=False).stdout.strip()}"
    return f"{cpu}, {os.cpu_count()} cores, {memory:.0f} GiB, {platform.system()}; {versions}."


def _cpu() -> list[tuple[str, str]]:
    path = Path("/proc/cpuinfo")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    pairs = [line.partition(":") for line in lines]
    return [(key.strip(), value.strip()) for key, _, value in pairs]


def renewed(page: str, measured: str) -> str:
    """The sections of a page, with those that were ``measured`` in place of the old ones; new ones are last."""
    titled = f"\n{page}\n\n{measured}".split("\n## ")[1:]
    found = {section.partition("\n")[0]: section.strip() for section in titled}
    return "\n\n".join(f"## {section}" for section in found.values())


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns 1 where a goal was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"which to run, of {', '.join(FULL)} (default: all)")
    parser.add_argument("--quick", action="store_true", help="few rounds and small sizes")
    parser.add_argument("--write", action="store_true", help="write their sections of docs/benchmarks.md")
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.names if name not in FULL]
    if unknown:
        parser.error(f"there is no benchmark {', '.join(unknown)}; there are {', '.join(FULL)}")
    runners = QUICK if chosen.quick else FULL
    rows: list[Row] = []
    for name in chosen.names or runners:
        start = time.perf_counter()
        rows += runners[name]()
        print(f"{name}: {time.perf_counter() - start:.0f} s", file=sys.stderr)
    print(table(rows))
    if chosen.write:
        page = Path(__file__).parents[1] / "docs" / "benchmarks.md"
        kept = renewed(page.read_text(encoding="utf-8"), sections(rows))
        page.write_text(f"{HEAD}{machine()}\n\n{kept}\n", encoding="utf-8")
    return int(any(row.met is False for row in rows))
