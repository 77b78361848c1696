"""Newton's method for given modes at many points, in unknowns and torques together, and the modes corrected until they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.laws import BACKWARD, FORWARD, STUCK, Iterates, LawValues, Mask, SteadyLaws
from powertrain.numerics.batch import Rows
from powertrain.numerics.buffers import Array
from powertrain.numerics.newton import HALVINGS, newton, relative

LAST_STEP = 1e7
"""Seconds: a step of this length holds what nothing else does."""
STILL = 1e-10
"""Unknowns that change by less, relative to one and to their size, are found."""
CORRECTIONS, PROXIMAL = 20, 3
"""Full steps for given modes, with the compliance of stuck laws, and those after them, which take the creep away."""
DAMPED = 40
"""Steps that are halved where full ones go astray, as they do where a torque saturates."""
TOGETHER = 64
"""Halved steps of one evaluation, which for few points takes no longer than for one."""
NEUTRAL = 1e6
"""Seconds: a motion that takes longer to come to rest is not held by anything."""
LOCKED = 1e9
"""Torques that change by more than this for a unit change of a limit depend on round-off: the laws lock themselves."""
CHANGES = 8
"""Changes of modes after which the modes of a neighbour are no help."""


@dataclass(frozen=True)
class Near:
    """What a solved point tells its neighbours: laws whose motion is given, and how much the others yield."""

    given: Mask
    yields: Array

    def some(self, which: NDArray[np.intp]) -> Near:
        """That of some of the points."""
        return Near(self.given[which], self.yields[which])


def corrected(
    laws: SteadyLaws,
    at: Iterates,
    near: Near,
    side: Array,
    lossless: bool = False,
    changes: int = 1,
    firm: bool = False,
) -> tuple[Iterates, Mask]:
    """The points with unknowns and torques for their modes, or for those that follow from these, and which of them are solutions.

    ``near`` and ``side`` have a row for each point.
    """
    done, y, modes, tau = np.zeros(len(at.y), bool), at.y.copy(), at.modes.copy(), at.tau.copy()
    active, before = np.arange(len(y)), np.full(modes.shape, np.nan)
    for _ in range(changes):
        here = Iterates(at.grid[active], y[active], modes[active], tau[active])
        there = Near(near.given[active], near.yields[active])
        begun = here
        here, fine = _solutions(laws, begun, there, side[active], lossless, CORRECTIONS, 0)
        if not fine.all():
            some = np.flatnonzero(~fine)
            end, found = _solutions(
                laws, begun.some(some), there.some(some), side[active][some], lossless, DAMPED, HALVINGS
            )
            here.y[some[found]], here.tau[some[found]], fine[some[found]] = end.y[found], end.tau[found], True
        value = laws.values(here, lossless)
        drive = _share(laws, here, there, side[active], lossless, value)
        y[active], tau[active] = here.y, here.tau
        new = laws.next_modes(here, value, there.given, side[active], drive if firm else None)
        if lossless:  # their direction makes no difference
            here.modes[:, laws.tied_modes] = new[:, laws.tied_modes] = np.where(
                value.speed[:, laws.tied] < 0.0, BACKWARD, FORWARD
            )
        same = (new == here.modes).all(axis=1)
        done[active] = same & fine & laws.balanced(here, value)
        go = ~same & np.isfinite(here.y).all(axis=1) & np.isfinite(here.tau).all(axis=1)
        go &= (new != before[active]).any(axis=1)  # in a circle
        before[active], active = here.modes, active[go]
        modes[active] = new[go] if changes > 1 else modes[active]
        if not active.size:
            break
    return Iterates(at.grid, y, modes, tau), done


def _share(laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool, value: LawValues) -> Array:
    """What drives each law against its own compliance. ``at`` and ``value`` take the torques that stuck laws have by theirs.

    That is asked only where it makes a difference: where several laws are stuck, or one is and another slides at rest.
    """
    n, drive, mode = laws.unknowns, np.zeros_like(at.tau), at.modes[:, laws.law_modes]
    stuck = (mode == np.where(laws.contact, 1.0, STUCK)) & ~near.given
    slides = laws.may_free & ((mode == FORWARD) | (mode == BACKWARD)) & (np.abs(value.speed) <= laws.zone(value, at))
    several = (stuck.sum(axis=1) > 1) | (stuck.any(axis=1) & slides.any(axis=1))
    some = np.flatnonzero(several & np.isfinite(at.y).all(axis=1))
    if not some.size:
        return drive
    here, there, near_value = at.some(some), near.some(some), value.some(some)
    entries, left = laws.equations(fixed(laws, here, there, side[some], lossless), here.z)
    left[:, n:] -= stuck[some] * there.yields * here.tau
    step = laws.equations.solver(entries)(-left)
    tau = here.tau + step[:, n:]
    creep = near_value.speed + np.einsum("pij,pj->pi", near_value.speed_, step)
    drive[some] = creep - there.yields * tau
    shared = Iterates(here.grid, here.y, here.modes, tau)
    end, _ = _solutions(laws, shared, there, side[some], lossless, PROXIMAL, 0)
    at.y[some], at.tau[some] = end.y, end.tau
    value.put(some, laws.values(end, lossless))
    return drive


def _solutions(
    laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool, most: int, halvings: int
) -> tuple[Iterates, Mask]:
    """Newton's steps for the modes at all points, and where they became small; stuck laws yield to what their torque changes."""
    n = laws.unknowns

    given, every = fixed(laws, at, near, side, lossless), np.arange(len(at.y))

    def equations(which: NDArray[np.intp], z: Array) -> tuple[Array, Array]:
        return laws.equations(given if np.array_equal(which, every) else given.take(which, axis=1), z)

    def sizes(z: Array) -> Array:
        size = relative(z)
        size[:, n:] = size[:, n:].max(axis=1, keepdims=True, initial=1.0)
        return size

    solver = laws.equations.solver
    z, fine = newton(
        equations, at.z, still=STILL, most=most, halvings=halvings, sizes=sizes, factors=solver, together=TOGETHER
    )
    return Iterates(at.grid, z[:, :n], at.modes, z[:, n:]), fine


