"""Markdown from plain docstrings and tables, and files that are written only where they change."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

_CODE = re.compile(r"(``.*?``)")
_SPECIAL = re.compile(r"([\\*_|$<>\[\]`#~])")
_EQUATION = re.compile(r"<=|>=|[^<>=]=[^=]|[^ ]\s[<>]\s[^ ]")
_PROSE = {"are", "but", "its", "of", "the", "that", "them", "these", "they", "this", "with", "without", "which"}


def escaped(text: str) -> str:
    """Plain text with ``code`` as Markdown that looks the same."""
    parts = _CODE.split(text)
    return "".join(part[1:-1] if k % 2 else _SPECIAL.sub(r"\\\1", part) for k, part in enumerate(parts))


def docstring(text: str) -> str:
    """A docstring as Markdown: prose as prose; lines of equations, and indented lines, as they stand."""
    shown: list[str] = []
    inside = False
    for line in text.splitlines():
        literal = bool(line.strip()) and (line.startswith("  ") or is_equation(line))
        if literal != inside:
            shown += ["```", ""] if inside else ["", "```text"]
        inside = literal
        shown.append(line if literal else escaped(line))
    return "\n".join([*shown, "```"] if inside else shown)


def is_equation(line: str) -> bool:
    """Whether a line of a docstring is a formula and not a sentence with one in it."""
    words = set(re.findall(r"[a-z]+", line.lower()))
    return bool(_EQUATION.search(line)) and not line.rstrip().endswith(".") and len(words & _PROSE) < 2


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
