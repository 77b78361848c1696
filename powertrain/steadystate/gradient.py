"""Exact derivatives of steady operating points: the model is differentiated in the modes that hold at each point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.equilibrium.points import OK, STUCK_POINT
from powertrain.equilibrium.system import held_rows
from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import names as texts
from powertrain.language.component import Component
from powertrain.language.symbols import column
from powertrain.language.units import quotient
from powertrain.numerics.batch import Columns, Rows
from powertrain.plant import Plant, plant_of
from powertrain.signals import Selector
from powertrain.steadystate.dataset import dataset
from powertrain.steadystate.intervals import ends_of
from powertrain.steadystate.results import Look
from powertrain.steadystate.steady import Question, kept, question, steady_map
from powertrain.steadystate.steady_map import SteadyMap

if TYPE_CHECKING:
    import xarray as xr


def steady_gradient(
    plant: Plant[Any] | Component,
    grid: Mapping[str, ArrayLike],
    wrt: str | Sequence[str],
    *,
    outputs: str | Iterable[Selector] | Mapping[str, Selector],
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    guesses: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Operating points as from ``pt.steady``, with the derivatives of the outputs.

    A small change of the grid does not change modes, so derivatives are exact wherever the status is ``ok``. On the boundary between two
    modes they are those of the mode that was found. If the status is ``stuck``, ``d(y)/d(x)_low`` and ``_high`` are the derivatives at
    the ends of the law's bounds. They are nan elsewhere.

    Parameters
    ----------
    plant : Plant or Component
        The model.
    grid : mapping of str to array_like
        As for ``pt.steady``.
    wrt : str or sequence of str
        Names of the grid.
    outputs, parameters, inputs, free, guesses
        As for ``pt.steady``.

    Returns
    -------
    xarray.Dataset
        The outputs, and the derivative of ``y`` with respect to ``x`` as the variable ``d(y)/d(x)``.

    Raises
    ------
    ParameterError
        As ``pt.steady``.
    """
    plant = plant_of(plant)
    q = question(plant, grid, outputs, parameters, inputs, free, guesses)
    spanned, asked = q.grid, q.asked
    names = list(dict.fromkeys(texts("wrt", wrt)))
    for name in names:
        if name not in asked.axes:
            raise ParameterError(f"wrt: {name} is not on the grid{suggestion(name, asked.axes)}")
    map_ = steady_map(plant, q)
    ordered, results = map_.run(spanned, Look(), None, keep=True)
    found = dataset(plant, q.grid, q.common, map_, ordered, results)
    slopes = _slopes(plant, q, map_, names)
    status = found.status.values.ravel()
    points = spanned.at(np.arange(spanned.size))
    shape = (len(map_.problem.outputs), len(names), spanned.size)
    low, high = np.full(shape, np.nan), np.full(shape, np.nan)
    fine = np.flatnonzero(status == OK)
    assert results.solved is not None
    u, modes = (np.hstack([getattr(p, what) for p in results.solved])[:, fine] for what in ("u", "modes"))
    low[..., fine] = high[..., fine] = slopes.at(points[:, fine], u, modes)[1]
    stuck = np.flatnonzero(status == STUCK_POINT)
    if stuck.size:
        low[..., stuck], high[..., stuck] = slopes.ends(points[:, stuck])
    units = {n: found[n].attrs.get("units", "1") if n in found.variables else "" for n in grid}
    for i, of in enumerate(map_.quantities[: len(map_.problem.outputs)]):
        for j, name in enumerate(names):
            label = f"d({of.name})/d({name})"
            said = {
                "units": quotient(of.unit, units[name]),
                "long_name": f"Derivative of {of.name} with respect to {name}",
            }
            both = [("", np.where(status == OK, low[i, j], np.nan))]
            if stuck.size:
                both += [("_low", low[i, j]), ("_high", high[i, j])]
            for end, values in both:
                found[label + end] = (spanned.dims, values.reshape(spanned.shape), said)
    return found


def _slopes(plant: Plant[Any], q: Question, map_: SteadyMap, names: list[str]) -> _Slopes:
    """The derivatives for these names, kept for the next call."""
    found: _Slopes = kept(
        plant, "slopes", q, tuple(names),
        lambda slopes: slopes.map is map_,
        lambda: _Slopes(map_, [q.asked.axes.index(n) for n in names]),
    )  # fmt: skip
    return found


class _Slopes:
    """Values and total derivatives of the outputs of a steady problem."""

    def __init__(self, map_: SteadyMap, places: list[int]) -> None:
        problem = map_.problem
        self.map, self.solver, self.problem = map_, map_.solver, problem
        self.held = held_rows(problem)
        axes = column([problem.grid[k] for k in places])
        u, y = column(problem.u), column(problem.outputs)
        rows = column([*problem.rows, *(row for row, _, _ in self.held)])
        self.shape = y.numel(), len(places), u.numel(), rows.numel()
        parts = [y, ca.jacobian(y, axes), ca.jacobian(y, u), ca.jacobian(rows, axes), ca.jacobian(rows, u)]
        flat = [e for p in parts for e in ca.vertsplit(ca.vec(ca.densify(p).T)) if p.numel()]
        varying = [*problem.grid, *problem.u, *problem.modes]
        self.columns = Columns("steady_slopes", varying, problem.common, flat)

    def at(self, grid: Rows, unknowns: Rows, modes: Rows) -> tuple[Rows, NDArray[np.float64]]:
        """Outputs, and their derivatives (output, axis, point)."""
        n, a, u, r = self.shape
        with np.errstate(all="ignore"):
            found = self.columns(np.vstack([grid, unknowns, modes]))
        sizes = np.cumsum([n, n * a, n * u, r * a])
        y, y_a, y_u, r_a, r_u = np.split(found, sizes)
        slopes = y_a.reshape(n, a, -1)
        if u:
            moved = self._moved(modes, r_a.reshape(r, a, -1), r_u.reshape(r, u, -1))
            slopes = slopes + np.einsum("nup,uap->nap", y_u.reshape(n, u, -1), moved)
        return y, slopes

    def ends(self, grid: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives of the least and greatest outputs if laws rest under a prescribed motion."""
        resting = np.flatnonzero(self.solver.solve(grid).rest.any(axis=1))
        ends = [self.at(grid, end.u, end.modes) for end in ends_of(self.solver, grid, resting)]
        y, s = (np.array(each) for each in zip(*ends, strict=True))
        low, high = y.argmin(axis=0)[None, :, None], y.argmax(axis=0)[None, :, None]
        return np.take_along_axis(s, low, 0)[0], np.take_along_axis(s, high, 0)[0]

    def _moved(self, modes: Rows, r_a: NDArray[np.float64], r_u: NDArray[np.float64]) -> NDArray[np.float64]:
        """The change of the implicit unknowns; rows of laws that are not stuck do not count."""
        first = len(self.problem.rows)
        r_a, r_u = r_a.copy(), r_u.copy()
        for j, (_, k, mode) in enumerate(self.held, first):
            r_a[j] *= modes[k] == mode
            r_u[j] *= modes[k] == mode
        count = r_a.shape[-1]
        moved = [-np.linalg.lstsq(r_u[..., p], r_a[..., p], rcond=None)[0] for p in range(count)]
        return np.array(moved, float).reshape(count, r_u.shape[1], r_a.shape[1]).transpose(1, 2, 0)
