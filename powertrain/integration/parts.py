"""A compiled step in parts: constants, the advance, its four samples, their survey, the verdict.

What depends only on held values and parameters is computed when these change. A rejected step ends after the advance. The samples are
computed side by side, and so are the indicators in their survey. The results equal those of the step in one function, up to round-off.
"""

from __future__ import annotations

import casadi as ca

from powertrain.integration.fused import Model, error_norm, taken_step
from powertrain.integration.samples import WITHOUT, extremes
from powertrain.integration.step import on_polynomial
from powertrain.integration.step_control import verdict_of
from powertrain.modes.indicators import indicators
from powertrain.numerics.buffers import CHECKS, PREFIX, Call, Memory, bound, view, zeros
from powertrain.numerics.compiled import Compilable
from powertrain.numerics.least import least_of
from powertrain.numerics.vectorised import WIDTH, abreast

assert len(CHECKS) + 1 == WIDTH


def in_parts(model: Model, method: str) -> dict[str, Compilable]:
    """The parts by name."""
    return {**_advance(model, method), "samples": _samples(model), "survey": _survey(model), "verdict": _verdict(model)}


def _advance(model: Model, method: str) -> dict[str, ca.Function]:
    """(time, y, m, p, reached, tolerance, constants) -> (y, dense, error norm, stiffness, time and unknowns at the samples, outside).

    And (m, p) -> constants.
    """
    n, t, h = model.y.numel(), model.time[0], model.time[1]
    reached = model.kind.sym("reached", n + model.indicators)
    taken, defect = taken_step(model, method, reached[:n, :])
    inner = [ca.vertcat(t + q * h, on_polynomial(taken.dense, q)) for q in CHECKS]
    points = ca.horzcat(*inner, ca.vertcat(t + h, taken.end)).T
    results = [taken.end, ca.vec(taken.dense), error_norm(model, taken, defect), taken.stiffness, points]
    results.append(model.guards(t + h, taken.end))
    symbols, values = zip(*model.constants.values(), strict=True)
    inputs = [model.time, model.y, model.m, model.p, reached, model.tolerance, *symbols]
    return {
        "constants": ca.Function(f"{PREFIX}constants", [model.m, model.p], list(values)),
        "advance": ca.Function(PREFIX + method, inputs, ca.cse([ca.densify(r) for r in results])),
    }


def _samples(model: Model) -> Compilable:
    """(points, m, p) -> indicators, their noise and rates at these points, one row per point."""
    dae = model.dae
    watched = indicators(dae)
    found = ca.vertcat(*(i.value for i in watched), *(i.noise for i in watched), dae.xdot, dae.residual)
    return abreast(f"{PREFIX}samples", ca.vertcat(dae.t, dae.x, dae.z), [dae.m, dae.p], ca.cse(ca.densify(found)))


def _survey(model: Model) -> Compilable:
    """(reached, samples) -> the least extremes of the indicators."""
    n, ny = model.indicators, model.y.numel()
    places = [(0, slice(ny, ny + n, 1)), *((1, slice(k, WIDTH * n, WIDTH)) for k in range(WIDTH))]
    places.append((1, slice(WIDTH * n + WIDTH - 1, 2 * WIDTH * n, WIDTH)))  # the round-off at the end of the step
    sizes = (ny + n, 1), (WIDTH, 2 * n + ny)
    return least_of(f"{PREFIX}survey", sizes, places, lambda each: extremes(each[:-1], each[-1]), WITHOUT)


def _verdict(model: Model) -> ca.Function:
    """(error norm, stiffness, least extremes, samples) -> (info, reached)."""
    n, norm, stiffness = model.indicators, ca.SX.sym("norm"), ca.SX.sym("stiffness")
    least, samples = ca.SX.sym("least", len(WITHOUT)), ca.SX.sym("samples", WIDTH, 2 * n + model.y.numel())
    info, last = verdict_of(norm, stiffness, ca.vertsplit(least)), samples[-1, :].T
    results = [ca.densify(info), ca.vertcat(last[2 * n :], last[:n])]
    return ca.Function(f"{PREFIX}verdict_of_samples", [norm, stiffness, least, samples], results)


class Parts:
    """The parts of a step, callable for each direction of the double buffer."""

    def __init__(self, functions: dict[str, ca.Function], memory: Memory) -> None:
        self._functions, self._memory = functions, memory
        self._constants = [zeros(functions["constants"].nnz_out(i)) for i in range(functions["constants"].n_out())]
        self._points, self._found = (
            zeros(n) for n in (functions["samples"].nnz_in(0), functions["samples"].nnz_out(0))
        )
        self._norm, self._stiffness, self._least = memory.info[:1], zeros(1), zeros(len(WITHOUT))
        self._prepare = bound(functions["constants"], [memory.m, memory.p], self._constants)
        self._samples = bound(functions["samples"], [self._points, memory.m, memory.p], [self._found])
        self._prepared = b"", b""
        self.calls = [self._step(side) for side in (0, 1)]

    def _step(self, side: int) -> Call:
        """The step from one side of the double buffer."""
        memory, norm, stiffness, other = self._memory, self._norm, self._stiffness, 1 - side
        given = [memory.time, memory.y[side], memory.m, memory.p, memory.reached[side], memory.tolerance]
        taken = [memory.y[other], memory.dense, norm, stiffness, self._points, memory.outside]
        advance = bound(self._functions["advance"], [*given, *self._constants], taken)
        survey = bound(self._functions["survey"], [memory.reached[side], self._found], [self._least])
        judged = [memory.info, memory.reached[other]]
        verdict = bound(self._functions["verdict"], [norm, stiffness, self._least, self._found], judged)
        m, p, error = memory.m, memory.p, view(norm)

        def call() -> None:
            now = m.tobytes(), p.tobytes()
            if now != self._prepared:
                self._prepare()
                self._prepared = now
            advance()
            if error[0] <= 1.0:
                self._samples()
                survey()
                verdict()

        return call
