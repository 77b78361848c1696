"""Derivatives of the start with respect to parameters and initial values, from the start conditions.

    c(t, s, z, p) = value,   0 = g(t, s, z, p),   d = d(t, p)   =>   c_x X + c_d D + c_p P = V

States that no condition affects keep their values. Second derivatives follow by differentiating once more,

    c_x X2 + c_d D2 + c''[V, V] = 0   for the tangents V = (X, D, P).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.initialization.conditions import Discretes
from powertrain.language.reals import Array
from powertrain.language.symbols import column
from powertrain.result import Result
from powertrain.variational.curvature import Curvature, Tangents
from powertrain.variational.instants import NotDifferentiable
from powertrain.variational.partials import Block, Partials, System
from powertrain.variational.record import Record
from powertrain.variational.unknowns import Unknowns


class Start:
    """The conditions of a start and their derivatives, built once. Serves one thread."""

    def __init__(self, result: Result[Any], system: System) -> None:
        if not hasattr(result.report, "solved"):
            raise ParameterError("the result was pickled and has lost its initial equations; simulate again")
        self.system, self.labels = system, tuple(a.label for a in result.report.solved)
        self.solved = column([a.expression for a in result.report.solved])
        self.conditions = Partials(system, self.solved)
        self._discretes: dict[frozenset[str], tuple[Discretes, Partials]] = {}

    @cached_property
    def curvature(self) -> Curvature:
        """The curvature of the conditions."""
        return Curvature(self.system, self.solved)

    def discretes(self, result: Result[Any], wanted: Unknowns) -> tuple[Discretes, Partials]:
        """The discrete variables that ``initial()`` determines where others are given for the run or varied, and their derivatives."""
        held = result.report.given.union(wanted.starts).intersection(self.system.compiled.discretes)
        if held not in self._discretes:
            found = Discretes(self.system.compiled, held)
            self._discretes[held] = found, Partials(self.system, found.values)
        return self._discretes[held]

    def derivatives(self, result: Result[Any], run: Record, wanted: Unknowns) -> NDArray[np.float64]:
        """ds/d(unknowns) at the start of a run."""
        _refuse_jump(result, run)
        n, chain = self.system.states, wanted.chain(np.array([run.start]), after=True)[0]
        found = np.zeros((self.system.size, len(wanted.names)))
        held, places = self.system.discretes, self.system.compiled.discretes
        for j, name in enumerate(wanted.starts, len(wanted.parameters)):
            if name in places:
                found[n + held.index(places[name]), j] = 1.0
        discretes, partials = self.discretes(result, wanted)
        if discretes.given:
            slopes = partials(run.first, run.p)
            found[[n + held.index(place) for place in discretes.given]] = slopes.q[0] @ chain + slopes.s[0] @ found
        if n:
            found[:n] = self._states(result, run, wanted, chain, found[n:])
        return found

    def _states(
        self, result: Result[Any], run: Record, wanted: Unknowns, chain: Block, discretes: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        n, slopes, still = self.system.states, self.conditions(run.first, run.p), result.report.open
        kept = np.eye(n)[np.array(still, np.int64)]
        right = np.zeros((len(self.labels) + len(still), len(wanted.names)))
        right[: len(self.labels)] = -slopes.q[0] @ chain - slopes.s[0, :, n:] @ discretes
        labels = [*self.labels, *(self.system.dae.state_names[k] for k in still)]
        for j, name in enumerate(wanted.starts, len(wanted.parameters)):
            if name in labels:
                right[labels.index(name), j] += 1.0
        matrix = np.vstack([slopes.s[0, :, :n], kept])
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0], np.float64)

    def hessian(self, result: Result[Any], run: Record, wanted: Unknowns, weights: Array, along: Tangents) -> Block:
        """The second derivatives of the weighted states s at the start."""
        n, held, slopes = self.system.states, self.system.discretes, self.conditions(run.first, run.p)
        matrix = np.vstack([slopes.s[0, :, :n], np.eye(n)[np.array(result.report.open, np.int64)]])
        on_conditions = (weights[:n] @ np.linalg.pinv(matrix))[: len(self.labels)]
        on_discretes = weights[n:] - on_conditions @ slopes.s[0, :, n:]
        discretes = self.discretes(result, wanted)[0]
        found = self.curvature(run.first, run.p, -on_conditions[None], along)
        if discretes.given:
            seeds = on_discretes[[held.index(place) for place in discretes.given]]
            found += Curvature(self.system, discretes.values)(run.first, run.p, seeds[None], along)
        return found


def _refuse_jump(result: Result[Any], run: Record) -> None:
    """Reject resets at the start of the run, which are not differentiated."""
    begun, first = np.array(list(result.report.states.values())), run.first.x[0]
    if (np.abs(begun - first) > 1e-7 * (1.0 + np.abs(first))).any():
        raise NotDifferentiable(
            f"at t = {run.start:.9g} s, the start of the run, a reset changes the states; start the run after it (start=...)"
        )
