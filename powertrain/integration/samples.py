"""Whether the indicators' samples inside one step are enough to trust their signs in between."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

ROUGH = 0.4
"""Above this share of its size, the third difference of an indicator says that its samples do not resolve it."""
_NOISE = 1e-6
"""Indicators below this size (rad/s, N.m, ...) are not asked to be smooth."""


def least(values: ca.SX) -> ca.SX:
    """The smallest entry, or 1 where there is none."""
    smallest = values[0] if values.numel() else ca.SX(1.0)
    for i in range(1, values.numel()):
        smallest = ca.fmin(smallest, values[i])
    return smallest


def survey(samples: Sequence[ca.SX]) -> tuple[ca.SX, ca.SX]:
    """Whether parabolas through an indicator's samples dip below zero inside the step, and the largest relative third difference.

    ``samples`` are the indicators at 1/4, 1/2, 3/4 and 1 of the step. Error control alone does not see what stuck laws carry: their
    states stand still while the torques change.
    """
    dips, rough = ca.SX(0.0), ca.SX(0.0)
    for i in range(samples[0].numel()):
        a, b, c, d = (sample[i] for sample in samples)
        bend, next_bend = a - 2 * b + c, b - 2 * c + d
        both = ca.logic_or(_dips(b, (c - a) / 2, bend, 2.0), _dips(c, (d - b) / 2, next_bend, 1.0))
        dips = ca.logic_or(dips, both)
        size = ca.fmax(ca.fmax(ca.fabs(a), ca.fabs(b)), ca.fmax(ca.fabs(c), ca.fabs(d)))
        rough = ca.fmax(rough, ca.fabs(next_bend - bend) / (size + _NOISE))
    return dips, rough


def _dips(value: ca.SX, slope: ca.SX, bend: ca.SX, before: float) -> ca.SX:
    """Whether the parabola value + slope q + bend q^2/2 has a minimum below zero for -before <= q <= 1.

    The minimum is value - slope^2/(2 bend), at q = -slope/bend. ``inside`` implies bend > 0, or slope = bend = 0, where there is none.
    """
    inside = ca.logic_and(slope <= before * bend, -slope <= bend)
    return ca.logic_and(inside, 2 * bend * value < slope**2)
