"""Operating points whose efficiency depends on the torque that it determines, against a vectorised fixed point in numpy."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

import powertrain as pt
from benchmarks.steady_map import ETA, RATIO
from benchmarks.timing import Row, at_most, duration, measure, table
from powertrain.components.cvu import CVU
from powertrain.components.transmissions import SplitPathTransmission
from powertrain.design import SplitPathBench

NAME = "implicit map"
GOAL = 3
INPUT_TORQUE = "transmission.flange_a.tau"
RATIOS, TORQUES = np.linspace(-2, 2, 7), np.array([0.0, 5, 20, 50, 100, 200, 400])
EFFICIENCY = 0.92 - 0.025 * np.abs(RATIOS[:, None]) - 0.15 * np.exp(-TORQUES / 30)
Array = NDArray[np.float64]


def bench() -> SplitPathBench:
    """The transmission with a unit whose efficiency is a table over its ratio and torque."""
    axes = [pt.Axis("ratio", "1", RATIOS, "clip"), pt.Axis("tau", "N.m", TORQUES, "clip")]
    efficiency = pt.Map(axes, EFFICIENCY, "1")
    return SplitPathBench(transmission=SplitPathTransmission(cvu=CVU(map_ab=efficiency, map_ba=efficiency)))


def fixed_point(r: Array, T_a: Array) -> Array:
    """The input torque: the unit's own torque from its efficiency there, until it changes by less than 1e-10 of the largest."""
    efficiency = RegularGridInterpolator((RATIOS, TORQUES), EFFICIENCY)
    V = (r - RATIO) / (1 - RATIO)
    T_b = np.where(T_a * (r - V) > 0, -RATIO * ETA, -RATIO / ETA) * T_a
    P_2, ratio = (-T_a - T_b) * V, np.clip(V, RATIOS[0], RATIOS[-1])
    unit, before = P_2, np.full_like(P_2, np.inf)
    while np.abs(unit - before).max() > 1e-10 * np.abs(unit).max():
        eta = efficiency(np.stack([ratio, np.minimum(np.abs(unit), TORQUES[-1])], axis=-1))
        before, unit = unit, P_2 * np.where(P_2 > 0, 1 / eta, eta)
    return np.asarray(T_b + unit)


def run(rounds: int = 9, n: int = 100) -> list[Row]:
    """All rows of this benchmark."""
    plant, ratio, load = pt.compile(bench()), np.linspace(-2.0, 3.0, n), np.linspace(-200.0, 200.0, n)
    r, T_a = (a.copy() for a in np.broadcast_arrays(ratio[:, None], load[None, :]))

    def ours() -> Array:
        return np.asarray(pt.steady(plant, {"r": ratio, "load": load}, outputs=[INPUT_TORQUE])[INPUT_TORQUE].values)

    error = float(np.abs(ours() - fixed_point(r, T_a)).max())
    times = measure({"ours": ours, "numpy": lambda: fixed_point(r, T_a)}, rounds)
    each = times.median("ours") / (n * n)
    return [
        Row(NAME, f"{n * n:,} points, no compiler", f"{duration(times.median('ours'))}, {duration(each)} a point"),
        Row(NAME, "largest difference from the fixed point", f"{error:.1e} N.m", "<= 1e-6 N.m", error <= 1e-6),
        Row(NAME, "fixed point in numpy", duration(times.median("numpy"))),
        at_most(NAME, "against the fixed point in numpy", times.ratio("ours", "numpy"), GOAL),
    ]


if __name__ == "__main__":
    print(table(run(*map(int, sys.argv[1:]))))
