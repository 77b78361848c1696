"""Laws that switch at one instant and act on each other.

A change of an unknown may let any of them be first. In one such order, with rates f_0 before, f_j after the first j laws and f_k after all,

    S+ = S + sum_j (f_(j-1) - f_j) d(tau'_j),   d(tau'_j) = (d(tau_j) + sum_(l<j) c_jl d(tau'_l)) / (1 + sum_(l<j) c_jl),
    c_jl = grad tau_j . (f_(l-1) - f_l),

where d(tau_j) is the motion of the instant of law j alone. The run then has one derivative for each order, and one-sided derivatives for
each unknown. For two laws, their mean is what central differences give. For more laws, the mean over all orders is close to that, and the
order farthest from it bounds the difference. If all d(tau) agree, so do all orders.

A. Pang, D. Stewart: Solution dependence on initial conditions in differential variational inequalities, Math. Program. 116 (2009) 429-460
(directional derivatives of nonsmooth flows).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from powertrain.numerics.buffers import Array

Parts = NDArray[np.float64]
"""The effect of the motion of each law's instant, one row per law."""
_LARGEST = 4
"""The largest number of laws for which every order is tried."""
_STOPPED = 1e-6
"""If an indicator falls slower by this factor after another law has switched, its law may not switch at all."""


def over_orders(
    gradients: Sequence[Array], before: Array, after: Array, between: Callable[[list[tuple[int, ...]]], Parts]
) -> tuple[Parts, Parts]:
    """The mean over the orders, and the deviation of the order farthest from it.

    ``gradients``: of the instants with respect to s; ``between``: the rates if only some of the laws have switched.
    """
    count = len(gradients)
    orders = _orders(count)
    subsets = sorted({tuple(sorted(order[:j])) for order in orders for j in range(1, count)})
    rates = {(): before, tuple(range(count)): after} | dict(zip(subsets, between(subsets), strict=True))
    found = [_in_order(order, gradients, rates) for order in orders]
    if any(parts is None or not np.isfinite(parts).all() for parts in found):
        return undecided(before - after, count)
    each = np.array(found)
    mean = each.mean(axis=0)
    apart = each - mean
    return mean, apart[int(np.abs(apart).max(axis=(1, 2)).argmax())]


def _orders(count: int) -> list[tuple[int, ...]]:
    """All orders of a few laws; of more, the cyclic ones, with each law at each place and each pair as often in either order."""
    if count <= _LARGEST:
        return list(permutations(range(count)))
    around = [tuple((first + j) % count for j in range(count)) for first in range(count)]
    return around + [order[::-1] for order in around]


def undecided(change: Array, count: int) -> tuple[Parts, Parts]:
    """The whole change with the mean instant, and the deviation with the first."""
    mean = np.full((count, 1), 1.0 / count) * change
    return mean, np.eye(count)[:, :1] * change - mean


def _in_order(order: tuple[int, ...], gradients: Sequence[Array], rates: dict[tuple[int, ...], Array]) -> Parts | None:
    """The parts of all laws if they switch in one order; None if one of them might not switch any more."""
    count = len(order)
    moves, parts = np.zeros((count, count)), np.zeros((count, len(rates[()])))
    changes: list[Array] = []
    for j, law in enumerate(order):
        gradient = gradients[law]
        c = np.array([gradient @ change[: len(gradient)] for change in changes])
        if 1.0 + c.sum() < _STOPPED:
            return None
        moves[j, law] = 1.0
        moves[j] = (moves[j] + c @ moves[:j]) / (1.0 + c.sum()) if j else moves[j]
        changes.append(rates[tuple(sorted(order[:j]))] - rates[tuple(sorted(order[: j + 1]))])
        parts += np.outer(moves[j], changes[-1])
    return parts
