"""Controls keep the battery within its limits: losses of machines, accessories and the generator count."""

from __future__ import annotations

import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.components.control import ElectricDriveControl, SetPedals
from powertrain.components.cycles import DriveCycle
from powertrain.components.electric import cells_in_series
from powertrain.trials import drive_cycle, full_accelerator
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.electric_four_wheel_drive import ElectricFourWheelDriveCar
from powertrain.vehicles.hybrid import HybridCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.series_hybrid import SeriesHybrid

HARD = DriveCycle("hard", ((0, 0), (1, 0), (20, 33), (30, 33), (32.5, 8), (36, 8)))


@pytest.mark.parametrize(
    ("car", "said"),
    [
        (ElectricCar(), "accessories take 300 W and the electric machines 80 W"),
        (ElectricFourWheelDriveCar(), "the electric machines"),
        (ParallelHybrid(), "the electric machines"),
        (SeriesHybrid(), "the electric machines"),
        (PowerSplitHybrid(), "accessories take 300 W and the electric machines 100 W"),
    ],
    ids=lambda v: type(v).__name__ if isinstance(v, pt.Component) else "",
)
def test_a_battery_of_one_cell_is_refused(car: pt.Component, said: str) -> None:
    """It ended in a solver message. A cell of 4.15 V behind 0.1 Ohm gives 4.15^2/0.4 = 43.1 W."""
    one = pt.replace(car, {"battery.ocv": cells_in_series(1), "battery.R": 0.1})
    name = type(car).__name__
    with pytest.raises(
        pt.ParameterError, match=rf"^{name}.battery delivers at most 43.1 W, with 4.15 V and R = 0.1 Ohm"
    ) as caught:
        pt.compile(one)
    assert said in str(caught.value)


def test_torque_that_the_battery_allows() -> None:
    """100 N.m at 50 rad/s draw 5 kW and lose 1 kW: with 3 kW there are 50 N.m; at rest the loss counts alone."""
    inputs = {"accelerator": 1.0, "brake": 0.0, "v": 5.0, "limit": 100.0, "added_loss": 1e3}
    for w, power, tau in ((50, 3e3, 50), (50, 9e3, 100), (0, 500, 50), (50, -10, 0)):
        given = {**inputs, "w": float(w), "discharge_power": float(power)}
        result = pt.simulate(ElectricDriveControl(), 1.0, points=2, inputs=given)
        assert result["tau"][-1] == pytest.approx(tau)


def test_two_machines_are_one_to_the_control() -> None:
    """Losses of copper grow with the square of the torque, 0.06 and 0.045 W/(N.m)2; 40 and 60 % of the torque are theirs."""
    run = pt.simulate(ElectricFourWheelDriveCar(), 1e-3, points=2, starts={"body.v": 20.0})
    front, rear = (run[f"{end}_machine.w"][-1] for end in ("front", "rear"))
    assert run["control.w"][-1] == pytest.approx(0.4 * front + 0.6 * rear)
    most = min(90e3 / front / 0.4, 150e3 / rear / 0.6)
    assert run["control.limit"][-1] == pytest.approx(most, rel=1e-6)
    assert run["control.added_loss"][-1] == pytest.approx(
        0.06 * (0.4 * most) ** 2 + 0.045 * (0.6 * most) ** 2, rel=1e-6
    )


@pytest.mark.parametrize("car", few([ElectricCar(), ElectricFourWheelDriveCar()]), ids=["one machine", "two machines"])
@pytest.mark.parametrize("weak", [{"battery.R": 1.0}, {"battery.i_discharge": 100.0}], ids=["R", "i"])
def test_full_pedal_with_a_weak_battery(car: ElectricCar | ElectricFourWheelDriveCar, weak: dict[str, float]) -> None:
    """The battery gives what it may, to 2 %, and no more."""
    result = full_accelerator(pt.replace(car, weak))
    given = -result["battery.bus.v"] * result["battery.i"] / result["battery.discharge_power"]
    assert 0.98 < given.max() <= 1.0 + 1e-6
    assert not result.statistics.get("outside current of the battery")


@pytest.mark.slow
@pytest.mark.parametrize("soc", [0.22, 0.6, 0.87])
@pytest.mark.parametrize("car", [SeriesHybrid(), PowerSplitHybrid(), ParallelHybrid()], ids=["series", "split", "P2"])
def test_hybrids_driven_hard(car: HybridCar, soc: float) -> None:
    """Hard acceleration and braking, nearly empty, half full, nearly full: 1 % of the greatest power at most beyond the limits."""
    run = drive_cycle(car, HARD, starts={"battery.soc": soc})
    result = run.result
    taken = result["battery.bus.v"] * result["battery.i"]
    assert np.max(taken - result["battery.charge_power"]) < 200
    assert np.max(-taken - result["battery.discharge_power"]) < 300
    assert not result.statistics.get("outside current of the battery")
    assert run.audit.closure < 1e-6


