"""The steady map of a split-path transmission at a million points, against its closed form in numpy and in a compiled C loop."""

from __future__ import annotations

import ctypes
import sys

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import powertrain as pt
from benchmarks import native
from benchmarks.timing import Call, Row, at_most, duration, measure, seconds, table
from powertrain.design import SplitPathBench

NAME = "steady map"
ETA, ETA_V, RATIO = 0.95, 0.9, -1.7
SIGNALS = ("V", "efficiency", "K", "transmission.flange_a.tau")
Array = NDArray[np.float64]


def by_hand(ratio: Array, load: Array) -> list[Array]:
    """The closed form over the grid of ratios and loads."""
    V, *others = closed_form(ratio[:, None], load[None, :])
    return [np.broadcast_to(V, others[0].shape).copy(), *others]


def closed_form(r: Array, T_a: Array) -> list[Array]:
    """Yu & Beachley's formulas for the output on a and the unit at the carrier, vectorised; power may flow either way."""
    V = (r - RATIO) / (1 - RATIO)
    T_b = np.where(T_a * (r - V) > 0, -RATIO * ETA, -RATIO / ETA) * T_a
    P_2 = (-T_a - T_b) * V
    unit = P_2 * np.where(P_2 > 0, 1 / ETA_V, ETA_V)
    T_1 = T_b + unit
    K = np.where(P_2 > 0, unit, P_2) / T_1
    P_out = -T_a * r
    return [V, np.where(T_1 >= 0, P_out, T_1) / np.where(T_1 >= 0, T_1, P_out), K, T_1]


def in_c(ratio: Array, load: Array) -> Call:
    """The same formulas in a compiled loop."""
    function = native.build(native.FLOORS / "split_path.c").split_path
    double, long = ctypes.c_double, ctypes.c_long

    def call() -> list[Array]:
        out = [np.empty((ratio.size, load.size)) for _ in SIGNALS]
        numbers = double(RATIO), double(ETA), double(ETA_V)
        arrays = [native.pointer(o) for o in out]
        function(long(ratio.size), long(load.size), native.pointer(ratio), native.pointer(load), *numbers, *arrays)
        return out

    return call


def run(rounds: int = 15, n: int = 1000) -> list[Row]:
    """All rows of this benchmark."""
    native.keep_memory()
    ratio, load = np.linspace(-2.0, 3.0, n), np.linspace(-200.0, 200.0, n)
    plant = pt.compile(SplitPathBench())

    def ours() -> list[Array]:
        found = pt.steady(plant, {"r": ratio, "load": load}, outputs=SIGNALS)
        return [found[name].values for name in SIGNALS]

    first = seconds(ours)
    calls: dict[str, Call] = {"ours": ours, "numpy": lambda: by_hand(ratio, load)}
    reason = native.no_compiler()
    if not reason:
        calls["C"] = in_c(ratio, load)
    exact = by_hand(ratio, load)
    error = max(float((np.abs(a - b) / (1 + np.abs(b))).max()) for a, b in zip(ours(), exact, strict=True))
    times = measure(calls, rounds)
    million = n * n / 1e6
    rows = [
        Row(NAME, f"{million:g} million points, no compiler", duration(times.median("ours"))),
        Row(NAME, "the first map of a plant, all preparations", duration(first)),
        Row(NAME, "largest relative difference from the closed form", f"{error:.1e}", "<= 1e-9", error <= 1e-9),
        Row(NAME, "closed form in numpy", duration(times.median("numpy"))),
        at_most(NAME, "against the closed form in numpy", times.ratio("ours", "numpy"), 1),
    ]
    rows += scattered(plant, rounds, n * n, reason)
    if reason:
        return [*rows, Row(NAME, "against C", reason)]
    rows.append(Row(NAME, "closed form in a C loop", duration(times.median("C"))))
    rows.append(at_most(NAME, "against the closed form in C", times.ratio("ours", "C"), 5))
    return rows


def scattered(plant: pt.Plant[SplitPathBench], rounds: int, count: int, no_compiler: str) -> list[Row]:
    """Points in no order: neighbours have other modes, and nothing is the same along a row. In machine code two threads share them."""
    random = np.random.default_rng(1)
    ratio, load = random.uniform(-2.0, 3.0, count), random.uniform(-200.0, 200.0, count)
    points = {"r": xr.DataArray(ratio, dims="point"), "load": xr.DataArray(load, dims="point")}

    def ours(compile: bool) -> list[Array]:
        found = pt.steady(plant, points, outputs=SIGNALS, compile=compile)
        return [found[name].values for name in SIGNALS]

    calls: dict[str, Call] = {"no compiler": lambda: ours(False), "numpy": lambda: closed_form(ratio, load)}
    if not no_compiler:
        calls["compiled"] = lambda: ours(True)
    times = measure(calls, rounds)
    million = f"{count / 1e6:g} million scattered points"
    against = f"{times.ratio('no compiler', 'numpy'):.3g} x"
    rows = [
        Row(NAME, f"{million}, no compiler", duration(times.median("no compiler"))),
        Row(NAME, f"{million}, no compiler, against the closed form in numpy", against),
    ]
    if no_compiler:
        return [*rows, Row(NAME, f"{million}, compiled", no_compiler)]
    ratio_compiled = times.ratio("compiled", "numpy")
    return [
        *rows,
        Row(NAME, f"{million}, compiled, two threads", duration(times.median("compiled"))),
        at_most(NAME, f"{million}, compiled, two threads, against the closed form in numpy", ratio_compiled, 1),
    ]


if __name__ == "__main__":
    print(table(run(*map(int, sys.argv[1:]))))
