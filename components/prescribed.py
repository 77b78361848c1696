"""Motions that follow a signal, of shafts and of rods: exactly, or through a filter that makes them sufficiently smooth."""

from __future__ import annotations

import math

from powertrain import Equations, Symbol, der

BESSEL = (1.3617, 0.6180)
"""Coefficients of s and s^2 of a second-order Bessel filter with a critical frequency of 1 rad/s."""


def following_position(x: Symbol, v: Symbol, reference: Symbol, exact: bool, f_crit: Symbol) -> Equations:
    """Exactly x = reference, or x + 1.3617 v/w_crit + 0.6180 der(v)/w_crit^2 = reference with w_crit = 2 pi f_crit; v = der(x)."""
    yield v == der(x)
    if exact:
        yield x == reference
    else:
        w_crit = 2 * math.pi * f_crit
        yield der(v) * BESSEL[1] == ((reference - x) * w_crit - BESSEL[0] * v) * w_crit


def following_speed(x: Symbol, v: Symbol, reference: Symbol, exact: bool, f_crit: Symbol) -> Equations:
    """Exactly v = reference, or der(v) = 2 pi f_crit (reference - v); v = der(x)."""
    yield v == der(x)
    if exact:
        yield v == reference
    else:
        yield der(v) == 2 * math.pi * f_crit * (reference - v)
