"""Exactly zero speed of stuck laws that share states: the smallest correction of the states."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.numerics.buffers import Evaluated, Memory

AT_REST = 1e-13
"""A stuck law may keep this speed."""


def project(dae: HybridDae, memory: Memory, side: int) -> None:
    """Set the speeds of all stuck laws to zero by the minimum-norm change of x in ``memory.y[side]``."""
    laws = [law for law in dae.frictions if not law.algebraic and not law.prescribed]
    if memory.speeds is None:
        memory.speeds = _speeds(dae, laws)
    stuck = [k for k, law in enumerate(laws) if memory.m[law.index] == 0]
    x = memory.y[side][: dae.x.numel()]
    for _ in range(2):
        speed, gradient = memory.speeds(*memory.instant(side))
        if not np.abs(speed[stuck]).max(initial=0.0) > AT_REST:
            break
        x -= np.linalg.lstsq(gradient[stuck], speed[stuck].ravel(), rcond=None)[0]


def _speeds(dae: HybridDae, laws: list[Friction]) -> Evaluated:
    w = ca.vertcat(*[law.w for law in laws])
    results = [ca.densify(w), ca.densify(ca.jacobian(w, dae.x))]
    return Evaluated(ca.Function("powertrain_speeds", [dae.t, dae.x, dae.z, dae.m, dae.p], results))
