"""One pass of the mode rules as symbolic functions: all laws are updated from the same evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from powertrain.dae import contact, friction, switch, when
from powertrain.dae.hybrid import HybridDae
from powertrain.dae.tolerances import JUMP
from powertrain.modes.selflocking import refused


@dataclass(frozen=True)
class Pass:
    """The next held values and what must follow.

    ``flags``: CHANGES, number of entries that change; EDGES, whens with a rising edge; CLOSING, barriers that are struck; TORQUES, sum of
    all torques; IDLE, laws at a limit newly held at rest by others; FORBIDDEN, a value above zero if a law is refused
    (``powertrain.modes.selflocking``); JUMPS, 1 if motions of laws jump.
    """

    held: ca.SX
    flags: ca.SX
    edges: ca.SX
    closing: ca.SX


def mode_pass(dae: HybridDae, fire: ca.SX, jumped: ca.SX, slack: ca.SX) -> Pass:
    """The mode rules.

    ``fire`` marks timed laws whose instant is now. ``jumped`` is ``START``, ``JUMPED`` or 0. ``slack`` is 1 for modes from the
    complementarity problem and for single trials, else 0: a law at rest that shares its motion with none, or is nonlinear in the torques,
    may then count as sliding while its rate is negative within its uncertainty. Laws with a ``share`` do not depend on it.
    """
    held = [dae.m[i] for i in range(dae.m.numel())]
    fires = switch.firing(dae, fire)
    for rubbing in dae.frictions:
        for index, mode in friction.next_modes(dae, rubbing, jumped, slack).items():
            held[index] = mode
    for condition in (*dae.switches, *dae.relations):
        held[condition.index] = switch.next_mode(dae, condition, fires.get(condition.index))
    for touching in dae.contacts:
        held[touching.index] = contact.next_mode(dae, touching, jumped)
    edges = []
    for law in dae.whens:
        edges.append(when.rises(dae, law, fires.get(law.index)))
        held[law.index] = when.next_mode(dae, law)
    closing = _closing(dae, jumped)
    return Pass(ca.vertcat(*held), _flags(dae, held, edges, closing), ca.vertcat(*edges), ca.vertcat(*closing))


def _closing(dae: HybridDae, jumped: ca.SX) -> list[ca.SX]:
    """Which barriers are struck."""
    contacts = [contact.struck(dae, law, jumped) for law in dae.contacts]
    return [*contacts, *(friction.struck(barrier, jumped) for barrier in dae.barriers[len(contacts) :])]


def _flags(dae: HybridDae, held: Sequence[ca.SX], edges: Sequence[ca.SX], closing: Sequence[ca.SX]) -> ca.SX:
    changes = ca.sum1(ca.vertcat(*held) != dae.m) if held else ca.SX(0)
    torques = sum((law.torque for law in dae.frictions), ca.SX(0))
    idle = sum((friction.idles(dae, law) for law in dae.frictions if law.rests is not None), ca.SX(0))
    flags = [changes, sum(edges, ca.SX(0)), sum(closing, ca.SX(0)), torques, idle, refused(dae), _jumps(dae, held)]
    return ca.densify(ca.vertcat(*flags))


def _jumps(dae: HybridDae, held: Sequence[ca.SX]) -> ca.SX:
    """Whether the new held values, other than modes of laws, make the speed of a law or a gap jump: a belt that a signal starts."""
    motions = dae.motions
    if not dae.may_jump(motions):
        return ca.SX(0)
    free = dae.free_held
    after = ca.substitute(motions, ca.vertcat(*(dae.m[i] for i in free)), ca.vertcat(*(held[i] for i in free)))
    excess = ca.fabs(after - motions) - JUMP * (1 + ca.fabs(motions) + ca.fabs(after))
    return ca.SX(ca.mmax(ca.densify(excess)) > 0)
