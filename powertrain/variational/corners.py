"""Corners of the rates: places where their derivatives jump although they do not, as for |w| and the larger of two values.

First derivatives of a run pass a corner unchanged, but a step over it would integrate them no better than to the length of the step, so
steps end at corners. Second derivatives jump there, so a corner on the run is treated like an event.
``side`` is zero at a corner and determines its instant, as an indicator determines that of an event.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.operations import operation
from powertrain.dae.tolerances import INTEGRATED
from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.numerics.many import Many
from powertrain.numerics.tape import graph_of
from powertrain.result import Result
from powertrain.variational.partials import Partials, System
from powertrain.variational.record import POINTS, Record, edge, nearest, record, spans

_HALVINGS = 50
_EVENT = 2e-4
"""Corners within this share of a step of an event belong to the event: |w| where a clutch sticks."""
_SAME = 1e-10
_TOGETHER = 1000
"""Samples whose derivatives are in memory together: those of a drive cycle would take tens of gigabytes."""


@dataclass(frozen=True)
class Corner:
    """A corner on the run: the instant in s, and which of the sides are zero there."""

    time: float
    sides: tuple[int, ...]


class Corners:
    """The corners of expressions of one model. Serves one thread."""

    def __init__(self, system: System, expressions: Symbol) -> None:
        dae = system.dae
        moving = ca.vertcat(dae.t, dae.x, dae.z)
        self.found = column([side for side in _sides(expressions) if ca.depends_on(side, moving)])
        self._values = Many(system.dae.arguments, self.found)
        self.slopes = Partials(system, self.found)

    def cut(self, result: Result[Any], cuts: Array) -> tuple[Record, list[Corner]]:
        """The run with steps that also end at ``cuts`` and at the corners that it passes, and these corners."""
        corners = self.passed(result, record(result, cuts))
        return record(result, np.union1d(cuts, [corner.time for corner in corners])), corners

    def passed(self, result: Result[Any], run: Record) -> list[Corner]:
        """All corners that a run passes between its events, in order of time."""
        if not self.found.numel():
            return []
        steps, count = run.steps, len(run.steps.times)
        begins = self._known(edge(result, steps.times, before=False), run.p)
        inside = self._known(steps.samples, run.p).reshape(count, len(POINTS), -1)
        values = np.concatenate([begins[:, None], inside], axis=1).reshape(-1, begins.shape[1])
        shares = np.append(0.0, POINTS)
        at = (steps.times[:, None] + steps.durations[:, None] * shares).ravel()
        changes = [(j, *change) for j in range(values.shape[1]) for change in _changes(values[:, j])]
        side, last, first = np.array(changes, dtype=np.int64).reshape(-1, 3).T
        low, high = at[last], at[first]
        times = self._zeros(result, run.p, side, low, high, np.where(values[last, side] > 0.0, 1.0, -1.0))
        found: list[Corner] = []
        switching = self._at_events(result, run, times)
        for t, j, at_event in sorted(zip(times.tolist(), side.tolist(), switching.tolist(), strict=True)):
            if found and t - found[-1].time <= _SAME * (1.0 + abs(t)):
                found[-1] = Corner(found[-1].time, (*found[-1].sides, j))
            elif not at_event:
                found.append(Corner(t, (j,)))
        return found

    def _known(self, samples: Samples, p: Array) -> NDArray[np.float64]:
        """The sides divided by their uncertainties, which follow from those of the states."""
        found = np.empty((len(samples.t), self.found.numel()))
        for first in range(0, len(samples.t), _TOGETHER):
            part = slice(first, first + _TOGETHER)
            slopes = self.slopes(Samples(*(each[part] for each in samples)), p)
            found[part] = slopes.value / (INTEGRATED * np.maximum(np.abs(slopes.s).sum(axis=2), 1.0))
        return found

    def _zeros(
        self,
        result: Result[Any],
        p: Array,
        side: NDArray[np.int64],
        low: Array,
        high: Array,
        signs: Array,
    ) -> Array:
        """The last instants at which sides still have their ``signs``, by bisection: at zero an expression has either derivative."""
        rows = np.arange(len(side))
        for _ in range(_HALVINGS if len(side) else 0):
            middle = 0.5 * (low + high)
            early = self._values(edge(result, middle, before=True), p)[rows, side] * signs > 0.0
            low, high = np.where(early, middle, low), np.where(early, high, middle)
        return low

    def _at_events(self, result: Result[Any], run: Record, times: Array) -> NDArray[np.bool_]:
        """Which corners belong to a law that switches there, or to the start or end of the run."""
        near = _EVENT * np.maximum(*(spans(result.trajectory, times, before) for before in (True, False)))
        return nearest(np.array([run.start, run.end, *run.instants.times]), times) <= near


def _changes(values: Array) -> Iterator[tuple[int, int]]:
    """Samples before and after a change of sign; values below the accuracy of the integration, scaled to one, have no sign."""
    starts = np.append(0, np.flatnonzero((values[1:] > 0.0) != (values[:-1] > 0.0)) + 1)
    clear = np.flatnonzero(np.maximum.reduceat(np.abs(values), starts) > 1.0)
    ends = np.append(starts[1:], len(values)) - 1
    for one, other in pairwise(clear):
        if (other - one) % 2:
            yield int(ends[one]), int(starts[other])


def _sides(expressions: Symbol) -> list[Symbol]:
    """The expressions that are zero at the corners."""
    found: list[Symbol] = []
    for node, inner in graph_of(*scalars(expressions)).values():
        code = operation(node)
        if code in (ca.OP_FABS, ca.OP_SIGN):
            found.append(inner[0])
        elif code in (ca.OP_FMIN, ca.OP_FMAX, ca.OP_LT, ca.OP_LE):
            found.append(inner[1] - inner[0])
    return found
