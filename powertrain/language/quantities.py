"""Numbers with their unit in a text: "1500 kg", "100 kW", "2000 rpm", "80 mph" become numbers in the unit that is asked for."""

from __future__ import annotations

import re
from collections import Counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.language.dimensions import Measure, measure
from powertrain.language.units import BASE, checked_unit

N = TypeVar("N", float, NDArray[np.float64])
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s+|(?=[^\d\s.]))(\S.*?)\s*$")
"""A number and a unit; a unit that begins with a digit, such as 1/s, needs the space."""
_COMMON = {
    "Nm": (1.0, "N.m"), "hp": (745.6998715822702, "W"), "PS": (735.49875, "W"), "mph": (0.44704, "m/s"), "kph": (1 / 3.6, "m/s"),
    "mi": (1609.344, "m"), "ft": (0.3048, "m"), "in": (0.0254, "m"), "lb": (0.45359237, "kg"), "lbf": (4.4482216152605, "N"),
    "lbf.ft": (1.3558179483314004, "N.m"), "psi": (6894.757293168361, "Pa"), "Ah": (3600.0, "A.s"), "%": (0.01, "1"),
    "g/kWh": (1e-3 / 3.6e6, "kg/J"), "gal": (3.785411784e-3, "m3"), "kN": (1e3, "N"), "kNm": (1e3, "N.m"), "mOhm": (1e-3, "Ohm"),
    "ms": (1e-3, "s"), "MW": (1e6, "W"), "kPa": (1e3, "Pa"), "kV": (1e3, "V"),
}  # fmt: skip
"""Units of every day beside Modelica's: size in a unit that ``measure`` knows."""
_NAME, _PART = re.compile(r"[A-Za-z]+"), re.compile(r"([A-Za-z]+|1)(-?\d+)?")
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
    number, given = (
        float(found[1]),
        found[2].replace("**", "").replace("*", ".").replace("·", ".").replace("^", "").replace("°C", "degC"),
    )
    if given == "degC" and unit == "K":
        return number + ZERO_CELSIUS
    try:
        _measured(given)
    except ModelError as error:
        raise ParameterError(f"{where} = {text!r}: {error}{suggestion(given, [*_COMMON, *BASE])}") from None
    try:
        return converted(number, given, unit)
    except ModelError as error:
        raise ParameterError(f"{where} = {text!r}: {error}") from None


def converted(value: N, given: str, unit: str) -> N:
    """A value in the unit ``given`` as one in ``unit``. Errors: ModelError for unknown units and for units that measure something else."""
    (size, powers), (wanted, others) = _measured(given), _measured(unit)
    if powers != others:
        raise ModelError(f"{given} cannot be converted to {unit}: it is a different quantity")
    return value * (size / wanted)


def _measured(unit: str) -> Measure:
    """The size of a unit in SI units and the powers of these; units of every day may be parts of others: lbf/mph2."""
    if unit in _COMMON:
        factor, plain = _COMMON[unit]
        size, powers = measure(plain)
        return factor * size, powers
    if not any(name in _COMMON for name in _NAME.findall(unit)):
        return measure(checked_unit(unit))
    size, sums = 1.0, Counter[str]()
    above, _, below = unit.partition("/")
    for text, sign in (above, 1), (below, -1):
        for part in text.strip("()").split(".") if text else ():
            found = _PART.fullmatch(part)
            if found is None:
                raise ModelError(f"unknown unit {part!r} in {unit!r}")
            one, inside = _measured(found[1])
            power = sign * int(found[2] or 1)
            size *= one**power
            sums.update({base: power * exponent for base, exponent in inside})
    return size, tuple(sorted((base, power) for base, power in sums.items() if power))
