"""The unilateral contact: everything that follows from its record, ``Contact``.

Its equation in each mode (open: no force; closed: no acceleration of the gap) is in ``powertrain.compiler.torques``, its impacts in
``powertrain.modes.discontinuities``.
"""

from __future__ import annotations

import casadi as ca

from powertrain.dae.hybrid import Contact, HybridDae
from powertrain.dae.tolerances import EPS, INTEGRATED, ZONE

CLOSED, OPEN = 1.0, 0.0


def pressure_margin(law: Contact) -> ca.SX:
    """Force of a closed contact above its opening limit; including the hysteresis."""
    return law.force + law.hysteresis


def gap_margin(law: Contact, known: ca.SX | float = EPS) -> ca.SX:
    """Gap of an open contact; including the hysteresis."""
    return law.gap + known


def approaching(law: Contact) -> ca.SX:
    """The gap closes; ignores noise of a speed around zero, and of the acceleration if friction holds both sides."""
    slow = ca.logic_and(law.speed < 0, law.acceleration < -law.still)
    return ca.logic_or(law.speed < -EPS, slow)


def watched(dae: HybridDae, law: Contact) -> list[tuple[ca.SX, ca.SX | float]]:
    """What falls through zero when the contact must change its mode, with its uncertainty.

    Open: no approach below zero. Closed: no pulling force.
    """
    closed = dae.m[law.index] > 0.5
    open_ = ca.if_else(ca.logic_or(law.gap > 0, approaching(law)), gap_margin(law), 1.0)
    return [(ca.if_else(closed, pressure_margin(law), open_), ca.if_else(closed, law.hysteresis, EPS))]


def next_mode(dae: HybridDae, law: Contact, jumped: ca.SX) -> ca.SX:
    """A closed contact opens if its force would pull, or if a jump takes one of its sides away."""
    pressed = ca.logic_and(pressure_margin(law) > 0, ca.logic_not(_taken_away(law, jumped)))
    return ca.if_else(dae.m[law.index] > 0.5, pressed, _comes_to_rest(law))


def struck(dae: HybridDae, law: Contact, jumped: ca.SX) -> ca.SX:
    """Whether an open contact closes with a speed, or a reset throws the sides of a closed one at each other."""
    hits = ca.logic_and(ca.logic_and(gap_margin(law) <= 0, approaching(law)), ca.logic_not(_comes_to_rest(law)))
    thrown = ca.logic_and(ca.logic_and(jumped > 0, law.speed < -INTEGRATED), ca.logic_not(_taken_away(law, jumped)))
    return ca.if_else(dae.m[law.index] > 0.5, thrown, hits)


def _comes_to_rest(law: Contact) -> ca.SX:
    """Whether an open contact closes without an impact."""
    near = ca.logic_and(ca.fabs(law.gap) <= ZONE, ca.fabs(law.speed) <= EPS)
    return ca.logic_and(near, law.acceleration < -law.still)


def _taken_away(law: Contact, jumped: ca.SX) -> ca.SX:
    """Whether a jump has moved the sides of a closed contact apart, or throws them apart."""
    return ca.logic_and(jumped > 0, ca.logic_or(law.gap > INTEGRATED, law.speed > INTEGRATED))


def steady_margins(law: Contact, moved: bool) -> dict[float, ca.SX]:
    """The modes that the contact may have at a steady state, each with a margin that is not negative where it holds.

    ``moved``: an unknown makes the gap of the closed contact zero, as the integration does in a run; otherwise the gap must be zero.
    """
    closed = pressure_margin(law) if moved else ca.fmin(pressure_margin(law), ZONE - ca.fabs(law.gap))
    return {CLOSED: closed, OPEN: gap_margin(law)}


def next_steady_mode(law: Contact, mode: ca.SX, zone: ca.SX) -> ca.SX:
    """The mode that follows at an iterate of a steady state; ``zone`` is the uncertainty of the gap.

    A closed contact opens if its force would pull, or if its sides are apart.
    """
    stays = ca.logic_and(pressure_margin(law) >= 0, law.gap <= zone)
    return ca.if_else(mode == CLOSED, stays, gap_margin(law, zone) < 0)
