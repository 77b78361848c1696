"""The conditions of a steady state and what they determine: one square system, solved symbolically as far as it goes.

Steady is a state whose derivative is zero. Angles that merely turn, that is states on which no rate, residual or law depends, are left
out, and where only differences of states matter, one of them is. A prescribed variable is one more condition; it needs one more
unknown (an input or a parameter to be found), or it holds a state whose own rate is then left over.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler import linear
from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import Contact, Friction, Guard, HybridDae, Schedule, Switch
from powertrain.compiler.index import generic
from powertrain.compiler.matching import Matching, components
from powertrain.equilibrium.balance import Balance, changed, opened, start_of
from powertrain.equilibrium.fraction import root_of_fraction
from powertrain.errors import ParameterError
from powertrain.language.symbols import Symbol, column, key
from powertrain.modes.tolerances import ZONE
from powertrain.numerics.batch import dependence
from powertrain.numerics.buffers import Array

Law = Friction | Switch | Contact
Turning = dict[int, dict[int, float]]
"""States of which only differences matter: {state left out: {other state: how far it turns with it}}."""


@dataclass(frozen=True)
class Request:
    """What is asked for: the grid's names, those that prescribe variables, those held (states), what is to be found, expressions wanted."""

    axes: tuple[str, ...]
    prescribed: tuple[str, ...]
    held: tuple[str, ...]
    free: tuple[str, ...]
    wanted: tuple[Symbol, ...]