def undetermined(laws: SteadyLaws, at: Iterates, near: Near, side: Array) -> Mask:
    """Where an unknown, or the torque of a law that slides, is not determined.

    An unknown is not where its rate, changed by so much a second, moves it by a million times as much: it takes so many seconds to come to
    rest, in whatever unit it is. A torque is not where unit changes of the limits move it without limit.
    """
    n = laws.unknowns
    entries, right = laws.equations(fixed(laws, at, near, side), at.z)
    solve, right = laws.equations.solver(entries), np.zeros_like(right)
    drifts = np.zeros(len(right), bool)
    for row, unknown in zip(laws.rates, laws.rate_of[laws.rates], strict=True):
        right[:, row] = 1.0
        drifts |= np.abs(solve(right)[:, unknown]) > NEUTRAL
        right[:, row] = 0.0
    mode = at.modes[:, laws.law_modes]
    slides = ~laws.contact & ((mode == FORWARD) | (mode == BACKWARD))
    right[:, n:] = slides * np.linspace(
        1.0, 2.0, laws.count
    )  # alike, they would hide torques that grow against each other
    torque = np.where(slides, solve(right)[:, n:], 0.0)
    return np.asarray(drifts | (np.abs(torque) > LOCKED).any(axis=1))


def fixed(
    laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool = False, length: float = LAST_STEP
) -> Rows:
    """What stays as it is while unknowns and torques are solved for: the first argument of ``laws.equations``."""
    kinds = laws.kinds(at, near.given, side, lossless)
    return laws.equations.given(at.grid, at.modes, kinds, near.yields, length)
