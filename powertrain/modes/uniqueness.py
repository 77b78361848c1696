"""Checks whether other driving sides of lossy meshes are possible: a mesh that can lock itself may carry two different torques.

All other laws keep their modes: what rests stays at rest, although sliding may satisfy the laws as well.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import compress, product

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import SAME
from powertrain.language.reals import Array
from powertrain.language.symbols import depending
from powertrain.numerics.buffers import Memory

_MOST = 6


def pieces_of(dae: HybridDae) -> list[int]:
    """The indices of the switches that depend on torques: their combinations are the pieces of the bounds."""
    laws = ca.vertcat(*[dae.m[friction.index] for friction in dae.frictions])
    pieces = compress(dae.switches, depending([s.g for s in dae.switches], laws))
    return [s.index for s in pieces if s.time is None]


def others(memory: Memory, pieces: list[int], side: int, consistent: Callable[[], bool]) -> list[Array]:
    """Consistent modes with other torques in other ``pieces``; ``memory`` is restored, except for what ``consistent`` computes."""
    if not 0 < len(pieces) <= _MOST:
        return []
    m = memory.m
    start = m.copy()
    found, modes = [memory.frictions(side).torque], []
    for combination in product((0.0, 1.0), repeat=len(pieces)):
        m[pieces] = combination
        if np.array_equal(m, start) or not consistent():
            continue
        values = memory.frictions(side).torque
        # A torque may be round-off of the largest, so all have the uncertainty of that one.
        if np.isfinite(values).all() and all(
            np.any(np.abs(values - other) > SAME * (1.0 + np.abs(other).max())) for other in found
        ):
            found.append(values)
            modes.append(m.copy())
    m[:] = start
    return modes
