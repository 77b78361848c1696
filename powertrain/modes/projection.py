"""Exactly zero speed of stuck laws that share states: the smallest correction of the states."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import HybridDae
from powertrain.numerics.buffers import Memory


def project(dae: HybridDae, memory: Memory, side: int) -> None:
    """Set the speeds of all stuck laws to zero by the minimum-norm change of x in ``memory.y[side]``."""
    laws = [law for law in dae.frictions if memory.m[law.index] == 0 and not law.algebraic and not law.prescribed]
    w = ca.vertcat(*[law.w for law in laws])
    function = ca.Function(
        "powertrain_speeds", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(w), ca.densify(ca.jacobian(w, dae.x))]
    )
    n, nz, nm, count = dae.x.numel(), dae.z.numel(), dae.m.numel(), dae.p.numel()
    y = memory.y[side]
    for _ in range(2):
        speed, gradient = function(memory.time[0], y[:n], y[n : n + nz], memory.m[:nm], memory.p[:count])
        y[:n] -= np.linalg.lstsq(np.array(gradient), np.array(speed).ravel(), rcond=None)[0]
