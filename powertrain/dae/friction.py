"""The friction law: everything that follows from its record, ``Friction``.

In turn: its torque in each mode; the margins of its modes; which of them is watched during a step; the mode that follows at an event; and
the modes that hold, and the mode that follows, at a steady state, where nothing accelerates.

The torques of all laws together are solved in ``powertrain.compiler.torques``, the modes of all laws in
``powertrain.modes.complementarity``, and both for many operating points at once in ``powertrain.equilibrium``. A direction without a
torque limit is also a ``Barrier`` (``HybridDae.barriers``).
"""

from __future__ import annotations

import math

import casadi as ca

from powertrain.dae.hybrid import JUMPED, Barrier, Friction, HybridDae
from powertrain.dae.tolerances import (
    CREEP,
    EPS,
    INACCURATE,
    INTEGRATED,
    NO_WIDTH,
    NOISE,
    REVERSED,
    SWIFT,
    YIELDING,
    ZONE,
)

FORWARD, STUCK, BACKWARD, FREE = 1.0, 0.0, -1.0, 2.0


def sliding_torque(mode: ca.SX, lower: ca.SX, upper: ca.SX, prescribed: bool) -> ca.SX:
    """The torque of a law that is not stuck.

    If it changes no motion, any torque between the bounds is possible at rest: operating points select one by a mode between -1 and 1.
    """
    if prescribed:
        upper = ca.if_else(ca.fabs(mode) < 1, lower + (1 + mode) / 2 * (upper - lower), upper)
    return ca.if_else(mode == BACKWARD, lower, upper)


def least_torque(lower: ca.SX, upper: ca.SX) -> ca.SX:
    """The smallest torque within the bounds: that of a stuck law whose torque changes no motion."""
    return ca.fmax(lower, ca.fmin(upper, 0))


def torque_margins(law: Friction) -> tuple[ca.SX, ca.SX]:
    """Distances of a stuck torque from the lower and the upper limit, including the hysteresis.

    If the bounds are in the wrong order, a switch is about to follow the torque; this is no reason to break loose.
    """
    high = law.peak * ca.fmax(law.upper, law.lower)
    low = law.peak * ca.fmin(law.upper, law.lower)
    return law.torque - low + law.hysteresis, high - law.torque + law.hysteresis


def stuck_margin(law: Friction) -> ca.SX:
    """A law is stuck while its torque stays within its limits."""
    return ca.fmin(*torque_margins(law))


def rest_margin(dae: HybridDae, law: Friction) -> ca.SX:
    """A stuck law is at rest, but for its compliance. It gives way where no mode follows, and the run ends.

    Without a torque limit, nothing else gives way to a motion that others prescribe. While laws with a limit hold the motion, its
    compliance gives way as well; they slip, as its torque rises, long before this speed is reached. A law that shares its motion gives
    way where it acts on a part so light that its compliance yields as much as what is held through that part.
    """
    most = YIELDING * ca.fabs(law.torque) if law.limitless else INACCURATE * law.hysteresis
    yields = ca.fabs(law.rate) > law.reach * most
    # without a load, round-off decides this, but then w is zero
    moved = ca.logic_and(dae.m[law.index] == STUCK, yields)
    return (CREEP if law.algebraic else INTEGRATED) - ca.if_else(moved, ca.fabs(law.w), 0.0)


def gives_way(law: Friction) -> bool:
    """Whether the motion of a stuck law has to be watched, see ``rest_margin``."""
    return not law.prescribed and (bool(law.limitless) or law.share is not None)


def speed_margin(law: Friction, mode: ca.SX | float, known: ca.SX | float) -> ca.SX:
    """A law slides in the direction of its speed."""
    return mode * law.w + known


def rate_margin(law: Friction, mode: ca.SX | float, slack: ca.SX | float) -> ca.SX:
    """A law at rest slides in the direction of its rate; ``slack`` times the uncertainty of its torque may turn the rate round."""
    return mode * law.rate + (slack * law.reach * law.hysteresis + (EPS if law.algebraic else 0))


