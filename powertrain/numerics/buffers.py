"""CasADi functions bound once to preallocated numpy arrays; the overhead of a call is a tenth of a microsecond."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, TypeAlias, cast

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import FrictionValues, HybridDae
from powertrain.language.reals import Array

Call: TypeAlias = Callable[[], None]
PREFIX = "powertrain_"
"""Prefix of the names of CasADi functions."""
CHECKS = (0.25, 0.5, 0.75)
"""Positions inside a step at which event indicators are evaluated, besides its end."""
INFO = 5
"""Entries of ``Memory.info`` before the indicators' minima; see ``powertrain.integration.step_control``."""

CHANGES, EDGES, CLOSING, TORQUES, IDLE, FORBIDDEN, JUMPS = FLAGS = range(7)
"""Entries of ``Memory.flags``, see ``powertrain.modes.rules``."""


def bound(function: ca.Function, arguments: Sequence[Array], results: Sequence[Array]) -> Call:
    """A call that evaluates a Function, with its arguments and results in these arrays.

    CasADi's handle keeps neither the buffer object nor the arrays alive, so the call does.
    """
    pair: tuple[Any, Any] = function.buffer()
    buffer, handle = pair
    for i, array in enumerate(arguments):
        _check(array, function.nnz_in(i))
        buffer.set_arg(i, view(array))
    for i, array in enumerate(results):
        _check(array, function.nnz_out(i))
        buffer.set_res(i, view(array))
    call: Any = partial(handle)
    call.kept = (function, buffer, tuple(arguments), tuple(results))
    return cast(Call, call)


class Evaluated:
    """A Function with its own arrays, for arbitrary arguments; results are dense matrices.

    A call takes a tenth of the time of the same Function with numpy arguments. Serves one thread.
    """

    def __init__(self, function: ca.Function) -> None:
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        ends = np.cumsum([0, *(rows * columns for rows, columns in self._shapes)]).tolist()
        self._parts = [slice(a, b) for a, b in pairwise(ends)]
        self._given = [zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self._sizes = [function.nnz_in(i) for i in range(function.n_in())]
        self._found = zeros(ends[-1])
        results = [self._found[part] if part.stop > part.start else zeros(0) for part in self._parts]
        self._call = bound(function, self._given, results)

    def __call__(self, *values: float | Array) -> list[Array]:
        """The results, in arrays that no later call changes."""
        for given, size, value in zip(self._given, self._sizes, values, strict=True):
            given[:size] = value
        self._call()
        found = self._found.copy()
        return [found[part].reshape(shape, order="F") for part, shape in zip(self._parts, self._shapes, strict=True)]


def view(array: Array) -> Any:
    """The array as a memoryview, which accesses single items faster than numpy."""
    return memoryview(cast(Any, array))


def _check(array: Array, needed: int) -> None:
    if array.dtype != np.float64 or not array.flags.c_contiguous or array.size < needed:
        raise ValueError(f"a buffer of {needed} float64 is needed, not {array.size} of {array.dtype}")


def zeros(n: int) -> Array:
    """An array of n zeros; of one zero for n = 0, because a buffer needs an address."""
    return np.zeros(max(n, 1))


class Memory:
    """The arrays shared by all functions of one engine. ``y`` and ``reached`` are double-buffered: a step reads one side, writes the other.

    ``reached`` are the rates of the unknowns ``y``, and the indicators there.

    ``record`` is what is stored of a step: the index of its held values, its time and size, and its dense output.
    """

    def __init__(self, dae: HybridDae, indicators: int, timed: int) -> None:
        unknowns, held = dae.x.numel() + dae.z.numel(), dae.m.numel()
        self._sizes = dae.x.numel(), unknowns, held, dae.p.numel()
        self._dae = dae
        self.record = zeros(3 + 5 * max(unknowns, 1))
        self.time, self.dense = self.record[1:3], self.record[3:]
        self.y = (zeros(unknowns), zeros(unknowns))
        self.reached = (zeros(unknowns + indicators), zeros(unknowns + indicators))
        self.m = zeros(held)
        self.p = zeros(dae.p.numel())
        self.tolerance = zeros(2)
        self.info = zeros(INFO + len(CHECKS) + 1)
        self.outside = zeros(len(dae.guards))
        self.fraction = zeros(1)
        self.above = zeros(indicators)
        self.at = zeros(unknowns)
        self.g = zeros(indicators)
        self.worst = zeros(1)
        self.held = zeros(held)
        self.flags = zeros(len(FLAGS))
        self.edges = zeros(len(dae.whens))
        self.closing = zeros(len(dae.barriers))
        self.fire = zeros(timed)
        self.jumped = zeros(2)
        self.start = zeros(2)
        self.corner = zeros(2)
        self.instants = zeros(timed)

    def values(self, t: float, y: Array, m: Array) -> tuple[float, Array, Array, Array, Array]:
        """Time, states, algebraic unknowns, held values and parameters, from arrays as long as those of ``y`` and ``m``."""
        n, unknowns, held, parameters = self._sizes
        return t, y[:n], y[n:unknowns], m[:held], self.p[:parameters]

    def instant(self, side: int) -> tuple[float, Array, Array, Array, Array]:
        """The same on one side, at the present time."""
        return self.values(float(self.time[0]), self.y[side], self.m)

    def frictions(self, side: int) -> FrictionValues:
        """The values of all friction laws on one side."""
        return FrictionValues(*(values.ravel() for values in self._frictions(*self.instant(side))))

    @cached_property
    def _frictions(self) -> Evaluated:
        return Evaluated(self._dae.friction_values)
