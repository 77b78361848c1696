"""Messages for runs that cannot continue: rates that are not finite, steps that become too small."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.numerics.buffers import Array, Memory

OUTSIDE = "A function of the model is evaluated outside its range there."


def _first_not_finite(dae: HybridDae, slope: Array) -> str | None:
    n = dae.x.numel()
    bad = np.flatnonzero(~np.isfinite(slope[: n + dae.z.numel()]))
    if not bad.size:
        return None
    k = int(bad[0])
    what = f"the derivative of {dae.state_names[k]}" if k < n else f"left minus right of {dae.equation(k - n)}"
    return f"{what} is {slope[k]:g}"


def not_finite(dae: HybridDae, memory: Memory, side: int, t: float) -> str:
    """Name the first state whose derivative is not finite."""
    reason = _first_not_finite(dae, memory.slope[side]) or "a derivative is not finite"
    return f"at t = {t:.9g} s {reason}. {OUTSIDE}"


def underflow(dae: HybridDae, memory: Memory, side: int, t: float, h: float) -> str:
    """Look just ahead for a derivative that is not finite; otherwise name the state that requires the smallest step."""
    n = dae.x.numel()
    rates = dae.function("rates", ca.vertcat(dae.xdot, dae.residual))
    y, m, p = memory.y[side], memory.m[: dae.m.numel()], memory.p[: dae.p.numel()]
    here = np.array(rates(t, y[:n], y[n : n + dae.z.numel()], m, p)).ravel()
    reason = _first_not_finite(dae, here)
    if reason:
        return f"at t = {t:.9g} s {reason}. {OUTSIDE}"
    for ahead in (h, 1e3 * h, 1e6 * h, 1e9 * h):
        there = np.array(rates(t + ahead, y[:n] + ahead * here[:n], y[n : n + dae.z.numel()], m, p)).ravel()
        reason = _first_not_finite(dae, there)
        if reason:
            return f"just after t = {t:.9g} s {reason}. {OUTSIDE}"
    size = np.abs(here[:n]) / (memory.tolerance[1] * dae.sizes[:n] + memory.tolerance[0] * np.abs(y[:n]))
    worst = dae.state_names[int(np.argmax(size))] if n else "an algebraic equation"
    return (
        f"the step size becomes too small at t = {t:.9g} s (h = {h:.3g} s); {worst} changes fastest. "
        "The model may have a singularity there, or a jump that is not declared as an event."
    )
