"""Tables in text files: columns with a heading and a unit, separated by commas, semicolons or tabs."""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from powertrain.errors import ParameterError
from powertrain.language.arguments import path as argument_path

_UNIT = re.compile(r"(.*)\[([^\[\]]*)\]$"), re.compile(r"(.*?)\((.*)\)$")
"""A heading with its unit: ``speed [rpm]``, ``BSFC (g/(kW.h))``."""
_NUMBER = re.compile(r"[-+]?[\d.,]*\d[\d.,]*(?:[eE][-+]?\d+)?")
_THOUSANDS, _HUNDREDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}"), re.compile(r"[-+]?[1-9]\d\d")
"""Numbers such as 1.500 and 800: together in a column, the mark may separate thousands."""


class Heading(NamedTuple):
    """The name of a column and its unit, which is empty where the file does not say it."""

    name: str
    unit: str = ""

    @classmethod
    def of(cls, text: str) -> Heading:
        """The heading that a text such as ``speed [rpm]`` or ``speed (rpm)`` says."""
        if not isinstance(text, str):
            raise ParameterError(f"{text!r} is not a column heading; write it as a string, such as 'speed [rpm]'")
        found = next((match for form in _UNIT if (match := form.match(text.strip()))), None)
        return cls(found[1].strip(), found[2].strip()) if found else cls(text.strip())

    def __str__(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Row(NamedTuple):
    """The cells of a row and its line in the file."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class TextTable:
    """A table in a text file: headings, and rows of cells as texts; a decimal comma is a point here.

    The first line holds the headings, with units in brackets or in the line below. Columns are separated by tabs, semicolons or commas,
    whichever occurs first in this list. Where they are not separated by commas, numbers may have a decimal comma. Empty lines and lines
    that begin with # are skipped, and so are empty columns at the end.
    """

    path: Path
    headings: tuple[Heading, ...]
    rows: tuple[Row, ...]

    @classmethod
    def read(cls, path: str | Path) -> TextTable:
        """The table of a file.

        Raises
        ------
        ParameterError
            For files that cannot be read, are not in UTF-8, have no rows, rows of another length than the headings, numbers with decimal
            commas as well as decimal points, or 1.500 and 800 in one column, of which the first may be 1500.
        """
        file = Path(argument_path("path", path))
        lines = [(i, line) for i, line in _lines(file) if line.strip() and not line.lstrip().startswith("#")]
        if len(lines) < 2:
            raise ParameterError(f"{file}: a header such as 'speed [rad/s], loss [W]' and rows of numbers are needed")
        delimiter = next((mark for mark in "\t;" if mark in lines[0][1]), ",")
        rows = [Row(i, _cells(line, delimiter)) for i, line in lines]
        if delimiter != ",":
            _check_thousands(file, rows)
            rows = _with_points(file, rows)
        width = _width(rows)
        rows = [Row(line, cells[:width]) for line, cells in rows]
        if all(_NUMBER.fullmatch(cell) for cell in rows[0].cells):
            raise ParameterError(
                f"{file}:{rows[0].line}: the first line must hold headings, such as 'speed [rpm]'; in a wide table leave its first cell "
                "empty, or name the axes there"
            )
        headings = tuple(Heading.of(cell) for cell in rows[0].cells)
        if longer := [row for row in rows if len(row.cells) > len(headings)]:
            found = f"{len(longer[0].cells)} cells, but there are {len(headings)} headings"
            title = "; lines above the headings begin with #" * (longer[0] is rows[1])
            raise ParameterError(f"{file}:{longer[0].line}: {found}; columns are separated by {delimiter!r}{title}")
        return cls(file, *_with_unit_row(headings, rows[1:]))

    def number(self, row: Row, column: int) -> float:
        """The number in a cell; nan where it is empty or says NaN. Errors: ParameterError with the line and the column."""
        cell = row.cells[column] if column < len(row.cells) else ""
        try:
            number = float(cell or "nan")
        except ValueError:
            number = math.inf
        if math.isinf(number):
            raise ParameterError(f"{self.path}:{row.line}: {self.headings[column]}: {cell!r} is not a number")
        return number

    @property
    def is_wide(self) -> bool:
        """Whether the first line holds numbers, beside its first cell."""
        return len(self.headings) > 2 and all(_NUMBER.fullmatch(str(heading)) for heading in self.headings[1:])

    def long(self, first: Heading, across: Heading, value: Heading) -> TextTable:
        """A wide table with a row per value: ``first`` names the first column, ``across`` the first line."""
        rows = [
            Row(row.line, (row.cells[0], str(head), cell))
            for row in self.rows
            for head, cell in zip(self.headings[1:], row.cells[1:], strict=False)
        ]
        return TextTable(self.path, (first, across, value), tuple(rows))


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    try:
        yield from enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1)
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ParameterError(
            f"{path}: byte {error.start} is not text in UTF-8; save the file in that encoding"
        ) from None


def _cells(line: str, delimiter: str) -> tuple[str, ...]:
    return tuple(cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True)))


def _with_points(path: Path, rows: list[Row]) -> list[Row]:
    """The rows with decimal points. A comma beside points may separate thousands: that is not guessed."""
    numbers = [(row.line, cell) for row in rows for cell in row.cells if _NUMBER.fullmatch(cell)]
    commas, points = ([found for found in numbers if mark in found[1]] for mark in ",.")
    if commas and points:
        (i, comma), (k, point) = commas[0], points[0]
        raise ParameterError(
            f"{path}: {comma!r} in line {i} has a comma, {point!r} in line {k} a point; write all numbers with one of them, without "
            "separators of thousands"
        )
    return [Row(i, tuple(c.replace(",", ".") if _NUMBER.fullmatch(c) else c for c in cells)) for i, cells in rows]


def _check_thousands(path: Path, rows: list[Row]) -> None:
    """ParameterError for a column such as 800, 1.000, 1.500: read without the marks, its numbers go on where those without one end."""
    for column in itertools.zip_longest(*(row.cells for row in rows[1:]), fillvalue=""):
        marked = [cell for cell in column if _NUMBER.fullmatch(cell) and {",", "."} & set(cell)]
        plain = [cell for cell in column if _HUNDREDS.fullmatch(cell)]
        if not plain or not marked or not all(map(_THOUSANDS.fullmatch, marked)):
            continue
        whole = [cell.replace(",", "").replace(".", "") for cell in marked]
        if min(abs(int(number)) for number in whole) <= 10 * max(abs(int(number)) for number in plain):
            line = next(row.line for row in rows if marked[0] in row.cells)
            raise ParameterError(
                f"{path}:{line}: {marked[0]!r} in a column with {plain[0]!r} may be {whole[0]}; write numbers without separators of "
                f"thousands, and decimals with another digit: {marked[0]}0"
            )


def _width(rows: list[Row]) -> int:
    """The columns without the empty ones at the end, which spreadsheets write."""
    return max((k for _, cells in rows for k, cell in enumerate(cells, 1) if cell), default=0)


def _with_unit_row(headings: tuple[Heading, ...], rows: list[Row]) -> tuple[tuple[Heading, ...], tuple[Row, ...]]:
    """Where a heading has no unit and the first row begins with no number, that row says the units."""
    first = rows[0].cells
    if all(heading.unit for heading in headings) or not first or not first[0] or _NUMBER.fullmatch(first[0]):
        return headings, tuple(rows)
    units = [cell.strip("[]") for cell in first] + [""] * (len(headings) - len(first))
    named = [Heading(heading.name, heading.unit or unit) for heading, unit in zip(headings, units, strict=False)]
    return tuple(named), tuple(rows[1:])
