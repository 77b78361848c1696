"""Runs of a sweep as one Dataset in zarr: the values of the runs, lazily, from memory and from files, in blocks."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import spin_down
import xarray as xr

import powertrain as pt
from powertrain.analysis import archive

PLANT = pt.compile(spin_down.SpinDown())
TIMES = np.linspace(0.0, 1.0, 5)
CASES = [{"parameters": {"inertia.J": J}} for J in (0.5, 1.0, 2.0, 4.0, 8.0)]


def last(run: pt.Result[spin_down.SpinDown]) -> float:
    return float(run["inertia.w"][-1])


@pytest.mark.parametrize("folder", [False, True])
def test_values_are_those_of_the_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, folder: bool) -> None:
    """Two cases in each block; opened again, the store gives the same."""
    monkeypatch.setattr(archive, "_VALUES", 2 * len(TIMES))
    runs = pt.sweep(
        PLANT, CASES, stop=1.0, times=TIMES, scalars={"last": last}, record="inertia.*",
        **({"to": tmp_path / "runs"} if folder else {}),
    )  # fmt: skip
    runs.to_zarr(tmp_path / "all.zarr", TIMES, "inertia.w")
    found = xr.open_zarr(tmp_path / "all.zarr", chunks=None, consolidated=False)
    assert found.sizes == {"case": 5, "time": 5}
    for k, case in enumerate(CASES):
        alone = PLANT.simulate(1.0, times=TIMES, parameters=case["parameters"])
        np.testing.assert_allclose(found["inertia.w"].isel(case=k), alone.at(TIMES, "inertia.w"), rtol=1e-12)
        assert found["last"].isel(case=k) == alone["inertia.w"][-1]
    assert found["inertia.J"].values.tolist() == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert found["inertia.w"].attrs["units"] == "rad/s"
    assert not found["failed"].any()


def test_nothing_is_read_before_it_is_used(tmp_path: Path) -> None:
    found = pt.sweep(PLANT, CASES, stop=1.0).to_zarr(tmp_path / "all.zarr", TIMES)
    assert not found["inertia.w"].variable._in_memory
    part = found["inertia.w"].isel(case=slice(1, 3), time=-1)
    assert not part.variable._in_memory
    assert part.load().shape == (2,)


def test_runs_that_fail_or_end_early(tmp_path: Path) -> None:
    cases: list[dict[str, Any]] = [
        *CASES[:1],
        {"parameters": {"inertia.J": 1.0}, "stop": 0.5},
        {"parameters": {"inertia.J": -1.0}},
    ]
    runs = pt.sweep(PLANT, [{"stop": 1.0} | case for case in cases], on_error="keep")
    found = runs.to_zarr(tmp_path / "all.zarr", TIMES, "inertia.w")
    assert found["failed"].values.tolist() == [False, False, True]
    assert np.isnan(found["inertia.w"].values).sum(axis=1).tolist() == [0, 2, 5]


def test_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = pt.sweep(PLANT, CASES[:2], stop=1.0)
    (tmp_path / "there").mkdir()
    with pytest.raises(pt.ParameterError, match="there is already there"):
        runs.to_zarr(tmp_path / "there", TIMES)
    with pytest.raises(pt.ParameterError, match="ascending order"):
        runs.to_zarr(tmp_path / "a", [1.0, 0.0])
    with pytest.raises(pt.ParameterError, match=r"no signal inertia\.v"):
        runs.to_zarr(tmp_path / "a", TIMES, "inertia.v")
    with pytest.raises(pt.ParameterError, match="is before the start of case 0"):
        runs.to_zarr(tmp_path / "a", [-1.0, math.pi])
    monkeypatch.setitem(sys.modules, "zarr", None)
    with pytest.raises(pt.PowertrainError, match=r"pip install 'powertrain\[zarr\]'"):
        runs.to_zarr(tmp_path / "a", TIMES)
