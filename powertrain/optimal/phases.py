"""One phase of an optimal control problem. A sequence of modes is a sequence of phases, each with its own equations and duration.

Radau collocation with three points: x is a polynomial of degree 3 on each interval, whose derivative satisfies the equations at the points.
Inputs are linear on each interval and jump only between phases. L. T. Biegler: Nonlinear Programming, 2010, ch. 10.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.optimal.dynamics import Dynamics
from powertrain.result import Result

DEGREE = 3
POINTS = np.array(ca.collocation_points(DEGREE, "radau"))
_COLLOCATION = ca.collocation_coeff(list(POINTS))
SLOPES, WEIGHTS = np.array(_COLLOCATION[0], float), np.array(_COLLOCATION[2], float).ravel()


@dataclass(frozen=True)
class Guess:
    """Values of a phase from a run: states at nodes and points, algebraic unknowns at the points, inputs at the nodes."""

    start: float
    duration: float
    nodes: NDArray[np.float64]
    points: NDArray[np.float64]
    algebraic: NDArray[np.float64]
    inputs: NDArray[np.float64]

    @property
    def course(self) -> tuple[Array, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Times, states, algebraic unknowns and inputs at the points."""
        intervals = self.inputs.shape[1] - 1
        places = (np.arange(intervals)[:, None] + POINTS).ravel()
        nodes = np.arange(intervals + 1)
        u = np.array([np.interp(places, nodes, row) for row in self.inputs]).reshape(-1, places.size)
        return self.start + self.duration / intervals * places, self.points, self.algebraic, u


def guess(run: Result[Any], model: Dynamics, start: float, end: float, intervals: int) -> Guess:
    """A run between two instants, at the nodes and points of a phase."""
    h = (end - start) / intervals
    nodes = start + h * np.arange(intervals + 1)
    points = (nodes[:-1, None] + h * POINTS).ravel()
    inside = 1e-9 * (end - start)
    at = run.trajectory.at(np.clip(nodes, start + inside, end - inside), with_events=False)
    at_points = run.trajectory.at(np.clip(points, start + inside, end - inside), with_events=False)
    known = run.at(np.clip(nodes, start + inside, end - inside), [n for n in model.inputs if n in run.names()])
    u = np.array([known[n] if n in known else np.full(len(nodes), run.parameters[n]) for n in model.inputs], float)
    return Guess(start, end - start, at.x.T, at_points.x.T, at_points.z.T, u.reshape(len(model.inputs), -1))


@dataclass(frozen=True)
class Collocated:
    """A phase in terms of its unknowns: ``equations`` (= 0), ``margins`` (>= 0), outputs ``y`` at the points.

    ``weights``: those of the points in integrals; ``first`` and ``last``: the states at its ends; ``stop``: its end; ``times`` and inputs
    ``u`` at the nodes.
    """

    equations: ca.MX
    margins: ca.MX
    y: ca.MX
    weights: ca.MX
    first: ca.MX
    last: ca.MX
    stop: ca.MX
    times: ca.MX
    u: ca.MX


class Phase:
    """The unknowns and the equations of one phase, all scaled: ``x_scale`` and ``u_scale`` are the sizes of states and inputs."""

    def __init__(self, model: Dynamics, start: Guess, x_scale: Array, u_scale: Array, z_scale: Array) -> None:
        self.model, self.guess = model, start
        self.scales = x_scale, u_scale, z_scale
        n, nz, nu, count = len(model.states), len(model.algebraic), len(model.inputs), start.nodes.shape[1] - 1
        self.count = count
        self.nodes, self.points = ca.MX.sym("nodes", n, count + 1), ca.MX.sym("points", n, count * DEGREE)
        self.algebraic, self.inputs = ca.MX.sym("z", nz, count * DEGREE), ca.MX.sym("u", nu, count + 1)
        self.duration = ca.MX.sym("duration")
        self.unknowns = [self.nodes, self.points, self.algebraic, self.inputs, self.duration]

    @property
    def first(self) -> Array:
        """The initial guess."""
        x, u, z = self.scales
        g = self.guess
        parts = [g.nodes / x[:, None], g.points / x[:, None], g.algebraic / z[:, None], g.inputs / u[:, None]]
        return np.concatenate([*(p.ravel(order="F") for p in parts), [g.duration]])

    def build(self, start: ca.MX, p: ca.MX, free: ca.MX, shared: list[int]) -> Collocated:
        """The phase from ``start`` on; ``shared`` are the rows of the inputs that are constant: their values are ``free``."""
        x, points, z, u = self._values(free, shared)
        h, whole = self.duration / self.count, self.count * DEGREE
        at_points = u[:, :-1] @ self._spread(1.0 - POINTS) + u[:, 1:] @ self._spread(POINTS)
        times = start + h * ca.MX((np.arange(self.count)[:, None] + POINTS).reshape(1, -1))
        xdot, residual, y, margin, _ = self.model.function.map(whole)(
            times, points, z, at_points, ca.repmat(p, 1, whole)
        )
        z0 = z[:, 0] if z.shape[0] else z[:, :0]
        at_start = self.model.function(start, x[:, 0], z0, u[:, 0], p)
        equations = [*self._collocation(x, points, h * xdot), ca.vec(residual), at_start[4]]
        return Collocated(
            equations=ca.vertcat(*equations),
            margins=ca.vec(margin),
            y=y,
            weights=h * ca.MX(np.tile(WEIGHTS, self.count).reshape(-1, 1)),
            first=x[:, 0],
            last=x[:, -1],
            stop=start + self.duration,
            times=start + h * ca.MX(np.arange(self.count + 1)),
            u=u,
        )

    def _values(self, free: ca.MX, shared: list[int]) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX]:
        """States at the nodes and at the points, algebraic unknowns, and inputs at the nodes, in their units."""
        xs, us, zs = (ca.MX(s) for s in self.scales)
        x, points, z, u = (
            values * ca.repmat(scale, 1, values.shape[1])
            for values, scale in zip(self.unknowns[:-1], (xs, xs, zs, us), strict=True)
        )
        for row, k in enumerate(shared):
            u[k, :] = free[row] * ca.MX.ones(1, self.count + 1)
        return x, points, z, u

    def _spread(self, row: Array) -> ca.MX:
        """The matrix with a row for every interval, which has these numbers in the columns of its points."""
        return ca.MX(np.kron(np.eye(self.count), row[None, :]))

    def _collocation(self, x: ca.MX, points: ca.MX, rise: ca.MX) -> list[ca.MX]:
        """In every interval, the slope of the polynomial through its points is ``rise`` = h dx/dt there, and it ends in the next node."""
        scale = ca.repmat(ca.MX(self.scales[0]), 1, self.count)
        values = [x[:, :-1], *(points[:, k::DEGREE] for k in range(DEGREE))]
        slopes = [sum(SLOPES[j, k] * value for j, value in enumerate(values)) for k in range(DEGREE)]
        equations = [ca.vec((slope - rise[:, k::DEGREE]) / scale) for k, slope in enumerate(slopes)]
        return [*equations, ca.vec((x[:, 1:] - values[-1]) / scale)]
