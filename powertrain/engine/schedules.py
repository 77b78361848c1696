"""The current segments of piecewise linear time signals, and the instants at which they change."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from powertrain.compiler.hybrid import TimeSignal
from powertrain.modes.tolerances import NOW
from powertrain.numerics.buffers import Array


def just_after(t: float) -> float:
    """The latest time that still counts as the instant ``t``, within rounding."""
    return t + NOW * max(1.0, abs(t))


class Schedules:
    """All schedules of a model, with breakpoints in time order. A repeated time is a jump; its right limit holds at the instant."""

    def __init__(self, schedules: Sequence[TimeSignal]) -> None:
        self._schedules = schedules
        self._segments = [_segments(schedule) for schedule in schedules]
        points = sorted({(float(time), k) for k, schedule in enumerate(schedules) for time in schedule.times})
        self._times = [time for time, _ in points]
        self._owners = [k for _, k in points]
        self._jumps = {(k, float(time)) for k, schedule in enumerate(schedules) for time in _jumps(schedule)}

    @property
    def segments(self) -> list[tuple[list[float], list[Array]]]:
        """For each schedule the start times and one row (t0, y0, slope) more than starts: the first row holds before the first time."""
        return self._segments

    @property
    def places(self) -> list[int]:
        """The place of the first of the three held values of each schedule."""
        return [schedule.index for schedule in self._schedules]

    @property
    def breakpoints(self) -> list[tuple[float, int, bool]]:
        """Time, index of the schedule, and whether it jumps there, in time order."""
        pairs = zip(self._times, self._owners, strict=True)
        return [(t, k, (k, t) in self._jumps) for t, k in pairs]

    def __bool__(self) -> bool:
        return bool(self._schedules)

    def enter(self, m: Array, t: float) -> None:
        """Set the segments that hold from ``t`` on."""
        for k in range(len(self._schedules)):
            self._set(m, k, t)

    def following(self, t: float) -> float:
        """The first breakpoint after ``t``, or infinity."""
        i = bisect_right(self._times, t)
        return self._times[i] if i < len(self._times) else np.inf

    def cross(self, m: Array, before: float, t: float) -> bool:
        """Pass the breakpoints in (before, t]; return whether a signal jumps."""
        jumps = False
        for i in range(bisect_right(self._times, before), bisect_right(self._times, t)):
            self._set(m, self._owners[i], t)
            jumps = jumps or (self._owners[i], self._times[i]) in self._jumps
        return jumps

    def _set(self, m: Array, k: int, t: float) -> None:
        starts, rows = self._segments[k]
        index = self._schedules[k].index
        m[index : index + 3] = rows[bisect_right(starts, t)]


def _segments(schedule: TimeSignal) -> tuple[list[float], list[Array]]:
    """Start times, and one row (t0, y0, slope) more than starts: the first row holds before the first time."""
    times, values = [float(v) for v in schedule.times], [float(v) for v in schedule.values]
    starts: list[float] = []
    rows = [(times[0], values[0], 0.0)]
    for i, (t0, y0) in enumerate(zip(times, values, strict=True)):
        if i + 1 < len(times) and times[i + 1] <= t0:
            continue
        slope = (values[i + 1] - y0) / (times[i + 1] - t0) if i + 1 < len(times) else 0.0
        starts.append(t0)
        rows.append((t0, y0, slope))
    return starts, list(np.array(rows))


def _jumps(schedule: TimeSignal) -> list[float]:
    times, values = schedule.times, schedule.values
    return [float(times[i]) for i in range(1, len(times)) if times[i] == times[i - 1] and values[i] != values[i - 1]]
