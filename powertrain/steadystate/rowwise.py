"""A map row by row: along its fastest dimension only one quantity changes, so most work is done once per row.

The fastest dimension is cut where modes change on sample rows. All rows between two cuts are tried with the known combinations of modes,
first with the one that last fitted. Rows that no single combination fits are left to the point-by-point walk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.system import Equilibrium
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import LANES, Rows, Tape, lifted
from powertrain.numerics.buffers import Bound, zeros
from powertrain.numerics.replay import Affine, RowForms, row_forms, value
from powertrain.steadystate.neighbours import Key, Walker

Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

BLOCK = 16
_CACHED = 1 << 16
"""Numbers that fit into the processor's cache."""
_KEPT = 256
_SHORT = 16
_MOST_CUTS = 16
_PROBES = 8
_COARSE = 33
_WIDEST = 8192
_TOGETHER = 1 << 16
_LARGE = 1e150
"""The product of two smaller numbers is finite."""

Modes = Callable[[NDArray[np.intp], NDArray[np.intp]], Rows]
"""Modes at (row, column) pairs, one column of the result per pair."""


class _Flat:
    """One combination of modes in which everything is affine along a row: a + b x with two numbers per output and row."""

    def __init__(self, problem: Equilibrium, forms: RowForms, slow: list[Symbol], ends: Symbol) -> None:
        affine = [form for form in forms.outputs if isinstance(form, Affine)]
        pairs = [Symbol(0) if part is None else part for form in affine for part in (form.a, form.b)]
        rows = list(ca.cse([forms.fits, *pairs]))
        self._tape = Tape("steady_flat", slow, ca.vertcat(problem.common, ends), rows, LANES)

    def set_row(self, x: Array, common: Array) -> None:
        """Set the values along the rows, and the common values."""
        self._tape.set_common(np.concatenate([common, [x.min(), x.max()]]))

    def write(self, slow: Rows, which: Index, numbers: Sequence[Rows]) -> Mask:
        """Write a and b of the rows that fit; return which do."""
        found = self._tape(slow[:, which])
        good: Mask = found[0] != 0.0
        numbers[0][:, which[good]] = found[1:, good]
        return good


class _Curved:
    """One combination of modes on ``BLOCK`` rows of a given width, computed point by point where not affine."""

    def __init__(
        self, problem: Equilibrium, forms: RowForms, slow: list[Symbol], ends: Symbol, x: Symbol, width: int
    ) -> None:
        values = [value(f, x) for f in forms.outputs]
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
        """Set the values along the rows, and the common values."""
        self._x[:], self._ends[:] = x, (x.min(), x.max())
        self._common[: common.size] = common

    def write(self, slow: Rows, which: Index, tables: Sequence[Rows]) -> Mask:
        """Write the values of the rows that fit; return which do."""
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
        return good


@dataclass(frozen=True)
class RowPieces:
    """Columns at which the rows of a grid are cut, and the combination that last fitted each piece of each row, or -1."""

    cuts: list[int]
    fitted: NDArray[np.intp]


@dataclass(frozen=True)
class _Piece:
    """All rows between two cuts: what last fitted them, which are still open, and a and b of all outputs for the others."""

    first: int
    x: Array
    fitted: Index
    open: Mask
    numbers: Rows

    @property
    def columns(self) -> slice:
        return slice(self.first, self.first + self.x.size)


