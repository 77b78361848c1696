"""Accessories at the crankshaft, and those that a battery supplies while it stands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import TimeTable
from powertrain.components.engines import AccessoryDrive, BufferedAccessories
from powertrain.components.engines.accessories import Accessories

STOP = TimeTable(table=((0.0, 80.0), (50.0, 80.0), (50.001, 0.0), (70.0, 0.0), (70.001, 80.0)))
"""A crankshaft that stands from 50 s to 70 s."""


def taken(accessories: Accessories) -> tuple[Any, float]:
    """The energy [kJ] from the crankshaft in 500 s."""
    parts = accessories, rot.Speed(exact=True), STOP
    result = run(joined(*parts, joints="0.flange=1.flange 2.y=1.w_ref"), 500)
    times = np.linspace(0, 500, 50_001)
    power = result.at(times, "parts[0].flange.tau") * result.at(times, "parts[0].w")
    return result, float(np.trapezoid(power, times)) / 1e3


def test_a_drive_takes_its_power_while_the_crankshaft_turns() -> None:
    assert taken(AccessoryDrive(P=400))[1] == pytest.approx(0.4 * 480, rel=1e-3)


def test_a_battery_is_charged_with_what_it_supplied_at_rest() -> None:
    """400 W for 500 s although the crankshaft stands for 20 s; just after the stop they are 400 W + 8 kJ/20 s."""
    result, energy = taken(BufferedAccessories(P=400, T_charge=20))
    assert energy == pytest.approx(0.4 * 500, rel=1e-3)
    assert result.at([69.9], "parts[0].owed")[0] == pytest.approx(0.4e3 * 19.9, rel=1e-3)
    assert result.at([70.1], "parts[0].flange.tau")[0] * 80 == pytest.approx(800, rel=1e-2)
    assert pt.energy_audit(result).closure < 1e-6


def test_the_charging_power_is_limited_after_a_long_stop() -> None:
    """400 W for 1,000 s at rest are 400 kJ, for which 400 kJ/60 s = 6.7 kW would be too much for an idling engine."""
    long = TimeTable(table=((0.0, 80.0), (50.0, 80.0), (50.001, 0.0), (1050.0, 0.0), (1050.001, 80.0)))
    parts = BufferedAccessories(P=400), rot.Speed(exact=True), long
    result = run(joined(*parts, joints="0.flange=1.flange 2.y=1.w_ref"), 2000)
    torque = result.at([1051.0, 1200.0, 1350.0], "parts[0].flange.tau")
    np.testing.assert_allclose(torque * 80, 1400, rtol=1e-6)
    assert result.at([1380.0], "parts[0].owed")[0] == pytest.approx(70e3, rel=2e-3)
    assert result["parts[0].owed"][-1] == pytest.approx(0, abs=10)
    assert pt.energy_audit(result).closure < 1e-6
