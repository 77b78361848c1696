"""Derivatives of steady operating points, exact: by differentiation of the model with the modes that hold at each point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.compiler.hybrid import Friction
from powertrain.equilibrium.choices import STUCK, held_rows
from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import OK, STUCK_POINT
from powertrain.equilibrium.system import Equilibrium, formulate
from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import names as texts
from powertrain.language.component import Component
from powertrain.language.symbols import Symbol, column
from powertrain.numerics.batch import LANES, Rows, Tape
from powertrain.plant import Plant
from powertrain.steadystate.steady import Question, What, kept, question, steady

if TYPE_CHECKING:
    import xarray as xr

_MOST_ENDS = 8


def steady_gradient(
    plant: Plant[Any] | Component,
    grid: Mapping[str, ArrayLike],
    wrt: str | Sequence[str],
    *,
    outputs: str | Iterable[What] | Mapping[str, What],
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    guesses: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Operating points as from ``pt.steady``, with the derivatives of the outputs.

    Modes do not change with a small change of the grid, so derivatives are exact wherever the status is ``ok``; on the boundary between
    two modes they are those of the mode that was found. If the status is ``stuck``, ``d(y)/d(x)_low`` and ``_high`` are those at the ends
    of the law's bounds. They are nan elsewhere.

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
    plant = plant if isinstance(plant, Plant) else Plant(plant)
    q = question(plant, grid, outputs, parameters, inputs, free, guesses)
    spanned, wanted, asked = q.grid, q.wanted, q.asked
    names = texts("wrt", wrt)
    for name in names:
        if name not in asked.axes:
            raise ParameterError(f"wrt: {name} is not on the grid{suggestion(name, asked.axes)}")
    found = steady(plant, grid, outputs=outputs, parameters=parameters, inputs=inputs, free=free, guesses=guesses)
    slopes = _slopes(plant, q, names)
    status = found.status.values.ravel()
    points = spanned.at(np.arange(spanned.size))
    shape = (len(wanted), len(names), spanned.size)
    low, high = np.full(shape, np.nan), np.full(shape, np.nan)
    fine = np.flatnonzero(status == OK)
    low[..., fine] = high[..., fine] = slopes.at(points[:, fine])[1]
    stuck = np.flatnonzero(status == STUCK_POINT)
    if stuck.size:
        low[..., stuck], high[..., stuck] = slopes.ends(points[:, stuck])
    units = {n: found[n].attrs.get("units", "1") if n in found.variables else "" for n in grid}
    for i, w in enumerate(wanted):
        if w.name not in found.variables:
            continue
        for j, name in enumerate(names):
            label = f"d({w.name})/d({name})"
            said = {
                "units": f"{w.picked.unit}/({units[name] or '1'})",
                "long_name": f"Derivative of {w.name} with respect to {name}",
            }
            both = [("", np.where(status == OK, low[i, j], np.nan))]
            if stuck.size:
                both += [("_low", low[i, j]), ("_high", high[i, j])]
            for end, values in both:
                found[label + end] = (spanned.dims, values.reshape(spanned.shape), said)
    return found


def _slopes(plant: Plant[Any], q: Question, names: list[str]) -> _Slopes:
    """The derivatives for these names, kept for the next call."""
    values, place = q.common[: len(plant.compiled.parameters)], kept(plant, "slopes", q, 0.0, tuple(names))
    found: _Slopes | None = place.get()
    if found is None or not found.valid(values):
        problem = formulate(plant.compiled, q.asked, 0.0, q.guesses, values)
        found = place.put(_Slopes(problem, [q.asked.axes.index(n) for n in names], values))
    found.set_common(q.common)
    return found


class _Slopes:
    """Values and total derivatives of the outputs of a steady problem."""

    def __init__(self, problem: Equilibrium, places: list[int], parameters: NDArray[np.float64]) -> None:
        self.solver, self.problem, self._parameters = Solver(problem), problem, parameters
        self.held = held_rows(problem) if problem.u else []
        axes = column([problem.grid[k] for k in places])
        u = column(problem.u) if problem.u else Symbol(0, 1)
        y = column(problem.outputs)
        rows = column([*problem.rows, *(row for _, row in self.held)]) if problem.u else Symbol(0, 1)
        self.shape = y.numel(), len(places), u.numel(), rows.numel()
        parts = [y, ca.jacobian(y, axes), ca.jacobian(y, u), ca.jacobian(rows, axes), ca.jacobian(rows, u)]
        flat = [e for p in parts for e in ca.vertsplit(ca.vec(ca.densify(p).T)) if p.numel()]
        varying = [*problem.grid, *problem.u, *problem.modes]
        self.tape = Tape("steady_slopes", varying, problem.common, flat, LANES)

    def valid(self, parameters: NDArray[np.float64]) -> bool:
        """Whether the problem is formulated rightly for these parameters too."""
        return not self.problem.together or np.array_equal(parameters, self._parameters)

    def set_common(self, values: NDArray[np.float64]) -> None:
        """Parameters and inputs that are the same for all points."""
        self.solver.set_common(values)
        self.tape.set_common(values)

    def at(self, grid: Rows, side: Rows | None = None) -> tuple[Rows, NDArray[np.float64]]:
        """Outputs, and their derivatives (output, axis, point)."""
        points = self.solver.solve(grid, side)
        n, a, u, r = self.shape
        with np.errstate(all="ignore"):
            found = self.tape(np.vstack([grid, points.u, points.modes]))
        sizes = np.cumsum([n, n * a, n * u, r * a])
        y, y_a, y_u, r_a, r_u = np.split(found, sizes)
        slopes = y_a.reshape(n, a, -1)
        if u:
            moved = self._moved(points.modes, r_a.reshape(r, a, -1), r_u.reshape(r, u, -1))
            slopes = slopes + np.einsum("nup,uap->nap", y_u.reshape(n, u, -1), moved)
        return y, slopes

    def ends(self, grid: Rows) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The derivatives of the least and of the greatest outputs where laws rest under a prescribed motion."""
        resting = np.flatnonzero(self.solver.solve(grid).rest.any(axis=1))[:_MOST_ENDS]
        values, slopes = [], []
        for ends in product((1.0, -1.0), repeat=len(resting)):
            side = np.ones((len(self.problem.laws), grid.shape[1]))
            side[resting] = np.array(ends)[:, None]
            y, s = self.at(grid, side)
            values.append(y)
            slopes.append(s)
        y, s = np.array(values), np.array(slopes)
        low, high = y.argmin(axis=0)[None, :, None], y.argmax(axis=0)[None, :, None]
        return np.take_along_axis(s, low, 0)[0], np.take_along_axis(s, high, 0)[0]

    def _moved(self, modes: Rows, r_a: NDArray[np.float64], r_u: NDArray[np.float64]) -> NDArray[np.float64]:
        """How the implicit unknowns move: rows of laws that are not held do not count."""
        first = len(self.problem.rows)
        r_a, r_u = r_a.copy(), r_u.copy()
        for j, (k, _) in enumerate(self.held, first):
            holds = modes[k] == (STUCK if isinstance(self.problem.laws[k], Friction) else 1.0)
            r_a[j] *= holds
            r_u[j] *= holds
        count = r_a.shape[-1]
        moved = [-np.linalg.lstsq(r_u[..., p], r_a[..., p], rcond=None)[0] for p in range(count)]
        return np.array(moved, float).reshape(count, r_u.shape[1], r_a.shape[1]).transpose(1, 2, 0)
