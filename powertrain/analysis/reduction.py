"""Linear models in their least form: without derivatives of inputs, and without the motions that closed laws hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
_SMALL = 1e-9


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
    """The same response in states x - gains u - ..., without derivatives of u; raises ``improper(output, input, order)`` where y has them.

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
    """The states that are left where the relative motions ``held`` stay zero, and their places among all states.

    The states that go follow from the others. Relative positions, whose rate is a held speed, go as well; they are looked for among the
    states of which ``kinematic`` says that their rates are fixed combinations of other states.
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


def _independent(rows: Matrix) -> Matrix:
    """Rows of the same span, normalised, without those that follow from others."""
    size = np.abs(rows).max(axis=1, initial=0.0) if rows.size else np.zeros(0)
    chosen: list[Matrix] = []
    basis: list[Matrix] = []
    for row in rows[size > 0] / size[size > 0, None]:
        rest = row.copy()
        for _ in range(2):
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
    """Which states go, one for each row (the largest pivots), and which stay."""
    table, gone = rows.copy(), []
    for i in range(len(table)):
        j = int(np.argmax(np.abs(table[i])))
        gone.append(j)
        others = np.arange(len(table)) != i
        table[others] -= np.outer(table[others, j] / table[i, j], table[i])
        table[others, j] = 0.0
    kept = np.setdiff1d(np.arange(rows.shape[1]), gone)
    return np.array(gone, int), kept
