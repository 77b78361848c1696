"""The record of a run: its steps with dense output, its modes, and its events with both limits."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.dae.friction import FREE
from powertrain.dae.tolerances import BEGINNING, NOW
from powertrain.engine.catalogue import Catalogue
from powertrain.errors import ParameterError
from powertrain.language.reals import Array
from powertrain.language.units import told_apart
from powertrain.numerics.buffers import view

COUNTED = "outside "
"""What the names of the counts of guards begin with in the statistics of a run."""


def within_span(what: str, times: Array, first: float, last: float) -> Array:
    """The times, those beyond an end by round-off at this end; ParameterError if one lies outside. ``what``: the start of the message."""
    inside = np.clip(times, first, last)
    outside = times[np.abs(times - inside) > NOW * np.maximum(1.0, np.abs(times))]
    if outside.size:
        t = told_apart(outside.flat[0], (first, last))
        raise ParameterError(f"{what}{t} s lies outside the simulated span [{first:g}, {last:g}] s")
    return inside


@dataclass(frozen=True)
class Event:
    """One law that changed at one instant: ``old`` and ``new`` are its modes before and after, ``kind`` the kind of law."""

    time: float
    name: str
    kind: str
    old: float
    new: float


class Instant(NamedTuple):
    """Everything that happened at one instant: unknowns and held values on both sides.

    ``extra``: (name, kind) of impacts and resets; ``impulses``: those of all barriers in N.m.s and N.s, if there was an impact.
    """

    time: float
    left: Array
    right: Array
    held_left: Array
    held_right: Array
    extra: tuple[tuple[str, str], ...] = ()
    impulses: tuple[float, ...] = ()

    def begins(self, start: float, rests: Collection[int]) -> bool:
        """Whether free laws engage here at the start of the run, which is not an event. ``rests``: indices of the marks of resting laws."""
        if self.extra or self.time > start + BEGINNING * max(1.0, abs(self.time)):
            return False
        changed = np.flatnonzero(self.held_left != self.held_right).tolist()
        return all(self.held_left[place] == FREE for place in changed if place not in rests)


class Samples(NamedTuple):
    """Times, states, algebraic unknowns and held values, one row per sample."""

    t: Array
    x: NDArray[np.float64]
    z: NDArray[np.float64]
    m: NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """The accepted steps of one run.

    Step i starts at ``times[i]`` with ``dense[i]`` (5 columns of y = (x, z) in powers of (t - times[i]) / sizes[i]) and lasts until the
    next one starts; ``held[mode_of_step[i]]`` are its held values. ``rests``: see ``powertrain.engine.catalogue``. ``notes`` says what
    is not unique in the result.
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
    rests: Mapping[int, int] = field(default_factory=dict)
    statistics: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def start(self) -> float:
        """Time of the first step."""
        return float(self.times[0]) if len(self.times) else self.end

    def within(self, what: str, times: Array) -> Array:
        """The times, see ``within_span``."""
        return within_span(what, times, self.start, self.end)

    @property
    def events(self) -> list[Event]:
        """All changes of laws in time order; events of one instant in the order of the laws."""
        found: list[Event] = []
        for instant in self.instants:
            for index, name, kind in self.laws:
                old, new = self._shown(instant.held_left, index), self._shown(instant.held_right, index)
                if old != new:
                    found.append(Event(instant.time, name, kind, old, new))
            found += [Event(instant.time, name, kind, np.nan, np.nan) for name, kind in instant.extra]
        return found

    def _shown(self, held: Array, index: int) -> float:
        """The mode of a law; 0 if it rests at a limit."""
        at_rest = index in self.rests and held[self.rests[index]] > 0.0
        return 0.0 if at_rest else float(held[index])

    def part(self, start: float, end: float) -> Trajectory:
        """The steps and events from ``start`` to ``end`` within the run, in whole steps."""
        first, last = int(self.times.searchsorted(start, "right")) - 1, int(self.times.searchsorted(end))
        if last < len(self.times):
            at, final, held = float(self.times[last]), self.dense[last, 0], self.held[self.mode_of_step[last]]
        else:
            at, final, held = self.end, self.final, self.final_held
        steps = slice(first, last)
        return replace(
            self,
            times=self.times[steps],
            sizes=self.sizes[steps],
            dense=self.dense[steps],
            mode_of_step=self.mode_of_step[steps],
            end=at,
            final=final,
            final_held=held,
            instants=tuple(i for i in self.instants if self.times[first] <= i.time <= at),
        )

    def at(self, times: ArrayLike, with_events: bool = True) -> Samples:
        """The run at some times.

        With events, the instants of all events are added twice: the left limit, then the right limit. Without, a requested time at which an
        event happens gives the right limit. Times after the end of the run are left out.
        """
        asked = np.atleast_1d(np.asarray(times, dtype=np.float64))
        asked = asked[(asked >= self.start) & (asked <= self.end)]
        if not (with_events and self.instants):
            return self._samples(asked, *self._evaluate(asked))
        merged, places = self._merged(np.sort(asked))
        y, held = self._evaluate(merged)
        y[places], held[places] = self._limits(self.instants)
        return self._samples(merged, y, held)

    def in_steps(self, times: Array, steps: NDArray[np.int_]) -> Samples:
        """The dense output of given steps, one for each time."""
        return self._samples(times, *self._polynomials(times, steps))

    def limits(self, instants: Sequence[Instant]) -> Samples:
        """The left and the right limit at each instant of events."""
        return self._samples(np.array([i.time for i in instants], float).repeat(2), *self._limits(instants))

    def _limits(self, instants: Sequence[Instant]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unknowns and held values on both sides of each instant."""
        count, size = 2 * len(instants), self.dense.shape[2]
        y = np.array([side[:size] for i in instants for side in (i.left, i.right)], float)
        held = np.array([side for i in instants for side in (i.held_left, i.held_right)], float)
        return y.reshape(count, size), held.reshape(count, self.held.shape[1])

    def _samples(self, times: Array, y: NDArray[np.float64], held: NDArray[np.float64]) -> Samples:
        return Samples(times, y[:, : self.states], y[:, self.states :], held)

    def _evaluate(self, times: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unknowns and held values at some times, one row per time."""
        if not len(self.times):
            return np.tile(self.final, (len(times), 1)), np.tile(self.final_held, (len(times), 1))
        y, held = self._polynomials(times, self.times.searchsorted(times, "right") - 1)
        last = times == self.end
        y[last], held[last] = self.final, self.final_held
        return y, held

    def _polynomials(self, times: Array, steps: NDArray[np.int_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The same by the dense output of given steps; each column of the unknowns is contiguous."""
        first = np.flatnonzero(np.diff(steps, prepend=-1))
        counts = np.diff(first, append=len(steps))
        q = (times - self.times[steps]) / self.sizes[steps]
        columns = self.dense[steps[first]].transpose(1, 2, 0).copy()
        y = columns[4].repeat(counts, axis=1)
        for k in (3, 2, 1, 0):
            y *= q
            y += columns[k].repeat(counts, axis=1)
        return y.T, self.held.take(self.mode_of_step[steps], axis=0)

    def _merged(self, times: Array) -> tuple[Array, NDArray[np.int64]]:
        """The ascending times with the instants of all events added twice, and the indices of those."""
        when = np.array([instant.time for instant in self.instants])
        others = times[~np.isin(times, when)]
        after = others.searchsorted(when).repeat(2)
        return np.insert(others, after, when.repeat(2)), after + np.arange(after.size)


class TrajectoryRecorder:
    """Collects the steps of a running simulation: ``rows`` are the bytes of ``record`` after each, see ``Memory``."""

    def __init__(self, record: Array, states: int, algebraic: int, of: Catalogue) -> None:
        self.unknowns, self.states, self._of = states + algebraic, states, of
        self.rows, self._record = bytearray(), record
        self.held: list[Array] = []
        self.instants: list[Instant] = []

    @property
    def steps(self) -> int:
        """The number of steps so far."""
        return len(self.rows) // self._record.nbytes

    def enter(self, held: Array) -> None:
        """Keep the held values that apply from the next step on."""
        self._record[0] = len(self.held)
        self.held.append(held)

    def extend(self, rows: Array, held: Array) -> None:
        """Keep steps, whose first column is the place of their held values among ``held``; -1 for the values before these."""
        rows[:, 0] += len(self.held)
        self.rows += view(rows)
        self.held += [*held]
        self._record[0] = len(self.held) - 1

    def trajectory(
        self, end: float, final: Array, m: Array, statistics: dict[str, float], notes: tuple[str, ...]
    ) -> Trajectory:
        """Everything recorded so far."""
        table = np.frombuffer(self.rows).reshape(-1, self._record.size)
        return Trajectory(
            times=table[:, 1].copy(),
            sizes=table[:, 2].copy(),
            dense=table[:, 3 : 3 + 5 * self.unknowns].reshape(len(table), 5, self.unknowns),
            held=np.array(self.held) if self.held else np.zeros((0, 0)),
            mode_of_step=table[:, 0].astype(np.int64),
            end=end,
            final=final[: self.unknowns].copy(),
            final_held=m.copy(),
            states=self.states,
            instants=tuple(self.instants),
            laws=self._of.kinds,
            rests=self._of.rests,
            statistics=statistics,
            notes=notes,
        )
