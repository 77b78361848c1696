"""The optimal basic ratio of a split-path transmission for a duty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

import powertrain as pt
from powertrain.design.bench import SplitPathBench
from powertrain.design.duty import Duty
from powertrain.design.evaluation import Demands, EvaluatedLayout, row

Rank = Literal["mean_efficiency", "min_efficiency", "max_K", "unit_range"]
SIGN: dict[Rank, int] = {"mean_efficiency": -1, "min_efficiency": -1, "max_K": 1, "unit_range": 1}
"""The criteria for ranking designs: 1 if smaller is better."""
_FIRST, _ZOOM = 25, 9
_NARROW = 1e-9
"""Width, as a share of the bounds, to which the best ratio is located."""


@dataclass(frozen=True)
class Refined:
    """The best basic ratio by the criterion ``by``, with its ``value`` and the value ``before``.

    ``edge``: it is at the edge of the bounds, so a better one may lie beyond. ``path``: the ratios evaluated.
    """

    R_o: float
    by: Rank
    value: float
    before: float
    mean_efficiency: float
    max_K: float
    V_min: float
    V_max: float
    edge: bool
    path: tuple[float, ...]

    def __str__(self) -> str:
        said = f"R_o = {self.R_o:.6g}: {self.by} {self.value:.6g} (before: {self.before:.6g})"
        return f"{said}; at the edge of the bounds, a better one may lie beyond" if self.edge else said


def refine_ratio(
    plants: Sequence[pt.Plant[SplitPathBench]],
    duty: Duty,
    start: float,
    bounds: tuple[float, float],
    demands: Demands,
    by: Rank,
) -> Refined:
    """The R_o within bounds that is best by one column of ``SplitPathDesigns.table`` and meets the demands on the unit.

    The best ratio usually lies on a ridge, where two ends of the range are equally bad or where the range of the unit ends; derivatives do
    not lead there. Therefore the bounds are sampled, then repeatedly the neighbourhood of the best sample, with all samples of a round
    in one array.

    Parameters
    ----------
    plants : sequence of Plant
        One compiled bench, or two for below and above r = 1.
    duty : Duty
        The required ratios.
    start : float
        Basic ratio to be improved.
    bounds : (float, float)
        Lowest and highest basic ratio.
    demands : Demands
        What the unit must meet.
    by : str
        The criterion, a column of the table.

    Returns
    -------
    Refined

    Raises
    ------
    ParameterError
        If the start does not satisfy the duty, or if nothing is found.
    """
    known: dict[float, dict[str, float]] = {}

    def look(ratios: list[float]) -> None:
        new = [x for x in dict.fromkeys(map(float, ratios)) if x not in known]
        if new:
            layouts = [EvaluatedLayout.of(plant, duty, np.array(new)) for plant in plants]
            known.update({x: row(layouts, k, duty, demands) for k, x in enumerate(new)})

    low, high = min(bounds), max(bounds)
    look([start, *np.linspace(low, high, _FIRST)])
    if not math.isfinite(known[start]["mean_efficiency"]):
        raise pt.ParameterError(f"R_o = {start:g} does not meet this duty, so there is nothing to refine")
    width = (high - low) / (_FIRST - 1)
    while True:
        met = [x for x, found in known.items() if not found["problem"] and low <= x <= high]
        if not met:
            raise pt.ParameterError(f"no basic ratio between {low:g} and {high:g} meets this duty within its limits")
        best = min(met, key=lambda x: SIGN[by] * known[x][by])
        if width < _NARROW * max(high - low, abs(best)):
            break
        look([x for x in best + width * np.linspace(-1, 1, _ZOOM) if low <= x <= high])
        width *= 2 / (_ZOOM - 1)
    found = known[best]
    return Refined(
        R_o=best,
        by=by,
        value=found[by],
        before=known[start][by],
        mean_efficiency=found["mean_efficiency"],
        max_K=found["max_K"],
        V_min=found["V_min"],
        V_max=found["V_max"],
        edge=high > low and min(best - low, high - best) <= _NARROW * (high - low),
        path=tuple(known),
    )
