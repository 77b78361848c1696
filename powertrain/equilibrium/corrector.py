"""Newton's method for given modes at many points, in unknowns and torques together, repeated until the modes hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from powertrain.dae.contact import OPEN
from powertrain.dae.friction import BACKWARD, FORWARD, FREE
from powertrain.dae.tolerances import LOCKED, NEUTRAL, SAME, STILL, balance_tolerance
from powertrain.equilibrium.laws import NextModes, SteadyLaws
from powertrain.equilibrium.points import AtRest, Index, Iterates, Mask, taken
from powertrain.language.reals import Array
from powertrain.numerics.newton import HALVINGS, newton, relative

CORRECTIONS, PROXIMAL = 20, 3
"""Full steps for given modes with the compliance of stuck laws, and steps after them that remove the creep."""
DAMPED = 40
"""Damped steps if full ones fail, for instance because a torque saturates."""
TOGETHER = 64
"""Halved steps in one evaluation: for a few points it takes no longer than for one."""
NOTHING = 1e-9
"""Share of the time of the slowest motion below which the time of another one is round-off."""
SHIFTED = 1e-4
"""Torque that laws pass to each other, relative to one plus the largest torque: far above its uncertainty."""
UNMET = 1e-3
"""Part of a unit change of an equation that is left where the matrix is singular and its least-squares solution takes the place."""
CHANGES = 8
"""Changes of modes after which starting from a neighbour's modes is abandoned."""


def corrected(laws: SteadyLaws, at: Iterates, rest: AtRest, lossless: bool = False) -> tuple[Iterates, Mask]:
    """The points with unknowns and torques for their modes, or for modes that follow from these, and whether each is a solution."""
    active, here, before, done = np.arange(len(at.y)), at, None, np.zeros(len(at.y), bool)
    y, modes, tau = at.y, at.modes, at.tau
    for _ in range(CHANGES):
        begun, n = here, len(active)
        here, fine = _newton(laws, begun, rest, lossless, CORRECTIONS, 0)
        if not fine.all():
            some = np.flatnonzero(~fine)
            end, found = _newton(laws, begun.some(some), rest.some(some), lossless, DAMPED, HALVINGS)
            here.y[some[found]], here.tau[some[found]], fine[some[found]] = end.y[found], end.tau[found], True
        after = _shared(laws, here, rest, lossless)
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
        following = np.where(go[:, None], new, begun.modes)
        if n == len(y):  # a copy would take a noticeable share of the time
            y, modes, tau = here.y, following, here.tau
        else:
            y[active], modes[active], tau[active] = here.y, following, here.tau
        if not left.size:
            break
        active, before, rest = active[left], taken(now, left), rest.some(left)
        here = Iterates(begun.grid, here.y, new, here.tau).some(left)
    return Iterates(at.grid, y, modes, tau), done


def _shared(laws: SteadyLaws, at: Iterates, rest: AtRest, lossless: bool) -> NextModes:
    """The next modes. Stuck laws in ``at`` get the torques that their compliance gives them.

    This matters only if several laws are stuck, or if one is stuck and another slides at rest.
    """
    n, after = laws.unknowns, laws.next_modes(at, rest, lossless=lossless)
    stuck = (at.modes[:, laws.law_modes] == laws.holding) & ~rest.given
    slides = laws.may_free & _slides(laws, at) & after.still
    several = (stuck.sum(axis=1) > 1) | (stuck.any(axis=1) & slides.any(axis=1))
    some = np.flatnonzero(several & np.isfinite(at.y).all(axis=1))
    if not some.size:
        return after
    here, rest = at.some(some), rest.some(some)
    motion = laws.motion(here)
    entries, left = laws.equations(laws.fixed(here, rest, lossless), here.z)
    left[:, n:] -= stuck[some] * rest.yields * here.tau
    step = laws.pattern.solver(entries)(-left)
    tau = here.tau + step[:, n:]
    creep = motion.speed + np.einsum("pij,pj->pi", motion.speed_, step)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = creep / rest.yields  # infinite without compliance
    end, _ = _newton(laws, Iterates(here.grid, here.y, here.modes, tau), rest, lossless, PROXIMAL, 0)
    at.y[some], at.tau[some] = end.y, end.tau
    after.put(some, laws.next_modes(end, rest, share, lossless))
    return after


