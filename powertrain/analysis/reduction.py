"""Minimal form of linear models: without derivatives of inputs, and without the motions that closed laws hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.numerics.pivots import leading_columns

Matrix = NDArray[np.float64]
_SMALL = 1e-9
ROUNDING = 64 * np.finfo(float).eps
"""Singular values below this share of the largest, times the number of states, count as zero."""


@dataclass(frozen=True)
class Matrices:
    """der(x) = a x + sum_k b[k] u^(k),  y = c x + sum_k d[k] u^(k),  relative motions = w x + sum_k v[k] u^(k)."""

    a: Matrix
    b: list[Matrix]
    c: Matrix
    d: list[Matrix]
    w: Matrix
    v: list[Matrix]


def substitute_inputs(full: Matrices, improper: Callable[[int, int, int], Exception]) -> tuple[Matrices, Matrix]:
    """The same response in states x - gains u - ..., without derivatives of u; raises ``improper(output, input, order)`` if y has them.

    With g_k = b_(k+1) + a g_(k+1): der(x - sum_k g_k u^(k)) = a (x - sum_k g_k u^(k)) + (b_0 + a g_0) u.
    """
    order = len(full.b)
    gains = [np.zeros_like(full.b[0]) for _ in range(order)]
    for k in range(order - 2, -1, -1):
        gains[k] = full.b[k + 1] + full.a @ gains[k + 1]
    through = [d + full.c @ g for d, g in zip(full.d, gains, strict=True)]
    motions = [v + full.w @ g for v, g in zip(full.v, gains, strict=True)]
    for k in range(order - 1, 0, -1):
        scale = np.abs(full.d[k]) + np.abs(full.c) @ np.abs(gains[k]) + np.abs(through[0])
        remaining = np.argwhere(np.abs(through[k]) > _SMALL * scale)
        if remaining.size:
            i, j = remaining[0]
            raise improper(int(i), int(j), k)
    b = full.b[0] + full.a @ gains[0]
    return Matrices(full.a, [b], full.c, [through[0]], full.w, motions), gains[0]


def free_motion(
    full: Matrices, held: NDArray[np.int64], kinematic: NDArray[np.bool_]
) -> tuple[Matrices, NDArray[np.int64]]:
    """The states that remain if the relative motions ``held`` stay zero, and their indices among all states.

    The removed states follow from the others. Relative positions whose rate is a held speed are removed as well; candidates are the states
    for which ``kinematic`` says that their rates are fixed combinations of other states.
    """
    n = len(full.a)
    rows = _independent(full.w[held])
    if not len(rows):
        return full, np.arange(n)
    motion = np.hstack([full.a, full.b[0]])
    rows = _independent(np.vstack([rows, _positions(motion, rows, np.flatnonzero(kinematic))]))
    gone, kept = _split(rows)
    expand = np.zeros((n, len(kept)))
    expand[kept, np.arange(len(kept))] = 1.0
    expand[gone] = -np.linalg.solve(rows[:, gone], rows[:, kept])
    reduced = Matrices(full.a[kept] @ expand, [full.b[0][kept]], full.c @ expand, full.d, full.w @ expand, full.v)
    return reduced, kept


@dataclass(frozen=True)
class Quotient:
    """A model in the states x[kept] - relative x[gone]."""

    matrices: Matrices
    kept: NDArray[np.int64]
    gone: NDArray[np.int64]
    relative: Matrix


def without_unseen(full: Matrices) -> Quotient:
    """The model without the motions V of eigenvalue zero that no output sees: a V inside V, c V = 0.

    The other motions are known up to V. Their coordinates x[kept] - V[kept] V[gone]^-1 x[gone] are constant along V, so their rates follow
    from those of the representatives with x[gone] = 0.
    """
    n = len(full.a)
    unseen = _unseen(full.a, full.c)
    if not unseen.shape[1]:
        return Quotient(full, np.arange(n), np.zeros(0, int), np.zeros((n, 0)))
    gone, kept = _split(unseen.T)
    relative = np.asarray(np.linalg.solve(unseen[gone].T, unseen[kept].T).T, np.float64)
    relative[np.abs(relative) <= _SMALL * np.abs(relative).max(initial=0.0)] = 0.0
    turn = np.zeros((len(kept), n))
    turn[:, kept], turn[:, gone] = np.eye(len(kept)), -relative
    matrices = Matrices(
        turn @ full.a[:, kept], [turn @ full.b[0]], full.c[:, kept], full.d, np.zeros((0, len(kept))), []
    )
    return Quotient(matrices, kept, gone, relative)


def _unseen(a: Matrix, c: Matrix) -> Matrix:
    """A basis of the largest V with a V inside V on which a is nilpotent and c V = 0, by successive null spaces in the quotient."""
    from scipy.linalg import matrix_balance

    inner, scale = matrix_balance(a, permute=False)
    size = np.linalg.norm(inner, 2) if len(a) else 0.0
    shown = c @ scale
    lengths = np.linalg.norm(shown, axis=1, keepdims=True)
    shown = np.divide(shown, lengths, out=np.zeros_like(shown), where=lengths > 0.0) * size
    rest, found = np.eye(len(a)), np.zeros((len(a), 0))
    while rest.shape[1]:
        _, sizes, rows = np.linalg.svd(np.vstack([rest.T @ inner @ rest, shown @ rest]))
        null = rows[int((sizes > ROUNDING * len(a) * size).sum()) :].T
        if not null.shape[1]:
            break
        found = np.hstack([found, rest @ null])
        rest = rest @ rows[: rest.shape[1] - null.shape[1]].T
    return np.asarray(scale @ found)


def _independent(rows: Matrix) -> Matrix:
    """Normalised rows with the same span, without dependent ones."""
    size = np.abs(rows).max(axis=1, initial=0.0) if rows.size else np.zeros(0)
    chosen: list[Matrix] = []
    basis: list[Matrix] = []
    for row in rows[size > 0] / size[size > 0, None]:
        rest = row.copy()
        for direction in basis:
            rest -= (direction @ rest) * direction
        if np.linalg.norm(rest) > _SMALL * np.linalg.norm(row):
            chosen.append(row)
            basis.append(rest / np.linalg.norm(rest))
    return np.array(chosen).reshape(len(chosen), rows.shape[1])


def _positions(motion: Matrix, speeds: Matrix, candidates: NDArray[np.int64]) -> Matrix:
    """Combinations of the candidate states whose rates are held speeds, whatever the input; ``motion`` is (a b)."""
    n = speeds.shape[1]
    moving = candidates[np.abs(motion[candidates]).max(axis=1, initial=0.0) > 0.0]
    found = np.zeros((0, n))
    for speed in speeds if moving.size else ():
        target = np.append(speed, np.zeros(motion.shape[1] - n))
        weights = np.linalg.lstsq(motion[moving].T, target, rcond=None)[0]
        if np.linalg.norm(motion[moving].T @ weights - target) <= _SMALL * np.linalg.norm(speed):
            row = np.zeros(n)
            row[moving] = np.where(np.abs(weights) > _SMALL * np.abs(weights).max(), weights, 0.0)
            found = np.vstack([found, row])
    return found


def _split(rows: Matrix) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The removed states, one per row, and the remaining ones."""
    gone = leading_columns(rows)
    return np.array(gone, int), np.setdiff1d(np.arange(rows.shape[1]), gone)
