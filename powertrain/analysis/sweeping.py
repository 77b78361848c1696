"""Many runs of one plant: over parameters, starts or inputs, sequentially or on any executor, in memory or in a folder."""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing, contextmanager, suppress
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

from powertrain.analysis.cases import Job, Outcome, run_case
from powertrain.analysis.dispatch import outcomes as dispatched
from powertrain.analysis.identity import model_identity
from powertrain.analysis.sweep import Collected, Sweep, SweepPlan
from powertrain.errors import ParameterError, PowertrainError, suggestion
from powertrain.initialization.conditions import start_values
from powertrain.language.arguments import flag, names, one_of, path
from powertrain.language.component import Component
from powertrain.language.packing import packed_model
from powertrain.plant import Plant, plant_of
from powertrain.result import Result
from powertrain.signals import signals_of

if TYPE_CHECKING:
    import xarray as xr

M = TypeVar("M", bound=Component)


@overload
def sweep(
    model: M | Plant[M], cases: Iterable[Mapping[str, Any]], *, to: None = None, **options: Any
) -> Sweep[Result[M] | PowertrainError]: ...
@overload
def sweep(
    model: M | Plant[M], cases: Iterable[Mapping[str, Any]], *, to: str | PathLike[str], **options: Any
) -> Sweep[xr.Dataset | PowertrainError]: ...
def sweep(
    model: M | Plant[M],
    cases: Iterable[Mapping[str, Any]],
    *,
    to: str | PathLike[str] | None = None,
    record: str | Sequence[str] | None = None,
    scalars: Mapping[str, Callable[[Any], float]] | None = None,
    executor: Executor | None = None,
    on_error: Literal["raise", "keep"] = "raise",
    progress: bool = False,
    **options: Any,
) -> Sweep[Any]:
    """Simulate many cases; the model is compiled once.

    Parameters
    ----------
    model : Component or Plant
        The model.
    cases : iterable of mappings
        The arguments of ``Plant.simulate`` that differ from run to run.
    to : path, optional
        A folder to which every case is written as a netCDF file when it ends, instead of being kept in memory. An interrupted sweep
        continues there: finished cases are not run again, failed ones (``*.failed.nc``) only with ``on_error="raise"``.
    record : str or sequence of str, optional
        Names and patterns of the signals to keep; by default all, or none if there are ``scalars``.
    scalars : mapping of str to callable, optional
        Values to keep of each run, as functions of its result: ``{"top speed": top_speed}``. They become columns of the sweep's
        table, beside the parameters of the cases.
    executor : Executor, optional
        Any executor in the style of concurrent.futures: threads, processes, ``mpi4py.futures.MPIPoolExecutor``, or
        ``dask.distributed``'s ``client.get_executor()``. A process compiles the model once; if a process is lost, its cases run again.
    on_error : {"raise", "keep"}
        "keep" stores the error of a failed run in its place, with the run so far as ``result``, and returns the completed cases after
        Ctrl-C. "raise" cancels the remaining cases and raises the error, which has the cases so far as ``sweep``.
    progress : bool
        Show a progress bar.
    **options
        Arguments of ``Plant.simulate`` that are common to all cases. Values that a case gives replace the common ones by name:
        ``parameters``, ``starts``, ``guesses`` and ``inputs`` of both count.

    Returns
    -------
    Sweep
        The results in the order of the cases.

    Raises
    ------
    ParameterError
        If a case does not fit ``Plant.simulate``, if the model or a function cannot be sent to other processes, or if the folder holds
        cases of another sweep.

    Examples
    --------
    >>> pt.sweep(plant, [{"parameters": {"J1.J": J}} for J in grid], stop=1.5)  # doctest: +SKIP
    """
    plant = plant_of(model)
    one_of("on_error", on_error, ("raise", "keep"))
    flag("progress", progress)
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ParameterError(
            f"executor = {executor!r} is not an executor: pass one such as concurrent.futures.ProcessPoolExecutor(4)"
        )
    tasks = [_without_units(plant, case) for case in _tasks(cases, options)]
    plan = SweepPlan(tasks, dict(options), _job(plant, to, record, scalars, executor is not None))
    found = Collected.before(plan, failed_too=on_error == "keep")
    with closing(_run(plant, plan, found.missing(), executor)) as arriving, _shown(found, progress) as ended:
        try:
            for outcomes in arriving:
                ended(len(outcomes))
                for outcome in outcomes:
                    found.take(outcome)
                failed = [outcome for outcome in outcomes if outcome.error is not None]
                if failed and on_error == "raise":
                    _raise(failed[0], Sweep(plan, found))
        except KeyboardInterrupt as error:
            if on_error == "raise":
                error.add_note(f"{found.done.sum()} of {len(plan.cases)} cases were run")
                error.sweep = Sweep(plan, found)  # type: ignore[attr-defined]
                raise
    return Sweep(plan, found)


