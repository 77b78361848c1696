"""The result of a sweep: the outcomes of its cases in order, and a table of their numbers, in memory or from a folder."""

from __future__ import annotations

import json
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.analysis.archive import write_zarr
from powertrain.analysis.cases import ENDED, FAILED, KINDS, Case, Job, Outcome
from powertrain.analysis.identity import identity
from powertrain.errors import ParameterError, PowertrainError, SimulationError
from powertrain.export import read_classic
from powertrain.language.arguments import single

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

T = TypeVar("T", covariant=True)
_FILE = re.compile(r"((\d{6,})-[0-9a-f]{16})(\.failed)?\.nc")
_NOT_KEPT = "the runs were not kept, only the numbers of the table; name the signals to keep with record=[...]"


class Sweep(Sequence[T]):
    """The results of the cases, in their order.

    ``sweep[k]`` is the ``Result`` of a case, or the error with which it failed. Cases in a folder are read on demand, as an
    ``xarray.Dataset``. ``table`` has one row per case.
    """

    def __init__(self, plan: SweepPlan, found: Collected) -> None:
        self._plan, self._found = plan, found

    @property
    def cases(self) -> Sequence[Mapping[str, Any]]:
        """The cases as given."""
        return self._plan.cases

    def __len__(self) -> int:
        return len(self._plan.cases)

    @overload
    def __getitem__(self, k: int) -> T: ...
    @overload
    def __getitem__(self, k: slice) -> list[T]: ...
    def __getitem__(self, k: int | slice) -> Any:
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        return self._outcome(range(len(self))[operator.index(k)])

    def _outcome(self, k: int) -> Any:
        plan, found = self._plan, self._found
        if not found.done[k]:
            return SimulationError(f"case {k} was not run: the sweep ended before")
        path = None if plan.job.folder is None else plan.file(k, bool(found.failed[k]))
        if path is not None and path.exists():
            return _read(path)
        if k in found.kept:
            return found.kept[k]
        raise ParameterError(_NOT_KEPT if path is None else f"{path} was removed")

    @cached_property
    def errors(self) -> dict[int, PowertrainError]:
        """The errors of the cases that failed or were not run, by the number of the case."""
        self._complete()
        failed = np.flatnonzero(self._found.failed | ~self._found.done)
        return {int(k): self._outcome(int(k)) for k in failed}

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row per case: its parameters and other numbers and strings, the scalars, and ``error``: '' or the error."""
        import pandas as pd

        self._complete()
        rows = pd.DataFrame([_values_of(case) for case in self._plan.cases])
        scalars = pd.DataFrame(self._found.scalars, columns=list(self._plan.job.scalars))
        errors = pd.Series([""] * len(self), dtype=str, name="error")
        for k, error in self.errors.items():
            errors[k] = str(error)
        table = pd.concat([rows, scalars, errors], axis=1)
        table.index.name = "case"
        return table

    def to_zarr(self, store: str | PathLike[str], times: ArrayLike, *signals: str) -> xr.Dataset:
        """Write all runs to a zarr store as one Dataset over ``case`` and ``time``, and open it lazily.

        Parameters
        ----------
        store
            A folder that does not exist yet.
        times
            Common to all cases, ascending [s]. Complete runs are evaluated from their dense output, at events with their right limits. Runs
            in files and recorded ones are interpolated linearly between their samples; pass ``times=`` to the sweep to put samples there.
        signals
            Names; by default all signals that were kept.

        Returns
        -------
        xarray.Dataset
            Signals with units over (``case``, ``time``), nan after the end of a run and where it ``failed``; the numbers of ``table``
            (parameters, scalars) over ``case``. Data are read on demand; ``xarray.open_zarr`` opens the store again. Cases are written in
            blocks, so memory does not grow with their number.

        Raises
        ------
        PowertrainError
            Without zarr: ``pip install 'powertrain[zarr]'``. ParameterError for a store that exists, and for names that were not kept.

        Examples
        --------
        >>> runs = pt.sweep(plant, cases, stop=2.0)  # doctest: +SKIP
        >>> data = runs.to_zarr("runs.zarr", np.linspace(0.0, 2.0, 201), "car.w", "clutch.tau")  # doctest: +SKIP
        >>> data["car.w"].sel(time=1.0).mean()  # doctest: +SKIP
        """
        return write_zarr(self, self.table, store, times, list(signals))

    def _complete(self) -> None:
        """Read the numbers of cases that were already in the folder."""
        for k in np.flatnonzero(self._found.old):
            self._found.take_old(int(k), self._plan)

    def __repr__(self) -> str:
        self._complete()
        failed, missing = int(self._found.failed.sum()), int((~self._found.done).sum())
        said = [f"{len(self)} case{'s' * (len(self) != 1)}"]
        said += [f"{failed} failed"] if failed else []
        said += [f"{missing} not run"] if missing else []
        where = f" in {self._plan.job.folder}" if self._plan.job.folder is not None else ""
        return f"Sweep({', '.join(said)}{where})"


@dataclass(frozen=True)
class SweepPlan:
    """The cases and their common part."""

    cases: Sequence[Mapping[str, Any]]
    options: Mapping[str, Any]
    job: Job

    @cached_property
    def _common(self) -> str:
        job = self.job
        return identity(job.model, job.record, job.scalars, self.options)

    def case(self, number: int) -> Case:
        """A case with the name of its file, a hash of the model, the options and the code of the functions."""
        task = self.cases[number]
        if self.job.folder is None:
            return Case(number, _together(self.options, task))
        text = json.dumps(task, default=_listed)
        name = f"{number:06d}-{identity(self._common, task)[:16]}"
        return Case(number, _together(self.options, task), text, name)

    def file(self, number: int, failed: bool) -> Path:
        """The file of a case in the folder."""
        assert self.job.folder is not None
        return self.job.folder / f"{self.case(number).name}{FAILED if failed else ENDED}"


@dataclass
class Collected:
    """The outcomes so far, by the number of the case; ``old`` are cases of an earlier sweep whose numbers are not read yet."""

    scalars: NDArray[np.float64]
    done: NDArray[np.bool_]
    failed: NDArray[np.bool_]
    old: NDArray[np.bool_]
    kept: dict[int, Any]

    @classmethod
    def before(cls, plan: SweepPlan, failed_too: bool) -> Collected:
        """The cases in the folder of an earlier sweep. ParameterError if a file belongs to another sweep."""
        n = len(plan.cases)
        done, failed = _present(plan)
        if not failed_too:
            for k in np.flatnonzero(failed):
                plan.file(int(k), failed=True).unlink()
            done, failed = done & ~failed, np.zeros(n, bool)
        return cls(np.full((n, len(plan.job.scalars)), np.nan), done, failed, done.copy(), {})

    def missing(self) -> list[int]:
        """The numbers of the cases still to be run."""
        return [int(k) for k in np.flatnonzero(~self.done)]

    def take(self, outcome: Outcome) -> None:
        """Store a case that ended."""
        k = outcome.number
        self.done[k], self.failed[k] = True, outcome.error is not None
        if outcome.scalars:
            self.scalars[k] = list(outcome.scalars.values())
        if outcome.error is not None or outcome.run is not None:
            self.kept[k] = outcome.error or outcome.run

    def take_old(self, k: int, plan: SweepPlan) -> None:
        """Store the content of a case's file."""
        _, said = read_classic(plan.file(k, bool(self.failed[k])), attributes_only=True)
        self.old[k] = False
        if numbers := json.loads(said["scalars"]):
            self.scalars[k] = [numbers[name] for name in plan.job.scalars]


