"""One design of a split-path transmission for a duty: curves at the duty's points, extrema between them, a row of the table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.design.bench import SplitPathBench
from powertrain.design.duty import SIGNALS, Duty, Unit, Vector, unit_margins
from powertrain.design.extrema import WORST, Extrema, extrema, limited

if TYPE_CHECKING:
    import xarray as xr

REGIMES = ("", "idle", "split", "positive recirculation", "negative recirculation")
NONE = 1e-9
"""A power or an efficiency that counts as zero."""
Plant = pt.Plant[SplitPathBench]


@dataclass(frozen=True)
class Curves:
    """Values at the points of a duty (last dimension), over basic ratios if there are several; intervals by both ends."""

    values: dict[str, tuple[Vector, Vector]]
    status: NDArray[np.int8]
    regime: NDArray[np.intp]
    meanings: tuple[str, ...]

    @classmethod
    def of(cls, found: xr.Dataset, coupling: str) -> Curves:
        """From operating points over R_o and point."""
        found = found.transpose("R_o", "point")
        values = {
            n: (found.get(f"{n}_low", found[n]).to_numpy(), found.get(f"{n}_high", found[n]).to_numpy())
            for n in SIGNALS
        }
        status = found.status.to_numpy()
        one, two, three = (found[n].to_numpy() for n in ("P_1", "P_2", "P_3"))
        little = NONE * np.maximum(np.abs(one), np.abs(three))
        with np.errstate(invalid="ignore"):
            none = np.abs(two) <= little
            back, past = (two < 0, one < -little) if coupling == "input" else (two > 0, three > little)
        regime = np.select([~np.isfinite(two), none, back, past], [0, 1, 4, 3], 2)
        return cls(values, status, regime, tuple(found.status.attrs["flag_meanings"].split()))

    def at(self, index: int | NDArray[np.bool_]) -> Curves:
        """The curves of one basic ratio; of these, some of the points."""
        values = {n: (low[index], high[index]) for n, (low, high) in self.values.items()}
        return Curves(values, self.status[index], self.regime[index], self.meanings)


@dataclass(frozen=True)
class EvaluatedLayout:
    """A layout over basic ratios: curves at the points of the duty, and extrema below and above r = 1 (or over all, if 1 is not inside)."""

    curves: Curves
    worst: tuple[Extrema, ...]

    @classmethod
    def of(cls, plant: Plant, duty: Duty, ratios: Vector) -> EvaluatedLayout:
        """The operating points of a plant."""
        found = pt.steady(plant, duty.grid(ratios), outputs=SIGNALS)
        pieces = duty.halves() if duty.low < 1 < duty.high else (duty,)
        worst = tuple(extrema(plant, piece, ratios) for piece in pieces)
        return cls(Curves.of(found, plant.model.transmission.coupling), worst)


@dataclass(frozen=True)
class Demands:
    """Requirements of a design: range of V, torque [N.m], speed [rad/s] and power [W] of the unit, and its share of the power."""

    unit: Unit
    limits: Mapping[str, float]
    max_K: float = math.inf


def row(layouts: Sequence[EvaluatedLayout], k: int, duty: Duty, demands: Demands) -> dict[str, Any]:
    """The values of one layout, or of one below and another above r = 1, for basic ratio k."""
    if len(layouts) == 1:
        parts, worst = [(layouts[0].curves.at(k), duty)], list(layouts[0].worst)
    else:
        masks = duty.r <= 1, duty.r >= 1
        parts = [
            (one.curves.at(k).at(mask), half) for one, mask, half in zip(layouts, masks, duty.halves(), strict=True)
        ]
        worst = [one.worst[side] for side, one in enumerate(layouts)]
    at = np.concatenate([d.r for _, d in parts])
    weight = np.concatenate([d.weight for _, d in parts])
    ends = [np.concatenate([c.values["efficiency"][end] for c, _ in parts]) for end in (0, 1)]
    problem = _problem(parts, worst, k)
    solved = not problem
    found: dict[str, Any] = {
        "mean_efficiency": _mean(ends[0], weight) if solved else math.nan,
        "mean_efficiency_high": _mean(ends[1], weight) if solved else math.nan,
    }
    for name in WORST:
        choose = min if name in ("V_min", "min_efficiency") else max
        found[name] = choose(float(part.worst[name][k]) for part in worst) if solved else math.nan
    found["unit_range"] = found["V_max"] - found["V_min"]
    found["regimes"] = _regimes(at, np.concatenate([c.regime for c, _ in parts])) if solved else ""
    found["problem"] = problem or _range_problem(found, demands)
    return found


def _problem(parts: Sequence[tuple[Curves, Duty]], worst: Sequence[Extrema], k: int) -> str:
    """Why the design cannot turn at some r; empty if it can."""
    for curves, duty in parts:
        V, efficiency = curves.values["V"][0], curves.values["efficiency"][0]
        with np.errstate(invalid="ignore"):
            locked = (duty.r != 0) & np.isfinite(V) & (efficiency <= NONE)
        unsolved = ~np.isfinite(V) | ((duty.r != 0) & ~np.isfinite(efficiency))
        if unsolved.any():
            return f"{curves.meanings[int(curves.status[unsolved][0])]} at r = {duty.r[unsolved][0]:g}"
        if locked.any():
            return f"no power reaches the output at r = {duty.r[locked][0]:g}: the differential locks itself"
    for one in worst:
        for name, values in one.worst.items():
            if not np.isfinite(values[k]):
                return f"no single operating point at r = {one.where[name][k]:g}"
    return ""


def _mean(efficiency: Vector, weight: Vector) -> float:
    """Energy delivered over energy supplied."""
    some = weight > 0
    return float(1.0 / (weight[some] / efficiency[some]).sum())


def _range_problem(found: Mapping[str, Any], demands: Demands) -> str:
    V, unit = np.array([found["V_min"], found["V_max"]]), demands.unit
    if found["max_K"] > demands.max_K * (1 + NONE):
        return f"|K| up to {found['max_K']:.4g}, at most {demands.max_K:g} is allowed"
    margins = unit_margins(V, unit)
    if (margins >= -NONE).all():
        return limited(found, demands.limits)
    wanted = f"V from {V.min():.4g} to {V.max():.4g}"
    return (
        f"{wanted}, the unit has {unit[0]:g} to {unit[1]:g}"
        if isinstance(unit, tuple)
        else f"{wanted}, the unit spans {unit:g}"
    )


def _regimes(r: Vector, regime: NDArray[np.intp]) -> str:
    """The regimes in the order of r, with the ratios at which they change."""
    known = regime > 1
    r, regime = r[known], regime[known]
    if not regime.size:
        return ""
    words = [REGIMES[regime[0]]]
    for k in np.flatnonzero(np.diff(regime)):
        words.append(f"to r = {(r[k] + r[k + 1]) / 2:.3g}, {REGIMES[regime[k + 1]]}")
    return " ".join(words)
