"""The runs of a sweep as one xarray Dataset in zarr, over cases and a common time, written in blocks of cases."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.errors import ParameterError, PowertrainError
from powertrain.language.arguments import path, row
from powertrain.result import Result

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Array = NDArray[np.float64]
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
    first = next((run for run in _outcomes(runs, range(len(runs))) if not isinstance(run, PowertrainError)), None)
    if first is None:
        raise ParameterError("all cases of the sweep failed; there is nothing to write")
    names = list(signals) or _names(first)
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


def _outcomes(runs: Sequence[Any], cases: range) -> Iterator[Any]:
    return (runs[k] for k in cases)


def _names(run: Any) -> list[str]:
    return (
        list(run.names())
        if isinstance(run, Result)
        else [str(name) for name in run.data_vars if run[name].dims == ("time",)]
    )


def _block(
    runs: Sequence[Any], table: pd.DataFrame, cases: range, times: Array, names: Sequence[str], first: Any
) -> xr.Dataset:
    """The signals of some cases over the common time, with their rows of the table."""
    import xarray as xr

    values, failed = np.full((len(names), len(cases), len(times)), np.nan), np.zeros(len(cases), bool)
    for k, run in enumerate(_outcomes(runs, cases)):
        failed[k] = isinstance(run, PowertrainError)
        if not failed[k]:
            values[:, k] = _sampled(run, times, names, cases[k])
    texts = _texts(first, names)
    data: dict[str, Any] = {n: (("case", "time"), values[i], texts[n]) for i, n in enumerate(names)}
    data["failed"] = ("case", failed, {"long_name": "Whether the run failed"})
    rows = table.iloc[cases.start : cases.stop]
    numbers = {str(n): ("case", rows[n].to_numpy()) for n in rows.columns if rows[n].dtype.kind in "iufb"}
    time = ("time", times, {"units": "s", "long_name": "Time"})
    return xr.Dataset(data, {"case": np.arange(cases.start, cases.stop), "time": time, **numbers})


def _sampled(run: Any, times: Array, names: Sequence[str], case: int) -> Array:
    """Signals at the common times: from the dense output, or interpolated between samples; nan after the end of a run."""
    dense = isinstance(run, Result) and _dense(run)
    t = run.trajectory.times if dense else np.asarray(run.time)
    end = run.trajectory.end if dense else t[-1]
    if times[0] < t[0]:
        raise ParameterError(f"times: {times[0]:g} s is before the start of case {case}")
    values, ended = np.full((len(names), len(times)), np.nan), times <= end
    if dense:
        found = run.at(times[ended], list(names))
        values[:, ended] = [found[n] for n in names]
        return values
    for name in names:
        if not isinstance(run, Result) and name not in run.data_vars:
            raise ParameterError(
                f"signals: case {case} has no {name}; it has {', '.join(map(str, run.data_vars))}"[:500]
            )
    rows = np.array([run[n] for n in names], float)
    place = np.clip(np.searchsorted(t, times[ended], side="right") - 1, 0, max(len(t) - 2, 0))
    after = np.minimum(place + 1, len(t) - 1)
    span = t[after] - t[place]
    part = np.divide(times[ended] - t[place], span, out=np.zeros_like(span), where=span > 0.0)
    values[:, ended] = rows[:, place] + part * (rows[:, after] - rows[:, place])
    return values


def _dense(run: Result[Any]) -> bool:
    """Whether a run has its trajectory, rather than only recorded samples."""
    try:
        return run.trajectory is not None
    except ParameterError:
        return False


def _texts(run: Any, names: Sequence[str]) -> dict[str, dict[str, str]]:
    """Units and long names."""
    found = run.to_xarray(*names) if isinstance(run, Result) else run
    return {n: {key: found[n].attrs[key] for key in ("units", "long_name") if key in found[n].attrs} for n in names}
