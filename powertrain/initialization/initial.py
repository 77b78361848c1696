"""Initialisation: which conditions determine the start, the solution for the states, and a report of the conditions used.

Conditions in order of priority: values given for this run, the equations of ``initial()``, declared ``start`` values, and zero for the
remaining states. A condition that follows from earlier ones is not needed; it must agree with them unless a value of the run replaces
it. Guesses only say where the search begins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae, OperatingPoint
from powertrain.dae.tolerances import MISSED, ROUND_OFF, STARTED
from powertrain.engine.simulator import Simulator
from powertrain.errors import InitializationError, ParameterError, suggestion
from powertrain.initialization.choice import Choice, StartJacobian, independent
from powertrain.initialization.conditions import (
    DECLARED,
    Discretes,
    StartEquation,
    declared_conditions,
    signal_condition,
    unsettled,
)
from powertrain.initialization.outdated import outdated
from powertrain.initialization.report import InitialReport
from powertrain.initialization.resolution import coarse_time
from powertrain.initialization.uniqueness import is_default, not_unique
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars
from powertrain.language.units import with_unit
from powertrain.modes.complementarity import Laws
from powertrain.modes.tied import tied_notes
from powertrain.numerics.buffers import Bound, zeros
from powertrain.numerics.newton import HALVINGS, newton

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
        return plan.solve(engine, t, p, m, given, guesses)


def _residuals_to_solve(dae: HybridDae, conditions: list[Symbol]) -> list[Symbol]:
    """The algebraic equations, unless they depend on modes and no condition needs their unknowns; then both are solved together later."""
    if not dae.z.numel():
        return []
    needed = bool(conditions) and any(ca.which_depends(column(conditions), dae.z, 1, True))
    modal = bool(dae.m.numel()) and any(ca.which_depends(dae.residual, dae.m, 1, True))
    return scalars(dae.residual) if needed or not modal else []


class _Plan:
    """The conditions for one set of given names, made independent at the point of solution, by Newton's method."""

    def __init__(self, compiled: Compiled, names: Sequence[str], declared: Sequence[StartEquation]) -> None:
        self.compiled, self.held = compiled, frozenset(names).intersection(compiled.discretes)
        self.discretes = Discretes(compiled, self.held)
        values = [signal_condition(compiled, n, 0.0, "given for this run") for n in names if n not in self.held]
        self.conditions = conditions = [*values, *self.discretes.others, *declared]
        given = len(values)
        dae = compiled.dae
        self.n, self.size = dae.x.numel(), dae.x.numel() + dae.z.numel()
        residuals = _residuals_to_solve(dae, [c.expression for c in conditions])
        self.nz = len(residuals)
        rows = column([*residuals, *(c.expression for c in conditions)])
        jacobian = ca.jacobian(rows, ca.vertcat(dae.x, dae.z))
        inputs = [dae.t, ca.vertcat(dae.x, dae.z), dae.m, dae.p]
        self.function = function = ca.Function(
            "powertrain_initial", inputs, [ca.densify(rows), ca.densify(jacobian.nz[:])]
        )
        self.arguments = [zeros(function.nnz_in(i)) for i in range(4)]
        self.results = [zeros(function.nnz_out(i)) for i in range(2)]
        self.values = Bound(function, self.arguments, self.results)
        self.rows, self.columns = (np.array(k, int) for k in jacobian.sparsity().get_triplet())
        self.single = np.flatnonzero((self.rows >= self.nz) & (np.bincount(self.rows)[self.rows] == 1))
        outputs = ca.vertcat(rows, ca.vec(jacobian.nz[:])) if rows.numel() else rows
        self.linear = not self.nz and not ca.depends_on(jacobian.nz[:], ca.vertcat(dae.x, dae.z))
        self.modal = bool(dae.m.numel()) and any(ca.which_depends(outputs, dae.m, 1, True))
        self.position = {key(s): i for i, s in enumerate([*scalars(dae.x), *scalars(dae.z)])}
        guesses = {u.name: u.guess for u in compiled.variables.values() if u.guess}
        self.guess = self._guess(guesses, np.zeros(self.size))
        places = [None if self.linear else self._place(c.label) for c in conditions]
        self.known = [place for place in places[:given] if place is not None]
        self.plain = np.array([place is not None for place in places[:given]], bool)
        self.declared = np.array([c.value for c in conditions[given:]])
        for found, value in zip(places[given:], self.declared.tolist(), strict=True):
            if found is not None:
                place, slope, offset = found
                self.guess[place] = (value - offset) / slope
        self.implied = np.array(
            [i < given or not (given or c.source == DECLARED) for i, c in enumerate(conditions)], bool
        )
        self.defaults = np.array([is_default(c) for c in conditions], bool)
        self.jacobian = StartJacobian(self.rows, self.columns, self.nz, len(conditions), self.n, self.size)
        self.choices: dict[bytes, Choice] = {}

    def solve(
        self, engine: Simulator, t: float, p: Array, m: Array, given: Array, guesses: Mapping[str, float]
    ) -> tuple[Array, Array, Array, InitialReport]:
        y = self._guess(guesses, self.guess.copy(), asked=True) if guesses else self.guess.copy()
        target = np.concatenate([np.zeros(self.nz), given, self.declared])
        for (place, slope, offset), value in zip(self.known, given[self.plain].tolist(), strict=True):
            y[place] = (value - offset) / slope  # from another start Newton's method may not converge
        discretes = self.discretes.set(t, y, m, p)
        self._solve_single(t, y, m, p, target)
        for _ in range(_ROUNDS):
            assumed = m.copy()
            choice = self._newton(t, y, m, p, target)
            discretes = self.discretes.set(t, y, m, p, discretes)
            if not self.modal:
                break
            x, z, m = engine.resolve(t, y[: self.n], y[self.n :], m, p)
            y = np.concatenate([x, z])
            if np.array_equal(m, assumed):
                break
        else:
            raise InitializationError(unsettled(self.compiled, self.conditions))
        return y[: self.n], y[self.n :], m, self._report(t, y, m, p, target, choice)

    @cached_property
    def places(self) -> dict[str, tuple[int, float, float]]:
        """The signals of the form slope * unknown + offset with numbers: name -> (index of the unknown, slope, offset)."""
        found = {name: self._place(name) for name in self.compiled.signals}
        return {name: place for name, place in found.items() if place is not None}

    def _place(self, name: str) -> tuple[int, float, float] | None:
        signal = self.compiled.signals.get(name)
        inside = free_symbols(signal.expression) if signal else []
        if signal is None or len(inside) != 1 or key(inside[0]) not in self.position:
            return None
        slope = ca.jacobian(signal.expression, inside[0])
        if not slope.is_constant() or not float(slope):
            return None
        offset = float(ca.substitute(signal.expression, inside[0], 0))
        return self.position[key(inside[0])], float(slope), offset

    def _guess(self, guesses: Mapping[str, float], y: Array, asked: bool = False) -> Array:
        for name, value in guesses.items():
            found = self._place(name)
            if found is not None:
                place, slope, offset = found
                y[place] = (value - offset) / slope
            elif asked:
                raise ParameterError(self._no_guess(name))
        return y

    def _no_guess(self, name: str) -> str:
        if name not in self.compiled.signals:
            return f"guesses: the model has no variable {name}{suggestion(name, self.compiled.signals)}"
        return (
            f"guesses: {name} is computed from others, a guess of it would change nothing; guess one of "
            f"{', '.join(list(self.places)[:12])}, or give it a value with starts"
        )

    def _solve_single(self, t: float, y: Array, m: Array, p: Array, target: Array) -> None:
        """A Newton step of every condition with a single unknown: at the guess of that unknown other equations may not be defined."""
        r, j = self._evaluate(t, y, m, p)
        guess = y.copy()
        for k in self.single[::-1].tolist():  # the first condition prevails
            i, place = self.rows[k], self.columns[k]
            value = guess[place] - (r[i] - target[i]) / j[k] if j[k] else np.nan
            if np.isfinite(value):
                y[place] = value

    def _evaluate(self, t: float, y: Array, m: Array, p: Array) -> tuple[Array, Array]:
        """All rows and the nonzeros of their Jacobian, valid until the next call."""
        self.arguments[0][0] = t
        for array, value in zip(self.arguments[1:], (y, m, p), strict=True):
            array[: value.size] = value
        self.values.call()
        return self.results[0], self.results[1]

    def _newton(self, t: float, y: Array, m: Array, p: Array, target: Array) -> Choice:
        """Solve the chosen conditions for the unknowns they own, in place; other unknowns keep their guesses."""
        if not len(target) or not len(y):
            return Choice(self.jacobian, [], [])
        choice, open_rows = self._choose(self._evaluate(t, y, m, p)[1])
        if open_rows or choice.displaces:
            y[self.n :] += 1e-3 * (1.0 + np.abs(y[self.n :])) * np.linspace(0.7, 1.3, self.nz)
            choice, open_rows = self._choose(self._evaluate(t, y, m, p)[1])
        if open_rows:
            raise InitializationError(self._singular(open_rows))
        chosen, owned = choice.chosen, choice.owned

        def equations(_: NDArray[np.intp], trial: Array) -> tuple[Array, Array]:
            y[owned] = trial[0]
            r, j = self._evaluate(t, y, m, p)
            return j[None], (r - target)[None, chosen]

        found, fine = newton(
            equations,
            y[None, owned],
            still=STARTED,
            most=_ITERATIONS,
            halvings=0 if self.linear else HALVINGS,
            factors=choice.factors,
        )
        y[owned] = found[0]
        if not fine[0]:
            r, j = self._evaluate(t, y, m, p)
            if not self._round_off(r - target, j, y)[chosen].all():
                raise InitializationError(self._no_solution(r - target, chosen.tolist()))
        return choice

    def _round_off(self, gap: Array, nonzeros: Array, y: Array) -> NDArray[np.bool_]:
        """Which rows are zero within the round-off of their terms; stiff equations cannot do better."""
        with np.errstate(invalid="ignore"):
            terms = np.bincount(self.rows, np.abs(nonzeros * y[self.columns]), len(gap))
        return np.asarray(np.abs(gap) <= ROUND_OFF * terms)

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
        choice, open_rows = independent(self.jacobian, nonzeros)
        if not open_rows:
            if len(self.choices) >= _KEPT:
                self.choices.clear()
            self.choices[nonzeros.tobytes()] = choice
        return choice, open_rows

    def _report(self, t: float, y: Array, m: Array, p: Array, target: Array, choice: Choice) -> InitialReport:
        values = target[self.nz :]
        left = choice.left[self.implied[choice.left]]
        if len(left):
            reached = self._evaluate(t, y, m, p)[0][self.nz :]
            for i in left[~(np.abs(reached - values)[left] <= MISSED * (1.0 + np.abs(reached[left])))].tolist():
                self._refuse(self.conditions[i], float(values[i]), float(reached[i]))
        notes = partial(self._notes, t, y.copy(), m.copy(), p.copy(), choice)
        return InitialReport(
            self.conditions, values, choice.taken, self.compiled.states, y, choice.open_states, self.held, notes
        )

    def _notes(self, t: float, y: Array, m: Array, p: Array, choice: Choice) -> tuple[str, ...]:
        """What is not unique in the start, speeds and torques at rest; values that tables of the model do not have; a late start."""
        opened, point = self.compiled.dae.opened, OperatingPoint(t, y[: self.n], y[self.n :], m, p)
        tied = () if opened is None else tied_notes(self._laws, point)
        return (
            *self._unasked(t, y, m, p, choice),
            *tied,
            *outdated(self.compiled, dict(zip(self.compiled.parameters, p.tolist(), strict=True))),
            *coarse_time(self.compiled.dae, t),
        )

    @cached_property
    def _laws(self) -> Laws:
        return Laws(self.compiled.dae)

    def _unasked(self, t: float, y: Array, m: Array, p: Array, choice: Choice) -> tuple[str, ...]:
        """A note on variables that do not start at zero only because others do."""
        left = choice.left[self.defaults[choice.left]]
        reached, nonzeros = (np.array(found).ravel() for found in self.function(t, y, m, p))
        missed = left[np.abs(reached[self.nz + left]) > MISSED]
        kept = np.flatnonzero(np.isin(choice.chosen - self.nz, np.flatnonzero(self.defaults)))
        if not len(missed) or not len(kept):
            return ()
        solve, jacobian = choice.factors(nonzeros[None]), self._rows_of(self.nz + missed, nonzeros)

        def changes(starts: Array) -> tuple[Array, Array]:
            right, moved = np.zeros((1, len(choice.owned), starts.shape[1])), np.zeros((self.size, starts.shape[1]))
            right[0, kept] = starts
            moved[choice.owned] = solve(right)[0]
            return jacobian(moved), np.array(self._rates(t, y, m, p) @ moved)

        conditions = [self.conditions[i - self.nz] for i in choice.chosen[kept]]
        values = reached[self.nz + missed].tolist()
        note = not_unique([self.conditions[i] for i in missed], values, conditions, changes)
        return (note,) if note else ()

    def _rows_of(self, rows: NDArray[np.intp], nonzeros: Array) -> Callable[[Array], Array]:
        """Some rows of the Jacobian, as the product with a matrix."""
        place = np.full(self.nz + len(self.conditions), -1)
        place[rows] = np.arange(len(rows))
        inside = np.flatnonzero(place[self.rows] >= 0)
        i, k, entries = place[self.rows[inside]], self.columns[inside], nonzeros[inside, None]

        def product(matrix: Array) -> Array:
            found = np.zeros((len(rows), matrix.shape[1]))
            np.add.at(found, i, entries * matrix[k])
            return found

        return product

    @cached_property
    def _rates(self) -> ca.Function:
        """The slopes of the rates: (t, y, m, p) -> matrix."""
        dae = self.compiled.dae
        y = ca.vertcat(dae.x, dae.z)
        return ca.Function("powertrain_start_rates", [dae.t, y, dae.m, dae.p], [ca.jacobian(dae.xdot, y)])

    def _refuse(self, condition: StartEquation, value: float, reached: float) -> None:
        """An omitted condition must hold, unless a value given for this run replaced it or it is only a declared start."""
        wanted, given = (with_unit(f"{number:g}", condition.unit) for number in (value, reached))
        asked = f"asks for {wanted}, but the other conditions already give {given}"
        if condition.source == "initial()":
            asked = f"cannot hold: the other conditions leave left minus right at {reached:g}"
        raise InitializationError(f"inconsistent initial conditions: {condition.label}\n  {asked}; remove one of them")
