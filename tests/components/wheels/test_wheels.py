"""Wheels on the road: rolling resistance, rest on a slope, brakes, loads, and the rigid wheel as the limit of a stiff tyre."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from cases import few
from wheel_rigs import SLIPPING, WHEELS, plain, tight

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Constant, Ramp, Sine
from powertrain.components.body import DrivenAxle, VehicleBody
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, SlipWheel, WheelBrake
from powertrain.vehicles.rear_drive import RearDriveCar

G = 9.80665
M = 1500 + 2 / 0.3**2
"""Mass of the vehicle with its two wheels' inertia."""


def test_coasting_to_rest_by_rolling_resistance() -> None:
    """Constant deceleration to exactly zero, at v/a, and rest from then on."""
    result = tight(plain(RigidWheel()), 12.0, {"body.v": 1.0})
    a = 0.01 * 1500 * G / M
    v = result["body.v"]
    np.testing.assert_allclose(v, np.maximum(1 - a * result.time, 0), atol=1e-9)
    assert v[-1] == 0
    np.testing.assert_allclose(result["front.lossPower"] + result["rear.lossPower"], 0.01 * 1500 * G * v, atol=1e-9)


def test_rolling_resistance_rises_with_the_speed_squared() -> None:
    """m v' = -m_w g (Cr + Cr_2 v^2): v = root(Cr/Cr_2) tan(arctan(v_0/root) - k t)."""
    result = tight(plain(RigidWheel(Cr=0.01, Cr_2=4e-6)), 60.0, {"body.v": 40.0})
    root, k = np.sqrt(0.01 / 4e-6), np.sqrt(0.01 * 4e-6) * 1500 * G / M
    np.testing.assert_allclose(result["body.v"], root * np.tan(np.arctan(40 / root) - k * result.time), rtol=1e-7)


@pytest.mark.parametrize(("grade", "rolls"), few([(0.0099, False), (-0.0099, False), (0.0101, True), (-0.0101, True)]))
def test_rolling_resistance_holds_up_to_its_coefficient(grade: float, rolls: bool) -> None:
    result = tight(plain(RigidWheel(), grade=Constant(k=grade)), 5.0)
    a = np.sign(-grade) * (abs(grade) - 0.01) * G / np.sqrt(1 + grade**2) * 1500 / M if rolls else 0.0
    assert result["body.v"][-1] == pytest.approx(a * 5, rel=1e-8)


@pytest.mark.parametrize("name", WHEELS)
@pytest.mark.parametrize("grade", few([0.12, -0.12]))
def test_brake_holds_on_a_slope(name: str, grade: float) -> None:
    """The car comes to rest and stays: the tyre's spring carries what the brake holds."""
    model = plain(WHEELS[name], grade=Constant(k=grade), demand=Constant(k=0.5))
    result = tight(model, 60.0, {"body.v": 3.0})
    late = result.time > 55
    assert np.abs(result["body.v"][late]).max() < 1e-9
    assert np.ptp(result["body.s"][late]) < 1e-9
    pull = 1500 * G * grade / np.sqrt(1 + grade**2)
    assert result["front.f"][-1] + result["rear.f"][-1] == pytest.approx(pull, rel=1e-8)
    if name != "rigid":
        stiffness = {"linear": 6e4 / 0.3, "magic": 2.5e5}[name]
        assert result["rear.u"][-1] * stiffness == pytest.approx(result["rear.f"][-1], rel=1e-8)


@pytest.mark.parametrize("grade", few([0.25, 0.34, -0.34]))
def test_locked_wheels_regain_their_grip_at_rest(grade: float) -> None:
    """On a road of mu = 0.4 a locked wheel slides at 0.21 of its load; at rest it holds almost 0.4."""
    model = plain(MagicFormulaWheel(mu=0.4), demand=Constant(k=1.0), grade=Constant(k=grade), locked_front=True)
    result = tight(model, 20.0, {"body.v": float(np.sign(grade)) * 10.0})
    sliding = result["rear.f"] / result["rear.fn"]
    assert abs(sliding[np.argmin(np.abs(result.time - 0.5))]) == pytest.approx(0.22, abs=0.01)
    assert abs(result["body.v"][-1]) < 1e-9
    pull = 1500 * G * grade / np.sqrt(1 + grade**2)
    assert result["front.f"][-1] + result["rear.f"][-1] == pytest.approx(pull, rel=1e-8)


