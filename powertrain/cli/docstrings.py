"""What is prose and what is a formula in a docstring: for the terminal and for the pages of the documentation."""

from __future__ import annotations

import re
from collections.abc import Iterator

_SIGN = re.compile(r" (?:=|<=|>=|<|>) |(?<=\w)=(?=\w)")
_PROSE = set(
    "a an and are as at be both but by for from has how if in is it its no not of on or so that the them these they this to which with"
    " without".split()
)
_SENTENCE = re.compile(r"^[A-Z][a-z]+ (?!der\()[a-z]|[a-z]\. [A-Z][a-z]+ ")
_WORD = re.compile(r"(?<!\S)[a-z]+(?![\w.(/])")
_MOST_PROSE, _SHORT = 4, 3
_FULL = 100
"""Characters from which a line of a formula goes on in the next one."""


def blocks(text: str) -> Iterator[tuple[bool, list[str]]]:
    """The paragraphs of a docstring, each with whether its lines are kept as they are: formulas, indented lines, examples (``>>>``)."""
    block: list[str] = []
    formulas = False
    for number, line in enumerate(text.splitlines()):
        example = line.startswith(">>>") or bool(line and block and block[0].startswith(">>>"))
        formula = example or line.startswith("  ") or (number > 0 and is_equation(line))
        if (
            line
            and not formula
            and formulas
            and len(block[-1]) > _FULL
            and not block[-1].endswith((".", ",", ";", ":"))
        ):
            block[-1] += f" {line}"
            continue
        if block and (not line or formula is not formulas):
            yield formulas, block
            block = []
        if line:
            block, formulas = [*block, line], formula
        else:
            formulas = False
    if block:
        yield formulas, block


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
