"""Units as texts in Modelica's notation: ``kg.m2``, ``N.m/rad``, ``rad/s``, ``1``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from powertrain.errors import ModelError, suggestion

BASE = frozenset(
    "1 m s kg g A K mol cd rad deg N Pa J W V C F H Ohm Hz degC bar l h min rpm kW kJ MJ kWh km mm cm t MPa GPa".split()
)
_SECONDS = re.compile(r"s(\d*)$")
_FACTOR = re.compile(r"(?:(?P<name>[A-Za-z]+|1|%)|\((?P<inner>.+)\))(?P<power>-?\d+)?")
_RPM = {"rpm", "rev/min", "r/min", "u/min"}
"""Rotations per minute as they are typed, in small letters."""
_SPELLINGS = {
    **dict.fromkeys(("lbs", "lbm"), "lb"),
    "bhp": "hp",
    "kmh": "km/h",
    "n-m": "N.m",
    "celsius": "degC",
    "fahrenheit": "degF",
    **dict.fromkeys(("cc", "ccm"), "cm3"),
    **{
        mark.join(pair): "lbf.ft"
        for mark in (*".·⋅- ", "")
        for pair in (("lb", "ft"), ("ft", "lb"), ("lbs", "ft"), ("ft", "lbs"))
    },
    **{f"{one}-{other}": "lbf.ft" for one, other in (("lbf", "ft"), ("ft", "lbf"))},
}
"""Other units as users type them, in lower case; a torque in pounds and feet means pounds-force."""
_JOINED = re.compile(r"\b(kg|N)(mm|m)?(s)?(?![A-Za-z])")
"""Products that are often typed without a sign: kgm2, Nm, Nms."""
_SPACE = re.compile(r"(?<=\w)\s+(?=[A-Za-z(])")
"""A space that means a product, as in N m."""
_AROUND = re.compile(r"\s*([./])\s*")
"""A sign between units with the spaces around it, as in km / h."""
_SIGNS = (
    ("**", ""),
    ("*", "."),
    ("·", "."),
    ("⋅", "."),
    ("^", ""),
    ("²", "2"),
    ("³", "3"),
    ("⁻", "-"),
    ("¹", "1"),
    ("°C", "degC"),
    ("°F", "degF"),
    ("Ω", "Ohm"),
    ("Ω", "Ohm"),
)


def with_unit(value: str, unit: str) -> str:
    """A value as a text with its unit; a pure number stands alone, and so does one whose unit is not known.

    >>> with_unit("0.3", "m"), with_unit("0.95", "1"), with_unit("0.4", "")
    ('0.3 m', '0.95', '0.4')
    """
    return value if unit in ("", "1") else f"{value} {unit}"


def told_apart(value: float, others: Iterable[float]) -> str:
    """A number with six digits, or with all where six make it look like one of ``others``.

    >>> told_apart(0.3, [1.0]), told_apart(1 + 1e-9, [0.0, 1.0])
    ('0.3', '1.000000001')
    """
    short = f"{value:g}"
    return repr(float(value)) if short in {f"{other:g}" for other in others if other != value} else short


def quotient(unit: str, by: str) -> str:
    """The unit of a quotient; an empty unit is unknown.

    >>> quotient("N.m", "1"), quotient("rad/s", "rad/s"), quotient("J", "N.m")
    ('N.m', '1', 'J/(N.m)')
    """
    if not unit or by in ("", "1"):
        return unit
    if unit == by:
        return "1"
    return f"{unit}/{by}" if not set(by) & set("./*") else f"{unit}/({by})"


def checked_unit(unit: str) -> str:
    """``unit`` itself where it is a product or quotient of known units, else ModelError."""
    if not isinstance(unit, str):
        raise ModelError(f"{unit!r} is not a unit; write it as a string (kg.m2, N.m/rad, rad/s, 1)")
    for name, _ in factors(unit):
        if name not in BASE:
            raise unknown(name, unit, BASE)
    return unit


def factors(unit: str) -> list[tuple[str, int]]:
    """The names in a product or quotient, with their powers. Errors: ModelError for a text that is neither.

    >>> factors("N.m/rad"), factors("N/(km/h)2")
    ([('N', 1), ('m', 1), ('rad', -1)], [('N', 1), ('km', -2), ('h', 2)])
    """
    parts = _outside_brackets(unit, "/")
    if len(parts) > 2:
        first, second, *more = parts
        raise ModelError(
            f"the unit {unit!r} has two slashes, of which the second may mean either: "
            f"write {'/'.join([f'{first}/({second}', *more])}) or {'.'.join([f'{first}/({second}', *more])})"
        )
    found = []
    for text, sign in zip(parts, (1, -1), strict=False):
        for part in _outside_brackets(text, "."):
            match = _FACTOR.fullmatch(part)
            if match is None:
                raise unknown(part, unit)
            power = sign * int(match["power"] or 1)
            inner = [(match["name"], 1)] if match["name"] else factors(match["inner"])
            found += [(name, exponent * power) for name, exponent in inner]
    return found


def _outside_brackets(text: str, mark: str) -> list[str]:
    """The parts of a text between the marks that are not in brackets."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if letter == mark and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def in_notation(unit: str) -> str:
    """A unit as it is usually typed, in Modelica's notation; in kJ/degC a degree is a difference, K.

    >>> in_notation("N*m^2"), in_notation("RPM"), in_notation("km / h"), in_notation("kJ/°C")
    ('N.m2', 'rpm', 'km/h', 'kJ/K')
    """
    if unit.lower() in _RPM:
        return "rpm"
    if unit.lower() in _SPELLINGS:
        return _SPELLINGS[unit.lower()]
    for typed, plain in _SIGNS:
        unit = unit.replace(typed, plain)
    unit = _SPACE.sub(".", _AROUND.sub(r"\1", unit))
    if unit.startswith("/"):
        unit = f"1{unit}"
    return unit if unit == "degC" else unit.replace("degC", "K")


def unknown(part: str, unit: str, known: Collection[str] = ()) -> ModelError:
    """The error for a part of a unit, with the unit in Modelica's notation, or else the known units that are like the part."""
    whole = "" if part == unit else f" in {unit!r}"
    meant = _JOINED.sub(lambda match: ".".join(filter(None, match.groups())), in_notation(unit))
    near = f"; did you mean {meant}?" if meant != unit and _is_known(meant) else suggestion(part, known)
    return ModelError(f"unknown unit {part!r}{whole} (units are written as kg.m2, N.m/rad, rad/s, N/(km/h), 1){near}")


def _is_known(unit: str) -> bool:
    try:
        return all(name in BASE for name, _ in factors(unit))
    except ModelError:
        return False


def rate_unit(unit: str, order: int = 1) -> str:
    """The unit of a derivative by time.

    >>> rate_unit("rad"), rate_unit("rad", 2), rate_unit("m/s"), rate_unit("N.m/rad"), rate_unit("N/(m/s)")
    ('rad/s', 'rad/s2', 'm/s2', 'N.m/(rad.s)', 'N/((m/s).s)')
    """
    if order == 0:
        return unit
    above, below = (*_outside_brackets(unit, "/"), "")[:2]
    seconds = _SECONDS.match(below)
    if not below or seconds:
        power = order + (int(seconds[1] or 1) if seconds else 0)
        return f"{above}/s{power if power > 1 else ''}"
    inner = below if "/" in below else below.strip("()")
    return f"{above}/({inner}.s{order if order > 1 else ''})"
