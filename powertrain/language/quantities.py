"""Numbers with their unit in a text: "1500 kg", "100 kW", "2000 rpm", "80 mph" become numbers in the unit that is asked for."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ModelError, ParameterError
from powertrain.language.dimensions import exact
from powertrain.language.units import factors, in_notation

N = TypeVar("N", float, NDArray[np.float64])
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s+|(?=[^\d\s.]))(\S.*?)\s*$")
"""A number and a unit; a unit that begins with a digit, such as 1/s, needs the space."""
_ROTATIONS = {"Hz", "rpm"}
_ANGLES = {"rad", "deg", *_ROTATIONS}
_SCALES = {"K": (1.0, 0.0), "degC": (1.0, 273.15), "degF": (1 / 1.8, 459.67 / 1.8)}
"""Scales of temperature: the size of a degree and the temperature at zero, in K."""
_DEGREES = {"C": "degC", "F": "degF"}
"""What is a coulomb or a farad elsewhere is a degree where a temperature is asked for."""


def is_number(text: str) -> bool:
    """Whether a text is a number without a unit."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def has_unit(text: str) -> bool:
    """Whether a text is a number followed by something, with or without a space between them: "100 kW", "100kW", but not "1e5"."""
    return not is_number(text) and _QUANTITY.match(text) is not None


def quantity(text: str, unit: str, where: str) -> float:
    """The number of a text such as "100 kW" in ``unit``.

    Errors: ParameterError where the text is not a number with a unit, or its unit measures something else.
    """
    found = _QUANTITY.match(text)
    if found is None:
        raise ParameterError(f"{where} = {text!r} is not a number with a unit, such as '1.5 {unit}'")
    if found[2].startswith(","):
        raise ParameterError(
            f"{where} = {text!r} has a comma; write decimals with a point, and thousands without a mark"
        )
    try:
        return converted(float(found[1]), found[2], unit)
    except ModelError as error:
        raise ParameterError(f"{where} = {text!r}: {error}") from None


def counts_rotations(unit: str) -> bool:
    """Whether a unit stands for rotations per minute where a speed is meant: rpm in any spelling, and 1/min."""
    return in_notation(unit) in ("rpm", "1/min", "min-1")


def converted(value: N, given: str, unit: str) -> N:
    """A value in the unit ``given`` as one in ``unit``; 1/min of an angular speed are rotations, as rpm. K, degC and degF are temperatures.

    Errors: ModelError for unknown units, for units that measure something else, and for 1/s of an angular speed, which may mean rad/s
    or Hz.
    """
    plain, asked = in_notation(given), in_notation(unit)
    if asked in _SCALES:
        plain = _DEGREES.get(plain, plain)
    if plain in _SCALES and asked in _SCALES:
        (degree, zero), (other, start) = _SCALES[plain], _SCALES[asked]
        return value * (degree / other) + (zero - start) / other
    (size, powers), (wanted, others) = exact(plain), exact(asked)
    if powers != others:
        raise ModelError(f"{given} cannot be converted to {unit}: it is a different quantity")
    turns = _turns(plain, asked)
    if turns is None:
        bare = unit if _power(plain, _ANGLES) else given
        raise ModelError(f"{bare} may count radians or rotations; write rad/s or Hz")
    return value * (size / wanted * (2 * math.pi) ** turns)


def _turns(given: str, unit: str) -> int | None:
    """The power of rotations (2 pi rad) that a unit without an angle stands for where the other has one; None where that is ambiguous.

    1/min counts rotations, also within N.m.min for N.m.s/rad. Hz and rpm count what a rate without an angle counts. N.m is N.m/rad.
    """
    lacking = _power(unit, _ANGLES) - _power(given, _ANGLES)
    if lacking == 0 or lacking in (_power(unit, {"min"}), -_power(given, {"min"})):
        return lacking
    if {base for base, _ in exact(unit)[1]} != {"s"}:
        return 0
    return lacking if _power(unit, _ROTATIONS) or _power(given, _ROTATIONS) else None


def _power(unit: str, names: Collection[str]) -> int:
    """The sum of the powers of some names in a unit."""
    return sum(power for name, power in factors(unit) if name in names)