@pytest.mark.slow
def test_a_road_too_steep_for_its_grip_lets_locked_wheels_slide() -> None:
    model = plain(MagicFormulaWheel(mu=0.4), demand=Constant(k=1.0), grade=Constant(k=0.42), locked_front=True)
    result = tight(model, 6.0, {"body.v": 3.0})
    assert result["body.v"][-1] < -5


@pytest.mark.parametrize("name", few(SLIPPING))
def test_a_car_that_stops_rocks_once_or_twice(name: str) -> None:
    """Its tyres' springs swing a car with locked rear wheels less than a tenth as far every time."""
    result = tight(plain(WHEELS[name], demand=Constant(k=0.5)), 8.0, {"body.v": 3.0}, times=np.linspace(0, 8, 8001))
    v = result["body.v"]
    stopped = int(np.argmax(v <= 0))
    crossings = stopped + np.flatnonzero(np.diff(np.sign(v[stopped:])) != 0)
    swings = [np.abs(v[i:j]).max() for i, j in pairwise(crossings) if np.abs(v[i:j]).max() > 1e-4]
    assert max(swings) < 0.3
    assert all(b < 0.5 * a for a, b in pairwise(swings))
    assert np.abs(v[result.time > result.time[stopped] + 1.5]).max() < 1e-2


@pytest.mark.parametrize("name", few(WHEELS))
def test_energy_closes_through_start_slide_and_stop(name: str) -> None:
    """Torque that spins the wheels, a brake that locks them, a slope and wind: the audit closes, nothing is gained."""
    model = plain(
        WHEELS[name],
        torque=Sine(amplitude=2500, f=0.2),
        demand=Constant(k=0.3),
        grade=Constant(k=-0.1),
        wind=Constant(k=4),
        body=VehicleBody(),
    )
    model = pt.replace(model, {"front.mu": 0.25, "rear.mu": 0.3} if name != "rigid" else {})
    result = pt.simulate(model, 8.0, rtol=1e-8)
    audit = pt.energy_audit(result)
    assert not audit.hidden
    assert audit.closure < 1e-6
    assert np.asarray(audit.loss).min() > -1e-4
    assert result["body.v"].max() > 1
    if name != "rigid":
        assert np.abs(result["front.v_slide"]).max() > 1


@pytest.mark.slow
def test_stiff_tyre_is_a_rigid_wheel() -> None:
    """C to infinity at one relaxation length; the difference falls with 1/C."""
    drive = Sine(amplitude=400, f=0.5)
    rigid = tight(plain(RigidWheel(), torque=drive), 2.0, {"body.v": 5.0})
    differences = []
    for C in (1e6, 1e7):
        soft = tight(plain(SlipWheel(C=C, d=1e5, mu=10), torque=drive), 2.0, {"body.v": 5.0})
        differences.append(float(np.abs(soft["body.v"] - rigid["body.v"]).max()))
    assert differences[0] < 2e-2
    assert differences[1] == pytest.approx(differences[0] / 10, rel=0.1)


@pytest.mark.slow
def test_wheels_start_rolling() -> None:
    """A speed of the body is a speed of its wheels unless they are given another; the contact bears the load at once."""
    for wheel in WHEELS.values():
        assert tight(plain(wheel), 0.01, {"body.v": 12.0})["front.w"][0] == pytest.approx(12 / 0.3)
    locked = tight(plain(SLIPPING["magic"]), 0.01, {"body.v": 12.0, "front.w": 0.0})
    assert locked["front.v_slip"][0] == pytest.approx(-12)
    assert locked["front.Fz"][0] == pytest.approx(locked["front.fn"][0]) != 4000


