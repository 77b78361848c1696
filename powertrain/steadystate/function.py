"""An operating point as a ``casadi.Function`` of its given values, with derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from powertrain.equilibrium.operating import Solver
from powertrain.equilibrium.points import OK
from powertrain.equilibrium.system import held_rows, with_modes
from powertrain.errors import ParameterError
from powertrain.language.arguments import by_name, single
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.language.symbols import column
from powertrain.plant import Plant, plant_of
from powertrain.signals import Selector
from powertrain.steadystate.dataset import dataset
from powertrain.steadystate.results import Look
from powertrain.steadystate.steady import question, steady_map

_ACCURACY = 1e-10
"""Accuracy of the unknowns, relative to their size at the given point plus one."""
_INDEPENDENT = 1e-9
"""Smaller singular values, relative to the largest, leave an unknown undetermined."""


@dataclass(frozen=True)
class SteadyFunction:
    """Operating points in given modes.

    ``function``: a ``casadi.Function`` of (v, p) that gives the outputs ``y`` and ``margin``, which is not negative where the modes hold.
    ``inputs``, ``parameters``, ``outputs`` and ``margins`` name the entries of v, p, y and margin; ``units`` are their units. ``v`` and
    ``p``: the values at the point for which the function was made. ``modes``: the modes by law.
    """

    function: ca.Function
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    margins: tuple[str, ...]
    units: dict[str, str]
    modes: dict[str, float]
    v: Array
    p: Array


def steady_function(
    plant: Plant[Any] | Component,
    at: Mapping[str, float],
    outputs: str | Iterable[Selector] | Mapping[str, Selector],
    *,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    guesses: Mapping[str, float] | None = None,
) -> SteadyFunction:
    """The operating points of a model as a ``casadi.Function``, differentiable to any order.

    The conditions F(u, v, p) = 0 of an operating point in given modes determine its unknowns u. Conditions with a closed-form solution are
    eliminated. The function solves the others by Newton's method; its derivatives follow from the implicit function theorem,
    du/dv = -(F_u)^-1 F_v.

    Parameters
    ----------
    at
        The operating point, {name: value} as a grid of ``pt.steady`` with one point: inputs, parameters, or prescribed variables, in
        their units. Its names become the inputs of the function. Its modes become those of the function, and its unknowns the start of
        Newton's method.
    outputs
        Names or selectors of signals.
    parameters, inputs, free, guesses
        As for ``pt.steady``. Parameters are also the argument ``p`` of the function.

    Returns
    -------
    SteadyFunction
        The function, the names and units of its entries, and its modes.

    Raises
    ------
    ParameterError
        If the point has no unique solution, or its conditions do not determine all unknowns.

    Examples
    --------
    >>> import casadi as ca, powertrain as pt
    >>> from powertrain.components.rotational import Inertia, QuadraticSpeedDependentTorque, Torque
    >>> class Fan(pt.Component):
    ...     torque: pt.Input = pt.signal_input("N.m", "Torque")
    ...     source: Torque = Torque()
    ...     rotor: Inertia = Inertia(J=1)
    ...     air: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
    ...         tau_nominal=-5, w_nominal=50, TorqueDirection=False
    ...     )
    ...
    ...     def equations(self):
    ...         yield pt.connect(self.torque, self.source.tau)
    ...         yield pt.connect(self.source.flange, self.rotor.flange_a)
    ...         yield pt.connect(self.rotor.flange_b, self.air.flange)
    >>> found = pt.steady_function(Fan(), {"torque": 5.0}, ["rotor.w"], guesses={"rotor.w": 40.0})
    >>> v = ca.MX.sym("v")
    >>> slope = ca.Function("slope", [v], [ca.jacobian(found.function(v, found.p)[0], v)])
    >>> round(float(slope(5.0)), 6)
    5.0
    """
    plant = plant_of(plant)
    point = by_name("at", at)
    if not point or not all(map(single, point.values())):
        raise ParameterError("at: give the values of one operating point, a number for each name")
    q = question(plant, point, outputs, parameters, inputs, free, guesses)
    map_ = steady_map(plant, q)
    problem = map_.problem
    for w, lost in zip(q.wanted, problem.turning, strict=True):
        if lost:
            raise ParameterError(f"outputs: {w.name} depends on an angle that only rotates, so it has no steady value")
    v = np.array([axis.values.item() for axis in q.grid.axes])
    solved = map_.solver.solve(v[:, None])
    if solved.status[0] != OK or solved.rest.any():
        problems = dataset(plant, q.grid, q.common, map_, *map_.run(q.grid, Look(), None)).attrs["problems"]
        raise ParameterError(
            f"at: the operating point is not unique or does not exist: {problems or 'friction at rest'}"
        )
    modes, u = solved.modes[:, 0], solved.u[:, 0]
    count = len(plant.compiled.parameters)
    function, margins = _function(map_.solver, modes, u, v, q.common, count)
    known = plant.compiled
    units = {n: known.parameters[n].unit for n in known.parameters} | {n: i.unit for n, i in known.inputs.items()}
    units |= {n: known.signals[n].unit for n in q.asked.axes if n in known.signals and n not in units}
    return SteadyFunction(
        function, q.asked.axes, tuple(known.parameters), tuple(w.name for w in q.wanted), margins,
        units | {w.name: w.picked.unit for w in q.wanted},
        {law.name: float(mode) for law, mode in zip(problem.laws, modes, strict=True)}, v, q.common[:count],
    )  # fmt: skip


def _function(
    solver: Solver, modes: Array, u: Array, v: Array, common: Array, count: int
) -> tuple[ca.Function, tuple[str, ...]]:
    """The function of (v, p), and the names of the margins."""
    problem = solver.problem
    held = [row for row, k, mode in held_rows(problem) if modes[k] == mode]
    margins = {
        f"{choice.law.name}": choice.margins[mode] for choice, mode in zip(solver.choices, modes.tolist(), strict=True)
    }
    given = dict(enumerate(modes.tolist()))
    parts = with_modes([*problem.outputs, *margins.values(), *problem.rows, *held], problem.modes, given)
    first, second = len(problem.outputs), len(problem.outputs) + len(margins)
    y, margin, rows = (column(part) for part in (parts[:first], parts[first:second], parts[second:]))
    grid, unknown = column(problem.grid), column(problem.u)
    values = ca.Function("powertrain_steady_values", [unknown, grid, problem.common.symbols], [y, margin])
    V, P = ca.MX.sym("v", len(v)), ca.MX.sym("p", count)
    whole = ca.vertcat(P, ca.DM(common[count:]))
    found: Any = ca.DM(0, 1)
    if problem.u:
        conditions = ca.Function("powertrain_steady_rows", [unknown, grid, problem.common.symbols], [rows])
        found = _root(conditions, u, v, common)(u, ca.vertcat(V, whole))
    outputs = values(found, V, whole)
    return ca.Function("powertrain_steady", [V, P], list(outputs), ["v", "p"], ["y", "margin"]), tuple(margins)


def _root(conditions: ca.Function, u: Array, v: Array, common: Array) -> ca.Function:
    """Newton's method for F(u) = 0 from the solution ``u`` of the given point: (start, (v, common)) -> u.

    Stuck laws make some rows of F dependent. With the pseudo-inverse of F_u at the given point, F_u^+ F(u) = 0 is square and has the same
    solutions nearby; its derivative there is 1, so it has the units of u.
    """
    U, A = ca.MX.sym("u", len(u)), ca.MX.sym("a", len(v) + len(common))
    rows = conditions(U, A[: len(v)], A[len(v) :])
    slope = np.array(ca.Function("slope", [U, A], [ca.jacobian(rows, U)])(u, np.concatenate([v, common])), float)
    sizes = np.linalg.svd(slope, compute_uv=False)
    if len(sizes) < len(u) or sizes[-1] <= _INDEPENDENT * sizes[0]:
        raise ParameterError("at: the conditions of the operating point do not determine all of its unknowns")
    scale = 1.0 + np.abs(u)
    square = ca.DM(np.linalg.pinv(slope) / scale[:, None]) @ rows
    root: ca.Function = ca.rootfinder(
        "powertrain_steady_root", "newton", {"x": U, "p": A, "g": square}, {"abstol": _ACCURACY, "max_iter": 50}
    )
    return root
