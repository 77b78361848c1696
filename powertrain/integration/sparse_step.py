"""Rodas5P for large models: the same step with a numeric sparse factorisation, where symbolic elimination is no longer efficient."""

from __future__ import annotations

from functools import partial

import casadi as ca
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from powertrain.integration import rodas5p
from powertrain.integration.fused import Model, closing, verdict_function
from powertrain.integration.step_control import allowances
from powertrain.language.reals import Array
from powertrain.numerics.buffers import CHECKS, PREFIX, Call, Memory, bound, zeros

_A = np.array([[*row, *[0.0] * (8 - len(row))] for row in rodas5p.A])
_C = np.array([[*row, *[0.0] * (8 - len(row))] for row in rodas5p.C])
_DENSE = np.array(rodas5p.DENSE)


class SparseStep:
    """A step from either side of the double buffer: ``calls`` do the same as the fused step functions, including pivoting."""

    def __init__(self, model: Model, memory: Memory) -> None:
        self._memory = memory
        self._states, self._n = model.dae.x.numel(), model.y.numel()
        self._point, self._end, self._now = zeros(self._n), zeros(self._n), zeros(1)
        self._rate, self._slope = zeros(self._n), zeros(self._n)
        self._g, self._noise, self._outside = zeros(model.indicators), zeros(model.indicators), memory.outside
        self._samples, self._norm = zeros((2 + len(CHECKS)) * max(model.indicators, 1)), zeros(1)
        self._nominal = model.dae.sizes
        self._allowed = allowances(model.dae.x.numel(), model.dae.z.numel())
        self._close: Call | None = None
        self._bind(model)
        self.calls = [partial(self._call, side) for side in (0, 1)]

    def _bind(self, model: Model) -> None:
        dae, memory = model.dae, self._memory
        now = ca.SX.sym("now")
        rates, g, noise = model.reached(now, model.y)
        inputs, arrays = [now, model.y, dae.m, dae.p], [self._now, self._point, memory.m, memory.p]
        self._rates = bound(ca.Function(PREFIX + "rates", inputs, ca.cse([rates])), arrays, [self._rate])
        self._watch = bound(
            ca.Function(PREFIX + "watch", inputs, ca.cse([g, noise, ca.densify(model.guards(now, model.y))])),
            arrays,
            [self._g, self._noise, self._outside],
        )
        judged = verdict_function(model.indicators)
        self._verdict = bound(judged, [self._norm, zeros(1), self._samples, self._noise], [memory.info])
        diagonal = ca.Sparsity.diag(self._n)
        jacobian = ca.jacobian(rates, model.y)
        pattern = jacobian.sparsity() + diagonal
        self._data = zeros(pattern.nnz())
        full = ca.project(jacobian, pattern)
        time_slope = ca.densify(ca.jacobian(rates, now))
        function = ca.Function(PREFIX + "jacobian", inputs, ca.cse([full, time_slope]))
        self._jacobian = bound(function, arrays, [self._data, self._slope])
        columns, rows = np.array(pattern.get_col(), dtype=np.int64), np.array(pattern.row(), dtype=np.int64)
        self._diagonal = np.flatnonzero((rows == columns) & (rows < self._states))
        self._pattern = (rows, np.array(pattern.colind()))
        closes = closing(dae)
        if closes is not None:
            x = closes(now, model.y[: self._states], model.y[self._states :], dae.m, dae.p)
            projected = ca.Function(PREFIX + "closing", inputs, [ca.vertcat(x, model.y[self._states :])])
            self._close = bound(projected, arrays, [self._end])

    def _call(self, side: int) -> None:
        """Step from ``memory.time``; results as for the fused step functions."""
        memory, n = self._memory, self._n
        t, h = float(memory.time[0]), float(memory.time[1])
        y, finish = memory.y[side][:n], memory.y[1 - side]
        self._now[0], self._point[:n] = t, y
        self._jacobian()
        matrix = -self._data
        matrix[self._diagonal] += 1.0 / (h * rodas5p.GAMMA)
        stages = np.zeros((8, n))
        memory.info[0] = np.nan
        if not np.isfinite(matrix).all():
            return
        try:
            solve = splu(csc_array((matrix, *self._pattern), shape=(n, n)), permc_spec="COLAMD").solve
        except RuntimeError:
            return
        for i in range(8):
            self._now[0] = t + rodas5p.ALPHA[i] * h
            self._point[:n] = y + _A[i, :i] @ stages[:i]
            self._rates()
            if not np.isfinite(self._rate).all():
                return
            right = self._rate + rodas5p.GAMMA_SUM[i] * h * self._slope
            right[: self._states] += _C[i, :i] @ stages[:i, : self._states] / h
            stages[i] = solve(right)
        self._end[:n] = self._point[:n] + stages[7]
        if self._close is not None:
            self._now[0], self._point[:n] = t + h, self._end[:n]
            self._close()
        finish[:n] = end = self._end[:n]
        self._describe(t, h, y, end, stages)
        self._judge(t, h, end, memory.reached[side][n:], memory.reached[1 - side][n:])

    def _describe(self, t: float, h: float, y: Array, end: Array, stages: Array) -> None:
        """Error norm and dense output."""
        memory = self._memory
        scale = memory.tolerance[1] * self._nominal + memory.tolerance[0] * np.maximum(np.abs(y), np.abs(end))
        self._norm[0] = np.sum((stages[7] / (self._allowed * scale)) ** 4) ** 0.25
        first, second, third = _DENSE @ stages
        dense = memory.dense.reshape(5, -1)
        dense[:] = y, end - y + first, second - first, third - second, -third

    def _judge(self, t: float, h: float, end: Array, before: Array, after: Array) -> None:
        """The verdict from the indicators ``before`` the step, which are known, inside it, and ``after`` it, which are kept."""
        n, count, samples = self._n, before.size, self._samples.reshape(2 + len(CHECKS), -1)
        samples[0, :count] = before
        for k, q in enumerate((*CHECKS, 1.0), start=1):
            self._now[0] = t + q * h
            self._point[:n] = end if q == 1.0 else q ** np.arange(5) @ self._memory.dense.reshape(5, -1)
            self._watch()
            samples[k] = self._g
        after[:] = self._g[:count]
        self._verdict()
