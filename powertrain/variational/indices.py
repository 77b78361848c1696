"""Which parameters cause the scatter of a result: Sobol' and Morris indices, and first-order shares from gradients."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from powertrain.analysis.sampling import points_of, quantiles
from powertrain.analysis.sweeping import sweep
from powertrain.errors import ParameterError, PowertrainError
from powertrain.language.arguments import by_name, count, one_of
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.plant import Plant, plant_of
from powertrain.variational.gradients import gradient, number_of
from powertrain.variational.objectives import Objective, objective

if TYPE_CHECKING:
    import xarray as xr

_SHOWN = {
    "sobol": {
        "first": ("S1", "Sobol' index of first order"),
        "first_error": ("S1_conf", "Half the 95 % confidence interval of first"),
        "total": ("ST", "Total Sobol' index"),
        "total_error": ("ST_conf", "Half the 95 % confidence interval of total"),
    },
    "morris": {
        "mean": ("mu", "Mean elementary effect"),
        "magnitude": ("mu_star", "Mean magnitude of the elementary effects"),
        "magnitude_error": ("mu_star_conf", "Half the 95 % confidence interval of magnitude"),
        "scatter": ("sigma", "Standard deviation of the elementary effects"),
    },
}


def sensitivity_indices(
    plant: Plant[Any] | Component,
    of: Mapping[str, Any],
    distributions: Mapping[str, Any],
    number: int,
    *,
    method: Literal["sobol", "morris"] = "sobol",
    seed: int = 0,
    executor: Executor | None = None,
    progress: bool = False,
    **options: Any,
) -> xr.Dataset:
    """Shares of the parameters in the scatter of results, from many runs, and from the gradient of one run.

    Parameters
    ----------
    of
        Results by name: signals (their final values), or ``pt.integral``, ``pt.maximum`` and the like; see ``pt.gradient``.
    distributions
        Distributions of the parameters, as for ``pt.sample``: (low, high), or a frozen distribution of scipy.stats; independent.
    number
        For "sobol" the number n of base points, a power of two: n (k + 2) runs with k parameters. For "morris" the number n of
        trajectories: n (k + 1) runs.
    method
        "sobol": shares of the variance, first-order S_i = Var(E(y|p_i))/Var(y) and total E(Var(y|all but p_i))/Var(y) (Saltelli et al.,
        Computer Physics Communications 181 (2010) 259-270). "morris": elementary effects, the change of the result per full range
        of each parameter, for screening many parameters (Morris, Technometrics 33 (1991) 161-174); it needs bounded distributions.
    seed, executor, progress
        As for ``pt.sample`` and ``pt.sweep``.
    options
        Options of ``Plant.simulate``, such as ``stop=2.0``.

    Returns
    -------
    xarray.Dataset
        Over ``parameter`` and ``result``. "sobol": ``first`` and ``total`` [1], with half their 95 % confidence intervals ``first_error``
        and ``total_error``. "morris": ``mean``, ``magnitude`` (with ``magnitude_error``) and ``scatter`` in the unit of the result.
        Both: ``linear`` [1], the share (dy/dp_i)^2 Var(p_i) of the sum of these at the medians, from one run and its exact gradient.
        If ``linear`` agrees with ``first``, one run is sufficient. The attribute ``runs`` is the number of runs.

    Raises
    ------
    PowertrainError
        If SALib is not installed: ``pip install 'powertrain[uncertainty]'``.
    ParameterError
        For unknown names and numbers that do not suit the method; SimulationError if a run fails or has no derivative.

    Examples
    --------
    >>> import powertrain as pt
    >>> class Product(pt.Component):
    ...     a: pt.Parameter = pt.parameter("1", "First factor", default=0.5)
    ...     b: pt.Parameter = pt.parameter("1", "Second factor", default=0.5)
    ...     y: pt.Variable = pt.variable("1", "Integral of the product", start=0.0)
    ...
    ...     def equations(self):
    ...         yield pt.der(self.y) == self.a * self.b
    >>> found = pt.sensitivity_indices(Product(), {"y": "y"}, {"a": (0, 1), "b": (0, 1)}, 64, stop=1.0)
    >>> found["linear"].sel(result="y").values.round(6).tolist()
    [0.5, 0.5]
    """
    import xarray as xr

    one_of("method", method, tuple(_SHOWN))
    plant = plant_of(plant)
    results = {name: objective(what) for name, what in by_name("of", of).items()}
    given = by_name("distributions", distributions)
    if not results or not given:
        raise ParameterError("of, distributions: give at least one result and one parameter")
    n, seed = points_of(method, number), count("seed", seed, least=0)
    problem = {"num_vars": len(given), "names": list(given), "bounds": [[0.0, 1.0]] * len(given)}
    points, analyse = _salib(method, problem, n, seed)
    values = np.array([quantiles(name, d, points[:, k]) for k, (name, d) in enumerate(given.items())]).T
    cases = [{"parameters": dict(zip(given, row, strict=True))} for row in values.tolist()]
    scalars = {name: partial(number_of, of=what) for name, what in results.items()}
    table = sweep(plant, cases, scalars=scalars, executor=executor, progress=progress, **options).table
    shown = _SHOWN[method]
    found = np.zeros((len(shown), len(given), len(results)))
    for j, name in enumerate(results):
        y = table[name].to_numpy(float)
        if np.ptp(y) > 0.0:
            analysed = analyse(y)
            found[:, :, j] = [np.asarray(analysed[key], float) for key, _ in shown.values()]
    dims = ("parameter", "result")
    data = {name: (dims, found[i], {"long_name": doc}) for i, (name, (_, doc)) in enumerate(shown.items())}
    data["linear"] = (
        dims,
        _linear(plant, results, given, options),
        {"long_name": "Share of the variance by the gradient"},
    )
    return xr.Dataset(data, {"parameter": list(given), "result": list(results)}, {"runs": len(cases), "method": method})


def _salib(method: str, problem: dict[str, Any], number: int, seed: int) -> tuple[Array, Any]:
    """The points in the unit cube, and the function that computes the indices from the results there."""
    try:
        draw, analysis = (import_module(f"SALib.{part}.{method}") for part in ("sample", "analyze"))
    except ImportError:
        raise PowertrainError("Sobol' and Morris indices need SALib: pip install 'powertrain[uncertainty]'") from None
    if method == "sobol":
        points = draw.sample(problem, number, calc_second_order=False, seed=seed)
        return points, partial(analysis.analyze, problem, calc_second_order=False, seed=seed)
    points = draw.sample(problem, number, seed=seed)
    return points, partial(analysis.analyze, problem, points, seed=seed)


def _linear(
    plant: Plant[Any], results: Mapping[str, Objective], given: Mapping[str, Any], options: Mapping[str, Any]
) -> Array:
    """(dy/dp_i)^2 Var(p_i) divided by its sum, at the medians: (parameter, result)."""
    middle = {name: float(quantiles(name, d, np.array([0.5]))[0]) for name, d in given.items()}
    fixed = options.get("parameters") or {}
    run = plant.simulate(**{**options, "parameters": {**fixed, **middle}})
    spread = np.array([_deviation(d) for d in given.values()])
    found = np.array([(gradient(run, what, list(given)).array * spread) ** 2 for what in results.values()]).T
    total = found.sum(axis=0)
    return np.asarray(np.divide(found, total, out=np.zeros_like(found), where=total > 0.0))


def _deviation(distribution: Any) -> float:
    if hasattr(distribution, "std"):
        return float(distribution.std())
    low, high = distribution
    return float((high - low) / np.sqrt(12.0))
