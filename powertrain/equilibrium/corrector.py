"""Newton's method for given modes at many points, in unknowns and torques together, and the modes corrected until they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.laws import BACKWARD, FORWARD, FREE, STUCK, Iterates, LawValues, Mask, SteadyLaws
from powertrain.numerics.buffers import Array

LAST_STEP = 1e7
"""Seconds: a step of this length holds what nothing else does."""
STILL = 1e-10
"""Unknowns that change by less, relative to one and to their size, are found."""
CORRECTIONS, PROXIMAL = 20, 3
"""Newton's steps for given modes, with the compliance of stuck laws, and those after them, which take the creep away."""
DAMPED, HALVINGS = 40, 16
"""Shortened steps of Newton's method, and how often each is halved."""
NEUTRAL = 1e6
"""Seconds: a motion that takes longer to come to rest is not held by anything."""
LOCKED = 1e9
"""Torques that change by more than this for a unit change of a limit depend on round-off: the laws lock themselves."""
CHANGES = 8
"""Changes of modes after which the modes of a neighbour are no help."""


@dataclass(frozen=True)
class Near:
    """What a solved point tells its neighbours: laws that their own torque does not move, and how much the others yield."""

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
        here, fine = _newton(laws, begun, there, side[active], lossless, CORRECTIONS)
        if not fine.all():
            some = np.flatnonzero(~fine)
            end, found = _damped(laws, begun.some(some), there.some(some), side[active][some], lossless)
            here.y[some[found]], here.tau[some[found]], fine[some[found]] = end.y[found], end.tau[found], True
        here, drive = _shared(laws, here, there, side[active], lossless)
        value = laws.values(here, lossless)
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


def _shared(laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool) -> tuple[Iterates, Array]:
    """Solutions with the torques that the compliance of stuck laws gives them, and what then drives each law against its own."""
    n, tau, drive = laws.unknowns, at.tau.copy(), np.zeros_like(at.tau)
    stuck = (at.modes[:, laws.law_modes] == np.where(laws.contact, 1.0, STUCK)) & ~near.given
    some = np.flatnonzero(stuck.any(axis=1) & np.isfinite(at.y).all(axis=1))
    if laws.count < 2 or not some.size:
        return at, drive
    here, there = at.some(some), Near(near.given[some], near.yields[some])
    value = laws.values(here, lossless)
    step = solved(*_bordered(laws, here, value, there, side[some], False))
    tau[some] += step[:, n:]
    creep = value.speed + np.einsum("pij,pj->pi", value.speed_, step)
    drive[some] = creep - there.yields * tau[some]
    shared = Iterates(here.grid, here.y, here.modes, tau[some])
    end, _ = _newton(laws, shared, there, side[some], lossless, PROXIMAL)
    y, tau = at.y.copy(), at.tau.copy()
    y[some], tau[some] = end.y, end.tau
    return Iterates(at.grid, y, at.modes, tau), drive


def _newton(
    laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool, most: int
) -> tuple[Iterates, Mask]:
    """Newton's steps at all points, and where they became small; stuck laws yield to what their torque changes."""
    y, tau, n = at.y.copy(), at.tau.copy(), laws.unknowns
    fine, active = np.zeros(len(y), bool), np.arange(len(y))
    for _ in range(most):
        here = Iterates(at.grid[active], y[active], at.modes[active], tau[active])
        there = Near(near.given[active], near.yields[active])
        matrix, right = _bordered(laws, here, laws.values(here, lossless), there, side[active], True)
        step = solved(matrix, right)
        y[active] += step[:, :n]
        tau[active] += step[:, n:]
        large = 1.0 + np.abs(tau[active]).max(axis=1, initial=0.0)
        still = (np.abs(step[:, :n]) <= STILL * (1.0 + np.abs(y[active]))).all(axis=1)
        still &= (np.abs(step[:, n:]) <= STILL * large[:, None]).all(axis=1)
        fine[active] = still
        active = active[~still & np.isfinite(step).all(axis=1)]
        if not active.size:
            break
    return Iterates(at.grid, y, at.modes, tau), fine


