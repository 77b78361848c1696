"""Newton's method at many points together: small dense systems, damped point by point."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.float64]
Evaluate = Callable[[Rows, NDArray[np.intp]], tuple[Rows, NDArray[np.float64]]]
"""(unknowns, points) -> residuals with one row per equation, and Jacobians (equations, unknowns, points)."""

CONVERGED, SINGULAR, DIVERGED, IMPOSSIBLE = range(4)
_ITERATIONS = 50
_STALLED = 5
_QUARTERS = 4
_STEP = 1e-12
_RANK = 1e-11
_CLEAR = 1e-6
"""Columns of a Jacobian, of length one, that stand out as far from those before them are certainly independent."""
_HELD_BACK = 2
"""Steps in a row that want to leave the signs of values; then there is no solution within."""
_NEARER = 0.9
"""The share of the way to a limit that one step may go."""


def newton(evaluate: Evaluate, start: Rows, sides: Rows) -> tuple[Rows, NDArray[np.int8]]:
    """Unknowns and outcome of every point; there may be more equations than unknowns where these do not contradict each other.

    ``sides`` has a row for every row that ``evaluate`` gives: 0 for an equation, 1 or -1 for a value that keeps this sign, nan for one
    that does not count. SINGULAR: the equations hold, and still do when unknowns change. DIVERGED: no solution was found.
    IMPOSSIBLE: no change of the unknowns brings the equations nearer to zero.
    """
    u = start.copy()
    count = u.shape[1]
    outcome = np.full(count, DIVERGED, np.int8)
    active = np.arange(count)
    values, slopes = evaluate(u, active)
    best, stalled, held_back = np.full(count, np.inf), np.zeros(count, int), np.zeros(count, int)
    for _ in range(_ITERATIONS):
        if not active.size:
            break
        residual, jacobian = _equations(values, slopes, sides[:, active])
        step, deficient = newton_step(residual, jacobian)
        size = _size(residual, jacobian, u[:, active])
        still = (np.abs(step) <= _STEP * (1.0 + np.abs(u[:, active]))).all(axis=0)
        closed = (still | (size <= 1e-14)) & (size <= 1e-9)
        outcome[active[closed]] = np.where(deficient[closed], SINGULAR, CONVERGED)
        outcome[active[still & ~closed]] = IMPOSSIBLE
        stalled[active] = np.where(size < 0.9 * best[active], 0, stalled[active] + 1)
        best[active] = np.minimum(best[active], size)
        go = ~(closed | still | (stalled[active] >= _STALLED)) & np.isfinite(step).all(axis=0)
        active = active[go]
        if not active.size:
            break
        length = _room(values[:, go], slopes[..., go], step[:, go], sides[:, active])
        held_back[active] = np.where(length < 1.0, held_back[active] + 1, 0)
        free = held_back[active] <= _HELD_BACK
        outcome[active[~free]] = IMPOSSIBLE
        go[go] = free
        active, length = active[free], length[free]
        tried, values, slopes, ok = _damped(
            evaluate, u[:, active], active, length * step[:, go], residual[:, go], jacobian[..., go], sides[:, active]
        )
        u[:, active[ok]] = tried[:, ok]
        active, values, slopes = active[ok], values[:, ok], slopes[..., ok]
    return u, outcome


def _equations(values: Rows, slopes: NDArray[np.float64], sides: Rows) -> tuple[Rows, NDArray[np.float64]]:
    on = sides == 0.0
    return np.where(on, values, 0.0), np.where(on[:, None], slopes, 0.0)


def _room(values: Rows, slopes: NDArray[np.float64], step: Rows, sides: Rows) -> Rows:
    """How much of a step leaves the signs of all values that have to keep theirs."""
    length = np.ones(step.shape[1])
    for value, slope, side in zip(values, slopes, sides, strict=True):
        keeps = (side != 0.0) & (side * value > 0.0)
        if keeps.any():
            change = (slope * step).sum(axis=0)
            with np.errstate(all="ignore"):
                most = np.where(keeps & (side * change > _NEARER * side * value), _NEARER * value / change, 1.0)
            length = np.minimum(length, most)
    return length


def _damped(
    evaluate: Evaluate,
    base: Rows,
    active: NDArray[np.intp],
    step: Rows,
    residual: Rows,
    jacobian: NDArray[np.float64],
    sides: Rows,
) -> tuple[Rows, Rows, NDArray[np.float64], NDArray[np.bool_]]:
    """Takes a quarter of the step where it does not help; the last array says where some step did."""
    length = np.ones(active.size)
    scale = np.where(sides == 0.0, 1.0 / (np.abs(jacobian).max(axis=1) + 1e-300), 0.0)
    old = np.abs(residual * scale).max(axis=0)
    small = np.abs(step).max(axis=0) <= 1e-9 * (1.0 + np.abs(base).max(axis=0))
    tried = base - step
    values, slopes = evaluate(tried, active)
    bad = np.arange(active.size)
    for _ in range(_QUARTERS):
        new = np.abs(values[:, bad] * scale[:, bad]).max(axis=0)
        fine = (new <= old[bad] * (1.0 - 0.1 * length[bad])) | (small[bad] & np.isfinite(new))
        bad = bad[~fine]
        if not bad.size:
            break
        length[bad] *= 0.25
        tried[:, bad] = base[:, bad] - length[bad] * step[:, bad]
        values[:, bad], slopes[..., bad] = evaluate(tried[:, bad], active[bad])
    ok = np.ones(active.size, bool)
    ok[bad] = False
    return tried, values, slopes, ok


def _size(residual: Rows, jacobian: NDArray[np.float64], u: Rows) -> NDArray[np.float64]:
    """The residual in terms of what it is the difference of."""
    terms = (np.abs(jacobian) * (1.0 + np.abs(u))).sum(axis=1) + 1e-300
    size: NDArray[np.float64] = (np.abs(residual) / terms).max(axis=0)
    return np.where(np.isfinite(size), size, np.inf)


def newton_step(residual: Rows, jacobian: NDArray[np.float64]) -> tuple[Rows, NDArray[np.bool_]]:
    """The least-squares step of every point, and whether some unknown is not determined there. Nan where the equations are."""
    rows = _not_zero(np.abs(jacobian).max(axis=1))
    matrix = jacobian / rows[:, None]
    columns = _not_zero(np.abs(matrix).max(axis=0))
    matrix /= columns
    right = residual / rows
    step, clear, deficient = _orthogonal(matrix, right)
    some = np.flatnonzero(~clear)
    if some.size:
        step[:, some], deficient[some] = _singular_values(matrix[..., some], right[:, some])
    return step / columns, deficient


def _not_zero(sizes: Rows) -> Rows:
    sizes[sizes == 0.0] = 1.0
    return sizes


def _orthogonal(matrix: NDArray[np.float64], right: Rows) -> tuple[Rows, NDArray[np.bool_], NDArray[np.bool_]]:
    """The least-squares solutions by orthogonal columns, where these are clearly independent, and where some are zero."""
    n = matrix.shape[1]
    q, rest = [matrix[:, j] for j in range(n)], right.copy()
    r: dict[tuple[int, int], Rows] = {}
    heads: list[Rows] = []
    clear, deficient = np.ones(matrix.shape[2], bool), np.zeros(matrix.shape[2], bool)
    for j in range(n):
        length = (q[j] ** 2).sum(axis=0)
        for i in range(j):
            r[i, j] = (q[i] * q[j]).sum(axis=0)
            q[j] = q[j] - r[i, j] * q[i]
        left, zero = (q[j] ** 2).sum(axis=0) if j else length, length == 0.0
        clear &= (left > _CLEAR**2 * length) | zero
        deficient |= zero
        r[j, j] = np.sqrt(np.where(zero, 1.0, left))
        q[j] = q[j] / r[j, j]
        heads.append((q[j] * rest).sum(axis=0))
        rest -= heads[j] * q[j]
    step = np.empty((n, matrix.shape[2]))
    for j in reversed(range(n)):
        step[j] = (heads[j] - sum(r[j, k] * step[k] for k in range(j + 1, n))) / r[j, j]
    return step, clear, deficient


def _singular_values(matrix: NDArray[np.float64], right: Rows) -> tuple[Rows, NDArray[np.bool_]]:
    """The shortest least-squares solutions, and whether some unknown is not determined."""
    finite = np.isfinite(matrix).all(axis=(0, 1)) & np.isfinite(right).all(axis=0)
    whole, wanted = np.where(finite, matrix, 0.0), np.where(finite, right, np.nan)
    left, sizes, across = np.linalg.svd(np.moveaxis(whole, 2, 0), full_matrices=False)
    small = sizes <= _RANK * np.maximum(sizes[:, :1], 1e-300)
    inverse = np.where(small, 0.0, 1.0 / np.where(small, 1.0, sizes))
    step = np.swapaxes(across, 1, 2) @ (inverse[:, :, None] * (np.swapaxes(left, 1, 2) @ wanted.T[:, :, None]))
    return step[:, :, 0].T, np.asarray(small.any(axis=1))
