"""Cases for sweeps from distributions on parameters: Latin hypercube and Sobol' points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, count, limits, one_of

Sampling = Literal["latin hypercube", "sobol"]


def sample(
    distributions: Mapping[str, Any], number: int, *, method: Sampling = "latin hypercube", seed: int = 0
) -> list[dict[str, dict[str, float]]]:
    """Cases for ``pt.sweep`` with parameters drawn from distributions.

    Parameters
    ----------
    distributions
        By the name of the parameter, in its unit: (low, high) for a uniform distribution, or a frozen distribution of scipy.stats.
        Parameters are independent.
    number
        Number of cases; for "sobol" a power of two, because otherwise its points are not balanced.
    method
        "latin hypercube": every parameter has one value in each of ``number`` slices of equal probability. "sobol": a scrambled Sobol'
        sequence, whose means converge almost with 1/number.
    seed
        Equal seeds, whole numbers from 0 on, give equal cases.

    Returns
    -------
    list
        ``{"parameters": {name: value}}`` for each case.

    Raises
    ------
    ParameterError
        For empty ranges, unknown methods, values that are not finite, and a number that does not suit the method.

    Examples
    --------
    >>> import powertrain as pt
    >>> cases = pt.sample({"J1.J": (0.9, 1.1), "clutch.mue": (0.3, 0.5)}, 4)
    >>> [sorted(case["parameters"]) for case in cases][0]
    ['J1.J', 'clutch.mue']
    """
    from scipy.stats import qmc

    one_of("method", method, ("latin hypercube", "sobol"))
    given, n, seed = by_name("distributions", distributions), points_of(method, number), count("seed", seed, least=0)
    if not given:
        raise ParameterError("distributions: give at least one parameter")
    drawn = qmc.LatinHypercube(len(given), rng=seed) if method != "sobol" else qmc.Sobol(len(given), rng=seed)
    points = drawn.random(n)
    columns = {name: quantiles(name, d, points[:, k]) for k, (name, d) in enumerate(given.items())}
    return [{"parameters": {name: float(values[i]) for name, values in columns.items()}} for i in range(n)]


def points_of(method: str, number: int) -> int:
    """A number of points. ParameterError for one that does not suit the method."""
    n = count("number", number)
    if method == "sobol" and n & (n - 1):
        raise ParameterError(
            f"number = {n} is not a power of two, which Sobol' points need; take {1 << n.bit_length()}"
        )
    return n


def quantiles(name: str, distribution: Any, at: NDArray[np.float64]) -> NDArray[np.float64]:
    """The values of a parameter at quantiles of its distribution. ParameterError if they are not finite."""
    if hasattr(distribution, "ppf"):
        values = np.asarray(distribution.ppf(at), float)
    else:
        low, high = limits(f"distributions: {name}", distribution)
        values = low + (high - low) * at
    if values.shape != at.shape or not np.isfinite(values).all():
        raise ParameterError(f"distributions: {name} gives values that are not finite numbers")
    return values