@dataclass
class Equilibrium:
    """The steady problem as expressions of the grid's values, the unknowns ``u`` that stay implicit, the modes and the common values.

    ``rows`` are zero at ``u``; ``blocks`` are the numbers of rows and unknowns that belong together, in the order of their solution.
    ``solved`` are the inputs and parameters found symbolically; ``common`` are all parameters, then all inputs.
    ``turning`` says which outputs depend on angles that merely turn; ``together`` that some states were left out because they turn
    together, by ratios that hold for the present parameters. ``balance`` is the same problem for given torques of the laws.
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
    """The steady problem of a model. ParameterError where the conditions do not determine it."""
    dae = compiled.dae
    stage = _Stage(compiled, asked, time, parameters)
    kept = _influential(dae, stage.everything)
    _refuse_turning(asked, kept, stage)
    turning = _turning_together(compiled, kept, stage, parameters)
    unknowns = [Unknown(dae.x[i], dae.state_names[i]) for i in kept if i not in turning]
    unknowns += [Unknown(dae.z[i], dae.z[i].name()) for i in range(dae.z.numel())]
    unknowns += [Unknown(stage.free[n], n) for n in asked.free]
    held = {stage.state_of(n) for n in asked.held}
    moving = [i for i in kept if i not in turning and i not in held]
    rates = stage.put([stage.rate(i, turning, dae.xdot) for i in moving])
    residuals = stage.put([dae.residual[i] for i in range(dae.z.numel())])
    given = stage.put([compiled.signals[n].expression for n in asked.prescribed])
    conditions = [(r, f"der({dae.state_names[i]}) = 0") for r, i in zip(rates, moving, strict=True)]
    conditions += [(r, f"the equation of {dae.z[i].name()}") for i, r in enumerate(residuals)]
    conditions += [(e - stage.axis[n], f"{n} as the grid says") for e, n in zip(given, asked.prescribed, strict=True)]
    balance = _balance(stage, moving, unknowns, turning, guesses)
    return _reduce(stage, unknowns, conditions, balance, guesses, turning)


@dataclass(frozen=True)
class Unknown:
    """A state, an algebraic unknown, or an input or parameter to be found."""

    symbol: Symbol
    name: str


class _Stage:
    """Symbols of the grid in the place of held values, inputs and parameters."""

    def __init__(self, compiled: Compiled, asked: Request, time: float, parameters: Array) -> None:
        dae = self.dae = compiled.dae
        self.values = {key(dae.p[i]): float(value) for i, value in enumerate(parameters)}
        self.compiled, self.asked = compiled, asked
        self.axis = {n: Symbol.sym(n) for n in asked.axes}
        self.free = {n: Symbol.sym(n) for n in asked.free}
        known = self.axis | self.free
        frictions = [replace(f, rounding=Symbol(0)) for f in dae.frictions]  # where angles stand makes no difference
        self.laws: list[Law] = [*frictions, *dae.switches, *dae.contacts]
        self.inputs = {n: Symbol.sym(n) for n in compiled.inputs}
        m = [Symbol(v) for v in dae.held_start.tolist()]
        for law in self.laws:
            m[law.index] = dae.m[law.index]
        for s in dae.schedules:
            value = known.get(s.name, self.inputs[s.name]) if s.name in self.inputs else Symbol(_at(s, time))
            m[s.index : s.index + 3] = [Symbol(time), value, Symbol(0)]
        p = [known.get(n, dae.p[i]) for i, n in enumerate(compiled.parameters)]
        self.arguments = [Symbol(time), dae.x, dae.z, column(m), column(p)]
        shared = [(law.rests, law.w) for law in dae.frictions if law.rests is not None]
        for (index, _), w in zip(shared, self.put([w for _, w in shared]), strict=True):
            m[index] = ca.if_else(ca.fabs(w) <= ZONE, 1.0, 0.0)  # nothing accelerates
        self.arguments[3] = column(m)
        self.common = (
            column([*ca.vertsplit(dae.p), *self.inputs.values()])
            if dae.p.numel()
            else column(list(self.inputs.values()))
        )
        self.everything = self._everything()

    def put(self, expressions: Sequence[Symbol]) -> list[Symbol]:
        """Expressions of (t, x, z, m, p) with the grid's symbols put in."""
        dae = self.dae
        function = ca.Function("powertrain_put", [dae.t, dae.x, dae.z, dae.m, dae.p], [column(list(expressions))])
        result = function.call(self.arguments)[0]
        return list(ca.vertsplit(ca.densify(result))) if result.numel() else []

    def _everything(self) -> list[Symbol]:
        """All that a state can influence: rates, residuals, laws (not how well these are known), guards, prescribed variables."""
        dae = self.dae
        found = [dae.xdot, dae.residual]
        for law in [*self.laws, *dae.guards]:
            found += [
                getattr(law, f.name)
                for f in fields(law)
                if isinstance(getattr(law, f.name), ca.SX) and f.name not in ("time", "known")
            ]
        found += [self.compiled.signals[n].expression for n in self.asked.prescribed]
        whole = column(found)
        return self.put(list(ca.vertsplit(ca.densify(whole)))) if whole.numel() else []

    def put_all(self, columns: Sequence[Symbol], tau: Symbol) -> list[Symbol]:
        """The same for columns that contain the torques of the laws, too."""
        dae = self.dae
        z = dae.z if dae.opened is None else dae.z[: dae.opened.residual.numel()]
        t, x, _, m, p = self.arguments
        function = ca.Function("powertrain_put", [dae.t, dae.x, z, dae.m, dae.p, tau], list(columns))
        found: list[Symbol] = function.call([t, x, z, m, p, tau])
        return [ca.densify(e) for e in found]

    def rate(self, i: int, turning: Turning, xdot: Symbol) -> Symbol:
        """The rate of a state, against those it turns together with."""
        return xdot[i] - sum((row[i] * xdot[k] for k, row in turning.items() if i in row), Symbol(0))

    def state_of(self, name: str) -> int:
        """The state that a variable is, up to its sign; -1 where it is none."""
        return state_of(self.compiled, name)


def state_of(compiled: Compiled, name: str) -> int:
    """The index of the state that a variable is, up to its sign; -1 where it is none."""
    expression = compiled.signals[name].expression
    if not expression.is_symbolic():
        expression = -expression
    places = {key(compiled.dae.x[i]): i for i in range(compiled.dae.x.numel())}
    return places.get(key(expression), -1) if expression.is_symbolic() else -1


def _at(schedule: Schedule, time: float) -> float:
    return float(np.interp(time, schedule.times, schedule.values))


def _influential(dae: HybridDae, everything: Sequence[Symbol]) -> list[int]:
    """The states that anything depends on."""
    found = dependence(everything, [dae.x[i] for i in range(dae.x.numel())])
    return [i for i in range(dae.x.numel()) if found.size and found[:, i].any()]


