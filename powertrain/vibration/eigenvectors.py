"""Eigenvalues of a linear model that are not zero, with right and left eigenvectors."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from powertrain.analysis.reduction import ROUNDING

Matrix = NDArray[Any]


class Eigenvectors(NamedTuple):
    """``values``; ``right``: a r = s r, columns of length 1; ``left``: l^H a = s l^H, columns with l_i^H r_j = 1 for i = j, else 0.

    ``hidden``: sizes of eigenvalues that may not be zero, but are small enough next to the largest to count as such.
    """

    values: Matrix
    right: Matrix
    left: Matrix
    hidden: list[float]


def eigenvectors(a: Matrix) -> Eigenvectors:
    """The eigenvalues of a matrix that are not zero, and their eigenvectors.

    A rigid body that moves freely has the eigenvalue zero twice with one eigenvector. Rounding by eps splits it into two of sqrt(eps),
    which may look like a vibration. Therefore zeros are taken out by null spaces first, which rounding changes by eps only: in an
    orthonormal basis (n, r) with a n = 0, the matrix is (0, u; 0, a'). The null space of a', what moves into that of a, is taken out in
    the same way, until none is left. An eigenvector v of a' to the eigenvalue s gives n u v/s + r v of a, a left one l gives r l.
    """
    from scipy.linalg import matrix_balance

    inner, scale = matrix_balance(a, permute=False)
    size = float(np.linalg.norm(inner, 2)) if len(a) else 0.0
    limit, certain = ROUNDING * len(a) * size, float(np.finfo(float).eps) * len(a) * size
    turns: list[tuple[Matrix, Matrix, Matrix]] = []
    hidden: list[float] = []
    while len(inner):
        _, sizes, rows = np.linalg.svd(inner)
        rank = int((sizes > limit).sum())
        if rank == len(inner):
            break
        hidden += np.sqrt(sizes[rank:][sizes[rank:] > certain] * size).tolist()  # s^2/size is left of a vibration
        null, rest = rows[rank:].T, rows[:rank].T
        turns.append((null, rest, null.T @ inner @ rest))
        inner = rest.T @ inner @ rest
    values, right = (np.asarray(found, complex) for found in np.linalg.eig(inner))
    left = np.linalg.pinv(right).conj().T
    for null, rest, coupling in reversed(turns):
        right, left = null @ (coupling @ right / values) + rest @ right, rest @ left
    right, left = scale @ right, np.linalg.solve(scale.T, left)
    length = np.linalg.norm(right, axis=0)
    return Eigenvectors(values, right / length, left * length, hidden)
