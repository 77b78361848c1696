"""Cars as the test-car list of the United States Environmental Protection Agency describes them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Literal, Self

from powertrain import ParameterError
from powertrain.language.makers import arguments_checked

RPM_PER_KMH = 0.37699111843077515
"""1 rpm/(km/h) in rad/m."""
TRANSIENT, STABILISED = 5.78, 6.21
"""Lengths of the UDDS's two parts [km]: the first 505 s, and the rest."""
WARM = 1.026
"""Warm UDDS over FTP, the mean of the nine cars of model year 2022 whose bags are known."""
Kind = Literal["manual", "automatic", "dual clutch", "belt", "power split", "electric"]
KINDS: dict[str, Kind] = {
    "Manual": "manual",
    "Automatic": "automatic",
    "Semi-Automatic": "automatic",
    "Automated Manual": "dual clutch",
    "Automated Manual- Selectable": "dual clutch",
    "Continuously Variable": "belt",
    "Selectable Continuously Variable": "belt",
}
"""What the list calls transmissions."""
STEPPED = "manual", "automatic", "dual clutch"
SPREAD = {4: 4.0, 5: 4.5, 6: 5.3, 7: 6.5, 8: 7.7, 9: 9.0, 10: 7.4}
"""Ratio spread, first over top gear, by the number of gears: H. Naunheimer et al., Automotive Transmissions, ch. 4."""
ELECTRICITY = "Electricity"
OTHER_FUELS = "diesel", "e85", "ethanol", "methanol", "cng", "natural gas", "lpg", "propane", "hydrogen"
"""Words in the names of fuels that are neither gasoline nor electricity."""
DIGIT = re.compile(r"\d")
INITIALS = frozenset("AWD BMW EV FWD GLI GMC GTI PHEV RWD SUV TDI".split())
"""Words of names that are written in capitals."""
COAST_DOWN = "coast_A_N", "coast_B_N_per_mps", "coast_C_N_per_mps2"
TEXTS = "vehicle", "test_vehicle", "transmission", "drive", "test", "procedure", "fuel"
POSITIVE = "gears", "displacement_l", "rated_power_kW", "test_mass_kg", "axle_ratio", "n_over_v_top_gear_rpm_per_kmh"
RESULTS = "fuel_economy_mpg", "bag2_mpg", "bag3_mpg", "bag4_mpg"
"""Columns: results are positive, too, or empty."""
CITY, HIGHWAY = ("Charge Depleting UDDS",), ("HWFE", "Charge Depleting Highway")
"""Procedures; the FTP has several."""


