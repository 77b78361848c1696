"""The modes that laws may have at a steady state, and for every mode a margin that is not negative where the mode holds.

Modes follow the rules of the simulation, with one difference: nothing accelerates, so a law at rest is stuck as long as its torque is
within the bounds. If the motion is prescribed, that torque is not determined: the law is at rest with any torque between the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Contact, Friction, Switch
from powertrain.compiler.matching import components
from powertrain.equilibrium.placed import Law
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.symbols import Symbol
from powertrain.modes.indicators import pressure_margin, relation, torque_margins
from powertrain.modes.tolerances import EPS, INFINITE, NO_WIDTH, ZONE
from powertrain.numerics.batch import dependence

FORWARD, STUCK, BACKWARD, FREE = 1.0, 0.0, -1.0, 2.0


@dataclass(frozen=True)
class LawModes:
    """A law with its possible modes; ``rest`` is not negative where no mode holds because the law rests under a prescribed motion."""

    law: Law
    modes: tuple[float, ...]
    margins: tuple[Symbol, ...]
    rest: Symbol | None = None

    def margin(self, mode: float) -> Symbol:
        """Not negative where ``mode`` holds."""
        return self.margins[self.modes.index(mode)]


def choices(problem: Equilibrium) -> list[LawModes]:
    """The choice of every law of a steady problem."""
    return [_choice(law, moved) for law, moved in zip(problem.laws, _moved_by_unknowns(problem), strict=True)]


@dataclass(frozen=True)
class Group:
    """Laws and unknowns that depend on each other and on earlier groups; laws that are not ``coupled`` depend on earlier groups only."""

    laws: list[int]
    unknowns: list[int]
    rows: list[int]
    coupled: bool


def order(problem: Equilibrium, found: Sequence[LawModes]) -> list[Group]:
    """All laws and unknowns in groups, in the order in which they can be solved."""
    laws = range(len(found))
    wanted = [[*c.margins, *([] if c.rest is None else [c.rest])] for c in found]
    wanted += [[problem.rows[i] for i in rows] for rows, _ in problem.blocks]
    owner = [*laws, *(0 for _ in problem.u)]
    for b, (_, block) in enumerate(problem.blocks, len(found)):
        for j in block:
            owner[len(found) + j] = b
    symbols = [*problem.modes, *problem.u]
    graph = [sorted({owner[j] for j in np.flatnonzero(dependence(e, symbols).any(axis=0))}) for e in wanted]
    groups: list[Group] = []
    for nodes in components(graph):
        blocks = [problem.blocks[n - len(found)] for n in sorted(nodes) if n >= len(found)]
        members = sorted(n for n in nodes if n in laws)
        unknowns, rows = [j for _, block in blocks for j in block], [i for rows, _ in blocks for i in rows]
        coupled = bool(blocks) or len(members) > 1 or members[0] in graph[members[0]]
        last = groups[-1] if groups else None
        if last is not None and not coupled and not last.coupled and not set(last.laws) & set(graph[members[0]]):
            groups[-1] = Group([*last.laws, *members], [], [], False)
        else:
            groups.append(Group(members, unknowns, rows, coupled))
    return groups


def _moved_by_unknowns(problem: Equilibrium) -> list[bool]:
    speeds = [
        law.w if isinstance(law, Friction) else law.gap if isinstance(law, Contact) else Symbol(0)
        for law in problem.laws
    ]
    return [bool(row.any()) for row in dependence(speeds, problem.u)] if problem.u else [False] * len(speeds)


def _choice(law: Law, moved: bool) -> LawModes:
    if isinstance(law, Switch):
        return LawModes(law, (1.0, 0.0), (relation(Symbol(1), law.g), relation(Symbol(0), law.g)))
    if isinstance(law, Contact):
        closed = pressure_margin(law) if moved else ca.fmin(pressure_margin(law), ZONE - ca.fabs(law.gap))
        return LawModes(law, (1.0, 0.0), (closed, law.gap + EPS))
    modes = (FORWARD, BACKWARD) if law.prescribed else (STUCK, FORWARD, BACKWARD)
    if law.may_free:
        modes = (*modes, FREE)
    margins = tuple(_friction_margin(law, mode) for mode in modes)
    rests = ca.if_else(ca.fabs(law.w) <= ZONE, law.upper - law.lower - NO_WIDTH, -1)
    return LawModes(law, modes, margins, rests if law.prescribed else None)


def _friction_margin(law: Friction, mode: float) -> Symbol:
    rests = ZONE - ca.fabs(law.w)
    if mode == FREE:
        return NO_WIDTH - (law.upper - law.lower)
    if mode == STUCK:
        held = ca.fmin(*torque_margins(law))
        return held if law.algebraic else ca.fmin(held, rests)
    bound = law.upper if mode == FORWARD else law.lower
    if bound.is_constant() and not math.isfinite(float(bound)):
        return Symbol(-1)
    away = mode * law.w - ZONE
    if law.algebraic:
        away = mode * law.w + EPS
    elif law.prescribed:  # at rest with equal bounds all modes give the same torque
        away = ca.if_else(ca.fabs(law.w) <= ZONE, NO_WIDTH - (law.upper - law.lower), away)
    else:
        away = ca.fmax(away, ca.fmin(rests, mode * law.rate + law.reach * law.hysteresis))
    return away


def bounded(problem: Equilibrium) -> list[Symbol]:
    """Not negative where the values found are finite."""
    torques = [law.torque for law in problem.laws if isinstance(law, Friction)]
    return [margin for e in [*problem.solved, *torques] for margin in (INFINITE - e, INFINITE + e)]


def possible(choice: LawModes, mode: float, hidden: Sequence[Symbol]) -> Symbol:
    """Negative where the given values alone rule out a mode; ``hidden`` symbols are unknown.

    While it is not known whether a law is free, nor whether it slides, the free mode need not be tried: between bounds of zero the law
    slides without torque anyway.
    """
    law, found = choice.law, [] if choice.rest is not None else [choice.margin(mode)]
    if mode == FREE and isinstance(law, Friction):
        if choice.rest is None and dependence([*found, law.w], hidden).any(axis=1).all():
            return Symbol(-1)
    elif isinstance(law, Friction):
        if not law.algebraic:
            found.append(ZONE - ca.fabs(law.w) if mode == STUCK else mode * law.w + ZONE)
        if law.may_free:
            found.append(law.upper - law.lower - NO_WIDTH)
    known = [margin for margin in found if not dependence([margin], hidden).any()]
    return ca.mmin(ca.vertcat(Symbol(0), *known))


def held_rows(problem: Equilibrium) -> list[tuple[int, Symbol]]:
    """Expressions that are zero while a law is stuck or a contact is closed: the number of the law, and its speed or gap."""
    rows = []
    for k, (law, moved) in enumerate(zip(problem.laws, _moved_by_unknowns(problem), strict=True)):
        if moved and isinstance(law, Friction) and not law.prescribed and not law.algebraic:
            rows.append((k, law.w))
        elif moved and isinstance(law, Contact):
            rows.append((k, law.gap))
    return rows


def with_modes(expressions: Sequence[Symbol], modes: Sequence[Symbol], values: Mapping[int, float]) -> list[Symbol]:
    """Expressions with some modes replaced by numbers, simplified accordingly."""
    symbols = ca.symvar(ca.vertcat(*expressions)) if expressions else []
    function = ca.Function(
        "powertrain_given", [ca.vertcat(*symbols)] if symbols else [Symbol(0, 1)], [ca.densify(e) for e in expressions]
    )
    given = {modes[k].element_hash(): Symbol(v) for k, v in values.items()}
    column = ca.vertcat(*[given.get(s.element_hash(), s) for s in symbols]) if symbols else Symbol(0, 1)
    return list(function.call([column]))
