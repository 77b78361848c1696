"""Operating points at which Newton's method fails: implicit Euler steps of growing length follow the motion until it comes to rest.

    (y' - y)/h = f(y', tau),   w = w(y'),   w > 0: tau = U,   w < 0: tau = L,   w = 0: L <= tau <= U

Linearised at y, a step is the problem of ``powertrain.modes.complementarity`` with speeds in place of rates. Steps grow until they are
Newton steps. A step for which one linearisation is not valid is shortened: along it a decreasing limit may have changed sign, a clutch
opened, or a torque saturated. The term 1/h holds motions that nothing else holds. Torques that grow with others (lossy meshes) come last:
without them the problem is convex and gives all modes, and its speeds give the directions of sliding. Without laws, all points take their
steps at once.

C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from powertrain.compiler.torques import COMPLIANCE
from powertrain.dae.friction import FORWARD
from powertrain.dae.hybrid import OperatingPoint
from powertrain.dae.tolerances import NO_WIDTH, REST, STILL
from powertrain.equilibrium.beginnings import beginnings, euler_step, mobilities
from powertrain.equilibrium.corrector import corrected
from powertrain.equilibrium.laws import LAST_STEP, Linearized, SteadyLaws
from powertrain.equilibrium.points import AtRest, Iterates, Mask, SolvedPoints
from powertrain.language.reals import Array
from powertrain.modes.complementarity import Answer, Complementarity, LinearLaws
from powertrain.numerics.newton import relative

FIRST_STEP, LONGEST_STEP, GROWTH = 1.0, 1e4, 10.0
"""First and longest step in seconds, from steps that follow the motion to Newton steps, and the factor by which they grow or shrink."""
LEAST_STEP = 1e-4
"""The shortest step [s]."""
DESCRIBED = 1.0
"""A step is accepted if the next correction is no longer than this share of it."""
ROUNDS = 40
FAR = 1e10
"""Unknowns above this diverge."""
MOST_PIECES = 8
RELAXED_FIRST, RELAXED_GROWTH, RELAXED_FALL = 1e-4, 3.0, 0.25
"""Without laws: the first step in seconds, and the factors by which steps grow and shrink."""
RELAXED_DESCRIBED = 0.3
"""``DESCRIBED`` without laws."""
RELAXED_ROUNDS = 400


@dataclass(frozen=True)
class _Trial(OperatingPoint):
    """The last iterate: x are the unknowns y, p the values of the grid, m the modes.

    ``step`` is h; ``lossless``: torques that depend on others are left out; ``open``: laws whose direction is unknown.
    """

    step: float
    lossless: bool
    open: Mask

    def at(self, tau: Array) -> Iterates:
        """The iterate with these torques, as one row."""
        return Iterates(self.p[None], self.x[None], self.m[None], tau[None])


@dataclass(frozen=True)
class _Step(LinearLaws):
    """The laws after a step, and the step itself: y' = y + move + along (tau' - tau)."""

    move: Array
    along: Array
    given: Mask
    zone: Array


class _StepLaws:
    """The laws after an implicit Euler step as functions of their torques."""

    def __init__(self, laws: SteadyLaws) -> None:
        self.laws, self.count, self.frictions = laws, laws.count, laws.frictions
        self.index, self.switches = laws.law_modes.tolist(), laws.switch_modes.tolist()
        self.may_free, self.linearized = laws.may_free, Linearized(laws)

    def at(self, point: OperatingPoint, tau: Array) -> _Step:
        """The laws near ``tau``; nan if an equation has no value there."""
        assert isinstance(point, _Trial)
        n, many = point.x.size, self.linearized(point.at(tau), point.lossless)
        step = euler_step(self.laws, many, point.step)
        given, reach, rate_slope = (each[0] for each in mobilities(many, step))
        v, move, along = many.first(), step.move[0], step.along[0]

        def after(value: Array, slope: Array) -> tuple[Array, Array]:
            return value + slope[:, :n] @ move, slope[:, n:] + slope[:, :n] @ along

        rate = v.speed + v.speed_[:, :n] @ move
        (lower, lower_slope), (upper, upper_slope) = after(v.lower, v.lower_), after(v.upper, v.upper_)
        g, g_slope = after(v.g, v.g_)
        yields = COMPLIANCE * reach
        rate = np.where(given & (np.abs(rate) <= v.zone), 0.0, rate)
        slopes = rate_slope, lower_slope, upper_slope, g_slope
        peak = np.ones(self.count)  # the point of breaking loose is not an operating point
        return _Step(v.speed, rate, lower, upper, peak, reach, yields, g, *slopes, move, along, given, v.zone)

    def at_rest(self, point: OperatingPoint, near: LinearLaws, zone: float) -> Mask:
        """The laws whose direction is unknown."""
        assert isinstance(point, _Trial)
        assert isinstance(near, _Step)
        rest: Mask = point.open | (np.abs(near.speed) <= near.zone)
        rest &= ~(near.given & (np.abs(near.rate) > near.zone))
        free = self.may_free | (self.laws.tied & point.lossless)
        return rest & ~(free & (near.upper - near.lower <= NO_WIDTH))


class Continuation:
    """Finds operating points of one steady problem, one by one: all arrays have one row."""

    def __init__(self, laws: SteadyLaws) -> None:
        self.laws, self._steps = laws, _StepLaws(laws)
        self.problem = Complementarity(laws.balance.dae, self._steps)

    def solve(self, grid: Array, side: Array, within: Callable[[SolvedPoints], Mask]) -> SolvedPoints | None:
        """A solution for values of the grid; ``side`` as in ``AtRest``.

        If Newton's method leads to a root beyond the limits of the model, such as a battery's low voltage, continuation steps follow.
        """
        laws, every = self.laws, np.ones(self.laws.count, bool)
        rest, modes = beginnings(laws, grid, side).rest, np.zeros(laws.balance.modes.numel())
        start, initial = laws.starts(grid)
        begun = [start] if np.array_equal(start, initial) else [start, initial]
        starts = [_Trial(0.0, y[0], np.zeros(0), modes, grid[0], FIRST_STEP, True, every) for y in begun]
        for attempt, first in product((self._held, self._settled), starts):
            found = attempt(first, np.zeros(laws.count), rest)
            if found is not None and laws.tied.any():
                x, m, tau = found.y[0], found.modes[0], found.tau[0]
                again = replace(first, x=x, m=m, lossless=False, open=~every, step=LONGEST_STEP)
                found = self._corrected(again.at(tau), again, rest) or self._settled(again, tau, rest)
            if found is not None and within(found)[0]:
                return found
        return None

    def _held(self, point: _Trial, tau: Array, rest: AtRest) -> SolvedPoints | None:
        """The solution of the semismooth Newton method with all laws initially stuck."""
        here = point.at(tau)
        modes = self.laws.next_modes(here, rest, lossless=point.lossless).modes.copy()
        modes[:, self.laws.tied_modes] = FORWARD
        return self._corrected(replace(here, modes=modes), point, rest)

    def _corrected(self, here: Iterates, point: _Trial, rest: AtRest) -> SolvedPoints | None:
        """The solution of the semismooth Newton method from ``here``."""
        end, fine = corrected(self.laws, here, rest, point.lossless)
        return SolvedPoints(fine, end.y, end.modes, end.tau, rest.given, rest.yields) if fine[0] else None

    def _settled(self, point: _Trial, tau: Array, rest: AtRest) -> SolvedPoints | None:
        """Take steps, each followed by Newton's method for the resulting modes, until the modes hold."""
        laws = self.laws
        for _ in range(ROUNDS):
            answer = self._answer(point, tau)
            if answer is None or answer.tau is None:  # a limit changes sign along a step that is too long
                if not laws.rates.size or point.step <= LEAST_STEP:  # without rates the length changes nothing
                    return None
                point = replace(point, step=point.step / GROWTH)
                continue
            m = point.m.copy()
            m[list(answer.modes)] = list(answer.modes.values())
            step = self._steps.at(replace(point, m=m), tau)
            y = point.x + step.move + step.along @ (answer.tau - tau)
            if not (np.abs(y) <= FAR).all():
                return None
            after = replace(point, m=m, x=y)
            here = after.at(answer.tau)
            if point.step > LEAST_STEP and not self._described(here, point, rest):
                point = replace(point, step=point.step / GROWTH)
                continue
            if (found := self._corrected(here, point, rest)) is not None:
                return found
            value = self._steps.linearized(here, point.lossless)
            m[laws.switch_modes] = value.g[0] > 0.0
            turned = np.sign(value.speed[0]) * np.sign(step.speed) < 0
            stuck = m[laws.law_modes] == laws.holding
            wide = point.open if point.lossless else turned | stuck
            point = replace(after, step=min(GROWTH * point.step, LONGEST_STEP), open=wide)
            tau = answer.tau
        return None

    def _described(self, here: Iterates, point: _Trial, rest: AtRest) -> bool:
        """Whether one linearisation is valid for the step: its Newton correction is shorter than the step."""
        laws, moved, scale = self.laws, here.y[0] - point.x, relative(point.x)
        entries, left = laws.equations(laws.fixed(here, rest, point.lossless, point.step), here.z)
        left[0, laws.rates] -= moved[laws.rated] / point.step
        correction = laws.pattern.solver(entries)(-left)[0, : laws.unknowns]
        size, most = (np.abs(v / scale).max(initial=0.0) for v in (correction, moved))
        return bool(size <= DESCRIBED * most + STILL)

    def _answer(self, point: _Trial, tau: Array) -> Answer | None:
        """The problem with the kinks of the bounds; if that fails, one problem for each combination of their pieces."""
        answer = self.problem.solve(point, tau, 0.0, bends=True)
        if answer.tau is not None:
            return answer
        bending = self.problem.bending(self._steps.at(point, tau))
        if len(bending) > MOST_PIECES:
            return None
        places = [self._steps.switches[k] for k in bending]
        for piece in product((0.0, 1.0), repeat=len(bending)):
            m = point.m.copy()
            m[places] = piece
            held = replace(point, m=m)
            answer = self.problem.solve(held, tau, 0.0, bends=False)
            if answer.tau is None:
                continue
            at = self._steps.at(held, tau)
            g = at.g + at.g_slope @ (answer.tau - tau)
            size = REST * (1.0 + np.abs(at.g_slope) @ np.abs(answer.tau))
            if all((2.0 * v - 1.0) * g[k] >= -size[k] for k, v in zip(bending, piece, strict=True)):
                return replace(answer, modes={**answer.modes, **dict(zip(places, piece, strict=True))})
        return None


