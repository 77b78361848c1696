"""Initialisation: which conditions fix the start, the solution for the states, and a report of what was used.

Conditions in the order of their right: values given for this run, the equations of ``initial()``, declared ``start`` values, and zero
for the states that are left. A condition that follows from those before it is not needed; it must agree with them unless a value
of the run replaces it. Guesses only say where the search begins.
"""

from __future__ import annotations

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
    """The conditions for one set of given names, made independent once, then solved by Newton's method."""

    def __init__(self, compiled: Compiled, conditions: list[Condition], given: int) -> None:
        self.compiled, self.conditions, self.given = compiled, conditions, given
        dae = compiled.dae
        self.n, self.nz = dae.x.numel(), dae.z.numel()
        rows = column(
            [*ca.vertsplit(dae.residual), *(c.expression for c in conditions)]
            if self.nz
            else [c.expression for c in conditions]
        )
        unknowns = ca.vertcat(dae.x, dae.z)
        jacobian = ca.jacobian(rows, unknowns)
        inputs = [dae.t, dae.x, dae.z, dae.m, dae.p]
        self.values = ca.Function("powertrain_initial", inputs, [rows, ca.densify(jacobian)])
        self.modal = (
            any(ca.which_depends(ca.vertcat(rows, ca.vec(jacobian)), dae.m, 1, True))
            if dae.m.numel() and rows.numel()
            else False
        )
        self.chosen: list[int] = []
        self.owned: list[int] = []
        self.known: set[int] | None = None

    def solve(
        self, engine: Engine, t: float, p: Array, m: Array, given: Array, guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        y = self._guess(guesses)
        target = np.concatenate([np.zeros(self.nz), given, [c.value for c in self.conditions[self.given :]]])
        for _ in range(_ROUNDS):
            self._newton(t, y, m, p, target)
            if not self.modal:
                break
            x, z, resolved = engine.resolve(t, y[: self.n], y[self.n :], m, p)
            y = np.concatenate([x, z])
            if np.array_equal(resolved, m):
                break
            m = resolved
        else:
            raise InitializationError("the modes of the laws at the start do not settle; give more of the start")
        return y[: self.n], y[self.n :], m, self._report(t, y, m, p, target)

    def _guess(self, guesses: Mapping[str, float]) -> Array:
        y = np.zeros(self.n + self.nz)
        flat, states = self.compiled.flat, self.compiled.states
        named = {u.name: u.guess for u in flat.unknowns.values() if u.guess}
        for name, value in {**named, **guesses}.items():
            if name in states:
                y[states.index(name)] = value
            elif name in guesses and name not in self.compiled.signals:
                raise ParameterError(
                    f"guesses: the model has no variable {name}{suggestion(name, self.compiled.signals)}"
                )
        return y

    def _evaluate(self, t: float, y: Array, m: Array, p: Array) -> tuple[Array, NDArray[np.float64]]:
        r, j = self.values(t, y[: self.n], y[self.n :], m, p)
        return np.array(r, float).ravel(), np.array(j, float)

    def _newton(self, t: float, y: Array, m: Array, p: Array, target: Array) -> None:
        """Solves the chosen conditions for the unknowns they own; what nobody owns keeps its guess."""
        if not len(target) or not len(y):
            return
        for _ in range(50):
            r, j = self._evaluate(t, y, m, p)
            r = r - target
            if not self.chosen:
                self._choose(j)
            step = np.linalg.solve(j[np.ix_(self.chosen, self.owned)], -r[self.chosen])
            if not np.isfinite(step).all():
                break
            y[self.owned] += step
            if np.all(np.abs(step) <= 1e-12 * (1.0 + np.abs(y[self.owned]))):
                return
        worst = int(np.argmax(np.abs(r[self.chosen])))
        label = self._label(self.chosen[worst])
        raise InitializationError(
            f"the initial conditions have no solution that Newton's method finds from the guesses; the worst is\n  {label}"
        )

    def _label(self, row: int) -> str:
        return self.conditions[row - self.nz].label if row >= self.nz else "an implicit equation of the model"

    def _choose(self, jacobian: NDArray[np.float64]) -> None:
        """Takes the rows in order; each owns one unknown; a row that those before it already determine is left out."""
        free = np.ones(self.n + self.nz, bool)
        basis: list[tuple[int, NDArray[np.float64]]] = []
        for i, full in enumerate(jacobian):
            row = full.copy()
            size = np.abs(row).max(initial=0.0)
            for pivot, other in basis:
                if row[pivot]:
                    row -= row[pivot] / other[pivot] * other
            weight = np.abs(row) * free
            if i < self.nz:
                weight[self.n :] *= 1e3
            pivot = int(np.argmax(weight))
            if weight[pivot] <= 1e-9 * max(size, 1e-300):
                if i < self.nz:
                    raise InitializationError(
                        "the implicit equations of the model are singular at the guesses; give other guesses"
                    )
                continue
            free[pivot] = False
            basis.append((pivot, row))
            self.chosen.append(i)
        self.owned = [pivot for pivot, _ in basis]

    def _report(self, t: float, y: Array, m: Array, p: Array, target: Array) -> InitialReport:
        chosen = set(self.chosen)
        left = [i for i in range(self.nz, len(target)) if i not in chosen]
        conditions = [self._with_value(i, float(target[i])) for i in range(self.nz, len(target))]
        if left:
            r, _ = self._evaluate(t, y, m, p)
            for i in left:
                self._check_implied(conditions[i - self.nz], i, float(r[i]) - float(target[i]), float(r[i]))
        used = [c for i, c in enumerate(conditions, self.nz) if i in chosen]
        rest = [
            Condition(self.compiled.states[k], "not determined otherwise", Symbol(0), float(y[k]))
            for k in range(self.n)
            if k not in self.owned
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
        raise InitializationError(
            f"inconsistent initial conditions: {condition.label}\n  asks for {condition.value:g} {condition.unit}, but the other conditions "
            f"already give {reached:g} {condition.unit}; take one of them out"
        )
