"""The weight in the backward calculation: its work over a road, and a car that stands on a slope."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import powertrain as pt
from powertrain.components.body import RoadProfile
from powertrain.components.cycles import DriveCycle
from powertrain.trials import drive_cycle
from powertrain.trials.backward import backward, demand
from powertrain.trials.cycle import on_cycle
from powertrain.vehicles import ManualCar

WEIGHT = 1300 * 9.80665
"""Of the car, N."""


def climbing(car: pt.Component, cycle: DriveCycle) -> np.ndarray:
    """The work against the weight in every row [J]: the force on a road less that on the level one."""
    level = DriveCycle(cycle.name, cycle.table)
    force = demand(car, cycle)[1] - demand(ManualCar(), level)[1]
    return force * (cycle.speeds[1:] + cycle.speeds[:-1]) / 2 * np.diff(cycle.times)


def test_the_weight_does_the_work_of_the_heights() -> None:
    """Half a kilometre a row, up and down: the slope in the middle of a row is steeper than the mean."""
    heights = np.array([0.0, 20.0, 0.0, 30.0, 30.0])
    cycle = DriveCycle.from_distance("hills", [0, 500, 1000, 1500, 2000], [0, 15, 15, 15, 0], heights=heights.tolist())
    np.testing.assert_allclose(climbing(ManualCar(), cycle), WEIGHT * np.diff(heights), atol=1e-3)


def test_the_road_of_an_earlier_cycle_is_gone() -> None:
    """As in ``drive_cycle``: a level cycle after a hilly one is driven on the level, and a road of the vehicle's own stays."""
    table = ((0.0, 0.0), (10.0, 15.0), (30.0, 15.0), (40.0, 0.0))
    level = DriveCycle("level", table)
    hilly = on_cycle(ManualCar(), DriveCycle("hilly", table, grades=(0.0, 0.06, 0.06, 0.0)))
    assert climbing(hilly, level).tolist() == [0, 0, 0]
    own = ManualCar(road=RoadProfile(profile=pt.Map.constant(0.06, x="s", x_unit="m", name="grade")))
    assert climbing(on_cycle(own, level), level) == pytest.approx(
        WEIGHT * 0.06 / np.hypot(1, 0.06) * np.array([75, 300, 75])
    )


@pytest.mark.parametrize("method", ["linear", "smooth"])
def test_the_weight_does_the_work_of_a_road_within_a_row(method: str) -> None:
    """Two minutes at 20 m/s in one row, over several hills."""
    places, grades = np.linspace(0, 2400, 13), 0.06 * np.sin(np.arange(13) ** 1.5)
    profile = pt.Map.curve(places, grades, x="s", x_unit="m", name="grade", outside="clip", method=method)  # type: ignore[arg-type]
    work = climbing(ManualCar(road=RoadProfile(profile=profile)), DriveCycle("cruise", ((0, 20), (100, 20), (130, 20))))

    def rise(low: float, high: float) -> float:
        inside = places[(places > low) & (places < high)]
        return float(quad(lambda s: np.sin(np.arctan(profile(s))), low, high, points=inside, limit=200)[0])

    np.testing.assert_allclose(work, [WEIGHT * rise(0, 2000), WEIGHT * rise(2000, 2600)], rtol=1e-7)


@pytest.mark.slow
def test_a_car_that_stands_on_a_slope_idles() -> None:
    """Its brakes hold it, uphill and downhill; the engine burns what it burns on a level road."""
    table = ((0.0, 0.0), (10.0, 0.0), (20.0, 10.0), (30.0, 0.0), (60.0, 0.0))
    level = backward(ManualCar(), DriveCycle("level", table))
    for grade in 0.08, -0.08:
        run = backward(ManualCar(), DriveCycle("slope", table, grades=(grade,) * 5))
        assert run.force[[0, 3]].tolist() == [0, 0]
        assert run.fuel_rate[[0, 3]].tolist() == level.fuel_rate[[0, 3]].tolist()
        assert (run.fuel_rate[1] > level.fuel_rate[1]) == (grade > 0)


@pytest.mark.slow
@pytest.mark.parametrize(("grade", "gear"), [(0.15, 1), (0.0, 2)])
def test_a_climb_is_in_the_gear_of_the_simulation(grade: float, gear: int) -> None:
    """At 5 m/s a shift of 0.7 s on 15 % costs 0.7 g sin(alpha) = 1.02 m/s, after which the downshift at 4 m/s would follow."""
    speeds = ((4.5, 4.0), (8.0, 7.5), (12.0, 11.5), (16.5, 16.0), (21.0, 20.5))
    car = pt.replace(ManualCar(), {"schedule.speeds": speeds, "schedule.eager": 0.05})
    cycle = DriveCycle("climb", ((0.0, 1.0), (5.0, 5.0), (20.0, 5.0)), grades=(grade,) * 3)
    assert backward(car, cycle).gears[-1] == gear
    assert drive_cycle(car, cycle).result["schedule.gear"][-1] == gear
