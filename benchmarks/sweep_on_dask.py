"""A long sweep on two Dask workers of this machine, one of which is killed on the way: what is lost, and how memory grows.

Needs ``powertrain[dask]``.
"""

from __future__ import annotations

import os
import signal
import tempfile
import threading
import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import powertrain as pt
from benchmarks.timing import Row, duration
from powertrain.components.rotational import Damper, Fixed, Inertia

NAME = "sweep on Dask"


class SpinDown(pt.Component):
    """An inertia that a damper brakes: w = w0 exp(-d t/J)."""

    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        """The damper stands on the ground."""
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


class Watch(threading.Thread):
    """Kills a process after a third of the cases; the memory of others (MB) from then on, over the number of cases that ended."""

    def __init__(self, folder: Path, count: int, victim: int, others: tuple[int, ...]) -> None:
        super().__init__(daemon=True)
        self.folder, self.count, self.victim, self.others = folder, count, victim, others
        self.ended: list[int] = []
        self.memory: list[list[float]] = []

    def run(self) -> None:
        """Looks twice a second until the sweep ends."""
        while (n := sum(1 for _ in self.folder.iterdir())) < self.count:
            if n > self.count / 3:
                if not self.ended:
                    os.kill(self.victim, signal.SIGKILL)
                self.ended.append(n)
                self.memory.append([_memory(pid) for pid in self.others])
            time.sleep(0.5)

    def slopes(self) -> list[float]:
        """MB for 100,000 cases more."""
        return [float(np.polyfit(self.ended, m, 1)[0] * 1e5) for m in np.transpose(self.memory)]


def run(count: int = 100_000) -> list[Row]:
    """All rows of this benchmark; none without Dask."""
    if find_spec("distributed") is None:
        return []
    distributed = import_module("distributed")
    inertias = np.linspace(1.0, 4.0, count)
    cases = [{"parameters": {"inertia.J": J}} for J in inertias.tolist()]
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster,
        cluster.get_client() as client,
        tempfile.TemporaryDirectory() as folder,
    ):
        first, second = client.run(os.getpid).values()
        watch = Watch(Path(folder), count, first, (second, os.getpid()))
        watch.start()
        begin = time.perf_counter()
        runs = pt.sweep(
            SpinDown(),
            cases,
            stop=1.0,
            starts={"inertia.w": 10.0},
            points=2,
            scalars={"w": last_speed},
            to=folder,
            executor=client.get_executor(),
        )
        took = time.perf_counter() - begin
        watch.join()
        wrong = int(
            (np.abs(runs.table["w"] / (10 * np.exp(-0.5 / inertias)) - 1) > 1e-4).sum() + runs.table["w"].isna().sum()
        )
    rows = [Row(NAME, f"{count} cases, one of two workers killed: cases lost or wrong", str(wrong), "0", wrong == 0)]
    rows += [
        Row(NAME, f"{count} cases, one of two workers killed", f"{duration(took)}, {duration(took / count)} a case")
    ]
    names = "memory of the other worker", "memory of the scheduler and the process that sweeps"
    for name, slope in zip(names, watch.slopes(), strict=True):
        rows.append(Row(NAME, f"{name}, for 100,000 cases more", f"{slope:.0f} MB"))
    return rows


def last_speed(run: pt.Result[Any]) -> float:
    """What is kept of a run."""
    return float(run["inertia.w"][-1])


def _memory(pid: int) -> float:
    """The resident memory of a process in MB."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
