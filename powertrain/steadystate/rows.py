"""A map row by row: along its fastest dimension only one quantity changes, so most of the work is done once for a row.

The fastest dimension is cut where modes change on some sample rows. Blocks of rows are tried with the combinations of modes that are
known; rows that do not fit as a whole are left to the walk from point to point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.engine.buffers import Array, Bound, zeros
from powertrain.steadystate.equilibrium import Equilibrium
from powertrain.steadystate.forms import Form, RowForms, row_forms
from powertrain.steadystate.lanes import Rows, Tape, lifted
from powertrain.steadystate.walk import Key, Walker
from powertrain.symbols import Symbol

Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

BLOCK = 16
LANES = 512
_KEPT = 256
_SHORT = 16
_MOST_CUTS = 16
_PROBES = 8
_COARSE = 33
_WIDEST = 8192

Modes = Callable[[NDArray[np.intp], NDArray[np.intp]], Rows]
"""Modes at (row, column) pairs, one column of the result per pair."""


class _Flat:
    """One combination of modes in which everything is affine along a row: two numbers per output and row."""

    def __init__(self, problem: Equilibrium, forms: RowForms, slow: list[Symbol], ends: Symbol) -> None:
        self.places: list[tuple[int, int]] = []
        rows: list[Symbol] = [forms.fits]
        for form in forms.outputs:
            place = [0, 0]
            for i, part in enumerate((form.a, form.b)):
                if part is not None:
                    place[i] = len(rows)
                    rows.append(part)
            self.places.append((place[0], place[1]))
        self._tape = Tape("steady_flat", slow, ca.vertcat(problem.common, ends), rows, LANES)

    def set_row(self, x: Array, common: Array) -> None:
        """The values along the rows, and what is the same for all."""
        self._x = x
        self._tape.set_common(np.concatenate([common, [x.min(), x.max()]]))

    def write(self, slow: Rows, which: Index, tables: Sequence[Rows]) -> tuple[Mask, bool]:
        """Writes those of some rows that fit; which do, and whether all values are finite."""
        found = self._tape(slow[:, which])
        good = found[0] != 0.0
        for lines, run in _runs(which, good):
            for table, (a, b) in zip(tables, self.places, strict=True):
                target = table[lines]
                if b:
                    np.multiply(found[b, run, None], self._x, out=target)
                    if a:
                        target += found[a, run, None]
                else:
                    target[...] = found[a, run, None] if a else 0.0
        return good, bool(np.isfinite(found[:, good]).all())


class _Curved:
    """One combination of modes on ``BLOCK`` rows of a given width, computed point by point where it must."""

    def __init__(
        self, problem: Equilibrium, forms: RowForms, slow: list[Symbol], ends: Symbol, x: Symbol, width: int
    ) -> None:
        values = [_value(f, x) for f in forms.outputs]
        along = Symbol(1) if forms.fits_along is None else forms.fits_along
        outputs = [ca.densify(e) for e in (*values, forms.fits * along)]
        inputs = [x, ca.vertcat(Symbol(0, 1), *slow), ends, problem.common]
        scalar = ca.Function("powertrain_steady_row", inputs, outputs)
        wide = lifted(scalar, 1, width, outputs).map("powertrain_rows", "serial", BLOCK, [0, 2, 3], [])
        self._x, self._ends, self._common = zeros(width), zeros(2), zeros(problem.common.numel())
        self._slow, self._count = zeros(len(slow) * BLOCK), len(slow)
        self._results = [zeros(BLOCK * width) for _ in range(len(values) + 1)]
        self._shaped = [r.reshape(BLOCK, width) for r in self._results]
        self._bound = Bound(wide, [self._x, self._slow, self._ends, self._common], self._results)

    def set_row(self, x: Array, common: Array) -> None:
        """The values along the rows, and what is the same for all."""
        self._x[:], self._ends[:] = x, (x.min(), x.max())
        self._common[: common.size] = common

    def write(self, slow: Rows, which: Index, tables: Sequence[Rows]) -> tuple[Mask, bool]:
        """Writes those of some rows that fit; which do, and whether all values are known to be finite."""
        good = np.zeros(which.size, bool)
        for low in range(0, which.size, BLOCK):
            some = which[low : low + BLOCK]
            if self._count:
                block = self._slow.reshape(BLOCK, self._count)
                block[: some.size], block[some.size :] = slow[:, some].T, slow[:, some[-1]]
            self._bound.call()
            fine = (self._shaped[-1][: some.size] != 0.0).all(axis=1)
            good[low : low + some.size] = fine
            for lines, run in _runs(some, fine):
                for table, values in zip(tables, self._shaped, strict=False):
                    table[lines] = values[run]
        return good, False


class RowMap:
    """Fills maps of one walker's problem by rows. Serves one thread."""

    def __init__(self, walker: Walker) -> None:
        self.walker = walker
        self._forms: dict[tuple[Key, int], RowForms] = {}
        self._ends: dict[tuple[Key, int], Symbol] = {}
        self._tapes: dict[tuple[Key, int, int], _Flat | _Curved] = {}

    def fill(
        self,
        fast: int,
        x: Array,
        slow: Rows,
        cuts: Sequence[int],
        common: Array,
        results: Sequence[Array],
        rest: Callable[[int, int, int], None],
        done: Callable[[int], None],
    ) -> bool:
        """``slow`` are the other axes' values, one column per row of the map; ``rest(row, first, last)`` does points of one row.

        Returns whether all values are known to be finite.
        """
        count, finite = slow.shape[1], True
        tables = [r[: count * x.size].reshape(count, x.size) for r in results]
        for first, last in zip([0, *cuts], [*cuts, x.size], strict=True):
            left = np.arange(count)
            for key in self.walker.keys if last - first >= _SHORT else []:
                tape = self._tape(key, fast, last - first)
                tape.set_row(np.ascontiguousarray(x[first:last]), common)
                good, fine = tape.write(slow, left, [t[:, first:last] for t in tables])
                finite &= fine
                left = left[~good]
                done(count * first + (count - left.size) * (last - first))
                if not left.size:
                    break
            for row in left.tolist():
                finite = False
                rest(row, first, last)
            done(count * last)
        return finite

    def _tape(self, key: Key, fast: int, width: int) -> _Flat | _Curved:
        problem = self.walker.problem
        x, slow = problem.grid[fast], [s for i, s in enumerate(problem.grid) if i != fast]
        if (key, fast) not in self._forms:
            ends = Symbol.sym("ends", 2)
            others = [*slow, *(problem.common[i] for i in range(problem.common.numel())), ends[0], ends[1]]
            wanted, margins, rivals = self.walker.parts(key)
            self._forms[key, fast] = row_forms(x, ends, others, wanted, margins, rivals)
            self._ends[key, fast] = ends
        forms = self._forms[key, fast]
        place = (key, fast, 0 if forms.flat else width)
        if place not in self._tapes:
            if len(self._tapes) > _KEPT:
                self._tapes.clear()
            ends = self._ends[key, fast]
            flat = forms.flat
            self._tapes[place] = (
                _Flat(problem, forms, slow, ends) if flat else _Curved(problem, forms, slow, ends, x, width)
            )
        return self._tapes[place]


