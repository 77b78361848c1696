"""A step of machine code in parts: the advance; the indicators at its four samples, computed abreast; the verdict.

What depends on held values and parameters alone is computed when these change. A rejected step ends after the advance. The numbers are
those of the step in one function.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from powertrain.integration.fused import Common, error_norm, taken_step, verdict_function
from powertrain.integration.step import on_polynomial
from powertrain.modes.indicators import indicators
from powertrain.numerics.buffers import CHECKS, PREFIX, Bound, Memory, view, zeros
from powertrain.numerics.compiled import Compilable
from powertrain.numerics.vectorised import WIDTH, abreast

assert len(CHECKS) + 1 == WIDTH


def in_parts(model: Common, method: str) -> dict[str, Compilable]:
    """The parts by name."""
    advance = _advance(model, method)  # calls the functions whose constants the next part gives
    return {"constants": _constants(model), method: advance, "samples": _samples(model), "verdict": _verdict(model)}


def _constants(model: Common) -> ca.Function:
    """(m, p) -> what the advance takes of them."""
    return ca.Function(f"{PREFIX}constants", [model.m, model.p], [values for _, values in model.constants.values()])


def _advance(model: Common, method: str) -> ca.Function:
    """(time, y, m, p, slope, tolerance, constants) -> (y, dense, error norm, stiffness, time and unknowns at the samples, outside)."""
    slope, t, h = model.kind.sym("slope", model.y.numel()), model.time[0], model.time[1]
    taken, defect = taken_step(model, method, slope)
    inner = [ca.vertcat(t + q * h, on_polynomial(taken.dense, q)) for q in CHECKS]
    points = ca.horzcat(*inner, ca.vertcat(t + h, taken.end)).T
    results = [taken.end, ca.vec(taken.dense), error_norm(model, taken, defect), taken.stiffness, points]
    results.append(model.guards(t + h, taken.end))
    inputs = [model.time, model.y, model.m, model.p, slope, model.tolerance]
    inputs += [symbol for symbol, _ in model.constants.values()]
    return ca.Function(PREFIX + method, inputs, ca.cse([ca.densify(r) for r in results]))


def _samples(model: Common) -> Compilable:
    """(points, m, p) -> indicators and rates at these points, a row for each."""
    dae = model.dae
    found = ca.vertcat(*(indicator.value for indicator in indicators(dae)), dae.xdot, dae.residual)
    return abreast(f"{PREFIX}samples", ca.vertcat(dae.t, dae.x, dae.z), [dae.m, dae.p], ca.cse(ca.densify(found)))


def _verdict(model: Common) -> ca.Function:
    """(error norm, tolerance, stiffness, samples) -> (info, slope)."""
    norm, stiffness = ca.SX.sym("norm"), ca.SX.sym("stiffness")
    tolerance, samples = ca.SX.sym("tolerance", 3), ca.SX.sym("samples", WIDTH, model.indicators + model.y.numel())
    judged = verdict_function(model.indicators)
    info = judged(norm, tolerance[2], stiffness, samples[:, : model.indicators].T)
    return ca.Function(
        f"{PREFIX}judgement", [norm, tolerance, stiffness, samples], [info, samples[-1, model.indicators :].T]
    )


class Parts:
    """The parts of a step from one side of the double buffer to the other, as one ``call``."""

    __slots__ = ("_kept", "call")

    def __init__(self, functions: dict[str, ca.Function], method: str, memory: Memory, side: int) -> None:
        names, other, m, p = ("constants", method, "samples", "verdict"), 1 - side, memory.m, memory.p
        constants = [zeros(functions["constants"].nnz_out(i)) for i in range(functions["constants"].n_out())]
        points, found = (zeros(n) for n in (functions["samples"].nnz_in(0), functions["samples"].nnz_out(0)))
        norm, stiffness = memory.info[:1], zeros(1)
        given = (
            [m, p],
            [memory.time, memory.y[side], m, p, memory.slope[side], memory.tolerance, *constants],
            [points, m, p],
            [norm, memory.tolerance, stiffness, found],
        )
        results = (
            constants,
            [memory.y[other], memory.dense, norm, stiffness, points, memory.outside],
            [found],
            [memory.info, memory.slope[other]],
        )
        self._kept = [Bound(functions[name], a, r) for name, a, r in zip(names, given, results, strict=True)]
        prepare, advance, samples, verdict = (bound.call for bound in self._kept)
        error, before = view(norm), (b"", b"")

        def call() -> None:
            nonlocal before
            now = m.tobytes(), p.tobytes()
            if now != before:
                prepare()
                before = now
            advance()
            if error[0] <= 1.0:
                samples()
                verdict()

        self.call: Callable[[], None] = call
