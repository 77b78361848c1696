"""Numbers with their unit in a text: "1500 kg", "100 kW", "2000 rpm", "80 mph" become numbers in the unit that is asked for."""

from __future__ import annotations

import re
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ModelError, ParameterError
from powertrain.language.dimensions import exact

N = TypeVar("N", float, NDArray[np.float64])
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s+|(?=[^\d\s.]))(\S.*?)\s*$")
"""A number and a unit; a unit that begins with a digit, such as 1/s, needs the space."""
ZERO_CELSIUS = 273.15


def has_unit(text: str) -> bool:
    """Whether a text is a number followed by something, with or without a space between them: "100 kW", "100kW", but not "1e5"."""
    try:
        float(text)
    except ValueError:
        return _QUANTITY.match(text) is not None
    return False


def quantity(text: str, unit: str, where: str) -> float:
    """The number of a text such as "100 kW" in ``unit``.

    Errors: ParameterError where the text is not a number with a unit, or its unit measures something else.
    """
    found = _QUANTITY.match(text)
    if found is None:
        raise ParameterError(f"{where} = {text!r} is not a number with a unit, such as '1.5 {unit}'")
    number, given = float(found[1]), _plain(found[2])
    if given == "degC" and unit == "K":
        return number + ZERO_CELSIUS
    try:
        return converted(number, given, unit)
    except ModelError as error:
        raise ParameterError(f"{where} = {text!r}: {error}") from None


def _plain(unit: str) -> str:
    """A unit as it is usually typed, in Modelica's notation: N*m^2 as N.m2."""
    for typed, plain in ("**", ""), ("*", "."), ("·", "."), ("^", ""), ("²", "2"), ("³", "3"), ("°C", "degC"):
        unit = unit.replace(typed, plain)
    return unit


def converted(value: N, given: str, unit: str) -> N:
    """A value in the unit ``given`` as one in ``unit``. Errors: ModelError for unknown units and for units that measure something else."""
    (size, powers), (wanted, others) = exact(_plain(given)), exact(_plain(unit))
    if powers != others:
        raise ModelError(f"{given} cannot be converted to {unit}: it is a different quantity")
    return value * (size / wanted)
