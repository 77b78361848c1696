"""The temperature of a battery: warmed by its losses, and in a car on a cold day."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cases import few
from electric_rigs import Current

import powertrain as pt
from powertrain.components.cycles import DriveCycle
from powertrain.components.electric import Battery, BatteryCooling, ConditionedBattery, PassivelyCooledBattery
from powertrain.trials import drive_cycle, driveline_map
from powertrain.trials.anatomy import value_at
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles import ElectricCar, ElectricFourWheelDriveCar, ParallelHybrid, PowerSplitHybrid, SeriesHybrid

COLD = 263.15


class Discharged(pt.Component):
    """A battery that gives 100 A."""

    battery: Battery = Battery(R=0.2, Q=1e6)
    cooling: BatteryCooling = PassivelyCooledBattery(C=1e5, G=20.0, T_air=COLD)
    draw: Current = Current(i=100.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.heat_port, self.cooling.battery)
        yield pt.connect(self.battery.bus, self.draw.bus)


def test_warms_up_exponentially() -> None:
    """2 kW of losses over 20 W/K are 100 K in the end, with a time constant of 5,000 s."""
    run = pt.simulate(Discharged(), 3000.0, rtol=1e-9)
    np.testing.assert_allclose(run["cooling.T"], COLD + 100 * (1 - np.exp(-run.time / 5000)), rtol=1e-8)
    warm = pt.simulate(Discharged(), 10.0, starts={"cooling.T": "20 degC"})
    assert warm["cooling.T"][0] == 293.15


def test_a_constant_temperature() -> None:
    """A cold resistance is larger by exp(B (1/T - 1/293.15 K))."""
    cold = Discharged(battery=Battery(R=0.2, Q=1e6, B=2000.0), cooling=ConditionedBattery(T=COLD))
    run = pt.simulate(cold, 10.0)
    assert run["battery.heat_port.T"][-1] == COLD
    expected = 0.2 * math.exp(2000 * (1 / COLD - 1 / 293.15)) * 100**2
    assert run["battery.lossPower"][-1] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("kind", few([ElectricCar, ElectricFourWheelDriveCar]))
def test_cars_on_a_cold_day(kind: type[pt.Component]) -> None:
    """The losses of the battery rise with its resistance, 2.18 times that at 20 degC, as all of it acts at once."""
    drive = DriveCycle.named("udds").part(0, 60)
    days = ConditionedBattery(), ConditionedBattery(T=COLD), PassivelyCooledBattery(T_air=COLD)
    lost = []
    for cooling in days:
        run = drive_cycle(pt.replace(kind(), {"battery_cooling": cooling, "battery.ohmic": 0.99}), drive)
        assert run.audit.closure < 1e-6
        lost.append(float(run.audit.components["lost"]["battery"]))
    assert lost[1] == pytest.approx(2.18 * lost[0], rel=0.05)
    assert lost[1] * 0.99 < lost[2] < lost[1]


@pytest.mark.parametrize("kind", few([SeriesHybrid, PowerSplitHybrid, ParallelHybrid]))
def test_hybrids_on_a_cold_day(kind: type[pt.Component]) -> None:
    car = pt.replace(kind(), {"battery_cooling": PassivelyCooledBattery(C=1e3, T_air=COLD)})
    run = drive_cycle(car, DriveCycle.named("udds").part(0, 40))
    T, lost = run.result["battery.heat_port.T"], run.result["battery.lossPower"]
    assert T[0] == COLD
    assert T[-1] > COLD + 0.5
    heat = np.trapezoid(lost - 10 * (T - COLD), run.result.time)
    assert T[-1] - COLD == pytest.approx(heat / 1e3, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ParallelHybrid, SeriesHybrid, PowerSplitHybrid])
def test_recovery_in_the_cold_keeps_the_voltage_of_the_cells(kind: type[pt.Component]) -> None:
    """At -20 degC braking drove 56 cells to 4.4 to 4.5 V each."""
    car = pt.replace(kind(), {"battery_cooling": ConditionedBattery(T=253.15)})
    run = drive_cycle(car, DriveCycle.named("udds").part(0, 130)).result
    assert run["battery.bus.v"].max() < 56 * 4.2
    assert run["battery.i"].max() > 20.0


def test_operating_points_have_the_temperature_of_the_air() -> None:
    """In a map a battery of its own would settle at the temperature of hours at every point."""
    car = ElectricCar(battery_cooling=PassivelyCooledBattery(T_air=COLD))
    held = value_at(on_rolling_road(car), "battery_cooling")
    assert isinstance(held, ConditionedBattery)
    assert float(held.T) == COLD
    found = driveline_map(car, [10.0], [0.3])
    assert int(found.status.values.item()) == 0


class CooledByLiquid(BatteryCooling):
    """A user's own, with a temperature of its own in maps."""

    T_liquid: pt.Parameter = pt.parameter("K", "Temperature of the liquid", default=COLD)

    def equations(self) -> pt.Equations:
        yield self.battery.Q_flow == 50 * (self.battery.T - self.T_liquid)

    def steady(self) -> ConditionedBattery:
        return ConditionedBattery(T=float(self.T_liquid))


def test_a_cooling_of_a_users_own_says_its_temperature_in_maps() -> None:
    car = on_rolling_road(ElectricCar(battery_cooling=CooledByLiquid()))
    assert value_at(car, "battery_cooling") == ConditionedBattery(T=COLD)
