"""A sweep on a Dask cluster of this machine, whose workers are killed on the way. Needs ``powertrain[dask]``."""

from __future__ import annotations

import os
import signal
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import spin_down

import powertrain as pt

distributed = pytest.importorskip("distributed")


class Killing:
    """An executor that kills a worker before the tenth portion."""

    def __init__(self, executor: Any, pid: int) -> None:
        self.executor, self.pid, self.left = executor, pid, 10

    def submit(self, *arguments: Any) -> Future[Any]:
        self.left -= 1
        if not self.left:
            os.kill(self.pid, signal.SIGKILL)
        future: Future[Any] = self.executor.submit(*arguments)
        return future


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_is_killed_on_the_way(tmp_path: Path) -> None:
    count = 2000
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster,
        cluster.get_client() as client,
    ):
        workers = list(client.run(os.getpid).values())
        runs = pt.sweep(
            spin_down.SpinDown(),
            spin_down.cases(count),
            stop=1.0,
            starts=spin_down.STARTS,
            points=2,
            scalars={"w": spin_down.last_speed},
            to=tmp_path,
            executor=Killing(client.get_executor(), workers[0]),
        )
    assert not runs.errors
    np.testing.assert_allclose(runs.table["w"], spin_down.exact(count), rtol=1e-5)
    assert len(list(tmp_path.glob("*.nc"))) == count
