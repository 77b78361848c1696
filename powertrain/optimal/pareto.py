"""Pareto fronts: parameters for which no result can be improved without making another one worse."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from powertrain.analysis.sweeping import sweep
from powertrain.errors import ParameterError, PowertrainError
from powertrain.language.arguments import by_name, count, limits, one_of
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.plant import Plant, plant_of
from powertrain.variational.gradients import gradient, number_of
from powertrain.variational.objectives import Objective, objective

if TYPE_CHECKING:
    import pandas as pd

_SAME = 1e-6
"""Objectives that differ by less than this share of the front are equal."""
_ACCURACY, _STEPS = 1e-9, 40
"""Accuracy of a minimum relative to the front, about that of a run, and the largest number of iterations."""
_REST = 1e-4
"""Weight of all other results: where the minimum leaves an unknown free, it takes the best value for these."""


def pareto_front(
    plant: Plant[Any] | Component,
    of: Mapping[str, Any],
    bounds: Mapping[str, tuple[float, float]],
    *,
    points: int = 20,
    method: Literal["gradient", "nsga2"] = "gradient",
    generations: int = 40,
    seed: int = 0,
    executor: Executor | None = None,
    **options: Any,
) -> pd.DataFrame:
    """Pareto-optimal parameters, for which no result improves without another one getting worse, and the results there.

    Parameters
    ----------
    of
        The results to be minimised, at least two, by name; as for ``pt.gradient``. To maximise one, give its negative:
        ``-1 * pt.final("car.w")``.
    bounds
        (low, high) of each parameter, in its unit.
    points
        Number of points of the front, for three or more results at least; with "nsga2" the size of the population.
    method
        "gradient": each point minimises the largest weighted distance from the ideal results, plus a small share of their sum
        (Wierzbicki, Mathematical Modelling 3 (1982) 391-405), by SLSQP with exact gradients; local, for smooth results, also on concave
        fronts. "nsga2": the evolutionary algorithm of Deb et al. (IEEE Trans. Evol. Comput. 6 (2002) 182-197), for results that jump or
        have many local minima.
    generations, seed, executor
        For "nsga2": the number of generations, the seed of its random numbers, and an executor as for ``pt.sweep``.
    options
        Options of ``Plant.simulate``, such as ``stop=2.0``.

    Returns
    -------
    pandas.DataFrame
        One row for each point of the front, sorted by the first result: the results, then the parameters. Dominated points are
        left out. ``attrs["runs"]`` is the number of runs.

    Raises
    ------
    PowertrainError
        For "nsga2" without pymoo: ``pip install 'powertrain[uncertainty]'``.
    ParameterError
        For unknown names, empty bounds, fewer than two results; SimulationError if a run fails, or has no derivative.

    Examples
    --------
    >>> import powertrain as pt
    >>> class Compromise(pt.Component):
    ...     p: pt.Parameter = pt.parameter("1", "What is chosen", default=0.0)
    ...     a: pt.Variable = pt.variable("1", "Integral of p^2", start=0.0)
    ...     b: pt.Variable = pt.variable("1", "Integral of (p - 1)^2", start=0.0)
    ...
    ...     def equations(self):
    ...         yield pt.der(self.a) == self.p**2
    ...         yield pt.der(self.b) == (self.p - 1) ** 2
    >>> pt.pareto_front(Compromise(), {"a": "a", "b": "b"}, {"p": (-2, 2)}, points=3, stop=1.0).round(3).values.tolist()
    [[0.0, 1.0, 0.0], [0.25, 0.25, 0.5], [1.0, 0.0, 1.0]]
    """
    import pandas as pd

    one_of("method", method, ("gradient", "nsga2"))
    plant = plant_of(plant)
    results = {name: objective(what) for name, what in by_name("of", of).items()}
    ranges = {name: limits(f"bounds: {name}", given) for name, given in by_name("bounds", bounds).items()}
    if len(results) < 2 or not ranges:
        raise ParameterError("of, bounds: give at least two results and one parameter")
    problem = _Problem(plant, results, ranges, executor, options)
    most = count("points", points)
    if method == "gradient":
        found = np.array(list(_scalarised(problem, most)))
    else:
        found = _evolved(problem, most, count("generations", generations), seed)
    values = problem.values(found)
    front = _undominated(values)
    rows = np.hstack([values[front], problem.parameters(found[front])])
    table = pd.DataFrame(rows, columns=[*results, *ranges]).sort_values(next(iter(results)), ignore_index=True)
    table.attrs["runs"] = problem.runs
    return table


class _Problem:
    """Results as functions of parameters in the unit cube."""

    def __init__(
        self, plant: Plant[Any], results: Mapping[str, Objective], ranges: Mapping[str, tuple[float, float]],
        executor: Executor | None, options: Mapping[str, Any],
    ) -> None:  # fmt: skip
        self.plant, self.results, self.names = plant, results, list(ranges)
        self.low, high = np.array(list(ranges.values()), float).T
        self.width = high - self.low
        self.executor, self.options, self.runs = executor, dict(options), 0
        self.fixed = dict(self.options.pop("parameters", None) or {})
        self._known: dict[bytes, tuple[Array, Array]] = {}

    def parameters(self, u: Array) -> Array:
        return np.asarray(self.low + self.width * u)

    def _case(self, u: Array) -> dict[str, float]:
        return {**self.fixed, **dict(zip(self.names, self.parameters(u).tolist(), strict=True))}

    def values(self, points: Array) -> Array:
        """(point, result)."""
        cases = [{"parameters": self._case(u)} for u in points]
        scalars = {name: partial(number_of, of=what) for name, what in self.results.items()}
        self.runs += len(cases)
        runs = sweep(self.plant, cases, scalars=scalars, executor=self.executor, **self.options)
        return np.asarray(runs.table[list(self.results)], float)

    def slopes(self, u: Array) -> tuple[Array, Array]:
        """The results at one point, and their derivatives (result, parameter)."""
        key = u.tobytes()
        if key not in self._known:
            run = self.plant.simulate(parameters=self._case(u), **self.options)
            self.runs += 1
            found = [gradient(run, what, self.names) for what in self.results.values()]
            values, slopes = np.array([g.value for g in found]), np.array([g.array for g in found])
            self._known[key] = values, slopes * self.width
        return self._known[key]


def _scalarised(problem: _Problem, points: int) -> Iterator[Array]:
    """The minima of single results, then the minima of the largest weighted distance from the ideal."""
    n, k = len(problem.names), len(problem.results)
    corners = [_least(problem, np.full(n, 0.5), i) for i in range(k)]
    values = np.array([problem.slopes(u)[0] for u in corners])
    ideal, width = values.min(axis=0), np.ptp(values, axis=0)
    yield from corners
    if not (width > 0.0).all():
        return
    for weights in _lattice(k, points - k):
        start = (1.0 - weights) / (k - 1) @ np.array(corners)  # away from the minima of results with large weights
        yield _nearest(problem, start, ideal, width * weights)


def _lattice(k: int, points: int) -> Iterator[Array]:
    """Positive weights that sum to one, evenly spaced, at least ``points`` of them (Das and Dennis, without the edges)."""
    parts = k
    while comb(parts - 1, k - 1) < points:
        parts += 1
    for cuts in combinations(range(1, parts), k - 1) if points > 0 else ():
        yield np.diff([0, *cuts, parts]) / parts


def _least(problem: _Problem, start: Array, i: int) -> Array:
    """The minimum of one result, and there of the others."""
    one, before = np.eye(len(problem.results))[i], _sizes(problem, start)
    alone = _weighted(problem, one / before, start)
    return _weighted(problem, np.where(one > 0.0, 1.0 / before, _REST / _sizes(problem, alone)) / _REST, alone)


def _sizes(problem: _Problem, u: Array) -> Array:
    """The sizes of the results at a point: their values, or their changes over the bounds if these are larger."""
    values, slopes = problem.slopes(u)
    sizes = np.maximum(np.abs(values), np.abs(slopes).max(axis=1))
    return np.asarray(np.where(sizes > 0.0, sizes, 1.0))


def _weighted(problem: _Problem, weights: Array, start: Array) -> Array:
    """The minimum of a weighted sum of the results."""
    return _minimum(lambda u: float(weights @ problem.slopes(u)[0]), lambda u: weights @ problem.slopes(u)[1], start)


def _nearest(problem: _Problem, start: Array, ideal: Array, width: Array) -> Array:
    """The point and s with the smallest s + share sum d, for which the distances d_i = (f_i - ideal_i)/width_i <= s."""

    def distances(v: Array) -> Array:
        return np.asarray((problem.slopes(v[:-1])[0] - ideal) / width)

    def slopes(v: Array) -> Array:
        return np.asarray(problem.slopes(v[:-1])[1] / width[:, None])

    above = {
        "type": "ineq",
        "fun": lambda v: v[-1] - distances(v),
        "jac": lambda v: np.column_stack([-slopes(v), np.ones(len(width))]),
    }
    first = np.append(start, 0.0)
    first[-1] = distances(first).max()
    return _minimum(
        lambda v: v[-1] + _REST * distances(v).sum(),
        lambda v: np.append(_REST * slopes(v).sum(axis=0), 1.0),
        first,
        [(None, None)],
        constraints=above,
    )[:-1]


def _minimum(
    value: Callable[[Array], float],
    slope: Callable[[Array], Array],
    start: Array,
    free: Sequence[Any] = (),
    **more: Any,
) -> Array:
    """The minimum of a function of a point in the unit cube, and of other unknowns with the bounds ``free``."""
    from scipy import optimize

    bounds = [(0.0, 1.0)] * (len(start) - len(free)) + list(free)
    ends: dict[str, Any] = {"ftol": _ACCURACY, "maxiter": _STEPS}
    solve: Any = optimize.minimize
    found = solve(value, start, jac=slope, method="SLSQP", bounds=bounds, options=ends, **more).x
    inside = slice(0, len(start) - len(free))
    found[inside] = np.clip(found[inside], 0.0, 1.0)
    return np.asarray(found, float)


def _evolved(problem: _Problem, size: int, generations: int, seed: int) -> Array:
    """The population of NSGA-II."""
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.config import Config
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize
    except ImportError:
        raise PowertrainError("NSGA-II needs pymoo: pip install 'powertrain[uncertainty]'") from None
    Config.warnings["not_compiled"] = False

    class Runs(Problem):  # type: ignore[misc]
        def _evaluate(self, x: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
            out["F"] = problem.values(x)

    cube = Runs(n_var=len(problem.names), n_obj=len(problem.results), xl=0.0, xu=1.0)
    found = minimize(cube, NSGA2(pop_size=size), ("n_gen", generations), seed=seed)
    return np.atleast_2d(np.asarray(found.X, float))


def _undominated(values: Array) -> list[int]:
    """The points that no other one dominates, without duplicates."""
    scale = np.ptp(values, axis=0)
    near = _SAME * np.where(scale > 0.0, scale, 1.0)
    kept: list[int] = []
    for i in np.lexsort(values.T[::-1]):
        better = (values <= values[i] + near).all(axis=1) & (values < values[i] - near).any(axis=1)
        same = any((np.abs(values[j] - values[i]) <= near).all() for j in kept)
        if not better.any() and not same:
            kept.append(int(i))
    return kept
