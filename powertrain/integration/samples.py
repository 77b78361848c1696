"""Whether the samples of indicators inside a step suffice to trust their signs in between."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.dae.tolerances import NOISE

ROUGH = 0.4
"""Samples do not resolve an indicator if its third difference exceeds this share of its size."""
WITHOUT = (1.0, 1.0, 1.0, 1.0, 0.0, 0.0)
"""The least ``extremes`` where there is no indicator."""
_BLUNT, _SKEW = 0.0012, 0.065
"""Bound on how much the minimum of a parabola between samples is too high: shares of its second and of its third difference.

3/4 of the fourth difference over 24, for a sine sampled at 1/32 of its period; and 2/3^1.5 of the third difference over 6.
"""
_BEYOND = 0.5
"""How far beyond the last sample a minimum counts, in sample distances.

A next step five times as long finds a minimum near its start too early, by up to 0.1 of its own sample distances: before the step starts.
"""


def least(values: ca.SX, without: float = 1.0) -> ca.SX:
    """The smallest entry, or ``without`` if there is none."""
    return ca.mmin(values) if values.numel() else ca.SX(without)


def extremes(samples: Sequence[ca.SX], noise: ca.SX) -> list[ca.SX]:
    """What decides on a step by its least value over all indicators: the samples, and what the ``survey`` finds, with the opposite sign."""
    dips, rough = survey(samples, noise)
    return [*samples, -dips, -rough]


def survey(samples: Sequence[ca.SX], noise: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Whether parabolas through the samples of an indicator dip below zero inside the step, and its relative third difference.

    ``samples`` has one entry for each indicator, and so do the results.

    Parabolas also count if they come as close to zero as their uncertainty. ``samples`` are the indicators at 1/4, 1/2, 3/4 and 1 of the
    step, ``noise`` their round-off: a second difference up to 4 times that and a third difference up to 8 times that says nothing, as for
    torques while nothing moves. A dip that is missed for this reason is at most half the round-off deep.
    The value at the start of the step is that of the cubic through the samples. If it is above zero, a parabola through it counts, too;
    if not, the indicator has just left zero.
    Indicators below zero at a sample are located anyway; another indicator that falls in the same step does not matter, as the dip may come
    first. Error control alone does not see the torques of stuck laws: the states stand still while these torques change.
    """
    a, b, c, d = samples
    bend, next_bend = a - 2 * b + c, b - 2 * c + d
    unsure = _SKEW * ca.fabs(next_bend - bend)
    straight = 4 * noise
    start = 4 * (a + c) - 6 * b - d
    early = ca.logic_and(start > unsure, _dips(a, (b - start) / 2, start - 2 * a + b, unsure, straight, (-1.0, 1.0)))
    first = _dips(b, (c - a) / 2, bend, unsure, straight, (-2.0, 1.0))
    second = _dips(c, (d - b) / 2, next_bend, unsure, straight, (-1.0, 1.0 + _BEYOND))
    lowest = ca.fmin(ca.fmin(a, b), ca.fmin(c, d))
    dips = ca.logic_and(lowest > 0, ca.logic_or(early, ca.logic_or(first, second)))
    size = ca.fmax(ca.fmax(ca.fabs(a), ca.fabs(b)), ca.fmax(ca.fabs(c), ca.fabs(d)))
    return dips, ca.fmax(0.0, (ca.fabs(next_bend - bend) - 2 * straight) / (size + NOISE))


def _dips(
    value: ca.SX, slope: ca.SX, bend: ca.SX, unsure: ca.SX, straight: ca.SX, between: tuple[float, float]
) -> ca.SX:
    """Whether the minimum of the parabola value + slope q + bend q^2/2 is ``between`` two places and below zero, within ``unsure``.

    The minimum is value - slope^2/(2 bend), at q = -slope/bend. A parabola that bends by no more than ``straight`` counts as straight.
    Before the samples, where an indicator may just have left zero, the parabola counts as exact.
    """
    low, high = between
    inside = ca.logic_and(ca.logic_and(slope <= -low * bend, -slope <= high * bend), bend > straight)
    error = ca.if_else(slope <= bend, unsure + _BLUNT * bend, 0)
    return ca.logic_and(inside, 2 * bend * (value - error) < slope**2)
