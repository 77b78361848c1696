"""Operating points on many grid points: a semismooth Newton method from several starts, then from neighbours, then continuation.

The starts are the model's own, all movable laws sliding forward or backward, and the speeds at which a run would start. They do not
depend on other points, so whether a point has several solutions does not depend on the grid. A point that no start solves begins at the
solution of its nearest neighbour; the remaining points are solved by continuation. ``Between`` starts from known solutions instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from powertrain.dae.friction import BACKWARD, STUCK
from powertrain.dae.tolerances import SAME
from powertrain.equilibrium.beginnings import beginnings
from powertrain.equilibrium.continuation import Continuation, relaxed
from powertrain.equilibrium.corrector import (
    Responses,
    adrift,
    corrected,
    responses,
    saddles,
    self_locking,
    shared_with_inputs,
    undetermined,
)
from powertrain.equilibrium.laws import SteadyLaws
from powertrain.equilibrium.points import AtRest, Index, Iterates, Mask, SolvedPoints
from powertrain.equilibrium.system import Balance
from powertrain.language.reals import Array

SPEEDS = (0.0, 10.0, -10.0, 100.0, -100.0)
"""Sliding speeds of laws at the starts, in rad/s or m/s."""
MOST_SOURCES = 8
"""Neighbours whose solutions are tried at a point as they become available."""
OTHERS = 4
"""Neighbours of a point that are tried besides the nearest one."""
_OPEN = 2.0
"""Marks a law that does not rest."""


@dataclass(frozen=True)
class Best:
    """One solution per point, where there are ``several``, the laws at rest under a given motion, and those whose modes differ.

    ``apart``: points with solutions in the same modes, at other values of the unknowns.
    """

    solved: SolvedPoints
    several: Mask
    rest: Mask
    differing: Mask
    apart: Mask


class Solutions:
    """Solves one steady problem at many points. Serves one thread.

    Solutions beyond a limit of the model (``within`` is False) are used only if there are no others.
    """

    def __init__(self, laws: SteadyLaws, within: Callable[[Array, SolvedPoints], Mask]) -> None:
        self.laws, self.within = laws, within

    @cached_property
    def _continuation(self) -> Continuation:
        """For the points at which Newton's method fails; most maps have none."""
        return Continuation(self.laws)

    def solve(self, grid: Array, side: Array) -> Best:
        """The points of ``grid``, one per row; ``side`` as in ``AtRest``."""
        laws, count = self.laws, len(grid)
        several, apart = np.zeros(count, bool), np.zeros(count, bool)
        differing = np.zeros((laws.balance.modes.numel(), count), bool).T
        start = beginnings(laws, grid, side)
        best, beyond, begun = self._nothing(start.rest), self._nothing(start.rest), list[tuple[Array, Mask]]()
        speeds = SPEEDS if start.sliding.any() else SPEEDS[:1]
        starts = [start.start + speed * start.sliding for speed in speeds]
        for first in starts if np.array_equal(start.initial, start.start) else [*starts, start.initial]:
            modes, found = self._from(first, grid, start.rest, begun, again=first is start.initial)
            self._leave(found, beyond, grid)
            begun.append((modes, found.done & (found.modes == modes).all(axis=1)))
            new, both = found.done & ~best.done, np.flatnonzero(best.done & found.done)
            if both.size:
                other = both[self._differ(grid[both], best.some(both), found.some(both))]
                one, two = best.some(other), found.some(other)
                changed = one.modes != two.modes
                several[other] = True
                differing[other] |= changed
                apart[other] |= ~changed.any(axis=1)
                new[other] = self._rank(two) < self._rank(one)
            best.take(new, found)
        if not laws.count:
            self._relax(best, start.start, grid, start.rest)
        self._rest_of(best, grid, side)
        best.take(beyond.done & ~best.done, beyond)
        known = np.flatnonzero(best.done)
        at, rest = best.at(grid).some(known), best.at_rest(side).some(known)
        change = responses(laws, at, rest)
        several[known[undetermined(laws, at, change)]] = True
        shared = shared_with_inputs(laws, at, rest)
        if shared.any():
            several[known] |= shared.any(axis=1)
            differing[np.ix_(known, laws.law_modes)] |= shared
        for sides, locks in self_locking(laws, at, rest, change):
            others = known[locks]
            driven = best.some(others).at(grid[others])
            driven.modes[:, sides] = 1.0 - driven.modes[:, sides]
            also = others[self._another(best.some(others), driven, side[others])]
            several[also] = True
            differing[np.ix_(also, sides)] = True
        for moved, loose, free in adrift(laws, at, rest, change):
            several[known[free]] = True
            held = loose & ~several[known]
            several[known[held]] = self._another(best.some(known[held]), moved.some(held), side[known[held]])
        several[known[self._beside_saddles(best, known, at, rest, change)]] = True
        singular = known[change.singular]
        best.done[singular[~several[singular]]] = False
        resting = np.zeros_like(best.given)
        if rest.given.any():
            after = laws.next_modes(at, rest)
            resting[known] = rest.given & after.still & after.open
        return Best(best, several, resting, differing, apart)

    def _beside_saddles(self, best: SolvedPoints, known: Index, at: Iterates, rest: AtRest, change: Responses) -> Mask:
        """Which of the ``known`` points have another solution, where motions lead away from theirs on both sides."""
        other = np.zeros(known.size, bool)
        if not self.laws.rates.size or not known.size:
            return other
        grows, direction = saddles(self.laws, change)
        some = np.flatnonzero(grows)
        one, resting, found = at.some(some), rest.some(some), best.some(known[some])
        for sign in (1.0, -1.0) if some.size else ():
            begin = relaxed(self.laws, replace(one, y=one.y + sign * direction[some]), resting)
            other[some] |= self._another(found, begin, resting.side)
        return other

    def _another(self, found: SolvedPoints, begin: Iterates, side: Array) -> Mask:
        """Whether the search from ``begin`` leads to other solutions than those found."""
        if not len(begin.y):
            return np.zeros(0, bool)
        end, good = corrected(self.laws, begin, found.at_rest(side))
        other = replace(found, y=end.y, modes=end.modes, tau=end.tau)
        good &= self._differ(begin.grid, found, other)
        good[good] = self.within(begin.grid[good], other.some(good))
        return good

    def _nothing(self, rest: AtRest) -> SolvedPoints:
        laws, count = self.laws, len(rest.given)
        sizes = laws.unknowns, laws.balance.modes.numel(), laws.count
        y, modes, tau = (np.zeros((n, count)).T for n in sizes)
        given, yields = rest.given.copy(order="K"), rest.yields.copy(order="K")
        return SolvedPoints(np.zeros(count, bool), y, modes, tau, given, yields)

    def _from(
        self, first: Array, grid: Array, rest: AtRest, begun: list[tuple[Array, Mask]], again: bool
    ) -> tuple[Array, SolvedPoints]:
        """The modes implied by the speeds of a start, and the solutions from it; none at points where another start had these modes.

        ``begun`` are the modes of earlier starts, and whether a solution has them. With ``again`` only such starts count.
        """
        laws, count = self.laws, len(grid)
        found = self._nothing(rest)
        found.y += first
        modes = laws.next_modes(found.at(grid), rest).modes
        seen = np.zeros(count, bool)
        for other, held in begun:
            seen |= (modes == other).all(axis=1) & (held | (not again))
        new = np.flatnonzero(~seen)
        found.modes[:] = modes
        end, found.done[new] = corrected(laws, found.at(grid).some(new), rest.some(new))
        found.y[new], found.modes[new], found.tau[new] = end.y, end.modes, end.tau
        return modes, found

    def _leave(self, found: SolvedPoints, beyond: SolvedPoints, grid: Array) -> None:
        """Move solutions beyond a limit of the model from ``found`` to ``beyond``."""
        out = found.done & ~self.within(grid, found)
        beyond.take(out, found)
        found.done[out] = False

    def _relax(self, best: SolvedPoints, first: Array, grid: Array, rest: AtRest) -> None:
        """Solve remaining points by following their motion until it comes to rest."""
        left = np.flatnonzero(~best.done)
        if not left.size:
            return
        begin, rest = replace(best.at(grid), y=first).some(left), rest.some(left)
        end, good = corrected(self.laws, relaxed(self.laws, begin, rest), rest)
        done = left[good]
        best.done[done], best.y[done], best.modes[done] = True, end.y[good], end.modes[good]

    def _rest_of(self, best: SolvedPoints, grid: Array, side: Array) -> None:
        """Solve remaining points from their neighbours, else by continuation."""
        if best.done.all():
            return
        failed, tries, rank = np.zeros(len(grid), bool), np.zeros(len(grid), int), np.ones(len(grid), int)
        place, fresh = _scaled(grid), np.flatnonzero(best.done)
        while True:
            while fresh.size:
                left = np.flatnonzero(~best.done & ~failed & (tries < MOST_SOURCES))
                if not left.size:
                    break
                fresh = self._spread(best, grid, side, left, fresh[KDTree(place[fresh]).query(place[left])[1]])
                tries[left] += 1
            known, left = np.flatnonzero(best.done), np.flatnonzero(~best.done & ~failed)
            if not left.size:
                return
            again = left[rank[left] <= min(OTHERS, known.size - 1)]
            if again.size:
                near = np.asarray(KDTree(place[known]).query(place[again], k=OTHERS + 1)[1])
                fresh = self._spread(best, grid, side, again, known[near[np.arange(again.size), rank[again]]])
                rank[again] += 1
                continue
            p = left[:1]
            one = self._continuation.solve(grid[p], side[p], partial(self.within, grid[p]))
            if one is None:
                failed[p] = True
            else:
                best.put(p, one)
                fresh = p

    def _spread(self, found: SolvedPoints, grid: Array, side: Array, left: Index, sources: Index) -> Index:
        """Start at points from the solutions of others; return the points that now have one."""
        some = found.some(sources)
        end, good = corrected(self.laws, some.at(grid[left]), some.at_rest(side[left]))
        some.y[:], some.modes[:], some.tau[:] = end.y, end.modes, end.tau
        good[good] = self.within(grid[left[good]], some.some(good))
        found.put(left[good], some.some(good))
        return left[good]

    def _differ(self, grid: Array, one: SolvedPoints, other: SolvedPoints) -> Mask:
        """Whether two solutions differ in unknowns, or in the torque of a law that slides in one of them."""
        rest = np.ones_like(one.tau)
        slides = ~np.logical_and(*(self.laws.next_modes(p.at(grid), p.at_rest(rest)).still for p in (one, other)))
        y = np.abs(one.y - other.y) > SAME * (1.0 + np.abs(one.y))
        large = 1.0 + np.abs(one.tau).max(axis=1, initial=0.0)
        tau = slides & (np.abs(one.tau - other.tau) > SAME * large[:, None])
        return np.asarray(y.any(axis=1) | tau.any(axis=1))

    def _rank(self, found: SolvedPoints) -> NDArray[np.intp]:
        """Preference: laws at rest before sliding laws, forward before backward."""
        modes = found.modes[:, : self.laws.frictions]
        rank: NDArray[np.intp] = 2 * (modes != STUCK).sum(axis=1) + (modes == BACKWARD).any(axis=1)
        return rank


