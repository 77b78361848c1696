"""The event loop: take steps until something happens, locate it, resolve the modes, continue."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence

import numpy as np

from powertrain.dae.hybrid import JUMPED, Guard
from powertrain.dae.tolerances import EPS, SHORTEST
from powertrain.engine.chatter import Chatter
from powertrain.engine.failure import not_finite, underflow
from powertrain.engine.in_c import ASK, EVENTS, FULL, GUARD, RATES, TOO_STIFF, UNDERFLOW, LoopInC, Position, Stretch
from powertrain.engine.location import MOST_IDLE
from powertrain.engine.prepared import Prepared
from powertrain.engine.schedules import just_after
from powertrain.engine.trajectory import COUNTED, Instant, Trajectory, TrajectoryRecorder
from powertrain.errors import SimulationError
from powertrain.integration.specialized import Calls
from powertrain.integration.step_control import FINEST, HALVINGS, STIFF, STIFF_STEPS, reduction
from powertrain.language.reals import Array
from powertrain.modes.algebra import NotConsistent
from powertrain.modes.guards import Point, first_violation, guard_message
from powertrain.numerics.buffers import view

Progress = Callable[[float, Array, Array], None]
"""Receives the time, the unknowns and the held values that a run has reached; these are the run's own arrays."""
_AGAIN = 1e-6
"""First step (s) tried with pivoting after all others have failed."""


