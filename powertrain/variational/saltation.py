"""How derivatives pass an event: saltation, resets, impacts.

An event happens where an indicator h(t, s, q) falls through zero, or at a known instant T(s, q). With rates f- before and f+ after,
and s+ = R(t, s-, q),

    d(tau) = -(h_s S + h_q) / (dh/dt along f-)    or    T_s S + T_q,
    S+     = R_s S + R_q + (R_t + R_s f- - f+) d(tau).

M. A. Aizerman, F. R. Gantmacher: Determination of stability by linear approximation of a periodic solution of a system of differential
equations with discontinuous right-hand sides, Q. J. Mech. Appl. Math. 11 (1958) 385-398; R. I. Leine, H. Nijmeijer: Dynamics and
Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import Contact, Friction, Guard, Switch, When
from powertrain.errors import SimulationError
from powertrain.language.symbols import column
from powertrain.modes.indicators import Indicator, indicators
from powertrain.modes.tolerances import EPS
from powertrain.numerics.buffers import Array
from powertrain.signals import Samples, signals_of
from powertrain.variational.many import Many
from powertrain.variational.mapping import Mapping
from powertrain.variational.partials import Block, Partials, Slopes
from powertrain.variational.record import Record
from powertrain.variational.transitions import VariationalRates

Law = Friction | Switch | Contact | When
_SAME_TIME = 1e-9
_AT_ZERO = 5e-11
"""Indicators below this fell through zero: they are located to a few 1e-11."""
_TRIGGER = 1e-6
_GRAZING = 1e-3
"""An indicator that reaches zero with less than this share of its mean slope over the step before only touches it."""
_SHALLOW = 100 * EPS
"""An indicator that would rise again this soon below zero switches by the hysteresis of the events alone."""
_EQUAL = 1e-7
_ROUNDING = 1e-15


@dataclass(frozen=True)
class Shift:
    """How the instant of an event moves: d(tau) = s S + q, by the law ``name``; ``index`` is the place of its mode."""

    name: str
    index: int
    s: Array
    q: Array


@dataclass(frozen=True)
class SaltationMap:
    """S+ = s S + left Q- + right Q+ at one event, Q the derivatives of q in the segments before and after.

    ``shifts``: how its instant moves, by all laws that cause it. Where there are several and ``together``, they must agree.
    """

    time: float
    s: Block
    left: Block
    right: Block
    shifts: tuple[Shift, ...]
    together: bool


class NotDifferentiable(SimulationError):
    """A run has no derivative at an event."""


class Saltation:
    """The jumps of derivatives at the events of a model's runs. Serves one thread."""

    def __init__(self, compiled: Compiled, flow: VariationalRates) -> None:
        system = flow.system
        dae = system.dae
        self.compiled, self.flow, self.system = compiled, flow, system
        self.indicators: tuple[Indicator, ...] = indicators(dae)
        laws: list[Switch | When] = [*dae.switches, *dae.whens]
        self.timed = [law for law in laws if law.time is not None]
        self.sticking = [law for law in dae.frictions if not law.algebraic and not law.prescribed]
        times = [law.time for law in self.timed if law.time is not None]
        asked = column([*(i.value for i in self.indicators), *times])
        self.before, self.values = Partials(system, asked), Many(system.inputs, asked)
        self.speeds = Partials(system, column([law.w for law in self.sticking]))
        self.mapping = Mapping(system) if dae.whens or dae.contacts else None

    def jumps(self, run: Record) -> list[SaltationMap]:
        """One jump for each event of a run. NotDifferentiable names the event that has none."""
        events = run.instants
        if not len(events.times):
            return []
        f_left, f_right = (self.flow.rates(samples, run.p) for samples in (events.left, events.right))
        slopes = self.before(events.left, run.p)
        early = self.before(events.early, run.p)
        falls = slopes.along(f_left[:, : self.system.size])
        before = early.along(self.flow.rates(events.early, run.p)[:, : self.system.size])
        bends = (falls >= 0.0) & (before < 0.0)
        falls, slopes = np.where(bends, before, falls), chosen(bends, early, slopes)
        seen, earlier = (self.values(samples, run.p) for samples in (events.seen, events.before))
        return [
            self._jump(run, k, f_left[k], f_right[k], replace(_one(slopes, k), value=seen[k]), falls[k], earlier[k])
            for k in range(len(events.times))
        ]

    def _jump(
        self, run: Record, k: int, f_left: Array, f_right: Array, slopes: Slopes, falls: Array, earlier: Array
    ) -> SaltationMap:
        n, t = self.system.size, float(run.instants.times[k])
        shifts = self._shifts(run, k, slopes, falls, earlier)
        s, q, rate = np.eye(self.flow.size), np.zeros((self.flow.size, slopes.q.shape[1])), np.zeros(self.flow.size)
        if self.mapping is not None:
            carried = self.mapping.map(run, k, {shift.index for shift in shifts})
            if carried is None:
                raise NotDifferentiable(
                    f"at t = {t:.9g} s resets or impacts follow one another at the same instant "
                    f"({self._names(run, k)}); the derivative of the run cannot be computed there"
                )
            s[:n, :n], q[:n], rate[:n] = carried
        change = s @ f_left + rate - f_right
        alone = self._alone(run, k, shifts, f_left, change) if len(shifts) > 1 else None
        for shift, part in (
            [(shifts[0], change)] if shifts and alone is None else list(zip(shifts, alone or [], strict=True))
        ):
            s[:, :n] += np.outer(part, shift.s)
            q = q + np.outer(part, shift.q)
        left, right = run.instants.left.m[k], run.instants.right.m[k]
        causes = {shift.index for shift in shifts}
        fresh = [
            i for i, law in enumerate(self.sticking)
            if right[law.index] == 0.0 and left[law.index] != 0.0 and law.index not in causes
        ]  # fmt: skip
        caught, at_q = self.caught(run.p, row_of(run.instants.right, k), fresh)
        return SaltationMap(t, caught @ s, caught @ q, at_q, tuple(shifts), alone is None and len(shifts) > 1)

    def _shifts(self, run: Record, k: int, slopes: Slopes, falls: Array, earlier: Array) -> list[Shift]:
        """The laws whose instant or indicator this event is."""
        t, left, right = float(run.instants.times[k]), run.instants.left.m[k], run.instants.right.m[k]
        near, count, nq = _SAME_TIME * max(1.0, abs(t)), len(self.indicators), slopes.q.shape[1]
        found = [
            Shift(law.name, law.index, slopes.s[count + j], slopes.q[count + j])
            for j, law in enumerate(self.timed)
            if abs(slopes.value[count + j] - t) <= near
            and (isinstance(law, When) or left[law.index] != right[law.index])
        ]
        for schedule in self.system.dae.schedules:
            here = slice(schedule.index, schedule.index + 3)
            if (left[here] != right[here]).any():
                found.append(
                    Shift(schedule.name, schedule.index, np.zeros(self.system.size), self._knot(schedule.index, nq))
                )
        hit = {name for name, _ in run.instants.extra[k]}
        laws: list[Law | None] = [None if isinstance(i.law, Guard) else i.law for i in self.indicators]
        changed = [
            j for j, law in enumerate(laws)
            if law is not None and (left[law.index] != right[law.index] or law.name in hit)
        ]  # fmt: skip
        value, possible = slopes.value, changed or [j for j, law in enumerate(laws) if law is not None]
        at_zero = [j for j in range(count) if laws[j] is not None and value[j] <= _AT_ZERO and falls[j] < 0.0]
        jumping = [j for j in at_zero if not getattr(laws[j], "continuous", False)]
        at_zero = next((g for g in ([j for j in jumping if j in changed], jumping, at_zero) if g), [])
        at_zero = self._first(at_zero, value, falls, t)
        if not at_zero and not found:
            at_zero = sorted(possible, key=lambda j: float(value[j]))[:1]
            if not at_zero or value[at_zero[0]] > _TRIGGER:
                raise NotDifferentiable(
                    f"at t = {t:.9g} s the cause of the event cannot be determined: {self._names(run, k)}"
                )
        for j in at_zero:
            law = laws[j]
            if law is None or any(law.index == shift.index for shift in found):
                continue
            if not self._sticks(law, left, right) or not falls[j] < 0.0:
                h = t - float(run.instants.before.t[k])
                self._refuse_grazing(law, t, float(falls[j]), float(earlier[j] - value[j]), h)
            found.append(Shift(law.name, law.index, -slopes.s[j] / falls[j], -slopes.q[j] / falls[j]))
        return found

    def _knot(self, index: int, nq: int) -> Array:
        """How the instant depends on q if it is a knot of an input: as the end of its segment."""
        found, first = np.zeros(nq), len(self.system.parameters) + len(self.system.segments)
        if index in self.system.segments:
            found[first + self.system.segments.index(index) // 3] = 1.0
        return found

    def _sticks(self, law: Law, left: Array, right: Array) -> bool:
        """Whether a sliding law comes to rest: then the jump of the rates is in proportion to the slope, however flat that is."""
        return any(law is s for s in self.sticking) and left[law.index] != 0.0 and right[law.index] == 0.0

    def _first(self, laws: list[int], value: Array, falls: Array, t: float) -> list[int]:
        """Those that fell through zero first, within the hysteresis; others below zero follow from what these change."""
        since = {j: float(value[j] / falls[j]) for j in laws}
        first = max(laws, key=lambda j: since[j], default=-1)
        noise = {j: -2.0 * EPS / float(falls[j]) for j in laws}
        return [j for j in laws if since[first] - since[j] <= noise[first] + noise[j] + _ROUNDING * t]

    def _refuse_grazing(self, law: Law, t: float, slope: float, fallen: float, h: float) -> None:
        """An indicator that arrives at zero flat moves its instant without bound.

        Over the step before, it is taken as a parabola: ``depth`` is how far below zero that would reach.
        """
        straight = -slope * h
        bent = fallen - straight
        depth = straight**2 / (4.0 * bent) if bent > EPS else np.inf
        if slope < 0.0 and straight > _GRAZING * fallen and depth > _SHALLOW:
            return
        raise NotDifferentiable(
            f"{law.name} ({law.where}) only just switches at t = {t:.9g} s: its indicator reaches zero with a slope of {slope:.3g} 1/s "
            f"after a fall of {fallen:.3g} in {h:.3g} s. A small change of a parameter may remove this event, so the run has no "
            "derivative there; choose parameters for which the law switches clearly or not at all"
        )

    def _alone(self, run: Record, k: int, shifts: Sequence[Shift], f_left: Array, change: Array) -> list[Array] | None:
        """What each of several laws that switch at one instant changes by itself; None where they act on each other."""
        rows = np.array([np.append(shift.s, shift.q) for shift in shifts])
        if (np.ptp(rows, axis=0) <= _EQUAL * np.abs(rows).max(axis=0) + 1e-9 * np.abs(rows).max()).all():
            return [change, *[np.zeros_like(change) for _ in shifts[1:]]]
        left, right = run.instants.left, run.instants.right
        if (left.x[k] != right.x[k]).any():
            return None
        m = np.repeat(left.m[k : k + 1], len(shifts), axis=0)
        for row, shift in zip(m, shifts, strict=True):
            width = 3 if any(shift.index == s.index for s in self.system.dae.schedules) else 1
            row[shift.index : shift.index + width] = right.m[k, shift.index : shift.index + width]
        each = Samples(
            left.t[k].repeat(len(m)), left.x[k][None].repeat(len(m), 0), left.z[k][None].repeat(len(m), 0), m
        )
        parts = f_left - self.flow.rates(self.corrected(each, run.p), run.p)
        scale = np.abs(parts).max(initial=0.0) + np.abs(change).max(initial=0.0)
        return list(parts) if (np.abs(parts.sum(axis=0) - change) <= _EQUAL * scale).all() else None

    def caught(self, p: Array, sample: Samples, laws: Sequence[int]) -> tuple[Block, Block]:
        """Laws that hold from an instant on at which their speed is zero: another speed there would be taken away at once.

        S+ = (I - B (W B)^-1 W) S - B (W B)^-1 W_q, with W the derivatives of the speeds and B what the laws' torques do to the rates.
        """
        size, n, nq = self.flow.size, self.system.size, self.system.free.numel()
        onto, at_q = np.eye(size), np.zeros((size, nq))
        if not laws:
            return onto, at_q
        slopes = self.speeds(sample, p)
        held = self.flow.rates(sample, p)[0]
        for i in laws:
            law, row = self.sticking[i], np.append(slopes.s[0, i], np.zeros(size - n))
            effects = []
            for mode in (1.0, -1.0):
                m = sample.m.copy()
                m[0, law.index] = mode
                b = self.flow.rates(self.corrected(sample._replace(m=m), p), p)[0] - held
                if np.isfinite(b).all() and abs(row @ b) > 1e-12 * (1.0 + np.abs(b).max()):
                    effects.append(b / (row @ b))
            if not effects:
                continue
            onto -= np.outer(effects[0], row)
            at_q -= np.outer(effects[0], slopes.q[0, i])
        return onto, at_q

    def corrected(self, samples: Samples, p: Array) -> Samples:
        """Samples whose algebraic unknowns solve the equations in their modes."""
        return signals_of(self.compiled).corrected(samples, p) if samples.z.shape[1] else samples

    def _names(self, run: Record, k: int) -> str:
        left, right = run.instants.left.m[k], run.instants.right.m[k]
        dae = self.system.dae
        laws: list[Law] = [*dae.frictions, *dae.switches, *dae.contacts, *dae.whens]
        names = [law.name for law in laws if left[law.index] != right[law.index]]
        return ", ".join(dict.fromkeys([*names, *(name for name, _ in run.instants.extra[k])])) or "without a law"


def chosen(where: NDArray[np.bool_], yes: Slopes, no: Slopes) -> Slopes:
    """Derivatives of the first where it says so, one decision for every expression and sample."""
    wide = where[:, :, None]
    return Slopes(
        no.value, np.where(where, yes.t, no.t), np.where(wide, yes.s, no.s), np.where(wide, yes.q, no.q), no.weights
    )


def row_of(samples: Samples, k: int) -> Samples:
    """One of several samples."""
    return Samples(*(v[k : k + 1] for v in samples))


def _one(slopes: Slopes, k: int) -> Slopes:
    """The derivatives at one of several samples."""
    return Slopes(slopes.value[k], slopes.t[k], slopes.s[k], slopes.q[k], slopes.weights[k])
