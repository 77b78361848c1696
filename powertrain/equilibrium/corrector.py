"""Newton's method for given modes at many points, in unknowns and torques together, repeated until the modes hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.laws import SteadyLaws
from powertrain.equilibrium.points import Iterates, Mask, taken
from powertrain.equilibrium.rules import NextModes
from powertrain.modes.friction import BACKWARD, FORWARD, STUCK
from powertrain.modes.tolerances import LOCKED, NEUTRAL, STILL
from powertrain.numerics.buffers import Array
from powertrain.numerics.newton import HALVINGS, newton, relative

LAST_STEP = 1e7
"""Step [s] that holds motions that nothing else holds."""
CORRECTIONS, PROXIMAL = 20, 3
"""Full steps for given modes with the compliance of stuck laws, and steps after them that remove the creep."""
DAMPED = 40
"""Damped steps if full ones fail, for instance because a torque saturates."""
TOGETHER = 64
"""Halved steps in one evaluation: for a few points it takes no longer than for one."""
CHANGES = 8
"""Changes of modes after which starting from a neighbour's modes is abandoned."""


@dataclass(frozen=True)
class Near:
    """What neighbours use of a solved point: the laws whose motion is given, and the compliances of the others."""

    given: Mask
    yields: Array

    def some(self, which: NDArray[np.intp]) -> Near:
        """The values of some of the points."""
        return Near(taken(self.given, which), taken(self.yields, which))


def corrected(
    laws: SteadyLaws,
    at: Iterates,
    near: Near,
    side: Array,
    lossless: bool = False,
    changes: int = 1,
    firm: bool = False,
) -> tuple[Iterates, Mask]:
    """The points with unknowns and torques for their modes, or for modes that follow from these, and whether each is a solution.

    ``near`` and ``side`` have one row per point.
    """
    active, here, before, done = np.arange(len(at.y)), at, None, np.zeros(len(at.y), bool)
    y, modes, tau = at.y, at.modes, at.tau
    for _ in range(changes):
        begun, n = here, len(active)
        here, fine = _solutions(laws, begun, near, side, lossless, CORRECTIONS, 0)
        if not fine.all():
            some = np.flatnonzero(~fine)
            end, found = _solutions(
                laws, begun.some(some), near.some(some), taken(side, some), lossless, DAMPED, HALVINGS
            )
            here.y[some[found]], here.tau[some[found]], fine[some[found]] = end.y[found], end.tau[found], True
        after = _shared(laws, here, near, side, lossless, firm)
        now, new = here.modes, after.modes
        if lossless:  # the direction of these laws makes no difference
            now = now.copy(order="K")
            now[:, laws.tied_modes] = new[:, laws.tied_modes]
        same = (new == now).all(axis=1)
        done[active] = same & fine & after.balanced
        go = ~same & np.isfinite(here.y).all(axis=1) & np.isfinite(here.tau).all(axis=1)
        if before is not None:
            go &= (new != before).any(axis=1)  # not cycling
        left = np.flatnonzero(go)
        following = np.where(go[:, None], new, begun.modes) if changes > 1 else begun.modes
        if n == len(y):
            y, modes, tau = here.y, following, here.tau
        else:
            y[active], modes[active], tau[active] = here.y, following, here.tau
        if not left.size:
            break
        active, before, near, side = active[left], taken(now, left), near.some(left), taken(side, left)
        here = Iterates(begun.grid, here.y, new, here.tau).some(left)
    return Iterates(at.grid, y, modes, tau), done


def _shared(laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool, firm: bool) -> NextModes:
    """The next modes. Stuck laws in ``at`` get the torques that their compliance gives them.

    This matters only if several laws are stuck, or if one is stuck and another slides at rest. ``firm``: a law that slides at rest against
    its rate sticks.
    """
    n, mode = laws.unknowns, at.modes[:, laws.law_modes]
    after = laws.next_modes(at, near.given, side, None, lossless)
    stuck = (mode == np.where(laws.contact, 1.0, STUCK)) & ~near.given
    slides = laws.may_free & ((mode == FORWARD) | (mode == BACKWARD)) & after.still
    several = (stuck.sum(axis=1) > 1) | (stuck.any(axis=1) & slides.any(axis=1))
    some = np.flatnonzero(several & np.isfinite(at.y).all(axis=1))
    if not some.size:
        return after
    side, here, there = taken(side, some), at.some(some), near.some(some)
    motion = laws.motion(here)
    entries, left = laws.equations(fixed(laws, here, there, side, lossless), here.z)
    left[:, n:] -= stuck[some] * there.yields * here.tau
    step = laws.equations.solver(entries)(-left)
    tau = here.tau + step[:, n:]
    creep = motion.speed + np.einsum("pij,pj->pi", motion.speed_, step)
    drive = creep - there.yields * tau if firm else None
    shared = Iterates(here.grid, here.y, here.modes, tau)
    end, _ = _solutions(laws, shared, there, side, lossless, PROXIMAL, 0)
    at.y[some], at.tau[some] = end.y, end.tau
    after.put(some, laws.next_modes(end, there.given, side, drive, lossless))
    return after


def _solutions(
    laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool, most: int, halvings: int
) -> tuple[Iterates, Mask]:
    """Newton steps for the modes at all points, and where they converged; stuck laws are compliant to their own torques."""
    n = laws.unknowns

    given, every = fixed(laws, at, near, side, lossless), np.arange(len(at.y))

    def equations(which: NDArray[np.intp], z: Array) -> tuple[Array, Array]:
        return laws.equations(given if np.array_equal(which, every) else [row.take(which) for row in given], z)

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
    """Points at which an unknown, or the torque of a sliding law, is not determined.

    An unknown is not determined if a change of its rate moves it by a million seconds' worth: it takes that long to come to rest, in
    any unit. A torque is not determined if unit changes of the limits move it without bound.
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
    )  # equal values would hide torques that grow against each other
    torque = np.where(slides, solve(right)[:, n:], 0.0)
    return np.asarray(drifts | (np.abs(torque) > LOCKED).any(axis=1))


def fixed(
    laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool = False, length: float = LAST_STEP
) -> list[Array]:
    """Everything constant while unknowns and torques are solved for: the first argument of ``laws.equations``."""
    kinds = laws.kinds(at, near.given, side, lossless)
    return laws.equations.given(at.grid, at.modes, kinds, near.yields, length)
