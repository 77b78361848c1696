"""Initialisation: which conditions determine the start, the solution for the states, and a report of the conditions used.

Conditions in order of priority: values given for this run, the equations of ``initial()``, declared ``start`` values, and zero for the
remaining states. A condition that follows from earlier ones is not needed; it must agree with them unless a value of the run replaces
it. Guesses only say where the search begins.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import OperatingPoint
from powertrain.dae.tolerances import MISSED, STARTED
from powertrain.engine.simulator import Simulator
from powertrain.errors import InitializationError
from powertrain.initialization.choice import Choice, independent
from powertrain.initialization.conditions import (
    DECLARED,
    Discretes,
    StartEquation,
    declared_conditions,
    signal_condition,
    unsettled,
)
from powertrain.initialization.guesses import Guesses
from powertrain.initialization.notes import StartNotes
from powertrain.initialization.report import InitialReport
from powertrain.initialization.start_rows import StartRows
from powertrain.language.reals import Array
from powertrain.language.units import with_unit
from powertrain.modes.guards import first_violation
from powertrain.numerics.newton import newton

_ROUNDS = 20
_ITERATIONS = 60
_KEPT = 16


class Initializer:
    """Solves the initial conditions of one compiled model; keeps what it built for each set of given names. Serves one thread."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled
        self._declared = declared_conditions(compiled)
        self._plans: dict[tuple[str, ...], _Plan] = {}

    def solve(
        self, engine: Simulator, t: float, p: Array, m: Array, starts: Mapping[str, float], guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        """States, algebraic unknowns, held values and the report. Raises InitializationError if the conditions cannot be satisfied."""
        places, names = self.compiled.discretes, tuple(starts)
        if names not in self._plans:
            self._plans[names] = _Plan(self.compiled, names, self._declared)
        plan = self._plans[names]
        for name in plan.held:
            m[places[name]] = starts[name]
        given = np.array([float(starts[name]) for name in names if name not in plan.held])
        x, z, m, report = plan.solve(engine, t, p, m, given, guesses)
        if message := first_violation(self.compiled.dae, (t, x, z, m, p), "start"):
            raise InitializationError(message)
        return x, z, m, report


class _Plan:
    """The conditions for one set of given names, made independent at the point of solution, by Newton's method."""

    def __init__(self, compiled: Compiled, names: Sequence[str], declared: Sequence[StartEquation]) -> None:
        self.compiled, self.held = compiled, frozenset(names).intersection(compiled.discretes)
        self.discretes = Discretes(compiled, self.held)
        values = [signal_condition(compiled, n, 0.0, "given for this run") for n in names if n not in self.held]
        self.conditions = conditions = [*values, *self.discretes.others, *declared]
        given, dae = len(values), compiled.dae
        self.rows, self.guesses = StartRows(dae, conditions), Guesses(compiled)
        self.n, self.nz = dae.x.numel(), self.rows.implicit
        self.guess = np.zeros(self.rows.jacobian.unknowns)
        self.guesses.put({u.name: u.guess for u in compiled.variables.values() if u.guess}, self.guess)
        self.declared = np.array([c.value for c in conditions[given:]])
        self.implied = np.array(
            [i < given or not (given or c.source == DECLARED) for i, c in enumerate(conditions)], bool
        )
        self.notes = StartNotes(compiled, self.rows, conditions)
        self.choices: dict[bytes, Choice] = {}

    def solve(
        self, engine: Simulator, t: float, p: Array, m: Array, given: Array, guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        y = self.guess.copy()
        self.guesses.check(guesses)
        self.guesses.put(guesses, y)
        target = np.concatenate([np.zeros(self.nz), given, self.declared])
        self.discretes.set(t, y, m, p)
        if not self.rows.linear or self.discretes.given:
            self.rows.solve_single(t, y, m, p, target)
        discretes = self.discretes.set(t, y, m, p)
        for _ in range(_ROUNDS):
            assumed = m.copy()
            choice = self._newton(t, y, m, p, target)
            discretes = self.discretes.set(t, y, m, p, discretes)
            if not self.rows.modal:
                break
            x, z, m = engine.resolve(t, y[: self.n], y[self.n :], m, p)
            y = np.concatenate([x, z])
            if np.array_equal(m, assumed):
                break
        else:
            raise InitializationError(unsettled(self.compiled, self.conditions))
        return y[: self.n], y[self.n :], m, self._report(t, y, m, p, target, choice)

    def _newton(self, t: float, y: Array, m: Array, p: Array, target: Array) -> Choice:
        """Solve the chosen conditions for the unknowns they own, in place; other unknowns keep their guesses."""
        if not len(target) or not len(y):
            return Choice(self.rows.jacobian, [], [])
        r, j = self.rows.at(t, y, m, p)
        choice, open_rows = self._choose(j)
        if open_rows or choice.displaces:
            y[self.n :] += 1e-3 * (1.0 + np.abs(y[self.n :])) * np.linspace(0.7, 1.3, self.nz)
            choice, open_rows = self._choose(self.rows.at(t, y, m, p)[1])
        if open_rows:
            raise InitializationError(self._singular(open_rows))
        chosen, owned = choice.chosen, choice.owned
        if self.rows.linear:
            for _ in range(2):  # the second step takes away the round-off of the first
                y[owned] += choice.factors(j[None])((target - r)[None, chosen])[0]
                r, j = self.rows.at(t, y, m, p)
            if self.rows.are_round_off(r - target, j, y)[
                chosen
            ].all():  # not where a condition has steps between constant values
                return choice
        if not self._iterate(t, y, m, p, target, choice):
            r, j = self.rows.at(t, y, m, p)
            if not self.rows.are_round_off(r - target, j, y)[chosen].all():
                raise InitializationError(self._no_solution(r - target, chosen.tolist()))
        return choice

    def _iterate(self, t: float, y: Array, m: Array, p: Array, target: Array, choice: Choice) -> bool:
        """Newton's method for the chosen conditions, in place; whether it converged."""

        def equations(_: NDArray[np.intp], trial: Array) -> tuple[Array, Array]:
            y[choice.owned] = trial[0]
            r, j = self.rows.at(t, y, m, p)
            return j[None], (r - target)[None, choice.chosen]

        first = y[None, choice.owned]
        found, fine = newton(equations, first, still=STARTED, most=_ITERATIONS, factors=choice.factors)
        y[choice.owned] = found[0]
        return bool(fine[0])

    def _no_solution(self, gap: Array, chosen: list[int]) -> str:
        sizes = [(np.inf if np.isnan(gap[i]) else abs(gap[i]), i) for i in chosen]
        worst = [i for size, i in sorted(sizes, reverse=True)[:4] if size > MISSED]
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

    def _choose(self, nonzeros: Array) -> tuple[Choice, list[int]]:
        """As ``independent``; choices are kept."""
        known = self.choices.get(nonzeros.tobytes())
        if known is not None:
            return known, []
        choice, open_rows = independent(self.rows.jacobian, nonzeros)
        if not open_rows:
            if len(self.choices) >= _KEPT:
                self.choices.clear()
            self.choices[nonzeros.tobytes()] = choice
        return choice, open_rows

    def _report(self, t: float, y: Array, m: Array, p: Array, target: Array, choice: Choice) -> InitialReport:
        values = target[self.nz :]
        left = choice.left[self.implied[choice.left]]
        if len(left):
            reached = self.rows.at(t, y, m, p)[0][self.nz :]
            for i in left[~(np.abs(reached - values)[left] <= MISSED * (1.0 + np.abs(reached[left])))].tolist():
                self._refuse(self.conditions[i], float(values[i]), float(reached[i]))
        point = OperatingPoint(t, y[: self.n].copy(), y[self.n :].copy(), m.copy(), p.copy())
        notes = partial(self.notes.at, point, choice)
        return InitialReport(self.conditions, values, choice, self.compiled.states, y, self.held, notes)

    def _refuse(self, condition: StartEquation, value: float, reached: float) -> None:
        """An omitted condition must hold, unless a value given for this run replaced it or it is only a declared start."""
        wanted, given = (with_unit(f"{number:g}", condition.unit) for number in (value, reached))
        asked = f"asks for {wanted}, but the other conditions already give {given}"
        if condition.source == "initial()":
            asked = f"cannot hold: the other conditions leave left minus right at {reached:g}"
        raise InitializationError(f"inconsistent initial conditions: {condition.label}\n  {asked}; remove one of them")
