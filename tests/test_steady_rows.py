"""Large maps, which are computed by rows, against the same points one row after the other and in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.design.bench import SplitPathBench
from powertrain.steadystate.known_modes import KnownModes

OK, NONE = 0, 3
OUTPUTS = ["V", "efficiency", "transmission.flange_a.tau"]


@pytest.fixture(scope="module")
def bench() -> pt.Plant[SplitPathBench]:
    return pt.compile(SplitPathBench())


def same(found: xr.Dataset, expected: xr.Dataset) -> None:
    np.testing.assert_array_equal(found.status, expected.status)
    for name in OUTPUTS:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9)


@pytest.mark.parametrize("columns", [200, 201])
def test_what_fitted_for_other_parameters_is_no_more_than_a_guess(
    bench: pt.Plant[SplitPathBench], columns: int
) -> None:
    """The variable unit stands where r is the ratio of the differential; an odd number of loads has one that is zero."""
    r, load = np.linspace(-2, 3, 61), np.linspace(-40, 40, columns)
    for ratio in -1.7, -0.6, -1.7:
        parameters = {"transmission.differential.ratio": ratio}
        whole = pt.steady(bench, {"r": r, "load": load}, outputs=OUTPUTS, parameters=parameters)
        for k in range(0, r.size, 7):
            row = pt.steady(bench, {"r": r[k], "load": load}, outputs=OUTPUTS, parameters=parameters)
            same(whole.isel(r=k), row)


def test_points_in_no_order_are_those_solved_one_by_one(bench: pt.Plant[SplitPathBench]) -> None:
    """Among them points where modes change: no load, the variable unit at rest, the output at rest; and loads beyond any limit."""
    rng, count = np.random.default_rng(4), 12_000
    r, load = rng.uniform(-2, 3, count), rng.uniform(-200, 200, count)
    r[rng.random(count) < 0.02], r[rng.random(count) < 0.02], load[rng.random(count) < 0.02] = -1.7, 0.0, 0.0
    load[5000:5003] = 1e20
    points = {"r": xr.DataArray(r, dims="point"), "load": xr.DataArray(load, dims="point")}
    whole = pt.steady(bench, points, outputs=OUTPUTS)
    for low in range(0, r.size, 1500):
        some = slice(low, low + 1500)
        same(whole.isel(point=some), pt.steady(bench, {n: v[some] for n, v in points.items()}, outputs=OUTPUTS))
    assert (whole.status[5000:5003] == NONE).all()


def test_infinite_torque_has_no_solution_in_a_large_map_either(bench: pt.Plant[SplitPathBench]) -> None:
    """Although what does not depend on the torque could be computed."""
    r, load = np.linspace(-2, 3, 60), np.r_[np.linspace(1, 40, 63), 1e20]
    whole = pt.steady(bench, {"r": r, "load": load}, outputs=OUTPUTS)
    same(whole.isel(r=7), pt.steady(bench, {"r": r[7], "load": load}, outputs=OUTPUTS))
    assert (whole.status[:, -1] == NONE).all()
    assert (whole.status[:, :-1] == OK).all()


def test_rows_in_known_modes_are_filled_as_a_whole(
    bench: pt.Plant[SplitPathBench], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Torques, their limits and the margins of all modes are affine along the load, on both sides of zero."""
    counts, fill = list[int](), KnownModes.fill

    def counted(known: KnownModes, count: int, *given: Any) -> None:
        counts.append(count)
        fill(known, count, *given)

    monkeypatch.setattr(KnownModes, "fill", counted)
    grid = {"r": np.linspace(-2, 3, 64), "load": np.linspace(-200, 200, 64)}
    found = pt.steady(bench, grid, outputs=OUTPUTS)
    assert (found.status == OK).all()
    assert sum(counts) == 0


class PartlyCurved(pt.Component):
    """Affine in x where k is negative, a parabola where it is not; and a corner in x."""

    x: pt.Input = pt.signal_input("1", "Along a row")
    k: pt.Input = pt.signal_input("1", "From row to row")
    y: pt.Variable = pt.variable("1", "Affine or curved")
    z: pt.Variable = pt.variable("1", "Affine on both sides of one half")
    level: pt.Variable = pt.variable("1", "The same all along a row on either side")

    def equations(self) -> pt.Equations:
        x, k = self.x.value, self.k.value
        yield self.y == pt.switch(k >= 0, k * x**2, k * x + 1)
        yield self.z == pt.switch(x >= 0.5, k * x, 3 - x)
        yield self.level == pt.switch(x >= 0.5, 2 * k, 5.0)


def test_rows_of_all_kinds_next_to_each_other() -> None:
    """Rows that are affine, curved and, where the corner lies in them, neither, in turns."""
    x, k = np.linspace(-1, 2, 150), np.random.default_rng(3).uniform(-1, 1, 70)
    found = pt.steady(PartlyCurved(), {"x": x, "k": k}).transpose("k", "x")
    K, X = np.meshgrid(k, x, indexing="ij")
    assert (found.status == OK).all()
    np.testing.assert_allclose(found.y, np.where(K >= 0, K * X**2, K * X + 1), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(found.z, np.where(X >= 0.5, K * X, 3 - X), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(found.level, np.where(X >= 0.5, 2 * K, 5.0), rtol=1e-12)


class Corners(pt.Component):
    """A parabola from a corner on that lies elsewhere in every row."""

    x: pt.Input = pt.signal_input("1", "Along a row")
    k: pt.Input = pt.signal_input("1", "From row to row")
    y: pt.Variable = pt.variable("1", "Curved beyond the corner")

    def equations(self) -> pt.Equations:
        x, k = self.x.value, self.k.value
        yield self.y == pt.switch(x >= k, k + x**2, 2 - x)


def test_curved_rows_are_looked_at_from_end_to_end() -> None:
    """The modes at the upper end hold at the lower one, in the middle, or nowhere else."""
    x, k = np.linspace(-1, 2, 150), np.random.default_rng(5).uniform(-1.5, 2.5, 70)
    found = pt.steady(Corners(), {"x": x, "k": k}).transpose("k", "x")
    K, X = np.meshgrid(k, x, indexing="ij")
    assert (found.status == OK).all()
    np.testing.assert_allclose(found.y, np.where(X >= K, K + X**2, 2 - X), rtol=1e-12, atol=1e-14)
