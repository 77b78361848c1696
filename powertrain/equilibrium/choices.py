"""The modes that laws may have at a steady state, and for every mode a margin that is not negative where the mode holds.

The margins are those of the laws (``steady_margins`` in ``powertrain.modes.friction``, ``contact`` and ``switch``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Contact, Friction, Switch
from powertrain.compiler.matching import components
from powertrain.equilibrium.placed import Law, rest_of
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.symbols import Symbol
from powertrain.modes import contact, friction, switch
from powertrain.modes.friction import FREE
from powertrain.modes.tolerances import INFINITE
from powertrain.numerics.batch import dependence


@dataclass(frozen=True)
class LawModes:
    """A law with a margin for each possible mode; ``rest`` is not negative where none holds because a prescribed motion rests."""

    law: Law
    margins: Mapping[float, Symbol]
    rest: Symbol | None = None

    @property
    def modes(self) -> tuple[float, ...]:
        """In the order in which they are tried."""
        return tuple(self.margins)


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
    wanted = [[*c.margins.values(), *([] if c.rest is None else [c.rest])] for c in found]
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
    return [bool(row.any()) for row in dependence([rest_of(law) for law in problem.laws], problem.u)]


def _choice(law: Law, moved: bool) -> LawModes:
    if isinstance(law, Switch):
        return LawModes(law, switch.steady_margins(law))
    if isinstance(law, Contact):
        return LawModes(law, contact.steady_margins(law, moved))
    return LawModes(law, friction.steady_margins(law), friction.steady_rest(law) if law.prescribed else None)


def bounded(problem: Equilibrium) -> list[Symbol]:
    """Not negative where the values found are finite."""
    torques = [law.torque for law in problem.laws if isinstance(law, Friction)]
    return [margin for e in [*problem.solved, *torques] for margin in (INFINITE - e, INFINITE + e)]


def possible(choice: LawModes, mode: float, hidden: Sequence[Symbol]) -> Symbol:
    """Negative where the given values alone rule out a mode; ``hidden`` symbols are unknown.

    While it is not known whether a law is free, nor whether it slides, the free mode need not be tried: between bounds of zero the law
    slides without torque anyway.
    """
    law, found = choice.law, [] if choice.rest is not None else [choice.margins[mode]]
    if isinstance(law, Friction) and mode == FREE:
        if choice.rest is None and dependence([*found, law.w], hidden).any(axis=1).all():
            return Symbol(-1)
    elif isinstance(law, Friction):
        found += friction.necessary(law, mode)
    known = [margin for margin in found if not dependence([margin], hidden).any()]
    return ca.mmin(ca.vertcat(Symbol(0), *known))


def held_rows(problem: Equilibrium) -> list[tuple[int, Symbol]]:
    """Expressions that are zero while a law is stuck or a contact is closed: the number of the law, and its speed or gap."""
    moved = zip(problem.laws, _moved_by_unknowns(problem), strict=True)
    own = [not (isinstance(law, Friction) and (law.prescribed or law.algebraic)) and moves for law, moves in moved]
    return [(k, rest_of(law)) for k, law in enumerate(problem.laws) if own[k]]


def with_modes(expressions: Sequence[Symbol], modes: Sequence[Symbol], values: Mapping[int, float]) -> list[Symbol]:
    """Expressions with some modes replaced by numbers, simplified accordingly."""
    symbols = ca.symvar(ca.vertcat(*expressions)) if expressions else []
    function = ca.Function(
        "powertrain_given", [ca.vertcat(*symbols)] if symbols else [Symbol(0, 1)], [ca.densify(e) for e in expressions]
    )
    given = {modes[k].element_hash(): Symbol(v) for k, v in values.items()}
    column = ca.vertcat(*[given.get(s.element_hash(), s) for s in symbols]) if symbols else Symbol(0, 1)
    return list(function.call([column]))
