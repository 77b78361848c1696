"""The space of split-path transmissions: structures, mechanical points, basic ratios, ranges and units, searched for a duty.

The objectives are the mean efficiency over the duty and the size of the unit: its largest torque times its largest speed, divided by the
largest power delivered. The result is their Pareto front.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.cvu import ElectricPair, VariableUnit
from powertrain.components.transmissions import Flow, Network, RatioOfUnit, VariableTransmission, flow
from powertrain.design.duty import Duty, Vector
from powertrain.design.parts import RESERVE, cvu_of, pair_of, ratio_of, transmission_of
from powertrain.design.structure import COMMON, Designs, Structure
from powertrain.design.units import Variator

if TYPE_CHECKING:
    import pandas as pd

_GRID, _FINE, _ZOOMS = 17, 97, 7
_LOOKED = 16
"""Designs of each front that are rated finely, from the most efficient one to the one with the smallest unit."""
_SLACK, _NONE = 1e-6, 1e-9
"""Relative excess over a limit that counts as rounding and grid error; an efficiency that counts as zero."""


@dataclass(frozen=True)
class Efficiencies:
    """Efficiencies besides the unit's: of planetaries with fixed carrier, and of a gear pair."""

    planetary: float = 0.98
    pair: float = 0.99


def split_path_space(
    duty: Duty,
    units: Sequence[Variator],
    structures: Sequence[Structure] = COMMON,
    *,
    candidates: int = 256,
    rounds: int = 3,
    points: tuple[float, float] | None = None,
    basic: tuple[float, float] = (0.25, 4.0),
    efficiencies: Efficiencies | None = None,
    progress: bool = True,
) -> SplitPathSpace:
    """Search structures and units for high efficiency with a small unit.

    Gears beside the unit adapt it to its range of V and to its speed limit.

    Parameters
    ----------
    duty : Duty
        The required ratios, with torques, speeds and weights.
    units : sequence of Variator
        Units to choose from.
    structures : sequence of Structure
        Structures to choose from.
    candidates : int
        Designs of each structure per round.
    rounds : int
        Rounds of the search; designs of later rounds lie near the best of earlier ones.
    points : (float, float), optional
        Range of the mechanical points; by default from a tenth of the largest r to twice the largest r.
    basic : (float, float)
        Sizes |R_o| of planetaries (R_o < 0).
    efficiencies : Efficiencies, optional
        Efficiencies of meshes and gears.
    progress : bool
        Show a progress bar.

    Returns
    -------
    SplitPathSpace

    Raises
    ------
    ParameterError
        For a duty at r <= 0 only, and for empty bounds.
    """
    from tqdm.auto import tqdm

    low, high = points or (0.1 * duty.high, 2 * duty.high)
    for what, (first, last) in (("points", (low, high)), ("basic", basic)):
        if not 0 < first < last:
            raise pt.ParameterError(f"{what}: from {first:g} to {last:g} is not a range of positive numbers")
    eta = efficiencies or Efficiencies()

    def searched(pair: tuple[Variator, Structure]) -> Rated:
        unit, structure = pair
        known: Rated | None = None
        for number in range(rounds):
            cube = _cube(structure.parameters, candidates, number, known)
            rated = rate(designs_at(structure, cube, duty, (low, high), basic, unit), duty, unit, eta, cube)
            known = rated if known is None else known.with_(rated)
        assert known is not None
        return known

    pairs = [(unit, structure) for unit in units for structure in structures]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        bar = tqdm(pool.map(searched, pairs), "Split-path space", len(pairs), unit="structure", disable=not progress)
        found = tuple(bar)
    return SplitPathSpace(duty, found, eta)


def _cube(dimension: int, count: int, number: int, known: Rated | None) -> Vector:
    """Points of the unit cube: a Sobol sequence, in later rounds in boxes around the best, halved each round."""
    from scipy.stats import qmc

    sample = np.asarray(qmc.Sobol(dimension, scramble=True, seed=number).random(count), float)
    if known is None:
        return sample
    best = known.front()
    if not len(best):
        return sample
    centres = known.cube[best[np.arange(count) % len(best)]]
    return np.asarray(np.clip(centres + 0.5 ** (number + 1) * (sample - 0.5), 0, 1), float)


def designs_at(
    structure: Structure,
    cube: Vector,
    duty: Duty,
    points: tuple[float, float],
    basic: tuple[float, float],
    unit: Variator,
) -> Designs:
    """The designs for points in the unit cube, with gears that suit the unit."""
    n = len(structure.planetaries)
    m = points[0] * (points[1] / points[0]) ** cube[:, :n]
    R_o = -basic[0] * (basic[1] / basic[0]) ** cube[:, n : 2 * n]
    shifts = duty.low + (duty.high - duty.low) * np.sort(cube[:, 2 * n :], axis=1)
    raw = Designs(structure, m, R_o, shifts, np.ones((len(cube), 2)))
    return geared(raw, duty, unit)


