"""The space of split-path transmissions: structures, mechanical points, basic ratios, ranges and units, searched for a duty.

The objectives are the mean efficiency over the duty and the size of the unit: its largest torque times its largest speed, divided by the
largest power delivered. The result is their Pareto front.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

import powertrain as pt
from powertrain.components.cvu import ElectricPair, VariableUnit
from powertrain.components.transmissions import Flow, Network, RatioOfUnit, VariableTransmission
from powertrain.design.duty import Duty, Vector
from powertrain.design.parts import RESERVE, cvu_of, pair_of, ratio_of, transmission_of
from powertrain.design.rating import COLUMNS, GRID, SLACK, Efficiencies, Rated, bounds, front, over_range, rate
from powertrain.design.structure import COMMON, Designs, Structure
from powertrain.design.units import Variator

if TYPE_CHECKING:
    import pandas as pd

_LOOKED = 16
"""Designs of each front that are rated finely, from the most efficient one to the one with the smallest unit."""


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


def geared(designs: Designs, duty: Duty, unit: Variator) -> Designs:
    """The designs with gears beside the unit that use its range of V and its speed.

    For a unit with limited V the gear brings the largest |V| to the limit on its side, and the faster shaft to its speed limit. For a unit
    with unlimited V each shaft reaches its speed limit. Without a speed limit the shaft turns at input speed.
    """
    ends = bounds(designs, duty)
    t = np.linspace(0, 1, GRID)
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
        inside = size * first >= ratio[0] - SLACK * abs(ratio[0]) and size * last <= ratio[1] + SLACK * abs(ratio[1])
        if inside and not abs(best) > size:
            best = sign * size
    return float(best)


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
        columns = ["unit", "structure", *COLUMNS, "shifts", "m", "R_o", "_number"]
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
        loss = self.unit(line).loss
        return [over_range(network, low, high, self.duty, loss, points) for low, high, network in self.ranges(line)]

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
