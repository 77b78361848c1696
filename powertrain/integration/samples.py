"""Whether the samples of indicators inside a step suffice to trust their signs in between."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.dae.tolerances import NOISE

ROUGH = 0.4
"""Samples do not resolve an indicator if its third difference exceeds this share of its size."""
WITHOUT = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0)
"""The least ``extremes`` where there is no indicator."""
_SKEW, _BLUNT = 0.065, 1 / 32
"""Bound on the error of a parabola between its samples: shares of the third and of the fourth difference about the middle one.

The next terms of Stirling's formula: max |q^3 - q|/6 = 3^-1.5 / 3, and max |q^4 - q^2|/24 = 1/96, times three for what follows.
"""
_BEYOND = 0.5
"""How far outside the step a minimum counts, in sample distances.

Beyond its end: a next step five times as long finds a minimum near its start too early, by up to 0.1 of its own sample distances.
Before its start, for the same reason, if the indicator falls there.
"""


def least(values: ca.SX, without: float = 1.0) -> ca.SX:
    """The smallest entry, or ``without`` if there is none."""
    return ca.mmin(values) if values.numel() else ca.SX(without)


def extremes(samples: Sequence[ca.SX], noise: ca.SX) -> list[ca.SX]:
    """What decides on a step by its least value over all indicators: samples after its start, and the ``survey`` with the opposite sign."""
    dips, rough = survey(samples, noise)
    return [*samples[1:], -dips, -rough]


def survey(samples: Sequence[ca.SX], noise: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Whether parabolas through the samples of an indicator dip below zero inside the step, and its relative third differences.

    ``samples`` has one entry for each indicator, and so do the results.

    Parabolas also count if they come as close to zero as their uncertainty. ``samples`` are the indicators at 0, 1/4, 1/2, 3/4 and 1 of the
    step, ``noise`` their round-off: a second difference up to 4 times that and a third difference up to 8 times that says nothing, as for
    torques while nothing moves. A dip that is missed for this reason is at most half the round-off deep.
    An indicator that does not fall at the start of the step has just left zero, and does not dip before it has risen.
    Indicators below zero at a sample are located anyway; another indicator that falls in the same step does not matter, as the dip may come
    first. Error control alone does not see the torques of stuck laws: the states stand still while these torques change.
    """
    start, a, b, c, d = samples
    bends = start - 2 * a + b, a - 2 * b + c, b - 2 * c + d
    early, late = bends[1] - bends[0], bends[2] - bends[1]  # third differences
    # by the slope of the quartic through all samples
    falls = ca.logic_and(start > 0, 48 * a - 36 * b + 16 * c - 3 * d < 25 * start)
    straight, fourth = 4 * noise, late - early
    first = _dips((start, a, b), early - fourth / 2, fourth, straight, (-1.0 - _BEYOND, 1.0))
    second = _dips((a, b, c), (early + late) / 2, fourth, straight, (-1.0, 1.0))
    third = _dips((b, c, d), late + fourth / 2, fourth, straight, (-1.0, 1.0 + _BEYOND))
    dips = ca.logic_and(
        ca.fmin(ca.fmin(a, b), ca.fmin(c, d)) > 0, ca.logic_or(ca.logic_and(falls, first), ca.logic_or(second, third))
    )
    size = ca.fmax(ca.fmax(ca.fabs(a), ca.fabs(b)), ca.fmax(ca.fabs(c), ca.fabs(d)))
    return dips, ca.fmax(0.0, (ca.fmax(ca.fabs(early), ca.fabs(late)) - 2 * straight) / (size + NOISE))


def _dips(
    samples: tuple[ca.SX, ca.SX, ca.SX], third: ca.SX, fourth: ca.SX, straight: ca.SX, between: tuple[float, float]
) -> ca.SX:
    """Whether the parabola value + slope q + bend q^2/2 through three samples has a minimum ``between`` two q below zero, within its error.

    The minimum is value - slope^2/(2 bend), at q = -slope/bend. A parabola that bends by no more than ``straight`` counts as straight.
    """
    before, value, after = samples
    slope, bend, (low, high) = (after - before) / 2, before - 2 * value + after, between
    inside = ca.logic_and(ca.logic_and(slope <= -low * bend, -slope <= high * bend), bend > straight)
    error = _SKEW * ca.fabs(third) + _BLUNT * ca.fabs(fourth)
    return ca.logic_and(inside, 2 * bend * (value - error) < slope**2)
