"""Transmissions with two electric machines: the pair alone, torques by virtual work, modes that change, drives in a car."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from ratio_bench import RatioBench
from two_mode import C1, C2, ahs2

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant
from powertrain.components.cvu import ElectricPair, RatioActuator
from powertrain.components.transmissions import ElectricTransmission, Lever, Network, OverallRatio, UnitLoss, flow
from powertrain.components.transmissions.network import HOUSING
from powertrain.components.transmissions.ratio import factors_of_unit
from powertrain.design.parts import pair_of

SHIFT = 1 / 1.70
R_1 = np.sqrt(2.69 / 0.7)
TWO_MODE = ahs2(R_1, R_1, 2.69)
SPANS = [(0.0, SHIFT, TWO_MODE.range(C1)), (SHIFT, 2.0, TWO_MODE.range(C2))]
"""The AHS-2 by its fixed gears."""


class PairBench(pt.Component):
    """Shaft a at a given speed, a torque on shaft b."""

    pair: ElectricPair
    drive: rot.ConstantSpeed
    rotor: rot.Inertia = rot.Inertia(J=0.5)
    load: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-50.0)
    aims: tuple[Constant, ...]

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.pair.flange_a)
        yield pt.connect(self.pair.flange_b, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.load.flange)
        yield pt.connect(self.aims[0].y, self.pair.n_a)
        yield pt.connect(self.aims[1].y, self.pair.n_b)


@pytest.mark.parametrize(("n_a", "n_b"), [(1.0, 0.8), (-1.0, 0.5), (2.0, 0.0)])
def test_pair_keeps_the_proportion_and_its_link(n_a: float, n_b: float) -> None:
    """tau_b carries the load; the slip follows from it, the power on shaft a from the machines' losses; backward and at rest of b too."""
    aims = Constant(k=n_a), Constant(k=n_b)
    model = PairBench(pair=ElectricPair(), drive=rot.ConstantSpeed(w_fixed=100.0 * np.sign(n_a)), aims=aims)
    result = pt.simulate(model, 4.0, starts={"rotor.w": 100 * n_b / abs(n_a)}, rtol=1e-9)
    w_a, w_b = (result[f"pair.machine_{side}.w"][-1] for side in "ab")
    tau_a, tau_b = (result[f"pair.machine_{side}.tau"][-1] for side in "ab")
    assert tau_b == pytest.approx(50.0, rel=1e-6)
    n = np.hypot(n_a, n_b)
    a, b = n_a / n, n_b / n
    slip = b * w_a - a * w_b
    assert result["pair.slip"][-1] == pytest.approx(slip, rel=1e-9)
    assert abs(slip) < 0.02 * np.hypot(w_a, w_b)
    charging = 100 * 5e-3 * (400**2 - result["pair.link.v"][-1] ** 2) / 2
    across = (
        100 * slip / np.sqrt(1 + (100 * slip) ** 2 * (a**2 + b**2) / 270**2)
    )  # both machines are below their rated speed
    assert tau_b == pytest.approx(a * across - charging * w_b / (w_a**2 + w_b**2 + 1), rel=1e-6)
    losses = sum(0.1 * tau**2 + abs(w) + 1e-3 * w**2 for tau, w in ((tau_a, w_a), (tau_b, w_b)))
    assert tau_a * w_a + tau_b * w_b == pytest.approx(-losses, rel=1e-5)
    assert pt.energy_audit(result).closure < 1e-8


def test_pair_has_the_efficiency_of_the_design() -> None:
    """From a to b eta_ab, from b to a eta_ba, in either direction of rotation: exactly, the loss map is bilinear."""
    pair = pair_of(UnitLoss(0.81, 0.64), torque=300, speed=900, power=1e5)
    for machine, drives, generates in ((pair.machine_a, 0.8, 0.9), (pair.machine_b, 0.9, 0.8)):
        for w in (3.0, 250.0, -250.0):
            assert machine.efficiency(w, np.copysign(70.0, w)) == pytest.approx(drives, rel=1e-12)
            assert machine.efficiency(w, -np.copysign(70.0, w)) == pytest.approx(generates, rel=1e-12)
    with pytest.raises(pt.ParameterError, match="map of both machines together"):
        pair_of(UnitLoss(pt.Map.constant(0.9, x="ratio"), 0.9), torque=1, speed=1, power=1)


