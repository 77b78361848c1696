"""Cars with a fixed gear: gears that the gearbox does not have, and driving in reverse."""

from __future__ import annotations

from typing import Any

import pytest
from cases import few

import powertrain as pt
from powertrain.components.control import FixedGear, OpenPedals
from powertrain.components.transmissions import EIGHT_SPEED, SIMPSON_THREE, Automatic, GearScheme
from powertrain.trials.gears import in_gear
from powertrain.trials.operating import operating_map
from powertrain.vehicles import AutomaticCar, DualClutchCar, ManualCar, ParallelHybrid

FORWARD_ONLY = GearScheme(SIMPSON_THREE.levers, SIMPSON_THREE.elements, SIMPSON_THREE.forward)
CARS: list[tuple[Any, dict[str, Any], int]] = [
    (ManualCar, {}, 6),
    (DualClutchCar, {}, 6),
    (AutomaticCar, {}, 8),
    (AutomaticCar, {"gearbox": Automatic()}, 3),
    (ParallelHybrid, {}, 6),
]


@pytest.mark.parametrize(("kind", "parts", "last"), CARS)
def test_gears_that_the_gearbox_does_not_have(kind: Any, parts: dict[str, Any], last: int) -> None:
    """A manual gearbox was in neutral there, a power-shift gearbox in its highest gear."""
    car = kind(schedule=FixedGear(gear=last), **parts)
    with pytest.raises(pt.ParameterError, match=rf"gear_count .*\n.* schedule.gear = {last + 1}"):
        kind(schedule=FixedGear(gear=last + 1), **parts)
    with pytest.raises(pt.ParameterError, match=rf"schedule.gear = {last + 1}"):
        pt.simulate(car, 0.1, parameters={"schedule.gear": last + 1})


def test_cars_without_a_reverse_gear() -> None:
    cars: list[Any] = [ManualCar(), AutomaticCar(), AutomaticCar.with_gearset(Automatic.of(FORWARD_ONLY))]
    for car in cars:
        with pytest.raises(pt.ParameterError, match=r"has_reverse .*\n.* schedule.gear = -1"):
            pt.replace(car, schedule=FixedGear(gear=-1))


@pytest.mark.slow
def test_driving_in_reverse() -> None:
    """At the end of the run the turbine and the wheels have the speeds of the reverse gear, and the energy closes."""
    car: Any = AutomaticCar.with_gearset(Automatic.eight_speed(), schedule=FixedGear(gear=-1), driver=OpenPedals())
    result = pt.simulate(car, 4.0, inputs={"driver.accelerator_pedal": ([0.0, 0.5, 4.0], [0.0, 0.3, 0.3])}, rtol=1e-6)
    wheel = result["body.v"][-1] / float(car.front.wheels.radius)
    assert wheel < -3.0
    assert result["start.converter.w_b"][-1] / (3.2 * wheel) == pytest.approx(EIGHT_SPEED.ratio("R"), rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


@pytest.mark.parametrize("kind", few([ManualCar, AutomaticCar]))
def test_one_gear_of_a_car_is_a_fixed_gear(kind: Any) -> None:
    """Every gear alone, for maps: the force over the engine's torque is in proportion to the ratio."""
    car = kind()
    found = [operating_map(in_gear(car, k), [20.0], [0.6]) for k in (4, 6)]
    speeds = [float(each["w"].item()) for each in found]
    four, six = (car.gearbox.gear_ratios[k - 1] for k in (4, 6))
    assert speeds[0] / speeds[1] == pytest.approx(four / six, rel=1e-3)
