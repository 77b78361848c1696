"""Algebraic unknowns that are explicit once all modes are known: then the model is an ODE, and an explicit step serves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from powertrain.engine.buffers import CHECKS
from powertrain.engine.sparse_lu import factorize
from powertrain.engine.step import Step, on_polynomial

STRICT = 4.0
"""How often the error estimate counts: so the results are as accurate as those of the implicit method, whose estimate says more."""
_POWERS = np.linalg.inv(np.vander((0.0, *CHECKS, 1.0), increasing=True))
"""From the values at the start, at the samples and at the end to the coefficients of their quartic."""


def solution(residual: Callable[[ca.SX], ca.SX], z: ca.SX, rows: Sequence[int] | None) -> ca.SX:
    """The z with 0 = residual(z). ValueError where that is not linear in z, KeyError where a pivot of ``rows`` is missing."""
    jacobian = ca.jacobian(residual(z), z)
    if ca.depends_on(jacobian, z):
        raise ValueError("the algebraic unknowns are implicit")
    return -factorize(jacobian, rows)(ca.densify(residual(ca.SX.zeros(z.numel()))))


def with_algebra(taken: Step, settled: Callable[[ca.SX, ca.SX], ca.SX], states: int, t: ca.SX, h: ca.SX) -> Step:
    """A step of the states with the algebraic unknowns that follow from them; in between these lie on a quartic through the samples.

    ``settled`` gives them at a time for unknowns (x, z) of which it reads x.
    """
    first, last = taken.dense[states:, 0], settled(t + h, taken.end)
    inside = [settled(t + q * h, on_polynomial(taken.dense, q)) for q in CHECKS]
    values = [first, *inside, last]
    quartic = ca.horzcat(*[_combined(row, values) for row in _POWERS.tolist()])
    dense = ca.vertcat(taken.dense[:states, :], quartic)
    return replace(taken, end=ca.vertcat(taken.end[:states, :], last), error=STRICT * taken.error, dense=dense)


def _combined(weights: Sequence[float], values: Sequence[ca.SX]) -> ca.SX:
    """The combination, written with differences from the first value, so that what is constant stays so."""
    whole = round(sum(weights))
    rest = sum((w * (v - values[0]) for w, v in zip(weights[1:], values[1:], strict=True)), 0 * values[0])
    return rest + whole * values[0] if whole else rest
