"""Markdown from plain docstrings and tables, and files that are written only where they change."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from formulas import formulas

_CODE = re.compile(r"(``.*?``)")
_SPECIAL = re.compile(r"([\\*_|$<>\[\]`#~])")
_SIGN = re.compile(r" (?:=|<=|>=|<|>) |(?<=\w)=(?=\w)")
_PROSE = set(
    "a an and are as at be both but by for from has how if in is it its no not of on or so that the them these they this to which with"
    " without".split()
)
_SENTENCE = re.compile(r"^[A-Z][a-z]+ [a-z]|[a-z]\. [A-Z][a-z]+ ")
_WORD = re.compile(r"(?<!\S)[a-z]+(?![\w.(/])")
_MOST_PROSE, _SHORT = 4, 3
_FULL = 100
"""Characters from which a line of a formula goes on in the next one."""


def escaped(text: str) -> str:
    """Plain text with ``code`` as Markdown that looks the same."""
    parts = _CODE.split(text)
    return "".join(part[1:-1] if k % 2 else _SPECIAL.sub(r"\\\1", part) for k, part in enumerate(parts))


def docstring(text: str, names: Collection[str] = ()) -> str:
    """A docstring as Markdown: prose as prose; lines of formulas, and indented lines, typeset; ``names`` are those of variables."""
    shown: list[str] = []
    block: list[str] = []
    for number, line in enumerate(text.splitlines()):
        if line.startswith("  ") or (number > 0 and is_equation(line)):
            block.append(line)
        elif line and block and len(block[-1]) > _FULL and not block[-1].endswith((".", ",", ";", ":")):
            block[-1] += f" {line}"
        else:
            shown += [*_formulas(block, names), escaped(line)]
            block = []
    return "\n".join([*shown, *_formulas(block, names)])


def _formulas(lines: list[str], names: Collection[str]) -> list[str]:
    if lines and lines[0].lstrip().startswith(">>>"):
        return ["", "```python", *lines, "```", ""]
    return ["", "```{raw} html", formulas(lines, names), "```", ""] if lines else []


def is_equation(line: str) -> bool:
    """Whether a line of a docstring begins with a formula, and is not a sentence with one in it."""
    sign = _SIGN.search(line)
    if sign is None or _SENTENCE.search(line):
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
