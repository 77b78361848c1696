"""The cells of a test-car list: names of columns, and what a cell may hold."""

from __future__ import annotations

import math
from collections.abc import Mapping

from powertrain import ParameterError

ELECTRICITY = "Electricity"
DRIVES = "F", "R", "A", "4", "P"
"""Driven wheels: front, rear, all; four with a transfer case, and part-time four."""
COAST_DOWN = "coast_A_N", "coast_B_N_per_mps", "coast_C_N_per_mps2"
TEXTS = "vehicle", "test_vehicle", "transmission", "drive", "test", "procedure", "fuel"
RANGES = {
    "gears": (1, 10, ""),
    "displacement_l": (0.5, 10, " l"),
    "rated_power_kW": (20, 1500, " kW"),
    "test_mass_kg": (600, 5500, " kg"),
    "axle_ratio": (0.8, 20, ""),
    "n_over_v_top_gear_rpm_per_kmh": (8, 150, " rpm/(km/h)"),
}
"""Columns of positive numbers, and the range that cars of the list leave with room to spare: beyond it a value has another unit."""
RESULTS = "fuel_economy_mpg", "bag2_mpg", "bag3_mpg", "bag4_mpg"
"""Columns of results: positive, too, or empty."""
OPTIONS = "start_stop", "turbocharged"
"""Columns that a file may have, of Y, N or nothing: the agency's fuel economy guide knows what its test-car list does not."""


def checked(given: Mapping[str, str | None], where: str) -> dict[str, str]:
    """A row without spaces around its cells, and ``where`` it is. ParameterError for a cell that is no number, or out of its range."""
    row = {name: (text or "").strip() for name, text in given.items()} | {"where": where}
    row["drive"] = row["drive"].upper()
    if row["fuel"].lower() == ELECTRICITY.lower():
        row["fuel"] = ELECTRICITY
    if empty := [name for name in TEXTS if not row[name] and name not in ("test_vehicle", "procedure")]:
        raise ParameterError(f"{where}: {empty[0]} is empty")
    if row["drive"] not in DRIVES:
        raise ParameterError(f"{where}: unknown drive {row['drive']!r}; choose from {', '.join(DRIVES)}")
    for name in (*RANGES, *COAST_DOWN, *RESULTS):
        text = row[name]
        if (text == "" and name in RESULTS) or (name == "displacement_l" and row["fuel"] == ELECTRICITY):
            continue
        _check_number(name, text, where)
    return row


def _check_number(name: str, text: str, where: str) -> None:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"{where}: {name} = {text!r} is not a number")
    if number < 0 and name in ("coast_A_N", "coast_C_N_per_mps2"):
        raise ParameterError(f"{where}: {name} = {number:g} must not be negative")
    if number <= 0 and name not in COAST_DOWN:
        raise ParameterError(f"{where}: {name} = {number:g} must be positive")
    if name == "gears" and number % 1:
        raise ParameterError(f"{where}: {name} = {number:g} is not a whole number")
    least, most, unit = RANGES.get(name, (-math.inf, math.inf, ""))
    if not least <= number <= most:
        advice = "; check the unit" if unit else ""
        raise ParameterError(f"{where}: {name} = {number:g}{unit} is not within {least:g} to {most:g}{unit}{advice}")


def plain(text: str) -> str:
    """A text without spaces, in lower case: the lists of different years write names differently."""
    return "".join(text.lower().split())


def cell_value(text: str) -> float | str:
    """The value of a cell; 8 and 8.0 are equal."""
    try:
        return float(text)
    except ValueError:
        return plain(text)


def option(row: Mapping[str, str], name: str) -> bool | None:
    """The value of an optional column of Y or N; None if it is empty."""
    text = row.get(name, "")
    if text.upper() not in ("Y", "N", ""):
        raise ParameterError(f"{row['where']}: {name} = {text!r}; choose from Y, N, or leave it empty")
    return text.upper() == "Y" if text else None
