"""The current segments of piecewise linear time signals, and the instants at which they change."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from powertrain.dae.hybrid import TimeSignal
from powertrain.dae.tolerances import NOW
from powertrain.language.reals import Array


def just_after(t: float) -> float:
    """The latest time that still counts as the instant ``t``, within rounding."""
    return t + NOW * max(1.0, abs(t))


class Schedules:
    """All schedules of a model, with breakpoints in time order. A repeated time is a jump; its right limit holds at the instant."""

    def __init__(self, schedules: Sequence[TimeSignal]) -> None:
        self.places = [schedule.index for schedule in schedules]
        """The first of the three held values of each schedule."""
        self.segments = [_segments(schedule) for schedule in schedules]
        """See ``_segments``."""
        found = [_breakpoints(schedule) for schedule in schedules]
        times = np.concatenate([np.zeros(0), *(own for own, _ in found)])
        jumps = np.concatenate([np.zeros(0, bool), *(own for _, own in found)])
        owners = np.arange(len(found)).repeat([len(own) for own, _ in found])
        order = np.lexsort((owners, times))
        self.times: list[float] = times[order].tolist()
        """Of all breakpoints, in time order."""
        self.owners: list[int] = owners[order].tolist()
        """The schedule of each breakpoint."""
        self.jumps: list[bool] = jumps[order].tolist()
        """Whether it jumps there, or makes a motion jump."""

    def __bool__(self) -> bool:
        return bool(self.places)

    def enter(self, m: Array, t: float) -> None:
        """Set the segments that hold from ``t`` on."""
        for k in range(len(self.places)):
            self._set(m, k, t)

    def following(self, t: float) -> float:
        """The first breakpoint after ``t``, or infinity."""
        i = bisect_right(self.times, t)
        return self.times[i] if i < len(self.times) else np.inf

    def cross(self, m: Array, before: float, t: float) -> bool:
        """Pass the breakpoints in (before, t]; return whether a signal jumps."""
        jumps = False
        for i in range(bisect_right(self.times, before), bisect_right(self.times, t)):
            self._set(m, self.owners[i], t)
            jumps = jumps or self.jumps[i]
        return jumps

    def _set(self, m: Array, k: int, t: float) -> None:
        starts, rows = self.segments[k]
        index = self.places[k]
        m[index : index + 3] = rows[bisect_right(starts, t)]


def _segments(schedule: TimeSignal) -> tuple[list[float], Array]:
    """Start times, and one row (t0, y0, slope) more than starts: the first row holds before the first time."""
    t, y = np.asarray(schedule.times, float), np.asarray(schedule.values, float)
    last = np.append(t[1:] > t[:-1], True)  # of several values at one time
    slopes = np.zeros_like(t)
    slopes[:-1][last[:-1]] = np.diff(y)[last[:-1]] / np.diff(t)[last[:-1]]
    rows = np.column_stack([t, y, slopes])
    return t[last].tolist(), np.vstack([(t[0], y[0], 0.0), rows[last]])


def _breakpoints(schedule: TimeSignal) -> tuple[Array, NDArray[np.bool_]]:
    """The distinct times, and where the signal jumps, or its derivative if that is part of a motion."""
    t, y = np.asarray(schedule.times, float), np.asarray(schedule.values, float)
    times = np.unique(t)
    jumps = np.isin(times, t[1:][(np.diff(t) == 0) & (np.diff(y) != 0)])
    return times, jumps | schedule.turns