def _refuse_turning(asked: Request, kept: Sequence[int], stage: _Stage) -> None:
    for name in asked.held:
        if stage.state_of(name) not in kept:
            raise ParameterError(
                f"grid: {name} only rotates; nothing in the model depends on it, so it has no steady value"
            )


def _turning_together(compiled: Compiled, kept: Sequence[int], stage: _Stage, parameters: Array) -> Turning:
    """The states of which only differences matter, for given parameters. ParameterError where that changes along the grid."""
    found = _null_directions(compiled.dae, kept, stage, parameters)
    moved = parameters.copy()
    moved[[i for i, n in enumerate(compiled.parameters) if n in stage.axis or n in stage.free]] *= 1.01
    if found and not _alike(found, _null_directions(compiled.dae, kept, stage, moved)):
        names = ", ".join(compiled.dae.state_names[i] for i in (*found, *next(iter(found.values()))))
        raise ParameterError(
            f"steady: {names} turn together by ratios that change along the grid; "
            "declare their difference as a variable with prefer=True"
        )
    return found


def _alike(one: Turning, other: Turning) -> bool:
    return one.keys() == other.keys() and all(
        one[i].keys() == other[i].keys() and all(abs(one[i][j] - other[i][j]) < 1e-9 for j in one[i]) for i in one
    )


def _null_directions(dae: HybridDae, kept: Sequence[int], stage: _Stage, values: Array) -> Turning:
    if not kept:
        return {}
    x = column([dae.x[i] for i in kept])
    whole = column(stage.everything)
    jacobian = ca.jacobian(whole, x)
    parameters = {key(dae.p[i]) for i in range(dae.p.numel())}
    symbols = [s for s in ca.symvar(jacobian) if key(s) not in parameters]
    function = ca.Function("powertrain_turning", [column(symbols), dae.p], [ca.densify(jacobian)])
    stacks = []
    for k in range(3):
        point = np.random.default_rng(k).uniform(0.3, 2.0, len(symbols))
        value = np.nan_to_num(np.array(function(point, values)), nan=1.0, posinf=1.0, neginf=1.0)
        stacks.append(value / np.maximum(np.abs(value).max(axis=1, keepdims=True), 1e-300))
    _, sizes, basis = np.linalg.svd(np.vstack(stacks))
    null = basis[int((sizes > 1e-9 * max(sizes.max(), 1e-300)).sum()) :]
    pivots: dict[int, Array] = {}
    for _ in range(len(null)):
        row, place = (int(i) for i in np.unravel_index(int(np.abs(null).argmax()), null.shape))
        pivot = null[row] / null[row, place]
        null = np.delete(null - np.outer(null[:, place], pivot), row, axis=0)
        pivots = {other: each - each[place] * pivot for other, each in pivots.items()}
        pivots[place] = pivot
    turning: Turning = {}
    for place, pivot in pivots.items():
        shares = {kept[j]: float(pivot[j]) for j in range(len(kept)) if j not in pivots and abs(pivot[j]) > 1e-9}
        turning[kept[place]] = shares
    return turning


