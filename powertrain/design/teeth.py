"""Tooth numbers for a required basic ratio."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.differentials import FundamentalDifferential, Pairs, Planets, Ring, Sun
from powertrain.language.arguments import count, number

Teeth = NDArray[np.intp]

if TYPE_CHECKING:
    import pandas as pd


def sets_near(
    R_o: float, *, tolerance: float = 0.01, suns: int | Iterable[int] = range(18, 100), planets: int = 3
) -> pd.DataFrame:
    """Planetary gear sets that can be assembled with approximately this R_o, the nearest first.

    Parameters
    ----------
    R_o : float
        Basic ratio [1].
    tolerance : float
        Allowed relative deviation [1].
    suns : int or iterable of int
        Teeth of the sun, one number or several; for R_o > 0, teeth of member a, and of the planet of a KHV.
    planets : int
        Number of planets.

    Returns
    -------
    pandas.DataFrame
        For R_o < 0, simple sets (2K-H(-)): columns sun, planet, ring, R_o and member a. If ring - sun is odd, profile shift compensates
        half a tooth. The sun is member a for R_o < -1, the ring for R_o > -1.

        For R_o > 0 (2K-H(+) and KHV): columns kind, a, b, first, second, R_o. "two suns", "two rings": stepped planets with the same
        module, ``first`` meshes with a and ``second`` with b; "pairs": a sun a and a ring b with pairs of planets, ``first`` at the sun;
        "KHV": a planet with ``a`` teeth in a ring with ``b``. Only the nearest 300 sets are listed.

    Raises
    ------
    ParameterError
        For a ratio that no gear set has (0, 1), and for arguments that are not numbers of their kind.
    """
    import pandas as pd

    R_o, tolerance, planets = number("R_o", R_o), number("tolerance", tolerance), count("planets", planets)
    if not 0 < tolerance < 1:
        raise pt.ParameterError(f"tolerance = {tolerance:g} must lie between 0 and 1, a relative deviation")
    candidates = [count("suns", sun) for sun in ([suns] if isinstance(suns, int) else suns)]
    if R_o in (0.0, 1.0):
        raise pt.ParameterError(f"R_o = {R_o:g}: no gear set has this basic ratio; two members would coincide")
    if R_o > 0:
        return _positive(R_o, tolerance, candidates, planets)
    a = "sun" if R_o < -1 else "ring"
    limits = sorted(x if a == "sun" else 1 / x for x in (-R_o * (1 - tolerance), -R_o * (1 + tolerance)))
    rows = []
    for sun in candidates:
        for ring in _between(sun, *limits):
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


_PLANETS = range(12, 61)
_MOST = 300
_COLUMNS = ["kind", "a", "b", "first", "second", "R_o"]


def _positive(R_o: float, tolerance: float, suns: list[int], n: int) -> pd.DataFrame:
    """Sets with R_o > 0, by increasing deviation of the ratio."""
    import pandas as pd

    wheels: dict[str, type[Sun] | type[Ring]] = {"two suns": Sun, "two rings": Ring}
    rows = []
    for kind, a, b, first, second, _ in _candidates(R_o, tolerance, suns, n):
        try:
            if kind == "KHV":
                made = FundamentalDifferential.khv(a, b)
            elif kind == "pairs":
                made = FundamentalDifferential.from_teeth(Sun(a), Ring(b), Pairs(first, second, n=n))
            else:
                wheel = wheels[kind]
                made = FundamentalDifferential.from_teeth(wheel(a), wheel(b), Planets(first, second, n=n))
        except pt.ParameterError:
            continue
        rows.append((kind, a, b, first, second, float(made.ratio)))
        if len(rows) == _MOST:
            break
    return pd.DataFrame(rows, columns=_COLUMNS)


def _between(teeth: int, low: float, high: float) -> range:
    """The wheels with low to high times as many teeth, and one more on either side against rounding."""
    return range(math.ceil(low * teeth) - 1, math.floor(high * teeth) + 2)


def _candidates(R_o: float, tolerance: float, suns: list[int], n: int) -> list[tuple[str, int, int, int, int, float]]:
    """Teeth with a ratio within the tolerance, the nearest first: (kind, a, b, first, second, ratio)."""
    found: list[tuple[str, int, int, int, int, float]] = []

    def keep(kind: str, a: Teeth, b: Teeth, first: Teeth, second: Teeth, ratio: NDArray[np.float64]) -> None:
        good = (np.abs(ratio / R_o - 1) <= tolerance) & (b >= min(_PLANETS)) & (ratio != 1.0)
        columns = [v[good].tolist() for v in (a, b, first, second, ratio)]
        found.extend((kind, *row) for row in zip(*columns, strict=True))

    a, first, second = (g.ravel() for g in np.meshgrid(suns, _PLANETS, _PLANETS, indexing="ij"))
    for kind, sign in (("two suns", 1), ("two rings", -1)):
        b = a + sign * (first - second)
        keep(kind, a, b, first, second, first * b / (a * second))
    if R_o > 1:
        low, high = R_o * (1 - tolerance), R_o * (1 + tolerance)
        a, b = np.array([(one, other) for one in suns for other in _between(one, low, high)], int).reshape(-1, 2).T
        keep("KHV", a, b, 0 * a, 0 * a, b / a)
        spaced = np.flatnonzero((b - a) % n == 0)  # n pairs at equal distances; the rest is checked later
        i, first, second = (g.ravel() for g in np.meshgrid(spaced, _PLANETS, _PLANETS, indexing="ij"))
        keep("pairs", a[i], b[i], first, second, b[i] / a[i])
    found.sort(key=lambda row: (round(abs(row[-1] - R_o), 9), row[1] + row[2]))
    return found
