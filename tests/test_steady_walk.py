"""Large maps of laws that set each other off, in any order of their points, against a formula."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import powertrain as pt
from powertrain.equilibrium.operating import Solver
from powertrain.steadystate import results
from powertrain.steadystate.intervals import ranges

Points = NDArray[np.float64]


class Laws(pt.Component):
    """A friction whose limit a switch changes, switches that depend on it and on each other, some only where another one is on."""

    a: pt.Input = pt.signal_input("1", "One")
    b: pt.Input = pt.signal_input("1", "Another")
    c: pt.Input = pt.signal_input("1", "A third")
    f: pt.Variable = pt.variable("1", "Friction")
    g: pt.Variable = pt.variable("1", "Friction")
    x: pt.Variable = pt.variable("1", "After the friction")
    y: pt.Variable = pt.variable("1", "After x")
    z: pt.Variable = pt.variable("1", "After y")

    def equations(self) -> pt.Equations:
        a, b, c = self.a.value, self.b.value, self.c.value
        yield pt.friction(a - b, self.f, -1.0 - 0.5 * pt.switch(c > 0.2, 1.0, 0.0), 1.5)
        yield pt.friction(c - 0.4, self.g, -0.7, 0.9)
        yield self.x == pt.switch(self.f + a > 0.4, self.f * a, c)
        yield self.y == pt.switch(self.x > 0.3 * b, self.x + 1.0, -c)
        yield self.z == pt.switch(self.y > self.x, 1.0 + a, self.g)


def formula(a: Points, b: Points, c: Points) -> dict[str, Points]:
    """The same, one law after the other."""
    f = np.where(a > b, 1.5, np.where(c > 0.2, -1.5, -1.0))
    g = np.where(c > 0.4, 0.9, -0.7)
    x = np.where(f + a > 0.4, f * a, c)
    y = np.where(x > 0.3 * b, x + 1.0, -c)
    return {"f": f, "g": g, "x": x, "y": y, "z": np.where(y > x, 1.0 + a, g)}


def scattered(points: Points) -> Points:
    return points


def in_order(points: Points) -> Points:
    """By the first, which makes runs of equal modes longer."""
    return points[:, np.lexsort(np.round(3 * points))]


def in_blocks(points: Points) -> Points:
    """Each of a few points many times, and some neighbours of it."""
    return np.repeat(points[:, ::300], 300, axis=1)[:, : points.shape[1]] + 1e-3 * points


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Laws]:
    return pt.compile(Laws())


@pytest.mark.parametrize("order", [scattered, in_order, in_blocks])
@pytest.mark.parametrize("seed", [0, 1])
def test_points_in_any_order(plant: pt.Plant[Laws], order: Callable[[Points], Points], seed: int) -> None:
    values = order(np.random.default_rng(seed).uniform(-1, 1, (3, 9_000)))
    found = pt.steady(
        plant, {n: xr.DataArray(v, dims="i") for n, v in zip("abc", values, strict=True)}, outputs=[*"fgxyz"]
    )
    assert (found.status == 0).all()
    for name, exact in formula(*values).items():
        np.testing.assert_allclose(found[name], exact, rtol=1e-12, err_msg=name)


def test_points_with_known_modes_need_no_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """The solver is asked for new modes, and every time it is, these are known from then on."""
    asked, solve = list[int](), Solver.solve

    def counted(solver: Solver, grid: Points, *given: Any) -> Any:
        asked.append(grid.shape[1])
        return solve(solver, grid, *given)

    monkeypatch.setattr(Solver, "solve", counted)
    values = np.random.default_rng(2).uniform(-1, 1, (3, 200_000))
    pt.steady(Laws(), {n: xr.DataArray(v, dims="i") for n, v in zip("abc", values, strict=True)}, outputs=[*"fgxyz"])
    assert sum(asked) < 20_000


def test_rows(plant: pt.Plant[Laws]) -> None:
    """The same as a grid, on which no condition is zero."""
    a, b, c = np.linspace(-0.99, 1, 89), np.linspace(-0.97, 0.93, 17), np.linspace(-1, 0.95, 13)
    grid: dict[str, Any] = {"a": a, "b": b, "c": c}
    found = pt.steady(plant, grid, outputs=[*"fgxyz"]).transpose("a", "b", "c")
    for name, exact in formula(*np.meshgrid(a, b, c, indexing="ij")).items():
        np.testing.assert_allclose(found[name], exact, rtol=1e-12, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("side", [None, 1, -1])
def test_laws_at_rest_here_and_there(
    plant: pt.Plant[Laws], side: Literal[1, -1] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a = b or c = 0.4, torques have any value between their limits: as at points on their own, once for each set of laws."""
    asked = list[list[int]]()

    def counted(solver: Solver, grid: Points, laws: NDArray[np.intp]) -> Any:
        asked.append(laws.tolist())
        return ranges(solver, grid, laws)

    monkeypatch.setattr(results, "ranges", counted)
    axis = np.linspace(-0.8, 0.8, 17)
    grid = {"a": axis, "b": axis, "c": np.arange(-5, 6) * 0.2}
    found = pt.steady(plant, grid, outputs=[*"fgxyz"], side=side)
    assert len(asked) == 3
    assert sorted(map(len, asked)) == [1, 1, 2]
    status = (np.abs(found.a - found.b) < 1e-9) | (np.abs(found.c - 0.4) < 1e-9)
    assert (found.status == status).all()
    one_by_one = pt.steady(plant, {k: v[::2] for k, v in grid.items()}, outputs=[*"fgxyz"], side=side)
    for name in one_by_one.data_vars:
        np.testing.assert_array_equal(found[name][::2, ::2, ::2], one_by_one[name], err_msg=str(name))
    assert np.isfinite(found["f"]).all() == (side is not None)
