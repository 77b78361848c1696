"""The rolling radius of a tyre from its size."""

from __future__ import annotations

import math
import re

from powertrain import ParameterError

INCH = 0.0254
ROLLING = 3.05
"""Distance rolled in one revolution over the overall diameter of a radial tyre, at its rated load and 60 km/h.

Source: ETRTO Standards Manual; CO2MPAS of the European Commission uses it as well (``tyre_dynamic_rolling_coefficient``).
"""
_RADIAL = re.compile(
    r"\s*(?:P|LT)?\s*(\d{3})\s*/\s*(\d\d)\s*-?Z?RF?\s*-?(\d\d(?:\.5)?)\s*(?:C|LT)?(?:\s.*)?", re.IGNORECASE
)
"""Width [mm]/height over width [%] R rim [in], then the load index and others."""
HEIGHTS, RIMS = (20.0, 100.0), (8.0, 30.0)
"""Heights over widths [%] and rim diameters [in] of tyres of road vehicles; other numbers are mostly in another order."""
_TYRE = re.compile(r"\s*\D{0,2}\s*\d{3}\s*/\s*\d\d|\s*\d\d\s*[xX]\s*\d|.*\d\s*Z?[RD]\s*\d\d", re.IGNORECASE)
"""Texts that are meant as a tyre size, also wrong ones."""


def rolling_radius(size: str, where: str = "tyre size") -> float:
    """The rolling radius [m] of a radial tyre: 0.307 for "205/55R16", "205/55 R16 91V" or "P205/55R16".

    r = 3.05/(2 pi) d,  d = rim diameter + 2 width height/100

    A loaded tyre rolls 3 % less far than its unloaded circumference. Tyres of one size differ; a measured radius is better.
    ``where`` names the value in errors. Errors: ParameterError for a text that is not the size of a radial tyre,
    and for heights and rims that no tyre has.
    """
    found = _RADIAL.fullmatch(size) if isinstance(size, str) else None
    if found is None:
        raise ParameterError(
            f"{where} = {size!r} is not the size of a radial tyre, such as '205/55R16'; give the rolling radius with its unit, such as "
            "'0.307 m'"
        )
    width, height, rim = (float(number) for number in found.groups())
    if not (HEIGHTS[0] <= height <= HEIGHTS[1] and RIMS[0] <= rim <= RIMS[1]):
        raise ParameterError(
            f"{where} = {size!r} has a height of {height:g} % of the width and a rim of {rim:g} in; tyres have {HEIGHTS[0]:g} to "
            f"{HEIGHTS[1]:g} % and {RIMS[0]:g} to {RIMS[1]:g} in, in the order width/height R rim, such as '205/55R16'"
        )
    return ROLLING / (2 * math.pi) * (rim * INCH + 2e-3 * width * height / 100)


def radius_of(text: str, where: str) -> float | None:
    """``rolling_radius`` of a tyre size; None for other texts."""
    return rolling_radius(text, where) if _TYRE.match(text) else None
