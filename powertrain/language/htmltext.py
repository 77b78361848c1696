"""Short HTML for notebooks: tables, and a curve as a small picture."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

WIDE, HIGH = 360, 70
"""Size of a curve in pixels."""
POINTS = 400
"""Corners of a drawn curve at most: more of them are thinned by their extremes."""


def heading(kind: str, text: str) -> str:
    """A line with the kind of a thing in bold and what it is."""
    return f"<p><b>{html.escape(kind)}</b> {html.escape(text)}</p>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain texts."""
    top = "".join(f'<th style="text-align:left">{html.escape(cell)}</th>' for cell in head)
    lines = ("".join(f'<td style="text-align:left">{html.escape(cell)}</td>' for cell in row) for row in rows)
    return f"<table><tr>{top}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def folded(title: str, content: str) -> str:
    """Content that a click opens."""
    return f"<details><summary>{html.escape(title)}</summary>{content}</details>"


def curve(x: Sequence[float], y: Sequence[float]) -> str:
    """A curve without axes, in the colour of the text; large ones are drawn by the extremes of their stretches."""
    step = max(1, 2 * len(x) // POINTS)
    kept = sorted({k for i in range(0, len(x), step) for k in _extremes(y, i, min(i + step, len(x)))} | {0, len(x) - 1})
    low, high = min(y), max(y)
    width, height = (x[-1] - x[0]) or 1.0, (high - low) or 1.0
    corners = " ".join(f"{WIDE * (x[k] - x[0]) / width:.1f},{HIGH * (1 - (y[k] - low) / height):.1f}" for k in kept)
    return (
        f'<svg width="{WIDE}" height="{HIGH + 4}" viewBox="0 -2 {WIDE} {HIGH + 4}" role="img">'
        f'<polyline points="{corners}" fill="none" stroke="currentColor" stroke-width="1.2"/></svg>'
    )


def _extremes(y: Sequence[float], start: int, stop: int) -> tuple[int, int]:
    stretch = range(start, stop)
    return min(stretch, key=y.__getitem__), max(stretch, key=y.__getitem__)
