"""The conditions of a steady state and their unknowns: one square system, solved symbolically as far as possible.

In a steady state all derivatives are zero. Angles that merely turn, i.e. states on which no rate, residual or law depends, are left out.
If only differences of states matter, one of them is left out. A prescribed variable is one more condition. It needs one more unknown (an
input or parameter to be found), or it holds a state whose own rate is then not required to be zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import Guard
from powertrain.equilibrium.balance import Balance, changed, opened, start_of
from powertrain.equilibrium.blocks import blocks_of, solved_block
from powertrain.equilibrium.placed import Law, Placed, Request, Turning, Unknown
from powertrain.equilibrium.turning import influential, lost_outputs, refuse_turning, turning_together
from powertrain.language.symbols import Symbol, column, key
from powertrain.numerics.buffers import Array


@dataclass
class Equilibrium:
    """The steady problem as expressions of grid values, implicit unknowns ``u``, modes and common values.

    ``rows`` are zero at ``u``; ``blocks`` are the numbers of rows and unknowns that belong together, in order of solution.
    ``solved`` are inputs and parameters found symbolically; ``common`` are all parameters, then all inputs.
    ``turning``: which outputs depend on angles that merely turn. ``together``: some states were left out because they turn together, at
    ratios that hold for the present parameters. ``balance`` is the same problem for given torques of the laws.
    """

    grid: list[Symbol]
    u: list[Symbol]
    u_names: list[str]
    u_start: Array
    modes: list[Symbol]
    common: Symbol
    rows: list[Symbol]
    blocks: list[tuple[list[int], list[int]]]
    solved: list[Symbol]
    outputs: list[Symbol]
    rates: list[Symbol]
    laws: list[Law]
    guards: list[Guard]
    turning: list[bool]
    together: bool
    balance: Balance


def formulate(
    compiled: Compiled, asked: Request, time: float, guesses: Mapping[str, float], parameters: Array
) -> Equilibrium:
    """The steady problem of a model. ParameterError if the conditions do not determine it."""
    dae = compiled.dae
    placed = Placed(compiled, asked, time, parameters)
    kept = influential(dae, placed.everything)
    refuse_turning(asked, kept, placed)
    turning = turning_together(compiled, kept, placed, parameters)
    unknowns = [Unknown(dae.x[i], dae.state_names[i]) for i in kept if i not in turning]
    unknowns += [Unknown(dae.z[i], dae.z[i].name()) for i in range(dae.z.numel())]
    unknowns += [Unknown(placed.free[n], n) for n in asked.free]
    held = {placed.state_of(n) for n in asked.held}
    moving = [i for i in kept if i not in turning and i not in held]
    rates = placed.put([placed.rate(i, turning, dae.xdot) for i in moving])
    residuals = placed.put([dae.residual[i] for i in range(dae.z.numel())])
    given = placed.put([compiled.signals[n].expression for n in asked.prescribed])
    conditions = [(r, f"der({dae.state_names[i]}) = 0") for r, i in zip(rates, moving, strict=True)]
    conditions += [(r, f"the equation of {dae.z[i].name()}") for i, r in enumerate(residuals)]
    conditions += [(e - placed.axis[n], f"{n} as the grid says") for e, n in zip(given, asked.prescribed, strict=True)]
    balance = _balance(placed, moving, unknowns, turning, guesses)
    return _reduce(placed, unknowns, conditions, balance, guesses, turning)


def _reduce(
    placed: Placed,
    unknowns: list[Unknown],
    conditions: list[tuple[Symbol, str]],
    balance: Balance,
    guesses: Mapping[str, float],
    turning: Turning,
) -> Equilibrium:
    """Solve what is linear and independent of modes; the rest remains implicit."""
    dae, asked = placed.dae, placed.asked
    symbols = [u.symbol for u in unknowns]
    rows = [c for c, _ in conditions]
    order = blocks_of(placed, unknowns, conditions, rows)
    cyclic = [dae.x[i] for i in range(dae.x.numel()) if key(dae.x[i]) not in {key(s) for s in symbols}]
    old, new = list(cyclic), [Symbol(0)] * len(cyclic)
    implicit_rows: list[Symbol] = []
    implicit: list[int] = []
    blocks: list[tuple[list[int], list[int]]] = []
    for block_rows, block in order:
        here = [rows[i] for i in block_rows]
        if old:
            here = ca.substitute(here, [column(old)], [column(new)])
        solution = solved_block(here, [symbols[j] for j in block], [dae.m[law.index] for law in placed.laws])
        if solution is None:
            places = [list(range(n, n + len(block))) for n in (len(implicit_rows), len(implicit))]
            blocks.append((places[0], places[1]))
            implicit_rows += here
            implicit += block
        else:
            old += [symbols[j] for j in block]
            new += solution

    def final(expressions: Sequence[Symbol]) -> list[Symbol]:
        put = placed.put(expressions)
        return list(ca.substitute(put, [column(old)], [column(new)])) if old and put else put

    laws: list[Law] = [_changed(law, final) for law in placed.laws]
    wanted = {key(s) for s in placed.free.values()}
    return Equilibrium(
        grid=list(placed.axis.values()),
        u=[symbols[j] for j in implicit],
        u_names=[unknowns[j].name for j in implicit],
        u_start=start_of([unknowns[j].name for j in implicit], placed.compiled, guesses),
        modes=[dae.m[law.index] for law in placed.laws],
        common=placed.common,
        rows=implicit_rows,
        blocks=blocks,
        solved=[e for k, e in zip(old, new, strict=True) if key(k) in wanted],
        outputs=final(asked.wanted),
        rates=final([dae.xdot[placed.state_of(n)] for n in asked.held]),
        laws=laws,
        guards=[_changed(g, final) for g in dae.guards if g.action == "error"],
        turning=lost_outputs(placed, cyclic, turning),
        together=bool(turning),
        balance=balance,
    )


def _changed(record: Any, final: Callable[[list[Symbol]], list[Symbol]]) -> Any:
    """The same law with all its expressions changed."""
    names = [f.name for f in fields(record) if isinstance(getattr(record, f.name), ca.SX) and f.name != "time"]
    values = final([getattr(record, n) for n in names])
    return replace(record, **dict(zip(names, values, strict=True)))


def _balance(
    placed: Placed, moving: Sequence[int], unknowns: Sequence[Unknown], turning: Turning, guesses: Mapping[str, float]
) -> Balance:
    """The same conditions for given torques of the laws."""
    compiled, dae, asked = placed.compiled, placed.dae, placed.asked
    tau, xdot, residual, given = opened(compiled, asked.prescribed)
    laws = dae.opened
    count = residual.numel()
    implicit = {key(dae.z[i]) for i in range(count, dae.z.numel())}
    y = [u for u in unknowns if key(u.symbol) not in implicit]
    place = {key(u.symbol): i for i, u in enumerate(y)}
    rows = [placed.rate(i, turning, xdot) for i in moving] + list(ca.vertsplit(residual) if count else [])
    rows += given
    bounds = [laws.speed, laws.lower, laws.upper, laws.conditions, laws.peak] if laws is not None else []
    if laws is not None:
        gaps = [c.gap for c in dae.contacts]
        bounds[0] = column([*ca.vertsplit(laws.speed)[: len(dae.frictions)], *gaps])
    else:
        bounds = [Symbol(0, 1)] * 3 + [column([s.g for s in dae.switches]), Symbol(0, 1)]
    known = {key(u.symbol) for u in unknowns}
    cyclic = [dae.x[i] for i in range(dae.x.numel()) if key(dae.x[i]) not in known]
    expressions = [column(rows), *bounds]
    put = changed(placed.put_all(expressions, tau), cyclic, [Symbol(0)] * len(cyclic))
    wanted = [Symbol(0)] * (len(rows) - len(given)) + [placed.axis[n] for n in asked.prescribed]
    names = tuple(u.name for u in y)
    return Balance(
        dae,
        column(list(placed.axis.values())),
        column([u.symbol for u in y]),
        names,
        start_of(names, compiled, guesses),
        column([dae.m[law.index] for law in placed.laws]),
        placed.common,
        tau,
        put[0] - column(wanted),
        np.array([*(place[key(dae.x[i])] for i in moving), *[-1] * (len(rows) - len(moving))], np.intp),
        *put[1:],
    )
