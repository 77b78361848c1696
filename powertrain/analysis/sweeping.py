"""Many runs of one plant: over parameters, starts or inputs, one after the other or on any executor."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from functools import lru_cache
from inspect import signature
from typing import Any, Literal, TypeVar

from powertrain.component import Component
from powertrain.errors import ParameterError, PowertrainError, suggestion
from powertrain.plant import Plant, packed_model
from powertrain.result import Result

M = TypeVar("M", bound=Component)


def sweep(
    model: M | Plant[M],
    cases: Sequence[Mapping[str, Any]],
    *,
    executor: Executor | None = None,
    on_error: Literal["raise", "keep"] = "raise",
    progress: bool = False,
    **options: Any,
) -> list[Result[M] | PowertrainError]:
    """Simulates every case; a case is what differs from run to run, ``options`` is common to all (see ``Plant.simulate``).

    ``pt.sweep(plant, [{"parameters": {"J1.J": J}} for J in grid], stop=1.5)`` compiles nothing again. ``executor`` is anything in the
    manner of concurrent.futures (threads, processes, dask, mpi4py); a process compiles the model once. Results stand in the order of the
    cases; with ``on_error="keep"`` a failed run leaves its error in its place, with what was reached as ``result``.

    Raises ParameterError where a case is none for ``Plant.simulate`` or the model cannot be sent to other processes, and the first error of
    a run otherwise.
    """
    plant = model if isinstance(model, Plant) else Plant(model)
    tasks = [{**options, **case} for case in cases]
    for k, task in enumerate(tasks):
        _check(k, task)
    outcomes: Iterable[Result[M] | PowertrainError]
    if executor is None:
        outcomes = (_attempt(plant, task) for task in tasks)
    else:
        packed = packed_model(plant.model)
        futures = [executor.submit(_run_packed, packed, task) for task in tasks]
        outcomes = (future.result() for future in futures)
    if progress:
        from tqdm.auto import tqdm

        outcomes = tqdm(outcomes, total=len(tasks), unit="run")
    found: list[Result[M] | PowertrainError] = []
    for outcome in outcomes:
        if isinstance(outcome, PowertrainError) and on_error == "raise":
            raise outcome
        found.append(outcome)
    return found


def _check(k: int, task: Mapping[str, Any]) -> None:
    known = list(signature(Plant.simulate).parameters)[1:]
    for name in task:
        if name not in known:
            raise ParameterError(
                f"case {k}: {name} is no option of simulate(){suggestion(str(name), known)}; "
                f'the parameters of a case are written {{"parameters": {{"J1.J": 2.0}}}}'
            )
    if "stop" not in task:
        raise ParameterError(f"case {k}: stop (s) must be given, for all cases or for each")


def _attempt(plant: Plant[M], task: dict[str, Any]) -> Result[M] | PowertrainError:
    try:
        return plant.simulate(**task)
    except PowertrainError as error:
        return error


def _run_packed(packed: bytes, task: dict[str, Any]) -> Any:
    return _attempt(_plant_of(packed), task)


@lru_cache(maxsize=4)
def _plant_of(packed: bytes) -> Plant[Any]:
    return Plant(pickle.loads(packed))
