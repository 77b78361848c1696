"""When a gear schedule shifts: one rule, which schedules state as equations and trials evaluate with numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from powertrain import Symbol
from powertrain.components.body.body import G_N
from powertrain.components.limited import limited

NEVER = 1e9
"""A speed, in m/s or rad/s, that nothing reaches."""
STANDS = 1.0
"""A limit in rad/s below which there is none: an engine may stand while a machine drives."""
PRESSED, RESUMED = 0.01, 0.2
"""Brake position at which a driver begins to slow down, and accelerator position at which he drives on. Below it he may hold the speed of a
descent: the accelerator at which an engine delivers no torque is its motoring torque over the torque of combustion at full load."""
SHORTEST = 1e-6
"""Smallest travel of the pedal from ``kick`` to the floor: with ``kick`` = 1 there is no kick-down, and no division by zero."""


def beyond(kick: Symbol | float, accelerator: Symbol) -> Symbol:
    """How far the accelerator is pressed between the position for kick-down and the floor, 0 to 1."""
    return limited((accelerator - kick) / ca.fmax(1 - kick, SHORTEST))


class Driving(NamedTuple):
    """The quantities by which a schedule chooses the gear."""

    v: Symbol
    """Speed of the vehicle [m/s]."""
    w: Symbol
    """Speed of the engine [rad/s]."""
    accelerator: Symbol
    """Accelerator pedal, 0 to 1."""
    gear: Symbol
    """The present gear, from 1."""
    since_kick: Symbol
    """Time since the last kick-down [s]."""
    slowing: Symbol
    """1 while the driver slows down, else 0."""
    grade: Symbol
    """Slope of the road, tan(alpha)."""


class KickLimits(NamedTuple):
    """Engine speeds [rad/s] for shifts with a pressed accelerator. With 0, ``NEVER``, 0 and ``NEVER`` only the shift speeds count."""

    earliest: Symbol
    """Not up below it."""
    latest: Symbol
    """Up above it."""
    down: Symbol
    """Down below it."""
    kick: Symbol
    """No kick-down above it."""


class Shifts(NamedTuple):
    """Conditions of shifts, of which at most one holds, and the gears to which they lead; a kick-down leads to the next gear below."""

    up: Symbol
    down: Symbol
    kick_down: Symbol
    above: Symbol
    below: Symbol


def kick_limits(
    speeds: Sequence[tuple[float, float]],
    gear: Symbol,
    before: Sequence[float],
    after: Sequence[float],
    *,
    interrupts: bool = False,
) -> KickLimits:
    """The limits from the engine speeds [rad/s] before and after each upshift at which both gears pull equally hard.

    Without speeds before the shifts, or without those after them, there are no such limits. The downshift has the hysteresis of ``speeds``.
    A shift that ``interrupts`` the torque only has the limit above which it does not kick down.
    """
    lower = [w * down / up for w, (up, down) in zip(after, speeds, strict=False)]
    return KickLimits(
        earliest=_of(gear, before, 1, 0.0),
        latest=_of(gear, before, 1, NEVER),
        down=_of(gear, () if interrupts else lower, 2, 0.0),
        kick=_of(gear, lower, 2, NEVER),
    )


@dataclass(frozen=True)
class ShiftRule:
    """The rule of ``GearSchedule``, for rows of shift speeds (up, down) [m/s] and its parameters."""

    speeds: Sequence[tuple[float, float]]
    eager: Symbol
    relaxed: Symbol
    kick: Symbol
    patience: Symbol
    braking: Symbol
    skips: bool
    pause: Symbol | float
    """Time for which a shift interrupts the torque [s]."""

    def shifts(self, now: Driving, limits: KickLimits) -> Shifts:
        """Which shift is due."""
        pressed = ca.fmax(now.accelerator - self.relaxed, 0) / (1 - self.relaxed)
        depth = beyond(self.kick, now.accelerator)
        later, held = 1 + self.eager * pressed, 1 + self.braking * now.slowing
        ups = [up * ca.fmax(later, held) for up, _ in self.speeds]
        downs = [ca.fmax(ca.fmin(down * later, (up + down) / 2), down * held) for up, down in self.speeds]
        up, down = (_of(now.gear, [row[k] for row in self.speeds], 1 + k, far) for k, far in ((0, NEVER), (1, -NEVER)))

        released = _any(now.since_kick > self.patience, now.v > up * (1 + self.eager))
        pulls = _any(limits.earliest < STANDS, now.w > depth * limits.earliest)
        by_schedule = _all(now.v > _of(now.gear, ups, 1, NEVER), released, pulls)
        at_the_latest = _all(now.v > up, now.w > limits.latest)
        lost = G_N * now.grade / ca.sqrt(1 + now.grade**2) * self.pause
        upshift = _all(_any(by_schedule, at_the_latest), now.v - lost > _of(now.gear, downs, 1, -NEVER))

        downshift = now.v < _of(now.gear, downs, 2, -NEVER)

        pulls_harder = _any(now.v < down * later, now.w < depth * limits.down)
        # Without the limit of the engine speed a gear that was left at limits.latest would be kicked down to again.
        kicked = _all(now.accelerator > self.kick, pulls_harder, now.w < limits.kick)
        kick_down = _all(kicked, ca.logic_not(downshift), ca.logic_not(upshift))

        above, below = now.gear + 1, now.gear - 1
        if self.skips:
            above = ca.fmax(above, 1 + sum(now.v > each for each in ups))
            below = ca.fmin(below, 1 + sum(now.v >= each for each in downs))
        return Shifts(upshift, downshift, kick_down, above, below)


def _of(gear: Symbol, values: Sequence[Symbol | float], first: int, otherwise: float) -> Symbol:
    """The value for a gear; ``values`` are those of the gears from ``first`` on."""
    found = Symbol(otherwise)
    for k, value in enumerate(values, first):
        found = ca.if_else(ca.fabs(gear - k) < 0.5, value, found)
    return found


def _all(first: Symbol, *others: Symbol) -> Symbol:
    for other in others:
        first = ca.logic_and(first, other)
    return first


def _any(first: Symbol, *others: Symbol) -> Symbol:
    for other in others:
        first = ca.logic_or(first, other)
    return first
