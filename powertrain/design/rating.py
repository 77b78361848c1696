"""How good designs of split-path transmissions are: their mean efficiency over a duty, and the largest loads of the unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain import ParameterError, arguments_checked
from powertrain.components.transmissions import Flow, Network, UnitLoss, flow
from powertrain.design.duty import Duty, Vector
from powertrain.design.structure import Designs
from powertrain.design.units import Variator

GRID = 17
"""Points of a range at which designs are computed."""
_FINE, _ZOOMS = 97, 7
SLACK = 1e-6
"""Relative excess over a limit that counts as rounding and grid error."""
_NONE = 1e-9
"""An efficiency that counts as zero."""
COLUMNS = (
    "mean_efficiency",
    "min_efficiency",
    "unit_size",
    "unit_torque",
    "unit_speed",
    "unit_power",
    "max_K",
    "V_min",
    "V_max",
)
"""The ratings of a design."""


@arguments_checked
@dataclass(frozen=True)
class Efficiencies:
    """Efficiencies besides the unit's: of planetaries with fixed carrier, and of a gear pair.

    Errors: ParameterError for an efficiency outside (0, 1].
    """

    planetary: float = 0.98
    pair: float = 0.99

    def __post_init__(self) -> None:
        for name, value in (("planetary", self.planetary), ("pair", self.pair)):
            if not 0 < value <= 1:
                raise ParameterError(f"Efficiencies: {name} = {value:g} is outside (0, 1]")


def bounds(designs: Designs, duty: Duty) -> Vector:
    """The limits of the ranges, (designs, ranges + 1)."""
    ends = np.broadcast_to([duty.low, duty.high], (len(designs.scale), 2))
    return np.concatenate([ends[:, :1], designs.shifts, ends[:, 1:]], axis=1)


@dataclass(frozen=True)
class Rated:
    """Designs of one structure with one unit, and their ratings: arrays over designs, nan if infeasible."""

    designs: Designs
    unit: Variator
    cube: Vector
    values: dict[str, Vector]

    def with_(self, other: Rated) -> Rated:
        """These designs and others of the same structure and unit."""
        mine, theirs = self.designs, other.designs
        joined = [np.concatenate([getattr(mine, n), getattr(theirs, n)]) for n in ("m", "R_o", "shifts", "scale")]
        values = {n: np.concatenate([v, other.values[n]]) for n, v in self.values.items()}
        return Rated(Designs(mine.structure, *joined), self.unit, np.concatenate([self.cube, other.cube]), values)

    def front(self) -> NDArray[np.intp]:
        """The designs that no other one surpasses in both efficiency and size."""
        return front(self.values["mean_efficiency"], self.values["unit_size"])


def front(efficiency: Vector, size: Vector) -> NDArray[np.intp]:
    """Indices of the Pareto front, the most efficient first; designs with nan are left out."""
    good = np.flatnonzero(np.isfinite(efficiency) & np.isfinite(size))
    order = good[np.lexsort((size[good], -efficiency[good]))]
    least = np.minimum.accumulate(size[order])
    first = np.append(True, least[1:] < least[:-1]) if order.size else np.zeros(0, bool)
    return np.asarray(order[first], np.intp)


def over_range(
    network: Network, low: float, high: float, duty: Duty, loss: UnitLoss, points: int
) -> tuple[Vector, Flow]:
    """Operating points from ``low`` to ``high`` without standstill, as (r, flow), with the torques and speeds of the duty."""
    r = np.linspace(low, high, points)
    r = r[r != 0]
    torque = np.interp(r, duty.r, duty.torque) * np.sign(r)
    return r, flow(network, r, torque, np.interp(r, duty.r, duty.speed), loss=loss)


def rate(designs: Designs, duty: Duty, unit: Variator, eta: Efficiencies, cube: Vector, *, fine: bool = False) -> Rated:
    """Efficiency over the duty, and the largest loads of the unit: on a grid over every range, or (``fine``) located between its points."""
    count = len(designs.scale)
    ends = bounds(designs, duty)
    supplied, worst = np.zeros(count), {n: np.full(count, -np.inf) for n in _GREATEST}
    passes = np.zeros(count, bool)
    with np.errstate(all="ignore"):
        for k in range(len(designs.structure.ranges)):
            network, ratios = designs.networks(k, eta.planetary, eta.pair)

            def look(r: Vector, network: Network = network, ratios: Vector = ratios) -> Flow:
                torque = np.interp(r, duty.r, duty.torque) * np.where(r < 0, -1.0, 1.0)
                w_in = np.interp(r, duty.r, duty.speed)
                return flow(network, r, torque, w_in, loss=unit.loss, ratios=ratios, thorough=False)

            last = k == len(designs.structure.ranges) - 1
            inside = (duty.r >= ends[:, k, None]) & ((duty.r < ends[:, k + 1, None]) | last) & (duty.weight > 0)
            supplied += np.where(inside, duty.weight / look(duty.r).efficiency[0], 0.0).sum(axis=1)
            found, turned = _greatest(look, ends[:, k], ends[:, k + 1], fine)
            passes |= turned
            worst = {n: np.maximum(worst[n], v) for n, v in found.items()}
    values = _values(worst, supplied, passes, duty)
    return Rated(designs, unit, cube, {n: np.where(_keeps(values, unit), v, np.nan) for n, v in values.items()})


_GREATEST: dict[str, Callable[[Flow, Vector], Vector]] = {
    "tau_a": lambda on, r: np.abs(on.tau[0]),
    "tau_b": lambda on, r: np.abs(on.tau[1]),
    "w_a": lambda on, r: np.abs(on.w[0]),
    "w_b": lambda on, r: np.abs(on.w[1]),
    "unit_power": lambda on, r: on.unit_power,
    "max_K": lambda on, r: np.where(r == 0, 0.0, np.abs(on.K)),
    "loss": lambda on, r: np.where(r == 0, -np.inf, 1 - on.efficiency[0]),
    "V_max": lambda on, r: on.V,
    "-V_min": lambda on, r: -on.V,
}
"""Quantities of which the largest value is the worst."""


def _greatest(
    look: Callable[[Vector], Flow], low: Vector, high: Vector, fine: bool
) -> tuple[dict[str, Vector], Vector]:
    """The largest values over low <= r <= high, and whether shaft a of the unit reverses in between."""
    grid = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, _FINE if fine else GRID)
    on = look(grid)
    turned = (on.w[0].min(axis=1) < 0) & (on.w[0].max(axis=1) > 0)
    found = {}
    for name, value in _GREATEST.items():
        on_grid = value(on, grid)
        found[name] = on_grid.max(axis=1)
        at, number = grid, np.nan_to_num(on_grid, nan=-np.inf).argmax(axis=1)
        for _ in range(_ZOOMS if fine else 0):
            low, high = (at[np.arange(len(at)), np.clip(number + step, 0, at.shape[1] - 1)] for step in (-1, 1))
            at = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, GRID)
            there = value(look(at), at)
            number = np.nan_to_num(there, nan=-np.inf).argmax(axis=1)
            found[name] = np.maximum(found[name], there.max(axis=1))
    return found, turned


def _values(worst: dict[str, Vector], supplied: Vector, passes: Vector, duty: Duty) -> dict[str, Vector]:
    """The columns of the table."""
    size = np.maximum(worst["tau_a"] * worst["w_a"], worst["tau_b"] * worst["w_b"])
    return {
        "mean_efficiency": 1 / supplied,
        "min_efficiency": 1 - worst["loss"],
        "unit_size": size / (duty.torque * np.abs(duty.r) * duty.speed).max(),
        "unit_torque": np.maximum(worst["tau_a"], worst["tau_b"]),
        "unit_speed": np.maximum(worst["w_a"], worst["w_b"]),
        "unit_power": worst["unit_power"],
        "max_K": worst["max_K"],
        "V_min": np.where(passes, -np.inf, -worst["-V_min"]),
        "V_max": np.where(passes, np.inf, worst["V_max"]),
    }


def _keeps(values: dict[str, Vector], unit: Variator) -> NDArray[np.bool_]:
    """Which designs fulfil the duty within the unit's limits."""
    kept = np.isfinite(values["mean_efficiency"]) & (values["mean_efficiency"] <= 1) & np.isfinite(values["unit_size"])
    kept &= values["min_efficiency"] > _NONE
    for name in ("torque", "speed", "power"):
        kept &= values[f"unit_{name}"] <= getattr(unit, name) * (1 + SLACK)
    low, high = unit.ratio
    return np.asarray(
        kept & (values["V_min"] >= low - SLACK * abs(low)) & (values["V_max"] <= high + SLACK * abs(high)), bool
    )
