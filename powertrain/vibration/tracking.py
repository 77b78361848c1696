"""Which vibration at one operating point is which at the next one: the modal assurance criterion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from powertrain.vibration.eigenmodes import Vibrations

_SAME = 0.1
"""A vibration that shares less than this with any earlier one is a new one."""


def assurance(left: NDArray[Any], right: NDArray[Any], found: Vibrations) -> NDArray[np.float64]:
    """The modal assurance criterion between vibrations (``left``, ``right``: a column each) and those of another operating point.

    MAC_ij = |l_i^H r'_j| |l'_j^H r_i| with left eigenvectors l and right ones r, scaled to l_i^H r_i = 1. At the same point it is 1 for
    i = j and 0 otherwise, whatever the units of the states; without damping it is the MAC weighted with the mass matrix (Allemang,
    Sound and Vibration 37 (2003) 14-23). It is limited to 1.
    """
    product = np.abs(left.conj().T @ found.states) * np.abs(found.left.conj().T @ right).T
    return np.asarray(np.minimum(product, 1.0))


def track(row: list[Vibrations]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Which vibration of each point belongs to which mode (-1: none there), and its MAC with where the mode was seen last.

    The assignment with the greatest sum of MAC follows a mode through crossings. A mode that vanishes (overdamped, a clutch that opens)
    keeps its place and may come back; one that shares nothing with those before is a new mode.
    """
    size = row[0].states.shape[0]
    left, right = np.zeros((size, 0), complex), np.zeros((size, 0), complex)
    places: list[dict[int, tuple[int, float]]] = []
    for found in row:
        mac = assurance(left, right, found)
        pairs = [(i, j) for i, j in zip(*linear_sum_assignment(-mac), strict=True) if mac[i, j] >= _SAME]
        here = {int(i): (int(j), float(mac[i, j])) for i, j in pairs}
        seen = {j for j, _ in here.values()}
        new = [j for j in range(len(found.values)) if j not in seen]
        here |= {left.shape[1] + k: (j, 1.0) for k, j in enumerate(new)}
        left = np.hstack([left, np.zeros((size, len(new)))])
        right = np.hstack([right, np.zeros((size, len(new)))])
        for mode, (j, _) in here.items():
            left[:, mode], right[:, mode] = found.left[:, j], found.states[:, j]
        places.append(here)
    shape = len(row), left.shape[1]
    vibration, shared = np.full(shape, -1), np.full(shape, np.nan)
    for k, here in enumerate(places):
        for mode, (j, value) in here.items():
            vibration[k, mode], shared[k, mode] = j, value
    return vibration, shared
