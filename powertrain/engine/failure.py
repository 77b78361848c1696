"""Messages for runs that cannot continue: rates that are not finite, steps that become too small."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import LEAST_TORQUE
from powertrain.language.reals import Array
from powertrain.numerics.buffers import Memory

OUTSIDE = "A function of the model is evaluated outside its range there."

_SINGULAR = 1e-4
"""Smallest singular value, of rows of length one, below which equations count as singular where a run cannot go on."""


def _first_not_finite(dae: HybridDae, rates: Array) -> str | None:
    n = dae.x.numel()
    bad = np.flatnonzero(~np.isfinite(rates[: n + dae.z.numel()]))
    if not bad.size:
        return None
    k = int(bad[0])
    what = f"the derivative of {dae.state_names[k]}" if k < n else f"left minus right of {dae.equation(k - n)}"
    return f"{what} is {rates[k]:g}"


def not_finite(dae: HybridDae, memory: Memory, side: int, t: float) -> str:
    """Name the first state whose derivative is not finite."""
    reason = _first_not_finite(dae, memory.reached[side]) or "a derivative is not finite"
    return f"at t = {t:.9g} s {reason}. {OUTSIDE}"


def _undetermined(dae: HybridDae, memory: Memory, side: int, t: float) -> str | None:
    """The algebraic equation whose slope in the unknowns vanishes, if there is one."""
    n, nz = dae.x.numel(), dae.z.numel()
    slopes = dae.function("slopes", ca.jacobian(dae.residual, ca.vertcat(dae.x, dae.z)))
    rows = np.array(slopes(*memory.values(t, memory.y[side], memory.m))).reshape(nz, n + nz) * dae.sizes
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    if not nz or not np.isfinite(rows).all():
        return None
    if (flat := np.flatnonzero(lengths <= LEAST_TORQUE)).size:
        unknowns = ", ".join(s.name() for s in ca.symvar(dae.residual[int(flat[0])]) if ca.depends_on(dae.z, s))
        return (
            f"at t = {t:.9g} s an equation does not determine {unknowns}: its slope is zero there, as that of w^2 at w = 0. Give what it "
            f"moves an inertia or a mass.\n  {dae.equation(int(flat[0]))}"
        )
    left, values, right = np.linalg.svd((rows / lengths)[:, n:])
    if values[-1] > _SINGULAR:
        return None
    unknown, equation = dae.z[int(np.abs(right[-1]).argmax())].name(), dae.equation(int(np.abs(left[:, -1]).argmax()))
    return (
        f"at t = {t:.9g} s the equations no longer determine {unknown} from the states ({', '.join(dae.state_names)}). States are "
        f"selected once, for a whole run: describe the motion by a coordinate that stays valid, such as an angle in place of x and y.\n"
        f"  {equation}"
    )


def underflow(dae: HybridDae, memory: Memory, side: int, t: float, h: float) -> str:
    """Look for equations that are singular, then just ahead for a derivative that is not finite; else name the fastest state."""
    n = dae.x.numel()
    rates = dae.function("rates", ca.vertcat(dae.xdot, dae.residual))
    _, x, z, m, p = memory.values(t, memory.y[side], memory.m)
    here = np.array(rates(t, x, z, m, p)).ravel()
    reason = _first_not_finite(dae, here)
    if reason:
        return f"at t = {t:.9g} s {reason}. {OUTSIDE}"
    if reason := _undetermined(dae, memory, side, t):
        return reason
    for ahead in (h, 1e3 * h, 1e6 * h, 1e9 * h):
        there = np.array(rates(t + ahead, x + ahead * here[:n], z, m, p)).ravel()
        reason = _first_not_finite(dae, there)
        if reason:
            return f"just after t = {t:.9g} s {reason}. {OUTSIDE}"
    size = np.abs(here[:n]) / (memory.tolerance[1] * dae.sizes[:n] + memory.tolerance[0] * np.abs(x))
    worst = dae.state_names[int(np.argmax(size))] if n else "an algebraic equation"
    return (
        f"the step size becomes too small at t = {t:.9g} s (h = {h:.3g} s); {worst} changes fastest. "
        "The model may have a singularity there, or a jump that is not declared as an event."
    )
