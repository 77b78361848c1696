"""The event loop: steps until something happens, locates it, resolves the modes, goes on."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from powertrain.compiler.hybrid import Contact, Friction, Guard, HybridDae, Switch, When
from powertrain.engine.buffers import view
from powertrain.engine.chatter import Chatter
from powertrain.engine.consistent import NotConsistent
from powertrain.engine.failure import guard_message, guard_violation, not_finite, underflow
from powertrain.engine.location import locate_event
from powertrain.engine.projection import project
from powertrain.engine.survey import ROUGH
from powertrain.engine.trajectory import Instant, Recorder, Trajectory
from powertrain.errors import SimulationError

if TYPE_CHECKING:
    from powertrain.engine.engine import Engine

_STIFF = 3.25
_STIFF_STEPS = 15
_FINEST = 1e-5
"""Share of the simulated span below which steps are not halved to resolve indicators."""
_HALVINGS = 8
"""How often a step is halved because the indicators are not resolved; then a kink is taken as it is."""


class Run:
    """One simulation on the arrays of an engine whose start is already resolved on side 0."""

    def __init__(
        self,
        engine: Engine,
        start: float,
        stop: float,
        rtol: float,
        max_step: float,
        progress: Callable[[float], None] | None,
    ) -> None:
        self.engine, self.memory, self.dae = engine, engine.memory, engine.dae
        self.t, self.start, self.stop, self.rtol, self.max_step = start, start, stop, rtol, max_step
        self.side, self.h, self.crossed = 0, 0.0, start
        self.progress = progress
        self.watch = _throttled(progress) if progress is not None else None
        kinds = tuple((law.index, law.name, kind) for kind, laws in _laws(engine) for law in laws)
        self.recorder = Recorder(engine.dae.x.numel() + engine.dae.z.numel(), engine.dae.x.numel(), kinds)
        self.quiet = {s.index for s in self.dae.switches if s.continuous} | _schedule_entries(engine.dae)
        self.chatter = Chatter(stop - start)
        self.chattering = {
            law.index: law for _, laws in _laws(engine) for law in laws if getattr(law, "time", None) is None
        }
        self.counted = [guard for guard in self.dae.guards if guard.action == "count"]
        self.outside = np.zeros(len(self.counted))
        self.rejected, self.stiff, self.idle = 0, 0.0, 0
        self.method = engine.first_method(stop - start)
        self.numeric = False

    def execute(self) -> Trajectory:
        """Run to the stop time; errors carry the trajectory so far."""
        self.steps = self.engine.stepper(self.method)
        try:
            self._restart()
            self.recorder.enter(self.memory.m)
            self._check_guards()
            while self.t < self.stop:
                self._next_stop()
                located = self._smooth()
                self._event(located)
        except NotConsistent as error:
            raise SimulationError(f"at t = {self.t:.9g} s {error}", self._trajectory()) from None
        except SimulationError as error:
            error.result = self._trajectory()
            raise
        if self.progress is not None:
            self.progress(self.stop)
        return self._trajectory()

    def _trajectory(self) -> Trajectory:
        statistics = {
            "steps": float(len(self.recorder.times)),
            "rejected": float(self.rejected),
            "events": float(len(self.recorder.instants)),
        }
        statistics |= {f"outside {guard.name}": float(n) for guard, n in zip(self.counted, self.outside, strict=True)}
        trajectory = self.recorder.trajectory(self.t, self.memory.y[self.side], self.memory.m, statistics)
        return replace(trajectory, notes=tuple(self.engine.resolver.notes))

    def _next_stop(self) -> None:
        self.instant = min(self.engine.next_instant(self.t), self.engine.schedules.following(self.t))
        self.target = min(self.instant, self.stop)

    def _restart(self) -> None:
        """Slope and first step size after a discontinuity."""
        self._refresh()
        self.h = min(float(self.memory.start[0]), self.max_step)
        self.error_before = 1e-4

    def _refresh(self) -> None:
        memory = self.memory
        memory.time[0] = self.t
        self.engine.fresh[self.side].call()
        self.side = 1 - self.side
        total = float(memory.slope[self.side].sum())
        if not -np.inf < total < np.inf:
            self._refuse_rates()
        if memory.start[1] > 1e-13:
            project(self.dae, self.memory, self.side)

    def _refuse_rates(self) -> None:
        raise SimulationError(not_finite(self.dae, self.memory, self.side, self.t))

    def _smooth(self) -> bool:
        """Step until an indicator falls below zero (located: True) or until ``self.target``."""
        memory, recorder = self.memory, self.recorder
        time, info, dense = view(memory.time), view(memory.info), memory.dense
        steps = self.steps
        times, sizes, rows = recorder.times.append, recorder.sizes.append, recorder.rows.append
        t, h, side, target, largest = self.t, self.h, self.side, self.target, self.max_step
        before, rejected, watch = self.error_before, False, self.watch
        counting, auto = bool(self.counted), self.method == "dopri5" and self.engine.method == "auto"
        wanted, halved, finest = 0.0, 0, _FINEST * (self.stop - self.start)
        while True:
            last = t + 1.01 * h >= target
            if last:
                wanted, h = h, target - t
            time[0], time[1] = t, h
            steps[side]()
            e = info[0]
            if not e <= 1.0:
                rejected = True
                h = self._smaller(e, t, h, side)
                steps = self.steps
                continue
            rough = info[4]
            if (rough > ROUGH or info[3] <= 0.0 < info[1]) and halved < _HALVINGS and h > finest:
                halved += 1
                self.rejected += 1
                rejected, h = True, 0.5 * h
                continue
            halved = 0
            times(t)
            sizes(h)
            rows(dense.tobytes())
            factor = _growth(e, before, rough, 1.0 if rejected else 5.0)
            rejected = False
            before = e if e > 1e-4 else 1e-4
            if info[1] <= 0.0 and self._locate(t, h, side):
                return True
            side = 1 - side
            t = target if last else t + h
            h = min(max(h * factor, wanted) if last else h * factor, largest)
            if counting:
                self.outside += memory.outside[: len(self.outside)]
            if watch is not None:
                watch(t)
            if auto and (info[2] > _STIFF or self.stiff > 0):
                steps = self._watch_stiffness(info[2])
                auto = self.method == "dopri5"
            if last:
                self.t, self.h, self.side, self.error_before = t, h, side, before
                return False

    def _smaller(self, e: float, t: float, h: float, side: int) -> float:
        """The next trial size after a rejected step; algebraic unknowns get a solver with pivoting before the run is given up."""
        self.rejected += 1
        h *= max(0.2, 0.9 * e**-0.2) if e == e and e < 1e100 else 0.1
        if h >= 1e-15 * max(1.0, abs(t)):
            return h
        if self.method == "rodas5p" and not self.numeric and self.dae.z.numel():
            self.numeric = True
            self.steps = self.engine.stepper(self.method, numeric=True)
            return 1e-6
        self.t, self.side = t, side
        raise SimulationError(underflow(self.engine, side, t, h))

    def _watch_stiffness(self, ratio: float) -> tuple[Callable[[], None], Callable[[], None]]:
        """Change to the implicit method after enough steps at the edge of the explicit one's stability."""
        self.stiff += 1.0 if ratio > _STIFF else -0.4
        if self.stiff >= _STIFF_STEPS:
            self.method = "rodas5p"
            self.steps = self.engine.stepper(self.method)
        return self.steps

    def _locate(self, t: float, h: float, side: int) -> bool:
        """Move to the event inside the step just taken; False if there is none after all."""
        self.t, self.side = t, side
        memory = self.memory
        fraction = locate_event(self.engine.locate, memory)
        if fraction is None:
            return False
        self.side = 1 - self.side
        memory.y[self.side][:] = memory.at
        self.t, self.h = (
            (self.target if fraction == 1.0 and self.t + 1.01 * h >= self.target else self.t + fraction * h),
            h,
        )
        for k in self.engine.guard_places:
            if memory.g[k] <= 0.0:
                law = self.engine.indicators[k].law
                assert isinstance(law, Guard)
                raise SimulationError(guard_message(self.dae, memory, self.side, law, self.t))
        return True

    def _event(self, located: bool) -> None:
        """Resolve what happens at the present instant and go on from its right limit."""
        memory, m, t = self.memory, self.memory.m, self.t
        near = 1e-12 * max(1.0, abs(t))
        if not located and self.instant > t + near:
            return
        memory.time[0], memory.time[1] = t, 0.0
        held_left, left = m.copy(), memory.y[self.side].copy()
        self.engine.fire(t, t)
        jumps = bool(self.engine.schedules) and self.engine.schedules.cross(m, self.crossed, t + near)
        self.crossed = t + near
        resolver = self.engine.resolver
        resolver.resolve(self.side)
        self.engine.check_modes(self.side)
        changed = np.flatnonzero(m != held_left).tolist()
        if changed:
            self.recorder.enter(m)
        if not jumps and not resolver.extra and self.quiet.issuperset(changed):
            self._idle(located and not changed)
            self._refresh()
            return
        self.idle = 0
        self._restart()
        right = memory.y[self.side].copy()
        self.recorder.instants.append(Instant(t, left, right, held_left, m.copy(), tuple(resolver.extra)))
        for index in changed:
            if index in self.chattering and self.chatter.note(index, t):
                raise SimulationError(self.chatter.message(self.chattering[index], t))

    def _idle(self, without_change: bool) -> None:
        """Count located events that change nothing; too many in a row do not let time advance."""
        self.idle = self.idle + 1 if without_change else 0
        if self.idle > 1000:
            g = self.memory.g
            law = self.engine.indicators[int(np.argmin(g))].law
            raise SimulationError(
                f"at t = {self.t:.9g} s {law.name} ({law.where}) reports events without end and does not change its mode"
            )

    def _check_guards(self) -> None:
        for guard in self.dae.guards:
            if guard.action == "error":
                message = guard_violation(self.dae, self.memory, self.side, guard, self.t)
                if message:
                    raise SimulationError(message)


def _growth(e: float, before: float, rough: float, most: float) -> float:
    """The next step size over this one: a PI controller on the error norm, held back where indicators are barely resolved."""
    factor = 0.9 * (e if e > 1e-10 else 1e-10) ** -0.14 * before**0.08
    if 0.003 < rough <= ROUGH:
        factor = min(factor, (0.3 / rough) ** (1 / 3))
    return most if factor > most else 0.2 if factor < 0.2 else factor


def _laws(engine: Engine) -> list[tuple[str, tuple[Friction | Switch | Contact | When, ...]]]:
    dae = engine.dae
    loud = tuple(switch for switch in dae.switches if not switch.continuous)
    return [("friction", dae.frictions), ("switch", loud), ("contact", dae.contacts), ("when", dae.whens)]


def _schedule_entries(dae: HybridDae) -> set[int]:
    return {schedule.index + k for schedule in dae.schedules for k in range(3)}


def _throttled(progress: Callable[[float], None]) -> Callable[[float], None]:
    """Call ``progress`` at most ten times a second."""
    last = [clock.perf_counter()]

    def watch(t: float) -> None:
        now = clock.perf_counter()
        if now - last[0] >= 0.1:
            last[0] = now
            progress(t)

    return watch
