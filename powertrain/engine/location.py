"""Where inside a step an indicator falls through zero: the Illinois method on the dense polynomial."""

from __future__ import annotations

from powertrain.engine.buffers import CHECKS, INFO, Bound, Memory, view

_OVERSHOOT = -2e-11
"""How far below zero a located indicator may be: a fifth of the hysteresis."""
_ITERATIONS = 150
_PATIENCE = 8
"""Iterations after which every second one bisects: indicators may be flat on one side."""


def locate_event(locate: Bound, memory: Memory) -> float | None:
    """The fraction of the last step at which the first indicator is just below zero, or None if none is on closer look.

    ``memory.at`` and ``memory.g`` hold the unknowns and indicators there.
    """
    places = (0.0, *CHECKS, 1.0)
    first = next(k for k in range(1, len(places)) if memory.info[INFO + k - 1] <= 0.0)
    low, high = places[first - 1], places[first]
    fraction, worst, call = view(memory.fraction), view(memory.worst), locate.call
    memory.mask.fill(1.0)
    fraction[0] = high
    call()
    at_high = worst[0]
    if at_high > 0.0:
        return None
    memory.mask[:] = memory.g <= 0.0
    if at_high >= _OVERSHOOT:
        return high
    fraction[0] = low
    call()
    at_low = worst[0]
    if at_low <= 0.0:
        return low
    side = 0
    for n in range(_ITERATIONS):
        q = low + (high - low) * at_low / (at_low - at_high)
        if not low < q < high or (n > _PATIENCE and n % 2):
            q = 0.5 * (low + high)
            if not low < q < high:
                break
        fraction[0] = q
        call()
        value = worst[0]
        if value > 0.0:
            low, at_low = q, value
            if side == 1:
                at_high *= 0.5
            side = 1
        elif value >= _OVERSHOOT:
            return float(q)
        else:
            high, at_high = q, value
            if side == 2:
                at_low *= 0.5
            side = 2
    fraction[0] = high
    call()
    return high