@dataclass(frozen=True)
class TestCar:
    """What the list says of a car: rated power [W], test mass [kg], road load F = A + B v + C v^2 [N, m/s], and what it burnt.

    ``displacement`` [m3], 0 without an engine; ``w_per_v`` [rad/m] engine speed over vehicle speed in top gear; ``axle_ratio``.
    ``udds`` and ``hwfet`` [miles per US gallon; of gasoline equivalent for an electric car] are measured warm, nan where they were not.
    """

    name: str
    test_vehicle: str
    transmission: Kind
    gears: int
    drive: str
    displacement: float
    power: float
    mass: float
    axle_ratio: float
    w_per_v: float
    road_load: tuple[float, float, float]
    udds: float = float("nan")
    hwfet: float = float("nan")

    __test__ = False  # no class of tests

    @classmethod
    def shipped(cls) -> tuple[Self, ...]:
        """The 14 cars of model year 2022 that come with the library.

        Source: EPA, Data on Cars used for Testing Fuel Economy, model year 2022, a work of the US government in the public domain.
        """
        path = files("powertrain.measured").joinpath("data", "epa_2022_test_cars.csv")
        return cls.from_rows(csv.DictReader(path.read_text(encoding="utf-8").splitlines()), "epa_2022_test_cars.csv")

    @classmethod
    @arguments_checked
    def from_csv(cls, path: str | Path) -> tuple[Self, ...]:
        """The cars of a file with the columns of the shipped one, a row a test.

        Errors: ParameterError for a file that cannot be read or lacks a column, and for values that do not fit, which names the row.
        """
        try:
            with Path(path).open(encoding="utf-8-sig", newline="") as file:
                return cls.from_rows(csv.DictReader(file), str(path))
        except OSError as error:
            raise ParameterError(f"{path} cannot be read: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise ParameterError(f"{path}: byte {error.start} is not text in UTF-8") from None

    @classmethod
    def from_rows(cls, rows: csv.DictReader[str], where: str) -> tuple[Self, ...]:
        """Cars of rows of tests; those of one test vehicle are one car, with the mean of its road loads and results."""
        known = rows.fieldnames or ()
        if missing := [name for name in (*TEXTS, *POSITIVE, *COAST_DOWN, *RESULTS) if name not in known]:
            raise ParameterError(f"{where} lacks columns (separated by commas): {', '.join(missing)}")
        groups: dict[str, list[dict[str, str]]] = {}
        for row in rows:
            _check(row, f"{where}, line {rows.line_num}")
            groups.setdefault(f"{row['vehicle']} {row['test_vehicle']}", []).append(row)
        if not groups:
            raise ParameterError(f"{where} has no rows")
        return tuple(cls._of(group, f"{where}, {key}") for key, group in groups.items())

    @classmethod
    def _of(cls, rows: list[dict[str, str]], where: str) -> Self:
        rows = _of_one_fuel(rows, where)
        electric = rows[0]["fuel"] == ELECTRICITY
        city = [row for row in rows if row["procedure"] in CITY or row["test"] == "FTP"]
        city = [row for row in city if row["procedure"] != "Cold CO" and row["fuel_economy_mpg"]]
        road = [row for row in rows if row["procedure"] in HIGHWAY and row["fuel_economy_mpg"]]
        row, hybrid = (city or rows)[0], any(row["bag4_mpg"] for row in city)
        listed = KINDS.get(row["transmission"].partition(" (")[0])  # the EPA adds "(e.g., CVT with paddles)"
        kind: Kind | None = "electric" if electric else "power split" if hybrid else listed
        if kind is None:
            raise ParameterError(
                f"{where}: unknown transmission {row['transmission']!r}; choose from {', '.join(KINDS)}"
            )
        if kind == "power split" and listed != "belt":
            raise ParameterError(
                f"{where}: a hybrid whose transmission is {row['transmission']!r}; only hybrids with a power split are supported, "
                "whose transmissions the list calls continuously variable"
            )
        if kind in STEPPED and int(float(row["gears"])) not in SPREAD:
            raise ParameterError(
                f"{where}: gears = {row['gears']}; {kind} gearboxes have {min(SPREAD)} to {max(SPREAD)}"
            )
        loads = [[float(r[name]) for name in COAST_DOWN] for r in city or rows]
        return cls(
            name=cased(row["vehicle"]),
            test_vehicle=row["test_vehicle"],
            transmission=kind,
            gears=int(float(row["gears"])),
            drive=row["drive"],
            displacement=0.0 if electric else float(row["displacement_l"]) * 1e-3,
            power=float(row["rated_power_kW"]) * 1e3,
            mass=float(row["test_mass_kg"]),
            axle_ratio=float(row["axle_ratio"]),
            w_per_v=float(row["n_over_v_top_gear_rpm_per_kmh"]) * RPM_PER_KMH,
            road_load=(
                _mean(load[0] for load in loads),
                _mean(load[1] for load in loads),
                _mean(load[2] for load in loads),
            ),
            udds=_mean(float(r["fuel_economy_mpg"]) if electric else _warm(r) for r in city),
            hwfet=_mean(float(r["fuel_economy_mpg"]) for r in road),
        )


def cased(name: str) -> str:
    """The name of a car as its maker writes it, from a list that prints it in capitals: Mazda MX-5; a name in mixed case is kept."""
    if name not in (name.upper(), name.lower()):
        return name
    maker, *others = name.upper().split()
    kept = [word in INITIALS or (bool(DIGIT.search(word)) and not word.startswith(maker)) for word in others]
    words = [word if keep else word.title() for word, keep in zip(others, kept, strict=True)]
    return " ".join([maker if maker in INITIALS else maker.title(), *words])


def _of_one_fuel(rows: list[dict[str, str]], where: str) -> list[dict[str, str]]:
    """The tests of a car on gasoline, or on electricity. Errors: ParameterError for plug-in hybrids and other fuels."""
    known = [row for row in rows if not any(word in row["fuel"].lower() for word in OTHER_FUELS)]
    fuels = sorted({row["fuel"] for row in known or rows})
    if not known:
        raise ParameterError(
            f"{where}: the fuel is {' and '.join(fuels)}; only gasoline and electric cars are supported"
        )
    if ELECTRICITY in fuels and len(fuels) > 1:
        raise ParameterError(f"{where}: tests with {' and '.join(fuels)}; plug-in hybrids are not supported")
    return known


def _check(row: Mapping[str, str | None], where: str) -> None:
    """ParameterError for a value that is no number, or is not positive."""
    for name in (*POSITIVE, *COAST_DOWN, *RESULTS):
        text = row[name]
        if (text == "" and name in RESULTS) or (name == "displacement_l" and row["fuel"] == "Electricity"):
            continue
        try:
            number = float(text or "")
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ParameterError(f"{where}: {name} = {text or ''!r} is not a number")
        if number <= 0 and name not in COAST_DOWN:
            raise ParameterError(f"{where}: {name} = {number:g} must be positive")


def _warm(row: Mapping[str, str]) -> float:
    """Miles per gallon of the warm UDDS: the hot transient bag, then the stabilised one (the second, of a hybrid after the hot start)."""
    second = row["bag4_mpg"] or row["bag2_mpg"]
    if not (row["bag3_mpg"] and second):
        return WARM * float(row["fuel_economy_mpg"])
    return (TRANSIENT + STABILISED) / (TRANSIENT / float(row["bag3_mpg"]) + STABILISED / float(second))


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / len(found) if found else math.nan
