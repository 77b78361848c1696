"""One operating point: implicit Euler steps of growing length, each of which is one complementarity problem of all laws.

A steady state is where a simulation comes to rest. A step of length h from y,

    (y' - y)/h = f(y', tau),   w = w(y'),   w > 0: tau = U,   w < 0: tau = L,   w = 0: L <= tau <= U,

linearised at y, is the problem of ``powertrain.modes.complementarity`` with speeds in the place of rates. Steps grow until they are
Newton's; motions that nothing holds are kept by 1/h. Torques that grow with others (lossy meshes) come last: without them all modes
follow from a convex problem, and its speeds tell the directions of what slides.

C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.torques import COMPLIANCE
from powertrain.engine.buffers import Array
from powertrain.modes.complementarity import Answer, Complementarity, Linear, Mask, Point
from powertrain.steadystate.balance import Balance

FIRST_STEP, LONGEST_STEP, LAST_STEP, GROWTH = 1.0, 1e4, 1e8, 10.0
"""Lengths of steps in seconds: some that follow the motion, then Newton's; the last ones hold what nothing else does."""
CORRECTIONS = 12
"""Newton's steps for given modes."""
KNOWN = 1e-8
"""How well torques are known, relative to the largest."""
ROUNDS = 40
STILL = 1e-10
"""Unknowns that change by less, relative to one and to their size, are found."""
REST = 1e-9
"""A relative speed counts as rest below this share of the speeds that it is the difference of."""
GIVEN = 1e-11
"""A law's own torque moves it where its speed changes by more than this share of the terms."""
MOST_PIECES = 8


@dataclass(frozen=True)
class Trial(Point):
    """The last iterate (x: the unknowns y), with the values of the grid and the common ones in p.

    ``step`` is h; ``lossless``: torques that follow others are left out; ``crossed``: laws whose direction is not known;
    ``side``: 1 or -1 for laws that rest under a given motion and are looked at from there.
    """

    step: float
    lossless: bool
    crossed: Mask
    side: Array


@dataclass(frozen=True)
class Step(Linear):
    """The laws after a step, and the step itself: y' = y + move + along (tau' - tau)."""

    move: Array
    along: Array
    given: Mask
    size: Array


@dataclass(frozen=True)
class Values:
    """Rows, speeds, limits and conditions at one point, and their derivatives by (y, tau)."""

    rows: Array
    speed: Array
    lower: Array
    upper: Array
    g: Array
    rows_: Array
    speed_: Array
    lower_: Array
    upper_: Array
    g_: Array


@dataclass(frozen=True)
class Found:
    """An operating point: unknowns, held values, torques, laws at rest under a given motion."""

    y: Array
    m: Array
    tau: Array
    rest: Mask
    loose: bool