def width_margin(law: Friction) -> ca.SX:
    """A law transmits torque, or is not always at the same one, while its limits differ."""
    return law.upper - law.lower - NO_WIDTH


def order_margin(dae: HybridDae, law: Friction) -> ca.SX:
    """Not negative while the lower limit is below the upper one, but for the error of the states: a limit may end at zero."""
    width = law.upper - law.lower
    slopes = ca.densify(ca.jacobian(width, ca.vertcat(dae.x, dae.z)))
    return width + NOISE + REVERSED * ca.dot(ca.fabs(slopes), ca.DM(dae.sizes).T)


def undetermined(dae: HybridDae, law: Friction) -> bool:
    """Whether nothing may take the place of the torque of a law at rest: others depend on it, or its speed never changes."""
    changing = ca.vertcat(dae.t, dae.x, dae.z, dae.m)
    return law.prescribed and (law.acts or not ca.depends_on(law.w, changing))


def held_margin(law: Friction, mode: ca.SX | float) -> ca.SX:
    """A law at a limit stays there while its share of the load exceeds the limit; including the hysteresis."""
    assert law.share is not None
    return mode * (law.share - law.torque) + law.hysteresis


def speed_tolerance(dae: HybridDae, law: Friction) -> float:
    """Hysteresis of the speed of a law: a speed that no law sets to zero has the error of the integration."""
    integrated = law.prescribed and ca.depends_on(law.w, ca.vertcat(dae.x, dae.z))
    return INTEGRATED if integrated else EPS


def watched(dae: HybridDae, law: Friction) -> list[tuple[ca.SX, ca.SX | float]]:
    """What falls through zero when the law must change its mode, each with its uncertainty."""
    slow = speed_tolerance(dae, law)
    known = slow if law.prescribed else ca.if_else(_by_torque(dae, law), law.hysteresis, slow)
    found: list[tuple[ca.SX, ca.SX | float]] = [(_motion(dae, law), known)]
    if law.may_free and ca.depends_on(law.upper - law.lower, ca.vertcat(dae.t, dae.x, dae.z)):
        free = _free(dae, law)
        found.append((ca.if_else(dae.m[law.index] == FREE, ca.fmin(free, order_margin(dae, law)), free), EPS))
    if gives_way(law):
        found.append((rest_margin(dae, law), EPS))
    return found


def _motion(dae: HybridDae, law: Friction) -> ca.SX:
    """Sliding: the speed keeps its sign. Stuck: the torque stays within its limits, or a prescribed speed stays zero."""
    mode, known = dae.m[law.index], speed_tolerance(dae, law)
    stuck = 2 * known - ca.fabs(law.w) if law.prescribed else stuck_margin(law)
    loose = speed_margin(law, mode, known)
    if law.algebraic:  # if the bounds coincide, the direction of sliding makes no difference
        loose = ca.fmax(loose, law.hysteresis - ca.fabs(law.upper - law.lower))
    if law.may_free:
        loose = ca.if_else(mode == FREE, 1.0, loose)
    if law.share is not None:
        loose = ca.if_else(_rests(dae, law), held_margin(law, dae.m[law.index]), loose)
    return ca.if_else(mode == STUCK, stuck, loose)


def _by_torque(dae: HybridDae, law: Friction) -> ca.SX:
    """Whether the torque of a law, and not its speed, decides how long it keeps its mode."""
    stuck = dae.m[law.index] == STUCK
    return stuck if law.share is None else ca.logic_or(stuck, _rests(dae, law))


def _free(dae: HybridDae, law: Friction) -> ca.SX:
    """The law keeps being free, or not free; from free, it engages only above twice the hysteresis of its width."""
    return ca.if_else(dae.m[law.index] == FREE, 2 * NO_WIDTH - (law.upper - law.lower), width_margin(law))


