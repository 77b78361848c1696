"""Cases on an executor: a few at a time, in portions of similar duration, repeated if a worker is lost."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from itertools import islice
from queue import SimpleQueue
from typing import Any

from powertrain.analysis.cases import Case, Job, Outcome, run_cases, to_worker
from powertrain.errors import ParameterError, SimulationError

PORTION = 0.3
"""Duration of a portion in seconds: long compared with the cost of sending it, short to wait for."""
ATTEMPTS = 2
"""How often a case is tried alone after its worker was lost."""
MANY = 64
"""Concurrent portions on an executor that does not tell its number of workers."""


def outcomes(job: Job, cases: Iterator[Case], count: int, executor: Executor) -> Generator[list[Outcome], None, None]:
    """The outcomes of ``count`` cases as they arrive, one portion at a time. Closing the iterator cancels what has not started.

    If its worker was lost, the cases of a portion are run again one by one, with nothing in parallel, so a case that ends its process is
    identified. A broken process pool is replaced by an equal one.
    """
    dispatch = _Dispatch(job, cases, count, executor)
    try:
        yield from dispatch.run()
    finally:
        dispatch.end()


class _Dispatch:
    def __init__(self, job: Job, cases: Iterator[Case], count: int, executor: Executor) -> None:
        self.job, self.executor, self.own = to_worker(job), executor, False
        self.cases, self.more, self.lost = cases, count > 0, deque[Case]()
        self.running: dict[Future[Any], list[Case]] = {}
        self.ended: SimpleQueue[Future[Any]] = SimpleQueue()
        self.workers = _workers(executor)
        self.share = max(1, count // (4 * (self.workers or MANY)))
        self.size = 1

    def run(self) -> Iterator[list[Outcome]]:
        window = 2 * self.workers or MANY
        while self.more or self.running or self.lost:
            if self.lost and not self.running:
                yield [self.alone(self.lost.popleft())]
                continue
            while self.more and len(self.running) < window and not self.lost:
                self.submit(list(islice(self.cases, self.size)))
            if self.running:
                yield self.next()

    def submit(self, portion: list[Case]) -> None:
        """Submit a portion; if the pool broke before, the portion counts as lost like the others."""
        self.more = len(portion) == self.size
        if not portion:
            return
        try:
            future = self.executor.submit(run_cases, self.job, _sent(portion))
        except BrokenExecutor:
            self.lost.extend(portion)
            return
        except RuntimeError as error:
            raise ParameterError(f"executor: {error}") from None
        self.running[future] = portion
        future.add_done_callback(self.ended.put)

    def next(self) -> list[Outcome]:
        """The outcomes of the next portion to finish; empty if its worker was lost."""
        future = self.ended.get()
        portion = self.running.pop(future)
        error = None if future.cancelled() else future.exception()
        if error is not None and not isinstance(error, Exception):
            raise error  # Ctrl-C also reaches the workers of a terminal
        if error is not None or future.cancelled():
            self.lost.extend(portion)
            return []
        found, seconds = future.result()
        if seconds > 0:
            self.size = min(max(1, int(PORTION * len(portion) / seconds)), self.share)
        return list(found)

    def alone(self, case: Case) -> Outcome:
        """Run a case whose worker was lost, with nothing in parallel."""
        said = ""
        for _ in range(ATTEMPTS):
            self.renew()
            try:
                ((outcome,), _) = self.executor.submit(run_cases, self.job, _sent([case])).result()
            except Exception as error:
                said = f"{type(error).__name__}: {error}".rstrip(": ")
                continue
            return outcome
        return Outcome(
            case.number,
            error=SimulationError(
                f"case {case.number}: the process that ran it ended {ATTEMPTS} times without an answer ({said}): killed, out of memory, or "
                "ended by a function of the model"
            ),
        )

    def renew(self) -> None:
        """Replace the broken process pool by an equal one."""
        pool = self.executor
        if isinstance(pool, ProcessPoolExecutor) and pool._broken:
            self.end()
            settings = (pool._max_workers, pool._mp_context, pool._initializer, pool._initargs)  # type: ignore[attr-defined]
            self.executor, self.own = ProcessPoolExecutor(*settings), True

    def end(self) -> None:
        """Cancel what has not started, and shut down the replacement pool."""
        for future in self.running:
            future.cancel()
        if self.own:
            self.executor.shutdown(wait=False, cancel_futures=True)


def _sent(portion: list[Case]) -> bytes:
    try:
        return to_worker(portion)
    except Exception as error:
        numbers = ", ".join(str(case.number) for case in portion)
        raise ParameterError(f"case {numbers}: its result cannot be sent to another process: {error}") from None


def _workers(executor: Any) -> int:
    """The number of workers; 0 if the executor does not tell. Pools of the standard library and mpi4py, then dask."""
    for name in ("_max_workers", "num_workers"):
        if isinstance(found := getattr(executor, name, None), int):
            return found
    threads = getattr(getattr(executor, "_client", None), "nthreads", dict)
    return sum(threads().values())
