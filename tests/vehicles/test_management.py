"""Energy management of the hybrids: maps against single operating points, plans against their replay in the full model."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.control import PlannedPowerSplit
from powertrain.components.cycles import DriveCycle
from powertrain.trials import flywheel_management, power_split_management
from powertrain.trials.management import Management, looked_up
from powertrain.trials.management_power_split import MARGIN, PowerSplitBench
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid

HILLS = DriveCycle.named("udds").part(0, 340)


def test_tables_are_looked_up_by_force() -> None:
    speeds, level = np.array([1.0, 2.0, 4.0]), np.linspace(-1, 1, 5)
    pushed = (speeds[:, None] * level)[:, :, None]
    power = pushed * speeds[:, None, None]
    v, force = np.array([1.0, 3.0, 3.0, 3.0]), np.array([0.3, 1.5, -9.0, 9.0])
    (found,) = looked_up(speeds, pushed, [power], v, force)
    # between the speeds 2 and 4 pushed is 3 level and power 10 level
    np.testing.assert_allclose(found[:, 0], [0.3, 1.5 * 10 / 3, -10.0, np.nan])


@pytest.mark.parametrize("method", ["ecms", "DP", 1])
def test_a_plan_by_an_unknown_method_is_an_error(method: Any) -> None:
    """It used to be the plan of dynamic programming."""
    stages = pt.Stages(np.ones(1), np.array([0.0, 1.0]), np.zeros((1, 1, 1, 2)), np.zeros((1, 1, 1, 2)))
    unused: Any = None
    management = Management(unused, unused, HILLS, stages, 0.5, 1.0, unused, unused, "battery.soc")
    with pytest.raises(pt.ParameterError, match=r"method=.* must be one of dynamic programming, ECMS"):
        management.plan(method)


def test_torques_that_the_planned_control_may_request() -> None:
    """From full recovery, of which half is left at 1.5 m/s, to what battery and engine give."""
    control = SimpleNamespace(tau_full=500.0, w_fade=20.0, v_fade=3.0, F_most=5e3)
    speeds = np.array([1.5, 10.0, 30.0])
    ring = xr.DataArray(30.0 * speeds, dims="speed", coords={"speed": speeds})
    bench: Any = SimpleNamespace(
        vehicle=SimpleNamespace(control=control), ring=ring, charge=20e3, discharge=10e3 / MARGIN
    )
    torque = PowerSplitBench._wanted(bench, 5e3).transpose("speed", "level").values
    np.testing.assert_allclose(torque[:, 0], [-0.5 * 7.5e3 / 45, -20e3 / 300, -20e3 / 900])
    np.testing.assert_allclose(torque[:, -1], [15e3 / 45, 15e3 / 300, 15e3 / 900])
    assert np.ptp(np.diff(torque), axis=1) == pytest.approx(0.0, abs=1e-9)
    bench.ring = ring / 10  # at 3 rad/s per m/s, below 20 rad/s, less is left, and powers count as at 20 rad/s
    torque = PowerSplitBench._wanted(bench, 5e3).transpose("speed", "level").values
    np.testing.assert_allclose(torque[0, [0, -1]], [-0.225 * 7.5e3 / 20, 500.0])


@pytest.mark.slow
def test_operating_points_of_the_power_split_balance() -> None:
    """Power of fuel and battery less all losses is what pushes the road: checked with the losses that the parts report."""
    bench = PowerSplitBench(PowerSplitHybrid(), np.array([5.0, 20.0]), np.array([10e3, 30e3]))
    on = bench.on
    assert (on["status"] == 0).all()
    charging = on["der(battery.soc)"].isel(level=0)
    assert (charging > on["der(battery.soc)"].isel(level=-1)).all(), "what drives discharges"
    assert (on["engine.fuel_rate"].diff("power") > 0).all()
    heat = on["engine.fuel_rate"] * 43e6
    assert float((10e3 / heat.sel(power=10e3)).max()) < 0.4
    level = on["body.force"] * on["speed"]
    voltage = 56 * 3.78
    stored = on["der(battery.soc)"] * 6.5 * 3600 * voltage
    efficiency = (level + stored) / heat
    assert float(efficiency.max()) < 0.4, "no more than the engine's indicated efficiency comes out"


@pytest.mark.slow
def test_the_power_split_without_fuel_is_that_of_its_control() -> None:
    """At 33 m/s machine 1 turns the engine, as it would turn too fast itself with a stopped one: the battery pays for the drag."""
    car, speeds = PowerSplitHybrid(), np.array([20.0, 33.0])
    off = PowerSplitBench(car, speeds, np.array([10e3])).off.sel(soc=0.6).transpose("speed", "level")
    plant = pt.compile(on_rolling_road(car, {"control.running"}))
    grid: dict[str, Any] = {
        "body.speed": speeds,
        "driver.accelerator_set": 0.1,
        "battery.soc": 0.6,
        "control.running": 0.0,
    }
    inputs = {name: one.value for name, one in plant.compiled.inputs.items() if name not in grid}
    driven = pt.steady(plant, grid, inputs=inputs, outputs=["body.force", "engine.w"], first=True, progress=False)
    np.testing.assert_allclose(driven["engine.w"], [0.0, 30.3], atol=0.1)
    for k, force in enumerate(driven["body.force"].values.ravel()):
        rate = np.interp(force, off["body.force"][k], off["der(battery.soc)"][k])
        assert rate == pytest.approx(float(driven["der(battery.soc)"].values.ravel()[k]), rel=3e-3)


def test_the_planned_control_does_as_it_is_told() -> None:
    given = {"accelerator": 0.2, "brake": 0.0, "v": 10.0, "w": 200.0, "w_ring": 130.0, "soc": 0.6}
    given |= {"w_best": 200.0, "tau_open": 100.0, "opening": 0.5, "limit": 450.0}
    run = pt.simulate(
        PlannedPowerSplit(), 2.0, inputs={**given, "engine_on": ([0, 1, 1, 2], [0, 0, 1, 1]), "engine_power": 12e3}
    )
    times = np.array([0.5, 1.5])
    assert run.at(times, ["on"])["on"].tolist() == [0.0, 1.0]
    torque = 12e3 / 200
    assert run.at(times, ["torque"])["torque"] == pytest.approx([0.0, torque])
    assert run.at(times, ["tau_1"])["tau_1"] == pytest.approx([0.0, -torque / 3.6])
    assert run.at(times, ["tau_2"])["tau_2"] == pytest.approx([90.0, 90.0 - 2.6 / 3.6 * torque])


@pytest.mark.slow
@pytest.mark.parametrize("hybrid", ["power split", "flywheel"])
def test_plans_hold_in_the_full_model(hybrid: str) -> None:
    """Both follow the cycle; what is planned comes out within the transients that maps leave out; knowing the cycle does not cost fuel."""
    power = hybrid == "power split"
    task = power_split_management(PowerSplitHybrid(), HILLS) if power else flywheel_management(FlywheelHybrid(), HILLS)
    table = task.compare().table
    assert (table["outside"] == 0).all()
    assert table["gap"].abs().max() < 5.0
    assert float(table["saved"].to_numpy()[1]) > 0.5, "dynamic programming"
