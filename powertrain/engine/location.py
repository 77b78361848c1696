"""Locates the zero crossing of an indicator within a step: the Illinois method on the dense polynomial.

Secants fail if an indicator is constant on one side of zero: above (a law that is inactive until then) or below (a torque that ends).
There the method extrapolates from the other side, or bisects.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from powertrain.dae.tolerances import EPS
from powertrain.language.reals import Array
from powertrain.numerics.buffers import CHECKS, INFO, Call, Memory, view

AIM = 0.1 * EPS
"""A located indicator is below zero by this much, a tenth of the hysteresis, or at most twice as much."""
CLOSE, LARGEST = 1e-10, 1e-9
"""Once the bracket is narrower than the first (share of the step), the accepted depth doubles at each trial, up to the second."""
ITERATIONS = 150
MOST_IDLE = 1000
"""So many located events in a row that change nothing stop time."""
_PLACES = (0.0, *CHECKS, 1.0)


class Locator:
    """Finds the first indicator that falls below zero in the last step of ``memory``."""

    def __init__(self, locate: Call, memory: Memory) -> None:
        self._call, self._above, self._g = locate, memory.above, memory.g
        self._fraction, self._worst, self._info = view(memory.fraction), view(memory.worst), view(memory.info)

    def find(self, depth: float = 0.0) -> float | None:
        """The fraction of the last step at which the first indicator is just below ``-depth``, or None if none falls below.

        ``memory.at`` and ``memory.g`` hold the unknowns and indicators there.
        """
        info, first = self._info, 1
        while info[INFO + first - 1] + depth > 0.0:
            first += 1
            if first == len(_PLACES):
                return None
        low, high = _PLACES[first - 1], _PLACES[first]
        self._above.fill(0.0)
        at_high = self._value(high) + depth
        if at_high > 0.0:
            return None
        if at_high >= -2.0 * AIM:
            return high
        self._above[:] = self._g
        if depth:
            self._above += depth
        at_low = self._value(low) + depth
        return low if at_low <= 0.0 else self._first(low, high, at_low, at_high, depth)

    def _first(self, low: float, high: float, at_low: float, at_high: float, depth: float) -> float:
        """Like ``_between``, but indicators that are above zero at ``high`` also count if they are below at the located point or midway.

        They fell earlier and rose again: after the modes had ceased to hold, e.g. a stuck law loaded by another law that was free until
        then; or within a quarter of the step, which the samples of the step do not see.
        """
        above, start = self._above, self._g + depth
        while True:
            high = self._between(low, high, at_low + AIM, at_high + AIM, depth + AIM)
            earlier = self._fallen(start, depth)
            if not earlier.any() and (above > 0.0).any():
                self._value(0.5 * (low + high))
                earlier = self._fallen(start, depth)
                if earlier.any():
                    high = 0.5 * (low + high)
                else:
                    self._value(high)
            if not earlier.any():
                return high
            there = self._g + depth
            above[earlier] = there[earlier]
            at_low, at_high = float(start[above <= 0.0].min()), float(there[above <= 0.0].min())

    def _fallen(self, start: Array, depth: float) -> NDArray[np.bool_]:
        """Which indicators outside the search are below zero at the present place, and were above it at the start."""
        return np.asarray((self._above > 0.0) & (start > 0.0) & (self._g + depth < -2.0 * AIM))

    def _value(self, place: float) -> float:
        """The least indicator in the search at a fraction of the step."""
        self._fraction[0] = place
        self._call()
        return float(self._worst[0])

    def _between(self, low: float, high: float, at_low: float, at_high: float, aim: float) -> float:
        """The crossing between ``low`` and ``high``; ``at_low`` > 0 > ``at_high`` are the values there minus the goal."""
        fraction, worst, call, side = self._fraction, self._worst, self._call, 0
        before, at_before, beyond, at_beyond = low, at_low, high, at_high
        weight_low, weight_high, flat_above, flat_below = at_low, at_high, False, False
        enough = AIM
        for _ in range(ITERATIONS):
            if high - low < CLOSE:
                enough = min(2.0 * enough, LARGEST)
                if at_high >= -enough:
                    break
            if flat_above:
                q = high - (beyond - high) * at_high / (at_beyond - at_high) if at_beyond < at_high else high
            elif flat_below:
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
            if -enough <= value <= AIM:
                return q
            if value > 0.0:
                flat_above, weight_high = value > 0.5 * at_low, 0.5 * weight_high if side == 1 else at_high
                before, at_before, low, at_low, weight_low, side = low, at_low, q, value, value, 1
            else:
                flat_below, weight_low = value < 0.5 * at_high, 0.5 * weight_low if side == 2 else at_low
                beyond, at_beyond, high, at_high, weight_high, side = high, at_high, q, value, value, 2
        self._value(high)
        return high
