"""Stability of periodic motions: Floquet multipliers from the variational equations over one period, through sticking and slipping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples
from powertrain.errors import ParameterError
from powertrain.given_runs import complete
from powertrain.language.arguments import number
from powertrain.language.reals import Array
from powertrain.result import Result
from powertrain.variational.corners import Corners
from powertrain.variational.partials import System
from powertrain.variational.record import Record, Steps
from powertrain.variational.saltation import Saltation
from powertrain.variational.transitions import VariationalRates, transitions

_CLOSED = 1e-6
"""Changes of a state over the period, in its unit, that are not worth a line."""
_HALVINGS, _SETTLED = 6, 1e-6
"""Most halvings of all steps, and the relative change of the monodromy matrix below which there is no further one: a run at rest takes
steps of any length, over which coefficients that change with time are not resolved."""


@dataclass(frozen=True)
class Floquet:
    """The monodromy matrix of a period and its eigenvalues, the largest first.

    ``matrix``: maps a small change of the states (and discrete variables) ``names`` at the start of the period to the change at its
    end; ``multipliers``: its eigenvalues, ``vectors`` their eigenvectors as columns; ``closure``: the change of each state over the
    period, which should be zero except for angles of a rotating whole; printing shows those that are not. A motion is stable if all
    multipliers lie inside the unit circle, except those of its own phase and of free rotations, which are 1. Sticking gives zeros.
    """

    names: tuple[str, ...]
    matrix: NDArray[np.float64]
    multipliers: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    closure: dict[str, float]
    period: float

    def __str__(self) -> str:
        lines = [f"Floquet multipliers over {self.period:.6g} s"]
        for k, value in enumerate(self.multipliers):
            main = self.names[int(np.abs(self.vectors[:, k]).argmax())]
            text = f"{value.real:.6g}" if abs(value.imag) < 1e-12 else f"{value.real:.6g} {value.imag:+.6g}j"
            lines.append(f"{text:>24}  modulus {abs(value):.6g}  mainly {main}")
        moved = [f"{name} by {change:.3g}" for name, change in self.closure.items() if abs(change) > _CLOSED]
        if moved:
            lines.append(f"changed over the period: {', '.join(moved)}")
        return "\n".join(lines)

    __repr__ = __str__


def floquet(result: Result[Any], start: float, period: float) -> Floquet:
    """The Floquet multipliers of a periodic motion.

    ``result``: a run that has settled on the motion; ``start`` (s): the beginning of a period, not at an event; ``period`` (s). With
    dS/dt = A(t) S between events, saltation at events, and S(start) = 1, the multipliers are the eigenvalues of S(start + period).

    Raises ParameterError for a span outside the run; SimulationError if an event is not differentiable (see ``pt.gradient``).
    """
    trajectory = complete(result).trajectory
    start, period = number("start", start, "s"), number("period", period, "s")
    end = start + period
    if not period > 0.0 or not trajectory.start <= start < end <= trajectory.end:
        raise ParameterError(
            f"the period from {start:g} s to {end:g} s is outside the simulated span [{trajectory.start:g}, {trajectory.end:g}] s"
        )
    trajectory = trajectory.part(start, end)
    result = Result(result.compiled, trajectory, [start, end], result.p, result.report, inputs=result.inputs)
    system = System(result.compiled, (), ())
    flow = VariationalRates(system, None)
    corners = Corners(system, ca.vertcat(flow.expressions, system.dae.residual))
    ends, matrix = np.array([start, end]), np.zeros((0, 0))
    cuts = ends
    for _ in range(_HALVINGS):
        run, _ = corners.cut(result, cuts)
        coarser, matrix = matrix, _monodromy(flow, run, start, end)
        if coarser.size and np.abs(matrix - coarser).max() <= _SETTLED * np.abs(matrix).max():
            break
        cuts = np.concatenate([ends, run.steps.times, run.steps.times + run.steps.durations / 2])
    values, vectors = np.linalg.eig(matrix)
    order = np.argsort(-np.abs(values))
    first, last = trajectory.at(ends, with_events=False).x
    closure = dict(zip(result.compiled.states, (last - first).tolist(), strict=True))
    names = (*result.compiled.states, *result.compiled.discretes)
    return Floquet(names, matrix, values[order].astype(complex), vectors[:, order].astype(complex), closure, period)


def _monodromy(flow: VariationalRates, run: Record, start: float, end: float) -> Array:
    """The product of the transitions of all steps and events."""
    kept = (run.steps.times >= start) & (run.steps.times < end)
    points = np.repeat(kept, len(run.steps.samples.t) // max(len(kept), 1))
    steps = Steps(run.steps.times[kept], run.steps.durations[kept], Samples(*(v[points] for v in run.steps.samples)))
    phi = transitions(flow, steps, flow.linear(steps, run.p))[0]
    jumps = [j for j in Saltation(flow).jumps(run) if start < j.time <= end]
    places = [steps.before(j.time) for j in jumps]
    matrix: Array = np.eye(flow.system.size)
    for i in range(len(steps.times) + 1):
        for jump in (j for j, place in zip(jumps, places, strict=True) if place == i):
            matrix = jump.s @ matrix
        if i < len(steps.times):
            matrix = phi[i] @ matrix
    return matrix