def next_modes(dae: HybridDae, law: Friction, jumped: ca.SX, slack: ca.SX) -> dict[int, ca.SX]:
    """The next mode of the law, and whether it rests at its limit, by their index in the held values.

    A law at rest that reaches its peak keeps the peak while others hold what it moves; this is tried first.
    """
    new = next_mode(dae, law, jumped, slack)
    if law.rests is None:
        return {law.index: new}
    leaves = ca.logic_and(ca.logic_and(dae.m[law.index] == STUCK, ca.fabs(law.w) <= ZONE), law.peak > 1)
    return {law.index: new, law.rests: ca.logic_and(ca.fabs(new) == 1, ca.logic_or(leaves, _rests(dae, law)))}


def next_mode(dae: HybridDae, law: Friction, jumped: ca.SX, slack: ca.SX) -> ca.SX:
    """The next mode of the law; ``jumped`` and ``slack`` as in ``powertrain.modes.rules``."""
    new = _prescribed(dae, law) if law.prescribed else _moved(dae, law, jumped, slack)
    if not law.may_free:
        return new
    leaves = _free(dae, law) <= 0
    free = ca.if_else(dae.m[law.index] == FREE, ca.logic_not(leaves), leaves)
    return ca.if_else(free, FREE, new)


def _moved(dae: HybridDae, law: Friction, jumped: ca.SX, slack: ca.SX) -> ca.SX:
    """The next mode of a law that its torque moves: by its speed, and near rest by its torque if stuck, by its rate if sliding."""
    mode, w = dae.m[law.index], law.w
    zone = ca.SX(1) if law.algebraic else ca.logic_or(ca.fabs(w) <= ZONE, _error(law, mode, jumped))
    still = ca.SX(1) if law.algebraic else ca.logic_not(ca.logic_and(jumped > 0, ca.logic_not(zone)))
    sign = ca.if_else(w > 0, FORWARD, BACKWARD)
    loose = _sliding(mode, _slides_on(dae, law, slack), _reverses(dae, law, slack))
    return ca.if_else(mode == STUCK, ca.if_else(still, _stuck(law), sign), ca.if_else(zone, loose, sign))


def _stuck(law: Friction) -> ca.SX:
    """The next mode of a stuck law at rest: by its torque."""
    below, above = torque_margins(law)
    return ca.if_else(above <= 0, FORWARD, ca.if_else(below <= 0, BACKWARD, STUCK))


def _sliding(mode: ca.SX, slides: ca.SX, reverses: ca.SX | int = 0) -> ca.SX:
    """The next mode of a sliding law at rest, given whether it slides on, or else in the other direction."""
    return ca.if_else(slides, mode, ca.if_else(reverses, -mode, STUCK))


def _reverses(dae: HybridDae, law: Friction, slack: ca.SX) -> ca.SX:
    """Whether a law at rest between equal limits, which hold nothing, has a rate against its mode at either of them.

    It is tried stuck first, and only with ``slack``, from what the complementarity problem has found, slides in the other direction at
    once: stuck for a pass, meshes without a load would brace themselves against others.
    """
    mode = dae.m[law.index]
    room = ca.fabs(law.torque - law.peak * ca.if_else(mode == FORWARD, law.lower, law.upper))
    equal = ca.logic_and(slack > 0, room <= law.hysteresis)
    loose = ca.logic_and(ca.fabs(mode) == 1, ca.logic_not(_rests(dae, law)))
    return ca.logic_and(ca.logic_and(equal, loose), mode * law.rate + law.reach * room < 0)