@pytest.mark.parametrize(("demand", "torque"), [(0.2, 600.0), (1.7, 3000.0), (-1.0, 0.0)])
def test_brake_torque_is_its_demand(demand: float, torque: float) -> None:
    model = plain(RigidWheel(Cr=0), demand=Constant(k=demand))
    result = tight(model, 0.5, {"body.v": 30.0})
    assert result["body.v"][-1] == pytest.approx(30 - torque / 0.3 / M * 0.5, rel=1e-9)


def test_brake_may_sit_on_a_carrier() -> None:
    class Carried(pt.Component):
        shaft: rot.Inertia = rot.Inertia(J=1)
        brake: WheelBrake = WheelBrake(tau_max=10)
        carrier: rot.Inertia = rot.Inertia(J=2)
        demand: Constant = Constant(k=1)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.shaft.flange_b, self.brake.flange_a)
            yield pt.connect(self.brake.support, self.carrier.flange_a)
            yield pt.connect(self.demand.y, self.brake.demand)

    result = tight(Carried(), 2.0, {"shaft.w": 9.0})
    assert result["shaft.w"][-1] == pytest.approx(3.0)
    assert result["carrier.w"][-1] == pytest.approx(3.0)


@pytest.mark.parametrize("name", few(WHEELS))
def test_a_wheel_in_the_air_is_refused(name: str) -> None:
    """A high vehicle that is braked at the front lifts its rear."""
    model = plain(WHEELS[name], torque=Ramp(height=-30000, duration=5), body=VehicleBody(h=2))
    model = pt.replace(model, {"front.mu": 5.0} if name != "rigid" else {})
    with pytest.raises(
        pt.SimulationError,
        match=r"load of the wheel \(rear: .* leaves its range.*it falls below 0 N; allowed is at least 0",
    ):
        pt.simulate(model, 5.0, starts={"body.v": 50.0})


@pytest.mark.parametrize("wheel", few([SlipWheel(), MagicFormulaWheel()]), ids=["linear", "magic"])
def test_a_wheel_in_the_air_at_the_start_is_refused(wheel: SlipWheel | MagicFormulaWheel) -> None:
    """2 g to the side turn the inner wheel's load round: 1 - 2 h/track 2 = -0.47 of its share, so that its friction would drive."""
    car = RearDriveCar.in_one_gear(rear=DrivenAxle(left=wheel, right=wheel))
    with pytest.raises(
        pt.InitializationError, match=r"load of the wheel \(rear.left: .* -\d+.* N; allowed is at least 0 N"
    ):
        pt.simulate(car, 1.0, starts={"body.v": 20.0}, inputs={"curvature": 0.05})


def test_load_of_a_wheel_without_a_body() -> None:
    class Alone(pt.Component):
        wheel: RigidWheel = RigidWheel(load_nominal=3000, Cr=0.02)
        mass: tr.Mass = tr.Mass(m=300)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.wheel.road, self.mass.flange_a)

    result = tight(Alone(), 1.0, {"mass.v": 5.0})
    assert result["mass.v"][-1] == pytest.approx(5 - 0.02 * 3000 / (300 + 1 / 0.09))


def test_values_are_checked() -> None:
    with pytest.raises(pt.ParameterError, match=r"RigidWheel.radius = 0 m is outside its range \(0, 5\] m"):
        RigidWheel(radius=0)
    with pytest.raises(pt.ParameterError, match=r"SlipWheel.radius = 316 m is outside its range \(0, 5\] m"):
        SlipWheel(radius=316)  # millimetres
    with pytest.raises(pt.ParameterError, match=r"SlipWheel.sigma = -1 m is outside its range \(0, inf\)"):
        SlipWheel(sigma=-1)
    with pytest.raises(pt.ParameterError, match=r"front\.Cr_2 = -1e-06 s2/m2 must not be negative"):
        pt.compile(plain(RigidWheel(Cr_2=-1e-6)))
    assert RigidWheel(Cr_2="4e-6 s2/m2") == RigidWheel(Cr_2=4e-6)  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="RigidWheel has no field mu"):
        RigidWheel(mu=0.5)  # type: ignore[call-arg]
