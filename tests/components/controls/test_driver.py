from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.control import Driver
from powertrain.components.cycles import CycleSpeed, DriveCycle
from powertrain.components.translational import Brake, ConstantForce, Force, Mass, SpeedSensor


class Pushed(pt.Component):
    """A mass of 1,000 kg that both pedals push with at most 3,000 N."""

    cycle: CycleSpeed
    driver: Driver = Driver(k_p=1.0, k_i=0.2, k_a=1 / 3, hold=0)
    force: Force = Force()
    mass: Mass = Mass(m=1000)
    sensor: SpeedSensor = SpeedSensor()
    load: pt.Input = pt.signal_input("N", "What pulls it back", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.cycle.v_ref, self.driver.v_ref)
        yield pt.connect(self.cycle.a_ref, self.driver.a_ref)
        yield pt.connect(self.force.flange, self.mass.flange_a)
        yield pt.connect(self.mass.flange_b, self.sensor.flange)
        yield pt.connect(self.sensor.v, self.driver.v)
        pedals = self.driver.accelerator.value - self.driver.brake.value
        yield self.force.f.value == 3000 * pedals - self.load.value


def pushed(*rows: tuple[float, float]) -> Pushed:
    return Pushed(cycle=CycleSpeed(cycle=DriveCycle("test", rows), preview=0.01))


def test_ramp_is_followed_by_what_the_driver_knows() -> None:
    """k_a = m/F: the acceleration to come needs no error, whatever the controller's gains, up to the preview of 0.01 s."""
    result = pt.simulate(pushed((0, 0), (5, 0), (15, 20), (20, 20), (30, 0), (31, 0)), stop=31, points=3101)
    assert np.abs(result["driver.error"]).max() < 2 * 0.01 + 1e-3
    assert np.all(result["driver.accelerator"] * result["driver.brake"] == 0)


def test_constant_load_leaves_no_error() -> None:
    result = pt.simulate(pushed((0, 10), (1, 10)), stop=60, inputs={"load": 600.0}, starts={"mass.v": 10.0})
    assert result["driver.error"][-1] == pytest.approx(0, abs=1e-5)
    assert result["driver.accelerator"][-1] == pytest.approx(0.2, abs=1e-5)


def test_pedal_at_its_stop_does_not_wind_up() -> None:
    """4 m/s2 are asked for 10 s and 3 are there: once the mass has caught up it overshoots by little, not by 10 s of integral."""
    result = pt.simulate(pushed((0, 0), (10, 40), (60, 40)), stop=60, points=6001)
    assert result["driver.accelerator"].max() == 1
    assert result["mass.v"][1000] == pytest.approx(30, abs=0.1)
    assert result["mass.v"].max() < 40.5
    assert result["mass.v"][-1] == pytest.approx(40, abs=1e-3)  # slowest root -0.22 1/s


@pytest.mark.parametrize(("start", "goal", "pedal"), [(5.0, 25.0, "accelerator"), (25.0, 5.0, "brake")])
def test_foot_stays_down_until_the_speed_is_nearly_there(start: float, goal: float, pedal: str) -> None:
    """20 m/s at 3 m/s2 take 6.7 s; with k_p = 0.5 the foot lifts over the last 2 m/s."""
    car = pt.replace(pushed((0, goal), (60, goal)), driver=Driver(hold=0))
    result = pt.simulate(car, stop=60, points=6001, starts={"mass.v": start})
    t, v = result.time, result["mass.v"]
    direction = np.sign(goal - start)
    flat_out = t[np.argmax(result[f"driver.{pedal}"] < 1)]
    assert flat_out == pytest.approx(18 / 3, abs=0.1)
    assert t[np.argmax(direction * (v - goal) > -1)] < 8.0
    assert (direction * (v - goal)).max() < 0.5
    assert v[-1] == pytest.approx(goal, abs=0.05)


def test_mirrored_ramp_gives_the_other_pedal() -> None:
    up = pt.simulate(pushed((0, 1), (2, 1), (6, 9), (9, 9)), stop=9, points=901, starts={"mass.v": 1.0})
    down = pt.simulate(pushed((0, 9), (2, 9), (6, 1), (9, 1)), stop=9, points=901, starts={"mass.v": 9.0})
    assert down["driver.brake"] == pytest.approx(up["driver.accelerator"], abs=1e-5)


def test_foot_on_the_brake_where_the_cycle_stands() -> None:
    """The integral that the load has left would press the accelerator; the brake is held instead, until the cycle goes on."""
    car = pt.replace(pushed((0, 0), (10, 10), (20, 0), (25, 0), (27, 2)), {"driver.hold": 0.1})
    result = pt.simulate(car, stop=27, inputs={"load": ([0, 20, 20, 25], [600, 600, 0, 0])})
    accelerator, brake = (result.at([2.0, 22.0, 26.5], f"driver.{name}") for name in ("accelerator", "brake"))
    assert accelerator[0] > 0
    assert accelerator[1] == 0
    assert brake[1] >= 0.1
    assert accelerator[2] > 0


class Braked(pt.Component):
    """A mass of 1,000 kg on a slope, with a brake that rubs with at most 4,000 N."""

    cycle: CycleSpeed
    driver: Driver = Driver(hold=0.1)
    mass: Mass = Mass(m=1000)
    brake: Brake = Brake(fn_max=4000, mue_pos=((0.0, 1.0),))
    weight: ConstantForce = ConstantForce(f_constant=-1500)
    sensor: SpeedSensor = SpeedSensor()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.cycle.v_ref, self.driver.v_ref)
        yield pt.connect(self.cycle.a_ref, self.driver.a_ref)
        yield pt.connect(self.weight.flange, self.mass.flange_a)
        yield pt.connect(self.mass.flange_b, self.brake.flange_a, self.sensor.flange)
        yield pt.connect(self.sensor.v, self.driver.v)
        yield pt.connect(self.driver.brake, self.brake.f_normalized)


def test_standing_on_a_slope_the_foot_presses_until_the_vehicle_holds() -> None:
    """1,500 N pull it back, the resting foot holds 400 N: the integral presses on until 0.375 of the pedal do."""
    cycle = CycleSpeed(cycle=DriveCycle("stop", ((0, 0), (60, 0))))
    result = pt.simulate(Braked(cycle=cycle), stop=60, starts={"mass.v": 0.0})
    assert result["mass.v"].min() > -0.7
    assert result["mass.v"][-1] == pytest.approx(0, abs=1e-3)
    assert result["driver.brake"][-1] == pytest.approx(0.375, abs=1e-3)
