"""Event indicators of the laws: positive while a law keeps its mode, with a hysteresis far above the accuracy of event location."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from powertrain.compiler.hybrid import Contact, Friction, Guard, HybridDae, Switch, When
from powertrain.modes.tolerances import EPS, INTEGRATED, LIMIT, NO_WIDTH


@dataclass(frozen=True)
class Indicator:
    """An expression that falls through zero when ``law`` must change its mode; ``known`` is its uncertainty."""

    law: Friction | Switch | Contact | When | Guard
    value: ca.SX
    known: ca.SX | float = EPS

    @property
    def scaled(self) -> ca.SX:
        """The value scaled so that its uncertainty is EPS: a torque cannot be located more precisely than its own round-off."""
        return self.value * (EPS / self.known)


def indicators(dae: HybridDae) -> tuple[Indicator, ...]:
    """All indicators that are located as state events; conditions with a known instant are time events."""
    found: list[Indicator] = []
    for friction in dae.frictions:
        slow = speed_tolerance(dae, friction)
        known = slow if friction.prescribed else ca.if_else(_by_torque(dae, friction), friction.hysteresis, slow)
        found.append(Indicator(friction, friction_motion(dae, friction), known))
        if friction.may_free and ca.depends_on(friction.upper - friction.lower, ca.vertcat(dae.t, dae.x, dae.z)):
            found.append(Indicator(friction, friction_free(dae, friction)))
    for switch in (*dae.switches, *dae.relations):
        if switch.time is None and ca.depends_on(switch.g, ca.vertcat(dae.t, dae.x, dae.z)):
            found.append(Indicator(switch, switch_margin(dae, switch), switch.known))
    for contact in dae.contacts:
        closed = dae.m[contact.index] > 0.5
        found.append(Indicator(contact, contact_change(dae, contact), ca.if_else(closed, contact.hysteresis, EPS)))
    for when in dae.whens:
        if when.time is None and not when.relations:
            found.append(Indicator(when, relation(dae.m[when.index], when.g)))
    found += [Indicator(guard, guard_margin(guard)) for guard in dae.guards if guard.action == "error"]
    return tuple(found)


def relation(mode: ca.SX, g: ca.SX, eps: ca.SX | float = EPS) -> ca.SX:
    """``mode`` is 1 while g > 0 and 0 otherwise."""
    return (2 * mode - 1) * g + eps


def switch_margin(dae: HybridDae, switch: Switch) -> ca.SX:
    """The condition of a switch with its hysteresis."""
    return relation(dae.m[switch.index], switch.g, switch.known)


def in_time(dae: HybridDae, g: ca.SX) -> ca.SX:
    """``g``, affine in time, divided by its slope: its hysteresis becomes a time."""
    return g / (ca.fabs(ca.jacobian(g, dae.t)) + 1e-300)


def torque_margins(friction: Friction) -> tuple[ca.SX, ca.SX]:
    """Distances of a stuck torque from the lower and the upper limit, including the hysteresis.

    If the bounds are in the wrong order, a switch is about to follow the torque; this is no reason to break loose.
    """
    high = friction.peak * ca.fmax(friction.upper, friction.lower)
    low = friction.peak * ca.fmin(friction.upper, friction.lower)
    return friction.torque - low + friction.hysteresis, high - friction.torque + friction.hysteresis


def speed_tolerance(dae: HybridDae, friction: Friction) -> float:
    """Hysteresis of the speed of a law: a speed that no law sets to zero has the error of the integration."""
    integrated = friction.prescribed and ca.depends_on(friction.w, ca.vertcat(dae.x, dae.z))
    return INTEGRATED if integrated else EPS


def friction_motion(dae: HybridDae, friction: Friction) -> ca.SX:
    """Sliding: the speed keeps its sign. Stuck: the torque stays within its limits, or a prescribed speed stays zero."""
    mode = dae.m[friction.index]
    below, above = torque_margins(friction)
    known = speed_tolerance(dae, friction)
    stuck = 2 * known - ca.fabs(friction.w) if friction.prescribed else ca.fmin(below, above)
    loose = mode * friction.w + known
    if friction.algebraic:  # if the bounds coincide, the direction of sliding makes no difference
        loose = ca.fmax(loose, friction.hysteresis - ca.fabs(friction.upper - friction.lower))
    if friction.may_free:
        loose = ca.if_else(mode == 2, 1.0, loose)
    if friction.rests is not None and friction.share is not None:
        loose = ca.if_else(dae.m[friction.rests], held_margin(dae, friction), loose)
    return ca.if_else(mode == 0, stuck, loose)


def held_margin(dae: HybridDae, friction: Friction) -> ca.SX:
    """A law at a limit that others hold at rest stays there while its share of the load exceeds the limit; including the hysteresis."""
    assert friction.share is not None
    return dae.m[friction.index] * (friction.share - friction.torque) + friction.hysteresis


def _by_torque(dae: HybridDae, friction: Friction) -> ca.SX:
    """Whether the torque of a law, and not its speed, decides how long it keeps its mode."""
    stuck = dae.m[friction.index] == 0
    return stuck if friction.rests is None or friction.share is None else ca.logic_or(stuck, dae.m[friction.rests])


def friction_free(dae: HybridDae, friction: Friction) -> ca.SX:
    """The law transmits torque while upper - lower > 0; from free, it engages only above twice the hysteresis."""
    width = friction.upper - friction.lower
    return ca.if_else(dae.m[friction.index] == 2, 2 * NO_WIDTH - width, width - NO_WIDTH)


def contact_change(dae: HybridDae, contact: Contact) -> ca.SX:
    """Open: no approach below zero. Closed: no pulling force."""
    open_ = ca.if_else(ca.logic_or(contact.gap > 0, approaching(contact)), contact.gap + EPS, 1.0)
    return ca.if_else(dae.m[contact.index] > 0.5, pressure_margin(contact), open_)


def pressure_margin(contact: Contact) -> ca.SX:
    """Force of a closed contact above its opening limit; including the hysteresis."""
    return contact.force + contact.hysteresis


def approaching(contact: Contact) -> ca.SX:
    """The gap closes; ignores noise of a speed around zero, and of the acceleration if friction holds both sides."""
    slow = ca.logic_and(contact.speed < 0, contact.acceleration < -contact.still)
    return ca.logic_or(contact.speed < -EPS, slow)


def guard_margin(guard: Guard) -> ca.SX:
    """Distance from the nearer limit, with a tolerance."""
    margins = []
    for distance, limit in ((guard.value - guard.low, guard.low), (guard.high - guard.value, guard.high)):
        size = ca.fabs(limit)
        margins.append(distance + LIMIT * (1.0 + ca.if_else(size < 1e300, size, 0.0)))
    return ca.fmin(*margins)
