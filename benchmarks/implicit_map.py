"""Operating points whose efficiency depends on the torque that it determines, against a vectorised fixed point in numpy."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

import powertrain as pt
from benchmarks import native
from benchmarks.steady_map import ETA, RATIO
from benchmarks.timing import Call, Row, at_most, duration, measure, table
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

    def ours(compile: bool) -> Array:
        found = pt.steady(plant, {"r": ratio, "load": load}, outputs=[INPUT_TORQUE], compile=compile)
        return np.asarray(found[INPUT_TORQUE].values)

    error = float(np.abs(ours(False) - fixed_point(r, T_a)).max())
    calls: dict[str, Call] = {"no compiler": lambda: ours(False), "numpy": lambda: fixed_point(r, T_a)}
    reason = native.no_compiler()
    if not reason:
        calls["compiled"] = lambda: ours(True)
    times = measure(calls, rounds)

    def took(name: str) -> str:
        return f"{duration(times.median(name))}, {duration(times.median(name) / (n * n))} a point"

    rows = [
        Row(NAME, f"{n * n:,} points, no compiler", took("no compiler")),
        Row(NAME, "largest difference from the fixed point", f"{error:.1e} N.m", "<= 1e-6 N.m", error <= 1e-6),
        Row(NAME, "fixed point in numpy", duration(times.median("numpy"))),
        Row(NAME, "no compiler, against the fixed point in numpy", f"{times.ratio('no compiler', 'numpy'):.3g} x"),
    ]
    if reason:
        return [*rows, Row(NAME, "compiled", reason)]
    return [
        *rows,
        Row(NAME, f"{n * n:,} points, compiled", took("compiled")),
        at_most(NAME, "compiled, against the fixed point in numpy", times.ratio("compiled", "numpy"), GOAL),
    ]


if __name__ == "__main__":
    print(table(run(*map(int, sys.argv[1:]))))
