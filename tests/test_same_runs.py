"""A run depends on nothing but what it is given: the runs of one plant are equal to the last bit, whatever was run before."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from drivelines import driveline
from gearsets import EIGHT, RATIOS, eight_speed, shifts

import powertrain as pt
from powertrain.vehicles.split_path_car import SplitPathCar

SHIFTED: dict[str, Any] = {"stop": 8.5, "inputs": shifts() | {"tau_in": 200.0}}


def same(plant: pt.Plant[Any], runs: int, **options: Any) -> pt.Result[Any]:
    first = plant.simulate(**options)
    table = first.to_dataframe().to_numpy()
    for _ in range(runs - 1):
        again = plant.simulate(**options)
        assert [(e.time, e.name, e.new) for e in again.events] == [(e.time, e.name, e.new) for e in first.events]
        np.testing.assert_array_equal(again.to_dataframe().to_numpy(), table)
    return first


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


@pytest.mark.parametrize("gear", EIGHT)
def test_published_ratios_of_the_eight_speed(gear: str) -> None:
    held = {f"p{element}": float(element in EIGHT[gear]) for element in "ABCDE"}
    run = pt.simulate(eight_speed(0.98), 0.5, inputs=held | {"tau_in": 200.0})
    assert run["turbine.w"][-1] / run["output.w"][-1] == pytest.approx(RATIOS[gear], abs=6e-4)


def test_a_car_takes_off_the_same_way_each_time() -> None:
    plant = pt.compile(SplitPathCar())
    first = same(plant, 2, stop=60.0, rtol=1e-4)
    plant.simulate(30.0, parameters={"body.m": 1500.0}, rtol=1e-4)
    np.testing.assert_array_equal(same(plant, 2, stop=60.0, rtol=1e-4)["body.v"], first["body.v"])


@pytest.mark.parametrize("seed", [pytest.param(s, marks=() if s < 15 else pytest.mark.slow) for s in range(200)])
def test_random_drivelines(seed: int) -> None:
    draws = random.Random(seed)
    model = driveline(lambda options: draws.choice(list(options)), draws.randint(3, 10), False)
    try:
        plant = pt.compile(model)
        plant.simulate(1.0)
    except pt.PowertrainError:
        pytest.skip("refused")
    same(plant, 4, stop=1.0)