def _reduce(
    stage: _Stage,
    unknowns: list[Unknown],
    conditions: list[tuple[Symbol, str]],
    balance: Balance,
    guesses: Mapping[str, float],
    turning: Turning,
) -> Equilibrium:
    """Solves what is linear and free of modes; the rest stays implicit."""
    dae, asked = stage.dae, stage.asked
    symbols = [u.symbol for u in unknowns]
    rows = [c for c, _ in conditions]
    order = _blocks(stage, unknowns, conditions, rows)
    cyclic = [dae.x[i] for i in range(dae.x.numel()) if key(dae.x[i]) not in {key(s) for s in symbols}]
    old, new = list(cyclic), [Symbol(0)] * len(cyclic)
    implicit_rows: list[Symbol] = []
    implicit: list[int] = []
    blocks: list[tuple[list[int], list[int]]] = []
    for block_rows, block in order:
        here = [rows[i] for i in block_rows]
        if old:
            here = ca.substitute(here, [column(old)], [column(new)])
        solution = _solve(here, [symbols[j] for j in block], [dae.m[law.index] for law in stage.laws])
        if solution is None:
            places = [list(range(n, n + len(block))) for n in (len(implicit_rows), len(implicit))]
            blocks.append((places[0], places[1]))
            implicit_rows += here
            implicit += block
        else:
            old += [symbols[j] for j in block]
            new += solution

    def final(expressions: Sequence[Symbol]) -> list[Symbol]:
        put = stage.put(expressions)
        return list(ca.substitute(put, [column(old)], [column(new)])) if old and put else put

    laws: list[Law] = [_changed(law, final) for law in stage.laws]
    wanted = {key(s) for s in stage.free.values()}
    return Equilibrium(
        grid=list(stage.axis.values()),
        u=[symbols[j] for j in implicit],
        u_names=[unknowns[j].name for j in implicit],
        u_start=start_of([unknowns[j].name for j in implicit], stage.compiled, guesses),
        modes=[dae.m[law.index] for law in stage.laws],
        common=stage.common,
        rows=implicit_rows,
        blocks=blocks,
        solved=[e for k, e in zip(old, new, strict=True) if key(k) in wanted],
        outputs=final(asked.wanted),
        rates=final([dae.xdot[stage.state_of(n)] for n in asked.held]),
        laws=laws,
        guards=[_changed(g, final) for g in dae.guards if g.action == "error"],
        turning=_lost(stage, cyclic, turning),
        together=bool(turning),
        balance=balance,
    )


def _lost(stage: _Stage, cyclic: list[Symbol], turning: Turning) -> list[bool]:
    """The wanted expressions that depend on how far the model has turned."""
    wanted, x = stage.put(stage.asked.wanted), stage.dae.x
    leaves = [s for s in cyclic if key(s) not in {key(x[i]) for i in turning}]
    lost: NDArray[np.bool_] = np.asarray(dependence(wanted, leaves).any(axis=1))
    for i, shares in turning.items():
        direction = ca.DM.zeros(x.numel())
        for j, share in (shares | {i: 1.0}).items():
            direction[j] = share
        change = ca.jtimes(column(wanted), x, direction)
        symbols = ca.symvar(change)
        point = [
            stage.values.get(key(s), generic(s)) for s in symbols
        ]  # ratios by which angles turn are those of the parameters
        number = ca.Function("powertrain_lost", [column(symbols)], [change])(point)
        lost = np.asarray(lost | (np.abs(np.array(number).ravel()) > 1e-9))
    return [bool(lost[i]) for i in range(len(wanted))]


def _changed(record: Any, final: Callable[[list[Symbol]], list[Symbol]]) -> Any:
    """The same law with all its expressions changed."""
    names = [f.name for f in fields(record) if isinstance(getattr(record, f.name), ca.SX) and f.name != "time"]
    values = final([getattr(record, n) for n in names])
    return replace(record, **dict(zip(names, values, strict=True)))


def _balance(
    stage: _Stage, moving: Sequence[int], unknowns: Sequence[Unknown], turning: Turning, guesses: Mapping[str, float]
) -> Balance:
    """The same conditions for given torques of the laws."""
    compiled, dae, asked = stage.compiled, stage.dae, stage.asked
    tau, xdot, residual, given = opened(compiled, asked.prescribed)
    laws = dae.opened
    count = residual.numel()
    implicit = {key(dae.z[i]) for i in range(count, dae.z.numel())}
    y = [u for u in unknowns if key(u.symbol) not in implicit]
    place = {key(u.symbol): i for i, u in enumerate(y)}
    rows = [stage.rate(i, turning, xdot) for i in moving] + list(ca.vertsplit(residual) if count else [])
    rows += given
    bounds = [laws.speed, laws.lower, laws.upper, laws.conditions] if laws is not None else []
    if laws is not None:
        gaps = [c.gap for c in dae.contacts]
        bounds[0] = column([*ca.vertsplit(laws.speed)[: len(dae.frictions)], *gaps])
    else:
        bounds = [Symbol(0, 1)] * 3 + [column([s.g for s in dae.switches])]
    known = {key(u.symbol) for u in unknowns}
    cyclic = [dae.x[i] for i in range(dae.x.numel()) if key(dae.x[i]) not in known]
    expressions = [column(rows), *bounds]
    put = changed(stage.put_all(expressions, tau), cyclic, [Symbol(0)] * len(cyclic))
    wanted = [Symbol(0)] * (len(rows) - len(given)) + [stage.axis[n] for n in asked.prescribed]
    names = tuple(u.name for u in y)
    return Balance(
        dae,
        column(list(stage.axis.values())),
        column([u.symbol for u in y]),
        names,
        start_of(names, compiled, guesses),
        column([dae.m[law.index] for law in stage.laws]),
        stage.common,
        tau,
        put[0] - column(wanted),
        np.array([*(place[key(dae.x[i])] for i in moving), *[-1] * (len(rows) - len(moving))], np.intp),
        *put[1:],
    )


