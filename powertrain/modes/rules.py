"""One pass of the mode rules as symbolic functions: all laws are updated from the same evaluation."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from powertrain.compiler.hybrid import Friction, HybridDae, Switch, When
from powertrain.language.symbols import column
from powertrain.modes.indicators import (
    approaching,
    friction_free,
    held_margin,
    in_time,
    pressure_margin,
    relation,
    speed_tolerance,
    switch_margin,
    torque_margins,
)
from powertrain.modes.selflocking import inverted
from powertrain.modes.tolerances import EPS, INTEGRATED, NOW, SWIFT, ZONE


@dataclass(frozen=True)
class Pass:
    """The next held values and what must follow.

    ``flags``: number of entries that change; whens with a rising edge; barriers that are struck; sum of all torques; laws at a limit newly
    held at rest by others; and a value above zero if a law slides with its limits in the wrong order.
    """

    held: ca.SX
    flags: ca.SX
    edges: ca.SX
    closing: ca.SX


def timed(dae: HybridDae) -> tuple[ca.SX, list[int]]:
    """The known instants of laws (switches, then relations, then whens), and the indices of these laws in the held values."""
    laws: list[Switch | When] = [*dae.switches, *dae.relations, *dae.whens]
    known = [(law.time, law.index) for law in laws if law.time is not None]
    return ca.vertcat(ca.SX(0, 1), *[time for time, _ in known]), [index for _, index in known]


def mode_pass(dae: HybridDae, fire: ca.SX, jumped: ca.SX, slack: ca.SX) -> Pass:
    """The mode rules.

    ``fire`` marks timed laws whose instant is now. ``jumped`` is above 0 if speeds may have jumped since modes were found, above 1 if by a
    reset or an impact. A law at rest may count as sliding while its acceleration is above ``-slack``; this is 0 except for modes from the
    complementarity problem or a single trial, and for laws already resting at a limit.
    A closed contact opens if its force would pull, or if a reset has moved one of its sides away. It is struck if a reset throws its sides
    at each other. A one-way law is struck if a reset or an impact throws it backward.
    """
    held = [dae.m[i] for i in range(dae.m.numel())]
    instants = zip(timed(dae)[1], ca.vertsplit(timed(dae)[0]), strict=True)
    fires = {index: _fires(dae, fire[k], instant) for k, (index, instant) in enumerate(instants)}
    for friction in dae.frictions:
        held[friction.index] = friction_rule(dae, friction, jumped, slack)
        if friction.rests is not None:
            rests = _rests(dae, friction)
            held[friction.rests] = ca.if_else(_breaks_away(dae, friction, held[friction.index]), 1 - rests, rests)
    for switch in (*dae.switches, *dae.relations):
        old = dae.m[switch.index]
        left = switch_margin(dae, switch) if switch.time is None else relation(old, in_time(dae, switch.g))
        new = ca.if_else(left <= 0, 1 - old, old)
        if switch.time is not None:
            new = ca.if_else(fires[switch.index], ca.jacobian(switch.g, dae.t) > 0, new)
        held[switch.index] = new
    closing = []
    for contact in dae.contacts:
        old = dae.m[contact.index]
        near = ca.logic_and(ca.fabs(contact.gap) <= ZONE, ca.fabs(contact.speed) <= EPS)
        rest = ca.logic_and(near, contact.acceleration < -contact.still)
        taken_away = ca.logic_and(jumped > 0, contact.gap > INTEGRATED)
        pressed = ca.logic_and(pressure_margin(contact) > 0, ca.logic_not(taken_away))
        held[contact.index] = ca.if_else(old > 0.5, pressed, rest)
        hits = ca.logic_and(ca.logic_and(contact.gap + EPS <= 0, approaching(contact)), ca.logic_not(rest))
        thrown = ca.logic_and(ca.logic_and(jumped > 0, contact.speed < -INTEGRATED), ca.logic_not(taken_away))
        closing.append(ca.if_else(old > 0.5, thrown, hits))
    closing += [ca.logic_and(jumped > 1, b.speed < -ZONE) for b in dae.barriers[len(dae.contacts) :]]
    edges = []
    relations = [r.index for r in dae.relations]
    found = [column([values[i] for i in relations]) for values in (ca.vertsplit(dae.m), held)]
    now = ca.substitute([w.g for w in dae.whens], found[:1], found[1:])
    for when, g in zip(dae.whens, now, strict=True):
        old = dae.m[when.index]
        g = g if when.time is None else in_time(dae, g)
        rises = g >= EPS
        if when.time is not None:
            rises = ca.logic_or(rises, fires[when.index])
        edges.append(ca.logic_and(old < 0.5, rises))
        held[when.index] = ca.if_else(relation(old, g) <= 0, 0.0, old)
    new_held = ca.vertcat(*held)
    changes = ca.sum1(new_held != dae.m) if held else ca.SX(0)
    torques = sum((friction.torque for friction in dae.frictions), ca.SX(0))
    idle = sum((idles(dae, friction) for friction in dae.frictions if friction.rests is not None), ca.SX(0))
    flags = ca.vertcat(changes, sum(edges, ca.SX(0)), sum(closing, ca.SX(0)), torques, idle, inverted(dae))
    return Pass(new_held, ca.densify(flags), ca.vertcat(*edges), ca.vertcat(*closing))


def _fires(dae: HybridDae, fire: ca.SX, instant: ca.SX) -> ca.SX:
    """Whether the instant of a marked law is now; a reset may have moved it."""
    return ca.logic_and(fire > 0, ca.fabs(instant - dae.t) <= NOW * ca.fmax(1, ca.fabs(dae.t)))


def idles(dae: HybridDae, friction: Friction) -> ca.SX:
    """Whether a law at a limit of its torque has come to rest, held by others; how they share the torque is then undecided."""
    mode, known = dae.m[friction.index], _rests(dae, friction)
    still = ca.logic_and(ca.fabs(friction.w) <= ZONE, ca.fabs(friction.rate) <= friction.reach * friction.hysteresis)
    return ca.logic_and(ca.logic_and(ca.fabs(mode) == 1, still), known == 0)


def _rests(dae: HybridDae, friction: Friction) -> ca.SX:
    """1 if a law at a limit of its torque was found at rest, held by others."""
    return ca.SX(0) if friction.rests is None else dae.m[friction.rests]


def _breaks_away(dae: HybridDae, friction: Friction, new: ca.SX) -> ca.SX:
    """Whether a law at rest reaches its peak. It keeps the peak while others hold what it moves; this is tried first."""
    leaves = ca.logic_and(dae.m[friction.index] == 0, ca.fabs(new) == 1)
    return ca.logic_and(ca.logic_and(leaves, ca.fabs(friction.w) <= ZONE), friction.peak > 1)


def friction_rule(dae: HybridDae, friction: Friction, jumped: ca.SX, slack: ca.SX) -> ca.SX:
    """The next mode of one friction law."""
    mode, w, rate = dae.m[friction.index], friction.w, friction.rate
    below, above = torque_margins(friction)
    sign = ca.if_else(w > 0, 1.0, -1.0)
    zone = ca.SX(1) if friction.algebraic else ca.logic_or(ca.fabs(w) <= ZONE, _error(friction, mode, jumped))
    if friction.prescribed:
        new = _prescribed(dae, friction)
    else:
        stuck = ca.if_else(above <= 0, 1.0, ca.if_else(below <= 0, -1.0, 0.0))
        still = ca.SX(1) if friction.algebraic else ca.logic_not(ca.logic_and(jumped > 0, ca.logic_not(zone)))
        allowed = ca.fmax(slack, _rests(dae, friction))  # a held law moves in neither direction
        least = allowed * friction.reach * friction.hysteresis + (EPS if friction.algebraic else 0)
        nothing = ca.logic_and(slack > 0, ca.fabs(friction.upper - friction.lower) <= friction.hysteresis)
        forward, backward = ca.logic_or(rate > -least, nothing), ca.logic_or(rate < least, nothing)
        if friction.share is not None:
            kept = ca.logic_or(ca.logic_not(_rests(dae, friction)), held_margin(dae, friction) > 0)
            forward, backward = ca.logic_and(forward, kept), ca.logic_and(backward, kept)
        loose = ca.if_else(
            mode == 1, ca.if_else(forward, 1.0, 0.0), ca.if_else(mode == -1, ca.if_else(backward, -1.0, 0.0), 0.0)
        )
        new = ca.if_else(mode == 0, ca.if_else(still, stuck, sign), ca.if_else(zone, loose, sign))
    if not friction.may_free:
        return new
    leaves = friction_free(dae, friction) <= 0
    free = ca.if_else(mode == 2, ca.logic_not(leaves), leaves)
    return ca.if_else(free, 2.0, new)


def _prescribed(dae: HybridDae, friction: Friction) -> ca.SX:
    """The next mode of a law with a prescribed speed: near rest its rate decides.

    If the speed has the error of the integration, as behind a filter, a low rate decides nothing, and the law keeps its mode.
    """
    mode, w, rate = dae.m[friction.index], friction.w, friction.rate
    known = speed_tolerance(dae, friction)
    if known > EPS:
        slow = ca.if_else(rate == 0, 0.0, ca.if_else(mode * w <= -known, ca.sign(w), mode))
        near = ca.if_else(ca.fabs(rate) > SWIFT, ca.sign(rate), slow)
    else:
        near = ca.if_else(ca.fabs(rate) > EPS, ca.sign(rate), 0.0)
    return ca.if_else(ca.fabs(w) > 2 * known, ca.sign(w), near)


def _error(friction: Friction, mode: ca.SX, jumped: ca.SX) -> ca.SX:
    """Whether only the error of the integration makes a law move against its mode, or where its torque is unlimited.

    Without a jump the only other cause is the small delay with which the event is located.
    """
    w, smooth = friction.w, ca.logic_not(jumped)
    little = ca.fabs(w) <= INTEGRATED
    against = ca.logic_and(ca.fabs(mode) == 1, mode * w < 0)
    blocked = sum((ca.logic_and(mode == -way, way * w > 0) for way in friction.limitless), ca.SX(0))
    return ca.logic_or(
        ca.logic_and(against, ca.logic_and(smooth, little)), ca.logic_and(blocked, ca.logic_or(smooth, little))
    )
