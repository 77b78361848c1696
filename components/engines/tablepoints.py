"""Points of a table over speed and a second axis, and the grid that they form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from powertrain import ParameterError, TextTable, arguments_checked
from powertrain.components.common_units import RPM
from powertrain.components.engines.tablecolumns import Column

Array = NDArray[np.float64]
APART = 1e-3
"""Least distance of coordinates over their range; splines through closer ones oscillate."""


@dataclass(frozen=True)
class Points:
    """Values at speeds w [rad/s] and at x, in its own unit, with their lines in the file."""

    sheet: TextTable
    lines: tuple[int, ...]
    w: Array
    x: Array
    values: Array
    x_name: str = "torque"
    x_unit: str = " N.m"

    @classmethod
    @arguments_checked
    def of(cls, sheet: TextTable, columns: Sequence[Column]) -> Points:
        """The rows with a value, in the units of the columns' kinds. Errors: ParameterError for a value without coordinates."""
        lines = [row.line for row in sheet.rows]
        table = np.array([[sheet.number(row, c.place) * c.size for c in columns] for row in sheet.rows])
        known = ~np.isnan(table)
        for k in np.flatnonzero(known[:, 2] & ~known.all(axis=1))[:1]:
            empty = sheet.headings[columns[int(known[k].argmin())].place]
            raise ParameterError(f"{sheet.path}:{lines[k]}: {empty}: the cell is empty")
        used = np.flatnonzero(known[:, 2])
        if not used.size:
            raise ParameterError(f"{sheet.path}: {sheet.headings[columns[2].place]}: all cells are empty")
        w, x, values = table[used].T
        return cls(sheet, tuple(lines[k] for k in used), w, x, values)

    def at(self, k: int) -> str:
        """The coordinates of a point."""
        return self._place(self.w[k], self.x[k])

    def _place(self, w: float, x: float) -> str:
        return f"{w / RPM:g} rpm and {self.x_name} {x:g}{self.x_unit}"

    def grid(self, advice: str = "") -> tuple[Array, Array, Array]:
        """Speeds, coordinates along x and the values over both. Errors: ParameterError for missing and duplicate points."""
        w, i = np.unique(self.w, return_inverse=True)
        x, k = np.unique(self.x, return_inverse=True)
        number = np.zeros((w.size, x.size), int)
        np.add.at(number, (i, k), 1)
        if number.max() > 1:
            twice = np.flatnonzero(number[i, k] > 1)[:2]
            lines = " and ".join(str(self.lines[n]) for n in twice)
            raise ParameterError(f"{self.sheet.path}: lines {lines} both give a value at {self.at(twice[0])}")
        if number.min() == 0:
            row, column = (int(k) for k in np.argwhere(number == 0)[0])
            raise ParameterError(
                f"{self.sheet.path}: no value at {self._place(float(w[row]), float(x[column]))}: {np.sum(number == 0)} of {number.size} "
                f"points are missing ({w.size} speeds by {x.size} values of {self.x_name}){advice}"
            )
        values = np.empty((w.size, x.size))
        values[i, k] = self.values
        return w, x, values

    def filled(self) -> Points:
        """The points at every speed over the x of all speeds: interpolated and extrapolated linearly, not below zero."""
        speeds, x = np.unique(self.w), _apart(np.unique(self.x))
        rows = [self._along(w)(x) for w in speeds]
        return replace(
            self,
            lines=(0,) * (speeds.size * x.size),
            w=np.repeat(speeds, x.size),
            x=np.tile(x, speeds.size),
            values=np.concatenate(rows),
        )

    def _along(self, w: float) -> Callable[[Array], Array]:
        own = np.flatnonzero(self.w == w)
        own = own[np.argsort(self.x[own])]
        x, values = self.x[own], self.values[own]
        if own.size < 2:
            raise ParameterError(
                f"{self.sheet.path}:{self.lines[own[0]]}: {self.at(own[0])} is the only point at this speed; two are needed, so round "
                "measured speeds to their set points"
            )
        if (same := np.flatnonzero(np.diff(x) == 0)).size:
            lines = " and ".join(str(self.lines[own[k]]) for k in (same[0], same[0] + 1))
            raise ParameterError(f"{self.sheet.path}: lines {lines} both give a value at {self.at(int(own[same[0]]))}")

        def line(at: Array) -> Array:
            k = np.clip(np.searchsorted(x, at) - 1, 0, x.size - 2)
            inside = values[k] + (values[k + 1] - values[k]) / (x[k + 1] - x[k]) * (at - x[k])
            return np.asarray(np.maximum(inside, min(values.min(), 0)))

        return line


def _apart(x: Array) -> Array:
    """Both ends of increasing values, and those between that are further apart than scatter."""
    least = APART * (x[-1] - x[0])
    kept = [x[0]]
    for one in x[1:-1]:
        if min(one - kept[-1], x[-1] - one) >= least:
            kept.append(one)
    return np.array([*kept, x[-1]])
