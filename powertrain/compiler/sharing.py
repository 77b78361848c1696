"""Friction laws on the same motion, such as a brake beside a bearing: while both are stuck only the sum of their torques is determined.

The members of such a group share the torque so that each is at the same fraction theta of its own interval,

    T_k = lower_k + theta (upper_k - lower_k),

so that all hold as long as the sum of their intervals holds, and all break loose together. What is shared is said in the events.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.symbols import Symbol

_LEAST = 1e-6
"""The room (N.m or N) of a group below which fractions of it mean nothing: what is left of a decaying torque, and round-off."""


@dataclass(frozen=True)
class Member:
    """One law of a group; ``sign`` aligns its motion with the first member's."""

    law: int
    sign: float
    stuck: Symbol
    torque: Symbol
    lower: Symbol
    upper: Symbol
    infinite: bool

    @property
    def low(self) -> Symbol:
        """Lower end of the interval in the group's direction."""
        return self.lower if self.sign > 0 else -self.upper

    @property
    def high(self) -> Symbol:
        """Upper end of the interval in the group's direction."""
        return self.upper if self.sign > 0 else -self.lower

    @property
    def aligned(self) -> Symbol:
        """The torque in the group's direction."""
        return self.torque if self.sign > 0 else -self.torque


def parallel(gradients: NDArray[np.float64]) -> list[list[tuple[int, float]]]:
    """Rows that are multiples of each other, as (row, sign of the multiple); groups of two rows or more."""
    groups: dict[tuple[float, ...], list[tuple[int, float]]] = {}
    for i, row in enumerate(gradients):
        largest = int(np.argmax(np.abs(row) > 0.5 * np.abs(row).max(initial=0.0))) if row.size else 0
        if not row.size or not np.isfinite(row).all() or not row[largest]:
            continue
        unit = tuple(np.round(row / row[largest], 9) + 0.0)
        groups.setdefault(unit, []).append((i, float(np.sign(row[largest]))))
    return [group for group in groups.values() if len(group) > 1]


def share(members: Sequence[Member], k: int, theta: Symbol | None) -> tuple[Symbol, Symbol]:
    """(condition, residual): while a member before the k-th is stuck too, the k-th one's equation is residual = 0.

    With ``theta`` the fraction is an unknown of its own, for bounds that depend on torques; else the rule is linear in the torques.
    """
    this, before = members[k], members[:k]
    joint = _any([m.stuck for m in before])
    rest = this.aligned - (0 if theta is not None else ca.fmax(this.low, ca.fmin(this.high, 0)))
    if all(m.infinite for m in before):
        return joint, rest
    finite = [m for m in before if not m.infinite]
    if theta is not None:
        ratio = _count(finite) * _rest(this, theta)
        ratio -= sum((ca.if_else(m.stuck, _rest(m, theta), 0) for m in finite), Symbol(0))
    else:
        taken = sum((ca.if_else(m.stuck, m.aligned - m.low, 0) for m in finite), Symbol(0))
        room = sum((ca.if_else(m.stuck, m.high - m.low, 0) for m in finite), Symbol(0))
        ratio = taken * (this.high - this.low) - (this.aligned - this.low) * room
    unlimited = [m.stuck for m in before if m.infinite]
    return joint, ca.if_else(_any(unlimited), rest, ratio) if unlimited else ratio


def fraction_residual(members: Sequence[Member], theta: Symbol) -> Symbol:
    """The equation of theta: all stuck torques together are at that fraction of all stuck intervals; one half where these vanish."""
    finite = [m for m in members if not m.infinite]
    taken = sum((ca.if_else(m.stuck, m.aligned - (m.low + m.high) / 2, 0) for m in finite), Symbol(0))
    room = sum((ca.if_else(m.stuck, m.high - m.low, 0) for m in finite), Symbol(0))
    share = ca.if_else(_count(finite) >= 2, taken * room / (room**2 + _LEAST**2), 0)
    return theta - 0.5 - share


def _rest(member: Member, theta: Symbol) -> Symbol:
    """What a torque has beside its fraction: where some law must break loose, or no interval is left, all of a group have the same."""
    inside = ca.fmax(0, ca.fmin(1, theta)) - 0.5
    return member.aligned - (member.low + member.high) / 2 - inside * (member.high - member.low)


def _count(members: Sequence[Member]) -> Symbol:
    return sum((ca.if_else(m.stuck, 1, 0) for m in members), Symbol(0))


def joint_interval(members: Sequence[Member], k: int) -> tuple[Symbol, Symbol, Symbol, Symbol]:
    """(condition, torque, lower, upper) by which the k-th member breaks loose while others are stuck with it: those of all of them."""
    this = members[k]
    others = _any([m.stuck for i, m in enumerate(members) if i != k])
    finite = [m for m in members if not m.infinite] if not this.infinite else list(members)
    torque = sum((ca.if_else(m.stuck, m.aligned, 0) for m in finite), Symbol(0))
    low = sum((ca.if_else(m.stuck, m.low, 0) for m in finite), Symbol(0))
    high = sum((ca.if_else(m.stuck, m.high, 0) for m in finite), Symbol(0))
    both = ca.logic_and(this.stuck, others)
    return (both, torque, low, high) if this.sign > 0 else (both, -torque, -high, -low)


def _any(conditions: Sequence[Symbol]) -> Symbol:
    found = Symbol(0)
    for condition in conditions:
        found = ca.logic_or(found, condition)
    return found
