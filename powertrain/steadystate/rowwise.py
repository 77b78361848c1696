"""A map row by row: along its fastest dimension only one quantity changes, so most work is done once per row.

In given modes most quantities are affine along a row, a + b x with two numbers per row. The fastest dimension is cut where modes change
on sample rows. All rows between two cuts are tried with the known combinations of modes, first with the one that last fitted. Rows that
no single combination fits, and those on which something is not affine, are left to be filled point by point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.points import Index, Mask
from powertrain.equilibrium.system import Equilibrium
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, scalars
from powertrain.numerics.batch import LANES, Rows, Tape
from powertrain.numerics.replay import RowForms, row_forms
from powertrain.steadystate.known_modes import Key, KnownModes

_CACHED = 1 << 16
"""Numbers that fit into the processor's cache."""
_MOST_CUTS = 16
_PROBES = 8
_COARSE = 33
_TOGETHER = 1 << 16
_LARGE = 1e150
"""The product of two smaller numbers is finite."""

Modes = Callable[[NDArray[np.intp], NDArray[np.intp]], Rows]
"""Modes at (row, column) pairs, one column of the result per pair."""


class _Lines:
    """The outputs in one combination of modes along rows: a + b x with two numbers per output and row."""

    def __init__(self, problem: Equilibrium, forms: RowForms, slow: list[Symbol], ends: Symbol) -> None:
        pairs = [Symbol(0) if part is None else part for form in forms.outputs for part in (form.a, form.b)]
        rows = list(ca.cse([forms.fits, *pairs]))
        self._common = problem.common
        self._tape = Tape("steady_lines", slow, ca.vertcat(self._common.symbols, ends), rows, LANES)

    def __call__(self, slow: Rows, x: Array) -> tuple[Mask, Rows]:
        """Which rows fit where x is along them, and a and b of all outputs."""
        self._tape.set_common(np.append(self._common.values, [x.min(), x.max()]))
        found = self._tape(slow)
        return found[0] != 0.0, found[1:]


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
    """Fills maps of one problem row by row, in its known modes. Serves one thread."""

    def __init__(self, known: KnownModes) -> None:
        self.known = known
        self._lines: dict[tuple[Key, int], _Lines | None] = {}

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
            self._settle(piece, fast, slow)
            reached += int((~piece.open).sum()) * piece.x.size
            done(reached)
        if reached:
            _draw(tables, pieces)
        finite = reached == count * x.size
        for piece in pieces:
            left = _neighbours(np.flatnonzero(piece.open), x.size, piece.columns)
            for low in range(0, left.size, _TOGETHER):
                rest(left[low : low + _TOGETHER])
                reached += min(_TOGETHER, left.size - low)
                done(reached)
        return finite and all(np.abs(each).max(initial=0.0) < _LARGE for each in (x, *(p.numbers for p in pieces)))

    def _settle(self, piece: _Piece, fast: int, slow: Rows) -> None:
        """Try the known combinations: first on the rows that they last fitted, then on all."""
        for again in (True, False):
            for number, key in enumerate(self.known.keys):
                rows = np.flatnonzero(piece.open & (piece.fitted == number) if again else piece.open)
                if not rows.size or (lines := self._of(key, fast)) is None:
                    continue
                fits, numbers = lines(slow[:, rows], piece.x)
                piece.numbers[:, rows[fits]] = numbers[:, fits]
                piece.fitted[rows[fits]], piece.open[rows[fits]] = number, False

    def _of(self, key: Key, fast: int) -> _Lines | None:
        """The outputs of one combination along rows of the axis ``fast``; None if they are not affine."""
        if (key, fast) not in self._lines:
            problem, ends = self.known.problem, Symbol.sym("ends", 2)
            slow = [s for i, s in enumerate(problem.grid) if i != fast]
            others = [*slow, *scalars(problem.common.symbols), ends[0], ends[1]]
            forms = row_forms(problem.grid[fast], ends, others, *self.known.parts(key))
            self._lines[key, fast] = None if forms is None else _Lines(problem, forms, slow, ends)
        return self._lines[key, fast]


@np.errstate(all="ignore")
def _draw(tables: Sequence[Rows], pieces: Sequence[_Piece]) -> None:
    """Write a + b x along all rows, also along open ones.

    Rows are processed in groups that fit into the cache. Each group is first filled with the a of the first piece: memory is written much
    faster in long runs than in short ones.
    """
    terms = [np.vstack([np.ones_like(p.x), p.x]) for p in pieces]
    for k, table in enumerate(tables):
        step = max(1, _CACHED // table.shape[1])
        first = pieces[0].numbers[2 * k]
        sloping = [bool(p.numbers[2 * k + 1].any()) for p in pieces]
        drawn = [np.array_equal(p.numbers[2 * k], first) for p in pieces]
        for low in range(0, len(table), step):
            block = slice(low, low + step)
            table[block] = first[block, None]
            for piece, slopes, done, each in zip(pieces, sloping, drawn, terms, strict=True):
                if slopes:
                    np.matmul(piece.numbers[2 * k : 2 * k + 2, block].T, each, out=table[block, piece.columns])
                elif not done:
                    table[block, piece.columns] = piece.numbers[2 * k, block, None]


def _neighbours(rows: Index, width: int, columns: slice) -> Index:
    """The numbers of the points at some rows and columns, the longer of the two innermost."""
    points = rows[:, None] * width + np.arange(columns.start, columns.stop)
    return (points.T if points.shape[0] > points.shape[1] else points).ravel()


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
    if len(cuts) > _MOST_CUTS:
        return None
    return RowPieces(cuts, np.full((len(cuts) + 1, rows), -1))
