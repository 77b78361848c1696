"""The runs of a sweep as one xarray Dataset in zarr, over cases and a common time, written in blocks of cases."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError, PowertrainError
from powertrain.language.arguments import path, row
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.saved import Saved

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_VALUES = 2_000_000
"""Approximate number of values of one signal written at once."""


def write_zarr(
    runs: Sequence[Any], table: pd.DataFrame, store: str | PathLike[str], times: ArrayLike, signals: Sequence[str]
) -> xr.Dataset:
    """See ``Sweep.to_zarr``."""
    import xarray as xr

    try:
        import zarr  # noqa: F401
    except ImportError:
        raise PowertrainError("zarr is not installed: pip install 'powertrain[zarr]'") from None
    place, at = Path(path("store", store)), row("times", times)
    if place.exists():
        raise ParameterError(f"store: {place} is already there; choose another one")
    if not len(at) or (np.diff(at) <= 0.0).any():
        raise ParameterError("times must be in ascending order")
    first = next((_readable(run) for run in runs if not isinstance(run, PowertrainError)), None)
    if first is None:
        raise ParameterError("all cases of the sweep failed; there is nothing to write")
    names = list(signals) or first.names()
    block = max(1, _VALUES // len(at))
    for low in range(0, len(runs), block):
        cases = range(low, min(low + block, len(runs)))
        found = _block(runs, table, cases, at, names, first)
        chunks = {name: {"chunks": (min(block, len(runs)), len(at))} for name in names}
        if low:
            found.to_zarr(place, append_dim="case", consolidated=False)
        else:
            found.to_zarr(place, mode="w-", encoding=chunks, consolidated=False)
    opened: xr.Dataset = xr.open_zarr(place, chunks=None, consolidated=False)
    return opened


def _readable(run: Any) -> Result[Any] | Saved:
    """A run with its dense output, or its samples, between which signals are linear."""
    if isinstance(run, Result):
        try:
            run.trajectory  # noqa: B018  (says what is missing where only samples were kept)
        except ParameterError:
            return Saved(run.to_xarray())
        return run
    return Saved(run)


def _block(
    runs: Sequence[Any],
    table: pd.DataFrame,
    cases: range,
    times: Array,
    names: Sequence[str],
    first: Result[Any] | Saved,
) -> xr.Dataset:
    """The signals of some cases over the common time, with their rows of the table."""
    import xarray as xr

    values, failed = np.full((len(names), len(cases), len(times)), np.nan), np.zeros(len(cases), bool)
    for k, case in enumerate(cases):
        run = runs[case]
        failed[k] = isinstance(run, PowertrainError)
        if not failed[k]:
            values[:, k] = _sampled(_readable(run), times, names, case)
    texts = {n: {"units": first.unit(n), "long_name": first.description(n)} for n in names}
    data: dict[str, Any] = {n: (("case", "time"), values[i], texts[n]) for i, n in enumerate(names)}
    data["failed"] = ("case", failed, {"long_name": "Whether the run failed"})
    rows = table.iloc[cases.start : cases.stop]
    numbers = {str(n): ("case", rows[n].to_numpy()) for n in rows.columns if rows[n].dtype.kind in "iufb"}
    time = ("time", times, {"units": "s", "long_name": "Time"})
    return xr.Dataset(data, {"case": np.arange(cases.start, cases.stop), "time": time, **numbers})


def _sampled(run: Result[Any] | Saved, times: Array, names: Sequence[str], case: int) -> Array:
    """Signals at the common times; nan after the end of a run."""
    first, last = (run.trajectory.start, run.trajectory.end) if isinstance(run, Result) else run.time[[0, -1]]
    if times[0] < first:
        raise ParameterError(f"times: {times[0]:g} s is before the start of case {case}")
    for name in names:
        if isinstance(run, Saved) and name not in run:
            raise ParameterError(f"signals: case {case} has no {name}; it has {', '.join(run)}"[:500])
    values, ended = np.full((len(names), len(times)), np.nan), times <= last
    found = run.at(times[ended], list(names))
    values[:, ended] = [found[n] for n in names]
    return values
