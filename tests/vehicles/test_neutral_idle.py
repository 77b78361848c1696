"""Cars with neutral idle control: the clutch behind their converter follows both pedals."""

from __future__ import annotations

from typing import Any

import pytest

import powertrain as pt
from powertrain.components.control import OpenPedals
from powertrain.components.cycles import DriveCycle
from powertrain.components.transmissions import NeutralIdleConverter
from powertrain.trials import backward, drive_cycle
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.variator_car import VariatorCar

BRAKE = [0, 4, 4.1, 6], [0.3, 0.3, 0, 0]
ACCELERATOR = [0, 2, 2.1, 3, 3.1, 6], [0, 0, 0.1, 0.1, 0, 0]
"""The brake is pressed until 4 s, the accelerator from 2 s to 3 s."""


@pytest.mark.parametrize("kind", [AutomaticCar, VariatorCar])
def test_the_clutch_opens_while_only_the_brake_is_pressed(kind: Any) -> None:
    """Then the turbine turns with the idling engine; it stands when both pedals are pressed; with neither the car creeps."""
    car = kind(driver=OpenPedals(), start=NeutralIdleConverter())
    run = pt.simulate(car, 6, inputs={"driver.brake_pedal": BRAKE, "driver.accelerator_pedal": ACCELERATOR})
    idle = float(car.engine.w_idle)
    alone, both, again = run.at([1.9, 2.9, 3.9], "start.turbine.w")
    assert alone == pytest.approx(idle, rel=0.02)
    assert both == pytest.approx(0, abs=0.1)
    assert again == pytest.approx(idle, rel=0.1)
    held, creeps = run.at([3.9, 6.0], "body.v")
    assert held == pytest.approx(0, abs=1e-3)
    assert creeps > 0.3


@pytest.mark.slow
def test_the_backward_calculation_idles_like_the_standing_car() -> None:
    """The converter drags the engine in neither."""
    car = VariatorCar(start=NeutralIdleConverter())
    cycle = DriveCycle(name="rest and start", table=((0.0, 0.0), (60.0, 0.0), (70.0, 5.0)))
    fuel = drive_cycle(car, cycle).result.at([20.0, 40.0], "engine.fuel")
    assert backward(car, cycle).fuel_rate[0] == pytest.approx((fuel[1] - fuel[0]) / 20, rel=1e-6)
