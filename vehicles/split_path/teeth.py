"""Tooth numbers for a wanted basic ratio."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential, Planets, Ring, Sun

if TYPE_CHECKING:
    import pandas as pd


def sets_near(
    R_o: float, *, tolerance: float = 0.01, suns: Iterable[int] = range(18, 100), planets: int = 3
) -> pd.DataFrame:
    """Simple planetary sets that can be put together with about this R_o < 0: columns sun, planet, ring, R_o and member a, nearest first.

    Where ring - sun is odd, profile shift makes up for half a tooth. The sun is member a where R_o < -1, the ring where R_o > -1.
    """
    import pandas as pd

    if R_o >= 0:
        raise pt.ParameterError(f"R_o = {R_o:g}: a simple planetary set has a negative basic ratio")
    a = "sun" if R_o < -1 else "ring"
    size = -R_o if a == "sun" else -1 / R_o
    rows = []
    for sun in suns:
        for ring in range(int(sun * size * (1 - tolerance)), int(sun * size * (1 + tolerance)) + 2):
            planet = (ring - sun) // 2
            wheels = (Sun(sun), Ring(ring)) if a == "sun" else (Ring(ring), Sun(sun))
            try:
                ratio = float(
                    FundamentalDifferential.from_teeth(wheels[0], wheels[1], Planets(planet, n=planets)).ratio
                )
            except pt.ParameterError:
                continue
            if abs(ratio / R_o - 1) <= tolerance:
                rows.append({"sun": sun, "planet": planet, "ring": ring, "R_o": ratio, "a": a})
    table = pd.DataFrame(rows, columns=["sun", "planet", "ring", "R_o", "a"])
    distance = (table.R_o - R_o).abs().round(9)
    return (
        table.assign(distance=distance).sort_values(["distance", "sun"]).drop(columns="distance").reset_index(drop=True)
    )
