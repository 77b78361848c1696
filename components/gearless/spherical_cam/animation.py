"""The spherical cam differential in motion."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation

from powertrain.components.gearless.spherical_cam.figures import CAM, mechanism
from powertrain.components.gearless.spherical_cam.profile import SphericalCam


def animation(cam: SphericalCam = CAM, *, frames: int = 60) -> FuncAnimation:
    """One stroke of the cams, 2 pi/N of a side wheel against the cage, after which it repeats; see ``mechanism``."""
    figure = plt.figure(layout="constrained")
    solid = figure.add_subplot(projection="3d")

    def frame(i: int) -> Iterable[Any]:
        solid.clear()
        mechanism(cam, 2 * math.pi / cam.N * i / frames, solid)
        return list(solid.lines)

    return FuncAnimation(figure, frame, frames=frames, interval=60)
