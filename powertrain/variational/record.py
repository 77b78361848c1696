"""The data of a run that its derivatives use: its steps at collocation points, and both limits of its events.

The rest of this package accesses a run only through these records.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.special import roots_jacobi

from powertrain.engine.trajectory import Instant, Samples, Trajectory
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.signals import signals_of

STAGES = 4
"""One more than the fifth order of the run's methods requires: the forcing of the variational equations may be faster than the states."""
POINTS = np.append(0.5 * (1.0 + np.sort(roots_jacobi(STAGES - 1, 1.0, 0.0)[0])), 1.0)
"""The collocation points of Radau IIA in a step of length 1: zeros of the Jacobi polynomial P(1, 0), and the end."""

_BESIDE = 1e-12
"""Distance, in s and relative to the time, of a limit of functions of the time from an event: sign(0) is on neither side."""
_FEW = 64


@dataclass(frozen=True)
class Steps:
    """Steps without events inside: starts and durations in s, and samples at their collocation points, consecutively."""

    times: Array
    durations: Array
    samples: Samples

    def before(self, t: float) -> int:
        """The number of steps that start before ``t``."""
        return int(self.times.searchsorted(t, side="left"))


@dataclass(frozen=True)
class Instants:
    """The events of a run: times in s, both limits, samples some steps before, impacts and resets by name.

    ``seen`` is the left limit as the event was located, with the algebraic unknowns of the dense output.
    """

    times: Array
    seen: Samples
    left: Samples
    right: Samples
    before: Samples
    extra: tuple[tuple[tuple[str, str], ...], ...]


@dataclass(frozen=True)
class Record:
    """One run: parameters by index, first and last instant in s, steps cut at the requested times, events."""

    p: Array
    start: float
    end: float
    first: Samples
    steps: Steps
    instants: Instants


def record(result: Result[Any], cuts: Array) -> Record:
    """The run of a result, with steps that also end at ``cuts``."""
    trajectory = result.trajectory
    signals = signals_of(result.compiled)

    def corrected(samples: Samples) -> Samples:
        return signals.corrected(samples, result.p)

    nodes = np.unique(np.concatenate([trajectory.times, cuts, [trajectory.end]]))
    nodes = nodes[(nodes >= trajectory.start) & (nodes <= trajectory.end)]
    starts, durations = nodes[:-1], np.diff(nodes)
    owner = trajectory.times.searchsorted(starts, side="right") - 1
    times = starts[:, None] + durations[:, None] * POINTS
    samples = corrected(trajectory.in_steps(times.ravel(), owner.repeat(len(POINTS))))
    return Record(
        result.p,
        trajectory.start,
        trajectory.end,
        result.samples_at(nodes[:1]),
        Steps(starts, durations, samples),
        _instants(trajectory, corrected, [s.index for s in result.compiled.dae.switches if s.continuous]),
    )


def _instants(trajectory: Trajectory, corrected: Any, switches: list[int]) -> Instants:
    told = [i for i in trajectory.instants if i.time > trajectory.start]
    found = sorted([*told, *_quiet(trajectory, told, switches)], key=lambda i: i.time)
    seen, right = (Samples(*(values[k::2] for values in trajectory.limits(found))) for k in (0, 1))
    times, right = seen.t, shifted(right, 1)
    before = _inside(trajectory, times - spans(trajectory, times, before=True)) if found else seen
    return Instants(times, seen, corrected(seen), corrected(right), corrected(before), tuple(i.extra for i in found))


def _quiet(trajectory: Trajectory, told: Sequence[Instant], switches: list[int]) -> Iterator[Instant]:
    """Changes of ``switches`` without an event, because branches meet there; a rate that contains their derivatives may jump."""
    rows = trajectory.mode_of_step
    known = np.array([i.time for i in told], float)
    for i in np.flatnonzero(rows[1:] != rows[:-1]) + 1:
        t, old, new = float(trajectory.times[i]), trajectory.held[rows[i - 1]], trajectory.held[rows[i]]
        if (old[switches] == new[switches]).all() or (np.abs(known - t) <= _BESIDE * (1.0 + abs(t))).any():
            continue
        left = trajectory.in_steps(np.array([t]), np.array([i - 1]))
        yield Instant(t, np.concatenate([left.x[0], left.z[0]]), trajectory.dense[i][0], old, new)


def shifted(limits: Samples, side: int) -> Samples:
    """Limits at events, moved away from them in time: to the left (-1) or right (1)."""
    return limits._replace(t=limits.t + side * _BESIDE * (1.0 + np.abs(limits.t)))


def edge(result: Result[Any], times: Array, before: bool, share: float = 0.0) -> Samples:
    """Dense output a ``share`` of a step before or after instants; with zero share, of the steps that end or begin there."""
    trajectory = result.trajectory
    side: Literal["left", "right"] = "left" if before else "right"
    if share:
        apart = share * spans(trajectory, times, before)
        times, side = (times - apart if before else times + apart), "right"
    owner = np.maximum(trajectory.times.searchsorted(times, side=side) - 1, 0)
    return signals_of(result.compiled).corrected(trajectory.in_steps(times, owner), result.p)


def spans(trajectory: Trajectory, times: Array, before: bool) -> Array:
    """The longest of the few steps before or after instants, in s, up to the next event; the step that ends at an event may be tiny."""
    starts, row = trajectory.times, trajectory.mode_of_step
    changes, told = starts[1:][row[1:] != row[:-1]], np.array([i.time for i in trajectory.instants])
    apart = nearest(told, changes) > _BESIDE * (1.0 + np.abs(changes))
    bounds = np.unique([trajectory.start, trajectory.end, *changes[apart], *told])
    side: Literal["left", "right"] = "left" if before else "right"
    place = bounds.searchsorted(times, side=side)
    room = times - bounds[np.maximum(place - 1, 0)] if before else bounds[np.minimum(place, len(bounds) - 1)] - times
    owner = starts.searchsorted(times, side=side) - 1
    few = owner[:, None] + (np.arange(-_FEW, 1) if before else np.arange(_FEW + 1))
    return np.asarray(np.minimum(trajectory.sizes[few.clip(0, len(starts) - 1)].max(axis=1), room), float)


def nearest(instants: Array, times: Array) -> Array:
    """The distance of each time from the nearest of the ``instants``."""
    bounds = np.concatenate([[-np.inf], np.sort(instants), [np.inf]])
    after = bounds.searchsorted(times)
    return np.asarray(np.minimum(times - bounds[np.maximum(after - 1, 0)], bounds[after] - times), float)


def _inside(trajectory: Trajectory, times: Array) -> Samples:
    """Right limits at times of the run; rounding may put the first one before its start."""
    return trajectory.at(np.maximum(times, trajectory.start), with_events=False)