def _newton(
    laws: SteadyLaws, at: Iterates, rest: AtRest, lossless: bool, most: int, halvings: int
) -> tuple[Iterates, Mask]:
    """Newton steps for the modes at all points, and where they converged; stuck laws are compliant to their own torques."""
    n, fixed, every = laws.unknowns, laws.fixed(at, rest, lossless), np.arange(len(at.y))
    if not halvings and laws.abreast is not None:
        z, fine = laws.abreast(fixed, at.z, laws.balance.common.values, still=STILL, most=most)
        return Iterates(at.grid, z[:, :n], at.modes, z[:, n:]), fine

    def equations(which: Index, z: Array) -> tuple[Array, Array]:
        return laws.equations(fixed if np.array_equal(which, every) else [row.take(which) for row in fixed], z)

    def sizes(z: Array) -> Array:
        size = relative(z)
        size[:, n:] = size[:, n:].max(axis=1, keepdims=True, initial=1.0)
        return size

    z, fine = newton(
        equations,
        at.z,
        still=STILL,
        most=most,
        halvings=halvings,
        sizes=sizes,
        factors=laws.pattern.solver,
        together=TOGETHER,
    )
    return Iterates(at.grid, z[:, :n], at.modes, z[:, n:]), fine


@dataclass(frozen=True)
class Responses:
    """Changes of unknowns and torques at solutions (point, unknown, cause).

    The causes: a unit change of each of the ``rates``; changes of the ``limits`` of all sliding laws, together, (point, unknown); a unit
    change of the limit of each law in ``laws.driving``. ``singular``: points at which no change of the unknowns has such causes.
    """

    rates: Array
    limits: Array
    driving: Array
    singular: Mask


def responses(laws: SteadyLaws, at: Iterates, rest: AtRest) -> Responses:
    """The responses at solutions, by one elimination for all causes."""
    n, moves, driving = laws.unknowns, laws.rates.size, len(laws.driving)
    entries, value = laws.equations(laws.fixed(at, rest), at.z)
    right = np.zeros((moves + 1 + driving, n + laws.count, len(value))).T
    right[:, laws.rates, np.arange(moves)] = 1.0
    # equal values would hide torques that grow against each other
    right[:, n:, moves] = _slides(laws, at) * np.linspace(1.0, 2.0, laws.count)
    right[:, n + np.array(list(laws.driving), np.intp), moves + 1 + np.arange(driving)] = 1.0
    change = laws.pattern.solver(entries)(right)
    weights = np.linspace(1.0, 2.0, right.shape[2])  # all causes together; equal ones might cancel
    with np.errstate(all="ignore"):
        left = laws.pattern.product(entries, change @ weights) - right @ weights
    singular = np.asarray((np.abs(left) > UNMET).any(axis=1))
    return Responses(change[:, :, :moves], change[:, :, moves], change[:, :, moves + 1 :], singular)


def _slides(laws: SteadyLaws, at: Iterates) -> Mask:
    mode = at.modes[:, laws.law_modes]
    return np.asarray(~laws.contact & ((mode == FORWARD) | (mode == BACKWARD)))


def undetermined(laws: SteadyLaws, at: Iterates, change: Responses) -> Mask:
    """Points at which the torque of a sliding law is not determined: unit changes of the limits move it without bound."""
    return np.asarray((_slides(laws, at) & (np.abs(change.limits[:, laws.unknowns :]) > LOCKED)).any(axis=1))


