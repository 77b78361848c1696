"""Surrogates: a result of many runs as a Gaussian process of the parameters, with its error in cross-validation."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError, PowertrainError, suggestion
from powertrain.language.arguments import array, by_name, count, names, text
from powertrain.language.reals import Array

if TYPE_CHECKING:
    import pandas as pd

_FEWEST = 3
"""Minimum number of cases per fold: every fold is fitted to most cases."""


class Surrogate:
    """A Gaussian process in place of runs; created by ``pt.surrogate``.

    ``of``, ``wrt``: the result and its parameters; ``ranges``: (low, high) of the cases by parameter; ``cases``: their number;
    ``error``: root mean square error in cross-validation, in the unit of the result; ``largest``: the largest error;
    ``spread``: the standard deviation of the result itself, which is the error of a constant; ``coverage``: the share of cases within
    two of the standard deviations predicted for them (0.95 if these are right).
    """

    def __init__(
        self, of: str, wrt: Sequence[str], points: Array, values: Array, left_out: tuple[Array, Array]
    ) -> None:
        self.of, self.wrt, self.cases = of, tuple(wrt), len(values)
        self.ranges = {n: (float(p.min()), float(p.max())) for n, p in zip(wrt, points.T, strict=True)}
        off = np.abs(left_out[0] - values)
        self.error, self.largest = float(np.sqrt(np.mean(off**2))), float(off.max())
        self.spread, self.coverage = float(values.std()), float(np.mean(off <= 2.0 * left_out[1]))
        self._process = _Process(points, values)

    def __call__(self, values: Mapping[str, ArrayLike]) -> tuple[Array, Array]:
        """The result and its predicted standard deviation for values of all parameters, which broadcast.

        ParameterError for missing parameters, and for values outside the range of the cases.
        """
        given = by_name("values", values)
        for name in self.wrt:
            if name not in given:
                raise ParameterError(f"values: there is no {name}{suggestion(name, list(given))}")
        columns = np.broadcast_arrays(*(array(f"values: {name}", given[name]) for name in self.wrt))
        for name, column in zip(self.wrt, columns, strict=True):
            low, high = self.ranges[name]
            if not ((column >= low) & (column <= high)).all():
                raise ParameterError(f"values: {name} leaves the range of the cases, {low:g} to {high:g}")
        mean, deviation = self._process(np.stack([c.ravel() for c in columns], axis=1))
        return np.reshape(mean, columns[0].shape), np.reshape(deviation, columns[0].shape)

    def __str__(self) -> str:
        return (
            f"{self.of} of {', '.join(self.wrt)} from {self.cases} cases: cross-validated error {self.error:.3g} "
            f"(largest {self.largest:.3g}), spread of the result {self.spread:.3g}, "
            f"{100 * self.coverage:.0f} % within two predicted standard deviations"
        )

    __repr__ = __str__


def surrogate(table: pd.DataFrame, of: str, wrt: str | Sequence[str], *, folds: int = 10, seed: int = 0) -> Surrogate:
    """Fit a Gaussian process to a result of many runs.

    The covariance is a Matern function (nu = 5/2) with a length for each parameter, plus noise; its constants maximise the likelihood
    (C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, chapters 2 and 5). In
    cross-validation all of them are fitted anew without the cases of the fold.

    Parameters
    ----------
    table
        One row for each run, as ``pt.sweep(...).table``. Rows of failed runs, without a value, are left out.
    of
        The column of the result.
    wrt
        The columns of the parameters that were varied.
    folds
        Folds of the cross-validation: each is predicted from the others.
    seed
        Equal seeds give equal folds.

    Returns
    -------
    Surrogate
        A function of the parameters, with its error.

    Raises
    ------
    ParameterError
        For columns that do not exist or do not vary, and too few rows: three for each fold.
    PowertrainError
        If scikit-learn is not installed: ``pip install 'powertrain[uncertainty]'``.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> import powertrain as pt
    >>> x = np.linspace(0.0, 1.0, 30)
    >>> model = pt.surrogate(pd.DataFrame({"x": x, "y": np.sin(3.0 * x)}), "y", "x")
    >>> model.error < 1e-3 * model.spread, round(float(model({"x": 0.5})[0]), 3)
    (True, 0.997)
    """
    try:
        split = import_module("sklearn.model_selection").KFold
    except ImportError:
        raise PowertrainError("surrogate needs scikit-learn: pip install 'powertrain[uncertainty]'") from None
    chosen, parts, seed = names("wrt", wrt), count("folds", folds), count("seed", seed, least=0)
    if parts < 2:
        raise ParameterError(f"folds = {parts}: cross-validation needs at least two")
    for name in (text("of", of), *chosen):
        if name not in table.columns:
            known = [str(c) for c in table.columns]
            raise ParameterError(f"the table has no column {name}{suggestion(name, known)}")
    kept = table[[of, *chosen]].to_numpy(float)
    kept = kept[np.isfinite(kept).all(axis=1)]
    if len(kept) < _FEWEST * parts:
        raise ParameterError(
            f"{len(kept)} rows with values are too few for {parts} folds; take {_FEWEST * parts} or more"
        )
    values, points = kept[:, 0], kept[:, 1:]
    for name, column in zip((of, *chosen), kept.T, strict=True):
        if not np.ptp(column) > 0.0:
            raise ParameterError(f"{name} is {column[0]:g} in all rows: it was not varied")
    mean, deviation = np.empty_like(values), np.empty_like(values)
    for known_rows, left in split(parts, shuffle=True, random_state=seed).split(points):
        mean[left], deviation[left] = _Process(points[known_rows], values[known_rows])(points[left])
    return Surrogate(of, chosen, points, values, (mean, deviation))


class _Process:
    """A Gaussian process of parameters that are scaled to their spread."""

    def __init__(self, points: Array, values: Array) -> None:
        gaussian, limits = import_module("sklearn.gaussian_process"), import_module("threadpoolctl").threadpool_limits
        kernels = gaussian.kernels
        self.middle, self.size = points.mean(axis=0), points.std(axis=0)
        lengths = kernels.Matern(np.ones(points.shape[1]), (1e-2, 1e4), nu=2.5)
        kernel = kernels.ConstantKernel(1.0, (1e-3, 1e6)) * lengths + kernels.WhiteKernel(1e-6, (1e-12, 1.0))
        self.process = gaussian.GaussianProcessRegressor(
            kernel, normalize_y=True, n_restarts_optimizer=1, random_state=0
        )
        with warnings.catch_warnings(), limits(1):  # threads cost more than they save for matrices of this size
            warnings.simplefilter("ignore")  # a length or noise at its limit is acceptable: the error is measured
            self.process.fit((points - self.middle) / self.size, values)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Means and standard deviations."""
        mean, deviation = self.process.predict((points - self.middle) / self.size, return_std=True)
        return np.asarray(mean), np.asarray(deviation)
