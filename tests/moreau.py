"""Moreau's time stepping: forces are impulses over a step, found by projected Gauss-Seidel; and models of masses with laws between them.

J. J. Moreau, Numerical aspects of the sweeping process, Comput. Methods Appl. Mech. Eng. 177 (1999) 329-349.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import powertrain as pt

Array = NDArray[np.float64]


def project(impulse: Array, drive: Array, G: Array, low: Array, high: Array, acting: NDArray[np.bool_]) -> None:
    """Bring the ``acting`` impulses P within [low, high] to where drive - G P is zero, or drives them against their bound; others to 0."""
    impulse[~acting], change = 0.0, math.inf
    while change > 1e-12:
        before = impulse.copy()
        for n in np.flatnonzero(acting):
            impulse[n] = np.clip(impulse[n] + (drive[n] - G[n] @ impulse) / G[n, n], low[n], high[n])
        change = float(np.abs(impulse - before).max())


def masses(start: Sequence[float], forces: int, equations: Callable[[Any], pt.Equations]) -> pt.Component:
    """A model with places x0, x1, ... that begin at ``start``, speeds v0, v1, ... and forces f0, f1, ..."""
    fields: dict[str, Any] = {f"v{i}": pt.variable("m/s", "Speed", start=0.0) for i in range(len(start))}
    fields |= {f"x{i}": pt.variable("m", "Place", start=float(x)) for i, x in enumerate(start)}
    fields |= {f"f{n}": pt.variable("N", "Force") for n in range(forces)}
    members = fields | {"equations": equations, "__annotations__": dict.fromkeys(fields, pt.Variable)}
    model: pt.Component = type("Masses", (pt.Component,), members)()
    return model
