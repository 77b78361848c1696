"""Measured cars over the cycles they were measured on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import pandas as pd

from powertrain.components.common_units import GALLON, MILE
from powertrain.language.makers import arguments_checked
from powertrain.measured.building import build
from powertrain.measured.record import TestCar
from powertrain.measured.technology import Technology
from powertrain.trials import charge_corrected, drive_cycle

CYCLES = COOL, _ = "udds", "hwfet"
"""The cycles, and the one on which engine and gearbox are only as warm as in the bags of the FTP."""
CHARGER = 0.88
"""Efficiency from the wall into the battery: what is measured of an electric car comes from the wall."""
MPG = 1e8 * GALLON / MILE
"""Miles per US gallon times litres per 100 km."""
LITRE_OF_MODEL, LITRE_OF_TEST = 745.0 * 43.0e6, 743.5 * 43.0e6
"""Energy of a thousandth of a cubic metre of the model's gasoline, and of certification gasoline [mJ]: 40 CFR 600.113-12."""


@dataclass(frozen=True)
class Prediction:
    """Miles per gallon, predicted and measured (nan where it was not), of a car on a cycle; ``message`` says what went wrong."""

    car: TestCar
    cycle: str
    mpg: float
    measured: float
    time_outside: float
    message: str = ""

    @property
    def error(self) -> float:
        """Predicted over measured, less 1."""
        return self.mpg / self.measured - 1


@arguments_checked
def predict(car: TestCar, cycle: str, technology: Technology | None = None) -> Prediction:
    """The fuel economy of a car on "udds" (as warm as in the bags of the FTP) or "hwfet" (warm).

    A hybrid's is corrected for the charge by ``charge_corrected``, an electric car's is of gasoline equivalent from the wall.
    """
    cycle = cycle.lower() if cycle.lower() in CYCLES else cycle
    run = drive_cycle(build(car, technology or Technology(), cool=cycle == COOL), cycle)
    if car.transmission == "electric":
        mpg = run.mpg(CHARGER)
    else:
        litres = charge_corrected(run) if run.anatomy.stores else run.litres_per_100km
        mpg = MPG / litres * (LITRE_OF_TEST / LITRE_OF_MODEL)
    return Prediction(car, cycle, mpg, getattr(car, cycle, math.nan), run.time_outside, run.message)


def predictions(cars: Iterable[TestCar], technology: Technology | None = None) -> Iterator[Prediction]:
    """Every car on both cycles."""
    for car in cars:
        for cycle in CYCLES:
            yield predict(car, cycle, technology)


def table(found: Iterable[Prediction]) -> pd.DataFrame:
    """A row a car: measured and predicted miles per gallon, and the error [%], on both cycles."""
    rows: dict[str, dict[str, float | str]] = {}
    for one in found:
        row = rows.setdefault(one.car.test_vehicle, {"car": one.car.name, "transmission": one.car.transmission})
        row |= {
            f"{one.cycle} measured": one.measured,
            f"{one.cycle} predicted": one.mpg,
            f"{one.cycle} error %": 100 * one.error,
        }
    return pd.DataFrame.from_dict(rows, orient="index").reset_index(drop=True)
