"""A run depends on nothing but what it is given: the runs of one plant are equal to the last bit, whatever was run before."""

from __future__ import annotations

import importlib
import pkgutil
import random
from typing import Any

import numpy as np
import pytest
from cases import few
from drivelines import driveline
from gearsets import EIGHT, RATIOS, eight_speed, shifts
from small_models import CoupledClutches

import powertrain as pt
from powertrain import vehicles
from powertrain.components.body import DrivenAxle
from powertrain.components.cycles import DriveCycle
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.wheels import SlipWheel
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.dual_clutch_car import DualClutchCar
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.electric_four_wheel_drive import ElectricFourWheelDriveCar
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid
from powertrain.vehicles.four_wheel_drive import FourWheelDriveCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.rear_drive import RearDriveCar
from powertrain.vehicles.series_hybrid import SeriesHybrid
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar

SHIFTED: dict[str, Any] = {"stop": 8.5, "inputs": shifts() | {"tau_in": 200.0}}


def same(plant: pt.Plant[Any], runs: int, **options: Any) -> pt.Result[Any]:
    first = plant.simulate(**options)
    table = first.to_dataframe().to_numpy()
    for _ in range(runs - 1):
        again = plant.simulate(**options)
        assert [(e.time, e.name, e.new) for e in again.events] == [(e.time, e.name, e.new) for e in first.events]
        np.testing.assert_array_equal(again.to_dataframe().to_numpy(), table)
    return first


@pytest.mark.slow
@pytest.mark.parametrize("eta", [1.0, 0.98])
def test_shifts_of_an_eight_speed(eta: float) -> None:
    """Five runs, shorter ones and ones with another torque in between."""
    plant = pt.compile(eight_speed(eta))
    first = same(plant, 2, **SHIFTED)
    plant.simulate(3.0, inputs=SHIFTED["inputs"] | {"tau_in": 120.0})
    for again in (plant.simulate(**SHIFTED), same(plant, 2, **SHIFTED)):
        np.testing.assert_array_equal(again["output.w"], first["output.w"])
    audit = pt.energy_audit(first)
    assert abs(audit.residual) < 1e-6 * audit.turnover


@pytest.mark.slow
@pytest.mark.parametrize("gear", EIGHT)
def test_published_ratios_of_the_eight_speed(gear: str) -> None:
    held = {f"p{element}": float(element in EIGHT[gear]) for element in "ABCDE"}
    run = pt.simulate(eight_speed(0.98), 0.5, inputs=held | {"tau_in": 200.0})
    assert run["turbine.w"][-1] / run["output.w"][-1] == pytest.approx(RATIOS[gear], abs=6e-4)


@pytest.mark.slow
def test_a_car_takes_off_the_same_way_each_time() -> None:
    plant = pt.compile(SplitPathCar())
    first = same(plant, 2, stop=60.0, rtol=1e-4)
    plant.simulate(30.0, parameters={"body.m": 1500.0}, rtol=1e-4)
    np.testing.assert_array_equal(same(plant, 2, stop=60.0, rtol=1e-4)["body.v"], first["body.v"])


LOCKING = DrivenAxle(differential=CircularCamDifferential(mu=0.2))
CARS: dict[str, pt.Component] = {
    "manual": ManualCar(),
    "automatic": AutomaticCar(),
    "variator": VariatorCar(),
    "split path": SplitPathCar(),
    "split path, locking cam, Magic Formula": SplitPathCar(front=LOCKING),
    "split path, bevel, linear tyres": SplitPathCar(front=DrivenAxle(left=SlipWheel(), right=SlipWheel())),
    "four-wheel drive": FourWheelDriveCar(),
    "rear drive": RearDriveCar(),
    "electric": ElectricCar(),
    "electric, two machines": ElectricFourWheelDriveCar(),
    "dual clutch": DualClutchCar(),
    "parallel hybrid": ParallelHybrid.at("P2"),
    "series hybrid": SeriesHybrid(),
    "flywheel hybrid": FlywheelHybrid(),
    "power-split hybrid": PowerSplitHybrid(),
}


def test_every_vehicle_is_among_them() -> None:
    """Of all modules of the package with a class that drives cycles."""
    shipped = {
        kind
        for module in pkgutil.iter_modules(vehicles.__path__, "powertrain.vehicles.")
        if not module.ispkg
        for kind in vars(importlib.import_module(module.name)).values()
        if isinstance(kind, type) and kind.__module__ == module.name and "cycle" in getattr(kind, "_fields", ())
        if getattr(kind, "equations", pt.Component.equations) is not pt.Component.equations  # else partial
    }
    assert shipped == {type(car) for car in CARS.values()}


@pytest.mark.slow
@pytest.mark.parametrize("name", CARS)
def test_vehicles(name: str) -> None:
    """The first 150 s of the WLTC with a halt, five times; a shorter run, one at another tolerance and one of a heavier car in between."""
    plant = pt.compile(pt.replace(CARS[name], {"cycle.cycle": DriveCycle.named("wltc")}))
    first = same(plant, 2, stop=150.0, rtol=1e-4)
    assert np.abs(first.at([130.0, 136.0], "body.v")).max() < 0.02  # the halt
    mass = float(plant.parameters["body.m"])
    others: list[dict[str, Any]] = [
        {"stop": 20.0}, {"stop": 10.0, "rtol": 1e-6}, {"stop": 15.0, "parameters": {"body.m": 1.2 * mass}},
    ]  # fmt: skip
    for other in others:
        plant.simulate(**{"rtol": 1e-4, **other})
        again = plant.simulate(150.0, rtol=1e-4)
        np.testing.assert_array_equal(again.to_dataframe().to_numpy(), first.to_dataframe().to_numpy())


def test_coupled_clutches() -> None:
    plant = pt.compile(CoupledClutches())
    first = same(plant, 2, stop=1.5)
    plant.simulate(1.0, parameters={"J2.J": 3.0})
    np.testing.assert_array_equal(same(plant, 3, stop=1.5)["J4.w"], first["J4.w"])


@pytest.mark.parametrize("seed", few(range(240), 5))
def test_random_drivelines(seed: int) -> None:
    draws = random.Random(seed)
    model = driveline(lambda options: draws.choice(list(options)), draws.randint(3, 10), False)
    try:
        plant = pt.compile(model)
        first = plant.simulate(1.0)
    except pt.PowertrainError:
        pytest.skip("refused")
    plant.simulate(0.3, rtol=1e-4)
    again = same(plant, 4, stop=1.0)
    np.testing.assert_array_equal(again.to_dataframe().to_numpy(), first.to_dataframe().to_numpy())
