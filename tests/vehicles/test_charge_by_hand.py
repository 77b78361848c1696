"""Corrections to equal charge, from numbers of runs that are easily computed by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from powertrain.trials import CycleRun, charge_corrected
from powertrain.trials.charge import ChargeSustaining, beyond_correction


def run(battery: float, flywheel: float = 0.0) -> CycleRun:
    """5 l/100 km, a kilogram of fuel with 40 MJ, a marginal efficiency of 40 %, and stores that gained energy [J]."""
    known: dict[str, Any] = {"fuel": 1.0, "heat": 40e6, "litres_per_100km": 5.0, "marginal_efficiency": 0.4}
    known["anatomy"] = SimpleNamespace(vehicle="Car", stores=("battery", "flywheel"))
    known["audit"] = SimpleNamespace(components=pd.DataFrame({"stored": {"battery": battery, "flywheel": flywheel}}))
    return object.__new__(type("Known", (CycleRun,), known))


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
