"""Consumption and its correction to equal charge, from numbers of a run that are easily computed by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from powertrain.trials import CycleRun, charge_corrected
from powertrain.trials.anatomy import Anatomy
from powertrain.trials.charge import ChargeSustaining, beyond_correction


def run(battery: float = 0.0, flywheel: float = 0.0, **known: Any) -> CycleRun:
    """100 km with 5 l/100 km, a kilogram of fuel with 40 MJ, a marginal efficiency of 40 %, and stores that gained energy [J]."""
    audit = SimpleNamespace(components=pd.DataFrame({"stored": {"battery": battery, "flywheel": flywheel}}))
    one = (("body", "body"),)
    parts = Anatomy("Car", one, ("engine",), (), ("battery",), ("wheels",), (), stores=("battery", "flywheel"))
    numbers = {"distance": 100e3, "fuel": 1.0, "heat": 40e6, "litres_per_100km": 5.0, "marginal_efficiency": 0.4}
    return object.__new__(type("Known", (CycleRun,), {**numbers, "anatomy": parts, "audit": audit, **known}))


class Course(dict[str, Any]):
    """Signals over time, as those of a result."""

    def __init__(self, time: list[float], **signals: list[float]) -> None:
        super().__init__({name.replace("__", "."): np.array(values) for name, values in signals.items()})
        self.time = np.array(time)


def test_miles_per_gallon_count_electricity_as_gasoline() -> None:
    """235.215 mpg are 1 l/100 km; a gallon of gasoline has 33.705 kW.h, and those that were gained do not count."""
    gallon = 33.705 * 3.6e6
    assert run().mpg() == pytest.approx(235.214583 / 5)
    assert run(battery=gallon).mpg() == pytest.approx(235.214583 / 5)
    assert run(battery=-gallon, litres_per_100km=0.0).mpg() == pytest.approx(100 / 1.609344)
    assert run(battery=-gallon, litres_per_100km=378.5411784 / 100).mpg(0.5) == pytest.approx(100 / 1.609344 / 3)


def test_energy_of_the_battery() -> None:
    assert run(battery=-3.6e6, flywheel=7.0).wh_per_km == pytest.approx(10.0)
    assert run(battery=-3.6e6).net_energy_change == pytest.approx(-0.09)


def test_the_energy_demand_is_the_positive_work_of_body_and_wheels() -> None:
    """1 kW at the body, 1 kW for the inertia of the wheels, 0.3 kW that they get back from the road; then the car slows down."""
    course = Course(
        [0.0, 4.0, 4.0, 9.0],
        body__front__f=[60.0, 60.0, -60.0, -60.0],
        body__rear__f=[40.0] * 4,
        wheels__hub__tau=[50.0, 50.0, -50.0, -50.0],
        wheels__w=[20.0] * 4,
        wheels__f=[30.0] * 4,
        wheels__v=[10.0] * 4,
    )
    assert run(result=course, speed=np.full(4, 10.0)).demand == pytest.approx(4 * 1700.0)


def test_energy_gained_is_work_of_the_engine() -> None:
    """0.8 MJ took 2 MJ of fuel, a twentieth; with a loss of a fifth on the way 2.5 MJ."""
    assert charge_corrected(run(0.8e6)) == pytest.approx(5 * 0.95)
    assert charge_corrected(run(0.8e6), path=0.8) == pytest.approx(5 * 0.9375)
    assert charge_corrected(run(1.0e6, -1.8e6)) == pytest.approx(5 * 1.05)
    assert charge_corrected(run(0.8e6, 1e6), "battery") == pytest.approx(5 * 0.95)


@pytest.mark.parametrize(("gained", "said"), [(1.9e6, ""), (-1.9e6, ""), (4e6, "gained 10%"), (-4e6, "gave 10%")])
def test_a_correction_holds_up_to_a_twentieth_of_the_energy_of_the_fuel(gained: float, said: str) -> None:
    found = beyond_correction(run(gained))
    assert said in found
    assert bool(found) == bool(said)


def test_the_test_nearest_to_equal_charge_is_corrected_along_the_line() -> None:
    """Slopes of 0.02 l/100 km and of 0.5 g/km per W.h/km."""
    columns = {"charge": [-30.0, 5.0, 40.0], "consumption": [4.0, 5.0, 5.6], "carbon dioxide": [90.0, 115.0, 130.0]}
    for change, sustains in ((0.009, True), (-0.009, True), (0.011, False), (-0.011, False)):
        tests = pd.DataFrame({**columns, "net energy change": [-0.2, change, 0.2]})
        found = ChargeSustaining(tests, K_fuel=0.02, K_co2=0.5)
        assert found.litres_per_100km == pytest.approx(5.0 - 0.02 * 5)
        assert found.co2_per_km == pytest.approx(115.0 - 0.5 * 5)
        assert found.sustains == sustains
