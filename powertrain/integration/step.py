"""The result of one symbolic step of an integration method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca


@dataclass(frozen=True)
class StepResult:
    """The unknowns at the end, the error estimate and the dense output of one step.

    ``dense`` has five columns c0 ... c4: y(t + q h) = c0 + q (c1 + q (c2 + q (c3 + q c4))), 0 <= q <= 1.
    """

    end: ca.SX
    error: ca.SX
    dense: ca.SX
    stiffness: ca.SX


def combined(weights: Sequence[float], stages: Sequence[ca.SX]) -> ca.SX:
    """The sum of the stages with their weights."""
    used = [(a, u) for a, u in zip(weights, stages, strict=True) if a]
    return ca.mtimes(ca.horzcat(*(u for _, u in used)), ca.DM([a for a, _ in used]))


def on_polynomial(dense: ca.SX, q: ca.SX | float) -> ca.SX:
    """The unknowns at the fraction ``q`` of the step."""
    value = dense[:, 4]
    for column in (3, 2, 1, 0):
        value = dense[:, column] + q * value
    return value


def slope_of_polynomial(dense: ca.SX, q: ca.SX | float) -> ca.SX:
    """d/dq of the unknowns at the fraction ``q`` of the step."""
    value = 4 * dense[:, 4]
    for column in (3, 2, 1):
        value = column * dense[:, column] + q * value
    return value
