"""Figures of the reproduced papers: panels, and figures that the components already draw. matplotlib is imported when one is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def panels(
    titles: Sequence[str], columns: int = 2, width: float = 5.2, height: float = 3.0
) -> tuple[Figure, list[Axes]]:
    """A figure with an Axes for each title."""
    import matplotlib.pyplot as plt

    rows = -(-len(titles) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(width * columns, height * rows), layout="constrained", squeeze=False
    )
    for k, ax in enumerate(axes.flat):
        if k < len(titles):
            ax.set_title(titles[k], fontsize=10)
        else:
            ax.set_axis_off()
    return figure, list(axes.flat)


def drawn(
    package: str, name: str, size: tuple[float, float] = (7.5, 4.5), projection: str | None = None, **options: float
) -> Figure:
    """The figure ``name`` of a package of components, such as ``drawn("gearless.linkage", "motion")``; ``projection``: "3d" for some."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=size, layout="constrained")
    ax = figure.add_subplot(projection=projection)
    getattr(import_module(f"powertrain.components.{package}.figures"), name)(ax=ax, **options)
    return figure