def _damped(laws: SteadyLaws, at: Iterates, near: Near, side: Array, lossless: bool) -> tuple[Iterates, Mask]:
    """Newton's steps, each halved until it helps, and where they became small. Full steps go astray where a torque saturates.

    The natural monotonicity test of P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2011, 3.3: a step helps if the next one
    with the same matrix is shorter. If it is not half as long, it must not lead back either: beyond a saturation there is another one.
    """
    n, z = laws.unknowns, np.concatenate([at.y, at.tau], axis=1)
    fine, active = np.zeros(len(z), bool), np.flatnonzero(np.isfinite(z).all(axis=1))

    def equations(which: NDArray[np.intp], values: Array) -> tuple[Array, Array]:
        here = Iterates(at.grid[which], values[:, :n], at.modes[which], values[:, n:])
        return _bordered(laws, here, laws.values(here, lossless), near.some(which), side[which], True)

    for _ in range(DAMPED):
        matrix, right = equations(active, z[active])
        scale = 1.0 + np.abs(z[active])
        step = solved(matrix, right) / scale
        size = np.abs(step).max(axis=1, initial=0.0)
        fine[active], share = size <= STILL, np.ones(len(active))
        done = helps = fine[active] | ~np.isfinite(size)
        trial = z[active]
        for _ in range(HALVINGS):
            trial = z[active] + np.where(np.isfinite(step), share[:, None] * step, 0.0) * scale
            following = solved(matrix, equations(active, trial)[1]) / scale
            after = np.abs(following).max(axis=1, initial=0.0)
            ahead = (following * step).sum(axis=1) >= 0.0
            helps = done | (after <= 0.5 * size) | (ahead & (after <= (1 - share / 2) * size))
            if helps.all():
                break
            share = np.where(helps, share, share / 2)
        z[active] = trial
        active = active[~done & helps]
        if not active.size:
            break
    return Iterates(at.grid, z[:, :n], at.modes, z[:, n:]), fine


def undetermined(laws: SteadyLaws, at: Iterates, near: Near, side: Array) -> Mask:
    """Where an unknown, or the torque of a law that slides, is not determined.

    An unknown is not where its rate, changed by so much a second, moves it by a million times as much: it takes so many seconds to come to
    rest, in whatever unit it is. A torque is not where unit changes of the limits move it without limit.
    """
    n = laws.unknowns
    matrix, right = _bordered(laws, at, laws.values(at), near, side, True)
    right[:] = 0.0
    drifts = np.zeros(len(right), bool)
    for row, unknown in zip(laws.rates, laws.rate_of[laws.rates], strict=True):
        right[:, row] = 1.0
        drifts |= np.abs(solved(matrix, right)[:, unknown]) > NEUTRAL
        right[:, row] = 0.0
    mode = at.modes[:, laws.law_modes]
    slides = ~laws.contact & ((mode == FORWARD) | (mode == BACKWARD))
    right[:, n:] = slides * np.linspace(
        1.0, 2.0, laws.count
    )  # alike, they would hide torques that grow against each other
    torque = np.where(slides, solved(matrix, right)[:, n:], 0.0)
    return np.asarray(drifts | (np.abs(torque) > LOCKED).any(axis=1))


def _bordered(
    laws: SteadyLaws, at: Iterates, value: LawValues, near: Near, side: Array, proximal: bool
) -> tuple[Array, Array]:
    """Newton's equations in (y, tau): rows are zero, stuck laws at rest up to their compliance, sliding ones at their limit."""
    n, k, mode = laws.unknowns, np.arange(laws.count), at.modes[:, laws.law_modes]
    given, yields = near.given, near.yields
    mode = np.where(given & (mode == STUCK), side, mode)
    held = np.where(laws.contact, mode == 1.0, mode == STUCK) & ~given
    least = given & (mode == STUCK)
    upper = laws.contact | (mode == FORWARD) | (mode == FREE)
    bound = np.where(upper, value.upper, value.lower)
    slope = np.where(upper[..., None], value.upper_, value.lower_)
    zero = np.clip(0.0, np.minimum(value.lower, value.upper), np.maximum(value.lower, value.upper))
    bound, slope = np.where(least, zero, bound), np.where(least[..., None], 0.0, slope)
    bound, slope = np.where(held, 0.0, bound), np.where(held[..., None], value.speed_, -slope)
    slope[:, k, n + k] += np.where(held, -yields, 1.0)
    rows = value.rows_.copy()
    rows[:, laws.rates, laws.rate_of[laws.rates]] -= 1.0 / LAST_STEP
    right = np.concatenate(
        [value.rows, np.where(held, value.speed - (0.0 if proximal else yields * at.tau), at.tau - bound)], axis=1
    )
    return np.concatenate([rows, slope], axis=1), -right


def solved(matrix: Array, right: Array) -> Array:
    """The solutions of many small systems, with rows of size one; nan where there is none."""
    size = np.abs(matrix).max(axis=2, keepdims=True, initial=0.0)
    size[size == 0.0] = 1.0
    whole, given = matrix / size, right / size[..., 0]
    good = np.isfinite(whole).all(axis=(1, 2)) & np.isfinite(given).all(axis=1)
    whole[~good] = np.eye(whole.shape[1])
    try:
        found = np.linalg.solve(whole, given[..., None])[..., 0]
    except np.linalg.LinAlgError:
        found = np.array([_shortest(a, b) for a, b in zip(whole, given, strict=True)]).reshape(given.shape)
    found[~good] = np.nan
    return np.asarray(found)


def _shortest(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], dtype=np.float64)
