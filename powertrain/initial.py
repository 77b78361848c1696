"""Initialisation: which conditions fix the start, the solution for the states, and a report of what was used.

Conditions in the order of their right: values given for this run, the equations of ``initial()``, declared ``start`` values, and zero
for the states that are left. A condition that follows from those before it is not needed; it must agree with them unless a value
of the run replaces it. Guesses only say where the search begins.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.assemble import Compiled
from powertrain.engine import Engine
from powertrain.errors import InitializationError, ParameterError, suggestion
from powertrain.symbols import Symbol, column, free_symbols, key

Array = NDArray[np.float64]
_ROUNDS = 20
_ITERATIONS = 60
_DENSE = 200
_KEPT = 16


@dataclass(frozen=True)
class Condition:
    """expression = value at the start."""

    label: str
    source: str
    expression: Symbol
    value: float
    unit: str = "1"


@dataclass(frozen=True)
class InitialReport:
    """The start of one run: the conditions that were used, those that follow from others, and the states they give."""

    used: tuple[Condition, ...]
    implied: tuple[Condition, ...]
    states: dict[str, float]

    def __str__(self) -> str:
        rows = [(c.label, f"{c.value:.6g} {c.unit}", c.source) for c in self.used]
        rows += [
            (c.label, f"{c.value:.6g} {c.unit}", f"{c.source}; not needed, it follows from the others")
            for c in self.implied
        ]
        rows += [(name, f"{value:.6g}", "state") for name, value in self.states.items()]
        widths = [max((len(row[k]) for row in rows), default=0) for k in (0, 1)]
        return "\n".join(f"{a:<{widths[0]}}  {b:>{widths[1]}}  {c}" for a, b, c in rows)


class Initializer:
    """Solves the initial conditions of one compiled model; keeps what it built for each set of given names. Serves one thread."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled
        self._text = _text_conditions(compiled)
        self._declared = _declared_conditions(compiled)
        self._plans: dict[tuple[str, ...], _Plan] = {}

    def solve(
        self, engine: Engine, t: float, p: Array, m: Array, starts: Mapping[str, float], guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        """States, algebraic unknowns, held values and the report. Raises InitializationError where the conditions cannot be met."""
        names = tuple(starts)
        if names not in self._plans:
            given = [_signal_condition(self.compiled, n, 0.0, "given for this run") for n in names]
            self._plans[names] = _Plan(self.compiled, [*given, *self._text, *self._declared], len(given))
        return self._plans[names].solve(engine, t, p, m, np.array([float(v) for v in starts.values()]), guesses)


def _text_conditions(compiled: Compiled) -> list[Condition]:
    flat = compiled.flat
    residuals = compiled.resolve([e.residual for e in flat.initial])
    conditions = []
    for equation, residual in zip(flat.initial, residuals, strict=True):
        _refuse_unknown(compiled, residual, str(equation.place))
        conditions.append(Condition(str(equation.place), "initial()", residual, 0.0))
    return conditions


def _refuse_unknown(compiled: Compiled, expression: Symbol, where: str) -> None:
    dae = compiled.dae
    inside = {key(s) for group in (dae.t, dae.x, dae.z, dae.m, dae.p) for s in ca.symvar(group)}
    strange = [s.name() for s in free_symbols(expression) if key(s) not in inside]
    if strange:
        raise InitializationError(
            f"{where}\n  {strange[0]} is no variable of the model after reduction; state the condition otherwise"
        )


def _signal_condition(compiled: Compiled, name: str, value: float, source: str) -> Condition:
    if name not in compiled.signals:
        raise ParameterError(f"starts: the model has no variable {name}{suggestion(name, compiled.signals)}")
    signal = compiled.signals[name]
    return Condition(name, source, signal.expression, value, signal.unit)


def _declared_conditions(compiled: Compiled) -> list[Condition]:
    """Declared starts: first those that are not zero, then absolute quantities, then the relative ones that are preferred as states."""
    declared = [u for u in compiled.flat.unknowns.values() if u.start is not None]
    declared.sort(key=lambda u: (u.start == 0.0, u.prefer))
    return [_signal_condition(compiled, u.name, u.start or 0.0, "start of the variable") for u in declared]


class _Plan:
    """The conditions for one set of given names, made independent at the point where they are solved, by Newton's method."""

    def __init__(self, compiled: Compiled, conditions: list[Condition], given: int) -> None:
        self.compiled, self.conditions, self.given = compiled, conditions, given
        dae = compiled.dae
        self.n, self.nz = dae.x.numel(), dae.z.numel()
        residuals = ca.vertsplit(dae.residual) if self.nz else []
        rows = column([*residuals, *(c.expression for c in conditions)])
        jacobian = ca.jacobian(rows, ca.vertcat(dae.x, dae.z))
        self.values = ca.Function(
            "powertrain_initial", [dae.t, dae.x, dae.z, dae.m, dae.p], [ca.densify(rows), jacobian.nz[:]]
        )
        self.rows, self.columns = (np.array(k, int) for k in jacobian.sparsity().get_triplet())
        outputs = ca.vertcat(rows, ca.vec(jacobian.nz[:])) if rows.numel() else rows
        self.modal = bool(dae.m.numel()) and any(ca.which_depends(outputs, dae.m, 1, True))
        self.places = self._guessable()
        self.choices: dict[bytes, tuple[list[int], list[int]]] = {}

    def solve(
        self, engine: Engine, t: float, p: Array, m: Array, given: Array, guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        y = self._guess(guesses)
        target = np.concatenate([np.zeros(self.nz), given, [c.value for c in self.conditions[self.given :]]])
        for _ in range(_ROUNDS):
            chosen, owned = self._newton(t, y, m, p, target)
            if not self.modal:
                break
            x, z, resolved = engine.resolve(t, y[: self.n], y[self.n :], m, p)
            y = np.concatenate([x, z])
            if np.array_equal(resolved, m):
                break
            m = resolved
        else:
            raise InitializationError(
                f"{self._law_names()}: the modes of these laws at the start do not settle; give more of the start"
            )
        return y[: self.n], y[self.n :], m, self._report(t, y, m, p, target, chosen, owned)

    def _law_names(self) -> str:
        dae = self.compiled.dae
        names = [f.name for f in dae.frictions] + [s.name for s in dae.switches] + [c.name for c in dae.contacts]
        return ", ".join(names[:8])

    def _guessable(self) -> dict[str, tuple[int, float, float]]:
        """The signals that are slope * unknown + offset with numbers: name -> (place of the unknown, slope, offset)."""
        dae = self.compiled.dae
        position = {key(s): i for i, s in enumerate([*ca.vertsplit(dae.x), *ca.vertsplit(dae.z)]) if s.numel()}
        found = {}
        for name, signal in self.compiled.signals.items():
            inside = free_symbols(signal.expression)
            if len(inside) != 1 or key(inside[0]) not in position:
                continue
            slope = ca.jacobian(signal.expression, inside[0])
            if slope.is_constant() and float(slope):
                offset = float(ca.substitute(signal.expression, inside[0], 0))
                found[name] = (position[key(inside[0])], float(slope), offset)
        return found

    def _guess(self, guesses: Mapping[str, float]) -> Array:
        y = np.zeros(self.n + self.nz)
        declared = {u.name: u.guess for u in self.compiled.flat.unknowns.values() if u.guess}
        for name, value in {**declared, **guesses}.items():
            if name in self.places:
                place, slope, offset = self.places[name]
                y[place] = (value - offset) / slope
            elif name in guesses:
                raise ParameterError(self._no_guess(name))
        return y

    def _no_guess(self, name: str) -> str:
        if name not in self.compiled.signals:
            return f"guesses: the model has no variable {name}{suggestion(name, self.compiled.signals)}"
        return (
            f"guesses: {name} is computed from others, a guess of it would change nothing; guess one of "
            f"{', '.join(list(self.places)[:12])}, or give it a value with starts"
        )

    def _evaluate(self, t: float, y: Array, m: Array, p: Array) -> tuple[Array, Array]:
        """All rows and the nonzeros of their Jacobian."""
        r, j = self.values(t, y[: self.n], y[self.n :], m, p)
        return np.array(r, float).ravel(), np.array(j, float).ravel()

    def _newton(self, t: float, y: Array, m: Array, p: Array, target: Array) -> tuple[list[int], list[int]]:
        """Solves the chosen conditions for the unknowns they own, in place; what nobody owns keeps its guess."""
        if not len(target) or not len(y):
            return [], []
        r, j = self._evaluate(t, y, m, p)
        chosen, owned, open_rows = self._choose(j)
        if open_rows:
            y[self.n :] += 1e-3 * (1.0 + np.abs(y[self.n :])) * np.linspace(0.7, 1.3, self.nz)
            r, j = self._evaluate(t, y, m, p)
            chosen, owned, open_rows = self._choose(j)
        if open_rows:
            raise InitializationError(self._singular(open_rows))
        for _ in range(_ITERATIONS):
            gap = r[chosen] - target[chosen]
            step = self._step(j, chosen, owned, gap)
            if not np.isfinite(step).all():
                break
            y[owned] += step
            r, j = self._evaluate(t, y, m, p)
            if np.all(np.abs(step) <= 1e-12 * (1.0 + np.abs(y[owned]))):
                return chosen, owned
        raise InitializationError(self._no_solution(r - target, chosen))

    def _step(self, j: Array, chosen: list[int], owned: list[int], gap: Array) -> Array:
        row_place, column_place = np.full(len(self.conditions) + self.nz, -1), np.full(self.n + self.nz, -1)
        row_place[chosen], column_place[owned] = np.arange(len(chosen)), np.arange(len(owned))
        i, k = row_place[self.rows], column_place[self.columns]
        inside = (i >= 0) & (k >= 0)
        size = len(chosen)
        if not np.isfinite(j[inside]).all() or not np.isfinite(gap).all():
            return np.full(size, np.nan)
        if size <= _DENSE:
            matrix = np.zeros((size, size))
            matrix[i[inside], k[inside]] = j[inside]
            try:
                return np.asarray(np.linalg.solve(matrix, -gap), np.float64)
            except np.linalg.LinAlgError:
                return np.asarray(np.linalg.lstsq(matrix, -gap, rcond=None)[0], np.float64)
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        try:
            factors = splu(csc_array((j[inside], (i[inside], k[inside])), shape=(size, size)))
        except RuntimeError:
            return np.full(size, np.nan)
        return np.asarray(factors.solve(-gap), float)

    def _no_solution(self, gap: Array, chosen: list[int]) -> str:
        sizes = [(np.inf if np.isnan(gap[i]) else abs(gap[i]), i) for i in chosen]
        worst = [i for size, i in sorted(sizes, reverse=True)[:4] if size > 1e-9]
        quoted = "\n  ".join(f"{self._label(i)}: left minus right is {gap[i]:.6g}" for i in worst)
        return (
            f"these equations of the start have no solution that Newton's method finds from the guesses; give other guesses or starts"
            f"\n  {quoted}"
        )

    def _singular(self, rows: list[int]) -> str:
        quoted = "\n  ".join(self._label(i) for i in rows[:8])
        return (
            "these equations of the model do not determine its unknowns at the guesses (their slopes vanish or repeat each other); "
            f"give other guesses, or an inertia or a compliance where a motion is loose\n  {quoted}"
        )

    def _label(self, row: int) -> str:
        return self.conditions[row - self.nz].label if row >= self.nz else self.compiled.dae.equation(row)

    def _choose(self, nonzeros: Array) -> tuple[list[int], list[int], list[int]]:
        """(rows, the unknowns they own, implicit rows without an unknown), taken in order; a row that those before determine is left out."""
        known = self.choices.get(nonzeros.tobytes())
        if known is not None:
            return *known, []
        table: list[dict[int, float]] = [{} for _ in range(self.nz + len(self.conditions))]
        for i, k, a in zip(self.rows.tolist(), self.columns.tolist(), nonzeros.tolist(), strict=True):
            if a != 0.0 and np.isfinite(a):
                table[i][k] = a
        chosen: list[int] = []
        open_rows: list[int] = []
        basis: dict[int, tuple[int, dict[int, float]]] = {}
        for i, row in enumerate(table):
            size = max(map(abs, row.values()), default=0.0)
            _reduce(row, basis)
            implicit = i < self.nz
            pivot = max(row, key=lambda k: (abs(row[k]) * (1e3 if implicit and k >= self.n else 1.0), -k), default=None)
            if pivot is None or abs(row[pivot]) <= 1e-9 * size:
                if implicit:
                    open_rows.append(i)
                continue
            chosen.append(i)
            basis[pivot] = (len(basis), row)
        if not open_rows:
            if len(self.choices) >= _KEPT:
                self.choices.clear()
            self.choices[nonzeros.tobytes()] = (chosen, list(basis))
        return chosen, list(basis), open_rows

    def _report(
        self, t: float, y: Array, m: Array, p: Array, target: Array, chosen: list[int], owned: list[int]
    ) -> InitialReport:
        taken = set(chosen)
        left = [i for i in range(self.nz, len(target)) if i not in taken]
        conditions = [self._with_value(i, float(target[i])) for i in range(self.nz, len(target))]
        if left:
            r, _ = self._evaluate(t, y, m, p)
            for i in left:
                self._check_implied(conditions[i - self.nz], i, float(r[i]) - float(target[i]), float(r[i]))
        used = [c for i, c in enumerate(conditions, self.nz) if i in taken]
        rest = [
            Condition(self.compiled.states[k], "not determined otherwise", Symbol(0), float(y[k]))
            for k in sorted(set(range(self.n)) - set(owned))
        ]
        return InitialReport(
            (*used, *rest),
            tuple(conditions[i - self.nz] for i in left),
            dict(zip(self.compiled.states, y, strict=False)),
        )

    def _with_value(self, row: int, value: float) -> Condition:
        c = self.conditions[row - self.nz]
        return Condition(c.label, c.source, c.expression, value, c.unit)

    def _check_implied(self, condition: Condition, row: int, gap: float, reached: float) -> None:
        """A condition that was left out must hold, unless a value given for this run took its place or it is only a declared start."""
        first = row - self.nz < self.given
        replaced = self.given > 0 or condition.source == "start of the variable"
        if abs(gap) <= 1e-9 * (1.0 + abs(reached)) or (replaced and not first):
            return
        asked = f"asks for {condition.value:g} {condition.unit}, but the other conditions already give {reached:g} {condition.unit}"
        if condition.source == "initial()":
            asked = f"cannot hold: the other conditions leave left minus right at {reached:g}"
        raise InitializationError(
            f"inconsistent initial conditions: {condition.label}\n  {asked}; take one of them out"
        )


def _reduce(row: dict[int, float], basis: dict[int, tuple[int, dict[int, float]]]) -> None:
    """Subtracts multiples of the basis rows until ``row`` has no entry at a pivot; ``basis``: pivot -> (age, row), zero at older pivots."""
    pending = [(basis[k][0], k) for k in row if k in basis]
    heapq.heapify(pending)
    while pending:
        _, pivot = heapq.heappop(pending)
        if pivot not in row:
            continue
        other = basis[pivot][1]
        factor = row[pivot] / other[pivot]
        for k, a in other.items():
            old = row.get(k, 0.0)
            new = old - factor * a
            if k == pivot or abs(new) <= 1e-14 * (abs(old) + abs(factor * a)):
                row.pop(k, None)
                continue
            if k not in row and k in basis:
                heapq.heappush(pending, (basis[k][0], k))
            row[k] = new
