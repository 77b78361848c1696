"""Cars as the test-car list of the United States Environmental Protection Agency describes them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Literal, Self, get_args

from powertrain import ParameterError
from powertrain.components.body.body import G_N
from powertrain.components.common_units import KM_H, RPM
from powertrain.language.makers import arguments_checked
from powertrain.measured.agency import COLUMNS, is_agency, of_agency
from powertrain.measured.cells import (
    COAST_DOWN,
    DRIVES,
    ELECTRICITY,
    OPTIONS,
    RANGES,
    RESULTS,
    TEXTS,
    cell_value,
    checked,
    option,
    plain,
)

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
OTHER_FUELS = "diesel", "e85", "ethanol", "methanol", "cng", "natural gas", "lpg", "propane", "hydrogen"
"""Words in the names of fuels that are neither gasoline nor electricity."""
GASOLINE = "gasoline", "cold co"
"""Words in the names of gasolines: that of the test at -7 C is called "Cold CO Regular (Tier 2)"."""
DIGIT = re.compile(r"\d")
INITIALS = frozenset("AWD BMW EV FWD GLI GMC GTI PHEV RWD SUV TDI".split())
"""Words of names that are written in capitals."""
RESISTANCE, V_RESISTANCE = (0.012, 0.06), 80 / 3.6
"""Road load over weight at 80 km/h [m/s]: 1.8 % (an electric saloon) to 3.2 % (a convertible) of the shipped cars."""
LEAST_ELECTRIC = 50.0
"""Miles per gallon of gasoline equivalent [33.705 kWh] that every electric car does; the list has some results in kWh per 100 miles."""


@dataclass(frozen=True)
class TestCar:
    """What the list says of a car: rated power [W], test mass [kg], road load F = A + B v + C v^2 [N, m/s], and its fuel economy.

    ``displacement`` [m3], 0 without an engine; ``w_per_v`` [rad/m] engine speed over vehicle speed in top gear; ``axle_ratio``.
    ``start_stop`` and ``turbocharged`` (or supercharged) are None where they are not known, and then taken from what is usual.
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
    start_stop: bool | None = None
    turbocharged: bool | None = None

    __test__ = False  # no class of tests

    def __post_init__(self) -> None:
        if self.transmission not in get_args(Kind):
            raise ParameterError(
                f"{self.name}: unknown transmission {self.transmission!r}; choose from {', '.join(get_args(Kind))}"
            )
        if self.drive not in DRIVES:
            raise ParameterError(f"{self.name}: unknown drive {self.drive!r}; choose from {', '.join(DRIVES)}")
        if self.transmission in STEPPED and self.gears not in SPREAD:
            raise ParameterError(
                f"{self.name}: gears = {self.gears}; {self.transmission} gearboxes have {min(SPREAD)} to {max(SPREAD)}"
            )

    @classmethod
    def shipped(cls) -> tuple[Self, ...]:
        """The 14 cars of model year 2022 that come with the library.

        Source: EPA, Data on Cars used for Testing Fuel Economy, model year 2022, a work of the US government in the public domain. The
        test vehicle of the RAV4 is of 2019; according to the EPA's fuel economy guide for 2019 it has no start-stop.
        """
        return cls._from_data("epa_2022_test_cars.csv")

    @classmethod
    def others(cls) -> tuple[Self, ...]:
        """46 cars of model years 2016 and 2020, of the lists of these years, which had no part in the shared numbers.

        ``start_stop`` and ``turbocharged`` of 33 of them are those of the EPA's fuel economy guide, edition of October 2019, where it has
        the same model with the same engine and transmission.
        """
        return cls._from_data("epa_other_test_cars.csv")

    @classmethod
    def _from_data(cls, name: str) -> tuple[Self, ...]:
        text = files("powertrain.measured").joinpath("data", name).read_text(encoding="utf-8")
        return cls.from_rows(csv.DictReader(text.splitlines()), name)

    @classmethod
    @arguments_checked
    def from_csv(cls, path: str | Path) -> tuple[Self, ...]:
        """The cars of a file with the columns of the shipped one, or with those of the agency, a row a test.

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
        published = is_agency(known)
        columns = COLUMNS if published else (*TEXTS, *RANGES, *COAST_DOWN, *RESULTS)
        if missing := [name for name in columns if name not in known]:
            raise ParameterError(f"{where} lacks columns (separated by commas): {', '.join(missing)}")
        groups: dict[str, list[dict[str, str]]] = {}
        for given in rows:
            line = f"{where}, line {rows.line_num}"
            if None in given:
                raise ParameterError(f"{line}: more cells than the file has columns")
            if ours := of_agency(given, line) if published else given:
                row = checked(ours, line)
                groups.setdefault(f"{row['vehicle']} {row['test_vehicle']}", []).append(row)
        if not groups:
            raise ParameterError(f"{where} has no rows")
        return tuple(cls._of(group) for group in groups.values())

    @classmethod
    def _of(cls, rows: list[dict[str, str]]) -> Self:
        rows = _of_one_fuel(rows)
        _check_same(rows)
        electric = rows[0]["fuel"] == ELECTRICITY
        city, road = (
            [row for row in rows if _cycle(row) == cycle and row["fuel_economy_mpg"]] for cycle in ("udds", "hwfet")
        )
        for result in (*city, *road) if electric else ():
            _check_electric(result)
        row, kind = (city or rows)[0], _kind(rows)
        loads = [[float(r[name]) for name in COAST_DOWN] for r in city or rows]
        car = cls(
            name=cased(row["vehicle"]),
            test_vehicle=row["test_vehicle"],
            transmission=kind,
            gears=int(float(row["gears"])),
            drive=row["drive"],
            displacement=0.0 if electric else float(row["displacement_l"]) * 1e-3,
            power=float(row["rated_power_kW"]) * 1e3,
            mass=float(row["test_mass_kg"]),
            axle_ratio=float(row["axle_ratio"]),
            w_per_v=float(row["n_over_v_top_gear_rpm_per_kmh"]) * RPM / KM_H,
            road_load=(
                _mean(load[0] for load in loads),
                _mean(load[1] for load in loads),
                _mean(load[2] for load in loads),
            ),
            udds=_mean(float(r["fuel_economy_mpg"]) if electric else _warm(r) for r in city),
            hwfet=_mean(float(r["fuel_economy_mpg"]) for r in road),
            start_stop=option(row, "start_stop"),
            turbocharged=option(row, "turbocharged"),
        )
        _check_road_load(car, row["where"])
        return car


def cased(name: str) -> str:
    """The name of a car as its maker writes it, from a list that prints it in capitals: Mazda MX-5; a name in mixed case is kept."""
    if name not in (name.upper(), name.lower()):
        return name
    maker, *others = name.upper().split()
    kept = [word in INITIALS or (bool(DIGIT.search(word)) and not word.startswith(maker)) for word in others]
    words = [word if keep else word.title() for word, keep in zip(others, kept, strict=True)]
    return " ".join([maker if maker in INITIALS else maker.title(), *words])


def _kind(rows: list[dict[str, str]]) -> Kind:
    """The kind of transmission. A fourth bag of the FTP, or the name, says that a car is a hybrid."""
    row, where = rows[0], rows[0]["where"]
    written = plain(row["transmission"].partition(" (")[0])  # the EPA adds "(e.g., CVT with paddles)"
    known: dict[str, Kind] = {plain(name): kind for name, kind in KINDS.items()}
    listed = known.get(written)
    if row["fuel"] == ELECTRICITY:
        return "electric"
    if listed is None:
        raise ParameterError(f"{where}: unknown transmission {row['transmission']!r}; choose from {', '.join(KINDS)}")
    if "hybrid" in row["vehicle"].lower() or any(row["bag4_mpg"] for row in rows):
        if listed != "belt":
            raise ParameterError(
                f"{where}: a hybrid whose transmission is {row['transmission']!r}; only hybrids with a power split are supported, "
                "whose transmissions the list calls continuously variable"
            )
        return "power split"
    if listed in STEPPED and float(row["gears"]) not in SPREAD:
        raise ParameterError(f"{where}: gears = {row['gears']}; {listed} gearboxes have {min(SPREAD)} to {max(SPREAD)}")
    return listed


def _cycle(row: Mapping[str, str]) -> str:
    """The cycle of a test, "" for one that is not predicted."""
    test, procedure = row["test"].lower(), row["procedure"].lower()
    if (test == "ftp" and procedure != "cold co") or procedure == "charge depleting udds":
        return "udds"
    return "hwfet" if test == "hwy" or procedure in ("hwfe", "charge depleting highway") else ""


def _of_one_fuel(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """The tests of a car on gasoline, or on electricity. Errors: ParameterError for plug-in hybrids and other fuels."""
    known = [row for row in rows if row["fuel"] == ELECTRICITY or _is_gasoline(row["fuel"])]
    fuels, where = sorted({row["fuel"] for row in known or rows}), rows[0]["where"]
    if not known:
        raise ParameterError(
            f"{where}: the fuel is {' and '.join(fuels)}; only gasoline and electric cars are supported"
        )
    if ELECTRICITY in fuels and len(fuels) > 1:
        raise ParameterError(f"{where}: tests with {' and '.join(fuels)}; plug-in hybrids are not supported")
    for row in known:
        if row["fuel"] != ELECTRICITY and "depleting" in row["procedure"].lower():
            raise ParameterError(
                f"{row['where']}: procedure = {row['procedure']} with {row['fuel']}; plug-in hybrids are not supported"
            )
    return known


def _check_electric(row: Mapping[str, str]) -> None:
    """ParameterError for a result in another unit."""
    result = float(row["fuel_economy_mpg"])
    if result < LEAST_ELECTRIC:
        raise ParameterError(
            f"{row['where']}: fuel_economy_mpg = {result:g} of an electric car; "
            f"if these are kWh per 100 miles, write {3370.5 / result:.1f}"
        )


def _is_gasoline(fuel: str) -> bool:
    name = fuel.lower()
    return any(word in name for word in GASOLINE) and not any(word in name for word in OTHER_FUELS)


def _check_same(rows: list[dict[str, str]]) -> None:
    """ParameterError if the rows of a test vehicle are not of one car."""
    first = rows[0]
    for row in rows[1:]:
        for name in ("transmission", "drive", *RANGES, *OPTIONS):
            if cell_value(row.get(name, "")) != cell_value(first.get(name, "")):
                raise ParameterError(
                    f"{row['where']}: {name} = {row[name]}, but {first[name]} in another row of {row['vehicle']} {row['test_vehicle']}; "
                    "give every car, and every configuration of a car, a test_vehicle of its own"
                )


def _check_road_load(car: TestCar, where: str) -> None:
    """ParameterError for a road load that rises nowhere near as cars' do with their weight: one of the two has another unit."""
    F_0, F_1, F_2 = car.road_load
    v, (least, most) = V_RESISTANCE, RESISTANCE
    force = F_0 + F_1 * v + F_2 * v**2
    if not least <= force / (car.mass * G_N) <= most:
        raise ParameterError(
            f"{where}: the road load is {force:.0f} N at {3.6 * v:g} km/h, {100 * force / (car.mass * G_N):.2g} % of the weight, and not "
            f"{100 * least:g} % to {100 * most:g} %; check the units of {', '.join(COAST_DOWN)} and test_mass_kg"
        )


def _warm(row: Mapping[str, str]) -> float:
    """Miles per gallon of the warm UDDS: the hot transient bag, then the stabilised one (the second, of a hybrid after the hot start)."""
    second = row["bag4_mpg"] or row["bag2_mpg"]
    if not (row["bag3_mpg"] and second):
        return WARM * float(row["fuel_economy_mpg"])
    return (TRANSIENT + STABILISED) / (TRANSIENT / float(row["bag3_mpg"]) + STABILISED / float(second))


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / len(found) if found else math.nan