class Run:
    """One simulation on the arrays of a simulator whose start is already resolved on side 0."""

    def __init__(
        self,
        engine: Prepared,
        start: float,
        stop: float,
        max_step: float,
        progress: Progress | None,
        in_c: Callable[[str], LoopInC | None],
    ) -> None:
        self._loop_in_c = in_c
        self.engine, self.memory, self.dae = engine, engine.memory, engine.dae
        self.t, self.start, self.stop, self.max_step = start, start, stop, max_step
        self.side, self.h, self.crossed, self.longest = 0, 0.0, start, max_step
        self.progress = progress
        self.watch = _throttled(self._tell) if progress is not None else None
        self.catalogue = engine.catalogue
        self.recorder = TrajectoryRecorder(engine.memory.record, *engine.sizes[:2], self.catalogue)
        self.chatter = Chatter(stop - start)
        self.outside = np.zeros(len(self.catalogue.counted))
        self.rejected, self.stiff, self.idle = 0, 0.0, 0
        self.refused: tuple[float, float] | None = None
        self.method = engine.first_method(stop - start)
        self.numeric = engine.large
        memory, counted = engine.memory, engine.memory.outside[: len(self.outside)]
        self.views = [view(a) for a in (memory.time, memory.info, memory.record, counted)]

    def execute(self, resumed: bool = False) -> Trajectory:
        """Run to the stop time; errors carry the trajectory so far. ``resumed``: continue smoothly from the end of another run."""
        self.steps, self.in_c = self.engine.stepper(self.method), self._loop_in_c(self.method)
        self._tell()
        try:
            self._restart()
            self.recorder.enter(self.memory.m.copy())
            if resumed:
                self.h = min(self.stop - self.start, self.max_step)
            else:
                self._check_guards()
            self._choose()
            while self.t < self.stop:
                self._next_stop()
                self._pass(self._smooth() if self.in_c is None else self._proceed(self.in_c))
            self._count()
        except NotConsistent as error:
            raise SimulationError(f"at t = {self.t:.9g} s {error}", self._trajectory()) from None
        except SimulationError as error:
            error.result = self._trajectory()
            raise
        self._tell()
        return self._trajectory()

    def _tell(self) -> None:
        """Report the progress."""
        if self.progress is not None:
            self.progress(self.t, self.memory.y[self.side], self.memory.m)

    def _trajectory(self) -> Trajectory:
        statistics = {
            "steps": float(self.recorder.steps),
            "rejected": float(self.rejected),
            "events": float(len(self.recorder.instants)),
        }
        for name, n in zip(self.catalogue.counted, self.outside.tolist(), strict=True):
            key = COUNTED + name
            statistics[key] = statistics.get(key, 0.0) + n
        final, notes = self.memory.y[self.side], tuple(self.engine.resolver.notes)
        return self.recorder.trajectory(self.t, final, self.memory.m, statistics, notes)

    def _next_stop(self) -> None:
        self.instant, self.corner = self.engine.next_instant(self.t), self.engine.schedules.following(self.t)
        self.target = min(self.instant, self.corner, self.stop)

    def _restart(self) -> None:
        """Slope and first step size after a discontinuity."""
        self.h = min(self._refresh(), self.max_step)

    def _refresh(self) -> float:
        """Set stuck speeds to zero, evaluate the slope at the present instant and return a first step size."""
        memory = self.memory
        memory.time[0] = self.t
        self.engine.fresh[self.side]()
        self.side = 1 - self.side
        found: list[float] = memory.start.tolist()
        h, total = found
        if not -np.inf < total < np.inf:
            self._refuse_rates()
        return h

    def _refuse_rates(self) -> None:
        raise SimulationError(not_finite(self.dae, self.memory, self.side, self.t))

    def _smooth(self) -> bool:
        """Step until an indicator falls below zero (True: it is located) or until ``self.target``."""
        time, info, record, outside = self.views
        steps, auto = self.chosen
        t, h, side, target, largest = self.t, min(self.h, self.longest), self.side, self.target, self.longest
        rows, rejected, counting, watch = self.recorder.rows, False, len(outside), self.watch
        self.refused = None
        wanted, halved, finest = 0.0, 0, FINEST * min(self.stop - self.start, largest)
        while True:
            last = t + 1.01 * h >= target
            if last:
                wanted, h = h, target - t
            time[0] = t
            time[1] = h
            steps[side]()
            error = info[0]
            if not error <= 1.0:
                rejected = True
                h, steps = self._smaller(error, t, h, side, steps)
                continue
            if info[1] and halved < HALVINGS and h > finest:
                halved += 1
                self.rejected += 1
                rejected, h = True, 0.5 * h
                continue
            rows += record
            if auto and (info[4] > STIFF or self.stiff > 0) and self._too_stiff(info[4]):
                steps, auto = self._implicit(), False
            if info[3] <= 0.0 and self._locate(t, h, side):
                return True
            factor, halved, side = info[2], 0, 1 - side
            if rejected:
                factor, rejected, self.refused = min(factor, 1.0), False, None
            t = target if last else t + h
            h = max(h * factor, wanted) if last else h * factor
            if h > largest:
                h = largest
            if counting and any(outside):
                self.outside += outside
            if watch is not None:
                self.t, self.side = t, side  # the run may end here
                watch()
            if last:
                self.t, self.h, self.side = t, h, side
                return False

    def _proceed(self, loop: LoopInC) -> bool:
        """Continue in C until the stop (False), or until an event that is not routine: whether it was located inside a step."""
        while True:
            at = Position(self.t, self.h, self.longest, self.side, self.crossed, self.idle, self.stiff)
            done = loop.proceed(at, self.start, self.stop, self.max_step, self.recorder.held[-1])
            self._take_over(done)
            if done.status != FULL:
                break
        if (status := done.status) == ASK:
            self.instant, self.corner = done.instant, done.corner
            return done.located
        self.instant = self.corner = np.inf
        if status == TOO_STIFF:
            self._implicit()
        elif status == UNDERFLOW:
            self._pivot()
        elif status == RATES:
            self._refuse_rates()
        elif status == GUARD:
            self._refuse_located()
        elif status == EVENTS:
            self._idle(True)
        return False

    def _take_over(self, done: Stretch) -> None:
        """What C has done becomes part of the run."""
        self.t, self.h, self.longest, self.side, self.crossed, self.idle, self.stiff = done.at
        self.rejected += done.rejected
        self.outside += done.outside
        self.recorder.extend(done.rows, done.held)
        for instant in done.instants:
            self._keep(instant)
        if self.watch is not None:
            self.watch()

    def _choose(self) -> None:
        """Select the step function for the present modes, and the longest step; note whether the explicit method may be given up."""
        memory = self.memory
        self.longest = min(self.max_step, self.engine.waves.longest_step(self.t, self.stop, memory.m, memory.p))
        steps = self.steps
        if self.engine.specializes and not self.numeric:
            steps = self.engine.special.get(self.method, self.memory.m, steps)
        self.chosen = steps, self.method == "dopri5" and self.engine.method == "auto"
        self.since = self.recorder.steps

    def _count(self) -> None:
        """Count the steps since ``_choose``."""
        self.engine.special.count(self.recorder.steps - self.since)

    def _smaller(self, error: float, t: float, h: float, side: int, steps: Calls) -> tuple[float, Calls]:
        """The next step size after a rejected step, and its function."""
        self.rejected += 1
        before, self.refused = self.refused, (h, error)
        h *= reduction(h, error, before)
        if h >= SHORTEST * max(1.0, abs(t)):
            return h, steps
        self.t, self.h, self.side = t, h, side
        self._pivot()
        return self.h, self.steps

    def _pivot(self) -> None:
        """Go on with pivoting for algebraic unknowns after a step has become too small; the run fails where that changes nothing."""
        if self.method != "rodas5p" or self.numeric or not self.dae.z.numel():
            raise SimulationError(underflow(self.dae, self.memory, self.side, self.t, self.h))
        self.numeric, self.in_c = True, None
        self.steps = self.engine.stepper(self.method, numeric=True)
        self.chosen, self.h, self.refused = (self.steps, False), _AGAIN, None

    def _too_stiff(self, ratio: float) -> bool:
        """Whether enough steps were at the stability limit of the explicit method."""
        self.stiff += 1.0 if ratio > STIFF else -0.4
        return self.stiff >= STIFF_STEPS

    def _implicit(self) -> Calls:
        """Change to the implicit method for the rest of the run."""
        self.stiff, self.method = 0.0, "rodas5p"
        self.steps, self.in_c = self.engine.stepper(self.method), self._loop_in_c(self.method)
        self.chosen = self.steps, False
        return self.steps

    def _locate(self, t: float, h: float, side: int) -> bool:
        """Move to the event inside the step just taken; False if there is none."""
        self.t, self.side = t, side
        memory = self.memory
        fraction = self.engine.locator.find(_depth(self.idle))
        if fraction is None:
            return False
        self.side = 1 - self.side
        memory.y[self.side][:] = memory.at
        self.t, self.h = self.target if fraction == 1.0 and t + 1.01 * h >= self.target else t + fraction * h, h
        self._refuse_located()
        return True

    def _refuse_located(self) -> None:
        """Raise SimulationError if a quantity leaves its range at the event just located."""
        for k in self.engine.guard_places:
            if self.memory.g[k] <= 0.0:
                law = self.engine.indicators[k].law
                assert isinstance(law, Guard)
                raise SimulationError(guard_message(self.dae, self._point(), law))

    def _pass(self, located: bool) -> None:
        """An event at which nothing may jump that something with inertia follows, and no sides of a contact into each other."""
        self.engine.keep_left(self.t, self.side)
        self._event(located)
        self.engine.check_jumps(self.t, self.side)
        if self.engine.zeno is not None and self.engine.resolver.extra and self.recorder.instants:
            notes = self.engine.resolver.notes
            notes += [said for said in self.engine.zeno.check(self.recorder.instants[-1]) if said not in notes]

    def _event(self, located: bool) -> None:
        """Resolve what happens at the present instant and continue from its right limit."""
        memory, m, t = self.memory, self.memory.m, self.t
        near = just_after(t)
        timed = self.instant <= near or self.corner <= near
        if not (located or timed):
            return
        memory.time[0], memory.time[1] = t, 0.0
        if not timed and self.engine.bends and self._bends():
            return
        engine, resolver, held_left = self.engine, self.engine.resolver, self.recorder.held[-1]
        jumps = self.corner <= near and engine.schedules.cross(m, self.crossed, near)
        self.crossed = near
        if self.instant <= near:
            engine.fire(t)
        elif not located and not jumps and self._turns():
            return
        left = memory.y[self.side].copy()
        try:
            engine.admissible.check_rest(self.side)
            self._rest(held_left)
            resolver.resolve(self.side, JUMPED if jumps else 0.0)
            engine.admissible.check(self.side)
        except (NotConsistent, SimulationError):
            # a run that ends here ends with the last motion that there is
            memory.y[self.side][:], m[:] = left, held_left
            raise
        held = m.copy()
        changed = (held != held_left).nonzero()[0].tolist()
        if changed:
            self._count()
            self.recorder.enter(held)
            self._choose()
        if not jumps and not resolver.extra and self.catalogue.quiet.issuperset(changed):
            self._idle(located and not changed)
            self._refresh()
            return
        self.idle = 0
        self._restart()
        right = memory.y[self.side].copy()
        self._keep(Instant(t, left, right, held_left, held, tuple(resolver.extra), resolver.impulses), resolver.applied)

    def _rest(self, held: Array) -> None:
        """What has been stuck, with the held values before the event, is at rest."""
        now = self.memory.m.copy()
        self.memory.m[:] = held
        self.engine.rest[self.side]()
        self.side, self.memory.m[:] = 1 - self.side, now

    def _keep(self, instant: Instant, applied: Sequence[int] = ()) -> None:
        """Record an event, at which the resets of the laws ``applied`` were. SimulationError if its laws chatter."""
        if not instant.begins(self.start, self.catalogue.rests.values()):
            self.recorder.instants.append(instant)
        for index in {*(instant.held_left != instant.held_right).nonzero()[0].tolist(), *applied}:
            if index in self.catalogue.chattering and self.chatter.note(index, instant.time):
                raise SimulationError(self.chatter.message(self.catalogue.chattering[index], instant.time))

    def _bends(self) -> bool:
        """Continue past a kink of expressions; False if more than the modes of these expressions must be resolved there."""
        m, bends = self.memory.m, self.engine.bends
        places = [bends.get(k) for k in (self.memory.g <= 0.0).nonzero()[0].tolist()]
        if not places or None in places:
            return False
        for index in places:
            m[index] = 1.0 - m[index]
        if self._turns():
            self._count()
            self._choose()
            return True
        for index in places:
            m[index] = 1.0 - m[index]
        return False

    def _turns(self) -> bool:
        """Continue past a corner of continuous signals with the same step size; False if modes must be resolved there."""
        memory = self.memory
        self.engine.corner[self.side]()
        unsettled, total = memory.corner.tolist()
        if unsettled != 0.0 or not -np.inf < total < np.inf:
            return False
        self.side, self.idle = 1 - self.side, 0
        self.recorder.enter(memory.m.copy())
        return True

    def _idle(self, without_change: bool) -> None:
        """Count located events that change nothing; too many in a row stop time."""
        self.idle = self.idle + 1 if without_change else 0
        if self.idle > MOST_IDLE:
            g = self.memory.g
            law = self.engine.indicators[int(np.argmin(g))].law
            raise SimulationError(
                f"at t = {self.t:.9g} s {law.name} ({law.where}) triggers events repeatedly without changing its mode"
            )

    def _point(self) -> Point:
        return self.memory.values(self.t, self.memory.y[self.side], self.memory.m)

    def _check_guards(self) -> None:
        if message := first_violation(self.dae, self._point()):
            raise SimulationError(message)


def _depth(idle: int) -> float:
    """How far below zero an indicator counts after ``idle`` events without a change: those were noise of implicit torques."""
    return EPS * 2.0 ** min(idle, 20) if idle else 0.0


def _throttled(tell: Callable[[], None]) -> Callable[[], None]:
    """Call ``tell`` at most ten times a second."""
    last = [clock.perf_counter()]

    def watch() -> None:
        now = clock.perf_counter()
        if now - last[0] >= 0.1:
            last[0] = now
            tell()

    return watch
