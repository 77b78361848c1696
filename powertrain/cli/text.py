"""Text for a terminal: columns, numbers, summaries of docstrings."""

from __future__ import annotations

import inspect
import math
import shutil
import textwrap
from collections.abc import Iterable, Sequence

from powertrain.cli.docstrings import blocks

LARGEST_WIDTH = 140


def columns(rows: Iterable[Sequence[str]], head: Sequence[str] = (), right: Sequence[int] = ()) -> str:
    """Rows with aligned columns, those of ``right`` to the right; the last one is wrapped to the terminal."""
    lines = [list(row) for row in rows]
    if not lines:
        return ""
    if head:
        lines.insert(0, list(head))
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    last = len(widths) - 1
    before = 2 + sum(widths[:-1]) + 2 * last
    room = max(width() - before, 30)
    shown = []
    for line in lines:
        cells = [c.rjust(w) if k in right else c.ljust(w) for k, (c, w) in enumerate(zip(line, widths, strict=True))]
        if last not in right:
            cells[last] = f"\n{' ' * before}".join(textwrap.wrap(line[last], room) or [""])
        shown.append(("  " + "  ".join(cells)).rstrip())
    return "\n".join(shown)


def width() -> int:
    """Characters in a line of the terminal, and not too many."""
    return min(shutil.get_terminal_size((110, 24)).columns, LARGEST_WIDTH)


def paragraphs(docstring: str) -> str:
    """A docstring in the width of the terminal: prose filled, formulas a line each."""
    shown = []
    for are_formulas, lines in blocks(docstring):
        texts = [line.strip() for line in lines] if are_formulas else [" ".join(lines)]
        further = "      " if are_formulas else "  "
        filled = [textwrap.fill(text, width(), initial_indent="  ", subsequent_indent=further) for text in texts]
        shown.append("\n".join(filled))
    return "\n\n".join(shown)


def first_line(kind: type) -> str:
    """What a class is, from its docstring."""
    return (inspect.getdoc(kind) or "").partition("\n")[0].replace("``", "")


def number(value: float, digits: int = 4) -> str:
    """A number for reading: ``digits`` significant ones, without an exponent where that is short; - where there is none."""
    if math.isnan(value):
        return "-"
    if not math.isfinite(value) or value == 0 or 1e-3 <= abs(value) < 1e6:
        places = digits - 1 - (math.floor(math.log10(abs(value))) if value and math.isfinite(value) else 0)
        return f"{value:.{max(places, 0)}f}" if value else "0"
    return f"{value:.{digits - 1}e}"


def title(text: str) -> str:
    """A heading."""
    return f"\n{text}"
