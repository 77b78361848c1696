"""Exactly zero speed of stuck laws that share states: the smallest correction of the states."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Friction, HybridDae
from powertrain.numerics.buffers import Evaluated, Memory

AT_REST = 1e-13
"""A stuck law may keep this speed, or the rounding of the speeds whose difference it is."""
EPS = float(np.finfo(float).eps)


def project(dae: HybridDae, memory: Memory, side: int) -> None:
    """Set the speeds of all stuck laws to zero by the minimum-norm change of x in ``memory.y[side]``."""
    laws = [law for law in dae.frictions if not law.algebraic and not law.prescribed]
    if memory.speeds is None:
        memory.speeds = _speeds(dae, laws)
    stuck = [k for k, law in enumerate(laws) if memory.m[law.index] == 0]
    x = memory.y[side][: dae.x.numel()]
    for _ in range(2):
        found, slopes = memory.speeds(*memory.instant(side))
        speed, gradient = found[stuck].ravel(), slopes[stuck]
        rounding = EPS * (np.abs(gradient) @ np.abs(x))
        if not (np.abs(speed) > np.maximum(AT_REST, rounding)).any():
            break
        x -= np.linalg.lstsq(gradient, speed, rcond=None)[0]


def _speeds(dae: HybridDae, laws: list[Friction]) -> Evaluated:
    w = ca.vertcat(*[law.w for law in laws])
    results = [ca.densify(w), ca.densify(ca.jacobian(w, dae.x))]
    return Evaluated(ca.Function("powertrain_speeds", [dae.t, dae.x, dae.z, dae.m, dae.p], results))
