"""What one step of implicit Euler from the start of the unknowns says about each point, before its solution is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from powertrain.compiler.torques import COMPLIANCE
from powertrain.dae.tolerances import GIVEN
from powertrain.equilibrium.laws import Motion, SteadyLaws
from powertrain.equilibrium.points import AtRest, Index, Iterates, Mask, taken
from powertrain.language.reals import Array
from powertrain.numerics.newton import solved

SHORT_STEP = 0.1
"""Step [s] after which laws that hold each other share torques by compliance: too short for motions that nothing holds."""
UNSURE = 10.0
"""Mobilities below this multiple of their round-off are zero."""
SINGULAR = 1e14
"""Condition number above which equations do not determine their unknowns."""
DEPENDENT = 1e-12
"""Singular values of mobilities that are zero but for round-off, each law's own mobility scaled to one."""
PART = 1e-6
"""Components of their singular vectors that are not zero; a law with less has no noticeable share in what the others hold."""


@dataclass(frozen=True)
class Beginnings:
    """For each point: where the search starts, and what its laws do at rest.

    ``start`` is as guessed, ``initial`` as at the start of a run. ``sliding`` is the motion, as a change of the unknowns, that torques
    affect most, scaled so that laws slide at unit speed; zero if there is none.
    """

    start: Array
    initial: Array
    rest: AtRest
    sliding: Array


@dataclass(frozen=True)
class EulerStep:
    """The change of the unknowns in a step (point, unknown), its derivative by torques (point, unknown, law), and the round-off of that.

    ``degenerate``: points at which the equations do not determine the unknowns.
    """

    move: Array
    along: Array
    unsure: Array
    degenerate: Mask


def euler_step(laws: SteadyLaws, value: Motion, step: float) -> EulerStep:
    """A step of implicit Euler of ``step`` seconds.

    Where the equations do not determine the unknowns, it is the least-squares step of least length: elimination would let round-off
    choose the length. One step of iterative refinement corrects the solution, and its size shows the round-off in it.
    """
    n, matrix = laws.unknowns, value.rows_[:, :, : laws.unknowns].copy()
    matrix[:, laws.rates, laws.rated] -= 1.0 / step
    right = -np.concatenate([value.rows[:, :, None], value.rows_[:, :, n:]], axis=2)
    degenerate = _degenerate(matrix)
    some = np.flatnonzero(degenerate & np.isfinite(matrix).all(axis=(1, 2)))
    first = _solutions(matrix, right, some)
    correction = _solutions(matrix, right - matrix @ first, some)
    found = first + correction
    return EulerStep(found[:, :, 0], found[:, :, 1:], np.abs(correction[:, :, 1:]), degenerate)


def _solutions(matrix: Array, right: Array, degenerate: Index) -> Array:
    """The solution (point, unknown, side) for every right-hand side; the shortest least-squares solution at ``degenerate`` points."""
    found = solved(matrix, right)
    if degenerate.size:
        size = _row_sizes(matrix[degenerate])
        found[degenerate] = np.linalg.pinv(matrix[degenerate] / size, rcond=1.0 / SINGULAR) @ (right[degenerate] / size)
    return found


def _row_sizes(matrix: Array) -> Array:
    size = np.abs(matrix).max(axis=2, keepdims=True, initial=0.0)
    return np.where(size > 0.0, size, 1.0)


def _degenerate(matrix: Array) -> Mask:
    """Which equations do not determine their unknowns."""
    if not matrix.shape[1]:
        return np.zeros(len(matrix), bool)
    good = np.isfinite(matrix).all(axis=(1, 2)) & (np.abs(matrix).max(axis=2) > 0.0).all(axis=1)
    found: Mask = np.logical_not(good)
    level = matrix / _row_sizes(matrix)
    unsure = np.flatnonzero(good & (_condition_bound(level) > SINGULAR))
    if unsure.size:
        found[unsure] = np.linalg.cond(level[unsure]) > SINGULAR
    return found


def _condition_bound(matrix: Array) -> Array:
    """An upper bound of the condition numbers, by determinants: 2/|det A| (|A|_F^2/n)^(n/2).

    H. W. Guggenheimer, A. S. Edelman, C. R. Johnson, A simple estimate of the condition number of a linear system, College Mathematics
    Journal 26 (1995) 2.
    """
    n = matrix.shape[1]
    with np.errstate(all="ignore"):
        return np.asarray(2.0 / np.abs(np.linalg.det(matrix)) * ((matrix**2).sum(axis=(1, 2)) / n) ** (n / 2))


