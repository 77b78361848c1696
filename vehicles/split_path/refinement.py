"""The basic ratio of a split-path transmission that suits a duty best, by exact derivatives of the acausal model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import powertrain as pt
from powertrain.vehicles.split_path.bench import SplitPathBench
from powertrain.vehicles.split_path.duty import R_O, SIGNALS, Duty, Unit, Vector, part_of, unit_margins

_MET = 1e-9


@dataclass(frozen=True)
class Refined:
    """A basic ratio at which the mean efficiency is best, with what it was before; ``path`` are the ratios that were looked at."""

    R_o: float
    mean_efficiency: float
    before: float
    slope: float
    max_K: float
    V_min: float
    V_max: float
    path: tuple[float, ...]
    message: str


def refine_ratio(
    plants: Sequence[pt.Plant[SplitPathBench]],
    duty: Duty,
    start: float,
    bounds: tuple[float, float],
    *,
    unit: Unit = None,
    max_K: float = math.inf,
) -> Refined:
    """The R_o within bounds that has the greatest mean efficiency, by sequential quadratic programming with derivatives of the model.

    ``plants``: one, or those below and above r = 1. The unit's range and ``max_K`` are constraints. Where the mesh is stuck the least
    efficiency counts, as in ``SplitPathDesigns.table``. Raises ParameterError where the start cannot do the duty or nothing is found.
    """
    from scipy import optimize

    minimize: Any = optimize.minimize
    problem = _Refinement(plants, duty, unit, max_K)
    before = problem.at(start)
    if not math.isfinite(before.mean):
        raise pt.ParameterError(f"R_o = {start:g} cannot do this duty, so that there is nothing to refine")
    found = minimize(
        lambda x: (-problem.at(x[0]).mean, np.array([-problem.at(x[0]).slope])),
        [start],
        jac=True,
        method="SLSQP",
        bounds=[bounds],
        constraints={
            "type": "ineq",
            "fun": lambda x: problem.at(x[0]).margins,
            "jac": lambda x: problem.at(x[0]).margin_slopes[:, None],
        },
        options={"ftol": 1e-14, "maxiter": 100},
    )
    met = {x: problem.at(x) for x in problem.looked if problem.at(x).meets}
    if not met:
        raise pt.ParameterError(
            f"no basic ratio between {bounds[0]:g} and {bounds[1]:g} can do this duty within its limits"
        )
    R_o = max(met, key=lambda x: met[x].mean)
    best = met[R_o]
    return Refined(
        R_o, best.mean, before.mean, best.slope, best.K, best.V[0], best.V[1], tuple(problem.looked), str(found.message)
    )


@dataclass(frozen=True)
class _Sample:
    """The mean efficiency, the margins of all constraints, and their derivatives with respect to R_o."""

    mean: float
    slope: float
    margins: Vector
    margin_slopes: Vector
    K: float
    V: tuple[float, float]

    @property
    def meets(self) -> bool:
        """Whether the duty can be done within the limits."""
        return math.isfinite(self.mean) and bool((self.margins >= -_MET).all())


class _Refinement:
    """The duty as a function of R_o."""

    def __init__(self, plants: Sequence[pt.Plant[SplitPathBench]], duty: Duty, unit: Unit, max_K: float) -> None:
        below = duty.r <= 1
        masks = [np.ones(duty.r.size, bool)] if len(plants) == 1 else [below, ~below]
        self.parts = [(plant, part_of(duty, mask)) for plant, mask in zip(plants, masks, strict=True)]
        self.unit, self.max_K = unit, max_K
        self._known: dict[float, _Sample] = {}

    @property
    def looked(self) -> list[float]:
        """The ratios that were looked at."""
        return list(self._known)

    def at(self, R_o: float) -> _Sample:
        """Values and derivatives at one basic ratio."""
        R_o = float(R_o)
        if R_o not in self._known:
            self._known[R_o] = self._sample(R_o)
        return self._known[R_o]

    def _sample(self, R_o: float) -> _Sample:
        found = [
            pt.steady_gradient(plant, {**duty.grid([R_o]), R_O: R_o}, R_O, outputs=SIGNALS[:3])
            for plant, duty in self.parts
        ]
        weight = np.concatenate([d.weight for _, d in self.parts])
        turns = np.concatenate([d.r != 0 for _, d in self.parts])

        def whole(name: str, end: str) -> Vector:
            return np.concatenate([f[name + end if name + end in f else name].to_numpy() for f in found])

        eta, eta_s, some = whole("efficiency", "_low"), whole(f"d(efficiency)/d({R_O})", "_low"), weight > 0
        mean = float(1 / (weight[some] / eta[some]).sum())
        slope = float(mean**2 * (weight[some] / eta[some] ** 2 * eta_s[some]).sum())
        V, V_s = whole("V", "_low"), whole(f"d(V)/d({R_O})", "_low")
        K, K_s = _largest(*(whole(n, end)[turns] for end in ("_low", "_high") for n in ("K", f"d(K)/d({R_O})")))
        margins, slopes = self._constraints(V, V_s)
        if math.isfinite(self.max_K):
            margins, slopes = np.append(margins, self.max_K - K), np.append(slopes, -K_s)
        return _Sample(mean, slope, margins, slopes, K, (float(V.min()), float(V.max())))

    def _constraints(self, V: Vector, V_s: Vector) -> tuple[Vector, Vector]:
        if len(self.parts) == 2:
            V, V_s = np.append(V, 1.0), np.append(V_s, 0.0)
        low, high = int(V.argmin()), int(V.argmax())
        margins = unit_margins(V, self.unit)
        if self.unit is None:
            return margins, np.zeros(1)
        if isinstance(self.unit, tuple):
            return margins, np.array([V_s[low], -V_s[high]])
        if V[high] > 0:
            return margins, np.array([self.unit * V_s[low] - V_s[high], V_s[low]])
        return margins, np.array([V_s[low] - self.unit * V_s[high], -V_s[high]])


def _largest(low: Vector, low_s: Vector, high: Vector, high_s: Vector) -> tuple[float, float]:
    """The greatest size, and its derivative."""
    values, slopes = np.append(low, high), np.append(low_s, high_s)
    if not np.isfinite(values).any():
        return math.inf, 0.0
    k = int(np.nanargmax(np.abs(values)))
    return float(abs(values[k])), float(np.sign(values[k]) * slopes[k])
