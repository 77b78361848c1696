"""Markdown from plain docstrings and tables, and files that are written only where they change."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

_CODE = re.compile(r"(``.*?``)")
_SPECIAL = re.compile(r"([\\*_|$<>\[\]`#~])")
_SIGN = re.compile(r" (?:=|<=|>=|<|>) |(?<=\w)=(?=\w)")
_PROSE = set(
    "a an and are as at be both but by for from has how if in is it its no not of on or so that the them these they this to which with"
    " without".split()
)
_WORD = re.compile(r"(?<!\S)[a-z]+(?![\w.(/])")
_MOST_PROSE, _SHORT = 4, 3
_FULL = 100
"""Characters from which a line of a formula goes on in the next one."""


def escaped(text: str) -> str:
    """Plain text with ``code`` as Markdown that looks the same."""
    parts = _CODE.split(text)
    return "".join(part[1:-1] if k % 2 else _SPECIAL.sub(r"\\\1", part) for k, part in enumerate(parts))


def docstring(text: str) -> str:
    """A docstring as Markdown: prose as prose; lines of equations, and indented lines, as they stand."""
    shown: list[str] = []
    before, inside = "", False
    for number, line in enumerate(text.splitlines()):
        goes_on = inside and len(before) > _FULL and not before.endswith((".", ",", ";", ":"))
        literal = bool(line.strip()) and (line.startswith("  ") or goes_on or (number > 0 and is_equation(line)))
        if literal != inside:
            shown += ["```", ""] if inside else ["", "```text"]
        before, inside = line, literal
        shown.append(line if literal else escaped(line))
    return "\n".join([*shown, "```"] if inside else shown)


def is_equation(line: str) -> bool:
    """Whether a line of a docstring begins with a formula, and is not a sentence with one in it."""
    sign = _SIGN.search(line)
    if sign is None:
        return False
    left = line[: sign.start()]
    before, whole = (set(_WORD.findall(part.lower())) for part in (left, line))
    if len(left.split()) <= _SHORT:
        before -= {"a", "on"}  # names of variables
    return not before & _PROSE and len([w for w in before if len(w) > 3]) < 3 and len(whole & _PROSE) <= _MOST_PROSE


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
