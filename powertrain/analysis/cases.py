"""One case of a sweep: its execution in a worker, its outcome, and its file."""

from __future__ import annotations

import json
import os
import pickle
import threading
import time
import traceback
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from powertrain.analysis.identity import model_identity
from powertrain.errors import (
    InitializationError,
    ModelError,
    ParameterError,
    PowertrainError,
    SimulationError,
)
from powertrain.export import classic
from powertrain.language.arguments import array
from powertrain.plant import Plant
from powertrain.result import Result

KINDS = {
    kind.__name__: kind for kind in (PowertrainError, ModelError, ParameterError, InitializationError, SimulationError)
}
ENDED, FAILED = ".nc", ".failed.nc"
"""File name endings of cases."""
_compiling = threading.Lock()


@dataclass(frozen=True)
class Job:
    """The common part of the cases of a sweep. Picklable.

    ``packed`` is the pickled model and ``model`` its identity; ``record`` are the signals to keep of a run (None: all; empty: the run is
    not kept); ``scalars`` are functions of a run; ``folder`` is for runs that are not kept in memory.
    """

    packed: bytes
    model: str
    record: tuple[str, ...] | None
    scalars: Mapping[str, Callable[[Any], float]]
    folder: Path | None


@dataclass(frozen=True)
class Case:
    """One run of a sweep: the arguments of ``Plant.simulate``, in JSON as ``text``, and the ``name`` of its file."""

    number: int
    task: Mapping[str, Any]
    text: str = ""
    name: str = ""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a case. In transfer between processes, ``run`` is a result without its model, and ``error`` has no cause."""

    number: int
    scalars: Mapping[str, float] = field(default_factory=dict)
    run: Any = None
    error: PowertrainError | None = None

    def sent(self) -> Outcome:
        """A picklable form."""
        run = self.run.detached() if isinstance(self.run, Result) else None
        return replace(self, run=run, error=None if self.error is None else _plain(self.error))

    def received(self, plant: Plant[Any]) -> Outcome:
        """The outcome with the model of this process."""
        run: Result[Any] | None = None if self.run is None else Result.attached(self.run, plant.compiled)
        if isinstance(self.error, SimulationError):
            self.error.result = run
        return replace(self, run=run)


def to_worker(value: Any) -> bytes:
    """A job or its cases, serialised and compressed: an executor may keep them for a while, and cases are much alike."""
    return zlib.compress(pickle.dumps(value), 1)


def run_cases(sent_job: bytes, sent_cases: bytes) -> tuple[list[Outcome], float]:
    """The work of a worker: the outcomes of the cases, ready to send, and the time taken in seconds."""
    job, cases = _job_of(sent_job), _from_sender(sent_cases)
    try:
        with _compiling:
            plant = _plant_of(job.packed, job.model)
    except PowertrainError as error:
        return [Outcome(case.number, error=_plain(error)) for case in cases], 0.0
    begin = time.perf_counter()
    return [run_case(plant, job, case).sent() for case in cases], time.perf_counter() - begin


def run_case(plant: Plant[Any], job: Job, case: Case) -> Outcome:
    """Simulate one case and keep what the job requests; any exception becomes the ``error`` of its outcome."""
    scalars: dict[str, float] = {}
    run: Result[Any] | None = None
    failure: PowertrainError | None = None
    try:
        run = plant.simulate(**case.task, record=None if job.scalars else job.record or None)
        scalars = {name: _number(name, function, run) for name, function in job.scalars.items()}
    except PowertrainError as error:
        failure, run = error, getattr(error, "result", run)
    except Exception as error:
        failure = _unexpected(error, "the run failed")
    try:
        if run is not None and job.record is not None:
            run = (run.recorded(job.record) if job.scalars else run) if job.record else None
        if job.folder is not None:
            _write(job.folder / (case.name + (FAILED if failure else ENDED)), _content(case, scalars, run, failure))
            run = None
    except PowertrainError as error:
        failure = failure or error
    except OSError as error:
        failure = SimulationError(f"{error.filename or job.folder}: cannot be written: {error.strerror}")
    if isinstance(failure, SimulationError):
        failure.result = run
    return Outcome(case.number, scalars, run, failure)


def _content(case: Case, scalars: Mapping[str, float], run: Result[Any] | None, error: PowertrainError | None) -> bytes:
    said = {"case": case.text, "scalars": json.dumps(dict(scalars))}
    if error is not None:
        said |= {"error": _kind(error).__name__, "message": str(error)}
    return classic(np.zeros(0), {}, {}, said) if run is None else run.netcdf(**said)


def _write(path: Path, content: bytes) -> None:
    """Write a file completely or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _number(name: str, function: Callable[[Any], float], run: Result[Any]) -> float:
    try:
        found = function(run)
    except PowertrainError as error:
        raise ParameterError(f"scalars: {name!r} failed: {error}") from error
    except Exception as error:
        raise _unexpected(error, f"scalars: {name!r} failed") from error
    value = array(f"scalars: {name!r}", found, finite=False)
    if value.size != 1:
        raise ParameterError(f"scalars: {name!r} returns {value.size} numbers; it must return one")
    return float(value.item())


def _unexpected(error: Exception, what: str) -> PowertrainError:
    """An error in the user's own functions, with the place where it was raised."""
    said = SimulationError(f"{what}: {type(error).__name__}: {error}")
    said.__cause__ = error
    said.add_note("".join(traceback.format_exception(error)))
    return said


def _plain(error: PowertrainError) -> PowertrainError:
    """The same message in an error class of the library, which can be unpickled everywhere."""
    plain = _kind(error)(str(error))
    for note in getattr(error, "__notes__", ()):
        plain.add_note(note)
    return plain


def _kind(error: PowertrainError) -> type[PowertrainError]:
    """The nearest of the library's own error classes."""
    return next(KINDS[cls.__name__] for cls in type(error).__mro__ if KINDS.get(cls.__name__) is cls)


def _from_sender(sent: bytes) -> Any:
    return pickle.loads(zlib.decompress(sent))


@lru_cache(maxsize=4)
def _job_of(sent: bytes) -> Job:
    job: Job = _from_sender(sent)
    return job


@lru_cache(maxsize=4)
def _plant_of(packed: bytes, model: str) -> Plant[Any]:
    plant: Plant[Any] = Plant(pickle.loads(packed))
    if model_identity(plant.compiled) != model:
        raise ModelError(
            "a worker of the sweep compiles the model to different equations: it has a different version of powertrain or of the "
            "model's modules"
        )
    return plant
