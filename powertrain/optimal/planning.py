"""Optimal control of a model through a given sequence of modes, and a simulation of the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from powertrain.errors import ParameterError, SimulationError, suggestion
from powertrain.given_runs import complete, instant_of_run
from powertrain.initialization.outdated import constant_in_tables
from powertrain.language.arguments import by_name, count, listed, number, single
from powertrain.language.arguments import limits as bounded
from powertrain.language.component import Component
from powertrain.language.reals import Array
from powertrain.optimal.dynamics import Dynamics, dynamics
from powertrain.optimal.phases import Collocated, Guess, Phase, guess
from powertrain.optimal.plan import Plan
from powertrain.optimal.rounding import rounded
from powertrain.plant import Plant, plant_of
from powertrain.result import Result
from powertrain.signals import Selector
from powertrain.variational.gradients import number_of
from powertrain.variational.objectives import Objective, objective

Bounds = Mapping[str, tuple[float, float]]
_WIDTHS = (1e-1, 1e-2, 1e-3)
"""Relative widths of rounded corners, tried in this order."""
_WARM = {"ipopt.warm_start_init_point": "yes", "ipopt.mu_init": 1e-5}
"""Options for starting from the solution with wider corners: the default first barrier could lead away to another local minimum."""
_FREE = ": free"
"""The suffix of the margin of a free law."""
_SHORTEST = 0.05
"""The factor by which a phase may become shorter than in the guess; one that vanished would leave its modes undefined."""
_AT_BOUND = 1e-3
"""A phase whose duration is this close to the shortest, relatively, is at that bound."""


def optimal_control(
    plant: Plant[Any] | Component,
    minimize: Selector | Objective,
    guess: Result[Any],
    inputs: Bounds | None = None,
    *,
    parameters: Bounds | None = None,
    limits: Mapping[Any, tuple[float, float]] | None = None,
    ends: Mapping[str, float | Sequence[float]] | None = None,
    stop: tuple[float, float] | None = None,
    smooth: float = 0.0,
    intervals: int | Sequence[int] = 20,
) -> Plan:
    """Inputs and parameters that minimise an objective, through the sequence of modes of ``guess``.

    The instants at which modes change are free. The limits of the modes (speeds that keep their sign, torques within bounds) are
    constraints. The method is direct collocation, solved by IPOPT. Corners of the equations that the guess reaches and that are not modes
    are rounded in the plan. The plan is then simulated with the complete model; ``plan.same_modes`` says whether the modes were as
    planned.

    Parameters
    ----------
    plant : Plant or Component
        The model.
    minimize : selector or Objective
        ``pt.integral`` and ``pt.final`` of signals, and sums of these.
    guess : Result
        A simulated run with the desired sequence of modes, used as the initial guess; its initial state is kept.
    inputs, parameters : mapping of str to (float, float), optional
        (low, high) of the inputs and of the parameters to optimise.
    limits : mapping to (float, float), optional
        (low, high) of signals throughout, by name or selector.
    ends : mapping of str to float or (float, float), optional
        Values or (low, high) of signals at the end.
    stop : (float, float), optional
        Earliest and latest end [s]; by default that of the guess.
    smooth : float
        Weight of the changes of the inputs, relative to their ranges and to the cost of the guess.
    intervals : int or sequence of int
        Number of intervals of each phase; one number is for all phases.

    Returns
    -------
    Plan

    Raises
    ------
    ParameterError
        For unknown names and empty ranges.
    SimulationError
        If the guess has impacts or resets, or the replay fails.
    """
    problem = _Programme(
        plant_of(plant),
        objective(minimize),
        complete(guess),
        dict(by_name("inputs", inputs)),
        dict(by_name("parameters", parameters)),
        intervals,
    )
    if limits is not None and not isinstance(limits, Mapping):
        raise ParameterError(f"limits = {limits!r}: give a dictionary of signals and (low, high)")
    problem.limit(dict(limits or {}), dict(by_name("ends", ends)), stop, number("smooth", smooth))
    return problem.solve()


class _Programme:
    """The nonlinear programme: unknowns, equations and bounds of all phases, joined."""

    def __init__(
        self,
        plant: Plant[Any],
        cost: Objective,
        run: Result[Any],
        inputs: dict[str, Any],
        parameters: dict[str, Any],
        intervals: int | Sequence[int],
    ) -> None:
        self.plant, self.run, self.objective = plant, run, cost
        instant_of_run(plant.compiled, (run, run.trajectory.start), "guess")
        self.ranges = {n: _finite(f"inputs: {n}", r) for n, r in inputs.items()}
        self.free = {n: _finite(f"parameters: {n}", r) for n, r in parameters.items()}
        for what, names, known in (
            ("inputs", inputs, plant.compiled.inputs),
            ("parameters", parameters, plant.compiled.parameters),
        ):
            for name in names:
                if name not in known:
                    raise ParameterError(f"{what}: the model has no {name}{suggestion(name, known)}")
        for term in cost.terms:
            if term.kind not in ("at", "integral") or term.times:
                raise ParameterError(f"minimize takes pt.integral and pt.final, not {term.kind} of {term.signal}")
        if not self.ranges and not self.free:
            raise ParameterError("nothing to optimise: give inputs or parameters with their ranges")
        self.intervals = intervals
        self.width, self.corners = ca.MX.sym("width"), 0
        self.g: list[ca.MX] = []
        self.low: list[Array] = []
        self.high: list[Array] = []

    def limit(self, limits: dict[Any, Any], ends: dict[str, Any], stop: Any, smooth: float) -> None:
        """Build the phases with all limits."""
        self.limits = [(s, bounded(f"limits: {s}", r)) for s, r in limits.items()]
        self.ends = [(s, bounded(f"ends: {s}", (r, r) if single(r) else r, closed=True)) for s, r in ends.items()]
        self.stop = (self.run.trajectory.end,) * 2 if stop is None else bounded("stop", stop, closed=True)
        begin = self.run.trajectory.start
        if not self.stop[1] > begin:
            raise ParameterError(
                f"stop: the latest end, {self.stop[1]:g} s, is not after the start of the guess, {begin:g} s"
            )
        self.smooth = smooth
        signals = [t.signal for t in self.objective.terms] + [s for s, _ in self.limits] + [s for s, _ in self.ends]
        self.models = self._distinct([self._model(a, b, signals) for a, b in self._spans()])
        self.counts = self._counts(len(self.models))
        self.phases, self.built = self._phases(), list[Collocated]()
        self.parameters = ca.MX.sym("parameters", len(self.free))
        self._join()

    def _counts(self, phases: int) -> list[int]:
        """The number of intervals of every phase."""
        given = [self.intervals] * phases if isinstance(self.intervals, int) else listed("intervals", self.intervals)
        if len(given) != phases:
            raise ParameterError(
                f"intervals: {len(given)} numbers for {phases} phases; give one for each, or one for all"
            )
        return [count("intervals", n) for n in given]

    def _spans(self) -> list[tuple[float, float]]:
        trajectory = self.run.trajectory
        modes = [index for index, _, _ in trajectory.laws]
        marks = [trajectory.start]
        for instant in trajectory.instants:
            if instant.extra:
                raise SimulationError(
                    f"the guess has impacts or resets (at t = {instant.time:.6g} s), which a plan cannot contain"
                )
            if (instant.held_left[modes] != instant.held_right[modes]).any() and instant.time > trajectory.start:
                marks.append(instant.time)
        marks.append(trajectory.end)
        return [(a, b) for a, b in pairwise(marks) if b - a > 1e-9 * (marks[-1] - marks[0])]

    def _model(self, start: float, end: float, signals: Sequence[Selector]) -> tuple[Dynamics, float, float]:
        driven = [*self.ranges, *self.free]
        model = dynamics(self.plant, list(signals), driven, (self.run, 0.5 * (start + end)), slides=True)
        return model, start, end

    def _distinct(self, models: list[tuple[Dynamics, float, float]]) -> list[tuple[Dynamics, float, float]]:
        """Merge neighbours with the same modes, because nothing determines the instant between them; free laws count as sliding."""
        laws = [name for _, name, _ in self.run.trajectory.laws]
        found = models[:1]
        for model, start, end in models[1:]:
            last, begin, _ = found[-1]
            if all(last.modes[name] == model.modes[name] for name in laws):
                found[-1] = (min(last, model, key=_free), begin, end)
            else:
                found.append((model, start, end))
        return found

    def _phases(self) -> list[Phase]:
        """The phases with the course of the guess, in units of the largest values."""
        guesses = [guess(self.run, *m, n) for m, n in zip(self.models, self.counts, strict=True)]
        widest = np.array([max(abs(b) for b in r) or 1.0 for r in (*self.ranges.values(), *self.free.values())])
        x_scale = np.maximum(np.max([np.abs(g.nodes).max(axis=1) for g in guesses], axis=0), 1e-3)
        z_scale = np.max([np.abs(g.algebraic).max(axis=1, initial=0.0) for g in guesses], axis=0)
        z_scale = np.where(z_scale > 0.0, z_scale, 1.0)
        models = [self._rounded(m[0], g) for m, g in zip(self.models, guesses, strict=True)]
        return [Phase(m, g, x_scale, widest, z_scale) for m, g in zip(models, guesses, strict=True)]

    def _join(self) -> None:
        """Each phase begins where the one before it ends, the first where the guess does; limits hold in all, ends at the last."""
        first, start = self.phases[0], ca.MX(self.run.trajectory.start)
        shared = list(range(len(self.ranges), len(self.ranges) + len(self.free)))
        before, p = ca.MX(first.guess.nodes[:, 0]), ca.vertcat(ca.MX(first.model.p), self.width)
        for phase in self.phases:
            found = phase.build(start, p, self.parameters, shared)
            self._add(found.equations, 0.0, 0.0)
            self._add((found.first - before) / ca.MX(phase.scales[0]), 0.0, 0.0)
            self._margins(phase, found.margins)
            offset = len(self.objective.terms)
            for k, (_, (low, high)) in enumerate(self.limits):
                self._add(found.y[offset + k, :].T, low, high)
            start, before = found.stop, found.last
            self.built.append(found)
        offset = len(self.objective.terms) + len(self.limits)
        for k, (_, (low, high)) in enumerate(self.ends):
            self._add(self.built[-1].y[offset + k, -1], low, high)
        self._add(start, *self.stop)

    def _rounded(self, model: Dynamics, first: Guess) -> Dynamics:
        """The model with rounded corners, their relative width as a last parameter."""
        times, x, z, u = first.course
        p = np.repeat(model.p[:, None], times.size, axis=1)
        function, corners = rounded(model.function, (times[None], x, z, u, p), ("x", "z", "u"))
        self.corners += corners
        return replace(model, function=function)

    def _margins(self, phase: Phase, margins: ca.MX) -> None:
        """The limits of the modes; a free law slides with its limits as its torque, so they need not coincide."""
        names = phase.model.margins
        for k, name in enumerate(names):
            if not name.endswith(_FREE):
                self._add(margins[k :: len(names)], 0.0, np.inf)

    def _add(self, expression: ca.MX, low: float, high: float) -> None:
        self.g.append(expression)
        self.low.append(np.full(expression.numel(), low))
        self.high.append(np.full(expression.numel(), high))

    def _cost(self) -> tuple[ca.MX, ca.MX]:
        """The objective, and the weight on the changes of inputs."""
        cost, changes = ca.MX(0.0), ca.MX(0.0)
        for k, term in enumerate(self.objective.terms):
            if term.kind == "integral":
                cost += term.factor * sum(b.y[k, :] @ b.weights for b in self.built)
            else:
                cost += term.factor * self.built[-1].y[k, -1]
        for b in self.built:
            for k, (low, high) in enumerate(self.ranges.values()):
                changes += ca.sumsqr(ca.diff(b.u[k, :], 1, 1)) / (high - low) ** 2
        return cost, changes

    def solve(self) -> Plan:
        """Solves and replays."""
        w = [ca.vec(v) for phase in self.phases for v in phase.unknowns] + [self.parameters]
        cost, changes = self._cost()
        first = np.concatenate([*(phase.first for phase in self.phases), [self.run.parameters[n] for n in self.free]])
        low, high = self._bounds()
        worth = ca.Function("cost", [ca.vertcat(*w), self.width], [cost])
        scale = abs(float(worth(first, _WIDTHS[-1]))) or 1.0
        programme = {
            "x": ca.vertcat(*w), "f": cost / scale + self.smooth * changes, "g": ca.vertcat(*self.g), "p": self.width
        }  # fmt: skip
        values, width, stats = self._narrowed(programme, np.clip(first, low, high), low, high)
        return self._plan(programme["x"], values, width, float(worth(values, width)), stats)

    def _narrowed(
        self, programme: dict[str, ca.MX], first: Array, low: Array, high: Array
    ) -> tuple[ca.DM, float, dict[str, Any]]:
        """The solution with the narrowest corners for which the solver converges, their width, and the solver's message."""
        bounds = {"lbx": low, "ubx": high, "lbg": np.concatenate(self.low), "ubg": np.concatenate(self.high)}
        kept: tuple[ca.DM, float, dict[str, Any]] = (ca.DM(first), 0.0, {"success": False})
        begun, iterations, solver = {"x0": kept[0]}, 0, _ipopt(programme, {})
        for n, width in enumerate(_WIDTHS if self.corners else _WIDTHS[-1:]):
            if n == 1:
                solver = _ipopt(programme, _WARM)
            found = solver(p=width, **begun, **bounds)
            stats = solver.stats()
            iterations += int(stats["iter_count"])
            if n == 0 or stats["success"]:
                kept = found["x"], width, stats
            if not stats["success"]:
                break
            begun = {"x0": found["x"], "lam_x0": found["lam_x"], "lam_g0": found["lam_g"]}
        return kept[0], kept[1], kept[2] | {"iter_count": iterations}

    def _shortest(self, phase: Phase) -> float:
        """The shortest duration of a phase [s]: a share of that in the guess, less if the whole has to become shorter."""
        begin, end = self.run.trajectory.start, self.run.trajectory.end
        whole = (self.stop[1] - begin) / (end - begin)
        return _SHORTEST * phase.guess.duration * min(1.0, whole)

    def _bounds(self) -> tuple[Array, Array]:
        low, high = [], []
        for phase in self.phases:
            sizes = [v.numel() for v in phase.unknowns]
            low.append(np.full(sum(sizes), -np.inf))
            high.append(np.full(sum(sizes), np.inf))
            u = np.zeros((len(self.ranges) + len(self.free), phase.count + 1))
            bounds = list(self.ranges.values()) + list(self.free.values())
            place = slice(sum(sizes[:3]), sum(sizes[:4]))
            for array, k in ((low, 0), (high, 1)):
                u[:] = np.array([b[k] for b in bounds])[:, None] / phase.scales[1][:, None]
                array[-1][place] = u.ravel(order="F")
            low[-1][-1] = self._shortest(phase)
        free = list(self.free.values())
        return np.concatenate([*low, [b[0] for b in free]]), np.concatenate([*high, [b[1] for b in free]])

    def _plan(self, w: ca.MX, values: ca.DM, width: float, cost: float, stats: dict[str, Any]) -> Plan:
        parts = [
            e
            for b, phase in zip(self.built, self.phases, strict=True)
            for e in (b.times, b.u, phase.nodes, phase.duration)
        ]
        evaluated = [
            np.array(v, float) for v in ca.Function("parts", [w, self.width], [*parts, self.parameters])(values, width)
        ]
        times = np.maximum.accumulate(np.concatenate([evaluated[4 * k].ravel() for k in range(len(self.phases))]))
        u = np.hstack([evaluated[4 * k + 1].reshape(-1, n + 1) for k, n in enumerate(self.counts)])
        x = np.hstack([evaluated[4 * k + 2] * phase.scales[0][:, None] for k, phase in enumerate(self.phases)])
        durations = tuple(float(evaluated[4 * k + 3].item()) for k in range(len(self.phases)))
        inputs: dict[str, Any] = {**self.run.inputs, **{n: (times, u[k]) for k, n in enumerate(self.ranges)}}
        parameters = {n: float(v) for n, v in zip(self.free, evaluated[-1].ravel(), strict=True)}
        states = dict(zip(self.phases[0].model.states, x, strict=True))
        starts = {n: float(v[0]) for n, v in states.items() if n in self.plant.compiled.signals}
        changed = {n: v for n, v in self.run.parameters.items() if v != self.plant.parameters[n]} | parameters
        result = self.plant.simulate(
            times[-1], start=times[0], starts=starts, inputs=inputs, parameters=changed, rtol=1e-8
        )
        return Plan(
            cost, number_of(result, self.objective), result, self._sequence(result) == self._sequence(self.run), inputs, starts,
            changed, times, states, durations, bool(stats["success"]), str(stats["return_status"]), int(stats["iter_count"]),
            (*self._at_bounds(durations), *constant_in_tables(self.plant.compiled, self.free)),
        )  # fmt: skip

    def _at_bounds(self, durations: Sequence[float]) -> list[str]:
        """The phases that are as short as they may become."""
        return [
            f"phase {k} is as short as it may become, {found:.4g} s (in the guess: {phase.guess.duration:.4g} s): start from a guess in "
            "which it is shorter, or without it"
            for k, (found, phase) in enumerate(zip(durations, self.phases, strict=True))
            if found <= (1 + _AT_BOUND) * self._shortest(phase)
        ]

    def _sequence(self, run: Result[Any]) -> list[bytes]:
        """The sequence of modes."""
        trajectory = run.trajectory
        modes = [index for index, _, kind in trajectory.laws if kind in ("friction", "contact")]
        rows = trajectory.held[trajectory.mode_of_step][:, modes]
        found: list[bytes] = []
        for row in rows:
            if not found or row.tobytes() != found[-1]:
                found.append(row.tobytes())
        return found


def _ipopt(programme: dict[str, ca.MX], more: dict[str, Any]) -> Any:
    options: dict[str, Any] = {
        "expand": True, "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 1000, "ipopt.tol": 1e-8,
        "ipopt.acceptable_iter": 0,
    }  # fmt: skip
    return ca.nlpsol("powertrain_plan", "ipopt", programme, options | more)


def _free(model: Dynamics) -> int:
    """The number of its free laws."""
    return sum(name.endswith(_FREE) for name in model.margins)


def _finite(what: str, given: Any) -> tuple[float, float]:
    """A range whose width is a scale of the problem."""
    low, high = bounded(what, given)
    if not np.isfinite(low) or not np.isfinite(high):
        raise ParameterError(f"{what}: the range {low:g} to {high:g} must be finite")
    return low, high
