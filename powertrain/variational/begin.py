"""The derivatives of the start: what its conditions make of parameters and starts.

    c(t, s, z, p) = value,   0 = g(t, s, z, p),   d = d(t, p)   =>   c_x X + c_d D + c_p P = V

States that no condition reaches keep their values.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.conditions import discretes_of
from powertrain.errors import ParameterError
from powertrain.result import Result
from powertrain.symbols import column
from powertrain.variational.partials import Partials, System
from powertrain.variational.record import Record
from powertrain.variational.saltation import NotDifferentiable
from powertrain.variational.unknowns import Unknowns


def start_derivatives(result: Result[Any], run: Record, system: System, wanted: Unknowns) -> NDArray[np.float64]:
    """ds/d(unknowns) at the start. ParameterError for a result without the conditions of its start."""
    report, n = result.report, system.states
    if not hasattr(report, "solved"):
        raise ParameterError("the result was pickled and has lost the equations of its start; simulate it again")
    _refuse_jump(result, run, system)
    size, count = len(wanted.names), len(wanted.parameters)
    discretes = discretes_of(result.compiled)
    found = np.zeros((system.size, size))
    computed = ca.Function("d", [system.dae.t, system.dae.m, system.dae.p], [ca.densify(ca.jacobian(discretes.values, system.free))])
    if discretes.given:
        rows = [n + system.discretes.index(place) for place in discretes.given]
        slopes = np.array(computed(run.start, run.first.m[0], run.p)).reshape(len(rows), -1)
        found[rows, :count] = slopes[:, :count]
    for j, name in enumerate(wanted.starts, count):
        if name in discretes.places:
            row = n + system.discretes.index(discretes.places[name])
            found[row], found[row, j] = 0.0, 1.0
    solved = report.solved
    conditions = Partials(system, column([a.expression for a in solved]))(run.first, run.p)
    c, kept = conditions.s[0], np.eye(n)[list(report.open)].reshape(-1, n)
    right = np.zeros((len(solved) + len(kept), size))
    chain = wanted.chain(np.array([run.start]), after=True)[0]
    right[: len(solved)] = -conditions.q[0] @ chain - c[:, n:] @ found[n:]
    labels = [a.label for a in solved] + [system.dae.state_names[k] for k in report.open]
    for j, name in enumerate(wanted.starts, count):
        if name in labels:
            right[labels.index(name), j] += 1.0
    matrix = np.vstack([c[:, :n], kept])
    found[:n] = np.linalg.lstsq(matrix, right, rcond=None)[0] if n else 0.0
    return found


def _refuse_jump(result: Result[Any], run: Record, system: System) -> None:
    """Resets at the very start are not differentiated."""
    begun, first = np.array(list(result.report.states.values())), run.first.x[0]
    if (np.abs(begun - first) > 1e-7 * (1.0 + np.abs(first))).any():
        raise NotDifferentiable(
            f"at t = {run.start:.9g} s, the start itself, a reset changes the states; begin the run after it (start=...)"
        )
