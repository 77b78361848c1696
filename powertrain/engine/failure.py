"""Messages for runs that cannot continue: rates that are not finite, steps that become too small, values outside guards."""

from __future__ import annotations

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Guard, HybridDae
from powertrain.language.units import with_unit
from powertrain.modes.tolerances import LIMIT
from powertrain.numerics.buffers import Array, Memory

_AT_LIMIT = 1e-6
"""A value as near to its limit, relative to one and to the limit, is not quoted: it would look like the limit."""
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
    rates = ca.Function(
        "powertrain_rates", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(ca.vertcat(dae.xdot, dae.residual))]
    )
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


def guard_violation(dae: HybridDae, memory: Memory, side: int, guard: Guard, t: float) -> str | None:
    """The message for a guard whose value is outside its limits, or None."""
    value, low, high = _guard_values(dae, memory, side, guard, t)
    tolerance = LIMIT * (1.0 + min(abs(low), abs(high)))
    return _guard_text(guard, value, low, high, t) if value < low - tolerance or value > high + tolerance else None


def guard_message(dae: HybridDae, memory: Memory, side: int, guard: Guard, t: float) -> str:
    """The message for a guard whose limits are exceeded."""
    return _guard_text(guard, *_guard_values(dae, memory, side, guard, t), t)


def _guard_values(dae: HybridDae, memory: Memory, side: int, guard: Guard, t: float) -> tuple[float, float, float]:
    outputs = [ca.SX(guard.value), ca.SX(guard.low), ca.SX(guard.high)]
    function = ca.Function("powertrain_guard", [dae.t, dae.x, dae.z, dae.m, dae.p], outputs)
    n, y = dae.x.numel(), memory.y[side]
    values = function(t, y[:n], y[n : n + dae.z.numel()], memory.m[: dae.m.numel()], memory.p[: dae.p.numel()])
    value, low, high = (float(v) for v in values)
    return value, low, high


def _guard_text(guard: Guard, value: float, low: float, high: float, t: float) -> str:
    """Name the limit that was passed: at an event the value itself would look equal to it."""
    above = high - value < value - low
    limit = high if above else low
    said = with_unit(f"{value:.9g}", guard.unit)
    if abs(value - limit) <= _AT_LIMIT * (1.0 + abs(limit)):
        said = f"it {'rises above' if above else 'falls below'} {with_unit(f'{limit:.9g}', guard.unit)}"
    span = f"{low:.9g} to {high:.9g}"
    if not np.isfinite([low, high]).all():
        span = f"at least {low:.9g}" if high == np.inf else f"at most {high:.9g}"
    allowed = with_unit(span, guard.unit)
    return f"{guard.name} ({guard.where}) leaves its range at t = {t:.9g} s: {said}; allowed is {allowed}"
