"""Newton's method for many small systems of equations at once, damped by the natural monotonicity test.

    F'(z) step = -F(z),   z <- z + share step

A step helps if the next one with the same matrix, F'(z)^-1 F(z + share step), is shorter. Steps are measured in the sizes of the unknowns,
so neither the units of the equations nor their order matters. A single system is a batch of one.

P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2011, section 3.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

Equations = Callable[[Index, Array], tuple[Array, Array]]
"""(indices of systems, their unknowns, one row each) -> (F'(z) in any form with one row per system, F(z), one row each)."""
Solver = Callable[[Array], Array]
"""The solutions for right-hand sides, one row each."""

HALVINGS = 16
"""How often a step is halved before the iteration of its system ends without a solution."""
DRIFT = 1e-6
"""Relative change of a step below which it equals the one before."""


def relative(z: Array) -> Array:
    """The sizes of unknowns: one, or their magnitude if larger."""
    return 1.0 + np.abs(z)


def solved(matrix: Array, right: Array) -> Array:
    """The solutions of many small systems with rows scaled to one; the shortest one for a singular matrix, nan for missing values.

    One matrix serves any number of systems. ``right`` has one row per system, or one matrix with a column for each right-hand side.
    """
    if right.ndim == 2:
        return solved(matrix, right[:, :, None])[:, :, 0]
    if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
        return _without_missing(matrix, right)
    size = np.abs(matrix).max(axis=2, keepdims=True, initial=0.0)
    size[size == 0.0] = 1.0
    whole, given = matrix / size, right / size
    try:
        return np.asarray(np.linalg.solve(whole, given))
    except np.linalg.LinAlgError:
        each = zip(np.broadcast_to(whole, (len(given), *whole.shape[1:])), given, strict=True)
        return np.array([_shortest(a, b) for a, b in each]).reshape(given.shape)


def _without_missing(matrix: Array, right: Array) -> Array:
    """The same where values are missing: nan for the systems and right-hand sides that have some."""
    sound: Mask = np.asarray(np.isfinite(matrix).all(axis=(1, 2), keepdims=True))
    good = sound & np.isfinite(right).all(axis=1, keepdims=True)
    found = solved(np.where(sound, matrix, np.eye(matrix.shape[1])), np.where(good, right, 0.0))
    return np.asarray(np.where(good, found, np.nan))


def _shortest(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], dtype=np.float64)


def dense(matrix: Array) -> Solver:
    """The solver of dense matrices."""
    return partial(solved, matrix)


def drifting(matrix: Array, step: Array, before: tuple[Array, Array]) -> Mask:
    """The systems with the same matrix and the same step as ``before``: they are affine there, and no step in this direction solves them.

    So it is with equations that contradict each other and are singular but for a compliance.
    """
    change, size = (np.abs(one).max(axis=1, initial=0.0) for one in (step - before[1], step))
    same: Mask = np.asarray((change <= DRIFT * size) & (size > 0.0))
    if same.any():
        same &= (matrix == before[0]).reshape(len(matrix), -1).all(axis=1)
    return same


def newton(
    equations: Equations,
    z: Array,
    *,
    still: float,
    most: int,
    halvings: int = HALVINGS,
    sizes: Callable[[Array], Array] = relative,
    factors: Callable[[Array], Solver] = dense,
    together: int = 1,
) -> tuple[Array, Mask]:
    """The unknowns after Newton's method from ``z``, one row per system, and whether each converged.

    Parameters
    ----------
    still
        The iteration ends with a step that changes no unknown by more than this share of its ``sizes(z)``; that step is still taken.
        If a step has no value, a full step leaves nan, a damped step the last unknowns. Steps that ``drifting`` finds useless are not
        tried: of full ones the sum is taken at once.
    most
        The number of steps.
    halvings
        How often a step may be halved; 0 takes only full steps.
    factors
        The solver for F'(z), if this is not a dense matrix.
    together
        About how many halved steps, of one or several systems, are evaluated in one call of ``equations``.
    """
    columns, fine = (
        np.array(z.T, order="C"),
        np.zeros(len(z), bool),
    )  # each unknown contiguous over all systems, for speed
    z = columns.T
    active = np.flatnonzero(np.isfinite(z).all(axis=1))
    known: tuple[Array, Array] | None = None
    before: tuple[Array, Array] | None = None
    for k in range(most):
        whole = known is None and active.size == len(z)  # damped systems are in another order
        here = z if whole else columns.take(active, axis=1).T
        matrix, value = equations(active, here) if known is None else known
        solve, unit = factors(matrix), sizes(here)
        step = solve(-value)
        step[~value.any(axis=1)] = 0.0  # solved, even if F' is infinite there
        size = np.abs(step / unit).max(axis=1, initial=0.0)
        last = size <= still
        fine[active] = last
        go = np.isfinite(size) & ~last
        if not halvings:
            if before is not None:
                drifts = go & drifting(matrix, step, before)
                step[drifts] *= most - k  # all steps that remain
                go &= ~drifts
            if whole:
                z += step
            else:
                z[active] += step
            active, before = active[go], (matrix if len(matrix) == 1 else matrix[go], step[go])
        else:
            z[active[last]] += step[last]
            some = np.flatnonzero(go)
            if not some.size:
                break
            systems = active[some]
            full = _FullSteps(systems, matrix[some], z[systems], step[some], unit[some], size[some])
            again = (lambda _, solve=solve: solve) if len(matrix) == 1 else factors
            active, z_after, known = _helped(equations, again, full, halvings, together)
            z[active] = z_after
        if not active.size:
            break
    return z, fine


@dataclass(frozen=True)
class _FullSteps:
    """Systems, matrices, starting points, full steps, sizes of the unknowns, and step lengths in these sizes; one row each."""

    systems: Index
    matrix: Array
    first: Array
    step: Array
    unit: Array
    size: Array


def _helped(
    equations: Equations, factors: Callable[[Array], Solver], full: _FullSteps, halvings: int, together: int
) -> tuple[Index, Array, tuple[Array, Array]]:
    """The systems with a step that helps, their unknowns after the longest such step, and their equations there.

    A step helps if the next one is at most half as long. A next step that is only slightly shorter must also not lead back: beyond a
    saturation there is another one.
    """
    left, k, found = np.arange(len(full.systems)), 0, list[tuple[Index, Array, Array, Array]]()
    while left.size and k <= halvings:
        count = min(max(1, together // left.size), halvings + 1 - k)
        which, share = np.tile(left, count), np.repeat(0.5 ** np.arange(k, k + count), left.size)
        trial = full.first[which] + share[:, None] * full.step[which]
        matrix, value = equations(full.systems[which], trial)
        unit, size = full.unit[which], full.size[which]
        following, step = factors(full.matrix[which])(-value) / unit, full.step[which] / unit
        after, ahead = np.abs(following).max(axis=1, initial=0.0), (following * step).sum(axis=1) >= 0.0
        helps = ((after <= 0.5 * size) | (ahead & (after <= (1.0 - share / 2) * size))).reshape(count, left.size)
        some, first = helps.any(axis=0), helps.argmax(axis=0) * left.size + np.arange(left.size)
        best = first[some]
        found.append((left[some], trial[best], matrix[best], value[best]))
        # Whole steps first; where even the shortest one is longer than the unknowns, a drift ends the search.
        if k == 0:
            n, far = left.size, full.size > 2.0**halvings
            some |= far & drifting(matrix[:n], following[:n] * unit[:n], (full.matrix, full.step))
        left, k = left[~some], k + count
    which, z, matrix, value = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return full.systems[which], z, (matrix, value)
