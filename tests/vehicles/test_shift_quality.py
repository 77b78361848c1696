"""Figures of shifts with every kind of schedule, and of shifts that follow one another closely."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.control import FixedGear, GearSchedule, OpenPedals, PowerShiftSchedule, SpeedSchedule
from powertrain.trials import shift_quality, shifts
from powertrain.trials.shift_figure import plot_shift
from powertrain.vehicles import DualClutchCar
from powertrain.vehicles.dual_clutch_car import SPEEDS


def driven(schedule: SpeedSchedule | FixedGear, stop: float) -> pt.Result[DualClutchCar]:
    car = DualClutchCar(driver=OpenPedals(), schedule=schedule)
    return pt.simulate(car, stop, inputs={"driver.accelerator_pedal": ([0.0, stop], [0.6, 0.6])})


def heat(result: pt.Result[DualClutchCar], start: float, stop: float) -> float:
    """Torque times slip of both clutches and all synchronisers, J."""
    t = np.arange(start, stop, 1e-4)
    box, parts = result.model.gearbox, ["odd_clutch", "even_clutch"]
    parts += [f"synchronisers[{k}]" for k in range(box.gear_count)]
    power = [result.at(t, f"gearbox.{part}.tau") * result.at(t, f"gearbox.{part}.w_rel") for part in parts]
    return float(np.trapezoid(np.sum(power, axis=0), t))


@pytest.mark.slow
def test_a_shift_that_interrupts_the_torque() -> None:
    """Its duration is that of three stages: 0.7 s."""
    result = driven(GearSchedule(speeds=SPEEDS), 8.0)
    first = shift_quality(result).iloc[0]
    assert (first["from"], first["to"]) == (1, 2)
    assert first["slip energy"] == pytest.approx(heat(result, first["time"], first["time"] + 1.0), rel=5e-3)
    shaded: Any = plot_shift(result)[0].patches[0]
    assert shaded.get_width() == pytest.approx(0.7)


@pytest.mark.slow
def test_shifts_that_follow_closely_share_no_heat() -> None:
    """Low shift speeds and a dwell as short as a shift: the figures of two shifts used to contain the same 0.3 s."""
    low = tuple((3.0 + 0.3 * k, 1.0 + 0.3 * k) for k in range(5))
    result = driven(PowerShiftSchedule(speeds=low, t_shift=0.8, dwell=0.8, eager=0), 12.0)
    table = shift_quality(result)
    assert np.diff(table["time"]).min() < 0.81
    ends = [min(one + 1.1, other) for one, other in zip(table["time"], [*table["time"][1:], 12.0], strict=True)]
    expected = [heat(result, start, end) for start, end in zip(table["time"], ends, strict=True)]
    np.testing.assert_allclose(table["slip energy"], expected, rtol=1e-2, atol=1.0)


@pytest.mark.slow
def test_a_fixed_gear_does_not_shift() -> None:
    result = driven(FixedGear(gear=1), 0.5)
    for figures in (shifts, shift_quality, plot_shift):
        with pytest.raises(pt.ParameterError, match=r"DualClutchCar.schedule does not shift"):
            figures(result)
