"""How the instants of events depend on s and q, and which laws cause an event.

An event happens where an indicator h(t, s, q) falls through zero, or at a known instant T(s, q):

    d(tau) = -(h_s S + h_q) / (dh/dt along f-)    or    T_s S + T_q
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from powertrain.dae.friction import STUCK
from powertrain.dae.hybrid import Friction, Guard, Law, Switch, When
from powertrain.dae.tolerances import EPS
from powertrain.errors import SimulationError
from powertrain.language.reals import Array
from powertrain.modes.indicators import Indicator
from powertrain.variational.partials import Slopes, System
from powertrain.variational.record import Record

_SAME_TIME = 1e-9
_AT_ZERO = 5e-11
"""Indicators below this have fallen through zero; they are located to a few 1e-11."""
_TRIGGER = 1e-6
_GRAZING = 1e-3
"""An indicator grazes zero if it arrives with less than this share of its mean slope over the step before."""
_SHALLOW = 100 * EPS
"""An indicator that would rise again this close below zero switches only because of the hysteresis of events."""
_ROUNDING = 1e-15
_NOTHING = 1000 * EPS
"""Changes of rates due to the hysteresis of events, and changes of speeds due to events that are soon undone."""


class NotDifferentiable(SimulationError):
    """A run has no derivative at an event."""


@dataclass(frozen=True)
class Shift:
    """The motion of an event's instant, d(tau) = s S + q, due to the law ``name``; ``index`` is the index of its mode.

    ``row``: its indicator or instant among the possible causes of events; negative for knots of inputs.
    """

    name: str
    index: int
    s: Array
    q: Array
    row: int = -1
    flat: NotDifferentiable | None = None
    """The reason why there is no derivative, if the event changes anything."""


class EventLaws:
    """The possible causes of events in one model's runs."""

    def __init__(
        self,
        system: System,
        indicators: Sequence[Indicator],
        timed: Sequence[Switch | When],
        sticking: Sequence[Friction],
    ) -> None:
        self.system, self.timed, self.sticking, self._count = system, timed, sticking, len(indicators)
        self._laws = {j: i.law for j, i in enumerate(indicators) if not isinstance(i.law, Guard)}
        self.kinks = {s.index for s in system.dae.switches if s.continuous}

    def shifts(
        self, run: Record, k: int, slopes: Slopes, falls: Array, earlier: Array, without: Collection[int] = ()
    ) -> list[Shift]:
        """The laws whose indicator or instant causes this event, ``without`` those of these indices, which change nothing."""
        t, left, right = float(run.instants.times[k]), run.instants.left.m[k], run.instants.right.m[k]
        found = [*self._timed(t, slopes, left, right), *self._scheduled(slopes, left, right)]
        for j in self._causes(run, k, slopes, falls, without, known=bool(found or without)):
            law = self._laws[j]
            if any(law.index == shift.index for shift in found):
                continue
            flat = None
            if not (self._sticks(law, left, right) and falls[j] < 0.0):
                h = t - float(run.instants.before.t[k])
                flat = grazing(law, t, float(falls[j]), float(earlier[j] - slopes.value[j]), h)
            slope = float(falls[j]) or -1.0
            found.append(Shift(law.name, law.index, -slopes.s[j] / slope, -slopes.q[j] / slope, j, flat))
        return found

    def _timed(self, t: float, slopes: Slopes, left: Array, right: Array) -> list[Shift]:
        """Laws that change at known instants. A reset may have restarted the time on which its own law depends; that law is as before."""
        near, whens, relations = _SAME_TIME * max(1.0, abs(t)), self.system.dae.whens, self.system.dae.relations
        reset = {w.index for w in whens} | {r.index for r in relations}
        return [
            Shift(law.name, law.index, slopes.s[i], slopes.q[i], i)
            for i, law in enumerate(self.timed, self._count)
            if abs(slopes.value[i] - t) <= near and (law.index in reset or left[law.index] != right[law.index])
        ]

    def _scheduled(self, slopes: Slopes, left: Array, right: Array) -> list[Shift]:
        """Schedules and inputs whose segment changes."""
        still, nq = np.zeros(self.system.size), slopes.q.shape[1]
        return [
            Shift(schedule.name, schedule.index, still, self._knot(schedule.index, nq))
            for schedule in self.system.dae.schedules
            if (left[schedule.index : schedule.index + 3] != right[schedule.index : schedule.index + 3]).any()
        ]

    def _causes(
        self, run: Record, k: int, slopes: Slopes, falls: Array, without: Collection[int], *, known: bool
    ) -> list[int]:
        """The indicators that fell through zero first, those of laws that jump and change before others; at least one unless ``known``."""
        left, right = run.instants.left.m[k], run.instants.right.m[k]
        hit = {name for name, _ in run.instants.extra[k]}
        changed = [j for j, law in self._laws.items() if left[law.index] != right[law.index] or law.name in hit]
        fallen = [j for j in self._laws if slopes.value[j] <= _AT_ZERO and falls[j] < 0.0]
        fallen = [j for j in fallen if self._laws[j].index not in without]
        jumping = [j for j in fallen if self._laws[j].index not in self.kinks]
        t = float(run.instants.times[k])
        causes = self._first([j for j in jumping if j in changed] or jumping or fallen, slopes.value, falls, t)
        if causes or known:
            return causes
        nearest = min(changed or self._laws, key=lambda j: float(slopes.value[j]), default=None)
        if nearest is None or slopes.value[nearest] > _TRIGGER:
            raise NotDifferentiable(
                f"at t = {t:.9g} s the cause of the event cannot be determined: {self.names(run, k)}"
            )
        return [nearest]

    def _knot(self, index: int, nq: int) -> Array:
        """The dependence of the instant on q if it is a knot of an input: the end of its segment."""
        found, first = np.zeros(nq), len(self.system.parameters) + len(self.system.segments)
        if index in self.system.segments:
            found[first + self.system.segments.index(index) // 3] = 1.0
        return found

    def _sticks(self, law: Law | When, left: Array, right: Array) -> bool:
        """Whether a sliding law comes to rest: then the jump of the rates is proportional to the slope, however small."""
        return any(law is s for s in self.sticking) and left[law.index] != STUCK and right[law.index] == STUCK

    def _first(self, laws: list[int], value: Array, falls: Array, t: float) -> list[int]:
        """The laws that fell through zero first, within the hysteresis; others below zero follow from what these change."""
        since = {j: float(value[j] / falls[j]) for j in laws}
        first = max(laws, key=lambda j: since[j], default=-1)
        noise = {j: -2.0 * EPS / float(falls[j]) for j in laws}
        return [j for j in laws if since[first] - since[j] <= noise[first] + noise[j] + _ROUNDING * t]

    def names(self, run: Record, k: int) -> str:
        """The laws that switch at event k."""
        left, right = run.instants.left.m[k], run.instants.right.m[k]
        dae = self.system.dae
        names = [law.name for law in (*dae.laws, *dae.whens) if left[law.index] != right[law.index]]
        return ", ".join(dict.fromkeys([*names, *(name for name, _ in run.instants.extra[k])])) or "without a law"


def grazing(law: Law | When, t: float, slope: float, fallen: float, h: float) -> NotDifferentiable | None:
    """An indicator that arrives at zero with zero slope moves its instant without bound.

    It is approximated by a parabola over the step before; ``depth`` is how far that would fall below zero.
    """
    if slope == 0.0 and fallen > _SHALLOW:
        return NotDifferentiable(
            f"{law.name} ({law.where}) switches at t = {t:.9g} s where its condition ends at zero, at the kink of a limited "
            "signal. The run has no derivative there; write the condition in terms of the signal before its limit"
        )
    straight = -slope * h
    bent = fallen - straight
    depth = straight**2 / (4.0 * bent) if bent > EPS else np.inf
    if slope < 0.0 and straight > _GRAZING * fallen and depth > _SHALLOW:
        return None
    return NotDifferentiable(
        f"{law.name} ({law.where}) only just switches at t = {t:.9g} s: its indicator reaches zero with a slope of {slope:.3g} 1/s "
        f"after a fall of {fallen:.3g} in {h:.3g} s. A small change of a parameter may remove this event, so the run has no "
        "derivative there; choose parameters for which the law switches clearly or not at all"
    )


def negligible(change: Array, rates: Array, lasting: float) -> bool:
    """Whether a change of the ``rates`` is nothing to a run.

    It lasts until the law changes again, for ``lasting`` seconds: that is what the run misses without the event.
    """
    return bool((np.abs(change) * min(lasting, 1.0) <= _NOTHING * (1.0 + np.abs(rates))).all())


def duration(run: Record, k: int, index: int) -> float:
    """How long a held value stays as event k leaves it [s]."""
    values, times = run.instants.right.m[k:, index], run.instants.times[k:]
    changed = np.flatnonzero(values != values[0])
    return float((times[changed[0]] if changed.size else run.end) - times[0])
