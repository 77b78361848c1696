"""Tables in text files with one row per grid point, as arrays over their axes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ModelError, ParameterError
from powertrain.language.quantities import converted, counts_rotations
from powertrain.language.texttable import Heading, Row, TextTable
from powertrain.language.units import checked_unit

PLAIN = ("1", "N.m", "Pa", "W", "kg", "N", "m", "m/s", "kg/s", "kg/J", "m3", "s", "V", "Ohm", "A.s")
"""What columns in units of every day are converted to."""
EVERY_DAY = {"km/h": "m/s", "kW": "W", "bar": "Pa"}
"""Units that are known, but that no component has."""


@dataclass(frozen=True)
class GridTable:
    """Values over the grid of the axes, with names and units as components have them."""

    path: Path
    axes: tuple[Heading, ...]
    grids: tuple[NDArray[np.float64], ...]
    value: Heading
    values: NDArray[np.float64]


def read_grid(path: str | Path) -> GridTable:
    """The table of a file, whose last column holds the values; its rows may be in any order but must fill the grid.

    Errors: ParameterError naming the file, and the line or the column.
    """
    sheet = TextTable.read(path)
    for i, head in enumerate(sheet.headings, 1):
        if not head.unit or not head.name:
            said = f"{sheet.path}: column {i}: {str(head)!r}"
            raise ParameterError(f"{said} is not a column heading such as 'speed [rad/s]'")
    if len(sheet.headings) < 2:
        raise ParameterError(f"{sheet.path}: a column for every axis and one for the value are needed")
    table = np.array([_row(sheet, row) for row in sheet.rows])
    units = [_plain(sheet.path, head) for head in sheet.headings]
    table *= [size for size, _ in units]
    *axes, value = (Heading(head.name, unit) for head, (_, unit) in zip(sheet.headings, units, strict=True))
    grids = tuple(np.unique(column) for column in table.T[:-1])
    places = np.column_stack([g.searchsorted(column) for g, column in zip(grids, table.T, strict=False)])
    _check_grid(sheet.path, [row.line for row in sheet.rows], places.tolist(), axes, grids)
    values = np.empty([g.size for g in grids])
    values[tuple(places.T)] = table[:, -1]
    return GridTable(sheet.path, tuple(axes), grids, value, values)


def _plain(path: Path, head: Heading) -> tuple[float, str]:
    """The unit of a column as components have it, and the size of the column's unit in it: Nm is 1 N.m, rpm is pi/30 rad/s."""
    unit = "rad/s" if counts_rotations(head.unit) else EVERY_DAY.get(head.unit)
    if unit is not None:
        return converted(1.0, head.unit, unit), unit
    try:
        return 1.0, checked_unit(head.unit)
    except ModelError as error:
        for unit in PLAIN:
            with suppress(ModelError):
                return converted(1.0, head.unit, unit), unit
        raise ParameterError(f"{path}: column {head.name!r}: {error}") from None


def _check_grid(
    path: Path,
    lines: Sequence[int],
    places: Sequence[Sequence[int]],
    axes: Sequence[Heading],
    grids: Sequence[NDArray[np.float64]],
) -> None:
    """One row for every grid point: in order, the places count up through the grid."""
    ordered = sorted(zip(map(tuple, places), lines, strict=True))
    for (place, _), (following, line) in itertools.pairwise(ordered):
        if place == following:
            raise ParameterError(f"{path}:{line}: this grid point already has a value")
    whole = itertools.product(*(range(g.size) for g in grids))
    for wanted, found in itertools.zip_longest(whole, (place for place, _ in ordered)):
        if wanted != found:
            said = ", ".join(f"{a.name} = {g[k]:g} {a.unit}" for a, g, k in zip(axes, grids, wanted, strict=True))
            raise ParameterError(f"{path}: no row for {said}: the rows must fill the grid")


def _row(sheet: TextTable, row: Row) -> list[float]:
    try:
        numbers = [float(cell) for cell in row.cells]
    except ValueError:
        raise ParameterError(f"{sheet.path}:{row.line}: {', '.join(row.cells)!r} is not a row of numbers") from None
    width = len(sheet.headings)
    if len(numbers) != width or not all(map(math.isfinite, numbers)):
        said = ", ".join(row.cells)
        raise ParameterError(f"{sheet.path}:{row.line}: {width} finite numbers are needed, got {said!r}")
    return numbers