def _run(
    plant: Plant[Any], plan: SweepPlan, numbers: Sequence[int], executor: Executor | None
) -> Generator[list[Outcome], None, None]:
    """The outcomes as they arrive."""
    cases = map(plan.case, numbers)
    if executor is None:
        yield from ([run_case(plant, plan.job, case)] for case in cases)
    elif numbers:
        with closing(dispatched(plan.job, cases, len(numbers), executor)) as arriving:
            yield from ([outcome.received(plant) for outcome in outcomes] for outcomes in arriving)


def _raise(outcome: Outcome, reached: Sweep[Any]) -> None:
    assert outcome.error is not None
    outcome.error.add_note(f"case {outcome.number}: {reached.cases[outcome.number]}")
    outcome.error.sweep = reached
    raise outcome.error


@contextmanager
def _shown(found: Collected, progress: bool) -> Iterator[Callable[[int], object]]:
    """A function that displays the number of completed cases."""
    if not progress:
        yield lambda count: None
        return
    from tqdm.auto import tqdm

    with tqdm(total=len(found.done), initial=int(found.done.sum()), unit="run") as bar:
        yield bar.update


def _tasks(cases: Iterable[Mapping[str, Any]], options: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    try:
        listed = list(cases)
    except TypeError:
        raise ParameterError(f"cases = {cases!r}: give a list of mappings") from None
    known = [name for name in signature(Plant.simulate).parameters if name not in ("self", "record", "progress")]
    for k, case in enumerate(listed):
        if not isinstance(case, Mapping):
            raise ParameterError(f"case {k}: {case!r} is not a mapping; write {_EXAMPLE}")
        for name in (*options, *case):
            if name not in known:
                common = (
                    "is the same for all cases" if name in ("record", "progress") else "is not an option of simulate()"
                )
                near = suggestion(str(name), known)
                raise ParameterError(f"case {k}: {name} {common}{near}; write the parameters of a case as {_EXAMPLE}")
        if "stop" not in options and "stop" not in case:
            raise ParameterError(f"case {k}: stop (s) must be given, for all cases or for each")
    return listed


def _without_units(plant: Plant[Any], case: Mapping[str, Any]) -> Mapping[str, Any]:
    """The case with its parameters and starts as numbers, which the table shows; a text that is none stays, to fail in its own run."""
    known = plant.compiled.parameters
    readers: dict[str, Callable[[str, Any], float]] = {
        "parameters": lambda name, text: known[name].check(text, name),
        "starts": lambda name, text: start_values(plant.compiled, {name: text})[name],
    }
    found = dict(case)
    for option, read in readers.items():
        given = case.get(option)
        if isinstance(given, Mapping):
            found[option] = dict(given)
            for name in [name for name, value in given.items() if isinstance(value, str)]:
                with suppress(ParameterError, KeyError):
                    found[option][name] = read(name, given[name])
    return found


_EXAMPLE = '{"parameters": {"J1.J": 2.0}}'


def _job(
    plant: Plant[Any],
    to: str | PathLike[str] | None,
    record: str | Sequence[str] | None,
    scalars: Mapping[str, Callable[[Any], float]] | None,
    sent: bool,
) -> Job:
    """The common part of the cases, checked before any of them runs."""
    functions = _functions(scalars, sent)
    for name in functions:
        if name in plant.parameters or name == "error":
            raise ParameterError(f"scalars: {name!r} is already a column of the table; choose another name")
    kept: tuple[str, ...] | None = () if functions else None
    if record is not None:
        kept = tuple(signals_of(plant.compiled).matching(names("record", record)))
    folder = None if to is None else _folder(to)
    packed = packed_model(plant.model) if sent else b""
    return Job(packed, model_identity(plant.compiled) if sent or folder else "", kept, functions, folder)


def _folder(to: Any) -> Path:
    """The folder, created if necessary; checked before anything is computed."""
    try:
        folder = Path(path("to", to))
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ParameterError(f"to: cannot write to the folder {to}: {error.strerror}") from None
    return folder.resolve()


def _functions(scalars: Any, sent: bool) -> dict[str, Callable[[Any], float]]:
    if not isinstance(scalars, Mapping | None):
        raise ParameterError(
            f'scalars = {scalars!r}: pass functions of a result by name, such as {{"top speed": top_speed}}'
        )
    for name, function in (scalars or {}).items():
        if not isinstance(name, str) or not callable(function):
            raise ParameterError(f"scalars: {name!r}: {function!r} is not a named function of a result")
        if sent:
            try:
                pickle.dumps(function)
            except Exception as error:
                raise ParameterError(
                    f"scalars: {name!r}: {function!r} cannot be sent to another process ({error}); define it at the top level of a module"
                ) from None
    return dict(scalars or {})
