"""The measured cars in FASTSim, from the same test-car list: road load, test mass and rated power; what the list does not say is its own.

FASTSim (National Renewable Energy Laboratory) is a quasi-static model at 1 Hz. Its engine's efficiency depends on the power alone, so the
gears make no difference to it. Its conventional car is a 2012 Ford Fusion, whose mass, road load, engine power and accessory power are
replaced. All its errors have one factor taken out, fitted over all other cars, as its efficiency is that of another year.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Iterator
from math import exp, log
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from powertrain.components.cycles import DriveCycle
from powertrain.measured.fitting import Sensitivities
from powertrain.measured.prediction import Prediction, predictions
from powertrain.measured.published import OTHERS, PREDICTIONS
from powertrain.measured.record import TestCar
from powertrain.measured.technology import Technology

DATA = Path(__file__).parents[1] / "powertrain" / "measured" / "data"
FUSION = "2012_Ford_Fusion.yaml"
RHO, G = 1.2, 9.80665
GALLON = 3.785411784 * 0.7435 * 43.0e6
"""Energy of a gallon of certification gasoline [J]."""
AUXILIARY = 400.0
SPEEDS = np.linspace(2.0, 27.0, 51)


def quadratic(road_load: tuple[float, float, float]) -> tuple[float, float]:
    """The F_0 and F_2 without a linear term that come nearest to a road load over the speeds of the cycles."""
    columns = np.stack([np.ones_like(SPEEDS), SPEEDS**2], axis=1)
    wanted = np.polyval(road_load[::-1], SPEEDS)
    found = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(found[0]), float(found[1])


def fastsim_mpg(car: TestCar, cycle: str) -> float:
    """Miles per gallon of FASTSim's conventional car with a car's data. ImportError where FASTSim is not installed."""
    library = importlib.import_module("fastsim")
    given: dict[str, Any] = library.Vehicle.from_resource(FUSION).to_dict()
    F_0, F_2 = quadratic(car.road_load)
    given["chassis"] |= {
        "drag_coef": 2 * F_2 / RHO,
        "frontal_area_square_meters": 1.0,
        "wheel_rr_coef": F_0 / (car.mass * G),
    }
    given["mass_kilograms"] = car.mass
    given["chassis"] |= {"mass_kilograms": None, "glider_mass_kilograms": None, "cargo_mass_kilograms": None}
    engine = given["pt_type"]["Conv"]["fc"]
    engine |= {"pwr_out_max_watts": car.power, "pwr_out_max_init_watts": car.power / 2, "pwr_ramp_lag_seconds": 1.0}
    given["pwr_aux_base_watts"] = AUXILIARY
    driven = DriveCycle.named(cycle)
    trace = {"name": cycle, "time_seconds": driven.times.tolist(), "speed_meters_per_second": driven.speeds.tolist()}
    drive = library.SimDrive(library.Vehicle.from_dict(given), library.Cycle.from_dict(trace))
    drive.run()
    fuel: float = drive.to_dict()["veh"]["pt_type"]["Conv"]["fc"]["state"]["energy_fuel_joules"]
    return driven.distance / 1609.344 / (fuel / GALLON)


def fastsim_errors(cars: Iterable[TestCar]) -> dict[tuple[str, str], float]:
    """Errors, predicted over measured less 1, by test vehicle and cycle, with the factor that the other cars' errors ask for."""
    raw = {
        (car.test_vehicle, cycle): log(fastsim_mpg(car, cycle) / getattr(car, cycle))
        for car in cars
        if car.transmission not in ("electric", "power split")
        for cycle in ("udds", "hwfet")
    }
    means = {car: float(np.mean([e for (c, _), e in raw.items() if c != car])) for car, _ in raw}
    return {key: exp(error - means[key[0]]) - 1 for key, error in raw.items()}


def row(one: Prediction) -> dict[str, object]:
    """What is published of every car and cycle."""
    return {
        "car": one.car.name,
        "test_vehicle": one.car.test_vehicle,
        "transmission": one.car.transmission,
        "cycle": one.cycle,
        "measured": round(one.measured, 2),
        "predicted": round(one.mpg, 2),
        "error": round(100 * one.error, 2),
    }


def rows(technology: Technology) -> Iterator[dict[str, object]]:
    """What is published of the cars to which the shared numbers are fitted."""
    cars = TestCar.shipped()
    known = Sensitivities.shipped()
    left = dict(zip(zip(known.cars, known.cycles, strict=True), known.left_out(), strict=True))
    other = fastsim_errors(cars)
    for one in predictions(cars, technology):
        key = (one.car.test_vehicle, one.cycle)
        yield row(one) | {
            "left_out": round(100 * (exp(left[key] / 100) - 1), 2) if key in left else None,
            "fastsim": round(100 * other[key], 2) if key in other else None,
        }


def main() -> None:
    """Writes the files that the documentation shows. It takes half an hour."""
    others = map(row, predictions(TestCar.others(), Technology()))
    for name, found in ((PREDICTIONS, rows(Technology())), (OTHERS, others)):
        table = pd.DataFrame(found)
        table.to_csv(DATA / name, index=False)
        print(table.to_string(index=False))


if __name__ == "__main__":
    main()
