"""Gears that are not engaged: a synchroniser that slides although its gear is selected."""

from __future__ import annotations

from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.transmissions import DualClutchGearbox, ManualGearbox
from powertrain.language.component import children

LASTING = 1.0
"""Time [s] for which a synchroniser must slide in a selected gear to count as not engaged."""
SLIDES = 0.1
"""Speed difference [rad/s] above which a synchroniser slides."""


def lost_gear(result: pt.Result[Any]) -> str:
    """The message for a run in which a selected gear was not engaged for more than a second; else empty."""
    for name, box in children(result.model):
        if not isinstance(box, (ManualGearbox, DualClutchGearbox)):
            continue
        time, lever = result.time, result[f"{name}.lever"]
        for k in range(1, box.gear_count + 1):
            path = f"{name}.synchronisers[{k - 1}]"
            sliding = (np.abs(lever - k) < 1e-9) & (result[f"{path}.mode"] != 0.0)
            if sliding.any():
                sliding &= np.abs(result[f"{path}.w_rel"]) > SLIDES
            edges = np.flatnonzero(np.diff(np.concatenate([[0], sliding.astype(int), [0]])))
            for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
                if time[last] - time[first] > LASTING:
                    return (
                        f"gear {k} is not engaged: from t = {time[first]:.4g} s to {time[last]:.4g} s {path} slides: the clutch closed "
                        f"before it was done, or transmits more than its dogs hold. Give it more torque ({path}.fn_max; times peak for the "
                        f"dogs), the shift more time (t_lever of the schedule), or the shaft before it less inertia ({name}.input.J)"
                    )
    return ""
