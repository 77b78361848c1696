"""Expressions evaluated at many points.

``Lanes`` is built quickly and calls a function point by point: for some thousands of points. ``Columns`` is for millions: CasADi's virtual
machine spends most of its time on fetching instructions, so the tape of a scalar function is replayed on columns of points. This keeps
the processor busy with arithmetic and the operands in its cache. Building it takes about 20 microseconds per instruction. ``Evaluated``
in ``powertrain.numerics.buffers`` is for one point.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column
from powertrain.numerics.buffers import Call, bound, view, zeros
from powertrain.numerics.lookup import Lookup, looked_up
from powertrain.numerics.tape import grouped, replayed
from powertrain.numerics.vectorised import VectorTape, vector_tape

Rows = NDArray[np.float64]
"""One row per quantity, one column per point."""


LANES = 256
"""Points per call of a ``Tape`` of a map."""
TOGETHER = 64
"""Points per call of ``Lanes``."""
building = threading.RLock()
"""Held while functions are built from expressions that several threads share."""
# 16 MB, freed at once: glibc now reuses freed blocks up to this size; new pages take longer to fetch than to fill
np.empty(1 << 21)


class Lanes:
    """A column of expressions of several columns, the last of which is common to all points. Serves one thread."""

    def __init__(self, inputs: Sequence[Symbol], outputs: Symbol) -> None:
        with building:
            function = ca.Function("powertrain_one", list(inputs), [ca.densify(outputs)])
            wide = function.map("powertrain_lanes", "serial", TOGETHER, [len(inputs) - 1], [])
        self.sizes, self.size = [s.numel() for s in inputs], outputs.numel()
        self._given = [zeros(n * TOGETHER) for n in self.sizes[:-1]]
        self._common, self._found = zeros(self.sizes[-1]), zeros(self.size * TOGETHER)
        self._call = bound(wide, [*self._given, self._common], [self._found])

    def __call__(self, points: Sequence[Array], common: Array) -> Array:
        """One row of values per point; ``points`` are arrays for all inputs but the last, one row per point."""
        count, k = len(points[0]), self.size
        result = np.empty((count, k))
        rows = [a[:, None] if a.ndim == 1 else a for a in points]
        lanes = [a[: n * TOGETHER].reshape(TOGETHER, n) for a, n in zip(self._given, self.sizes, strict=False)]
        found = self._found[: k * TOGETHER].reshape(TOGETHER, k)
        self._common[: self.sizes[-1]] = common
        for first in range(0, count, TOGETHER):
            width = min(TOGETHER, count - first)
            for lane, values in zip(lanes, rows, strict=True):
                lane[:width] = values[first : first + width]
                lane[width:] = values[first + width - 1]
            self._call()
            result[first : first + width] = found[:width]
        return result


class Tape:
    """``outputs`` as functions of scalars that differ between points (``varying``) and of a column common to all.

    ``least`` and ``most`` are the numbers of points in one call of ``into``, here ``lanes``.
    """

    def __init__(
        self, name: str, varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol], lanes: int
    ) -> None:
        self.lanes, self.inputs, self.outputs = lanes, len(varying), len(outputs)
        self.least = self.most = lanes
        self.function = _in_columns(name, varying, common, outputs, lanes)
        buffer: tuple[Any, Any] = self.function.buffer()
        self._buffer, self._call = buffer
        self._common = zeros(common.numel())
        self._buffer.set_arg(self.inputs, view(self._common))
        self._kept: tuple[object, ...] = ()

    def set_common(self, values: Array) -> None:
        """Set the values common to all points."""
        self._common[: values.size] = values

    def into(self, arguments: Sequence[Array], results: Sequence[Array]) -> None:
        """Evaluate ``lanes`` points, given as contiguous arrays, directly into ``results``."""
        views = [view(a) for a in (*arguments, *results)]
        self._kept = tuple(views)
        buffer, n = self._buffer, self.inputs
        for i, each in enumerate(views[:n]):
            buffer.set_arg(i, each)
        for i, each in enumerate(views[n:]):
            buffer.set_res(i, each)
        self._call()

    def __call__(self, rows: Rows) -> Rows:
        """One row per output for one row per varying scalar."""
        return self.of_rows(rows, rows.shape[1])

    def of_rows(self, rows: Iterable[Array], count: int) -> Rows:
        """The same for separate rows of ``count`` values."""
        rows = list(rows)
        result = np.empty((self.outputs, count))
        given, found, call = self._block
        for first in range(0, count, self.lanes):
            last = min(first + self.lanes, count)
            for lane, row in zip(given, rows, strict=True):
                lane[: last - first], lane[last - first :] = row[first:last], row[last - 1]
            call()
            result[:, first:last] = found[:, : last - first]
        return result

    @cached_property
    def _block(self) -> tuple[Rows, Rows, Call]:
        """Arguments and results at ``lanes`` points, and the function that computes them."""
        given, found = np.zeros((self.inputs, self.lanes)), np.zeros((self.outputs, self.lanes))
        return given, found, bound(self.function, [*given, self._common], list(found))


_FEW, _MANY = 32, 1024


class Common:
    """What all points of a problem have in common, as its parameters: the symbols, and their values, set once for all of its columns."""

    def __init__(self, symbols: Symbol) -> None:
        self.symbols, self.values = symbols, np.zeros(symbols.numel())

    def set(self, values: Array) -> None:
        """Set the values."""
        self.values = values.copy()


class Columns:
    """``outputs`` as functions of scalars that differ between points (``varying``) and of what these have in common.

    ``compile``: as machine code, if they can be written in C.
    """

    def __init__(
        self, name: str, varying: Sequence[Symbol], common: Common, outputs: Sequence[Symbol], compile: bool = False
    ) -> None:
        self._name, self._common = name, common
        self._outputs = ca.cse([ca.densify(o) for o in outputs]) if outputs else []
        self.needed = np.flatnonzero(dependence(outputs, varying).any(axis=0))
        self._arguments = [varying[int(i)] for i in self.needed]
        self._tapes: dict[int, Tape | VectorTape] = {}
        self._compile = compile

    def __call__(self, rows: Rows) -> Rows:
        """One row per output for one row per varying scalar."""
        return self.of_needed([rows[k] for k in self.needed], rows.shape[1])

    def of_points(self, parts: Sequence[NDArray[Any]]) -> Rows:
        """The same for arrays with one row per point, side by side."""
        return self.of_needed(picked(parts, self.needed), len(parts[0]))

    def of_needed(self, rows: Iterable[Array], count: int) -> Rows:
        """The same for only those rows that are needed, of ``count`` points."""
        lanes = 0 if self._compile else _MANY if count > _MANY // 4 else _FEW
        if lanes not in self._tapes:
            self._tapes[lanes] = column_tape(
                self._name, self._arguments, self._common.symbols, self._outputs, lanes or _MANY, self._compile
            )
        self._tapes[lanes].set_common(self._common.values)
        return self._tapes[lanes].of_rows(rows, count)


def picked(parts: Sequence[NDArray[Any]], which: NDArray[np.intp]) -> list[Array]:
    """Some columns of arrays that have one row per point, counted through all arrays; not copied if they are contiguous."""
    columns = [values for part in parts for values in part.T]
    return [np.ascontiguousarray(columns[k], np.float64) for k in which]


def column_tape(
    name: str, varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol], lanes: int, compile: bool
) -> Tape | VectorTape:
    """``outputs`` at ``lanes`` points; with ``compile``, machine code for any number of points, if they can be written in C."""
    found = vector_tape(varying, common, outputs) if compile else None
    return Tape(name, varying, common, outputs, lanes) if found is None else found


def _in_columns(
    name: str, varying: Sequence[Symbol], common: Symbol, outputs: Sequence[Symbol], lanes: int
) -> ca.Function:
    """The outputs as columns of ``lanes`` values: a function of such a column for each varying scalar, and of ``common``."""
    scalar = ca.Function(f"powertrain_{name}", [*varying, common], [ca.densify(o) for o in outputs])
    columns, same = [ca.MX.sym(f"a{i}", lanes) for i in range(len(varying))], ca.MX.sym("common", common.numel())
    entries = [*([column] for column in columns), ca.vertsplit(same) if same.numel() else []]
    results = replayed(scalar, outputs, lambda i, j: entries[i][j], _OfColumns(lanes, {}))
    return ca.Function(f"{scalar.name()}_lanes", [*columns, same], [_filled(each, lanes) for each in results])


@dataclass(frozen=True)
class _OfColumns:
    """Arithmetic of columns of ``lanes`` values, and searches in tables; constants are scalars."""

    lanes: int
    lookups: dict[tuple[int, ...], Lookup]

    def constant(self, value: float) -> ca.MX:
        return ca.MX(value)

    def operate(self, code: int, operands: list[ca.MX]) -> ca.MX:
        first, last = operands[0], operands[-1]
        return ca.MX.unary(code, first) if len(operands) == 1 else ca.MX.binary(code, first, last)

    def call(self, function: ca.Function, operands: list[ca.MX]) -> list[ca.MX]:
        found = looked_up(function, operands, self, self.lookups)
        return _call(function, operands, self.lanes) if found is None else found

    def interval(self, points: Sequence[float], mode: str, x: ca.MX) -> ca.MX:
        return ca.low(ca.DM(list(points)), x, {"lookup_mode": mode})

    def entries(self, numbers: Sequence[float], places: Sequence[ca.MX]) -> list[ca.MX]:
        whole = ca.MX(ca.DM(numbers))
        return [whole.nz[place] for place in places]


def _call(function: ca.Function, arguments: Sequence[ca.MX], lanes: int) -> list[ca.MX]:
    """One function called for every lane: its results in turn, each a column of lanes."""
    columns = [ca.vertcat(*group) for group in grouped(function, [_filled(a, lanes).T for a in arguments])]
    found: list[Any] = function.map(lanes).call(columns)
    return [part.T for each in found for part in ca.vertsplit(each)]


def _filled(value: ca.MX, lanes: int) -> ca.MX:
    value = ca.densify(value)
    # a repetition would be one operation per lane
    return value if value.numel() == lanes else value * ca.MX.ones(lanes, 1)


def dependence(expressions: Sequence[Symbol], symbols: Sequence[Symbol]) -> NDArray[np.bool_]:
    """``found[i, j]``: whether expression i contains symbol j."""
    found = np.zeros((len(expressions), len(symbols)), dtype=bool)
    if expressions and symbols:
        pattern = ca.jacobian_sparsity(column(list(expressions)), column(list(symbols)))
        found[pattern.row(), pattern.get_col()] = True
    return found
