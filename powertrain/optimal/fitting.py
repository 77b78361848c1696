"""Identification: parameters and starts by weighted least squares on measured signals, with exact derivatives of the runs.

    minimise sum ((y_i(theta) - v_i) / sigma_i)^2,   covariance = s^2 (J^T J)^-1

with J the derivatives of the residuals; s = 1 if sigma is given, else the standard deviation of the residuals. Directions in which the
residuals hardly change are not determined by the data. They are named, and in these directions the unknowns stay as close to their first
values as the data permit (Tikhonov regularisation with a weight of 1e-6 of the largest singular value of J; P. C. Hansen, Rank-Deficient
and Discrete Ill-Posed Problems, SIAM 1998). Where that weight would be felt in a weak direction that the data do determine, a second
search keeps only the others near their first values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError, SimulationError, suggestion
from powertrain.initialization.outdated import constant_in_tables
from powertrain.language.arguments import by_name, limits, listed, number, tolerances
from powertrain.language.arguments import names as argument_names
from powertrain.language.component import Component
from powertrain.language.labelled import check_stated
from powertrain.language.reals import Array
from powertrain.language.units import with_unit
from powertrain.optimal.experiment import Experiment
from powertrain.plant import Plant, plant_of
from powertrain.result import Result
from powertrain.signals import signals_of
from powertrain.variational.gradients import sensitivities
from powertrain.variational.unknowns import unknowns

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_UNDETERMINED = 1e-6
"""A combination of unknowns is undetermined if the residuals are less sensitive to it than to the most sensitive one by this factor."""
_LOOSE = 1.0
"""A combination of unknowns is undetermined if its standard error exceeds this multiple of the parameters themselves."""
_WEAK = 1e-3
"""In directions weaker than this, relative to the strongest, the regularisation is felt: by the square of its relative weight."""
_PART = 0.01
"""An unknown belongs to an undetermined direction from this share of its largest one on; smaller shares may be inaccuracies of J."""
_IMPROBABLE = 1e-6
"""Residuals are too large for noise if noise of the given sigma exceeds their sum of squares with less than this probability."""


@dataclass(frozen=True)
class FitUnknown:
    """One unknown: a parameter common to all experiments, or (``experiment``) the start of a variable in one of them."""

    label: str
    name: str
    unit: str
    experiment: int | None
    first: float
    low: float
    high: float

    @property
    def scale(self) -> float:
        """Its size."""
        if self.first:
            return abs(self.first)
        span = self.high - self.low
        return span if np.isfinite(span) else 1.0


@dataclass(frozen=True)
class Fit:
    """The result of ``pt.fit``; prints as a table.

    ``values``, ``errors`` (standard errors, inf if the data do not determine the unknown) and ``units`` by name; ``covariance`` in
    the order of ``values``; ``undetermined``: directions, as relative changes of the unknowns, in which the residuals hardly change;
    ``results``: the runs of the experiments with the fitted values; ``cost``: the sum of squares; ``spread``: the standard deviation of the
    residuals divided by sigma, or itself if sigma is unknown; ``evaluations``: the number of sets simulated; ``parameters``: the values
    without initial values; ``at_bounds``: the unknowns limited by a bound, with that bound; ``notes``: the parameters whose effect on
    tables and limits, computed when the model was compiled, the fit does not contain. The standard errors do not take bounds into account.
    """

    values: dict[str, float]
    errors: dict[str, float]
    units: dict[str, str]
    covariance: NDArray[np.float64]
    undetermined: tuple[dict[str, float], ...]
    results: tuple[Result[Any], ...]
    experiments: tuple[Experiment, ...]
    cost: float
    spread: float
    evaluations: int
    message: str
    parameters: dict[str, float] = field(default_factory=dict)
    at_bounds: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def unexplained(self) -> bool:
        """Whether the residuals are larger than noise with the given sigma.

        The fit is then a local minimum that is not the lowest one, or the model lacks an effect. The standard errors do not contain that.
        """
        from scipy.special import gammaincc

        measured = sum(int(np.isfinite(v).sum()) for e in self.experiments for v in e.values.values())
        free = max(measured - len(self.values), 1)
        return self._sigma_given and bool(gammaincc(free / 2, self.cost / 2) < _IMPROBABLE)  # of chi-square

    @property
    def _sigma_given(self) -> bool:
        return all(e.has_sigma for e in self.experiments)

    @property
    def correlation(self) -> pd.DataFrame:
        """The correlations of the unknowns that the data determine."""
        import pandas as pd

        kept = [k for k, e in enumerate(self.errors.values()) if 0.0 < e < np.inf]
        sizes = np.sqrt(np.diag(self.covariance)[kept])
        labels = [list(self.values)[k] for k in kept]
        return pd.DataFrame(self.covariance[np.ix_(kept, kept)] / np.outer(sizes, sizes), labels, labels)

    def residuals(self, experiment: int = 0) -> pd.DataFrame:
        """Simulated minus measured values over time (s), one column per signal."""
        import pandas as pd

        data, run = self.experiments[experiment], self.results[experiment]
        found = run.at(data.grid, list(data.values))
        return pd.DataFrame({n: np.asarray(found[n]) - np.asarray(v) for n, v in data.values.items()}, data.grid)

    def plot(self, experiment: int = 0) -> Figure:
        """Measured and simulated signals, and their residuals."""
        import matplotlib.pyplot as plt

        data, run, left = self.experiments[experiment], self.results[experiment], self.residuals(experiment)
        times = np.union1d(
            run.time, np.linspace(run.time[0], run.time[-1], 500)
        )  # signals are curved within long steps
        fig, axes = plt.subplots(len(data.values), 2, figsize=(10, 2.6 * len(data.values)), squeeze=False, sharex=True)
        for (name, values), (ax, other) in zip(data.values.items(), axes, strict=True):
            ax.plot(data.grid, values, ".", markersize=3, label="measured")
            ax.plot(times, run.at(times, name), label="simulated")
            ax.set_ylabel(f"{name} [{run.units[name]}]")
            other.plot(data.grid, left[name], ".", markersize=3)
            other.axhline(0.0, color="black", linewidth=0.8)
        axes[0, 0].legend()
        axes[0, 0].set_title("Signals")
        axes[0, 1].set_title("Residuals")
        for ax in axes[-1]:
            ax.set_xlabel("Time [s]")
        fig.tight_layout()
        return fig

    def __str__(self) -> str:
        rows = [("", "value", "standard error")]
        rows += [
            (n, with_unit(f"{v:.6g}", self.units[n]), with_unit(f"{self.errors[n]:.2g}", self.units[n]))
            for n, v in self.values.items()
        ]
        widths = [max(len(r[k]) for r in rows) for k in range(3)]
        lines = ["  ".join(f"{c:<{w}}" for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
        count = len(self.results)
        weight = "in units of sigma" if self._sigma_given else "sigma is unknown, all signals have the same weight"
        lines.append(
            f"{count} experiment{'s' * (count != 1)}, standard deviation of the residuals {self.spread:.3g} ({weight})"
        )
        if self.unexplained:
            lines.append(
                "the residuals are larger than sigma explains: a local minimum (start from another guess), or the model lacks an effect; "
                "the standard errors do not contain that"
            )
        lines += [f"{n} is at its bound, {with_unit(f'{v:.6g}', self.units[n])}" for n, v in self.at_bounds.items()]
        for direction in self.undetermined:
            parts = ", ".join(f"{n} {100 * v:+.3g} %" for n, v in direction.items())
            lines.append(f"not determined by the data: the combination {parts}")
        return "\n".join([*lines, *self.notes])

    __repr__ = __str__


def fit(
    plant: Plant[Any] | Component,
    data: Experiment | Sequence[Experiment],
    wrt: str | Sequence[str],
    *,
    first: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    rtol: float = 1e-8,
    atol: float | None = None,
) -> Fit:
    """Fit parameters and initial values to measured signals.

    The derivatives come from the variational equations (see ``pt.gradient``), so there is no step size to choose, and events may move. The
    optimiser is SciPy's trust region reflective method. Directions that the data do not determine stay as close to the initial guess, in
    relative changes, as the data permit. The minimum is local: ``unexplained`` of the result says whether the residuals are larger than
    the ``sigma`` of the measurements.

    Parameters
    ----------
    plant : Plant or Component
        The model.
    data : Experiment or sequence of Experiment
        The measurements.
    wrt : str or sequence of str
        Parameters, common to all experiments, and variables with unknown initial values, one for each experiment.
    first : mapping of str to float, optional
        The initial guess; by default the plant's values and the ``starts`` of the experiments.
    bounds : mapping of str to (float, float), optional
        (low, high) by name.
    rtol, atol : float
        Tolerances of the runs, as of ``Plant.simulate``.

    Returns
    -------
    Fit

    Raises
    ------
    ParameterError
        For unknown names, and unknowns that appear twice or that an experiment gives.
    SimulationError
        If the first run fails, or if a run is not differentiable.
    """
    from scipy.optimize import least_squares

    plant = plant_of(plant)
    experiments = [data] if isinstance(data, Experiment) else listed("data", data)
    if not experiments or not all(isinstance(e, Experiment) for e in experiments):
        raise ParameterError("data: give one pt.Experiment or several")
    asked = _unknowns(plant, experiments, wrt, by_name("first", first), by_name("bounds", bounds))
    if not asked:
        raise ParameterError("wrt is empty; name parameters or variables")
    relative, absolute = tolerances(rtol, atol)
    problem = _LeastSquares(plant, experiments, asked, {"rtol": relative, "atol": absolute, "points": 1})
    scale = np.array([u.scale for u in asked])
    bound = np.array([u.low for u in asked]) / scale, np.array([u.high for u in asked]) / scale
    start = np.clip(np.array([u.first for u in asked]) / scale, *bound)
    weight = _UNDETERMINED * float(np.linalg.norm(problem.jacobian(start * scale) * scale, 2))
    search: Any = least_squares

    def minimum(first: Array, pulled: NDArray[np.float64]) -> Any:
        """The least squares, with the unknowns pulled to the start along some directions."""
        pull = weight * pulled
        return search(
            lambda q: np.concatenate([problem.residuals(q * scale), pull @ (q - start)]), first,
            lambda q: np.vstack([problem.jacobian(q * scale) * scale, pull]),
            bounds=bound, x_scale="jac", xtol=1e-10, ftol=1e-12, gtol=1e-10, max_nfev=200,
        )  # fmt: skip

    found = minimum(start, np.eye(len(start)))
    strengths, directions = _directions(problem.jacobian(found.x * scale) * scale)
    lost = strengths <= _UNDETERMINED * strengths.max()
    if (strengths[~lost] < _WEAK * strengths.max()).any():
        found = minimum(found.x, directions[lost])
    return _summary(problem, asked, found.x * scale, found.active_mask, str(found.message))


def _unknowns(
    plant: Plant[Any], experiments: Sequence[Experiment], wrt: Any, first: Mapping[str, Any], bounds: Mapping[str, Any]
) -> list[FitUnknown]:
    found: list[FitUnknown] = []
    compiled = plant.compiled
    asked = argument_names("wrt", wrt)
    for what, given in (("first", first), ("bounds", bounds)):
        for name in given:
            if name not in asked:
                raise ParameterError(f"{what}: {name} is not among the unknowns{suggestion(name, asked)}")
    for name in asked:
        if asked.count(name) > 1:
            raise ParameterError(f"wrt: {name} appears twice")
        giving = [k for k, e in enumerate(experiments) if name in e.parameters]
        if giving:
            raise ParameterError(
                f"wrt: {name} is unknown, but experiment {giving[0]} gives it; use first for an initial guess"
            )
        low, high = limits(f"bounds: {name}", bounds.get(name, (-np.inf, np.inf)))
        if name in compiled.parameters:
            entry = compiled.parameters[name]
            value = number(f"first: {name}", first.get(name, plant.parameters[name]))
            found.append(FitUnknown(name, name, entry.unit, None, value, low, high))
        elif name in compiled.signals:
            for k, experiment in enumerate(experiments):
                label = name if len(experiments) == 1 else f"{name} (experiment {k})"
                value = number(f"first: {name}", first[name]) if name in first else _start(plant, experiment, name)
                found.append(FitUnknown(label, name, compiled.signals[name].unit, k, value, low, high))
        else:
            known = [*compiled.parameters, *compiled.signals]
            raise ParameterError(f"wrt: the model has no parameter or variable {name}{suggestion(name, known)}")
    return found


def _start(plant: Plant[Any], experiment: Experiment, name: str) -> float:
    """The value of a variable at the start of an experiment."""
    if name in experiment.starts:
        return number(f"starts: {name}", experiment.starts[name])
    given: dict[str, Any] = {n: getattr(experiment, n) for n in ("parameters", "starts", "inputs")}
    return float(plant.start(experiment.begin, **given)[name])


class _LeastSquares:
    """Residuals of all experiments and their derivatives, one set of runs at a time."""

    def __init__(
        self,
        plant: Plant[Any],
        experiments: Sequence[Experiment],
        asked: Sequence[FitUnknown],
        options: Mapping[str, Any],
    ) -> None:
        self.plant, self.experiments, self.asked, self.options = plant, list(experiments), asked, options
        signals = signals_of(plant.compiled)
        self.picked = [[signals.pick(name) for name in e.values] for e in self.experiments]
        for e, picked in zip(self.experiments, self.picked, strict=True):
            for name, one in zip(e.values, picked, strict=True):
                check_stated(f"experiment: {name}", e.units[name], one.unit)
        self.measured = [np.array([np.asarray(v, float) for v in e.values.values()]) for e in self.experiments]
        self.weights = [np.array([[1.0 / (e.deviation(n) or 1.0)] for n in e.values]) for e in self.experiments]
        self.known = all(e.has_sigma for e in self.experiments)
        self.evaluations = 0
        self._at: tuple[bytes, list[Result[Any]]] = (b"", [])

    def named(self, values: Array, experiment: int | None = None) -> dict[str, float]:
        """The values of the parameters, or of the starts of an experiment."""
        return {u.name: float(v) for u, v in zip(self.asked, values, strict=True) if u.experiment == experiment}

    def runs(self, values: Array) -> list[Result[Any]]:
        """The runs of all experiments."""
        if self._at[0] == values.tobytes():
            return self._at[1]
        found = []
        for k, e in enumerate(self.experiments):
            given: dict[str, Any] = {"parameters": {**e.parameters, **self.named(values)}, "inputs": e.inputs}
            given["starts"] = {**e.starts, **self.named(values, k)}
            found.append(self.plant.simulate(e.grid[-1], start=e.begin, **given, **self.options))
        self.evaluations += 1
        self._at = values.tobytes(), found
        return found

    def residuals(self, values: Array) -> Array:
        """All residuals divided by sigma; infinite if the model cannot be simulated with these values."""
        count = sum(int(np.isfinite(m).sum()) for m in self.measured)
        try:
            runs = self.runs(values)
        except (SimulationError, ParameterError):
            return np.full(count, np.inf)
        found = []
        for run, e, measured, weight in zip(runs, self.experiments, self.measured, self.weights, strict=True):
            at = run.at(e.grid, list(e.values))
            left = weight * (np.array([np.asarray(at[name]) for name in e.values]) - measured)
            found.append(left[np.isfinite(measured)])
        return np.concatenate(found)

    def jacobian(self, values: Array) -> NDArray[np.float64]:
        """The derivatives of the residuals with respect to the unknowns."""
        found = []
        for k, (run, e) in enumerate(zip(self.runs(values), self.experiments, strict=True)):
            here = [j for j, u in enumerate(self.asked) if u.experiment in (None, k)]
            wanted = unknowns(run, [self.asked[j].name for j in here])
            order = [wanted.names.index(self.asked[j].name) for j in here]
            slopes = sensitivities(run, self.picked[k], wanted, e.grid)[:, :, order].transpose(1, 0, 2)
            block = np.zeros((*self.measured[k].shape, len(self.asked)))
            block[:, :, here] = self.weights[k][:, :, None] * slopes
            found.append(block[np.isfinite(self.measured[k])])
        return np.concatenate(found)


def _summary(problem: _LeastSquares, asked: Sequence[FitUnknown], values: Array, active: Array, message: str) -> Fit:
    left, jacobian = problem.residuals(values), problem.jacobian(values)
    size = np.maximum(np.abs(values), [u.scale for u in asked])
    spread = float(np.sqrt(left @ left / max(len(left) - len(asked), 1)))
    sigma = 1.0 if problem.known else spread
    strengths, directions = _directions(jacobian * size)
    lost = strengths <= _UNDETERMINED * strengths.max()
    known = directions[~lost]
    covariance = sigma**2 * (known.T / strengths[~lost] ** 2) @ known * np.outer(size, size)
    errors = np.sqrt(np.diag(covariance))
    shares = directions / np.take_along_axis(directions, np.abs(directions).argmax(axis=1)[:, None], axis=1)
    errors[(np.abs(shares[lost]) >= _PART).any(axis=0) | (errors > _LOOSE * size)] = np.inf
    named = [
        {u.label: float(part) for u, part in zip(asked, each, strict=True) if abs(part) >= _PART}
        for each in shares[lost | (sigma > _LOOSE * strengths)]
    ]
    labels = [u.label for u in asked]
    return Fit(
        dict(zip(labels, values.tolist(), strict=True)), dict(zip(labels, errors.tolist(), strict=True)),
        {u.label: u.unit for u in asked}, covariance, tuple(named), tuple(problem.runs(values)),
        tuple(problem.experiments), float(left @ left), spread, problem.evaluations, message,
        problem.named(values),
        {u.label: u.low if side < 0 else u.high for u, side in zip(asked, active.tolist(), strict=True) if side},
        constant_in_tables(problem.plant.compiled, [u.name for u in asked]),
    )  # fmt: skip


def _directions(jacobian: NDArray[np.float64]) -> tuple[Array, NDArray[np.float64]]:
    """How much the residuals change in orthogonal directions of the unknowns, the strongest first, and these directions as rows."""
    missing = np.zeros((max(jacobian.shape[1] - jacobian.shape[0], 0), jacobian.shape[1]))
    return np.linalg.svd(np.vstack([jacobian, missing]), full_matrices=False)[1:]
