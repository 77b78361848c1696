"""The temperature of an electric machine: two heat balances, and the torque that it leaves."""

from __future__ import annotations

import numpy as np
import pytest
from cases import few
from scipy.linalg import expm
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components.body import VehicleBody
from powertrain.components.cycles import DriveCycle
from powertrain.components.electric import (
    ConditionedMachine,
    ElectricMachine,
    LiquidCooledMachine,
    MachineCooling,
    VoltageSource,
)
from powertrain.components.rotational import ConstantSpeed
from powertrain.trials import drive_cycle
from powertrain.trials.anatomy import value_at
from powertrain.trials.operating import on_rolling_road
from powertrain.vehicles import ElectricCar, ElectricFourWheelDriveCar, ParallelHybrid, PowerSplitHybrid, SeriesHybrid

COOLING = LiquidCooledMachine(C=2e3, C_housing=9e3, G=60, G_liquid=150, T_liquid=330)


class Bench(pt.Component):
    """A machine at 300 rad/s that is asked for a constant torque."""

    machine: ElectricMachine = ElectricMachine()
    cooling: MachineCooling = COOLING
    drive: ConstantSpeed = ConstantSpeed(w_fixed=300)
    source: VoltageSource = VoltageSource()
    demand: pt.Input = pt.signal_input("N.m", "Torque demand")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.bus, self.machine.bus)
        yield pt.connect(self.machine.shaft, self.drive.flange)
        yield pt.connect(self.machine.heat_port, self.cooling.machine)
        yield pt.connect(self.demand, self.machine.torque_demand)


def test_winding_and_housing_warm_up_as_by_the_matrix_exponential() -> None:
    run = pt.simulate(Bench(), 300, inputs={"demand": 80.0}, rtol=1e-10)
    matrix = np.array([[-60 / 2e3, 60 / 2e3, 0], [60 / 9e3, -(60 + 150) / 9e3, 0], [0, 0, 0]])
    matrix[0, 2] = float(run["machine.lossPower"][0]) / 2e3
    for at in range(0, len(run.time), len(run.time) // 10):
        winding, housing, _ = expm(matrix * run.time[at]) @ [0, 0, 1]
        assert run["cooling.T"][at] == pytest.approx(330 + winding, rel=1e-8)
        assert run["cooling.T_housing"][at] == pytest.approx(330 + housing, rel=1e-8)


@pytest.mark.parametrize(("T", "share"), [(293.15, 1.0), (433.15, 1.0), (443.15, 0.5), (453.15, 0.0), (500.0, 0.0)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_hot_winding_leaves_less_torque(T: float, share: float, sign: int) -> None:
    """50 kW at 300 rad/s are 166.7 N.m; they fade out over the 20 K below 453.15 K."""
    run = pt.simulate(Bench(cooling=ConditionedMachine(T=T)), 1, inputs={"demand": sign * 1e3})
    assert run["machine.tau"][-1] == pytest.approx(sign * share * 50e3 / 300)
    assert ElectricMachine().full_load(300, T=T) == pytest.approx(share * 50e3 / 300)


def test_the_continuous_torque() -> None:
    """Where the temperature of the losses leaves the torque that causes them."""
    machine = ElectricMachine(copper=0.3)

    def left(tau: float) -> float:
        loss = 50 + 0.3 * tau**2 + 300 + 1e-3 * 300**2
        T = 330 + loss * (1 / 60 + 1 / 150)
        return 50e3 / 300 * (453.15 - T) / 20 - tau

    run = pt.simulate(Bench(machine=machine), 2000, inputs={"demand": 1e3})
    assert run["machine.tau"][0] == pytest.approx(50e3 / 300)
    assert run["machine.tau"][-1] == pytest.approx(brentq(left, 0, 200), rel=1e-5)
    held = pt.steady(Bench(machine=machine), {"demand": [1e3]}, outputs=["machine.tau"])
    assert float(held["machine.tau"].values.item()) == pytest.approx(brentq(left, 0, 200), rel=1e-9)


@pytest.mark.parametrize(
    "kind", few([ElectricCar, ElectricFourWheelDriveCar, SeriesHybrid, ParallelHybrid, PowerSplitHybrid], 2)
)
def test_every_machine_of_a_car_can_be_cooled(kind: type[pt.Component]) -> None:
    """The heat of the losses is in winding, housing and liquid."""
    car = kind()
    slots = [name for name, field in car._fields.items() if isinstance(getattr(car, name, None), MachineCooling)]
    run = drive_cycle(pt.replace(car, dict.fromkeys(slots, COOLING)), DriveCycle.named("udds").part(0, 60)).result
    for slot in slots:
        T, housing, lost = run[f"{slot}.T"], run[f"{slot}.T_housing"], run[f"{slot.removesuffix('_cooling')}.lossPower"]
        assert T[0] == housing[0] == 330
        taken = np.trapezoid(lost - 150 * (housing - 330), run.time)
        assert 2e3 * (T[-1] - 330) + 9e3 * (housing[-1] - 330) == pytest.approx(taken, rel=2e-2)


def test_a_car_that_pulls_uphill_gets_slower_as_its_machine_warms_up() -> None:
    """Its control knows the torque that is left: what it demands is what the machine gives."""
    cooling = LiquidCooledMachine(C=1e3, C_housing=5e3, G=20, G_liquid=60, T_liquid=360)
    cycle = DriveCycle("hill", ((0, 0), (10, 25), (400, 25)), grades=(0.12, 0.12, 0.12))
    run = drive_cycle(ElectricCar(machine_cooling=cooling, body=VehicleBody(m=2600, A=2.3, Cd=0.25)), cycle)
    assert run.audit.closure < 1e-6
    assert run.result["body.v"][-1] < 24 < run.result["body.v"].max()
    assert 433 < run.result["machine_cooling.T"][-1] < 453
    np.testing.assert_allclose(run.result["control.tau"], run.result["machine.tau"], atol=1e-6)


def test_in_maps_the_winding_is_as_warm_as_the_liquid() -> None:
    car = on_rolling_road(ElectricCar(machine_cooling=COOLING))
    assert value_at(car, "machine_cooling") == ConditionedMachine(T=330)


def test_a_temperature_in_place_of_a_range_is_rejected() -> None:
    """20 degC are 293.15 K, over which no torque would fade out."""
    with pytest.raises(pt.ParameterError, match=r"T_band = 293\.15 K is outside its range \(0, 200\] K"):
        ElectricMachine(T_band="20 degC")  # type: ignore[arg-type]
