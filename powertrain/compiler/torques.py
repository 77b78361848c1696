"""The torques and forces of friction laws and contacts: one unknown each, found together at every instant from the modes of the laws.

A sliding law gives its torque; a stuck one makes the rate of its relative speed zero. With the motion's equations already solved for given
torques, both are rows of one small system in the torques, whose locked part is symmetric and positive definite.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import casadi as ca
import numpy as np

from powertrain.compiler import linear, sharing
from powertrain.compiler.alias import Reduced, quote
from powertrain.compiler.cancellation import terms
from powertrain.compiler.flatten import Equation
from powertrain.compiler.index import Differentiated, generic
from powertrain.errors import ModelError
from powertrain.laws import FrictionLaw, Law, UnilateralLaw
from powertrain.recorder import Place
from powertrain.symbols import Symbol, column, free_symbols, key, total_derivative

_FLOOR = 1e-9
"""Pivots of stuck laws below this part of what they are alone count as zero."""
HOLDS = 1e-6
"""Pivot of a law that no torque can hold: where it would have to be held its torque is beyond all bounds."""
_ROUND_OFF = 1e-13
"""What is left of terms that cancel each other counts as zero below this part of them."""


@dataclass
class Torque:
    """A friction law or contact, whose torque is the unknown ``symbol``."""

    place: Place
    law: FrictionLaw | UnilateralLaw
    symbol: Symbol
    mode: Symbol
    algebraic: bool = False
    speed: Symbol = field(default_factory=Symbol)
    rate: Symbol = field(default_factory=Symbol)


def declare_torques(reduced: Reduced) -> tuple[list[Torque], list[tuple[Place, Law]]]:
    """One unknown for each friction law and contact: the root of its torque, or a new symbol where the torque is no root."""
    flat, torques, others = reduced.flat, [], []
    taken: dict[int, Place] = {}
    for place, law in flat.laws:
        if not isinstance(law, FrictionLaw | UnilateralLaw):
            others.append((place, law))
            continue
        plain = law.torque if isinstance(law, FrictionLaw) else law.force
        law = law.mapped(reduced.rewrite)
        value = law.torque if isinstance(law, FrictionLaw) else law.force
        inside = [s for s in free_symbols(value) if key(s) not in flat.recorder.constants]
        linear_root = (
            len(inside) == 1 and ca.jacobian(value, inside[0]).is_constant() and key(inside[0]) in reduced.symbols
        )
        if linear_root and key(inside[0]) in taken:
            raise ModelError(
                f"{place}\n{taken[key(inside[0])]}\n  these two carry the same torque, with nothing between them that has inertia or "
                "compliance: what moves between them is not determined; put an inertia, mass or damper between"
            )
        if linear_root:
            symbol = inside[0]
        elif not inside:
            _refuse_given(reduced, place, plain)
        else:
            symbol = Symbol.sym(f"{place.path}.{law.name}.torque")
            reduced.symbols[key(symbol)] = symbol
            reduced.equations.append(Equation(value - symbol, place))
        taken[key(symbol)] = place
        torques.append(Torque(place, law, symbol, flat.recorder.hold(f"{place.path}.{law.name}".lstrip("."))))
    return torques, others


def _refuse_given(reduced: Reduced, place: Place, torque: Symbol) -> NoReturn:
    """The torque of a law is constant already, because of a flange that is not connected."""
    ties = reduced.tied_by([key(s) for s in free_symbols(torque) if key(s) in reduced.flat.unknowns])
    raise ModelError(
        f"loose part: {place}\n  its torque or force is already given by the lines below, so that its motion is not determined; "
        f"connect what is open to something with inertia, or take the part out\n  {quote(ties)}"
    )


def add_rates(system: Differentiated, torques: list[Torque]) -> None:
    """The rate of each law: the derivative of its relative speed, or the speed itself where it depends on the torque at once."""
    recorder = system.reduced.flat.recorder

    def defined(name: str, expression: Symbol, place: Place) -> Symbol:
        symbol = Symbol.sym(name)
        system.reduced.symbols[key(symbol)] = symbol
        system.add(Equation(symbol - expression, place))
        return symbol

    for torque in torques:
        law, place, path = torque.law, torque.place, torque.mode.name()
        if isinstance(law, FrictionLaw):
            torque.speed = law.w
            if any(order > system.top.get(b, 0) for b, order in system.bases(law.w)):
                defined(f"{path}.speed", law.w, place)
            torque.algebraic = _follows_at_once(system, law.w, torque.symbol)
        else:
            torque.speed = defined(f"{path}.speed", total_derivative(law.gap, recorder.derivative), place)
        if torque.algebraic:
            torque.rate = torque.speed
        else:
            torque.rate = defined(f"{path}.rate", total_derivative(torque.speed, recorder.derivative), place)


def _follows_at_once(system: Differentiated, speed: Symbol, torque: Symbol) -> bool:
    """Whether ``speed`` contains an unknown that the equations tie to ``torque`` without an integration between."""
    stack = [b for b, order in system.bases(speed) if order == system.top.get(b, -1)]
    seen: set[int] = set()
    while stack:
        base = stack.pop()
        owner = system.matching.equation_of.get(base)
        if owner is None or owner in seen:
            continue
        seen.add(owner)
        residual = system.chains[owner][-1]
        if any(key(s) == key(torque) for s in free_symbols(residual)):
            return True
        stack += [b for b, order in system.incidence[owner] if order == system.top[b]]
    return False


@dataclass(frozen=True)
class Group:
    """Friction laws on the same motion, with the unknown fraction where their bounds depend on torques."""

    members: tuple[sharing.Member, ...]
    theta: Symbol | None


def parallel_groups(
    torques: list[Torque], opened: Sequence[Torque], x: Symbol, values: dict[int, float]
) -> list[Group]:
    """The groups of laws whose relative speeds are always proportional. ``opened`` holds the laws in terms of states and torques."""
    symbols = column([t.symbol for t in torques])
    movable = [
        i for i, t in enumerate(opened)
        if isinstance(t.law, FrictionLaw) and not t.algebraic and ca.which_depends(t.rate, torques[i].symbol, 1, False)[0]
    ]  # fmt: skip
    if len(movable) < 2:
        return []
    gradients = ca.densify(ca.jacobian(column([opened[i].speed for i in movable]), x))
    inside = ca.symvar(gradients)
    point = ca.DM([values.setdefault(key(s), generic(s)) for s in inside]) if inside else ca.DM(0, 1)
    numbers = np.array(ca.Function("powertrain_parallel", [column(inside)], [gradients])(point), float)
    groups = []
    for rows in sharing.parallel(numbers):
        members = [_member(movable[row], sign, opened[movable[row]]) for row, sign in rows]
        members.sort(key=lambda m: (not m.infinite, _hollow(m, symbols, values)))
        bounds = ca.vertcat(*(ca.vertcat(m.lower, m.upper) for m in members))
        name = "share." + "+".join(torques[m.law].mode.name() for m in members)
        tied = any(ca.which_depends(bounds, symbols, 1, False))
        groups.append(Group(tuple(members), Symbol.sym(name) if tied else None))
    return groups


def _hollow(member: sharing.Member, torques: Symbol, values: dict[int, float]) -> bool:
    """Whether a law has no bounds without torques. Such a law comes late: the first stuck one of a group holds the motion."""
    width = ca.substitute(member.upper - member.lower, torques, ca.DM.zeros(torques.numel()))
    inside = ca.symvar(width)
    point = ca.DM([values.get(key(s), generic(s)) for s in inside]) if inside else ca.DM(0, 1)
    return float(ca.Function("powertrain_width", [column(inside)], [width])(point)) == 0.0


def _member(index: int, sign: float, t: Torque) -> sharing.Member:
    law = t.law
    assert isinstance(law, FrictionLaw)
    infinite = any(b.is_constant() and np.isinf(float(b)) for b in (law.lower, law.upper))
    return sharing.Member(index, sign, t.mode == 0, law.torque, law.peak * law.lower, law.peak * law.upper, infinite)


def solve_torques(
    torques: list[Torque], opened: Sequence[Torque], groups: list[Group], parameters: dict[int, float]
) -> tuple[list[Symbol], list[int], list[Symbol]]:
    """The torques as expressions of states, implicit unknowns and modes; which of them stay implicit; and the residuals of these.

    A torque stays implicit where the laws are not linear in it, as with an efficiency that depends on the load.
    """
    if not torques:
        return [], [], []
    everything = column([t.symbol for t in torques])
    rows = [_law_row(t, torques[i].symbol, everything) for i, t in enumerate(opened)]
    for group in groups:
        for k, member in enumerate(group.members[1:], 1):
            joint, shared = sharing.share(group.members, k, group.theta)
            rows[member.law] = ca.if_else(ca.logic_and(member.stuck, joint), shared, rows[member.law])
    symbols, given = [t.symbol for t in torques], None
    bent = _bent(rows, symbols)
    if bent:  # a table of several arguments hides that it does not depend on torques
        rows, given = _without_torques(rows, symbols)
        bent = _bent(rows, symbols)
    implicit = [i for i, t in enumerate(torques) if key(t.symbol) in bent]
    explicit = [i for i in range(len(rows)) if i not in implicit]
    solution = [t.symbol for t in torques]
    linear_rows, stuck = [rows[i] for i in explicit], [torques[i].mode == 0 for i in explicit]
    idle = [unmoved(opened[i], parameters) for i in explicit]
    found = _solve_linear(linear_rows, [solution[i] for i in explicit], stuck, idle)
    for i, value in zip(explicit, found, strict=True):
        solution[i] = value
    left = [rows[i] for i in implicit]
    if given is not None:
        whole = ca.vertsplit(ca.substitute(column([*solution, *left]), *given))
        solution, left = whole[: len(solution)], whole[len(solution) :]
    return solution, implicit, left


def unmoved(t: Torque, parameters: dict[int, float]) -> Symbol:
    """Whether a torque does not move its own friction law: where the terms of its influence cancel each other.

    They may do so at instants, or for the ``parameters``, as between two equal wheels that roll on one body.
    """
    slope = ca.jacobian(t.rate, t.symbol)
    if isinstance(t.law, UnilateralLaw):
        return Symbol(0)
    cancels = ca.fabs(slope) <= _ROUND_OFF * terms(slope)
    inside = free_symbols(slope)
    if all(key(s) in parameters for s in inside):
        numbers = ca.DM([parameters[key(s)] for s in inside]) if inside else ca.DM(0, 1)
        if not float(ca.Function("powertrain_unmoved", [column(inside)], [cancels])(numbers)):
            return Symbol(0)
    return cancels


def cancels(slope: Symbol) -> bool:
    """Whether the terms of an expression cancel each other whatever the values."""
    inside = free_symbols(slope)
    numbers = ca.DM([generic(s) for s in inside]) if inside else ca.DM(0, 1)
    off = ca.fabs(slope) <= _ROUND_OFF * terms(slope)
    return bool(float(ca.Function("powertrain_cancels", [column(inside)], [off])(numbers)))


def _bent(rows: list[Symbol], symbols: list[Symbol]) -> set[int]:
    """What the slopes of the rows depend on."""
    slopes = ca.jacobian(column(rows), column(symbols))
    return {key(s) for s in free_symbols(ca.vertcat(0, *ca.vertsplit(ca.vec(slopes.nz[:]))))} & {
        key(s) for s in symbols
    }


def _without_torques(rows: list[Symbol], symbols: list[Symbol]) -> tuple[list[Symbol], tuple[Symbol, Symbol]]:
    """The rows with a symbol for every part that holds no torque, and these symbols with their expressions."""
    torques, whole = {key(s) for s in symbols}, column(rows)
    others = column([s for s in free_symbols(whole) if key(s) not in torques])
    short, names, parts = ca.extract_parametric(whole, others, {})
    return ca.vertsplit(short), (column(names), column(parts))


def _solve_linear(rows: list[Symbol], unknowns: list[Symbol], stuck: list[Symbol], idle: list[Symbol]) -> list[Symbol]:
    """The unknowns of linear rows, each row's own unknown taken as its pivot.

    A stuck law whose motion the other stuck laws already hold has no pivot left; with a tiny one in its place it takes no torque,
    unless it would have to hold against them: then its torque is beyond all bounds. Nor has a law that is ``idle``: unmoved by its torque.
    """
    if not rows:
        return []
    whole, symbols = column(rows), column(unknowns)
    jacobian = ca.jacobian(whole, symbols)
    right = ca.vertsplit(-ca.substitute(whole, symbols, ca.DM.zeros(len(rows))))
    entries: list[linear.Row] = [{} for _ in rows]
    numbers: list[linear.Numbers] = [{} for _ in rows]
    elements = ca.vertsplit(ca.vec(jacobian.nz[:])) if jacobian.nnz() else []
    for i, j, entry in zip(*jacobian.sparsity().get_triplet(), elements, strict=True):
        entries[i][j], numbers[i][j] = entry, 1e9 if i == j else 1.0
    own = [row.get(i, Symbol(1)) for i, row in enumerate(entries)]

    def settle(i: int, pivot: Symbol) -> Symbol:
        if pivot.is_constant() or (len(rows) < 2 and idle[i].is_zero()):
            return pivot
        nothing = ca.logic_or(own[i] == 0, idle[i])
        floor = ca.if_else(nothing, -HOLDS, _FLOOR * own[i])
        small = ca.logic_or(idle[i], ca.fabs(pivot) <= _FLOOR * ca.fabs(own[i]))
        return ca.if_else(ca.logic_and(stuck[i], small), floor, pivot)

    solution = linear.solve(entries, right, numbers, settle)
    return [solution[j] for j in range(len(rows))]


def _law_row(t: Torque, own: Symbol, torques: Symbol) -> Symbol:
    """The equation of a torque. At rest under a motion that it cannot change it is as small as its bounds allow."""
    if isinstance(t.law, UnilateralLaw):
        return ca.if_else(t.mode == 1, t.rate, t.law.force)
    moved = any(ca.which_depends(t.rate, own, 1, False))
    tied = any(ca.which_depends(ca.vertcat(t.law.lower, t.law.upper), torques, 1, False))
    resting = Symbol(0) if moved or tied else ca.fmax(t.law.lower, ca.fmin(t.law.upper, 0))
    sliding = t.law.torque - ca.if_else(t.mode == -1, t.law.lower, t.law.upper)
    return ca.if_else(t.mode == 0, t.rate if moved else t.law.torque - resting, sliding)