def bounds(designs: Designs, duty: Duty) -> Vector:
    """The limits of the ranges, (designs, ranges + 1)."""
    ends = np.broadcast_to([duty.low, duty.high], (len(designs.scale), 2))
    return np.concatenate([ends[:, :1], designs.shifts, ends[:, 1:]], axis=1)


def geared(designs: Designs, duty: Duty, unit: Variator) -> Designs:
    """The designs with gears beside the unit that use its range of V and its speed.

    For a unit with limited V the gear brings the largest |V| to the limit on its side, and the faster shaft to its speed limit. For a unit
    with unlimited V each shaft reaches its speed limit. Without a speed limit the shaft turns at input speed.
    """
    ends = bounds(designs, duty)
    t = np.linspace(0, 1, _GRID)
    spans = [ends[:, k, None] * (1 - t) + ends[:, k + 1, None] * t for k in range(len(designs.structure.ranges))]
    a, b = (np.concatenate([designs.unit_speeds(k, r)[s] for k, r in enumerate(spans)], axis=1) for s in (0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        V = b / a
        if np.isfinite(unit.ratio).any():
            low, high = np.min(V, axis=1), np.max(V, axis=1)
            factor = np.array([_fit(x, y, unit.ratio) for x, y in zip(low, high, strict=True)])
        else:
            factor = np.ones(len(a))
        fastest = [np.abs(a).max(axis=1), np.abs(b * factor[:, None]).max(axis=1)]
        wanted = unit.speed / duty.speed.max() if np.isfinite(unit.speed) else 1.0
        if np.isfinite(unit.ratio).any():
            both = wanted / np.maximum(*fastest)
            return designs.scaled(both, both * factor)
        return designs.scaled(wanted / fastest[0], wanted / fastest[1] * factor)


def _fit(low: float, high: float, ratio: tuple[float, float]) -> float:
    """The factor, of either sign, that maps ``low`` to ``high`` into the unit's range of V and uses most of it."""
    best = np.nan
    for sign in (1, -1):
        first, last = sorted((sign * low, sign * high))
        sizes = [limit / value for limit, value in zip(ratio, (first, last), strict=True) if value * limit > 0]
        size = min(sizes, default=np.nan)
        inside = size * first >= ratio[0] - _SLACK * abs(ratio[0]) and size * last <= ratio[1] + _SLACK * abs(ratio[1])
        if inside and not abs(best) > size:
            best = sign * size
    return float(best)


@dataclass(frozen=True)
class Rated:
    """Designs of one structure with one unit, and their ratings: arrays over designs, nan if infeasible."""

    designs: Designs
    unit: Variator
    cube: Vector
    values: dict[str, Vector]

    def with_(self, other: Rated) -> Rated:
        """Both."""
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
    grid = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, _FINE if fine else _GRID)
    on = look(grid)
    turned = (on.w[0].min(axis=1) < 0) & (on.w[0].max(axis=1) > 0)
    found = {}
    for name, value in _GREATEST.items():
        on_grid = value(on, grid)
        found[name] = on_grid.max(axis=1)
        at, number = grid, np.nan_to_num(on_grid, nan=-np.inf).argmax(axis=1)
        for _ in range(_ZOOMS if fine else 0):
            low, high = (at[np.arange(len(at)), np.clip(number + step, 0, at.shape[1] - 1)] for step in (-1, 1))
            at = low[:, None] + (high - low)[:, None] * np.linspace(0, 1, _GRID)
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
        kept &= values[f"unit_{name}"] <= getattr(unit, name) * (1 + _SLACK)
    low, high = unit.ratio
    return np.asarray(
        kept & (values["V_min"] >= low - _SLACK * abs(low)) & (values["V_max"] <= high + _SLACK * abs(high)), bool
    )


@dataclass(frozen=True)
class SplitPathSpace:
    """The result of the search. ``table`` ranks the designs, ``pareto`` is the overall front of efficiency against the size of the unit."""

    duty: Duty
    found: tuple[Rated, ...] = field(repr=False)
    efficiencies: Efficiencies = field(default_factory=Efficiencies)

    @cached_property
    def _fronts(self) -> tuple[tuple[Rated, int], ...]:
        """The front of every structure with every unit, rated again with extrema between the points of the grid."""
        chosen = []
        for one in self.found:
            whole = one.front()
            rows = (
                whole[np.unique(np.linspace(0, len(whole) - 1, _LOOKED).round().astype(int))] if whole.size else whole
            )
            if rows.size:
                fine = rate(one.designs.take(rows), self.duty, one.unit, self.efficiencies, one.cube[rows], fine=True)
                chosen += [(fine, int(k)) for k in np.flatnonzero(np.isfinite(fine.values["mean_efficiency"]))]
        return tuple(chosen)

    @cached_property
    def table(self) -> pd.DataFrame:
        """The fronts of all structures and units, the most efficient first; up to 16 designs of each, spread from end to end.

        ``unit_size``: the largest torque times the largest speed of a unit's shaft, over the largest power that the duty delivers;
        ``unit_torque`` [N.m], ``unit_speed`` [rad/s], ``unit_power`` [W] of the more loaded shaft; ``shifts``: r at which ranges meet;
        ``points``: mechanical points of the planetaries; ``R_o``: their basic ratios; ``front``: on the overall front.
        """
        import pandas as pd

        rows = []
        for number, (one, k) in enumerate(self._fronts):
            d = one.designs
            about = {"unit": one.unit.name, "structure": str(d.structure)}
            numbers = {n: [round(float(x), 4) for x in getattr(d, n)[k]] for n in ("shifts", "m", "R_o")}
            rows.append({**about, **{n: float(v[k]) for n, v in one.values.items()}, **numbers, "_number": number})
        columns = ["unit", "structure", *(_COLUMNS), "shifts", "m", "R_o", "_number"]
        table = pd.DataFrame(rows, columns=columns).rename(columns={"m": "points"})
        table = table.sort_values("mean_efficiency", ascending=False, kind="stable").reset_index(drop=True)
        on = np.zeros(len(table), bool)
        on[front(table.mean_efficiency.to_numpy(float), table.unit_size.to_numpy(float))] = True
        return table.assign(front=on)

    @property
    def pareto(self) -> pd.DataFrame:
        """The designs of the table that no other one surpasses in both efficiency and size."""
        return self.table[self.table.front]

    def ranges(self, line: int = 0) -> list[tuple[float, float, Network]]:
        """The ranges of a row of the table: lower and upper r, and network."""
        one, k = self._fronts[int(self.table._number[line])]
        d = one.designs.take([k])
        ends = bounds(d, self.duty)[0]
        networks = [
            d.networks(n, self.efficiencies.planetary, self.efficiencies.pair)[0]
            for n in range(len(d.structure.ranges))
        ]
        return [(float(low), float(high), x) for low, high, x in zip(ends, ends[1:], networks, strict=False)]

    def unit(self, line: int = 0) -> Variator:
        """The unit of a row of the table."""
        return self._fronts[int(self.table._number[line])][0].unit

    def flows(self, line: int = 0, points: int = 101) -> list[tuple[Vector, Flow]]:
        """Operating points over the ranges of a row of the table, as (r, flow); all directions of power are tried."""
        found = []
        for low, high, network in self.ranges(line):
            r = np.linspace(low, high, points)
            r = r[r != 0]
            torque = np.interp(r, self.duty.r, self.duty.torque) * np.sign(r)
            found.append(
                (r, flow(network, r, torque, np.interp(r, self.duty.r, self.duty.speed), loss=self.unit(line).loss))
            )
        return found

    def part(self, line: int = 0) -> VariableUnit | ElectricPair:
        """The unit of a row as a component with the losses of the design: a ``CVU``, or an ``ElectricPair`` if V may be infinite.

        The machines of a pair have twice the torque, speed and power that the duty requires. For a vehicle the duty must contain
        the torques for starting and the speeds of the engine at full power.
        Errors: ParameterError for a pair with an efficiency map, see ``pair_of``.
        """
        unit, row = self.unit(line), self.table.iloc[line]
        if not unit.electric:
            return cvu_of(unit.loss)
        return pair_of(unit.loss, **{n: RESERVE * float(row[f"unit_{n}"]) for n in ("torque", "speed", "power")})

    def transmission(self, line: int = 0, unit: VariableUnit | ElectricPair | None = None) -> VariableTransmission:
        """A row of the table as a component, with its ``part`` or another ``unit``.

        With one range a ``NetworkTransmission``, with several a ``RangeTransmission``, which shifts; with a pair of machines always an
        ``ElectricTransmission``.
        """
        return transmission_of(self.ranges(line), self.part(line) if unit is None else unit)

    def unit_ratio(self, line: int = 0) -> RatioOfUnit:
        """The signal ``ratio`` of a row's transmission for an overall ratio: V of its unit, or r itself."""
        return ratio_of(self.transmission(line))


_COLUMNS = (
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