def _runs(which: Index, good: Mask) -> list[tuple[slice, slice]]:
    """Where runs of good rows go to, and where they come from."""
    place = np.flatnonzero(good)
    if not place.size:
        return []
    cut = np.flatnonzero((np.diff(place) != 1) | (np.diff(which[place]) != 1)) + 1
    firsts, lasts = place[np.r_[0, cut]], place[np.r_[cut - 1, -1]]
    return [
        (slice(int(which[i]), int(which[j]) + 1), slice(int(i), int(j) + 1)) for i, j in zip(firsts, lasts, strict=True)
    ]


def _value(form: Form, x: Symbol) -> Symbol:
    if form.curve is not None:
        return form.curve
    a = Symbol(0) if form.a is None else form.a
    return a if form.b is None else a + form.b * x


def find_cuts(rows: int, columns: int, modes: Modes) -> list[int] | None:
    """Columns before which modes change on sample rows; None where there are too many for a map by rows."""
    probes = np.unique(np.linspace(0, rows - 1, _PROBES).round().astype(np.intp))
    places = np.unique(np.linspace(0, columns - 1, min(columns, _COARSE)).round().astype(np.intp))
    found = modes(np.repeat(probes, places.size), np.tile(places, probes.size))
    grid = found.reshape(len(found), probes.size, places.size)
    change = (np.diff(grid, axis=2) != 0).any(axis=0)
    row, place = np.nonzero(change)
    low, high = places[place], places[place + 1]
    start = grid[:, row, place]
    while (high - low > 1).any():
        middle = (low + high) // 2
        same = (modes(probes[row], middle) == start).all(axis=0)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    cuts = sorted(set(high.tolist()))
    return cuts if len(cuts) <= _MOST_CUTS and columns <= _WIDEST else None
