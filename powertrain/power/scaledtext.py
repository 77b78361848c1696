"""A text that scales with the axes: in small axes it is small, instead of lying over its neighbours."""

from __future__ import annotations

from typing import Any

from matplotlib.patheffects import withStroke
from matplotlib.text import Text


class ScaledText(Text):
    """A text of a height in units of the y axis, with a light outline that keeps it readable on lines."""

    def __init__(self, x: float, y: float, text: str, height: float, **options: Any) -> None:
        super().__init__(x, y, text, **options)
        self.height = height

    def _fit(self) -> None:
        (_, low), (_, high) = self.axes.transData.transform([(0, 0), (0, self.height)])
        points = abs(high - low) * 72 / self.get_figure(root=True).dpi
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
