"""Derivatives across an event: saltation, resets, impacts.

An event happens where an indicator h(t, s, q) falls through zero, or at a known instant T(s, q). With rates f- before and f+ after,
and s+ = R(t, s-, q),

    d(tau) = -(h_s S + h_q) / (dh/dt along f-)    or    T_s S + T_q,
    S+     = R_s S + R_q + (R_t + R_s f- - f+) d(tau).

Where f- = f+, as at the end of a play, S+ = S, and the run may also touch the surface on which h is zero without crossing it. Where the
rates jump, it has to cross.

M. A. Aizerman, F. R. Gantmacher: Determination of stability by linear approximation of a periodic solution of a system of differential
equations with discontinuous right-hand sides, Q. J. Mech. Appl. Math. 11 (1958) 385-398; R. I. Leine, H. Nijmeijer: Dynamics and
Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from powertrain.dae.friction import BACKWARD, FORWARD, STUCK
from powertrain.dae.hybrid import Switch, When
from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column
from powertrain.modes.indicators import Indicator, indicators
from powertrain.numerics.many import Many
from powertrain.signals import signals_of
from powertrain.variational.instants import EventLaws, NotDifferentiable, Shift, duration, negligible
from powertrain.variational.mapping import Mapping, Round, Step, differ
from powertrain.variational.partials import Block, Partials, Slopes
from powertrain.variational.record import Record, shifted
from powertrain.variational.simultaneous import Leg, Order, Parts, over_orders
from powertrain.variational.transitions import VariationalRates

_EQUAL = 1e-7
_LATE = 0.01
"""Largest relative change of an indicator's slope on the way from its surface to a grazing event: about the error of the derivative."""


@dataclass(frozen=True)
class SaltationMap:
    """S+ = s S + left Q- + right Q+ at one event, Q the derivatives of q in the segments before and after.

    ``shifts``: the motion of its instant, for all laws that cause it; ``moved``: those whose motion changes anything. ``apart``: for laws
    that act on each other, the deviation of S+ in one order from this mean over all orders, by S and by Q-. ``across``: R_s, R_q and R_t of
    the resets and impacts, computed in ``rounds``; ``caught``: the laws that stick from here on at a speed that is already zero.
    """

    time: float
    s: Block
    left: Block
    right: Block
    shifts: tuple[Shift, ...]
    moved: tuple[Shift, ...]
    apart: tuple[Block, Block] | None
    across: tuple[Block, Block, Array]
    rounds: Sequence[Round]
    caught: Sequence[int]