def _present(plan: SweepPlan) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which cases are in the folder, and which of them failed."""
    ended, failed = np.zeros(len(plan.cases), bool), np.zeros(len(plan.cases), bool)
    for entry in plan.job.folder.iterdir() if plan.job.folder is not None else ():
        found = _FILE.fullmatch(entry.name)
        k = int(found[2]) if found else len(ended)
        if found is None or k >= len(ended):
            continue
        if found[1] != plan.case(k).name:
            raise ParameterError(
                f"to: {plan.job.folder} holds case {k} of another sweep ({entry.name}): the model, the case, an option, record or a "
                "function in scalars differs. Choose a new folder"
            )
        (failed if found[3] else ended)[k] |= entry.stat().st_size > 0
    return ended | failed, failed & ~ended


def _read(path: Path) -> xr.Dataset | PowertrainError:
    try:
        signals, said = read_classic(path)
    except (OSError, ValueError, TypeError) as error:
        raise PowertrainError(f"{path}: cannot be read: {error}") from None
    if "error" in said:
        failure = KINDS[said["error"]](said["message"])
        if isinstance(failure, SimulationError):
            failure.result = signals
        return failure
    if signals is None:
        raise ParameterError(_NOT_KEPT)
    return signals


def _together(options: Mapping[str, Any], task: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of a run: the common ones and those of its case, which count where both give a value."""
    both = [name for name in task if isinstance(task[name], Mapping) and isinstance(options.get(name), Mapping)]
    return {**options, **task, **{name: {**options[name], **task[name]} for name in both}}


def _values_of(case: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers and strings of a case; parameters under their own name, others prefixed with the option's."""
    found: dict[str, Any] = {}
    for option, value in case.items():
        if isinstance(value, Mapping):
            prefix = "" if option == "parameters" else f"{option}."
            found |= {f"{prefix}{name}": v for name, v in value.items() if single(v) and not callable(v)}
        elif single(value):
            found[option] = value
    return found


def _listed(value: Any) -> Any:
    """NumPy numbers and arrays in a form for JSON."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else repr(value)
