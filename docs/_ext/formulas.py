"""Formulas of docstrings, typeset: subscripts, powers, Greek letters and derivatives from plain text such as ``tau = J der(w_rel)^2/2``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from html import escape

GREEK: dict[str, str] = dict(
    zip(
        "alpha beta gamma delta epsilon eta theta kappa lambda mu nu pi rho sigma tau phi psi omega".split(),
        "αβγδεηθκλμνπρστφψω",
        strict=True,
    )
)
SIGNS = {"<=": "≤", ">=": "≥", "+-": "±", "->": "→", "-": "−", "*": "·", "'": "′", "inf": "∞"}
_TOKEN = re.compile(r'``.*?``|"[^"]*"|\d+(?:\.\d+)?(?:e-?\d+)?|[A-Za-z]\w*(?:\.[A-Za-z]\w*)*|<=|>=|\+-|->|\.\.+|\s+|.')
_BETWEEN = re.compile(r"(?<=[,;.:])\s{2,}|\s{3,}")
_HYPHEN = re.compile(r"(?<=[a-z])-(?=[a-z])")
_NAME = re.compile(r"[A-Za-z]\w*(?:\.[A-Za-z]\w*)*")
_LETTER = re.compile(rf"({'|'.join(GREEK)}|[A-Za-z])(\d+|_\w+)?")
_DOT = "\N{COMBINING DOT ABOVE}"


def formulas(lines: Iterable[str], names: Collection[str] = ()) -> str:
    """Lines of formulas as HTML. Two spaces part the statements of a line; ``names`` are those of variables that look like words."""
    shown = []
    for line in lines:
        statements = "".join(
            f'<span class="statement">{typeset(statement, names)}</span> ' for statement in _BETWEEN.split(line.strip())
        )
        shown.append(f"<p>{statements.strip()}</p>")
    return '<div class="formulas">\n' + "\n".join(shown) + "\n</div>"


def typeset(text: str, names: Collection[str] = ()) -> str:
    """One statement as HTML."""
    tokens = _TOKEN.findall(_HYPHEN.sub("\N{HYPHEN}", text))
    return "".join(_parts(tokens, names))


def _parts(tokens: list[str], names: Collection[str]) -> list[str]:
    parts: list[str] = []
    k = 0
    while k < len(tokens):
        token = tokens[k]
        if token == "der" and tokens[k + 1 : k + 2] == ["("]:
            end = _closing(tokens, k + 1)
            parts.append(_derivative(tokens[k + 2 : end], names))
            k = end
        elif token == "^":
            end = _closing(tokens, k + 1) if tokens[k + 1] == "(" else k + 1
            raised = tokens[k + 2 : end] if end > k + 1 else tokens[k + 1 : k + 2]
            parts.append(f"<sup>{''.join(_parts(raised, names))}</sup>")
            k = end
        else:
            parts.append(_one(token, names))
        k += 1
    return parts


def _closing(tokens: list[str], opening: int) -> int:
    depth = 0
    for k in range(opening, len(tokens)):
        depth += {"(": 1, ")": -1}.get(tokens[k], 0)
        if not depth:
            return k
    return len(tokens)


def _derivative(inside: list[str], names: Collection[str]) -> str:
    if len(inside) == 1 and _NAME.fullmatch(inside[0]):
        return _symbol(inside[0], _DOT) or f"d{_one(inside[0], names)}/d<i>t</i>"
    return f"d({''.join(_parts(inside, names))})/d<i>t</i>"


def _one(token: str, names: Collection[str]) -> str:
    if token.startswith("``"):
        return f"<code>{escape(token[2:-2])}</code>"
    if token in SIGNS:
        return SIGNS[token]
    if _NAME.fullmatch(token):
        return _symbol(token) or (f"<i>{token}</i>" if token in names else token)
    return escape(token)


def _symbol(name: str, accent: str = "") -> str:
    """A letter, Latin or Greek, with its subscript, behind the port to which it belongs; empty for a word."""
    owner, dot, last = name.rpartition(".")
    found = _LETTER.fullmatch(last)
    if found is None:
        return ""
    letter, below = found.groups()
    sub = f"<sub>{below.lstrip('_').replace('_', ',')}</sub>" if below else ""
    return f"{owner}{dot}<i>{GREEK.get(letter, letter)}{accent}</i>{sub}"
