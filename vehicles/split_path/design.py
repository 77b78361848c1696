"""Which split-path transmission for a duty: layouts, couplings, basic ratios and switched combinations compared.

This is the program of Yu & Beachley 1986 (Fig. 10 and p. 16) put to the acausal model: nothing here knows a formula of the transmission.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential
from powertrain.components.transmissions import COMBINATIONS, TYPES, Coupling, SplitPathTransmission
from powertrain.vehicles.split_path.bench import SplitPathBench
from powertrain.vehicles.split_path.duty import SIGNALS, Duty, Unit, Vector, check_unit, part_of, unit_margins
from powertrain.vehicles.split_path.refinement import Refined, refine_ratio

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Rank = Literal["mean_efficiency", "min_efficiency", "max_K", "unit_range"]
REGIMES = ("", "idle", "split", "positive recirculation", "negative recirculation")
_NONE = 1e-9


def split_path_designs(
    duty: Duty | tuple[float, float],
    ratios: Iterable[float | FundamentalDifferential],
    *,
    weights: pd.DataFrame | Mapping[str, ArrayLike] | None = None,
    unit: Unit = None,
    transmission: SplitPathTransmission | None = None,
    couplings: Sequence[Coupling] = ("input", "output"),
    combinations: bool = True,
    by: Rank = "mean_efficiency",
    progress: bool = True,
) -> SplitPathDesigns:
    """Compares all six types in both couplings over basic ratios, with the nine switched combinations.

    ``duty``: the wanted range of r, with ``weights`` over it (columns r, weight, see ``Duty.over``); or a ``Duty``, as of a drive cycle.
    ``ratios``: numbers R_o, or differentials (by their tooth numbers, for instance). ``unit``: the range (low,
    high) of V that the variable unit has; or a number, its span V_max/V_min, where fixed gears may bring V into its range; None for any.
    ``transmission``: the one to vary, with its efficiencies and its kind of unit; by default eta = 0.95 and eta_v = 0.9.

    A combination drives in one type below r = 1 and in another above. r = 1 is where two members, and then all, turn alike, and the only
    ratio at which they can change places without a jump of speeds. Errors: ParameterError for a duty, a unit or a rank that does not
    exist, and for basic ratios of 0 or 1.
    """
    from tqdm.auto import tqdm

    given = transmission or SplitPathTransmission()
    values = np.array([float(x if isinstance(x, (int, float)) else x.ratio) for x in ratios])
    if not values.size:
        raise pt.ParameterError("there is no basic ratio to look at")
    check_unit(unit)
    if by not in get_args(Rank):
        raise pt.ParameterError(f"designs are not ranked by {by!r}, but by one of {', '.join(get_args(Rank))}")
    if isinstance(duty, Duty) and weights is not None:
        raise pt.ParameterError("weights belong to a range of r; a Duty has its own")
    work = duty if isinstance(duty, Duty) else Duty.over(duty, weights)
    cases = [(c, number) for c in couplings for number in TYPES]
    plants: dict[tuple[str, int], pt.Plant[SplitPathBench]] = {}
    points: dict[tuple[str, int], _Curves] = {}
    for coupling, number in tqdm(cases, desc="Split-path designs", unit="type", disable=not progress):
        plant = pt.compile(SplitPathBench(transmission=pt.replace(given, layout=TYPES[number], coupling=coupling)))
        plants[coupling, number] = plant
        points[coupling, number] = _Curves.of(pt.steady(plant, work.grid(values), outputs=SIGNALS), coupling)
    rows = [
        _row(coupling, str(number), values[k], [(points[coupling, number].isel(k), work)], work, unit)
        for coupling, number in cases
        for k in range(values.size)
    ]
    if combinations and work.low < 1 < work.high:
        rows += _combined(points, couplings, values, work, unit)
    return SplitPathDesigns(rows, work, unit, by, plants, points, values)


@dataclass(frozen=True)
class _Curves:
    """Values at the points of a duty (last dimension), over basic ratios where there are several; intervals by both ends."""

    values: dict[str, tuple[Vector, Vector]]
    status: NDArray[np.int8]
    regime: NDArray[np.intp]
    meanings: tuple[str, ...]

    @classmethod
    def of(cls, found: xr.Dataset, coupling: str) -> _Curves:
        found = found.transpose("R_o", "point")
        values = {
            n: (found.get(f"{n}_low", found[n]).to_numpy(), found.get(f"{n}_high", found[n]).to_numpy())
            for n in SIGNALS
        }
        status = found.status.to_numpy()
        one, two, three = (found[n].to_numpy() for n in ("P_1", "P_2", "P_3"))
        back, past = (two < 0, one < 0) if coupling == "input" else (two > 0, three > 0)
        with np.errstate(invalid="ignore"):
            none = np.abs(two) <= _NONE * np.maximum(np.abs(one), np.abs(three))
        regime = np.select([~np.isfinite(two), none, back, past], [0, 1, 4, 3], 2)
        return cls(values, status, regime, tuple(found.status.attrs["flag_meanings"].split()))

    def isel(self, k: int) -> _Curves:
        return self._map(k)

    def _map(self, index: Any) -> _Curves:
        values = {n: (low[index], high[index]) for n, (low, high) in self.values.items()}
        return _Curves(values, self.status[index], self.regime[index], self.meanings)

    def where(self, mask: NDArray[np.bool_]) -> _Curves:
        """Some of the points of one basic ratio."""
        return self._map(mask)


def _combined(
    points: Mapping[tuple[str, int], _Curves], couplings: Sequence[Coupling], values: Vector, duty: Duty, unit: Unit
) -> list[dict[str, Any]]:
    """The nine combinations, each with either type below r = 1."""
    below = duty.r <= 1
    rows = []
    for coupling in couplings:
        for name, pair in COMBINATIONS.items():
            for first, second in (pair, pair[::-1]):
                for k, R_o in enumerate(values):
                    parts = [
                        (points[coupling, number].isel(k).where(mask), part_of(duty, mask))
                        for number, mask in ((first, below), (second, ~below))
                    ]
                    rows.append(_row(coupling, f"{name}: {first}, then {second}", R_o, parts, duty, unit))
    return rows


def _row(
    coupling: str, kind: str, R_o: float, parts: Sequence[tuple[_Curves, Duty]], duty: Duty, unit: Unit
) -> dict[str, Any]:
    """A line of the table."""
    at = np.concatenate([d.r for _, d in parts])
    weight = np.concatenate([d.weight for _, d in parts])
    status = np.concatenate([c.status for c, _ in parts])
    low = {n: np.concatenate([c.values[n][0] for c, _ in parts]) for n in SIGNALS}
    high = {n: np.concatenate([c.values[n][1] for c, _ in parts]) for n in SIGNALS}
    V, turns = low["V"], at != 0
    if len(parts) == 2:
        V = np.append(V, 1.0)  # at the shift all members turn alike
    meanings = parts[0][0].meanings
    bad = ~np.isfinite(V[: at.size]) | (turns & ~(np.isfinite(low["efficiency"]) & (low["efficiency"] > 0)))
    problem = f"{meanings[int(status[bad][0])]} at r = {at[bad][0]:g}" if bad.any() else _range_problem(V, unit)
    K = np.maximum(np.abs(low["K"]), np.abs(high["K"]))
    solved = not bad.any()
    return {
        "coupling": coupling,
        "type": kind,
        "R_o": float(R_o),
        "mean_efficiency": _mean(low["efficiency"], weight) if solved else math.nan,
        "mean_efficiency_high": _mean(high["efficiency"], weight) if solved else math.nan,
        "min_efficiency": float(low["efficiency"][turns].min()) if solved else math.nan,
        "max_K": float(K[turns].max()) if solved else math.nan,
        "V_min": float(V.min()) if solved else math.nan,
        "V_max": float(V.max()) if solved else math.nan,
        "regimes": _regimes(at, np.concatenate([c.regime for c, _ in parts])) if solved else "",
        "problem": problem,
    }


def _mean(efficiency: Vector, weight: Vector) -> float:
    """Energy delivered over energy supplied."""
    some = weight > 0
    return float(1.0 / (weight[some] / efficiency[some]).sum())


def _range_problem(V: Vector, unit: Unit) -> str:
    margins = unit_margins(V, unit)
    if (margins >= -_NONE).all():
        return ""
    wanted = f"V from {V.min():.4g} to {V.max():.4g}"
    return (
        f"{wanted}, the unit has {unit[0]:g} to {unit[1]:g}"
        if isinstance(unit, tuple)
        else f"{wanted}, the unit spans {unit:g}"
    )


def _regimes(r: Vector, regime: NDArray[np.intp]) -> str:
    """The regimes in the order of r, with the ratio about which one goes over into the next."""
    known = regime > 1
    r, regime = r[known], regime[known]
    if not regime.size:
        return ""
    words = [REGIMES[regime[0]]]
    for k in np.flatnonzero(np.diff(regime)):
        words.append(f"to r = {(r[k] + r[k + 1]) / 2:.3g}, {REGIMES[regime[k + 1]]}")
    return " ".join(words)


@dataclass(frozen=True)
class SplitPathDesigns:
    """The compared designs. ``table`` ranks them, ``curves`` has their values over r."""

    rows: list[dict[str, Any]]
    duty: Duty
    unit: Unit
    by: Rank
    plants: dict[tuple[str, int], pt.Plant[SplitPathBench]]
    points: dict[tuple[str, int], _Curves]
    ratios: Vector = field(repr=False)

    @cached_property
    def table(self) -> pd.DataFrame:
        """One line per design, the best first, those that cannot do it last.

        ``mean_efficiency``: energy delivered over energy supplied for the duty; where the mesh is stuck at a point of the duty (r = 1)
        by the least torque ratio that it may have, ``mean_efficiency_high`` by the greatest. ``min_efficiency`` and ``max_K`` (size): over
        all points but r = 0. ``V_min``, ``V_max``: what the unit must do. ``regimes``: the cases of Fig. 8 in the order of r.
        ``problem``: why it cannot do it; empty where it can.
        """
        import pandas as pd

        table = pd.DataFrame(self.rows)
        key = {"mean_efficiency": -table.mean_efficiency, "min_efficiency": -table.min_efficiency, "max_K": table.max_K}
        order = (table.V_max - table.V_min) if self.by == "unit_range" else key[self.by]
        table = table.assign(feasible=table.problem == "", _key=order)
        table = table.sort_values(["feasible", "_key"], ascending=[False, True], kind="stable")
        return table.drop(columns="_key").reset_index(drop=True)

    @property
    def feasible(self) -> pd.DataFrame:
        """The designs that can do it."""
        return self.table[self.table.feasible]

    @cached_property
    def curves(self) -> xr.Dataset:
        """V, efficiency, K with the ends of their intervals over coupling, type, R_o and the points of the duty (coordinate r)."""
        import xarray as xr

        couplings = list(dict.fromkeys(c for c, _ in self.points))
        data: dict[str, Any] = {}
        for name in ("V", "efficiency", "K"):
            for end, place in (("low", 0), ("high", 1)):
                whole = np.array([[self.points[c, n].values[name][place] for n in TYPES] for c in couplings])
                data[f"{name}_{end}"] = (("coupling", "type", "R_o", "point"), whole, {"units": "1"})
        regime = np.array(REGIMES)[np.array([[self.points[c, n].regime for n in TYPES] for c in couplings])]
        data["regime"] = (("coupling", "type", "R_o", "point"), regime)
        coords = {"coupling": couplings, "type": list(TYPES), "R_o": self.ratios, "r": ("point", self.duty.r)}
        return xr.Dataset(data, coords=coords)

    def refine(self, line: int = 0, *, bounds: tuple[float, float] | None = None, max_K: float = math.inf) -> Refined:
        """The best R_o for the layouts of a line of ``table``, by exact derivatives of the model; see ``refine_ratio``.

        ``bounds``: by default the compared basic ratios on the same side of 0 and 1.
        """
        row = self.table.iloc[line]
        numbers = [int(w) for w in str(row.type).rpartition(":")[2].replace("then", "").split(",")]
        start = float(row.R_o)
        if bounds is None:
            same = [x for x in self.ratios.tolist() if (x > 0) == (start > 0) and (x > 1) == (start > 1)]
            bounds = min(same), max(same)
        plants = [self.plants[str(row.coupling), n] for n in numbers]
        return refine_ratio(plants, self.duty, start, bounds, unit=self.unit, max_K=max_K)
