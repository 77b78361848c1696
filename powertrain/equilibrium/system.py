"""The conditions of a steady state and their unknowns: one square system, solved symbolically as far as possible.

In a steady state all derivatives are zero. Angles that merely turn, i.e. states on which no rate, residual or law depends, are left out.
If only differences of states matter, one of them is left out. A prescribed variable is one more condition. It needs one more unknown (an
input or parameter to be found), or it holds a state whose own rate is then not required to be zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.dae.contact import CLOSED
from powertrain.dae.friction import STUCK
from powertrain.dae.hybrid import Contact, Friction, Guard, HybridDae, Law, Opened
from powertrain.equilibrium.elimination import Condition, Unknown, blocks_of, solved_block
from powertrain.equilibrium.placed import (
    Placed,
    Request,
    Turning,
    influential,
    lost_outputs,
    relative_rate,
    rest_of,
    state_of,
    turning_together,
)
from powertrain.equilibrium.starts import starts
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, key, mapped, scalars
from powertrain.numerics.batch import Common, dependence


@dataclass(frozen=True)
class Balance:
    """The conditions of a steady state for given torques ``tau`` of the laws (minus the force of a contact).

    ``rows`` are zero at the unknowns ``y``; all is in terms of grid, y, modes, common values and tau. ``speed`` are the relative speeds of
    friction laws and the gaps of contacts, ``lower`` and ``upper`` the limits of their torques, multiplied by ``peak`` while stuck;
    ``conditions`` are those of switches. ``rate_of`` is the unknown whose rate a row is, or -1. A search for y starts at ``start``, as
    guessed, and at ``initial``, as at the start of a run.
    """

    dae: HybridDae
    grid: Symbol
    y: Symbol
    names: tuple[str, ...]
    start: Symbol
    initial: Symbol
    modes: Symbol
    common: Common
    tau: Symbol
    rows: Symbol
    rate_of: NDArray[np.intp]
    speed: Symbol
    lower: Symbol
    upper: Symbol
    conditions: Symbol
    peak: Symbol


@dataclass(frozen=True)
class Equilibrium:
    """The steady problem as expressions of grid values, implicit unknowns ``u``, modes and common values.

    ``rows`` are zero at ``u``; ``torques_in`` are the sizes of what torques of laws contribute to those that are rates. ``solved`` are
    inputs and parameters found symbolically; ``common`` are all parameters, then all inputs. ``turning``: which outputs depend on angles
    that merely turn. ``together``: some states were left out because they turn together, at ratios that hold for the present parameters,
    or outputs do not depend on such states for these. ``balance`` is the same problem for given torques of the laws.
    """

    grid: list[Symbol]
    u: list[Symbol]
    u_names: list[str]
    modes: list[Symbol]
    common: Common
    rows: list[Symbol]
    torques_in: list[Symbol]
    solved: list[Symbol]
    outputs: list[Symbol]
    rates: list[Symbol]
    laws: list[Law]
    guards: list[Guard]
    turning: list[bool]
    together: bool
    balance: Balance


def formulate(compiled: Compiled, asked: Request, parameters: Array) -> Equilibrium:
    """The steady problem of a model. ParameterError if the conditions do not determine it."""
    dae, placed = compiled.dae, Placed(compiled, asked, parameters)
    kept = influential(placed)
    turning = turning_together(placed, kept)
    unknowns = [Unknown(dae.x[i], dae.state_names[i]) for i in kept if i not in turning]
    unknowns += [Unknown(dae.z[i], dae.z[i].name()) for i in range(dae.z.numel())]
    unknowns += [Unknown(placed.free[n], n) for n in asked.free]
    held = {state_of(compiled, n) for n in asked.held}
    moving = [i for i in kept if i not in turning and i not in held]
    rates = placed.put([relative_rate(i, turning, dae.xdot) for i in moving])
    given = placed.put([compiled.signals[n].expression for n in asked.prescribed])
    conditions = [Condition(r, f"der({dae.state_names[i]}) = 0") for r, i in zip(rates, moving, strict=True)]
    conditions += [
        Condition(r, f"the equation of {dae.z[i].name()}") for i, r in enumerate(placed.put(scalars(dae.residual)))
    ]
    conditions += [
        Condition(e - placed.axis[n], f"{n} as the grid says") for e, n in zip(given, asked.prescribed, strict=True)
    ]
    return _reduced(placed, unknowns, conditions, _balance(placed, moving, unknowns, turning), turning)


def _reduced(
    placed: Placed, unknowns: list[Unknown], conditions: list[Condition], balance: Balance, turning: Turning
) -> Equilibrium:
    """The problem with everything solved that is linear and independent of modes; the rest remains implicit."""
    dae, asked = placed.dae, placed.asked
    symbols, modes = [u.symbol for u in unknowns], [dae.m[law.index] for law in placed.laws]
    cyclic = _cyclic(dae, unknowns)
    old, new = [dae.x[i] for i in cyclic], [Symbol(0)] * len(cyclic)
    rows: list[Symbol] = []
    places: list[int] = []
    implicit: list[int] = []
    for block_rows, block in blocks_of(placed, unknowns, conditions):
        here = _changed([conditions[i].zero for i in block_rows], old, new)
        solution = solved_block(here, [symbols[j] for j in block], modes)
        if solution is None:
            rows += here
            places += block_rows
            implicit += block
        else:
            old += [symbols[j] for j in block]
            new += solution

    def final(expressions: Sequence[Symbol]) -> list[Symbol]:
        return _changed(placed.put(expressions), old, new)

    torques = _torques_in(balance, placed.laws, len(conditions))
    wanted = {key(s) for s in placed.free.values()}
    guards = [*(g for g in dae.guards if g.action == "error"), *placed.compiled.limits.guards(asked.free)]
    lost, cancelled = lost_outputs(placed, cyclic, turning)
    return Equilibrium(
        grid=list(placed.axis.values()),
        u=[symbols[j] for j in implicit],
        u_names=[unknowns[j].name for j in implicit],
        modes=modes,
        common=placed.common,
        rows=rows,
        torques_in=final([torques[i] for i in places]),
        solved=[e for k, e in zip(old, new, strict=True) if key(k) in wanted],
        outputs=final(asked.wanted),
        rates=final([dae.xdot[state_of(placed.compiled, n)] for n in asked.held]),
        laws=[mapped(law, final) for law in placed.laws],
        guards=[mapped(g, final) for g in guards],
        turning=lost,
        together=bool(turning) or cancelled,
        balance=balance,
    )


def _torques_in(balance: Balance, laws: Sequence[Law], count: int) -> list[Symbol]:
    """The size of what the torques of the laws contribute to each of the ``count`` conditions, if it is a rate, which come first."""
    rates = balance.rows[: int((balance.rate_of >= 0).sum())]
    torques = [law.torque for law in laws if isinstance(law, Friction)]
    torques += [-law.force for law in laws if isinstance(law, Contact)]
    slopes = ca.substitute(ca.jacobian(rates, balance.tau), balance.tau, column(torques))
    found = scalars(ca.densify(ca.fabs(slopes) @ ca.fabs(column(torques))))
    return found + [Symbol(0)] * (count - len(found))


def _cyclic(dae: HybridDae, unknowns: Sequence[Unknown]) -> list[int]:
    """The states that are left out: at a steady state they are zero."""
    known = {key(u.symbol) for u in unknowns}
    return [i for i, s in enumerate(scalars(dae.x)) if key(s) not in known]


def _changed(expressions: Sequence[Symbol], old: Sequence[Symbol], new: Sequence[Symbol]) -> list[Symbol]:
    """Expressions with some symbols replaced by others."""
    return list(ca.substitute(list(expressions), [column(list(old))], [column(list(new))]))


def _balance(placed: Placed, moving: Sequence[int], unknowns: Sequence[Unknown], turning: Turning) -> Balance:
    """The same conditions for given torques of the laws."""
    compiled, dae, asked = placed.compiled, placed.dae, placed.asked
    opened, given = _opened(compiled, asked.prescribed)
    count = opened.residual.numel()
    torques = {key(s) for s in scalars(dae.z)[count:]}
    y = [u for u in unknowns if key(u.symbol) not in torques]
    place = {key(u.symbol): i for i, u in enumerate(y)}
    rows = [relative_rate(i, turning, opened.xdot) for i in moving] + [*scalars(opened.residual), *given]
    speed = column([*scalars(opened.speed)[: len(dae.frictions)], *(c.gap for c in dae.contacts)])
    put = placed.put([column(rows), speed, opened.lower, opened.upper, opened.conditions, opened.peak])
    cyclic = _cyclic(dae, unknowns)
    put = _changed(put, [dae.x[i] for i in cyclic], [Symbol(0)] * len(cyclic))
    sign = ca.DM([1.0] * len(dae.frictions) + [-1.0] * len(dae.contacts))
    put = _changed(put, [opened.tau], [sign * opened.tau]) if dae.contacts else put
    wanted = [Symbol(0)] * (len(rows) - len(given)) + [placed.axis[n] for n in asked.prescribed]
    names = tuple(u.name for u in y)
    return Balance(
        dae,
        column(list(placed.axis.values())),
        column([u.symbol for u in y]),
        names,
        *starts(placed, {u.name: u.symbol for u in y}, [dae.x[i] for i in cyclic]),
        column([dae.m[law.index] for law in placed.laws]),
        placed.common,
        opened.tau,
        put[0] - column(wanted),
        np.array([*(place[key(dae.x[i])] for i in moving), *[-1] * (len(rows) - len(moving))], np.intp),
        *put[1:],
    )


def _opened(compiled: Compiled, names: Sequence[str]) -> tuple[Opened, list[Symbol]]:
    """The model for given torques of its laws, and the variables ``names``."""
    dae, none = compiled.dae, Symbol(0, 1)
    if dae.opened is None:
        conditions, signals = column([s.g for s in dae.switches]), [compiled.signals[n].expression for n in names]
        return Opened(none, dae.xdot, dae.residual, none, none, none, none, none, none, none, conditions), signals
    given = [compiled.open([v.symbol])[0] if (v := compiled.variables.get(n)) else None for n in names]
    return dae.opened, [compiled.signals[n].expression if e is None else e for n, e in zip(names, given, strict=True)]


def moved_by_unknowns(problem: Equilibrium) -> list[bool]:
    """The laws whose motion depends on implicit unknowns."""
    return [bool(row.any()) for row in dependence([rest_of(law) for law in problem.laws], problem.u)]


def held_rows(problem: Equilibrium) -> list[tuple[Symbol, int, float]]:
    """Expressions that are zero while a law is stuck or a contact is closed: its speed or gap, its number, and that mode."""
    moved = zip(problem.laws, moved_by_unknowns(problem), strict=True)
    own = [moves and not (isinstance(law, Friction) and (law.prescribed or law.algebraic)) for law, moves in moved]
    modes = [STUCK if isinstance(law, Friction) else CLOSED for law in problem.laws]
    return [(rest_of(law), k, modes[k]) for k, law in enumerate(problem.laws) if own[k]]


def with_modes(expressions: Sequence[Symbol], modes: Sequence[Symbol], values: Mapping[int, float]) -> list[Symbol]:
    """Expressions with some modes replaced by numbers, simplified accordingly."""
    numbers = [Symbol(v) for v in values.values()]
    return _changed([ca.densify(e) for e in expressions], [modes[k] for k in values], numbers)
