"""Laws that switch at one instant and act on each other.

A change of an unknown may let any of them be first. In one such order, with rates f_0 before, f_j after the first j laws and the map
s -> R_j(t, s) of the resets of law j,

    S+ = R S + sum_j R_k ... R_(j+1) e_j d(tau'_j),   e_j = R_j f_(j-1) + R_j,t - f_j,
    d(tau'_j) = (d(tau_j) + sum_(l<j) grad tau_j . R_(j-1) ... R_(l+1) e_l d(tau'_l)) / (1 + grad tau_j . (f_0 - f_(j-1))),

where d(tau_j) is the motion of the instant of law j alone. The run then has one derivative for each order, and one-sided derivatives for
each unknown. For two laws, their mean is what central differences give. For more laws, the mean over all orders is close to that, and the
order farthest from it bounds the difference. If all d(tau) agree, so do all orders. Resets must leave alone what the other instants depend
on, and lead to one state in every order.

A. Pang, D. Stewart: Solution dependence on initial conditions in differential variational inequalities, Math. Program. 116 (2009) 429-460
(directional derivatives of nonsmooth flows).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array

Parts = NDArray[np.float64]
"""The effect of the motion of each law's instant, one row per law."""
Order = tuple[int, ...]
_LARGEST = 4
"""The largest number of laws for which every order is tried."""
_STOPPED = 1e-6
"""If an indicator falls slower by this factor after another law has switched, its law may not switch at all."""


@dataclass(frozen=True)
class Leg:
    """What one law does in an order: the rates after it, and the map of its resets by s and t, which changes some entries of s."""

    rates: Array
    s: Parts
    t: Array
    changed: NDArray[np.intp]


def over_orders(
    gradients: Sequence[Array], before: Array, change: Array, legs: Callable[[Sequence[Order]], list[list[Leg]]]
) -> tuple[Parts, Parts]:
    """The mean over the orders, and the deviation of the order farthest from it.

    ``gradients``: of the instants with respect to s; ``legs``: those of some orders, or nothing if these do not lead to the same state.
    """
    orders = _orders(len(gradients))
    found = [_in_order(order, gradients, before, each) for order, each in zip(orders, legs(orders), strict=False)]
    if not found or any(parts is None or not np.isfinite(parts).all() for parts in found):
        return undecided(change, len(gradients))
    each = np.array(found)
    mean = each.mean(axis=0)
    apart = each - mean
    return mean, apart[int(np.abs(apart).max(axis=(1, 2)).argmax())]


def _orders(count: int) -> list[Order]:
    """All orders of a few laws; of more, the cyclic ones, with each law at each place and each pair as often in either order."""
    if count <= _LARGEST:
        return list(permutations(range(count)))
    around = [tuple((first + j) % count for j in range(count)) for first in range(count)]
    return around + [order[::-1] for order in around]


def undecided(change: Array, count: int) -> tuple[Parts, Parts]:
    """The whole change with the mean instant, and the deviation with the first."""
    mean = np.full((count, 1), 1.0 / count) * change
    return mean, np.eye(count)[:, :1] * change - mean


def _in_order(order: Order, gradients: Sequence[Array], before: Array, legs: Sequence[Leg]) -> Parts | None:
    """The parts of all laws if they switch in one order; None if one of them might not switch any more."""
    count, rates = len(order), before
    moves, effects = np.zeros((count, count)), np.zeros((0, len(before)))
    for j, (law, leg) in enumerate(zip(order, legs, strict=True)):
        gradient = gradients[law]
        slowed = 1.0 + gradient @ (before - rates)[: len(gradient)]
        if slowed < _STOPPED or any(gradients[other][leg.changed].any() for other in order[j + 1 :]):
            return None
        moves[j, law] = 1.0
        moves[j] = (moves[j] + effects[:, : len(gradient)] @ gradient @ moves[:j]) / slowed
        effects = np.vstack([effects @ leg.s.T, leg.s @ rates + leg.t - leg.rates])
        rates = leg.rates
    return np.asarray(moves.T @ effects, float)
