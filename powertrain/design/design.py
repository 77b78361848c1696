"""Split-path transmissions for a duty: a comparison of layouts, couplings, basic ratios and switched combinations.

This is the program of Yu & Beachley 1986 (Fig. 10 and p. 16) with the acausal model: no formula of the transmission is used here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential
from powertrain.components.transmissions import COMBINATIONS, TYPES, Coupling, SplitPathTransmission
from powertrain.design.bench import SplitPathBench
from powertrain.design.duty import Duty, Unit, Vector, check_unit
from powertrain.design.evaluation import REGIMES, Demands, EvaluatedLayout, row
from powertrain.design.extrema import check_limits
from powertrain.design.refinement import SIGN, Rank, Refined, refine_ratio
from powertrain.language.arguments import array

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


def split_path_designs(
    duty: Duty | tuple[float, float],
    ratios: Iterable[float | FundamentalDifferential],
    *,
    weights: pd.DataFrame | Mapping[str, ArrayLike] | None = None,
    unit: Unit = None,
    transmission: SplitPathTransmission | None = None,
    couplings: Sequence[Coupling] = ("input", "output"),
    combinations: bool = True,
    limits: Mapping[str, float] | None = None,
    by: Rank = "mean_efficiency",
    progress: bool = True,
) -> SplitPathDesigns:
    """Compare all six types in both couplings over basic ratios, including the nine switched combinations.

    The lowest efficiency, K, V and the load of the unit are extrema over the range of r, also between the points of the duty and at
    standstill. A combination uses one type up to r = 1 and another above; at the shift both count. At r = 1 all members turn at the
    same speed; only there can two of them be exchanged without a jump in speed.

    Parameters
    ----------
    duty : Duty or (float, float)
        The required range of r, or a ``Duty``, for instance of a drive cycle.
    ratios : iterable of float or differentials
        Basic ratios R_o, or differentials (for instance from tooth numbers).
    weights : mapping or DataFrame, optional
        Weights over a range of r: columns r, weight (see ``Duty.over``).
    unit : (float, float), float, optional
        The range (low, high) of V of the variable unit; or a number, its span V_max/V_min, if fixed gears may bring V into its range; by
        default unlimited.
    transmission : SplitPathTransmission, optional
        The transmission to vary, with its efficiencies and its unit; by default eta = 0.95 and eta_v = 0.9.
    couplings : sequence of {"input", "output"}
        Couplings to compare.
    combinations : bool
        Include the switched combinations.
    limits : mapping of str to float, optional
        The limits of the unit on either shaft, "torque" [N.m], "speed" [rad/s], "power" [W], for the torque and speed of the duty.
    by : str
        The column that ranks the designs.
    progress : bool
        Show a progress bar.

    Returns
    -------
    SplitPathDesigns
        ``table`` ranks the designs; ``curves`` has their values over r.

    Raises
    ------
    ParameterError
        For an invalid duty, unit or criterion, and for basic ratios of 0 or 1.
    """
    from tqdm.auto import tqdm

    given = transmission or SplitPathTransmission()
    values = array("ratios", [getattr(x, "ratio", x) for x in ratios])
    if not values.size:
        raise pt.ParameterError("no basic ratio is given")
    check_unit(unit)
    demands = Demands(unit, check_limits(limits))
    if by not in get_args(Rank):
        raise pt.ParameterError(f"designs cannot be ranked by {by!r}; choose from {', '.join(get_args(Rank))}")
    if isinstance(duty, Duty) and weights is not None:
        raise pt.ParameterError("weights belong to a range of r; a Duty has its own")
    work = duty if isinstance(duty, Duty) else Duty.over(duty, weights)
    cases = [(c, number) for c in couplings for number in TYPES]
    plants: dict[tuple[str, int], pt.Plant[SplitPathBench]] = {}
    points: dict[tuple[str, int], EvaluatedLayout] = {}
    for coupling, number in tqdm(cases, desc="Split-path designs", unit="type", disable=not progress):
        plant = pt.compile(SplitPathBench(transmission=pt.replace(given, layout=TYPES[number], coupling=coupling)))
        plants[coupling, number] = plant
        points[coupling, number] = EvaluatedLayout.of(plant, work, values)
    kinds = [(c, str(number), [points[c, number]]) for c, number in cases]
    if combinations and work.low < 1 < work.high:
        kinds += _combined(points, couplings)
    rows = [
        {"coupling": coupling, "type": kind, "R_o": float(values[k]), **row(layouts, k, work, demands)}
        for coupling, kind, layouts in kinds
        for k in range(values.size)
    ]
    return SplitPathDesigns(rows, work, demands, by, plants, points, values)


def _combined(
    points: Mapping[tuple[str, int], EvaluatedLayout], couplings: Sequence[Coupling]
) -> list[tuple[Coupling, str, list[EvaluatedLayout]]]:
    """The nine combinations, with either type below r = 1."""
    return [
        (coupling, f"{name}: {first}, then {second}", [points[coupling, first], points[coupling, second]])
        for coupling in couplings
        for name, pair in COMBINATIONS.items()
        for first, second in (pair, pair[::-1])
    ]


@dataclass(frozen=True)
class SplitPathDesigns:
    """The compared designs. ``table`` ranks them, ``curves`` has their values over r."""

    rows: list[dict[str, Any]]
    duty: Duty
    demands: Demands
    by: Rank
    plants: dict[tuple[str, int], pt.Plant[SplitPathBench]]
    points: dict[tuple[str, int], EvaluatedLayout]
    ratios: Vector = field(repr=False)

    @cached_property
    def table(self) -> pd.DataFrame:
        """One row per design, the best first, infeasible ones last.

        ``mean_efficiency``: energy delivered over energy supplied for the duty; if the mesh is stuck at a point of the duty (r = 1), with
        the lowest possible torque ratio there, and ``mean_efficiency_high`` with the highest. Extrema over the range of r, see ``extrema``:
        ``min_efficiency``, ``max_K`` (size), ``V_min``, ``V_max``, ``unit_range`` (their difference), and the load of the more loaded shaft
        of the unit, ``unit_torque`` [N.m], ``unit_speed`` [rad/s], ``unit_power`` [W]. ``regimes``: the cases of Fig. 8 in the order of r.
        ``problem``: why the design is infeasible; empty if it is feasible.
        """
        import pandas as pd

        table = pd.DataFrame(self.rows)
        table = table.assign(feasible=table.problem == "", _key=SIGN[self.by] * table[self.by])
        table = table.sort_values(["feasible", "_key"], ascending=[False, True], kind="stable")
        return table.drop(columns="_key").reset_index(drop=True)

    @property
    def feasible(self) -> pd.DataFrame:
        """The feasible designs."""
        return self.table[self.table.feasible]

    @cached_property
    def curves(self) -> xr.Dataset:
        """V, efficiency and K with the ends of their intervals, over coupling, type, R_o and the points of the duty (coordinate r)."""
        import xarray as xr

        couplings = list(dict.fromkeys(c for c, _ in self.points))
        data: dict[str, Any] = {}
        for name in ("V", "efficiency", "K"):
            for end, place in (("low", 0), ("high", 1)):
                whole = np.array([[self.points[c, n].curves.values[name][place] for n in TYPES] for c in couplings])
                data[f"{name}_{end}"] = (("coupling", "type", "R_o", "point"), whole, {"units": "1"})
        regime = np.array(REGIMES)[np.array([[self.points[c, n].curves.regime for n in TYPES] for c in couplings])]
        data["regime"] = (("coupling", "type", "R_o", "point"), regime)
        coords = {"coupling": couplings, "type": list(TYPES), "R_o": self.ratios, "r": ("point", self.duty.r)}
        return xr.Dataset(data, coords=coords)

    @property
    def unit(self) -> Unit:
        """The range of V of the unit."""
        return self.demands.unit

    def types(self, line: int = 0) -> list[int]:
        """The type of a row of ``table``, or of a combination those below and above r = 1."""
        return [int(word) for word in str(self.table.type[line]).rpartition(":")[2].replace("then", "").split(",")]

    def at_edge(self, line: int = 0) -> bool:
        """Whether a row's R_o is the first or last of those compared on its side of 0 and 1, so a better one may lie beyond."""
        R_o = float(self.table.R_o[line])
        return self.ratios.size > 1 and R_o in self._bounds(R_o)

    def _bounds(self, R_o: float) -> tuple[float, float]:
        same = [x for x in self.ratios.tolist() if (x > 0) == (R_o > 0) and (x > 1) == (R_o > 1)]
        return min(same), max(same)

    def refine(self, line: int = 0, *, bounds: tuple[float, float] | None = None, max_K: float = math.inf) -> Refined:
        """The best R_o for the layouts of a row of ``table``, by the table's criterion; see ``refine_ratio``.

        ``bounds``: by default the compared basic ratios on the same side of 0 and 1; ``max_K``: the largest share of the power in the unit.
        """
        chosen = self.table.iloc[line]
        start, plants = float(chosen.R_o), [self.plants[str(chosen.coupling), n] for n in self.types(line)]
        demands = replace(self.demands, max_K=max_K)
        return refine_ratio(plants, self.duty, start, bounds or self._bounds(start), demands, self.by)
