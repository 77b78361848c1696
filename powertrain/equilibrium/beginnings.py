"""What a step of implicit Euler from the start of the unknowns says of each point, before anything is known of its solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from powertrain.compiler.torques import COMPLIANCE
from powertrain.equilibrium.corrector import Near
from powertrain.equilibrium.laws import Iterates, LawValues, Mask, SteadyLaws
from powertrain.numerics.buffers import Array
from powertrain.numerics.newton import solved

SHORT_STEP = 0.1
"""The step after which laws that hold each other share torques by their compliance: shorter than what moves unknowns that nothing holds."""
SINGULAR = 1e14
"""Condition beyond which equations do not determine their unknowns."""
GIVEN = 1e-11
"""A law's own torque moves it where its speed changes by more than this share of the terms."""


@dataclass(frozen=True)
class Beginnings:
    """For each point: laws that their own torque does not move and how much the others yield; a motion, as a change of the unknowns.

    ``sliding`` is the motion that torques change most, by which laws slide at one unit of speed; zero where there is none. ``start``:
    where the search begins.
    """

    start: Array
    near: Near
    sliding: Array


def euler_step(laws: SteadyLaws, value: LawValues, step: float) -> tuple[Array, Array]:
    """What a step of ``step`` seconds adds to the unknowns (point, unknown), and its change with torques (point, unknown, law).

    Where the equations do not determine the unknowns it is the shortest step of least squares: by elimination, round-off alone would
    say how far they go.
    """
    n = laws.unknowns
    matrix = _euler(laws, value, step)
    right = -np.concatenate([value.rows[:, :, None], value.rows_[:, :, n:]], axis=2)
    points, _, sides = right.shape
    found = solved(np.repeat(matrix, sides, 0), right.transpose(0, 2, 1).reshape(points * sides, n))
    found = found.reshape(points, sides, n).transpose(0, 2, 1)
    finite = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    some = np.flatnonzero(_degenerate(matrix) & finite)
    size = _row_sizes(matrix[some])
    found[some] = np.linalg.pinv(matrix[some] / size, rcond=1.0 / SINGULAR) @ (right[some] / size)
    return found[:, :, 0], found[:, :, 1:]


def _euler(laws: SteadyLaws, value: LawValues, step: float) -> Array:
    matrix = value.rows_[:, :, : laws.unknowns].copy()
    matrix[:, laws.rates, laws.rate_of[laws.rates]] -= 1.0 / step
    return np.asarray(matrix)


def _row_sizes(matrix: Array) -> Array:
    size = np.abs(matrix).max(axis=2, keepdims=True, initial=0.0)
    return np.where(size > 0.0, size, 1.0)


def _degenerate(matrix: Array) -> Mask:
    """Which equations do not determine their unknowns; no unknowns are determined."""
    if not matrix.shape[1]:
        return np.zeros(len(matrix), bool)
    good = np.isfinite(matrix).all(axis=(1, 2)) & (np.abs(matrix).max(axis=2) > 0.0).all(axis=1)
    found: Mask = np.logical_not(good)
    level = matrix / _row_sizes(matrix)
    unsure = np.flatnonzero(good & (_condition_bound(level) > SINGULAR))
    found[unsure] = np.linalg.cond(level[unsure]) > SINGULAR
    return found


def _condition_bound(matrix: Array) -> Array:
    """More than the conditions, by determinants: 2/|det A| (|A|_F^2/n)^(n/2).

    H. W. Guggenheimer, A. S. Edelman, C. R. Johnson, A simple estimate of the condition number of a linear system, College Mathematics
    Journal 26 (1995) 2.
    """
    n = matrix.shape[1]
    with np.errstate(all="ignore"):
        return np.asarray(2.0 / np.abs(np.linalg.det(matrix)) * ((matrix**2).sum(axis=(1, 2)) / n) ** (n / 2))


def mobilities(value: LawValues, along: Array, others: bool = False) -> tuple[Mask, Array, Array]:
    """Laws that their own torque does not move, how much it moves the others, and the change of all speeds with all torques.

    ``others``: laws that the torque of another law moves are counted among those that move, by the strongest of these torques.
    """
    n = along.shape[1]
    slope = value.speed_[:, :, n:] + value.speed_[:, :, :n] @ along
    terms = np.abs(value.speed_[:, :, n:]) + np.abs(value.speed_[:, :, :n]) @ np.abs(along)
    size, least = np.abs(slope), GIVEN * terms
    own = np.diagonal(size, axis1=1, axis2=2)
    given = own <= np.diagonal(least, axis1=1, axis2=2)
    if others:
        own = np.where(given, size.max(axis=2, initial=0.0), own)
        given = given & ~(size > least).any(axis=2)
    return given, np.where(given, 1.0, own), slope


def beginnings(laws: SteadyLaws, grid: Array, others: bool = False) -> Beginnings:
    """For the points of ``grid``, a row each; ``others`` as in ``mobilities``."""
    count = len(grid)
    start = np.repeat(laws.balance.start[None], count, 0)
    at = Iterates(grid, start, np.zeros((count, laws.balance.modes.numel())), np.zeros((count, laws.count)))
    value = laws.values(at, lossless=True)
    move, along = euler_step(laws, value, SHORT_STEP)
    degenerate = _degenerate(_euler(laws, value, SHORT_STEP)) & np.isfinite(move).all(axis=1)
    if degenerate.any():  # at rest a ratio moves nothing: begin where speeds are as prescribed
        at.y[degenerate] += move[degenerate]
        value = laws.values(at, lossless=True)
        along = euler_step(laws, value, SHORT_STEP)[1]
    given, reach, slope = mobilities(value, along, others)
    return Beginnings(at.y, Near(given, COMPLIANCE * reach), _sliding(~given & ~laws.contact, reach, slope, along))


def _sliding(movable: Mask, reach: Array, slope: Array, along: Array) -> Array:
    """The leading singular vector of the mobilities, each law counted by its own."""
    size = np.where(movable, np.sqrt(reach), np.inf)
    even = slope / (size[:, :, None] * size[:, None, :])
    good = np.isfinite(even).all(axis=(1, 2)) & movable.any(axis=1)
    torques = np.zeros(movable.shape)
    if good.any():
        torques[good] = np.linalg.svd(even[good])[2][:, 0] / size[good]
    speed = np.abs(np.where(movable, np.einsum("pij,pj->pi", np.nan_to_num(slope), torques), 0.0)).max(
        axis=1, initial=0.0
    )
    moved = np.einsum("pij,pj->pi", np.nan_to_num(along), torques)
    return np.where((good & (speed > 0.0))[:, None], moved / np.where(speed > 0.0, speed, 1.0)[:, None], 0.0)
