"""Newton's method at many points together: small dense systems, damped point by point."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.float64]
Evaluate = Callable[[Rows, NDArray[np.intp]], tuple[Rows, NDArray[np.float64]]]
"""(unknowns, points) -> residuals with one row per equation, and Jacobians (points, equations, unknowns)."""

CONVERGED, SINGULAR, DIVERGED, IMPOSSIBLE = range(4)
_ITERATIONS = 50
_STALLED = 5
_HALVINGS = 8
_STEP = 1e-12
_RANK = 1e-11


def newton(evaluate: Evaluate, start: Rows) -> tuple[Rows, NDArray[np.int8]]:
    """Unknowns and outcome of every point; there may be more equations than unknowns where these do not contradict each other.

    SINGULAR: the equations hold, and still do when unknowns change. DIVERGED: no solution was found.
    IMPOSSIBLE: no change of the unknowns brings the equations nearer to zero.
    """
    u = start.copy()
    count = u.shape[1]
    outcome = np.full(count, DIVERGED, np.int8)
    active = np.arange(count)
    residual, jacobian = evaluate(u, active)
    best, stalled = np.full(count, np.inf), np.zeros(count, int)
    for _ in range(_ITERATIONS):
        if not active.size:
            break
        step, deficient = newton_step(residual, jacobian)
        size = _size(residual, jacobian, u[:, active])
        still = (np.abs(step) <= _STEP * (1.0 + np.abs(u[:, active]))).all(axis=0)
        tried, found, slopes, ok = _damped(evaluate, u, active, step, residual, jacobian)
        closed = (still | (size <= 1e-14)) & (size <= 1e-9)
        stalled[active] = np.where(size < 0.9 * best[active], 0, stalled[active] + 1)
        best[active] = np.minimum(best[active], size)
        done = closed | ~ok | (still & ~closed) | (stalled[active] >= _STALLED)
        better = ok & ~closed
        u[:, active[better]] = tried[:, better]
        outcome[active[closed]] = np.where(deficient[closed], SINGULAR, CONVERGED)
        outcome[active[still & ~closed]] = IMPOSSIBLE
        go = ~done
        active, residual, jacobian = active[go], found[:, go], slopes[go]
    return u, outcome


def _damped(
    evaluate: Evaluate, u: Rows, active: NDArray[np.intp], step: Rows, residual: Rows, jacobian: NDArray[np.float64]
) -> tuple[Rows, Rows, NDArray[np.float64], NDArray[np.bool_]]:
    """Halves the step where it does not help; the last array says where some step did."""
    length = np.ones(active.size)
    base = u[:, active]
    scale = 1.0 / (np.abs(jacobian).max(axis=2).T + 1e-300)
    old = np.abs(residual * scale).max(axis=0)
    tried = base - step
    found, slopes = evaluate(tried, active)
    ok: NDArray[np.bool_] = np.asarray(np.isfinite(step).all(axis=0))
    bad = ~ok
    for _ in range(_HALVINGS):
        new = np.abs(found * scale).max(axis=0)
        small = np.abs(length * step).max(axis=0) <= 1e-9 * (1.0 + np.abs(base).max(axis=0))
        bad = ok & ~((new <= old * (1.0 - 0.1 * length)) | (small & np.isfinite(new)))
        if not bad.any():
            return tried, found, slopes, ok
        length[bad] *= 0.5
        tried[:, bad] = base[:, bad] - length[bad] * step[:, bad]
        found[:, bad], slopes[bad] = evaluate(tried[:, bad], active[bad])
    return tried, found, slopes, ok & ~bad


def _size(residual: Rows, jacobian: NDArray[np.float64], u: Rows) -> NDArray[np.float64]:
    """The residual in terms of what it is the difference of."""
    terms = np.einsum("pij,jp->ip", np.abs(jacobian), 1.0 + np.abs(u)) + 1e-300
    size: NDArray[np.float64] = (np.abs(residual) / terms).max(axis=0)
    return np.where(np.isfinite(size), size, np.inf)


def newton_step(residual: Rows, jacobian: NDArray[np.float64]) -> tuple[Rows, NDArray[np.bool_]]:
    """The least-squares step of every point, and whether some unknown is not determined there."""
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(residual).all(axis=0))
    matrix = np.where(finite[:, None, None], jacobian, 0.0)
    rows = np.abs(matrix).max(axis=2, keepdims=True)
    rows[rows == 0.0] = 1.0
    matrix = matrix / rows
    columns = np.abs(matrix).max(axis=1, keepdims=True)
    columns[columns == 0.0] = 1.0
    left, sizes, right = np.linalg.svd(matrix / columns, full_matrices=False)
    largest = sizes[:, :1]
    small = sizes <= _RANK * np.maximum(largest, 1e-300)
    inverse = np.where(small, 0.0, 1.0 / np.where(small, 1.0, sizes))
    scaled = np.where(finite, residual, 0.0).T[:, :, None] / rows
    step = np.swapaxes(right, 1, 2) @ (inverse[:, :, None] * (np.swapaxes(left, 1, 2) @ scaled))
    result = (step / np.swapaxes(columns, 1, 2))[:, :, 0].T
    return np.where(finite, result, np.nan), np.asarray(small.any(axis=1))
