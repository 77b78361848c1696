"""Trajectories computed by another tool, to compare with: a folder of CSV files that ``POWERTRAIN_REFERENCE_RESULTS`` names."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]
VARIABLE = "POWERTRAIN_REFERENCE_RESULTS"
TRANSIENT = 1e-6
"""Modes that last shorter are steps of the other tool's event iteration."""


@dataclass(frozen=True)
class Reference:
    """Signals over time; at an event the time stands twice, with the values before and after it."""

    name: str
    time: Array
    signals: Mapping[str, Array]

    @property
    def continuous(self) -> list[str]:
        """Names of the signals that are neither modes nor flags."""
        return [
            name for name in self.signals if name.rpartition(".")[2] not in ("mode", "startForward", "startBackward")
        ]

    @property
    def modes(self) -> list[str]:
        """Names of the modes."""
        return [name for name in self.signals if name.endswith(".mode")]


def load(name: str) -> Reference:
    """The trajectory ``name`` such as "Rotational/First"; skips the test where the folder is not at hand."""
    folder = os.environ.get(VARIABLE)
    if not folder:
        pytest.skip(f"{VARIABLE} does not name the folder of reference trajectories")
    with (Path(folder) / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    table = np.array(rows, float)
    return Reference(name, table[:, 0], {signal: table[:, i] for i, signal in enumerate(head) if i})


def deviation(result: Any, reference: Reference, signal: str, name: str | None = None) -> float:
    """Largest distance of a continuous signal from the reference over its range, on the reference's grid."""
    expected = reference.signals[signal]
    actual = np.interp(reference.time, np.asarray(result.time), np.asarray(result[name or signal]))
    scale = float(np.ptp(expected)) or max(1.0, float(np.abs(expected).max()))
    return float(np.abs(actual - expected).max()) / scale


def sequence(time: Array, mode: Array) -> list[tuple[float, int]]:
    """(since when, mode) for each stretch of one mode that lasts longer than an event iteration."""
    starts = np.flatnonzero(np.diff(mode, prepend=np.nan) != 0)
    ends = np.append(time[starts[1:]], time[-1])
    found: list[tuple[float, int]] = []
    for start, end in zip(starts, ends, strict=True):
        if end - time[start] > TRANSIENT and (not found or found[-1][1] != round(mode[start])):
            found.append((float(time[start]) if found else float(time[0]), round(mode[start])))
    return found


def assert_close(result: Any, reference: Reference, tolerance: Mapping[str, float], default: float = 1e-4) -> None:
    """Every continuous signal within its tolerance (a share of its range); ``tolerance`` names those that differ from ``default``."""
    found = {signal: deviation(result, reference, signal) for signal in reference.continuous}
    far = {signal: value for signal, value in found.items() if value > tolerance.get(signal, default)}
    assert not far, f"{reference.name}: too far from the reference, as shares of the range: {far}"


def assert_modes(result: Any, reference: Reference, atol: float) -> None:
    """The same sequence of modes, switched within ``atol`` seconds."""
    for signal in reference.modes:
        expected = sequence(reference.time, reference.signals[signal])
        actual = sequence(np.asarray(result.time), np.asarray(result[signal]))
        assert [mode for _, mode in actual] == [mode for _, mode in expected], (signal, actual, expected)
        times = np.abs(np.array([t for t, _ in actual]) - np.array([t for t, _ in expected]))
        assert times.max() <= atol, (signal, times.max(), actual, expected)