def mobilities(value: Motion, step: EulerStep) -> tuple[Mask, Array, Array]:
    """Laws whose motion is given, the compliances of the others, and the change of all speeds with all torques.

    A motion is given if the law's own torque does not move it. A free unknown may absorb the effect of a torque, however: if the load that
    keeps the input of an open gearset at its speed is free, a brake does not move the shaft that it holds. If its torque moves other laws,
    and theirs move it, all of them are determined together; its compliance is relative to the largest of these mobilities.
    """
    n = step.along.shape[1]
    direct, through = value.speed_[:, :, n:], value.speed_[:, :, :n]
    slope = direct + through @ step.along
    terms = np.abs(direct) + np.abs(through) @ np.abs(step.along)
    nothing = np.abs(slope) <= GIVEN * terms + UNSURE * np.abs(through) @ step.unsure
    size = np.where(nothing, 0.0, np.abs(slope))
    own, moved, moves = (
        np.diagonal(size, axis1=1, axis2=2),
        size.max(axis=2, initial=0.0),
        size.max(axis=1, initial=0.0),
    )
    given = (own == 0.0) & ((moved == 0.0) | (moves == 0.0))
    return given, np.where(given, 1.0, np.where(own > 0.0, own, moved)), slope


def beginnings(laws: SteadyLaws, grid: Array, side: Array) -> Beginnings:
    """The beginnings for the points of ``grid``, whose rest is approached from ``side``, one per row."""
    count = len(grid)
    start, initial = laws.starts(grid)
    at = Iterates(grid, start, np.zeros((laws.balance.modes.numel(), count)).T, np.zeros((laws.count, count)).T)
    some, place = _motions(laws, at)
    step = euler_step(laws, some, SHORT_STEP)
    if step.degenerate.any():  # at rest a ratio moves nothing: start where speeds are as prescribed
        there = np.flatnonzero(step.degenerate[place])
        move = euler_step(laws, laws.motion(at.some(there)), SHORT_STEP).move
        good = np.isfinite(move).all(axis=1)
        at.y[there[good]] += move[good]
        some, place = _motions(laws, at)
        step = euler_step(laws, some, SHORT_STEP)
    given, reach, slope = mobilities(some, step)
    size = np.where(given, np.inf, np.sqrt(reach))
    sliding = _sliding(np.where(laws.contact, np.inf, size), slope, step.along)
    yields = COMPLIANCE * reach * _hold_each_other(size, slope)
    rest = AtRest(taken(given, place), taken(yields, place), side)
    return Beginnings(at.y, initial, rest, taken(sliding, place))


def _motions(laws: SteadyLaws, at: Iterates) -> tuple[Motion, Index]:
    """The motions with different slopes, and the place of every point among them."""
    entries, value = laws.held(at)
    first, place = _distinct(entries)
    return laws.motion_of(taken(entries, first), taken(value, first)), place


def _distinct(entries: Array) -> tuple[Index, Index]:
    """Points with different slopes, and the place of every point among them: loads and torques on a grid often change no slope."""
    with np.errstate(all="ignore"):
        mark = entries @ np.random.default_rng(0).normal(size=entries.shape[1])
    _, first, place = np.unique(mark, return_index=True, return_inverse=True)
    if (entries == taken(taken(entries, first), place)).all():
        return first, place
    every = np.arange(len(mark))
    return every, every


def _scaled(size: Array, slope: Array) -> tuple[Array, Mask]:
    """The mobilities of laws, each scaled by the ``size`` of its own, and the points at which they are finite."""
    scaled = slope / (size[:, :, None] * size[:, None, :])
    return scaled, np.asarray(np.isfinite(scaled).all(axis=(1, 2)))


def _hold_each_other(size: Array, slope: Array) -> Mask:
    """The laws in a combination of torques that moves nothing. Only these share what they hold, and need a compliance.

    With one, a law on a light shaft would creep where heavier ones leave little of its mobility. ``size`` is infinite where a motion is
    given: its torque alone moves nothing.
    """
    (scaled, good), found = _scaled(size, slope), np.ones(size.shape, bool)
    _, sizes, vectors = np.linalg.svd(scaled[good])
    found[good] = ((sizes <= DEPENDENT)[:, :, None] & (np.abs(vectors) > PART)).any(axis=1)
    return found


def _sliding(size: Array, slope: Array, along: Array) -> Array:
    """The leading singular vector of the mobilities of laws that may slide: ``size`` is infinite for the others."""
    (scaled, good), torques = _scaled(size, slope), np.zeros(size.shape)
    good &= np.isfinite(size).any(axis=1)
    if good.any():
        torques[good] = np.linalg.svd(scaled[good])[2][:, 0] / size[good]
    moved, speeds = (np.einsum("pij,pj->pi", np.nan_to_num(each), torques) for each in (along, slope))
    speed = np.abs(np.where(np.isfinite(size), speeds, 0.0)).max(axis=1, initial=0.0)[:, None]
    return np.where(speed > 0.0, moved / np.where(speed > 0.0, speed, 1.0), 0.0)
