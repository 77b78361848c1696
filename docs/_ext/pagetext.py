"""Markdown from plain docstrings and tables, and files that are written only where they change."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from formulas import formulas

from powertrain.cli.docstrings import blocks

_CODE = re.compile(r"(``.*?``)")
_SPECIAL = re.compile(r"([\\*_|$<>\[\]`#~]|^[-+](?= ))")


def escaped(text: str) -> str:
    """Plain text with ``code`` as Markdown that looks the same."""
    parts = _CODE.split(text)
    return "".join(part[1:-1] if k % 2 else _SPECIAL.sub(r"\\\1", part) for k, part in enumerate(parts))


def docstring(text: str, names: Collection[str] = ()) -> str:
    """A docstring as Markdown: prose as prose, formulas typeset; ``names`` are those of variables."""
    return "\n\n".join(
        _formulas(lines, names) if are_formulas else "\n".join(map(escaped, lines))
        for are_formulas, lines in blocks(text)
    )


def _formulas(lines: list[str], names: Collection[str]) -> str:
    if lines[0].lstrip().startswith(">>>"):
        return "\n".join(["```python", *lines, "```"])
    return f"```{{raw}} html\n{formulas(lines, names)}\n```"


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = (), code: Sequence[int] = ()
) -> str:
    """A table; the columns ``right`` are numbers, the columns ``code`` names."""
    lines = [
        list(head),
        ["---:" if k in right else "---" for k in range(len(head))],
        *([f"`{cell}`" if k in code and cell else escaped(cell) for k, cell in enumerate(row)] for row in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def write(path: Path, text: str) -> None:
    """Write a file if that changes it, so that Sphinx does not read it again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
