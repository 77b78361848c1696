"""The fused functions of one model: everything the event loop evaluates, each a single call on shared arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import HybridDae
from powertrain.dae.switch import timed
from powertrain.dae.tolerances import BALANCED, FOUND, INTEGRATED, NOW, SETTLED
from powertrain.integration import dopri5, rodas5p
from powertrain.integration.step import StepResult, on_polynomial, slope_of_polynomial
from powertrain.integration.step_control import allowances, verdict
from powertrain.modes.indicators import indicators
from powertrain.modes.projection import at_rest, closed
from powertrain.modes.rules import mode_pass
from powertrain.numerics.buffers import CHANGES, CHECKS, CLOSING, EDGES, IDLE, PREFIX, TORQUES
from powertrain.numerics.hoisting import hoisted
from powertrain.numerics.sparse_lu import factorize
from powertrain.numerics.vertex_elimination import sparse_jacobian

MIDWAY = 0.1
"""Weight of the defect of the dense output midway: the embedded error hardly sees a kink between the stages at 0.3 and 0.8."""
_SLOW, _STRAIGHT, _FIRST = 1e-5, 1e-15, 1e-6
"""Norms of rates and second derivatives too small to give the first step, and its size (s) in that case (Hairer, section II.4)."""
_STEPS = 5
"""Newton steps after a change of modes: a bus whose current changes by a hundred amperes takes four."""


class Model:
    """Functions of one model and their symbols: time, unknowns y = (x, z), held values and parameters.

    ``time`` is (t, h), ``tolerance`` (rtol, atol). ``rows`` are the pivot rows of d(residual)/dz if there are algebraic unknowns. ``kind``
    is ``ca.SX`` for one list of instructions, which suits CasADi's interpreter, or ``ca.MX`` for functions that are called, which suits
    the C compiler if the list is long. What these functions compute from held values and parameters alone is then in ``constants``: symbols
    and their values, by function.
    """

    def __init__(self, dae: HybridDae, rows: Sequence[int] | None = None, kind: Any = ca.SX) -> None:
        self.dae, self.rows, self.kind, self._called = dae, rows, kind, kind is not ca.SX
        self.time, self.tolerance = kind.sym("time", 2), kind.sym("tolerance", 2)
        self.y = kind.sym("y", dae.x.numel() + dae.z.numel())
        self.m = kind.sym("m", dae.m.numel()) if self._called else dae.m
        self.p = kind.sym("p", dae.p.numel()) if self._called else dae.p
        self._slopes = ca.densify(ca.vertcat(dae.xdot, dae.residual))
        self._watched = indicators(dae)
        self.indicators = len(self._watched)
        self.constants = dict[str, tuple[ca.SX, ca.SX]]()
        self._functions = dict[str, ca.Function]()

    def rates(self, t: ca.SX, y: ca.SX) -> ca.SX:
        """The derivatives of the states, then the residuals."""
        return self._call("rates", t, y, lambda: [self._slopes])[0]

    def partials(self, t: ca.SX, y: ca.SX) -> list[ca.SX]:
        """The derivatives of the rates by y and by t."""
        return self._call("partials", t, y, self._partials)

    def algebra(self, t: ca.SX, y: ca.SX) -> list[ca.SX]:
        """The residuals and their derivatives by z."""
        dae = self.dae
        return self._call("algebra", t, y, lambda: [dae.residual, ca.jacobian(dae.residual, dae.z)])

    def watch(self, t: ca.SX, y: ca.SX) -> ca.SX:
        """The indicators."""
        return self._call("watch", t, y, lambda: [self._column("value")])[0]

    def reached(self, t: ca.SX, y: ca.SX) -> list[ca.SX]:
        """The rates, the indicators and their round-off."""
        return self._call("reached", t, y, lambda: [self._slopes, self._column("value"), self._column("noise")])

    def located(self, t: ca.SX, y: ca.SX) -> ca.SX:
        """The indicators with equal uncertainties."""
        return self._call("located", t, y, lambda: [self._column("scaled")])[0]

    def guards(self, t: ca.SX, y: ca.SX) -> ca.SX:
        """Whether values are outside of the limits beyond which steps are counted."""
        return self._call("guards", t, y, lambda: [ca.densify(ca.vertcat(*self.dae.counted.values()))])[0]

    def still(self, t: ca.SX, y: ca.SX) -> ca.SX:
        """The states with stuck speeds set to zero."""
        return self._call("still", t, y, lambda: [ca.densify(at_rest(self.dae))])[0]

    def arguments(self, t: ca.SX, y: ca.SX) -> list[ca.SX]:
        """Those of every function of the model, ``dae.function``."""
        n = self.dae.x.numel()
        return [t, y[:n, :], y[n:, :], self.m, self.p]

    def _call(self, name: str, t: ca.SX, y: ca.SX, outputs: Callable[[], list[ca.SX]]) -> list[ca.SX]:
        """The function of this name, which is made of ``outputs`` when it is first called."""
        dae, functions = self.dae, self._functions
        if name not in functions and self._called:
            functions[name], prepare = hoisted(PREFIX + name, [dae.t, dae.x, dae.z], [dae.m, dae.p], outputs())
            constants = self.kind.sym(f"{name}_constants", prepare.numel_out(0))
            self.constants[name] = constants, prepare(self.m, self.p)
        elif name not in functions:
            functions[name] = ca.Function(PREFIX + name, dae.arguments, outputs())
        more = [self.constants[name][0]] if self._called else []
        return list(functions[name].call([*self.arguments(t, y), *more]))

    def _partials(self) -> list[ca.SX]:
        dae = self.dae
        slopes = sparse_jacobian(self._slopes, ca.vertcat(dae.t, dae.x, dae.z))
        return [slopes[:, 1:], ca.densify(slopes[:, 0])]

    def _column(self, part: str) -> ca.SX:
        """One part of all indicators."""
        return ca.SX(ca.densify(ca.vertcat(*[getattr(indicator, part) for indicator in self._watched])))


def step(model: Model, method: str) -> ca.Function:
    """A step of "dopri5" or "rodas5p" in one function: (time, y, m, p, reached, tolerance) -> (y, reached, info, dense, outside)."""
    n, t, h = model.y.numel(), model.time[0], model.time[1]
    reached = model.kind.sym("reached", n + model.indicators)
    taken, defect = taken_step(model, method, reached[:n, :])
    samples = [model.watch(t + q * h, on_polynomial(taken.dense, q)) for q in CHECKS]
    slope_there, last, noise = model.reached(t + h, taken.end)
    judged = verdict_function(model.indicators)
    norm = error_norm(model, taken, defect)
    info = judged(norm, taken.stiffness, ca.horzcat(reached[n:, :], *samples, last), noise)
    outside = model.guards(t + h, taken.end)
    results = [ca.densify(r) for r in (taken.end, ca.vertcat(slope_there, last), info, ca.vec(taken.dense), outside)]
    inputs = [model.time, model.y, model.m, model.p, reached, model.tolerance]
    if not model.constants:
        return ca.Function(PREFIX + method, inputs, ca.cse(results))
    symbols, values = zip(*model.constants.values(), strict=True)
    inner = ca.Function(f"{PREFIX}{method}_inner", [*inputs, *symbols], ca.cse(results))
    return ca.Function(PREFIX + method, inputs, inner.call([*inputs, *values]))


def taken_step(model: Model, method: str, slope: ca.SX) -> tuple[StepResult, ca.SX | None]:
    """The step from ``slope``, and the weighted defect of its dense output at midstep if that is part of the error."""
    n, t, h = model.dae.x.numel(), model.time[0], model.time[1]
    if method == "dopri5":
        taken = dopri5.step(model.rates, t, h, model.y, slope)
        defect = model.rates(t + h / 2, on_polynomial(taken.dense, 0.5)) - slope_of_polynomial(taken.dense, 0.5) / h
        return _closed(model, taken), MIDWAY * h * defect
    jacobian, time_slope = model.partials(t, model.y)
    rows = list(range(n)) + [n + row for row in model.rows or ()]
    return _closed(model, rodas5p.step(model.rates, jacobian, time_slope, n, t, h, model.y, slope, rows)), None


def _closed(model: Model, taken: StepResult) -> StepResult:
    """The step with closed contacts closed at its end, to which the dense output is led."""
    function, n, dense = closing(model.dae), model.dae.x.numel(), taken.dense
    if function is None:
        return taken
    (x,) = function.call(model.arguments(model.time[0] + model.time[1], taken.end))
    end = ca.vertcat(x, taken.end[n:, :])
    return replace(taken, end=end, dense=ca.horzcat(dense[:, 0], dense[:, 1] + end - taken.end, dense[:, 2:]))


def closing(dae: HybridDae) -> ca.Function | None:
    """(t, x, z, m, p) -> the states with closed contacts closed; None if they remain so by integration."""
    states = closed(dae)
    return None if states is None else dae.function("closed", states)


def error_norm(model: Model, taken: StepResult, defect: ca.SX | None) -> ca.SX:
    """The norm of all errors relative to their tolerances."""
    nominal, allowed = ca.DM(model.dae.sizes), ca.DM(allowances(model.dae.x.numel(), model.dae.z.numel()))
    scale = allowed * (
        model.tolerance[1] * nominal + model.tolerance[0] * ca.fmax(ca.fabs(model.y), ca.fabs(taken.end))
    )
    return _norm((taken.error / scale) ** 2 + (0 if defect is None else (defect / scale) ** 2))


def _norm(squares: ca.SX) -> ca.SX:
    """The root of the norm of squares: at least the largest of their roots, and nan if one is."""
    return ca.sqrt(ca.norm_2(squares)) if squares.numel() else type(squares)(0)


def verdict_function(indicators: int) -> ca.Function:
    """(norm, stiffness, one column of indicators for the start and each sample, noise) -> info, see ``verdict``."""
    norm, stiffness = ca.SX.sym("norm"), ca.SX.sym("stiffness")
    samples, noise = ca.SX.sym("samples", indicators, len(CHECKS) + 2), ca.SX.sym("noise", indicators)
    info = ca.densify(verdict(norm, stiffness, ca.horzsplit(samples), noise))
    return ca.Function(PREFIX + "verdict", [norm, stiffness, samples, noise], ca.cse([info]))


def fresh(model: Model) -> ca.Function:
    """After an event: stuck speeds set to zero, rates and indicators, Hairer's first step size, the sum of rates.

    (time, y, m, p, tolerance) -> (y, reached, [h, sum])
    """
    dae = model.dae
    n = dae.x.numel()
    t = model.time[0]
    y = _at_rest(model, model.y)
    slope = _right_slope(model, y)
    x = y[:n, :]
    scale = model.tolerance[1] * ca.DM(dae.sizes[:n]) + model.tolerance[0] * ca.fabs(x)
    size = _norm((x / scale) ** 2)
    speed_norm = _norm((slope[:n, :] / scale) ** 2)
    first = ca.if_else(ca.logic_or(size < _SLOW, speed_norm < _SLOW), _FIRST, 0.01 * size / speed_norm)
    ahead = model.rates(t + first, ca.vertcat(x + first * slope[:n, :], y[n:, :]))
    bend = _norm(((ahead - slope)[:n, :] / scale) ** 2) / first
    most = ca.fmax(speed_norm, bend)
    second = ca.if_else(most <= _STRAIGHT, ca.fmax(_FIRST, 1e-3 * first), (0.01 / most) ** (1 / 5))
    start = ca.vertcat(ca.fmin(100 * first, second), ca.sum1(slope))
    reached = ca.vertcat(slope, model.watch(t, y))
    return _function(PREFIX + "fresh", [model.time, model.y, dae.m, dae.p, model.tolerance], [y, reached, start])


def rest(model: Model) -> ca.Function:
    """At an event, before modes are found: sets the speeds of stuck laws to zero. (time, y, m, p) -> y."""
    return _function(PREFIX + "rest", [model.time, model.y, model.dae.m, model.dae.p], [_at_rest(model, model.y)])


def _at_rest(model: Model, y: ca.SX) -> ca.SX:
    """Unknowns with stuck speeds set to zero."""
    return ca.vertcat(model.still(model.time[0], y), y[model.dae.x.numel() :, :])


def _right_slope(model: Model, y: ca.SX) -> ca.SX:
    """The right limit of the slope if a table has a kink at this instant."""
    n, t = model.dae.x.numel(), model.time[0]
    soon = NOW * ca.fmax(1, ca.fabs(t))
    return model.rates(t + soon, ca.vertcat(y[:n, :] + soon * model.rates(t, y)[:n, :], y[n:, :]))


def corner(model: Model) -> ca.Function:
    """At a corner of time signals: like ``fresh`` without a step size, and whether modes must be resolved.

    (time, y, m, p) -> (y, reached, [0 if all modes hold and no law is held at its limit, sum])
    """
    dae, t = model.dae, model.time[0]
    y, far = _at_rest(model, model.y), ca.SX(0)
    if dae.z.numel():
        y = _corrected(model, t, _corrected(model, t, y))
        last = _corrected(model, t, y)
        far = ca.sum1(ca.logic_not(ca.fabs(last - y) <= SETTLED * (1 + ca.fabs(last))))
    flags = _rules(model, y, ca.SX.zeros(len(timed(dae)[1])), ca.SX.zeros(2))[1]
    determined = ca.fabs(flags[TORQUES]) < np.inf
    slope = _right_slope(model, y)
    unsettled = flags[CHANGES] + flags[EDGES] + flags[CLOSING] + flags[IDLE] + far + ca.logic_not(determined)
    found = ca.vertcat(unsettled, ca.sum1(slope))
    reached = ca.vertcat(slope, model.watch(t, y))
    return short(_function(PREFIX + "corner", [model.time, model.y, dae.m, dae.p], [y, reached, found]))


def locate(model: Model) -> ca.Function:
    """Unknowns and indicators at a fraction of the step, and the least indicator among those for which ``above`` is not positive.

    (time, fraction, above, dense, m, p) -> (y, g, least). Algebraic unknowns get two Newton corrections.
    """
    dae = model.dae
    fraction, above = ca.SX.sym("fraction"), ca.SX.sym("above", model.indicators)
    dense = ca.SX.sym("dense", 5 * model.y.numel())
    t = model.time[0] + fraction * model.time[1]
    y = on_polynomial(ca.reshape(dense, model.y.numel(), 5), fraction)
    if dae.z.numel():
        for _ in range(2):
            y = _corrected(model, t, y)
    g = model.located(t, y)
    smallest = ca.SX(1e300)
    for i in range(model.indicators):
        smallest = ca.fmin(smallest, ca.if_else(above[i] > 0, 1e300, g[i]))
    inputs = [model.time, fraction, above, dense, dae.m, dae.p]
    return short(_function(PREFIX + "locate", inputs, [y, ca.densify(g), smallest]))


def _corrected(model: Model, t: ca.SX, y: ca.SX) -> ca.SX:
    """The unknowns after a Newton step for z."""
    n = model.dae.x.numel()
    residual, jacobian = model.algebra(t, y)
    return ca.vertcat(y[:n, :], y[n:, :] - factorize(jacobian, model.rows)(residual))


def newton(model: Model) -> ca.Function:
    """A few full Newton steps for z: (time, y, m, p) -> (z, [0 if converged]); the order of pivots is fixed."""
    dae = model.dae
    n = dae.x.numel()
    z, before, last, open_ = model.y[n:, :], ca.SX(np.inf), ca.SX(0), ca.SX(0)
    for k in range(_STEPS):
        residual, jacobian = model.algebra(model.time[0], ca.vertcat(model.y[:n, :], z))
        step = factorize(jacobian, model.rows)(residual)
        size, share = ca.mmax(ca.fabs(residual)), ca.mmax(ca.fabs(step)) / (1 + ca.mmax(ca.fabs(z)))
        if k:
            open_ += ca.logic_not(ca.logic_or(size <= 0.9 * before, last < SETTLED))
        if k == _STEPS - 1:
            closed = ca.fabs(residual) <= BALANCED * ca.mtimes(ca.fabs(jacobian), 1 + ca.fabs(z))
            settled = ca.fabs(step) <= FOUND * (1 + ca.fabs(z))
            open_ += ca.sum1(ca.logic_not(ca.logic_and(closed, settled)))
        z, before, last = z - step, size, share
    return _function(PREFIX + "newton", [model.time, model.y, dae.m, dae.p], [z, open_])


def update(model: Model) -> ca.Function:
    """One pass of the mode rules: (time, y, m, p, fire, [jumped, slack]) -> (m, flags, edges, closing).

    Laws that are stuck are judged at rest, where integration continues: a smooth resistance has a torque left at a speed within its
    hysteresis, and limits that are a share of this very torque do not hold it. A larger change of the states would stop other motions.
    """
    dae = model.dae
    fire, jumped = ca.SX.sym("fire", len(timed(dae)[1])), ca.SX.sym("jumped", 2)
    still = _at_rest(model, model.y)
    near = ca.logic_and(jumped[0] <= 0, ca.norm_inf(still - model.y) <= INTEGRATED)
    called = _rules(model, ca.if_else(near, still, model.y), fire, jumped)
    return _function(PREFIX + "update", [model.time, model.y, dae.m, dae.p, fire, jumped], called)


def _rules(model: Model, y: ca.SX, fire: ca.SX, jumped: ca.SX) -> list[ca.SX]:
    """Held values, flags, edges and closing of one pass of the mode rules."""
    dae = model.dae
    a, b = ca.SX.sym("fire", fire.numel()), ca.SX.sym("jumped", 2)
    taken = mode_pass(dae, a, b[0], b[1])
    results = [ca.densify(e) for e in (taken.held, taken.flags, taken.edges, taken.closing)]
    rules = ca.Function(PREFIX + "rules", [*dae.arguments, a, b], results)
    return list(rules.call([*model.arguments(model.time[0], y), fire, jumped]))


def instants(dae: HybridDae) -> ca.Function:
    """The known instants of timed laws: (m, p) -> times."""
    return _function(PREFIX + "instants", [dae.m, dae.p], [ca.densify(timed(dae)[0])])


def short(function: ca.Function) -> ca.Function:
    """The same function, which computes what its results share once.

    What ``locate`` and ``corner`` save in a drive cycle without a compiler is two to twenty times what the search takes. What is called at
    events alone saves less than that, so that only the C compiler gets it short.
    """
    inputs = function.sx_in()
    return ca.Function(function.name(), inputs, ca.cse(function.call(inputs)))


def _function(name: str, inputs: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    return ca.Function(name, inputs, [ca.densify(ca.SX(r)) for r in results])