def _slides_on(dae: HybridDae, law: Friction, slack: ca.SX) -> ca.SX:
    """Whether a law at rest slides, or stays at its limit, in the direction of its mode: see ``takes_more``.

    A law with a peak that has come to rest is stuck first, unless it is about to move, or the complementarity problem, which contains the
    peak, has found that it slides.
    """
    mode, rests = dae.m[law.index], _rests(dae, law)
    slides = ca.logic_and(ca.fabs(mode) == 1, takes_more(dae, law, slack))
    if law.rests is None:
        return slides
    about = ca.logic_or(slack > 0, rate_margin(law, mode, -1) > 0)
    return ca.logic_and(slides, ca.logic_or(ca.logic_or(rests, law.peak <= 1), about))


def takes_more(dae: HybridDae, law: Friction, slack: ca.SX) -> ca.SX:
    """Whether a law at a limit, at rest, would take more: its rate decides; where others hold it, so that this is their creep, its share.

    A law that has no share, because it shares its motion with none or is nonlinear in the torques, always goes by its rate, and slides also
    within the uncertainty of a rate of zero.
    """
    if law.share is not None:
        return ca.if_else(_rests(dae, law), held_margin(law, dae.m[law.index]), dae.m[law.index] * law.rate) > 0
    nothing = ca.logic_and(slack > 0, ca.fabs(law.upper - law.lower) <= law.hysteresis)
    return ca.logic_or(rate_margin(law, dae.m[law.index], ca.fmax(slack, _rests(dae, law))) > 0, nothing)


def _prescribed(dae: HybridDae, law: Friction) -> ca.SX:
    """The next mode of a law with a prescribed speed: near rest its rate decides.

    If the speed has the error of the integration, as behind a filter, a low rate decides nothing, and the law keeps its mode unless it was
    free.
    """
    mode, w, rate = dae.m[law.index], law.w, law.rate
    known = speed_tolerance(dae, law)
    if known > EPS:
        turns = ca.logic_or(mode * w <= -known, mode == FREE)
        slow = ca.if_else(rate == 0, 0.0, ca.if_else(turns, ca.sign(w), mode))
        near = ca.if_else(ca.fabs(rate) > SWIFT, ca.sign(rate), slow)
    else:
        near = ca.if_else(ca.fabs(rate) > EPS, ca.sign(rate), 0.0)
    return ca.if_else(ca.fabs(w) > 2 * known, ca.sign(w), near)


def _error(law: Friction, mode: ca.SX, jumped: ca.SX) -> ca.SX:
    """Whether only the error of the integration makes a law move against its mode, or where its torque is unlimited.

    Without a jump the only other cause is the small delay with which the event is located.
    """
    w, smooth = law.w, ca.logic_not(jumped)
    little = ca.fabs(w) <= INTEGRATED
    against = ca.logic_and(ca.fabs(mode) == 1, mode * w < 0)
    blocked = sum((ca.logic_and(mode == -way, way * w > 0) for way in law.limitless), ca.SX(0))
    return ca.logic_or(
        ca.logic_and(against, ca.logic_and(smooth, little)), ca.logic_and(blocked, ca.logic_or(smooth, little))
    )


def _rests(dae: HybridDae, law: Friction) -> ca.SX:
    """1 if a law at a limit of its torque was found at rest, held by others."""
    return ca.SX(0) if law.rests is None else dae.m[law.rests]


def idles(dae: HybridDae, law: Friction) -> ca.SX:
    """Whether a law at a limit of its torque has come to rest, held by others; how they share the torque is then undecided."""
    mode = dae.m[law.index]
    still = ca.logic_and(ca.fabs(law.w) <= ZONE, ca.fabs(law.rate) <= law.reach * law.hysteresis)
    return ca.logic_and(ca.logic_and(ca.fabs(mode) == 1, still), _rests(dae, law) == 0)


def struck(barrier: Barrier, jumped: ca.SX) -> ca.SX:
    """Whether a jump throws a one-way law backward; a start must not."""
    return ca.logic_and(jumped == JUMPED, barrier.speed < -ZONE)