class Saltation:
    """The jumps of derivatives at the events of a model's runs. Serves one thread."""

    def __init__(self, flow: VariationalRates) -> None:
        self.flow, self.system = flow, flow.system
        system, dae = flow.system, flow.system.dae
        self.indicators: tuple[Indicator, ...] = indicators(dae)
        laws: list[Switch | When] = [*dae.switches, *dae.relations, *dae.whens]
        self.timed = [law for law in laws if law.time is not None]
        self.sticking = [law for law in dae.frictions if not law.algebraic and not law.prescribed]
        times = [law.time for law in self.timed if law.time is not None]
        self.asked = column([*(i.value for i in self.indicators), *times])
        self.before, self.values = Partials(system, self.asked), Many(system.dae.arguments, self.asked)
        self.known = Many(system.dae.arguments, column([Symbol(i.known) for i in self.indicators]))
        self.instants = EventLaws(system, self.indicators, self.timed, self.sticking)
        self.speeds = Partials(system, column([law.w for law in self.sticking]))
        self.mapping = Mapping(system) if dae.whens or dae.barriers or dae.relative else None

    def jumps(self, run: Record) -> list[SaltationMap]:
        """One jump for each event of a run. NotDifferentiable names an event that has none."""
        events = run.instants
        if not len(events.times):
            return []
        left = self.corrected(shifted(events.left, -1), run.p)
        f_left, f_right = (self.flow.rates(samples, run.p) for samples in (left, events.right))
        slopes = self.before(events.left, run.p)
        falls = slopes.along(f_left[:, : self.system.size])
        seen, earlier = (self.values(samples, run.p) for samples in (events.seen, events.before))
        return [
            self._jump(run, k, f_left[k], f_right[k], replace(_one(slopes, k), value=seen[k]), falls[k], earlier[k])
            for k in range(len(events.times))
        ]

    def _unknown_jump(self, run: Record, k: int) -> str:
        """Why there is no derivative where the states jump by other rules than those of one round of resets and impacts."""
        left, right, compiled = run.instants.left, run.instants.right, self.system.compiled
        jumped = [n for n, j in zip(compiled.states, differ(left.x[k], right.x[k]), strict=True) if j]
        jumped += [n for n, place in compiled.discretes.items() if differ(left.m[k, place], right.m[k, place])]

        def value(held: Array, first: int) -> float:
            begin, y, slope = held[first : first + 3]
            return float(y + slope * (run.instants.times[k] - begin))

        schedules = self.system.dae.schedules
        signals = [s.name for s in schedules if differ(value(left.m[k], s.index), value(right.m[k], s.index))]
        cause = (
            f"{', '.join(signals)} moves a source under a clutch or contact with a jump"
            if signals
            else f"resets or impacts follow one another at the same instant, or a source jumps ({self.instants.names(run, k)})"
        )
        return (
            f"at t = {run.instants.times[k]:.9g} s {', '.join(jumped)} jump{'s' if len(jumped) == 1 else ''}, because {cause}; the "
            "derivative of the run cannot be computed there"
        )

    def _jump(
        self, run: Record, k: int, f_left: Array, f_right: Array, slopes: Slopes, falls: Array, earlier: Array
    ) -> SaltationMap:
        n, t = self.system.size, float(run.instants.times[k])
        shifts = self.instants.shifts(run, k, slopes, falls, earlier)
        s, q, rate = np.eye(self.flow.size), np.zeros((self.flow.size, slopes.q.shape[1])), np.zeros(self.flow.size)
        rounds: Sequence[Round] = ()
        if self.mapping is not None:
            carried = self.mapping.map(run, k, {shift.index for shift in shifts})
            if carried is None:
                raise NotDifferentiable(self._unknown_jump(run, k))
            s[:n, :n], q[:n], rate[:n] = carried.s, carried.q, carried.t
            rounds = carried.rounds
        across = s.copy(), q, rate
        change = s @ f_left + rate - f_right
        moved = self._moved(run, k, shifts, change, f_left, None if rounds else slopes)
        if not moved and shifts and not negligible(change, f_left, duration(run, k, shifts[0].index)):
            # the laws that jump change nothing; what does is a kink that the run passes at the same instant
            others = self.instants.shifts(run, k, slopes, falls, earlier, {shift.index for shift in shifts})
            moved = self._moved(run, k, others, change, f_left, None if rounds else slopes)
            if not moved and shifts[0].flat is not None:
                raise shifts[0].flat
        mean, farthest = self._parts(run, k, moved, f_left, f_right, change)
        on_s = np.array([shift.s for shift in moved]).reshape(len(moved), n)
        on_q = np.array([shift.q for shift in moved]).reshape(len(moved), q.shape[1])
        s[:, :n] += mean.T @ on_s
        q = q + mean.T @ on_q
        left, sample = run.instants.left.m[k], row_of(run.instants.right, k)
        laws, causes = self.sticking, {shift.index for shift in shifts}
        fresh = [i for i in self.stuck(sample) if left[laws[i].index] != STUCK and laws[i].index not in causes]
        caught, at_q = self.caught(run.p, sample, fresh)
        apart = None if farthest is None else (caught @ farthest.T @ on_s, caught @ farthest.T @ on_q)
        return SaltationMap(
            t, caught @ s, caught @ q, at_q, tuple(shifts), tuple(moved), apart, across, rounds, tuple(fresh)
        )

    def _moved(
        self, run: Record, k: int, shifts: Sequence[Shift], change: Array, rates: Array, slopes: Slopes | None
    ) -> list[Shift]:
        """The laws whose motion of the instant changes something."""
        return [replace(each, flat=None) for each in shifts if self._counts(run, k, each, change, rates, slopes)]

    def _counts(self, run: Record, k: int, shift: Shift, change: Array, rates: Array, slopes: Slopes | None) -> bool:
        """Whether the motion of an instant changes anything. That of an indicator that grazes zero is refused where anything jumps.

        ``slopes``: of the indicators, where the states do not jump. A grazing law may change as little as its hysteresis: then it does not
        count. If it changes nothing at the surface on which it switches, it counts as others, as long as the hysteresis, which puts its
        event beyond the surface, does not matter.
        """
        if shift.flat is None:
            return True
        lasting = duration(run, k, shift.index)
        if slopes is None:
            if negligible(change, rates, lasting):
                return False
            raise shift.flat
        row, left = slopes.s[shift.row, : self.system.states], row_of(run.instants.left, k)
        beyond = self.known(left, run.p)[0, shift.row] - slopes.value[shift.row]
        moved = left._replace(x=left.x + beyond * row / ((row @ row) or 1.0))
        here, surface = (self._change(run, k, shift, each) for each in (left, moved))
        if negligible(here, rates, lasting):
            return False
        if not negligible(surface, rates, lasting) or self._late(run, left, shift, here, beyond) > _LATE:
            raise shift.flat
        return True

    def _late(self, run: Record, left: Samples, shift: Shift, change: Array, beyond: float) -> float:
        """How much the slope of an indicator changes, relative to it, between its surface and an event ``beyond`` it.

        The motion itself changes the slope before the event; the law would have changed it as well, had it switched at the surface.
        """
        n, rates = self.system.size, self.flow.rates(self.corrected(left, run.p), run.p)[0]
        fall = self.before(left, run.p).along(rates[None, :n])[0, shift.row]
        steps = np.array([np.zeros(n), rates[:n], change[:n]]) * (beyond / abs(fall))
        there = Samples(*(v.repeat(3, 0) for v in left))._replace(x=left.x + steps[:, : self.system.states])
        there_rates = self.flow.rates(self.corrected(there, run.p), run.p)
        falls = self.before(there, run.p).along(there_rates[:, :n])[:, shift.row]
        return float(np.abs(falls - fall).sum() / abs(fall))

    def _change(self, run: Record, k: int, shift: Shift, at: Samples) -> Array:
        """The change of the rates at a sample by a law and those that switch with it, except for others whose branches meet."""
        before, after = at.m.copy(), run.instants.right.m[k : k + 1]
        meeting = [index for index in self.instants.kinks if index != shift.index]
        before[:, meeting] = after[:, meeting]
        sides = (self.corrected(at._replace(m=m), run.p) for m in (before, after))
        f_before, f_after = (self.flow.rates(side, run.p)[0] for side in sides)
        return np.asarray(f_before - f_after)

    def _parts(
        self, run: Record, k: int, shifts: Sequence[Shift], f_left: Array, f_right: Array, change: Array
    ) -> tuple[Parts, Parts | None]:
        """The effect of the motion of each law's instant; for laws that act on each other also the order farthest from the mean."""
        if not shifts:
            return np.zeros((0, len(change))), None
        rows = np.array([np.append(shift.s, shift.q) for shift in shifts])
        if (np.ptp(rows, axis=0) <= _EQUAL * np.abs(rows).max(axis=0) + 1e-9 * np.abs(rows).max(initial=0.0)).all():
            return np.array([change, *(np.zeros_like(change) for _ in shifts[1:])]), None
        legs = partial(self._legs, run, k, shifts, f_right)
        mean, apart = over_orders([shift.s for shift in shifts], f_left, change, legs)
        scale = np.abs(mean).max(initial=0.0) + np.abs(change).max(initial=0.0)
        return mean, apart if np.abs(apart).max(initial=0.0) > _EQUAL * scale else None

    def _legs(
        self, run: Record, k: int, shifts: Sequence[Shift], f_right: Array, orders: Sequence[Order]
    ) -> list[list[Leg]]:
        """The laws switched one after the other in some orders; nothing if one leads to another state than the run."""
        left, right, n, size = run.instants.left, run.instants.right, self.system.size, self.flow.size
        steps, discretes = list[Step](), self.system.discretes
        begun = left.x[k] if self.mapping is None else self.mapping.settled(run, k)
        for order in orders:
            x, m, fired = begun, left.m[k].copy(), set[int]()
            for shift in (shifts[i] for i in order):
                fired.add(shift.index)
                one = self.mapping.step(run, k, x, m, fired, shift.index) if self.mapping is not None else None
                steps.append(one or Step(x, m.copy(), np.eye(n), np.zeros(n), np.arange(0)))
                x, m = steps[-1].x, steps[-1].m
                width = 3 if any(shift.index == s.index for s in self.system.dae.schedules) else 1
                here = slice(shift.index, shift.index + width)
                m[here] = right.m[k, here]
            reached, found = (np.append(a, b[discretes]) for a, b in ((x, m), (right.x[k], right.m[k])))
            if differ(reached, found).any():
                return []
        t, z = (v[k : k + 1].repeat(len(steps), 0) for v in (left.t, left.z))
        samples = Samples(t, np.array([each.x for each in steps]), z, np.array([each.m for each in steps]))
        rates = self.flow.rates(self.corrected(samples, run.p), run.p)
        rates[len(shifts) - 1 :: len(shifts)] = f_right
        legs = []
        for each, f in zip(steps, rates, strict=True):
            s, t = np.eye(size), np.zeros(size)
            s[:n, :n], t[:n] = each.s, each.t
            legs.append(Leg(f, s, t, each.changed))
        return [legs[i : i + len(shifts)] for i in range(0, len(legs), len(shifts))]

    def stuck(self, sample: Samples) -> list[int]:
        """The laws that stick at a sample."""
        return [i for i, law in enumerate(self.sticking) if sample.m[0, law.index] == STUCK]

    def caught(self, p: Array, sample: Samples, laws: Sequence[int]) -> tuple[Block, Block]:
        """Laws that stick from an instant at which their speed is zero: a perturbation of that speed would be removed at once.

        S+ = (I - B (W B)^-1 W) S - B (W B)^-1 W_q, with W the derivatives of the speeds and B the effect of the laws' torques on the rates.
        """
        onto, at_q = np.eye(self.flow.size), np.zeros((self.flow.size, self.system.free.numel()))
        for _, effect, row, q in self.catches(p, sample, laws):
            onto -= np.outer(effect, row)
            at_q -= np.outer(effect, q)
        return onto, at_q

    def catches(self, p: Array, sample: Samples, laws: Sequence[int]) -> Iterator[tuple[int, Array, Array, Array]]:
        """B (W B)^-1, W and W_q for each of these laws."""
        if not laws:
            return
        size, n = self.flow.size, self.system.size
        slopes = self.speeds(sample, p)
        held = self.flow.rates(sample, p)[0]
        for i in laws:
            law, row = self.sticking[i], np.append(slopes.s[0, i], np.zeros(size - n))
            effects = []
            for mode in (FORWARD, BACKWARD):
                m = sample.m.copy()
                m[0, law.index] = mode
                b = self.flow.rates(self.corrected(sample._replace(m=m), p), p)[0] - held
                if np.isfinite(b).all() and abs(row @ b) > 1e-12 * (1.0 + np.abs(b).max()):
                    effects.append(b / (row @ b))
            if effects:
                yield i, effects[0], row, slopes.q[0, i]

    def corrected(self, samples: Samples, p: Array) -> Samples:
        """Samples whose algebraic unknowns solve the equations in their modes."""
        return signals_of(self.system.compiled).corrected(samples, p)


def row_of(samples: Samples, k: int) -> Samples:
    """One of several samples."""
    return Samples(*(v[k : k + 1] for v in samples))


def _one(slopes: Slopes, k: int) -> Slopes:
    """The derivatives at one of several samples."""
    return Slopes(slopes.value[k], slopes.t[k], slopes.s[k], slopes.q[k], slopes.weights[k])