def shared_with_inputs(laws: SteadyLaws, at: Iterates, rest: AtRest) -> Mask:
    """The laws (point, law) at rest whose torque an input or parameter that is sought may take over, within the limits of all laws.

    Laws that hold one motion share its torque by compliance. A change of their creep then shifts torque among them. If that moves what is
    sought, the model has a solution for each of its values: on the synchronous shafts of two clutches, a motor may relieve both.
    """
    n, found = laws.unknowns, np.zeros(at.tau.shape, bool)
    if not laws.sought.size:
        return found
    mode = at.modes[:, laws.law_modes]
    sharing = (rest.yields > 0.0) & ~rest.given & (mode != FREE)
    held = sharing & (mode == laws.holding)
    some = np.flatnonzero((sharing.sum(axis=1) > 1) & held.any(axis=1))
    if not some.size:
        return found
    at, rest = at.some(some), rest.some(some)
    after = laws.next_modes(at, rest)
    modes, mode = at.modes.copy(order="K"), mode[some]
    stuck = np.where(laws.contact, mode == laws.holding, after.still & after.open) & ~rest.given
    modes[:, laws.law_modes] = np.where(stuck, laws.holding, mode)
    here, yields = replace(at, modes=modes), np.where(stuck, rest.yields, 0.0)
    factors = laws.pattern.solver(laws.equations(laws.fixed(here, rest), here.z)[0])
    shift = np.zeros((len(some), n + laws.count, laws.count))
    shift[:, n:] = np.eye(laws.count)
    for _ in range(2):  # the second time without the creep
        shift[:, :n] = 0.0
        shift[:, n:] *= -yields[:, :, None]
        shift = factors(shift)
    size = SHIFTED * (1.0 + np.abs(at.tau).max(axis=1))
    for law, sign in product(range(laws.count), (1.0, -1.0)):
        step = shift[:, :, law] * (sign * size / np.abs(shift[:, n:, law]).max(axis=1))[:, None]
        moved = np.abs(step[:, laws.sought]) > SAME * (1.0 + np.abs(at.y[:, laws.sought]))
        there = replace(here, y=at.y + step[:, :n], tau=at.tau + step[:, n:])
        after = laws.next_modes(there, rest)
        other = moved.any(axis=1) & after.balanced & (after.modes == modes).all(axis=1)
        found[some] |= other[:, None] & (np.abs(step[:, n:]) > SAME * size[:, None])
    return found


def adrift(laws: SteadyLaws, at: Iterates, rest: AtRest, change: Responses) -> Iterator[tuple[Iterates, Mask, Mask]]:
    """For every motion: the points moved along it, where its slope does not hold it, and where nothing holds it.

    The slope holds a motion if a constant rate moves it by less than a million seconds' worth: it takes that long to come to rest, in any
    unit. Else other terms may: the drag of air has no slope at rest. Nothing holds it if the equations are zero at the moved point, too.
    Laws at rest at a limit of their torque hold nothing in one direction, such as a freewheel without a load, those between equal limits in
    neither, such as those of unloaded meshes. Here they slide.
    """
    if not laws.rates.size or not len(at.y):
        return
    moved = replace(at, modes=_at_limits(laws, at, rest))
    idle = (moved.modes != at.modes)[:, laws.law_modes]
    if idle.any():
        change = responses(laws, moved, rest)
    for rate, unknown in enumerate(laws.rated):
        drift = np.abs(change.rates[:, unknown, rate])
        loose = drift > NEUTRAL
        for sign in (1.0, -1.0) if loose.any() else ():
            with np.errstate(all="ignore"):
                move = sign * change.rates[:, :, rate] / drift[:, None]
            there = replace(moved, y=at.y + move[:, : laws.unknowns], tau=at.tau + move[:, laws.unknowns :])
            after = laws.next_modes(replace(there, modes=at.modes), rest)
            against = idle & after.open & ~after.still & (after.modes != moved.modes)[:, laws.law_modes]
            yield replace(there, modes=after.modes), loose, loose & after.balanced & ~against.any(axis=1)


