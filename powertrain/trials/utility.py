"""Utility factors: what plug-in hybrids consume in the fleet, from their charge-depleting and charge-sustaining tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

import powertrain as pt
from powertrain.components.common_units import MILE
from powertrain.language.arguments import number, of_kind, positive
from powertrain.trials.charge import BREAK_OFF, ChargeSustaining

_USED = {"distance", "from the battery", "consumption", "carbon dioxide", "relative change"}


@pt.arguments_checked
@dataclass(frozen=True)
class UtilityFactor:
    """Share of all driving that happens within a distance d [km] of the last charge, with one charge a day [1].

      UF(d) = 1 - exp(-sum_i C_i (d/d_n)^i),  i = 1, 2, ...

    A fit to a survey of daily distances D: E[min(D, d)]/E[D] over all days of a fleet, or the mean of this ratio over its cars.
    ``coefficients`` are the C_i [1], ``normalized`` is d_n [km]. Another d_n: ``dataclasses.replace(WLTP_FACTOR, normalized=...)``.
    Errors: ParameterError for a d_n that is not above 0, and without coefficients.
    """

    coefficients: tuple[float, ...]
    normalized: float

    def __post_init__(self) -> None:
        positive("normalized", self.normalized)
        if len(self.coefficients) == 0:
            raise pt.ParameterError("UtilityFactor.coefficients is empty; give at least one coefficient")
        for i, value in enumerate(self.coefficients, 1):
            number(f"coefficient {i} of the utility factor", value)

    def __call__(self, distance: float) -> float:
        """UF at a distance [km]. Errors: ParameterError for a distance that is not finite or below 0, and for a share below 0 there."""
        distance = number("distance", distance, "km")
        if distance < 0.0:
            raise pt.ParameterError(f"utility factor: the distance must be 0 or more; it is {distance:g} km")
        exponent = float(np.polyval([*reversed(self.coefficients), 0.0], distance / self.normalized))
        if exponent < 0.0:
            raise pt.ParameterError(f"utility factor: the coefficients give a share below 0 at {distance:g} km")
        return 1.0 - float(np.exp(-exponent))


WLTP_FACTOR = UtilityFactor(
    (26.25, -38.94, -631.05, 5964.83, -25095.0, 60380.2, -87517.0, 75513.8, -35749.0, 7154.94), 800.0
)
"""Regulation (EU) 2017/1151, Annex XXI, Sub-Annex 8, Appendix 5, Table A8.App5/1."""
FLEET_FACTOR = UtilityFactor((10.52, -7.282, -26.37, 79.08, -77.36, 26.07), 399.0 * MILE / 1e3)
"""Fleet utility factor of SAE J2841 (September 2010), Table 2, as in the EPA's OMEGA model (``FUF``): every mile counts alike."""
INDIVIDUAL_FACTOR = UtilityFactor((13.1, -18.7, 5.22, 8.15, 3.53, -1.34, -4.01, -3.90, -1.15, 3.88), 400.0 * MILE / 1e3)
"""Multi-day individual utility factor of SAE J2841 (September 2010), Table 2, as in the EPA's OMEGA model (``labelUF``).

Every car counts alike, however far it is driven."""


def utility_weighted(
    depleting: pd.DataFrame, sustaining: ChargeSustaining, factor: UtilityFactor = WLTP_FACTOR
) -> pd.Series[float]:
    """Mean consumption of a plug-in hybrid between charges, from its charge-depleting and charge-sustaining tests.

    The cycles of the charge-depleting test, except the last, which only confirms that the battery is empty, count by the utility factor
    over their own distance. What is driven beyond counts as charge-sustaining:
      C = sum_j (UF(d_j) - UF(d_j-1)) C_CD,j + (1 - UF(d_n)) C_CS

    Parameters
    ----------
    depleting : pandas.DataFrame
        Result of ``charge_depleting``; begin with a full battery.
    sustaining : ChargeSustaining
        Result of ``charge_sustaining`` over the same cycle.
    factor : UtilityFactor
        ``WLTP_FACTOR``, ``FLEET_FACTOR``, ``INDIVIDUAL_FACTOR`` or one's own.

    Returns
    -------
    pandas.Series
        utility factor [1] at the charge-depleting cycle range, W.h/km from the battery, l/100 km, g/km CO2.

    Raises
    ------
    ParameterError
        If the charge-depleting test ended before the battery was empty, and for other tables, results and factors.

    Notes
    -----
    The regulation weights the phases of the cycle, this function whole cycles, as SAE J1711 does. Energy is taken from the battery; the
    regulation counts what the charger takes from the grid.
    """
    of_kind("utility_weighted", depleting, pd.DataFrame, "the table of charge_depleting()")
    of_kind("utility_weighted", sustaining, ChargeSustaining, "the result of charge_sustaining()")
    of_kind("utility_weighted", factor, UtilityFactor, "a UtilityFactor, such as WLTP_FACTOR")
    if depleting.empty or not _USED.issubset(depleting):
        found = f"{len(depleting)} rows and the columns {', '.join(map(str, depleting))}"
        raise pt.ParameterError(f"utility_weighted() takes the table of charge_depleting(), not one with {found}")
    if not (change := float(depleting["relative change"].iloc[-1])) < BREAK_OFF:
        raise pt.ParameterError(
            f"utility_weighted: the charge-depleting test ended after {depleting['distance'].iloc[-1]:.1f} km, before the battery was "
            f"empty: the charge still changed by {change:.0%} of the energy demand of the cycle; give charge_depleting a larger most"
        )
    driven = depleting.iloc[:-1]
    factors = np.array([0.0, *(factor(float(d)) for d in driven["distance"])])
    shares, left = np.diff(factors), 1.0 - factors[-1]
    beyond = {
        "from the battery": 0.0,
        "consumption": sustaining.litres_per_100km,
        "carbon dioxide": sustaining.co2_per_km,
    }
    weighted = {name: float(shares @ driven[name].to_numpy(float)) + left * value for name, value in beyond.items()}
    return pd.Series({"utility factor": float(factors[-1]), **weighted})