def relaxed(laws: SteadyLaws, at: Iterates, rest: AtRest) -> Iterates:
    """The state after a long motion from ``at``, or after ``RELAXED_ROUNDS`` steps.

    Where a torque saturates, its slope does not show where saturation ends, and no Newton step leads on. The motion does. A step that is
    longer than the time in which a motion grows would lead back to where it began; the determinant has the opposite sign there.
    """
    z, modes, n = at.z, at.modes.copy(order="K"), laws.unknowns
    length, active = np.full(len(z), RELAXED_FIRST), np.arange(len(z))
    for _ in range(RELAXED_ROUNDS):
        here = Iterates(at.grid, z[:, :n], modes, z[:, n:]).some(active)
        resting, h = rest.some(active), length[active, None]
        modes[active] = laws.next_modes(here, resting).modes
        here = replace(here, modes=modes[active])
        fixed, brief = (laws.fixed(here, resting, step=step) for step in (h, RELAXED_FIRST))
        entries, value = laws.equations(fixed, here.z)
        solve = laws.pattern.solver(entries)
        step = solve(-value)
        _, defect = laws.equations(fixed, here.z + step)
        defect[:, laws.rates] -= step[:, laws.rated] / h
        scale = relative(here.y)
        size, left = (np.abs(v[:, :n] / scale).max(axis=1, initial=0.0) for v in (step, solve(-defect)))
        settles = _side(laws, entries) == _side(laws, laws.equations(brief, here.z)[0])
        good = settles & (left <= RELAXED_DESCRIBED * size)
        z[active[good]] = (here.z + step)[good]
        length[active] *= np.where(good, RELAXED_GROWTH, RELAXED_FALL)
        active = active[(length[active] < LAST_STEP) & (length[active] > RELAXED_FIRST**3)]
        if not active.size:
            break
    return Iterates(at.grid, z[:, :n], modes, z[:, n:])


def _side(laws: SteadyLaws, entries: Array) -> Array:
    """The signs of the determinants."""
    return np.asarray(np.linalg.slogdet(np.nan_to_num(laws.pattern.dense(entries)))[0])
