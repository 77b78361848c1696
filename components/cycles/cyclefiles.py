"""Drive cycles in text files: identifies columns by name and unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from powertrain import Heading, ParameterError, TextTable
from powertrain.components.common_units import KM_H, MILE, MPH

HOUR, FOOT = 3600.0, 0.3048
UNITS: dict[str, dict[str, float]] = {
    "time": {
        **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
        "ms": 1e-3,
        **dict.fromkeys(("min", "minutes"), 60.0),
        **dict.fromkeys(("h", "hr", "hours"), HOUR),
    },
    "distance": {**dict.fromkeys(("m", "meters", "metres"), 1.0), "km": 1e3, "mi": MILE, "miles": MILE, "ft": FOOT},
    "speed": {
        **dict.fromkeys(("m/s", "mps", "ms", "meters/per/second"), 1.0),
        **dict.fromkeys(("km/h", "kmh", "kph", "km/hr", "kmph"), KM_H),
        **dict.fromkeys(("mph", "mi/h", "mile/h"), MPH),
        **dict.fromkeys(("ft/s", "fps"), FOOT),
    },
    "grade": {**dict.fromkeys(("", "1", "fraction"), 1.0), **dict.fromkeys(("percent", "%", "pct"), 0.01)},
}
UNITS |= {"stop": UNITS["time"], "height": UNITS["distance"]}
"""Factors to s, m, m/s and 1 for the units of each quantity; names are in lower case, with / as the separator."""
NAMES = {
    "time": "time t",
    "distance": "distance dist s position",
    "speed": "speed velocity v",
    "grade": "grade slope gradient",
    "height": "height altitude elevation",
    "stop": "stop wait",
}
"""Words that identify a column: any word of the heading, or only the first if the unit follows in the name."""
SHOWN = {
    "time": "time_s or time [s]",
    "distance": "distance_m or distance [m]",
    "speed": "speed_km_h, speed_m_s, speed_mph or speed [km/h]",
    "grade": "grade or grade_percent",
    "height": "height_m or height [m]",
    "stop": "stop_s",
}
LEFT_OUT = ("cycroadtype", "road_charge_kilowatts")
"""Columns of FASTSim cycles that are ignored: the power with which a road charges a vehicle."""
_WORD = re.compile(r"[A-Z]?[a-z0-9%]+|[A-Z]+(?![a-z])|%")


def read_columns(path: str | Path) -> dict[str, list[float]]:
    """The columns of a file by quantity, in s, m, m/s and as the tangent of the slope.

    Errors: ParameterError for a file that cannot be read, for a duplicate column or one of unknown name or unit, and for a
    cell that is not a number, with its line.
    """
    sheet = TextTable.read(path)
    found: dict[str, tuple[int, float]] = {}
    for place, heading in enumerate(sheet.headings):
        if str(heading).lower() in LEFT_OUT:
            continue
        what, size = _meaning(sheet, heading)
        if what in found:
            other = str(sheet.headings[found[what][0]])
            raise ParameterError(f"{sheet.path}: both {other!r} and {str(heading)!r} give the {what}")
        found[what] = place, size
    return {what: _numbers(sheet, place, size) for what, (place, size) in found.items()}


def one_of(columns: Mapping[str, list[float]], names: tuple[str, ...], path: str | Path) -> str:
    """The one column of ``names`` that a file has. Errors: ParameterError if there is none, or more than one."""
    there = [name for name in names if name in columns]
    if len(there) != 1:
        some = f"both {' and '.join(there)}" if there else "neither" if len(names) > 1 else "no column"
        needed = " and ".join(f"{name} ({SHOWN[name]})" for name in names)
        raise ParameterError(f"{path}: the header gives {some} of {needed}; it must give one")
    return there[0]


def _meaning(sheet: TextTable, heading: Heading) -> tuple[str, float]:
    """The quantity of a column, and the size of its unit."""
    words = [word.lower() for word in _WORD.findall(heading.name)]
    if words[:1] == ["cyc"]:  # as in cycSecs of FASTSim, where the unit stands for the name
        words = {"secs": ["time", "s"], "mps": ["speed", "mps"], "grade": ["grade"]}.get("".join(words[1:]), words)
    named = words if heading.unit else words[:1]
    what = next((what for what, names in NAMES.items() if set(named) & set(names.split())), None)
    if what is None:
        raise ParameterError(f"{sheet.path}: unknown column {str(heading)!r}; columns are {'; '.join(SHOWN.values())}")
    said = heading.unit.lower().replace(" ", "").replace(".", "/") if heading.unit else "/".join(words[1:])
    if said not in UNITS[what]:
        problem = f"the unit {said!r} of a {what} is not known" if said else f"a {what} needs a unit"
        raise ParameterError(f"{sheet.path}: {str(heading)!r}: {problem}; write {SHOWN[what]}")
    return what, UNITS[what][said]


def _numbers(sheet: TextTable, place: int, size: float) -> list[float]:
    for row in sheet.rows:
        if len(row.cells) <= place or not row.cells[place]:
            raise ParameterError(f"{sheet.path}:{row.line}: {sheet.headings[place]}: the cell is empty")
    return [sheet.number(row, place) * size for row in sheet.rows]