@pytest.mark.parametrize(
    "car", few([SeriesHybrid(), PowerSplitHybrid(), ParallelHybrid()]), ids=["series", "split", "P2"]
)
def test_a_full_battery_is_not_charged(car: HybridCar) -> None:
    """Coasting at 35 m/s, where the engine runs. It charged with 3.2 kW, of its least power of 5 kW."""
    plant = pt.compile(pt.replace(car, driver=SetPedals()))
    run = plant.simulate(4.0, starts={"body.v": 35.0, "battery.soc": 0.9})
    assert float(np.max(run["battery.i"])) < 0


CARS = {
    "one machine": ElectricCar(),
    "two machines": ElectricFourWheelDriveCar(),
    "series": SeriesHybrid(),
    "split": PowerSplitHybrid(),
    "P2": ParallelHybrid(),
    "P4": ParallelHybrid.at("P4"),
}


@pytest.mark.parametrize("car", few(CARS.values(), 2), ids=CARS)
def test_a_full_battery_brakes_like_any_other(car: ElectricCar | ElectricFourWheelDriveCar | HybridCar) -> None:
    """From 20 m/s with 0.3 of the pedal. Friction brakes of 20 kN, F_brake of 15 kN: two machines took 1.25 times as far, P4 1.14."""
    plant = pt.compile(pt.replace(car, driver=SetPedals(brake_set=0.3)))
    runs = [plant.simulate(8.0, starts={"body.v": 20.0, "battery.soc": soc}) for soc in (0.5, 0.98)]
    paths = [float(run["body.s"][-1]) for run in runs]
    assert paths[0] == pytest.approx(paths[1], rel=0.04)  # the losses of the gears


@pytest.mark.parametrize(
    "weak", few([{"machine_2.P_max": 10e3}, {"machine_2_cooling.T": 448.0}]), ids=["small machine", "hot machine"]
)
def test_a_machine_at_the_ring_that_takes_little(weak: dict[str, float]) -> None:
    """Full battery, full pedal: machine 1 generates no more than machine 2 draws. It charged a full battery with 19 kW, up to 94 %."""
    car = pt.replace(PowerSplitHybrid(), {"driver": SetPedals(accelerator_set=1.0)} | weak)
    result = pt.compile(car).simulate(25.0, starts={"battery.soc": 0.9})
    taken = result["battery.bus.v"] * result["battery.i"]
    assert np.max(taken - result["battery.charge_power"]) < 200
    assert result["battery.soc"].max() < 0.901
    assert result["engine.power"].max() > 15e3  # through the gear
    assert result["body.v"][-1] > 10


@pytest.mark.parametrize("car", few(CARS.values()), ids=CARS)
def test_a_full_battery_is_not_charged_by_driving_forward_while_rolling_back(car: pt.Component) -> None:
    """At -6 m/s on a slope of 25 %, with 0.3 of the pedal: 25 kW went into the battery. It starts on that slope all the same."""
    plant = pt.compile(pt.bench(pt.replace(car, driver=SetPedals(accelerator_set=0.3)), without=["road"]))
    back = plant.simulate(2.0, starts={"body.v": -6.0, "battery.soc": 0.98}, inputs={"road.grade": 0.25})
    assert back["body.v"][-1] < -6.0
    assert np.max(back["battery.bus.v"] * back["battery.i"]) < 300
    assert plant.simulate(2.0, starts={"battery.soc": 0.98}, inputs={"road.grade": 0.1})["body.s"][-1] > 0


@pytest.mark.slow
def test_an_engine_that_charges_leaves_the_brakes_their_share() -> None:
    """P2 with both pedals pressed: engine and brakes charged with 1.9 times i_charge, and the machine lacked 22 N.m of what both asked."""
    pedals = SetPedals(accelerator_set=0.06, brake_set=0.3)
    car = pt.replace(ParallelHybrid(), {"driver": pedals, "control.P_min": 30e3})
    result = pt.compile(car).simulate(5.0, starts={"battery.soc": 0.5, "body.v": 25.0})
    taken = result["battery.bus.v"] * result["battery.i"]
    assert np.max(taken - result["battery.charge_power"]) < 0
    np.testing.assert_allclose(result["machine.tau"], result["machine.torque_demand"], atol=1e-9)