def steady_margins(law: Friction) -> dict[float, ca.SX]:
    """The modes that the law may have at a steady state, each with a margin that is not negative where it holds.

    If the motion is prescribed, the torque at rest is not determined; ``steady_rest`` says where that is so.
    """
    modes = (FORWARD, BACKWARD) if law.prescribed else (STUCK, FORWARD, BACKWARD)
    margins = {mode: _steady_stuck(law) if mode == STUCK else _steady_sliding(law, mode) for mode in modes}
    if law.may_free:
        margins[FREE] = -width_margin(law)
    elif law.prescribed:  # the switches in its limits see to their order
        return margins
    ordered = law.upper - law.lower + law.hysteresis
    return {mode: ca.fmin(margin, ordered) for mode, margin in margins.items()}


def _steady_stuck(law: Friction) -> ca.SX:
    """The margin of a run, and the speed, which in a run is zero by integration."""
    return stuck_margin(law) if law.algebraic else ca.fmin(stuck_margin(law), _at_rest(law))


def _steady_sliding(law: Friction, mode: float) -> ca.SX:
    """The margins of a run, by speed or near rest by rate, but without hysteresis for a speed: there is no mode before.

    At rest, a law that shares its motion is at its limit where its share is beyond it.
    """
    bound, rests = law.upper if mode == FORWARD else law.lower, _at_rest(law)
    if bound.is_constant() and not math.isfinite(float(bound)):
        return ca.SX(-1)
    if law.algebraic:
        moving = speed_margin(law, mode, EPS)
        if law.share is None:
            return moving
        return ca.if_else(rests >= 0, ca.fmin(moving, held_margin(law, mode)), moving)
    away = speed_margin(law, mode, -ZONE)
    if law.prescribed:  # at rest with equal bounds all modes give the same torque
        return ca.if_else(ca.fabs(law.w) <= ZONE, -width_margin(law), away)
    more = rate_margin(law, mode, 1.0) if law.share is None else held_margin(law, mode)
    return ca.fmax(away, ca.fmin(rests, more))


def _at_rest(law: Friction) -> ca.SX:
    return ZONE - ca.fabs(law.w)


def next_steady_mode(law: Friction, mode: ca.SX, zone: ca.SX, side: ca.SX, given: ca.SX) -> ca.SX:
    """The mode that follows at an iterate of a steady state: as in a run, with the speed in place of the rate.

    The law has the speed, torque, limits and share of the iterate, and their uncertainties: ``zone`` is that of its speed. A law that
    slides at zero speed is held by others; if it may be free, it sticks where its share is within its limit. Where its motion is
    ``given``, it rests at the ``side`` from which rest is approached.
    """
    rests, sign = ca.fabs(law.w) <= zone, ca.sign(law.w)
    slides = speed_margin(law, mode, zone) >= 0
    if law.may_free:
        slides = ca.logic_and(slides, ca.logic_not(ca.logic_and(rests, held_margin(law, mode) < 0)))
    moved = ca.if_else(ca.fabs(mode) == 1, _sliding(mode, slides), ca.if_else(rests, _stuck(law), sign))
    new = ca.if_else(given, ca.if_else(rests, side, sign), moved)
    return ca.if_else(width_margin(law) <= 0, FREE, new) if law.may_free else new


def steady_rest(law: Friction) -> ca.SX:
    """Not negative where a law rests under a prescribed motion: no mode holds, and its torque may lie anywhere between the bounds."""
    return ca.if_else(ca.fabs(law.w) <= ZONE, width_margin(law), -1)


def necessary(law: Friction, mode: float) -> list[ca.SX]:
    """What is not negative wherever a mode other than free holds at a steady state; it depends on less than the margin."""
    found = [] if law.algebraic else [_at_rest(law) if mode == STUCK else speed_margin(law, mode, ZONE)]
    return [*found, width_margin(law)] if law.may_free else found


def held_at_rest(law: Friction) -> ca.SX:
    """1 where a law at its limit is held at rest by others, at a steady state: nothing accelerates."""
    return _at_rest(law) >= 0
