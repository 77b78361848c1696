"""Tables of printed and computed values, and whether they agree within the digits that were printed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from typing import Literal

Verdict = Literal["agrees", "corrected", "given", "not reproducible", "computed only", "differs", "DIFFERS"]
Value = float | str | None


@dataclass(frozen=True)
class Row:
    """One quantity of a paper, as printed and as the library's model gives it.

    ``printed`` is the text of the paper, whose last digit says how exact it is; empty where the paper only describes or draws the value.
    ``right`` is what should stand there where the print is known to be wrong, and ``remark`` why. ``within``: by how many units of the
    last printed digit the computed value may differ (0.5: rounded). ``cut``: after how many decimals the print was truncated instead.
    ``differs``: why the value is known not to agree within its printed digits; a difference without a reason is a DIFFERS.
    ``given``: one of the paper's data, from which the others are computed; compared with itself it would say nothing.
    ``reproducible = False``: the paper's value follows from nothing that the paper says; it is shown and not compared. ``computed`` None:
    there is nothing to compute.
    """

    quantity: str
    unit: str
    source: str
    printed: str
    computed: Value
    remark: str = ""
    right: str | None = None
    within: float = 0.5
    cut: int | None = None
    given: bool = False
    reproducible: bool = True
    differs: str = ""

    @property
    def verdict(self) -> Verdict:
        """How the computed value stands to the print, or to ``right`` in its place."""
        if not self.reproducible:
            return "not reproducible"
        if self.given and self._agrees:
            return "given"
        expected = self.printed if self.right is None else self.right
        if not expected:
            return "computed only"
        if not self._agrees:
            return "differs" if self.differs else "DIFFERS"
        return "agrees" if self.right is None else "corrected"

    @property
    def _agrees(self) -> bool:
        shown = self.computed
        if self.cut is not None and isinstance(shown, float):
            shown = truncated(shown, self.cut)
        expected = self.printed if self.right is None else self.right
        return agree(expected, shown, self.within if self.cut is None else 1e-9)

    @property
    def shown(self) -> str:
        """The computed value with two digits more than the paper has."""
        if self.computed is None:
            return "–"
        if isinstance(self.computed, (str, int)):
            return str(self.computed)
        place = _place(self.right or self.printed)
        if place is None:
            return f"{self.computed:.4g}"
        return f"{self.computed:.{max(0, 2 - place)}f}"


@dataclass(frozen=True)
class Table:
    """Rows of one subject."""

    title: str
    rows: list[Row]
    note: str = ""


def agree(printed: str, computed: Value, within: float = 0.5) -> bool:
    """Whether a computed value is the printed one, as far as its digits go; texts have to be the same. ``< 1`` is a bound.

    >>> agree("-2.54", -2.536), agree("2.45", 2.456, within=0.5), agree("2.45", 2.456, within=1)
    (True, False, True)
    """
    if printed.startswith("<") and isinstance(computed, (int, float)):
        return computed < float(number(printed[1:]))
    place = _place(printed)
    if place is None or not isinstance(computed, (int, float)):
        return printed == computed
    return abs(computed - float(number(printed))) <= (within + 1e-9) * 10.0**place


def truncated(value: float, decimals: int) -> float:
    """A value without its digits after so many decimals.

    >>> truncated(3.648, 2), truncated(0.6 * 4.1, 2)
    (3.64, 2.46)
    """
    scale = 10.0**decimals
    return math.copysign(math.floor(abs(value) * scale + 1e-9) / scale, value)


def number(text: str) -> Decimal:
    """The number in a printed text, whatever its minus sign: InvalidOperation for none."""
    return Decimal(text.replace("−", "-").replace(" ", "").replace("±", "").replace("≈", ""))


def _place(text: str | None) -> int | None:
    """The power of ten of the last printed digit; None for a text."""
    try:
        exponent = number(text or "").as_tuple().exponent
    except InvalidOperation:
        return None
    return exponent if isinstance(exponent, int) else None


@dataclass(frozen=True)
class Tally:
    """How many rows have which verdict."""

    tables: list[Table] = field(repr=False)

    @property
    def counts(self) -> dict[str, int]:
        """Rows by verdict."""
        found: dict[str, int] = {}
        for table in self.tables:
            for row in table.rows:
                found[row.verdict] = found.get(row.verdict, 0) + 1
        return found

    def __str__(self) -> str:
        names = ("agrees", "corrected", "given", "differs", "computed only", "not reproducible", "DIFFERS")
        words = (
            ("agree with the print", "agrees with the print"),
            ("agree with its correction", "agrees with its correction"),
            ("are given by the paper", "is given by the paper"),
            ("differ for a known reason", "differs for a known reason"),
            ("are computed only", "is computed only"),
            ("cannot be reproduced", "cannot be reproduced"),
            ("DIFFER", "DIFFERS"),
        )
        counted = [(self.counts[n], said) for n, said in zip(names, words, strict=True) if n in self.counts]
        return ", ".join(f"{count} {said[count == 1]}" for count, said in counted)
