"""Friction between parts that others tie to each other, as a locked clutch between two axles that roll on one road without slip.

Its torque acts on no motion, G_ii = 0, so nothing determines it while the law is stuck. With the compliance of stuck laws it is zero.
(See ``powertrain.modes.complementarity`` for G.)
"""

from __future__ import annotations

import numpy as np

from powertrain.dae.hybrid import OperatingPoint
from powertrain.modes.complementarity import Laws
from powertrain.modes.resting import SINGULAR


def tied_notes(laws: Laws, point: OperatingPoint) -> tuple[str, ...]:
    """A note on each such law at this point."""
    near = laws.at(point, np.zeros(laws.count))
    still = np.abs(np.diag(near.rate_slope)) <= SINGULAR * near.reach
    return tuple(
        f"{law.name} ({law.where}): other parts tie what it connects, so nothing determines its torque while it is stuck: "
        "it may lie anywhere between its limits"
        for law, moves_nothing in zip(laws.dae.frictions, still[: laws.frictions].tolist(), strict=True)
        if moves_nothing and not law.prescribed
    )
