"""Units as texts in Modelica's notation: ``kg.m2``, ``N.m/rad``, ``rad/s``, ``1``."""

from __future__ import annotations

import re
from collections.abc import Iterable

from powertrain.errors import ModelError

BASE = frozenset(
    "1 m s kg g A K mol cd rad deg N Pa J W V C F H Ohm Hz degC bar l h min rpm kW kJ MJ kWh km mm cm t MPa GPa".split()
)
_SECONDS = re.compile(r"s(\d*)$")
_FACTOR = re.compile(r"([A-Za-z]+|1)(-?\d+)?$")


def with_unit(value: str, unit: str) -> str:
    """A value as a text with its unit; a pure number stands alone.

    >>> with_unit("0.3", "m"), with_unit("0.95", "1")
    ('0.3 m', '0.95')
    """
    return value if unit == "1" else f"{value} {unit}"


def told_apart(value: float, others: Iterable[float]) -> str:
    """A number with six digits, or with all where six make it look like one of ``others``.

    >>> told_apart(0.3, [1.0]), told_apart(1 + 1e-9, [0.0, 1.0])
    ('0.3', '1.000000001')
    """
    short = f"{value:g}"
    return repr(float(value)) if short in {f"{other:g}" for other in others if other != value} else short


def checked_unit(unit: str) -> str:
    """``unit`` itself where it is a product or quotient of known units, else ModelError."""
    if not isinstance(unit, str):
        raise ModelError(f"{unit!r} is not a unit; write it as a string (kg.m2, N.m/rad, rad/s, 1)")
    for part in unit.replace("(", "").replace(")", "").replace("/", ".").split("."):
        match = _FACTOR.match(part)
        if match is None or match.group(1) not in BASE:
            whole = "" if part == unit else f" in {unit!r}"
            raise ModelError(f"unknown unit {part!r}{whole} (units are written as kg.m2, N.m/rad, rad/s, 1)")
    return unit


def rate_unit(unit: str, order: int = 1) -> str:
    """The unit of a derivative by time.

    >>> rate_unit("rad"), rate_unit("rad", 2), rate_unit("m/s"), rate_unit("N.m/rad")
    ('rad/s', 'rad/s2', 'm/s2', 'N.m/(rad.s)')
    """
    if order == 0:
        return unit
    above, _, below = unit.partition("/")
    seconds = _SECONDS.match(below)
    if not below or seconds:
        power = order + (int(seconds[1] or 1) if seconds else 0)
        return f"{above}/s{power if power > 1 else ''}"
    return f"{above}/({below.strip('()')}.s{order if order > 1 else ''})"