def torques(network: Network, w: tuple[float, float], tau_in: float, tau_out: float) -> Any:
    """Of both machines, by virtual work: tau_in w_in + tau_a w_a + tau_b w_b = tau_out w_out for every w_in, w_out."""
    return np.linalg.solve(factors_of_unit(network).T, [-tau_in, tau_out])


@pytest.fixture(scope="module")
def driven() -> pt.Result[RatioBench]:
    pair = pair_of(UnitLoss(0.85, 0.85), torque=400, speed=2000, power=1e5)
    model = RatioBench(
        transmission=ElectricTransmission.of(SPANS, pair),
        actuator=RatioActuator(T=0.1, rate=0.15, ratio_start=0.3),
        engine=rot.Inertia(J=0.1),
        load=rot.ConstantTorque(tau_constant=-80),
    )
    w_a, w_b = factors_of_unit(SPANS[0][2]) @ [200.0, 60.0]
    starts = {"engine.w": 200.0, "output.w": 60.0}
    starts |= {"transmission.pair.machine_a.w": w_a, "transmission.pair.machine_b.w": w_b}
    inputs = {"wanted": ([0, 1, 1, 12, 12, 24], [0.3, 0.3, 1.6, 1.6, 0.4, 0.4])}
    return pt.simulate(model, 24.0, starts=starts, inputs=inputs, rtol=1e-7, atol=1e-7)


def test_modes_change_at_equal_speeds_through_rest_of_a_machine(driven: pt.Result[RatioBench]) -> None:
    """Up through both mechanical points of the second mode and back; the output passes the shift without a jerk."""
    number, place = driven["transmission.range"], driven["transmission.place"]
    assert number[0] == number[-1] == 0
    assert number.max() == 1
    ratio = driven["output.w"] / driven["engine.w"]
    np.testing.assert_allclose(ratio, driven["actuator.ratio"], atol=0.03)
    up = int(np.flatnonzero(np.diff(number) > 0)[0])
    assert ratio[up] == pytest.approx(SHIFT, rel=0.02)
    changing = (place > 0.12) & (place < 0.88)
    np.testing.assert_allclose(ratio[changing], SHIFT, rtol=1e-6)  # a fixed gear
    assert np.abs(driven["transmission.pair.slip"][changing]).max() < 0.3  # against which the machines do not work
    for side in "ab":
        w = driven[f"transmission.pair.machine_{side}.w"]
        assert w.min() < -1 < 1 < w.max()
    audit = pt.energy_audit(driven)
    assert audit.closure < 1e-6
    assert np.asarray(audit.loss).min() > -1e-6 * np.asarray(audit.loss).max()


@pytest.mark.parametrize(("time", "k"), [(11.9, 1), (23.9, 0)])
def test_torques_at_rest_are_those_of_the_network(driven: pt.Result[RatioBench], time: float, k: int) -> None:
    """Of both machines by virtual work, and of the engine by the efficiency of the design, which has lossless gears here."""
    at = {name: driven.at(time, name) for name in ("output.w", "engine.w", "transmission.flange_a.tau")}
    assert driven.at(time, "transmission.locks[0].tau") == 0
    wanted = torques(SPANS[k][2], (at["engine.w"], at["output.w"]), at["transmission.flange_a.tau"], 80.0)
    found = [driven.at(time, f"transmission.pair.machine_{side}.tau") for side in "ab"]
    np.testing.assert_allclose(found, wanted, rtol=1e-4)
    r = at["output.w"] / at["engine.w"]
    network = flow(SPANS[k][2], [r], 80.0, at["engine.w"], loss=UnitLoss(0.85, 0.85))
    assert at["transmission.flange_a.tau"] == pytest.approx(network.tau_in[0], rel=2e-3)