def _blocks(
    stage: _Stage, unknowns: list[Unknown], conditions: list[tuple[Symbol, str]], rows: list[Symbol]
) -> list[tuple[list[int], list[int]]]:
    """Rows and unknowns of the blocks, in the order of their solution."""
    symbols = [u.symbol for u in unknowns]
    entries = dependence(rows, symbols)
    if stage.laws and rows:
        # A law that is stuck puts its speed (a closed contact its gap) in the place of the rates that depend on its mode.
        movable = [k for k, law in enumerate(stage.laws) if not isinstance(law, Switch)]
        through = dependence(rows, [stage.dae.m[stage.laws[k].index] for k in movable])
        speeds = stage.put(
            [law.w if isinstance(law, Friction) else law.gap for law in stage.laws if not isinstance(law, Switch)]
        )
        moved = dependence(speeds, symbols)
        if through.size and moved.size:
            entries = entries | (through.astype(int) @ moved.astype(int) > 0)
    adjacent = [[int(j) for j in np.flatnonzero(row)] for row in entries]
    matching = Matching(lambda e: adjacent[e])
    for e in sorted(range(len(rows)), key=lambda e: len(adjacent[e])):
        if not matching.augment(e):
            texts = [conditions[k][1] for k in sorted(matching.seen_equations)]
            names = sorted(unknowns[j].name for j in matching.seen_variables)
            raise ParameterError(_unbalanced(texts, names))
    graph = [[matching.equation_of[j] for j in row if matching.equation_of[j] != e] for e, row in enumerate(adjacent)]
    return [(sorted(block), sorted(matching.variable_of[e] for e in block)) for block in components(graph)]


def _unbalanced(texts: list[str], names: list[str]) -> str:
    found = (
        f"can only be met by {', '.join(names)}"
        if names
        else "cannot be met: nothing that is to be found influences them"
    )
    return (
        f"steady: the conditions {'; '.join(texts)} {found}. "
        "Prescribe a speed on the grid, or let an input or parameter be found: free=[...]"
    )


def _solve(rows: list[Symbol], unknowns: list[Symbol], modes: list[Symbol]) -> list[Symbol] | None:
    """The unknowns of a block as expressions, or None where it is not linear, or not the same in all modes."""
    jacobian = ca.jacobian(column(rows), column(unknowns))
    slopes = [jacobian.nz[i] for i in range(jacobian.nnz())]
    if dependence(slopes, modes).any():
        return None
    if dependence(slopes, unknowns).any():
        root = root_of_fraction(rows[0], unknowns[0]) if len(rows) == 1 else None
        return None if root is None or dependence([root], modes).any() else [root]
    symbols = ca.symvar(jacobian)
    point = [generic(s) for s in symbols]
    numbers = np.array(ca.Function("powertrain_block", [column(symbols)], [jacobian])(point).nonzeros(), float)
    right = ca.vertsplit(-ca.substitute(column(rows), column(unknowns), ca.DM.zeros(len(unknowns))))
    entries: list[linear.Row] = [{} for _ in rows]
    sizes: list[linear.Numbers] = [{} for _ in rows]
    for k, (i, j) in enumerate(zip(*jacobian.sparsity().get_triplet(), strict=True)):
        if numbers[k] == 0.0:
            continue
        entries[i][j], sizes[i][j] = jacobian.nz[k], float(numbers[k])
    try:
        solution = linear.solve(entries, right, sizes)
    except linear.SingularBlock:
        return None
    return [solution[j] for j in range(len(unknowns))]
