"""An objective at one run: an integrand, and readings of signals at instants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from powertrain.analysis.quadrature import Pieces
from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column
from powertrain.result import Result
from powertrain.signals import Picked, signals_of
from powertrain.variational.objectives import Objective, Reading, Term, weights_of

_INSIDE = 9
"""Samples per step for bracketing an extremum."""
_ROUNDS = 8


@dataclass(frozen=True)
class Functional:
    """The integrand (or None), the expressions that are read, their readings, and the value without the integral.

    ``pieces``: instants between which the integrand is as smooth as its quadrature needs.
    """

    label: str
    unit: str
    integrand: Symbol | None
    expressions: Symbol
    readings: tuple[Reading, ...]
    value: float
    key: tuple[object, ...] = ()
    pieces: tuple[float, ...] = ()

    @property
    def cuts(self) -> Array:
        """The times of the readings between events and of the pieces, in s."""
        return np.array(sorted({*(r.time for r in self.readings if r.instant < 0), *self.pieces}), float)


def functional(result: Result[Any], objective: Objective) -> Functional:
    """The objective at a run."""
    signals = signals_of(result.compiled)
    picked = [signals.pick(term.signal) for term in objective.terms]
    integrand: Symbol | None = None
    value, readings, labels, units = 0.0, [], [], set()
    for k, (term, p) in enumerate(zip(objective.terms, picked, strict=True)):
        labels.append(_label(term, p.label))
        units.add({"integral": p.unit and f"{p.unit}.s", "squares": "1"}.get(term.kind, p.unit))
        if term.kind == "integral":
            integrand = term.factor * p.expression + (0 if integrand is None else integrand)
            continue
        if term.kind in ("maximum", "minimum"):
            worth, found = _extremum(result, p, k, term)
        else:
            worth, found = _read(result, p, k, term)
        value += worth
        readings += found
    label = " + ".join(labels)
    key = tuple(
        (signals.identity(p), term.kind == "integral" and term.factor)
        for term, p in zip(objective.terms, picked, strict=True)
    )
    unit = units.pop() if len(units) == 1 else ""
    expressions, pieces = column([p.expression for p in picked]), _pieces(result, integrand)
    return Functional(label, unit, integrand, expressions, tuple(readings), value, key, pieces)


def _pieces(result: Result[Any], integrand: Symbol | None) -> tuple[float, ...]:
    """The beginnings of pieces of the run, halved until they resolve the integrand: what depends on time alone sets no step size."""
    if integrand is None:
        return ()
    trajectory, signals, whole, found = result.trajectory, signals_of(result.compiled), 0.0, list[float]()
    pieces = Pieces.of(trajectory)
    while len(pieces.first):
        values = signals.evaluate([integrand], pieces.samples(trajectory), result.p)[:, 0]
        whole = max(whole, float(pieces.weights @ np.abs(values)))
        rough = pieces.rough(values, whole)
        # The steps have four nodes; the rule that tells rough pieces has five.
        found += (pieces.halves(~rough).first if pieces.halvings else pieces.first[~rough]).tolist()
        pieces = pieces.halves(rough)
    return tuple(found)


def _label(term: Term, signal: str) -> str:
    factor = "" if term.factor == 1.0 else f"{term.factor:g} "
    if term.kind == "at":
        return f"{factor}{signal}" + (f" at {term.times[0]:g} s" if term.times else " at the end")
    return f"{factor}{term.kind} of {signal}"


def _values(result: Result[Any], picked: Picked, samples: Samples) -> Array:
    return signals_of(result.compiled).values(picked, samples, result.p)


def _read(result: Result[Any], picked: Picked, k: int, term: Term) -> tuple[float, list[Reading]]:
    times = result.trajectory.within("of: t = ", np.array(term.times or (result.trajectory.end,), float))
    value, weights, bend = weights_of(term, _values(result, picked, result.samples_at(times)))
    return value, [Reading(t, k, w, bend=bend) for t, w in zip(times.tolist(), weights.tolist(), strict=True)]


def _extremum(result: Result[Any], picked: Picked, k: int, term: Term) -> tuple[float, list[Reading]]:
    """The largest or smallest value of a signal: at an event, or refined between neighbouring samples."""
    trajectory, sign = result.trajectory, 1.0 if term.kind == "maximum" else -1.0
    instants = [i for i in trajectory.instants if i.time > trajectory.start]
    marks = np.unique([*trajectory.times, *(i.time for i in instants), trajectory.end])
    inside = marks[:-1, None] + np.diff(marks)[:, None] * np.linspace(0.0, 1.0, _INSIDE, endpoint=False)
    times = np.append(inside.ravel(), trajectory.end)
    best, where = -np.inf, Reading(trajectory.end, k, term.factor)
    if instants:
        limits = trajectory.limits(instants)
        t, corrected = limits.t, signals_of(result.compiled).corrected(limits, result.p)
        values = sign * _values(result, picked, corrected)
        j = int(values.argmax())
        best, where = float(values[j]), Reading(float(t[j]), k, term.factor, j // 2, 1 if j % 2 else -1)
        times = times[~np.isin(times, t)]
    low, high = trajectory.start, trajectory.end
    for _ in range(_ROUNDS):
        values = sign * _values(result, picked, result.samples_at(times))
        j = int(values.argmax())
        if not values[j] <= best + (1e-12 * (1.0 + abs(best)) if best > -np.inf else 0.0):
            turning = trajectory.start < times[j] < trajectory.end
            best, where = float(values[j]), Reading(float(times[j]), k, term.factor, turning=turning)
        elif where.instant >= 0:
            break
        low, high = times[max(j - 1, 0)], times[min(j + 1, len(times) - 1)]
        times = np.linspace(low, high, 33)
    return term.factor * sign * best, [where]