@pytest.mark.parametrize(("r", "k"), [(0.3, 0), (1.7, 1)])
def test_it_begins_in_the_range_of_its_speeds(r: float, k: int) -> None:
    """In the lower range the machines could not hold a ratio of 1.7 against the load."""
    pair = pair_of(UnitLoss(0.85, 0.85), torque=400, speed=2000, power=1e5)
    transmission, actuator = ElectricTransmission.of(SPANS, pair), RatioActuator(ratio_start=r)
    model = RatioBench(transmission=transmission, actuator=actuator, load=rot.ConstantTorque(tau_constant=-80))
    w = factors_of_unit(SPANS[k][2]) @ [200.0, 200.0 * r]
    starts = {"engine.w": 200.0, "output.w": 200.0 * r}
    starts |= {f"transmission.pair.machine_{side}.w": speed for side, speed in zip("ab", w, strict=True)}
    result = pt.simulate(model, 3.0, starts=starts, inputs={"wanted": r})
    assert (result["transmission.range"] == k).all()
    assert (result["transmission.place"] == k).all()
    assert result["output.w"][-1] / result["engine.w"][-1] == pytest.approx(r, rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("part", "k"), [(1.01, 1), (1.03, 0)])
def test_a_shift_in_reverse_has_the_hysteresis_of_one_forward(part: float, k: int) -> None:
    """The AHS-2 with its output reversed: 1 % below the shift it keeps the upper range, 3 % below it changes down."""
    levers = (*TWO_MODE.levers, Lever("reverse", "out", "back", HOUSING, -1.0))
    reversed_ = replace(TWO_MODE, levers=levers, output="back")
    spans = [(-2.0, -SHIFT, reversed_.range(C2)), (-SHIFT, 0.0, reversed_.range(C1))]
    pair = pair_of(UnitLoss(0.85, 0.85), torque=400, speed=2000, power=1e5)
    actuator, load = RatioActuator(T=0.1, rate=0.5, ratio_start=-0.5), rot.ConstantTorque(tau_constant=80)
    model = RatioBench(transmission=ElectricTransmission.of(spans, pair), actuator=actuator, load=load)
    w = factors_of_unit(spans[1][2]) @ [200.0, -100.0]
    starts = {"engine.w": 200.0, "output.w": -100.0}
    starts |= {f"transmission.pair.machine_{side}.w": speed for side, speed in zip("ab", w, strict=True)}
    result = pt.simulate(model, 3.0, starts=starts, inputs={"wanted": -part * SHIFT})
    assert result["output.w"][-1] / result["engine.w"][-1] == pytest.approx(-part * SHIFT, rel=2e-3)
    assert result["transmission.range"][0] == 1
    assert result["transmission.range"][-1] == k


def test_what_no_pair_can_drive() -> None:
    with pytest.raises(pt.ParameterError, match="two ranges meet at r = 0"):
        ElectricTransmission.of([(-1.0, 0.0, SPANS[0][2]), (0.0, 1.0, SPANS[1][2])])
    with pytest.raises(pt.ParameterError, match="the ranges do not meet"):
        pt.compile(RatioBench(transmission=ElectricTransmission.of([(0.0, 0.7, SPANS[0][2]), (0.7, 2.0, SPANS[1][2])])))
    with pytest.raises(pt.ParameterError, match="V_min = 500"):
        ElectricPair(V_min=500)


@pytest.mark.slow
def test_two_mode_transmission_drives_in_a_car(tmp_path: Any) -> None:
    """The AHS-2 takes a car to 60 km/h and back through both modes and through rest of machine a; the fuel is that of another CVT."""
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials import drive_cycle
    from powertrain.vehicles.split_path_car import SplitPathCar

    path = tmp_path / "short.csv"
    path.write_text("time_s,speed_km_h\n0,0\n3,0\n18,60\n25,60\n38,0\n42,0\n")
    cycle, actuator = DriveCycle.from_csv(path), RatioActuator(T=0.2, rate=0.5, ratio_start=0.2)
    car = SplitPathCar(transmission=ElectricTransmission.of(SPANS), unit_ratio=OverallRatio(), actuator=actuator)
    run, plain = drive_cycle(car, cycle), drive_cycle(SplitPathCar(), cycle)
    assert run.result.time[-1] == 42
    assert abs(run.audit.closure) < 1e-6
    assert set(np.unique(run.result["transmission.range"]).tolist()) == {0.0, 1.0}
    w_a = run.result["transmission.pair.machine_a.w"]
    assert w_a.min() < -10 < 100 < w_a.max()
    assert run.result["engine.fuel"][-1] == pytest.approx(plain.result["engine.fuel"][-1], rel=0.1)
    assert np.abs(run.result["body.v"] - run.result["cycle.v_ref"]).max() < 2 / 3.6 + 0.2
