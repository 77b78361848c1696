"""Worst-case demands on the variable unit of a design, and its lowest efficiency: over the range of r, not just a duty's samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.design.bench import SplitPathBench
from powertrain.design.duty import R_O, Duty, Vector

UNIT = "transmission.cvu"
OUTPUTS = ("V", "efficiency", "K", *(f"{UNIT}.{n}" for n in ("flange_a.tau", "flange_b.tau", "w_a", "w_b")))
WORST = ("V_min", "V_max", "min_efficiency", "max_K", "unit_torque", "unit_speed", "unit_power")
"""The reported quantities: V, efficiency and K; torque [N.m], speed [rad/s] and power [W] of the more loaded shaft of the unit."""
UNITS = {"torque": "N.m", "speed": "rad/s", "power": "W"}
_CELLS = 96
_ZOOM = 17
_NARROW = 1e-8
"""Width, as a share of the range of r, to which an extremum is located; and its closest distance to standstill."""


@dataclass(frozen=True)
class Extrema:
    """The extrema over r of one layout, for each basic ratio; ``where``: their r. Nan if a point has no solution."""

    worst: dict[str, Vector]
    where: dict[str, Vector]


def extrema(plant: pt.Plant[SplitPathBench], duty: Duty, ratios: Vector) -> Extrema:
    """Extrema over low <= r <= high, with the duty's torque and speed between its samples; a sampled duty has its samples only.

    The curves are smooth except for kinks where the direction of power changes, a jump at r = 1, where the mesh is stuck and all values of
    its interval count, and a jump at standstill, which is approached from both sides. They are sampled on a grid, and every maximum that
    may be the largest is refined. At standstill the efficiency is zero.
    """
    import xarray as xr

    points = duty.points() if duty.sampled else duty.at(_grid(duty))
    r = points["r"].to_numpy()
    shape = ratios.size, r.size
    everywhere = {name: xr.concat([of] * ratios.size, "point") for name, of in points.items()}
    on_grid = _values(plant, everywhere, np.repeat(ratios, r.size))
    grid = {name: value.reshape(shape) for name, value in on_grid.items()}
    best = {name: (value.argmax(axis=1), value.max(axis=1)) for name, value in grid.items()}
    top = {name: [r[i].copy(), value.copy()] for name, (i, value) in best.items()}
    jobs = [] if duty.sampled else _brackets(grid, r)
    while jobs:
        jobs = _narrowed(plant, duty, ratios, jobs, top, (r[0], r[-1]))
    worst = {name: -value if name in ("V_min", "min_efficiency") else value for name, (_, value) in top.items()}
    if duty.low <= 0 <= duty.high and not duty.sampled:
        worst["min_efficiency"] = np.where(
            np.isfinite(worst["min_efficiency"]), np.minimum(worst["min_efficiency"], 0.0), np.nan
        )
    return Extrema(worst, {name: at for name, (at, _) in top.items()})


def _grid(duty: Duty) -> Vector:
    """The initial samples of the curves. Nothing is delivered at r = 0 itself."""
    near = _NARROW * (duty.high - duty.low)
    r = np.concatenate([duty.r, np.linspace(duty.low, duty.high, _CELLS + 1), [1.0, -near, near]])
    return np.unique(r[(r >= duty.low) & (r <= duty.high) & (np.abs(r) >= near)])


def _values(plant: pt.Plant[SplitPathBench], points: dict[str, Any], ratios: Vector) -> dict[str, Vector]:
    """The quantities to be minimised, at points each with its basic ratio; the worse end of intervals."""
    import xarray as xr

    found = pt.steady(plant, {**points, R_O: xr.DataArray(ratios, dims="point")}, outputs=OUTPUTS)
    ends = [{n: found.get(f"{n}_{end}", found[n]).to_numpy() for n in OUTPUTS} for end in ("low", "high")]

    def size(name: str) -> Vector:
        return np.asarray(np.maximum(*(np.abs(end[name]) for end in ends)), float)

    tau, w = ([size(f"{UNIT}.{n}") for n in names] for names in (("flange_a.tau", "flange_b.tau"), ("w_a", "w_b")))
    V = ends[0]["V"]
    return {
        "V_min": -V,
        "V_max": V,
        "min_efficiency": -np.minimum(*(end["efficiency"] for end in ends)),
        "max_K": size("K"),
        "unit_torque": np.maximum(*tau),
        "unit_speed": np.maximum(*w),
        "unit_power": np.maximum(*(t * speed for t, speed in zip(tau, w, strict=True))),
    }


Job = tuple[str, int, float, float]
"""A quantity, the number of a basic ratio, and the bracket of r in which a maximum lies."""


def _brackets(grid: dict[str, NDArray[np.float64]], r: Vector) -> list[Job]:
    """Brackets of the maxima on the grid whose refinement may give the largest value: one step to either side."""
    jobs = []
    for name, values in grid.items():
        for k, v in enumerate(values):
            if not np.isfinite(v).all():
                continue
            step = np.abs(np.diff(v))
            reach = np.maximum(np.append(step, 0.0), np.append(0.0, step))
            left, right = np.append(-np.inf, v[:-1]), np.append(v[1:], -np.inf)
            peaks = np.flatnonzero((v >= left) & (v >= right) & (v + reach > v.max()))
            jobs += [(name, k, r[max(i - 1, 0)], r[min(i + 1, r.size - 1)]) for i in peaks.tolist()]
    return jobs


def _narrowed(
    plant: pt.Plant[SplitPathBench],
    duty: Duty,
    ratios: Vector,
    jobs: list[Job],
    top: dict[str, list[Vector]],
    ends: tuple[float, float],
) -> list[Job]:
    """The brackets after one refinement with points inside them; ``top`` is updated.

    Narrow brackets are dropped, as are those in which the curve rises up to an end of the range.
    """
    near = _NARROW * (duty.high - duty.low)
    fine = np.array([np.linspace(low, high, _ZOOM) for _, _, low, high in jobs])
    fine[np.abs(fine) < near] = near
    R_o = np.repeat([ratios[k] for _, k, _, _ in jobs], _ZOOM)
    found = {n: v.reshape(fine.shape) for n, v in _values(plant, duty.at(fine.ravel()), R_o).items()}
    left = []
    for row, (name, k, low, high) in enumerate(jobs):
        values = found[name][row]
        i = int(np.nanargmax(values)) if np.isfinite(values).any() else 0
        at, value = top[name]
        if values[i] > value[k]:
            at[k], value[k] = fine[row, i], values[i]
        at_end = (i == 0 and low <= ends[0]) or (i == _ZOOM - 1 and high >= ends[1])
        if high - low > 16 * near and not at_end:
            left.append((name, k, float(fine[row, max(i - 1, 0)]), float(fine[row, min(i + 1, _ZOOM - 1)])))
    return left


def check_limits(limits: Mapping[str, float] | None) -> dict[str, float]:
    """Errors: ParameterError for a limit that is not positive, or of something else than torque, speed, power."""
    given = dict(limits or {})
    for name, value in given.items():
        if name not in UNITS:
            raise pt.ParameterError(f"limits: the unit has no limit {name!r}; choose from {', '.join(UNITS)}")
        if not value > 0:
            raise pt.ParameterError(f"limits: {name} = {value:g} {UNITS[name]} must be positive")
    return given


def limited(worst: Mapping[str, Any], limits: Mapping[str, float]) -> str:
    """The limit of the unit that is exceeded; empty if there is none."""
    for name, limit in limits.items():
        if worst[f"unit_{name}"] > limit * (1 + 1e-9):
            return f"{name} of the unit up to {worst[f'unit_{name}']:.4g} {UNITS[name]}, it has {limit:g}"
    return ""
