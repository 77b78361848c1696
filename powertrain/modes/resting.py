"""Laws at a limit of their torque that do not slide, because stuck laws and closed contacts hold what they move.

Example: a mass is pressed against a stop harder than its friction can resist. Friction is at its limit, yet the mass rests. The speed of
such a law follows from those of the holding laws, w = c w_C, so its rate a = b - G tau is the same combination of theirs:

    G_i - c G_C = 0,  b_i - c b_C = 0,  c = G_iC G_CC^+.

It stays at rest as long as they hold. A prescribed motion leaves a difference in b only.
(See ``powertrain.modes.complementarity`` for G.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import HybridDae
from powertrain.modes.complementarity import Complementarity, Point
from powertrain.modes.tolerances import INTEGRATED

SINGULAR = 1e-10
"""Relative rank tolerance: smaller mobilities left by the holding laws count as held. It is also the uncertainty of c."""
NOTHING = 1e-8
"""Rates are the same combination if they differ by less than this share of their terms."""


def resting(dae: HybridDae, problem: Complementarity, point: Point) -> list[int]:
    """The places in the held values that mark the friction laws at a limit that others hold at rest at ``point``."""
    modes, count = point.m[problem.laws.index], problem.laws.frictions
    holds = np.concatenate([modes[:count] == 0.0, modes[count:] == 1.0])
    limited = [k for k, law in enumerate(dae.frictions) if law.rests is not None and abs(modes[k]) == 1.0]
    if not limited or not holds.any():
        return []
    near = problem.laws.at(point, np.zeros(problem.laws.count))
    if not np.isfinite(near.rate_slope).all():
        return []
    size = np.sqrt(_mobility(-np.diag(near.rate_slope), near.reach))
    held = _follow(-near.rate_slope / np.outer(size, size), near.rate / size, limited, holds)
    rest = problem.laws.at_rest(point, near, INTEGRATED)
    marks = [dae.frictions[k].rests for k, follows in zip(limited, held, strict=True) if follows and rest[k]]
    return [place for place in marks if place is not None]


def _mobility(own: NDArray[np.float64], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """G_ii, or the size of its terms if they cancel, as for a clutch between two shafts that gears tie to each other."""
    return np.where(np.abs(own) > SINGULAR * terms, np.abs(own), np.where(terms > 0.0, terms, 1.0))


def _follow(G: NDArray[np.float64], b: NDArray[np.float64], rows: list[int], holds: NDArray[np.bool_]) -> list[bool]:
    """Whether each of these rates is a combination of the rates of the holding laws, each scaled by its own size."""
    c = np.linalg.lstsq(G[np.ix_(holds, holds)], G[holds][:, rows], rcond=SINGULAR)[0]
    left = np.abs(G[rows] - c.T @ G[holds]).max(axis=1)
    moved = np.abs(b[rows] - c.T @ b[holds])
    terms = np.abs(b[rows]) + np.abs(c.T) @ np.abs(b[holds])
    known = NOTHING * terms + SINGULAR * np.abs(b[holds]).sum()
    return [bool(one) for one in (left <= NOTHING) & (moved <= known)]