def _at_limits(laws: SteadyLaws, at: Iterates, rest: AtRest) -> Array:
    """The modes at solutions, but laws that are at rest at a limit of their torque slide."""
    modes, mode = at.modes.copy(order="K"), at.modes[:, laws.law_modes]
    held = (mode == laws.holding) & ~rest.given
    known = balance_tolerance(np.abs(at.tau).max(axis=1, initial=0.0))[:, None]
    for direction in (BACKWARD, FORWARD) if held.any() else ():
        loose = replace(at, modes=at.modes.copy(order="K"))
        loose.modes[:, laws.law_modes] = np.where(held, np.where(laws.contact, OPEN, direction), mode)
        _, beyond = laws.equations(laws.fixed(loose, rest), at.z)
        reached = held & (np.abs(beyond[:, laws.unknowns :]) <= known)
        modes[:, laws.law_modes] = np.where(reached, loose.modes[:, laws.law_modes], modes[:, laws.law_modes])
    return modes


def saddles(laws: SteadyLaws, change: Responses) -> tuple[Mask, Array]:
    """The points that motions leave on two opposite sides, and the direction of such a motion; its largest part is one.

    A motion that grows is an eigenvector, with a positive eigenvalue, of the change of the unknowns by their rates. If the number of these
    motions is odd, a determinant has the other sign; then each side leads to another equilibrium, or to a motion without end.
    """
    moved = np.nan_to_num(change.rates[:, : laws.unknowns])
    inverse, direction = moved[:, laws.rated], np.zeros(moved.shape[:2])
    with np.errstate(all="ignore"):
        odd = np.flatnonzero(np.linalg.det(-inverse) < 0.0)
    direction[odd] = (moved[odd] @ _growing(inverse[odd])[:, :, None])[:, :, 0]
    size = np.abs(direction).max(axis=1, keepdims=True, initial=0.0)
    return size[:, 0] > 0.0, direction / np.where(size > 0.0, size, 1.0)


def _growing(inverse: Array) -> Array:
    """For the inverse of each matrix, the eigenvector of its greatest positive eigenvalue; zero if there is none but for round-off."""
    values, vectors = np.linalg.eig(inverse)
    times, real = np.abs(values), np.real(values) > NOTHING * np.abs(values).max(axis=1, keepdims=True, initial=0.0)
    real &= np.abs(np.imag(values)) <= NOTHING * times
    fastest = np.where(real, times, np.inf).argmin(axis=1)
    found = np.take_along_axis(np.real(vectors), fastest[:, None, None], axis=2)[:, :, 0]
    return np.asarray(np.where(real.any(axis=1)[:, None], found, 0.0))


def self_locking(laws: SteadyLaws, at: Iterates, rest: AtRest, change: Responses) -> list[tuple[Index, Mask]]:
    """Modes that tell which side drives, and the points at which the determinant of the equations has another sign with the other side.

    Where the sides change, the equations are continuous. If the determinants have opposite signs, as in a self-locking gear, both sides
    balance the same loads: there are two solutions or none. Each law is tried alone, and all together, as in a train that is self-locking
    as a whole. Only the rows of these laws differ, so a determinant over the present one is that of the new rows times the inverse.
    """
    if not laws.driving or not len(at.y):
        return []
    sides, rows = list(laws.driving.values()), laws.unknowns + np.array(list(laws.driving))
    every = np.unique(np.concatenate(sides))
    other = replace(at, modes=at.modes.copy(order="K"))
    other.modes[:, every] = 1.0 - other.modes[:, every]
    new, _ = laws.equations(laws.fixed(other, rest), at.z)
    ratios = np.zeros((rows.size, rows.size, len(at.y))).T
    for k, row in enumerate(rows):
        here = laws.pattern.rows == row
        ratios[:, k] = np.einsum("pc,pcj->pj", new[:, here], change.driving[:, laws.pattern.columns[here]])
    with np.errstate(all="ignore"):
        alone = [(side, ratios[:, k, k] < 0.0) for k, side in enumerate(sides)]
        return alone if len(sides) == 1 else [*alone, (every, np.linalg.det(ratios) < 0.0)]
