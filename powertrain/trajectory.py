"""What a run leaves behind: its steps with their dense output, its modes, and its events with both limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.buffers import Array


@dataclass(frozen=True)
class Event:
    """One law that changed at one instant; ``old`` and ``new`` are its mode before and after, ``kind`` what it is."""

    time: float
    name: str
    kind: str
    old: float
    new: float


@dataclass(frozen=True)
class Instant:
    """All that happened at one instant: unknowns and held values of both sides. ``extra`` are (name, kind) of impacts and resets."""

    time: float
    left: Array
    right: Array
    held_left: Array
    held_right: Array
    extra: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Trajectory:
    """The accepted steps of one run.

    Step i starts at ``times[i]`` with ``dense[i]`` (5 columns of y = (x, z) in powers of (t - times[i]) / sizes[i]) and lasts until the next
    one starts; ``held[mode_of_step[i]]`` are its held values.
    """

    times: Array
    sizes: Array
    dense: NDArray[np.float64]
    held: NDArray[np.float64]
    mode_of_step: NDArray[np.int64]
    end: float
    final: Array
    final_held: Array
    states: int
    instants: tuple[Instant, ...]
    laws: tuple[tuple[int, str, str], ...]
    statistics: dict[str, float] = field(default_factory=dict)

    @property
    def start(self) -> float:
        return float(self.times[0]) if len(self.times) else self.end

    @property
    def events(self) -> list[Event]:
        """What switched when, in time order; events of one instant in the order of the laws."""
        found: list[Event] = []
        for instant in self.instants:
            for index, name, kind in self.laws:
                old, new = float(instant.held_left[index]), float(instant.held_right[index])
                if old != new:
                    found.append(Event(instant.time, name, kind, old, new))
            found += [Event(instant.time, name, kind, np.nan, np.nan) for name, kind in instant.extra]
        return found

    def at(self, times: ArrayLike, with_events: bool = True) -> tuple[Array, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Times, states, algebraic unknowns and held values (one row per time).

        With events, the instants of all events are added, each twice: its left limit, then its right one. Without, a requested time at
        which an event happens gives the right limit. Times beyond what was reached are left out.
        """
        asked = np.atleast_1d(np.asarray(times, dtype=np.float64))
        if asked.size and (asked[0] < self.start or asked[-1] > self.end or asked.min() < self.start or asked.max() > self.end):
            asked = asked[(asked >= self.start) & (asked <= self.end)]
        y, held = self._evaluate(asked)
        if with_events and self.instants:
            asked, y, held = self._with_events(asked, y, held)
        return asked, y[:, : self.states], y[:, self.states :], held

    def _evaluate(self, times: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if not len(self.times):
            return np.tile(self.final, (len(times), 1)), np.tile(self.final_held, (len(times), 1))
        step = np.searchsorted(self.times, times, side="right") - 1
        q = ((times - self.times[step]) / self.sizes[step])[:, None]
        dense = self.dense[step]
        y = dense[:, 4]
        for column in (3, 2, 1, 0):
            y = dense[:, column] + q * y
        held = self.held[self.mode_of_step[step]]
        at_end = times == self.end
        if at_end.any():
            y[at_end] = self.final
            held[at_end] = self.final_held
        return y, held

    def _with_events(
        self, times: Array, y: NDArray[np.float64], held: NDArray[np.float64]
    ) -> tuple[Array, NDArray[np.float64], NDArray[np.float64]]:
        instants = self.instants
        when = np.array([instant.time for instant in instants])
        place = np.searchsorted(when, times)
        keep = when[np.minimum(place, len(when) - 1)] != times
        if not keep.all():
            times, y, held = times[keep], y[keep], held[keep]
        both = np.repeat(when, 2)
        at = np.searchsorted(times, both) if _is_sorted(times) else np.full(len(both), len(times))
        sides = np.array([side for instant in instants for side in (instant.left, instant.right)])
        held_sides = np.array([side for instant in instants for side in (instant.held_left, instant.held_right)])
        merged = np.insert(times, at, both), np.insert(y, at, sides, axis=0), np.insert(held, at, held_sides, axis=0)
        if _is_sorted(times):
            return merged
        order = np.argsort(merged[0], kind="stable")
        return merged[0][order], merged[1][order], merged[2][order]


def _is_sorted(times: Array) -> bool:
    return bool((times[1:] >= times[:-1]).all())


class Recorder:
    """Collects the steps of a running simulation at the cost of a few list appends per step."""

    def __init__(self, unknowns: int, states: int, laws: tuple[tuple[int, str, str], ...]) -> None:
        self.unknowns, self.states, self.laws = unknowns, states, laws
        self.times: list[float] = []
        self.sizes: list[float] = []
        self.rows: list[bytes] = []
        self.held: list[Array] = []
        self.held_from: list[int] = []
        self.instants: list[Instant] = []

    def enter(self, m: Array) -> None:
        """The held values from the next step on."""
        self.held.append(m.copy())
        self.held_from.append(len(self.times))

    def trajectory(self, end: float, final: Array, m: Array, statistics: dict[str, float]) -> Trajectory:
        n = len(self.times)
        dense = np.frombuffer(b"".join(self.rows)).reshape(n, 5, -1) if n else np.zeros((0, 5, self.unknowns))
        lasting = np.diff(np.array([*self.held_from, n]))
        return Trajectory(
            times=np.array(self.times),
            sizes=np.array(self.sizes),
            dense=dense[:, :, : self.unknowns],
            held=_rows(self.held),
            mode_of_step=np.repeat(np.arange(len(self.held)), lasting),
            end=end,
            final=final[: self.unknowns].copy(),
            final_held=m.copy(),
            states=self.states,
            instants=tuple(self.instants),
            laws=self.laws,
            statistics=statistics,
        )


def _rows(vectors: Sequence[Array]) -> NDArray[np.float64]:
    return np.array(vectors) if vectors else np.zeros((0, 0))
