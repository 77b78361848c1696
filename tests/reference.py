"""Samples of trajectories of the Modelica Standard Library's examples, from another tool (``data/msl``), and how to compare with them.

A continuous signal is compared at the samples' instants. Where one of ours jumps within ``WINDOW`` of such an instant, the sample may lie
anywhere between the values it has there: two tools agree on the instant of an event to within their tolerances only.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FOLDER = Path(__file__).parent / "data" / "msl"
WINDOW = 1e-5
"""Distance in seconds of instants of one event."""
TRANSIENT = 1e-6
"""Modes that last shorter are steps of the other tool's event iteration."""
FLAGS = ("mode", "startForward", "startBackward")


@dataclass(frozen=True)
class Reference:
    """Samples of signals over time; at an event the time stands twice, with the values before and after it.

    ``modes`` are (since when, mode) for each stretch of one mode.
    """

    name: str
    time: Array
    signals: Mapping[str, Array]
    modes: Mapping[str, list[tuple[float, int]]]


def load(name: str) -> Reference:
    """The trajectory ``name`` such as "Rotational/First"."""
    lines = (FOLDER / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    modes = dict(json.loads(line.removeprefix("# mode ")) for line in lines if line.startswith("# mode "))
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    table = np.array(rows, float)
    signals = {signal: table[:, i] for i, signal in enumerate(head) if i}
    return Reference(
        name, table[:, 0], signals, {signal: [(t, m) for t, m in found] for signal, found in modes.items()}
    )


def deviation(result: Any, reference: Reference, signal: str) -> float:
    """Largest distance of a signal from the reference over its range; ``result`` has samples at the reference's times."""
    time, actual, expected = np.asarray(result.time), np.asarray(result[signal]), reference.signals[signal]
    first = time.searchsorted(reference.time - WINDOW)
    last = time.searchsorted(reference.time + WINDOW, side="right")
    assert (last > first).all(), f"{reference.name}: simulate with times=np.unique(reference.time)"
    low, high = (np.array([pick(actual[a:b]) for a, b in zip(first, last, strict=True)]) for pick in (np.min, np.max))
    distance = np.maximum(np.maximum(low - expected, expected - high), 0.0)
    scale = float(np.ptp(expected)) or max(1.0, float(np.abs(expected).max()))
    return float(distance.max()) / scale


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
    found = {signal: deviation(result, reference, signal) for signal in reference.signals}
    far = {signal: value for signal, value in found.items() if value > tolerance.get(signal, default)}
    assert not far, f"{reference.name}: too far from the reference, as shares of the range: {far}"


def assert_modes(result: Any, reference: Reference, atol: float) -> None:
    """The same sequence of modes, switched within ``atol`` seconds."""
    for signal, expected in reference.modes.items():
        actual = sequence(np.asarray(result.time), np.asarray(result[signal]))
        assert [mode for _, mode in actual] == [mode for _, mode in expected], (signal, actual, expected)
        times = np.abs(np.array([t for t, _ in actual]) - np.array([t for t, _ in expected]))
        assert times.max() <= atol, (signal, times.max(), actual, expected)
