"""Second derivatives of a result of a run by differences of its exact gradients, for models that look up maps.

Column j is (g(p + h_j) - g(p - h_j))/(2 h_j) with h_j = 1e-4 |p_j|, or 1e-4 for zeros: 2 n runs with one gradient each for n unknowns.
CasADi takes the second derivatives of linear interpolants as zero, and crashes on those of smooth ones in scalar expressions (3.8.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.language.arguments import by_name
from powertrain.plant import Plant
from powertrain.result import Result
from powertrain.variational.gradients import gradient
from powertrain.variational.instants import NotDifferentiable

_STEP = 1e-4
Matrix = NDArray[np.float64]


def differences(
    plant: Plant[Any], of: Any, names: Sequence[str], run: Result[Any], options: dict[str, Any]
) -> tuple[Matrix, dict[str, float]]:
    """The second derivatives, each mixed one in both orders, and measures of their error: ``asymmetry`` and ``spread``.

    These are the largest difference between both orders, and between forward and backward differences, relative to the geometric mean of
    the diagonal entries. NotDifferentiable if neighbouring runs have other events.
    """
    here = gradient(run, of, names)
    found, spread = np.empty((len(names), len(names))), np.empty((len(names), len(names)))
    middle = np.array([here[each] for each in names])
    for j, name in enumerate(names):
        h = _STEP * (abs(here.at[name]) or 1.0)
        ends = []
        for value in (here.at[name] + h, here.at[name] - h):
            other = plant.simulate(**_with(plant, options, name, value))
            _refuse_other_events(run, other, name, value)
            slopes = gradient(other, of, names)
            ends.append([slopes[each] for each in names])
        after, before = np.array(ends)
        found[:, j], spread[:, j] = (after - before) / (2.0 * h), (after - 2.0 * middle + before) / h
    return found, {"asymmetry": _relative(found - found.T, found), "spread": _relative(spread, found)}


def _with(plant: Plant[Any], options: dict[str, Any], name: str, value: float) -> dict[str, Any]:
    """The options with another value of a parameter or initial value."""
    kind = "parameters" if name in plant.compiled.parameters else "starts"
    return {**options, kind: {**by_name(kind, options.get(kind)), name: value}}


def _refuse_other_events(run: Result[Any], other: Result[Any], name: str, value: float) -> None:
    first, second = ([(e.name, e.new) for e in each.events] for each in (run, other))
    if first == second:
        return
    k = next((i for i, (a, b) in enumerate(zip(first, second, strict=False)) if a != b), min(len(first), len(second)))
    events = list(run.events if k < len(first) else other.events)
    raise NotDifferentiable(
        f"with {name} = {value:.9g} the run has other events, from {events[k].name} at t = {events[k].time:.6g} s on: there is no second "
        "derivative"
    )


def _relative(gaps: Matrix, found: Matrix) -> float:
    """The largest gap relative to the geometric mean of the diagonal entries."""
    diagonal = np.sqrt(np.abs(np.diag(found)))
    scale = np.maximum(np.outer(diagonal, diagonal), np.abs(found + found.T) / 2.0)
    return float(np.divide(np.abs(gaps), scale, out=np.zeros_like(scale), where=scale > 0.0).max(initial=0.0))
