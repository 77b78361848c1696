"""Texts and legends that scale with the axes: in small axes they are small, instead of lying over their neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.textpath import TextPath


class ScaledText(Text):
    """A text of a height in units of the y axis, with a light outline that keeps it readable on lines."""

    def __init__(self, x: float, y: float, text: str, height: float, **options: Any) -> None:
        super().__init__(x, y, text, **options)
        self.height = height

    def _fit(self) -> None:
        axes, figure = self.axes, self.get_figure(root=True)
        if axes is None or figure is None:
            return
        (_, low), (_, high) = axes.transData.transform([(0, 0), (0, self.height)])
        points = abs(high - low) * 72 / figure.dpi
        self.set_fontsize(points)
        self.set_path_effects([withStroke(linewidth=0.15 * points, foreground="white", alpha=0.5)])

    def get_window_extent(self, *args: Any, **options: Any) -> Any:
        """Its size at the present scale."""
        self._fit()
        return super().get_window_extent(*args, **options)

    def draw(self, renderer: Any) -> None:
        """Draw it at the present scale."""
        self._fit()
        super().draw(renderer)


def write(ax: Axes, x: float, y: float, text: str, height: float, **options: Any) -> None:
    """A text of a height in units of the y axis."""
    ax.add_artist(ScaledText(x, y, text, height, clip_on=False, **options))


def width(text: str) -> float:
    """Width of the longest line of a text over its font size."""
    return max(float(TextPath((0, 0), line or " ", size=1).get_extents().x1) for line in text.split("\n"))


def legend(
    ax: Axes, entries: Sequence[tuple[str, str]], place: tuple[float, float], right: float, height: float
) -> None:
    """Texts, each beside its colour, from ``place`` on in as many rows as the room up to ``right`` requires."""
    x, y = place
    for text, colour in entries:
        size = 0.6 + height * width(text)
        if x > place[0] and x + size > right:
            x, y = place[0], y - 2 * height
        ax.add_patch(Rectangle((x, y - height / 2), 0.45, height, color=colour, linewidth=0))
        write(ax, x + 0.6, y, text, height, va="center")
        x += size + 0.5
    ax.update_datalim([(place[0], y - height)])
