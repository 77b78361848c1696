"""The linkage in motion."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from numpy import pi

from powertrain.components.gearless.linkage.figures import mechanism
from powertrain.components.gearless.linkage.kinematics import Linkage


def animate(
    linkage: Linkage | None = None, *, turns: float = 0.0, frames: int = 120, ax: Axes | None = None
) -> FuncAnimation:
    """Animate one internal cycle of the mechanism, during which the cage makes ``turns`` revolutions.

    ``turns`` is 10 in the bend of the source and 0 for a view from the cage. ``ax`` is a three-dimensional Axes. Save it with
    ``animate().save("linkage.gif", writer="pillow")``.
    """
    if ax is None:
        ax = plt.figure(layout="constrained").add_subplot(projection="3d", proj_type="ortho")

    def frame(i: int) -> Iterable[Any]:
        ax.clear()
        alpha = 2 * pi * i / frames
        mechanism(linkage, alpha, turns * alpha, ax)
        return ax.lines

    figure = ax.get_figure(root=True)
    assert figure is not None
    return FuncAnimation(figure, frame, frames=frames, interval=50)
