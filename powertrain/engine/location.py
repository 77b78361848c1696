"""Where inside a step an indicator falls through zero: the Illinois method on the dense polynomial.

Indicators may be flat below zero (a torque that ends), where secants do not help: after slow progress it extrapolates from above, or
bisects.
"""

from __future__ import annotations

from powertrain.numerics.buffers import CHECKS, INFO, Bound, Memory, view

_AIM = 1e-11
"""A located indicator is below zero by this much, a tenth of the hysteresis, or at most by twice as much."""
_ITERATIONS = 150
_PLACES = (0.0, *CHECKS, 1.0)


class Locator:
    """Finds the first indicator that falls below zero in the last step of ``memory``."""

    def __init__(self, locate: Bound, memory: Memory) -> None:
        self._kept, self._call, self._above, self._g = locate, locate.call, memory.above, memory.g
        self._fraction, self._worst, self._info = view(memory.fraction), view(memory.worst), view(memory.info)

    def find(self, depth: float = 0.0) -> float | None:
        """The fraction of the last step at which the first indicator is just below ``-depth``, or None if none is on closer look.

        ``memory.at`` and ``memory.g`` hold the unknowns and indicators there.
        """
        fraction, worst, call, info = self._fraction, self._worst, self._call, self._info
        first = 1
        while info[INFO + first - 1] + depth > 0.0:
            first += 1
            if first == len(_PLACES):
                return None
        low, high = _PLACES[first - 1], _PLACES[first]
        self._above.fill(0.0)
        fraction[0] = high
        call()
        at_high = worst[0] + depth
        if at_high > 0.0:
            return None
        if at_high >= -2.0 * _AIM:
            return high
        self._above[:] = self._g
        if depth:
            self._above += depth
        fraction[0] = low
        call()
        at_low = worst[0] + depth
        return low if at_low <= 0.0 else self._between(low, high, at_low + _AIM, at_high + _AIM, depth + _AIM)

    def _between(self, low: float, high: float, at_low: float, at_high: float, aim: float) -> float:
        """``at_low`` > 0 > ``at_high`` are the values there, shifted so that the goal is zero."""
        fraction, worst, call, side = self._fraction, self._worst, self._call, 0
        before, at_before, slow = low, at_low, False
        weight_low, weight_high = at_low, at_high
        for _ in range(_ITERATIONS):
            if slow:
                q = low + (low - before) * at_low / (at_before - at_low) if at_before > at_low else low
            else:
                q = low + (high - low) * weight_low / (weight_low - weight_high)
            if not low < q < high:
                q = 0.5 * (low + high)
                if not low < q < high:
                    break
            fraction[0] = q
            call()
            value = worst[0] + aim
            if -_AIM <= value <= _AIM:
                return q
            if value > 0.0:
                slow, weight_high = value > 0.5 * at_low, 0.5 * weight_high if side == 1 else at_high
                before, at_before, low, at_low, weight_low, side = low, at_low, q, value, value, 1
            else:
                slow, weight_low = value < 0.5 * at_high, 0.5 * weight_low if side == 2 else at_low
                high, at_high, weight_high, side = q, value, value, 2
        fraction[0] = high
        call()
        return high