def _scaled(grid: Array) -> Array:
    """The points with every axis scaled to 0 to 1."""
    low, high = grid.min(axis=0, initial=np.inf), grid.max(axis=0, initial=-np.inf)
    with np.errstate(all="ignore"):
        scaled = (grid - low) / np.where(high > low, high - low, 1.0)
    return np.asarray(np.nan_to_num(scaled, posinf=1.0, neginf=0.0))


class Between:
    """Points with the torque of a law between its limits, for laws at rest under a prescribed motion. Serves one thread.

    Equilibrium does not determine such a torque. It is prescribed as a fraction between the limits: both limits of the law are set to it,
    and all else is solved for as at any point. If the law moves what a sought input holds, the model computes its torque from that input,
    as of any stuck law; with two such laws between their limits, it would share their torque by compliance, which is not the solution.
    """

    def __init__(self, balance: Balance) -> None:
        share = ca.SX.sym("share", balance.tau.numel())
        inside, part = ca.fabs(share) <= 1.0, (1.0 + share) / 2.0
        mixed = balance.lower + part * (balance.upper - balance.lower)
        lower, upper = (ca.if_else(inside, mixed, bound) for bound in (balance.lower, balance.upper))
        self.laws = SteadyLaws(replace(balance, grid=ca.vertcat(balance.grid, share), lower=lower, upper=upper))
        dae = balance.dae
        self._placed = np.array([f.prescribed for f in dae.frictions] + [False] * len(dae.contacts), bool)

    def solve(self, grid: Array, side: Array, resting: Mask, near: SolvedPoints) -> SolvedPoints:
        """The points of ``grid`` from solved ones nearby; ``resting`` laws are at ``side``, where -1 and 1 are the limits."""
        laws, share = self.laws, np.where(resting, side, _OPEN)
        end, done = corrected(laws, near.at(np.hstack([grid, share])), near.at_rest(np.ones_like(side)))
        modes = end.modes.copy()
        follows = resting & ~self._placed & (np.abs(side) < 1.0)
        modes[:, laws.law_modes] = np.where(follows, STUCK, np.where(resting, side, modes[:, laws.law_modes]))
        done &= follows.sum(axis=1) <= 1
        return SolvedPoints(done, end.y, modes, end.tau, near.given, near.yields)