class SteadyLaws:
    """All friction laws and contacts of a steady problem as functions of their torques."""

    def __init__(self, balance: Balance) -> None:
        dae = self.dae = balance.dae
        self.balance, self.count = balance, balance.tau.numel()
        self.index = [f.index for f in dae.frictions] + [c.index for c in dae.contacts]
        self.frictions = len(dae.frictions)
        self.may_free = np.array([f.may_free for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self.tied = ~self.may_free & (np.arange(self.count) < self.frictions)
        self._places = [law.index for law in (*dae.frictions, *dae.switches, *dae.contacts)]
        self._sign = np.where(np.arange(self.count) < self.frictions, 1.0, -1.0)
        self.rate_of = balance.rate_of
        moved = ca.vertcat(balance.y, balance.tau)
        values = [balance.rows, balance.speed, balance.lower, balance.upper, balance.conditions]
        slopes = [ca.jacobian(e, moved) for e in values]
        inputs = [balance.grid, balance.common, balance.y, balance.modes, balance.tau]
        outputs = [ca.densify(e) for e in ca.cse([*values, *slopes])]
        self._function = ca.Function("powertrain_balance", inputs, outputs)
        self._grid = balance.grid.numel()

    def values(self, point: Trial, tau: Array) -> Values:
        """Everything at one point, with derivatives by (y, tau)."""
        n = self._grid
        found = self._function(point.p[:n], point.p[n:], point.x, point.m[self._places], self._sign * tau)
        values = [np.array(v, float) for v in found]
        for slope in values[5:]:
            slope[:, point.x.size :] *= self._sign
        value = Values(*(v.ravel() for v in values[:5]), *values[5:])
        if point.lossless:
            for each in (value.lower, value.upper, value.lower_, value.upper_):
                each[self.tied] = 0.0
        return value

    def at(self, point: Point, tau: Array) -> Step:
        """The laws after a step, near ``tau``; nan where an equation has no value there."""
        assert isinstance(point, Trial)
        v, n = self.values(point, tau), point.x.size
        matrix = v.rows_[:, :n].copy()
        rates = np.flatnonzero(self.rate_of >= 0)
        matrix[rates, self.rate_of[rates]] -= 1.0 / point.step
        solved = _solved(matrix, -np.column_stack([v.rows, v.rows_[:, n:]]))
        move, along = solved[:, 0], solved[:, 1:]

        def after(value: Array, slope: Array) -> tuple[Array, Array]:
            return value + slope[:, :n] @ move, slope[:, n:] + slope[:, :n] @ along

        size = np.abs(v.speed_[:, :n]) @ np.abs(point.x)
        terms = np.abs(v.speed_[:, n:]) + np.abs(v.speed_[:, :n]) @ np.abs(along)
        (rate, rate_slope), (lower, lower_slope) = after(v.speed, v.speed_), after(v.lower, v.lower_)
        (upper, upper_slope), (g, g_slope) = after(v.upper, v.upper_), after(v.g, v.g_)
        own = np.abs(np.diagonal(rate_slope))
        given = own <= GIVEN * np.diagonal(terms)
        reach = np.where(given, 1.0, own)
        yields = COMPLIANCE * reach
        rate = np.where(given & (np.abs(rate) <= REST * (1.0 + size)), 0.0, rate + yields * tau)
        slopes = rate_slope, lower_slope, upper_slope, g_slope
        return Step(v.speed, rate, lower, upper, reach, yields, g, *slopes, move, along, given, size)

    def at_rest(self, point: Point, near: Linear, zone: float) -> Mask:
        """The laws whose direction is not known."""
        assert isinstance(point, Trial)
        assert isinstance(near, Step)
        width = near.upper - near.lower
        rest: Mask = point.crossed | (np.abs(near.speed) <= REST * (1.0 + near.size))
        rest &= ~(near.given & (np.abs(near.rate) > REST * (1.0 + near.size)))
        rest &= ~((self.may_free | (point.lossless & self.tied)) & (width <= 1e-10))
        return rest


class Continuation:
    """Finds operating points of one steady problem."""

    def __init__(self, balance: Balance) -> None:
        self.laws = SteadyLaws(balance)
        self.problem = Complementarity(balance.dae, self.laws)
        self.switches = [s.index for s in balance.dae.switches]
        self.held_start, self.start = balance.dae.held_start, balance.start

    def solve(self, values: Array, start: Array | None = None, side: Array | None = None) -> Found | None:
        """A solution for the ``values`` of grid and common values, near ``start`` of the unknowns."""
        laws = self.laws
        every = np.ones(laws.count, bool)
        y, tau = self.start if start is None else start, np.zeros(laws.count)
        ends = np.zeros(laws.count) if side is None else side
        point = Trial(0.0, y, np.zeros(0), self.held_start.copy(), values, FIRST_STEP, True, every, ends)
        lossless = self._settled(point, tau)
        if lossless is None or not laws.tied.any():
            return lossless
        y, m = lossless.y, lossless.m
        return self._settled(replace(point, x=y, m=m, lossless=False, crossed=~every, step=LONGEST_STEP), lossless.tau)

    def _settled(self, point: Trial, tau: Array) -> Found | None:
        """Steps, each followed by Newton's method for the modes that it gives, until these are consistent."""
        for _ in range(ROUNDS):
            answer = self._answer(point, tau)
            if answer is None or answer.tau is None:
                return None
            m = point.m.copy()
            for index, mode in answer.modes.items():
                m[index] = mode
            here = replace(point, m=m)
            step = self.laws.at(here, tau)
            y = point.x + step.move + step.along @ (answer.tau - tau)
            if not np.isfinite(y).all():
                return None
            found = self._polished(replace(here, x=y), answer.tau, step)
            if found is not None:
                return found
            here = replace(here, x=y)
            after = self.laws.values(here, answer.tau)
            m[self.switches] = after.g > 0.0
            friction = np.arange(self.laws.count) < self.laws.frictions
            crossed = (np.sign(after.speed) * np.sign(step.speed) < 0) | ((m[self.laws.index] == 0.0) == friction)
            if point.lossless:
                crossed = point.crossed
            point = replace(here, step=min(GROWTH * point.step, LONGEST_STEP), crossed=crossed)
            tau = answer.tau
        return None

    def _polished(self, point: Trial, tau: Array, step: Step) -> Found | None:
        """The solution for the modes of ``point``, if these are consistent there."""
        y, m, laws = point.x, point.m, self.laws
        for _ in range(CORRECTIONS):
            here = replace(point, x=y)
            value = laws.values(here, tau)
            matrix, right, given = self._bordered(here, value, tau, step)
            change = _solved(matrix, right)
            if not np.isfinite(change).all():
                return None
            y, tau = y + change[: y.size], tau + change[y.size :]
            if self._still(change, y, tau):
                break
        else:
            return None
        here = replace(point, x=y)
        value = laws.values(here, tau)
        if not self._consistent(here, value, tau, given):
            return None
        rest = given & (value.upper - value.lower > 1e-10)
        return Found(y, m.copy(), tau, rest, self._loose(here, value, tau, given))

    def _still(self, step: Array, y: Array, tau: Array) -> bool:
        n, large = y.size, np.abs(tau).max(initial=0.0)
        return bool((np.abs(step[:n]) <= STILL * (1.0 + np.abs(y))).all() and (np.abs(step[n:]) <= STILL * (1.0 + large)).all())

    def _bordered(self, point: Trial, value: Values, tau: Array, near: Step) -> tuple[Array, Array, Mask]:
        """Newton's equations in (y, tau) for given modes; and which laws rest under a given motion."""
        laws, n = self.laws, point.x.size
        mode, k = point.m[laws.index], np.arange(laws.count)
        contact = k >= laws.frictions
        stuck = np.where(contact, mode == 1.0, mode == 0.0)
        given = stuck & near.given
        upper = np.where(contact, True, (mode == 1.0) | (mode == 2.0))
        bound = np.where(upper, value.upper, value.lower)
        slope = np.where(upper[:, None], value.upper_, value.lower_)
        if given.any():
            least = np.clip(0.0, np.minimum(value.lower, value.upper), np.maximum(value.lower, value.upper))
            end = np.where(point.side > 0, value.upper, np.where(point.side < 0, value.lower, least))
            slopes = np.where((point.side > 0)[:, None], value.upper_, np.where((point.side < 0)[:, None], value.lower_, 0.0))
            bound, slope = np.where(given, end, bound), np.where(given[:, None], slopes, slope)
        bound, slope = np.nan_to_num(bound, posinf=0.0, neginf=0.0), np.nan_to_num(slope)
        held = stuck & ~given
        law = np.where(held[:, None], value.speed_, -slope)
        law[k, n + k] += np.where(held, -near.yields, 1.0)
        rows = value.rows_.copy()
        rates = np.flatnonzero(laws.rate_of >= 0)
        rows[rates, laws.rate_of[rates]] -= 1.0 / LAST_STEP
        right = -np.concatenate([value.rows, np.where(held, value.speed, tau - bound)])
        return np.vstack([rows, law]), right, given

    def _consistent(self, point: Trial, value: Values, tau: Array, given: Mask) -> bool:
        """Whether all modes hold at a solution of their equations."""
        laws = self.laws
        n, mode = point.x.size, point.m[laws.index]
        zone = REST * (1.0 + np.abs(value.speed_[:, :n]) @ np.abs(point.x))
        known = KNOWN * (1.0 + np.abs(tau).max(initial=0.0))
        contact = np.arange(laws.count) >= laws.frictions
        within = (tau >= np.minimum(value.lower, value.upper) - known) & (tau <= np.maximum(value.lower, value.upper) + known)
        still = np.abs(value.speed) <= zone
        holds = np.where(
            contact,
            np.where(mode == 1.0, within & still, value.speed >= -zone),
            np.where(mode == 0.0, within & still, np.where(mode == 2.0, value.upper - value.lower <= 1e-10, mode * value.speed >= -zone)),
        )
        terms = np.abs(value.g_[:, :n]) @ np.abs(point.x) + np.abs(value.g_[:, n:]) @ np.abs(tau)
        sign = 2.0 * point.m[self.switches] - 1.0
        rows = np.abs(value.rows) <= 1e-7 * (1.0 + np.abs(value.rows_[:, :n]) @ np.abs(point.x) + np.abs(value.rows_[:, n:]) @ np.abs(tau))
        return bool(holds.all() and (sign * value.g >= -REST * (1.0 + terms)).all() and rows.all())

    def _loose(self, point: Trial, value: Values, tau: Array, given: Mask) -> bool:
        """Whether an unknown or the torque of a law that slides is not determined."""
        return False

    def _answer(self, point: Trial, tau: Array) -> Answer | None:
        """The problem with bounds that bend; else one for each combination of their pieces."""
        answer = self.problem.solve(point, tau, 0.0, bends=True)
        if answer.tau is not None:
            return answer
        bending = self.problem.bending(self.laws.at(point, tau))
        if len(bending) > MOST_PIECES:
            return None
        for piece in product((0.0, 1.0), repeat=len(bending)):
            m = point.m.copy()
            m[[self.switches[k] for k in bending]] = piece
            held = replace(point, m=m)
            answer = self.problem.solve(held, tau, 0.0, bends=False)
            if answer.tau is None:
                continue
            at = self.laws.at(held, tau)
            g = at.g + at.g_slope @ (answer.tau - tau)
            size = REST * (1.0 + np.abs(at.g_slope) @ np.abs(answer.tau))
            if all((2.0 * v - 1.0) * g[k] >= -size[k] for k, v in zip(bending, piece, strict=True)):
                return replace(answer, modes={**answer.modes, **{self.switches[k]: v for k, v in zip(bending, piece, strict=True)}})
        return None


def _solved(matrix: Array, right: Array) -> NDArray[np.float64]:
    if not np.isfinite(matrix).all():
        return np.full(right.shape, np.nan)
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])