class RowMap:
    """Fills maps of one walker's problem row by row. Serves one thread."""

    def __init__(self, walker: Walker) -> None:
        self.walker = walker
        self._forms: dict[tuple[Key, int], tuple[RowForms, Symbol]] = {}
        self._tapes: dict[tuple[Key, int, int], _Flat | _Curved] = {}

    def fill(
        self,
        fast: int,
        x: Array,
        slow: Rows,
        plan: RowPieces,
        results: Sequence[Array],
        rest: Callable[[Index], None],
        done: Callable[[int], None],
    ) -> bool:
        """``slow`` are the values of the other axes, one column per row of the map; ``rest`` solves individual points by number.

        Returns whether all values are known to be finite.
        """
        count, reached = slow.shape[1], 0
        tables = [r[: count * x.size].reshape(count, x.size) for r in results]
        pieces = [
            _Piece(first, x[first:last], fitted, np.ones(count, bool), np.zeros((2 * len(tables), count)))
            for fitted, (first, last) in zip(plan.fitted, pairwise([0, *plan.cuts, x.size]), strict=True)
        ]
        for piece in pieces:
            for points in self._settle(piece, True, fast, slow, [piece.numbers]):
                reached += points
                done(reached)
        if reached:
            _draw(tables, pieces)
        finite = reached == count * x.size
        for piece in pieces:
            for points in self._settle(piece, False, fast, slow, [t[:, piece.columns] for t in tables]):
                reached += points
                done(reached)
            left = _neighbours(np.flatnonzero(piece.open), x.size, piece.columns)
            for low in range(0, left.size, _TOGETHER):
                rest(left[low : low + _TOGETHER])
                reached += min(_TOGETHER, left.size - low)
                done(reached)
        return finite and all(np.abs(each).max(initial=0.0) < _LARGE for each in (x, *(p.numbers for p in pieces)))

    def _settle(self, piece: _Piece, flat: bool, fast: int, slow: Rows, targets: Sequence[Rows]) -> Iterator[int]:
        """Try the affine combinations, or the others: first on the rows that they last fitted, then on all.

        Yields the number of points whenever some are finished.
        """
        width = piece.x.size
        for again in (True, False):
            if not piece.open.any() or width < _SHORT:
                return
            for number, key in enumerate(self.walker.keys):
                rows = np.flatnonzero(piece.open & (piece.fitted == number) if again else piece.open)
                if not rows.size or self._form(key, fast)[0].flat != flat:
                    continue
                tape = self._tape(key, fast, width)
                tape.set_row(piece.x, self.walker.common)
                fits = rows[tape.write(slow, rows, targets)]
                piece.fitted[fits], piece.open[fits] = number, False
                yield fits.size * width

    def _form(self, key: Key, fast: int) -> tuple[RowForms, Symbol]:
        """The outputs of one combination along a row, and the symbols of the row's ends."""
        if (key, fast) not in self._forms:
            problem, ends = self.walker.problem, Symbol.sym("ends", 2)
            others = [s for i, s in enumerate(problem.grid) if i != fast]
            others += [*(problem.common[i] for i in range(problem.common.numel())), ends[0], ends[1]]
            self._forms[key, fast] = row_forms(problem.grid[fast], ends, others, *self.walker.parts(key)), ends
        return self._forms[key, fast]

    def _tape(self, key: Key, fast: int, width: int) -> _Flat | _Curved:
        forms, ends = self._form(key, fast)
        place = (key, fast, 0 if forms.flat else width)
        if place not in self._tapes:
            if len(self._tapes) > _KEPT:
                self._tapes.clear()
            problem = self.walker.problem
            slow = [s for i, s in enumerate(problem.grid) if i != fast]
            self._tapes[place] = (
                _Flat(problem, forms, slow, ends)
                if forms.flat
                else _Curved(problem, forms, slow, ends, problem.grid[fast], width)
            )
        return self._tapes[place]


@np.errstate(all="ignore")
def _draw(tables: Sequence[Rows], pieces: Sequence[_Piece]) -> None:
    """Write a + b x along all rows, also along open ones.

    Rows are processed in groups that fit into the cache. Each group is first filled with the a of the first piece: memory is written much
    faster in long runs than in short ones.
    """
    terms = [np.vstack([np.ones_like(p.x), p.x]) for p in pieces]
    for k, table in enumerate(tables):
        step = max(1, _CACHED // table.shape[1])
        sloping = [bool(p.numbers[2 * k + 1].any()) for p in pieces]
        for low in range(0, len(table), step):
            block = slice(low, low + step)
            table[block] = pieces[0].numbers[2 * k, block, None]
            for piece, slopes, each in zip(pieces, sloping, terms, strict=True):
                if slopes:
                    np.matmul(piece.numbers[2 * k : 2 * k + 2, block].T, each, out=table[block, piece.columns])
                elif piece.first:
                    table[block, piece.columns] = piece.numbers[2 * k, block, None]


def _neighbours(rows: Index, width: int, columns: slice) -> Index:
    """The numbers of the points at some rows and columns, the longer of the two innermost."""
    points = rows[:, None] * width + np.arange(columns.start, columns.stop)
    return (points.T if points.shape[0] > points.shape[1] else points).ravel()


def _runs(which: Index, good: Mask) -> list[tuple[slice, slice]]:
    """Destinations and sources of runs of good rows."""
    place = np.flatnonzero(good)
    if not place.size:
        return []
    cut = np.flatnonzero((np.diff(place) != 1) | (np.diff(which[place]) != 1)) + 1
    firsts, lasts = place[np.r_[0, cut]], place[np.r_[cut - 1, -1]]
    return [
        (slice(int(which[i]), int(which[j]) + 1), slice(int(i), int(j) + 1)) for i, j in zip(firsts, lasts, strict=True)
    ]


def make_plan(rows: int, columns: int, modes: Modes) -> RowPieces | None:
    """Cuts where modes change on sample rows; None if there are too many for a map by rows."""
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
    if len(cuts) > _MOST_CUTS or columns > _WIDEST:
        return None
    return RowPieces(cuts, np.full((len(cuts) + 1, rows), -1))
