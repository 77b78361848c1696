"""Identifies the columns of an engine's table by their names and units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple
from unicodedata import normalize

from powertrain import Heading, ParameterError, TextTable
from powertrain.components.common_units import RPM

HP, LB, LBF_FT, PSI = 745.6998715822702, 453.59237, 1.3558179483314004, 6894.757293168361
UNITS = {
    "speed": {"rad/s": 1.0, "radps": 1.0, **dict.fromkeys(("rpm", "1/min", "min1", "rev/min", "r/min", "u/min"), RPM)},
    "torque": {"nm": 1.0, "knm": 1e3, **dict.fromkeys(("lbfft", "ftlbf", "lbft", "ftlb", "ftlbs", "lbsft"), LBF_FT)},
    "bmep": {"bar": 1e5, "kpa": 1e3, "mpa": 1e6, "pa": 1.0, "psi": PSI},
    "power": {"w": 1.0, "kw": 1e3, "hp": HP, "bhp": HP, "ps": 735.49875},
    "flow": {
        "g/s": 1.0,
        "gps": 1.0,
        "kg/s": 1e3,
        **{unit + hour: size for unit, size in (("g/", 1 / 3600), ("kg/", 1 / 3.6)) for hour in ("h", "hr")},
        **dict.fromkeys(("lb/h", "lb/hr", "lbm/h", "lbm/hr", "lbs/h", "lbs/hr"), LB / 3600),
    },
    "specific": {
        "kg/j": 3.6e9,
        "g/mj": 3.6,
        "kg/kwh": 1e3,
        "kg/kwhr": 1e3,
        **dict.fromkeys(("g/kwh", "g/kwhr", "gpkwh", "gpkwhr"), 1.0),
        **dict.fromkeys(("lb/hph", "lb/hphr", "lb/bhph", "lb/bhphr", "lbm/hphr", "lbm/bhphr"), LB * 1e3 / HP),
        **dict.fromkeys(("g/hph", "g/hphr", "g/bhph", "g/bhphr"), 1e3 / HP),
    },
    "throttle": {"1": 1.0, "": 1.0, "%": 0.01},
}
UNITS |= {"full load": UNITS["torque"], "motored": UNITS["torque"]}
"""Units by quantity, without dots, hyphens and brackets, in rad/s, N.m, Pa, W, g/s, g/kWh and 1."""
SHOWN = {
    "speed": "rpm, 1/min, rad/s",
    "torque": "N.m, lbf.ft",
    "bmep": "bar, kPa, psi",
    "power": "kW, hp",
    "flow": "kg/s, g/s, kg/h, g/h, lb/h",
    "specific": "g/kWh, kg/J, lb/hp-hr",
    "throttle": "1, %",
    "full load": "N.m, lbf.ft",
    "motored": "N.m, lbf.ft",
}
WORDS = {
    "speed": "speed spd rpm n w omega drehzahl",
    "torque": "torque trq tq tau md m load drehmoment",
    "bmep": "bmep pme load",
    "power": "power p pe load leistung",
    "flow": "fuel mdot kraftstoff",
    "specific": "bsfc sfc be fuel consumption verbrauch",
    "throttle": "throttle u alpha pedal opening",
    "full load": "full wot max maximum volllast",
    "motored": "motored motoring drag friction closed min minimum schleppmoment",
}
"""Words in the names of such columns."""
OTHERS = {"indicated", "friction", "co"}
"""Words that make another quantity of a torque, a power or a consumption, such as that of CO2."""
CALL = "to read_fuel_map or read_torque_map"
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_MARKS = re.compile(r"[\s.()*·⋅^_−-]")


class Column(NamedTuple):
    """A column of a table: its quantity, and its unit as a factor."""

    place: int
    kind: str
    size: float


def column(sheet: TextTable, role: str, kinds: Sequence[str], asked: str | None) -> Column:
    """The column requested by name, or else the one whose name and unit match the first kind that the table contains.

    Errors: ParameterError if there is none, or if there are several.
    """
    if asked is not None:
        return _asked(sheet, role, kinds, Heading.of(asked))
    for kind in kinds:
        found = candidates(sheet, kind)
        if len(found) > 1:
            several = " and ".join(repr(str(sheet.headings[c.place])) for c in found)
            raise ParameterError(
                f"{sheet.path}: {several} may both give the {role}; pass {role.replace(' ', '_')}='name' {CALL}"
            )
        if found:
            return found[0]
    raise _nothing(sheet, role, kinds)


def candidates(sheet: TextTable, kind: str) -> list[Column]:
    """The columns whose unit and name are of a kind."""
    units = [unit_of(heading) for heading in sheet.headings]
    known = set(WORDS[kind].split())
    named = [words(heading.name) for heading in sheet.headings]
    return [
        Column(i, kind, UNITS[kind][unit])
        for i, (name, unit) in enumerate(zip(named, units, strict=True))
        if unit in UNITS[kind] and name & known and not name & (OTHERS - known)
    ]


def _asked(sheet: TextTable, role: str, kinds: Sequence[str], asked: Heading) -> Column:
    same = [i for i, heading in enumerate(sheet.headings) if heading.name.lower() == asked.name.lower()]
    if len(same) != 1:
        what = "several columns have that name" if same else "there is no such column"
        raise ParameterError(f"{sheet.path}: {role} = {str(asked)!r}: {what}; {_listed(sheet)}")
    heading = sheet.headings[same[0]]
    unit, said = unit_of(heading), unit_of(asked)
    if unit is not None and said is not None and unit != said:
        raise ParameterError(f"{sheet.path}: {role} = {str(asked)!r}: the file gives {str(heading)!r}")
    for kind in kinds:
        if (one := unit if unit is not None else said) in UNITS[kind]:
            return Column(same[0], kind, UNITS[kind][one])
    raise _nothing(sheet, role, kinds)


def _nothing(sheet: TextTable, role: str, kinds: Sequence[str]) -> ParameterError:
    units = ", or ".join(f"a {kind} in {SHOWN[kind]}" if kind != role else SHOWN[kind] for kind in kinds)
    return ParameterError(
        f"{sheet.path}: no column is known to give the {role} ({units}); {_listed(sheet)}; write name and unit as 'name [unit]' into "
        f"the heading, or pass {role.replace(' ', '_')}='name [unit]' {CALL}"
    )


def _listed(sheet: TextTable) -> str:
    return "the columns are " + ", ".join(repr(str(heading)) for heading in sheet.headings)


def unit_of(heading: Heading) -> str | None:
    """The unit of a heading as in ``UNITS``: in brackets, or at the end of its name, as in ``speed_rpm`` and ``RPM``; otherwise None."""
    if heading.unit:
        plain = normalize("NFKC", heading.unit)  # min⁻¹ is min−1
        return _MARKS.sub("", plain.lower()) if plain != "-" else "1"
    parts = re.split(r"[\s_]+", heading.name)
    last = _MARKS.sub("", parts[-1].lower())
    is_unit = any(last in units for units in UNITS.values()) and last not in ("", "1")
    return last if is_unit and (len(parts) > 1 or len(last) > 1) else None


def words(name: str) -> set[str]:
    """The words of a name, also for ``engineSpeed`` and ``eng_speed``."""
    return {word.lower() for word in _WORD.findall(name)}
