"""What compliance decides: laws that hold one motion share its torque alike, the weaker at its limit, whatever the order and the states."""

from __future__ import annotations

from itertools import pairwise, permutations
from typing import Any

import casadi as ca
import numpy as np
import pytest
from mechanisms import mechanism, random_starts
from scipy.integrate import quad
from scipy.optimize import brentq

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Sine
from powertrain.dae.hybrid import OperatingPoint
from powertrain.dae.tolerances import RESOLVED, ZONE
from powertrain.modes.complementarity import Complementarity

Matrix = np.ndarray[Any, Any]


def brake(limit: float) -> rot.Brake:
    return rot.Brake(fn_max=limit, mue_pos=((0.0, 1.0),))


class Held(pt.Component):
    """A torque that rises in one second on a shaft that brakes hold, each behind a lossless gear; no inertia but the shaft's."""

    order: tuple[int, ...]
    brakes: tuple[rot.Brake, ...]
    gears: tuple[rot.IdealGear, ...]
    rise: Ramp
    torque: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=0.3)
    press: pt.Input = pt.signal_input("1", "Pressure of all brakes")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.rise.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.shaft.flange_a)
        for i in self.order:
            yield pt.connect(self.shaft.flange_b, self.gears[i].flange_a)
            yield pt.connect(self.gears[i].flange_b, self.brakes[i].flange_a)
            yield pt.connect(self.press, self.brakes[i].f_normalized)


def held(limits: Matrix, ratios: Matrix, order: tuple[int, ...], height: float) -> Held:
    return Held(
        order=order,
        brakes=tuple(brake(float(v)) for v in limits),
        gears=tuple(rot.IdealGear(ratio=float(v)) for v in ratios),
        rise=Ramp(height=height, duration=1.0),
    )


def shares(limits: Matrix, total: float) -> Matrix:
    """``total`` on equally stiff parts with these limits: the weakest reach theirs one after the other."""
    rest, found = abs(total), np.zeros(len(limits))
    for k, i in enumerate(order := np.argsort(limits)):
        found[i] = min(limits[i], rest / (len(order) - k))
        rest -= found[i]
    signed: Matrix = np.sign(total) * found
    return signed


CASES = [
    ((20.0, 20.0), (1.0, 1.0)),
    ((2.0, 20.0), (1.0, 1.0)),
    ((20.0, 2.0), (1.0, 1.0)),
    ((60.0, 2.0), (-3.0, 2.0)),
    ((1.0, 20.0, 2.5), (1.0, 1.0, 1.0)),
    ((1.0, 20.0, 2.5), (2.0, -1.0, 0.5)),
]


@pytest.mark.slow
@pytest.mark.parametrize("height", [10.0, -10.0])
@pytest.mark.parametrize(("limits", "ratios"), CASES)
def test_the_weaker_at_its_limit_and_the_others_take_the_rest(
    limits: tuple[float, ...], ratios: tuple[float, ...], height: float
) -> None:
    """The torques on the shaft, tau over ratio, in every order of the connections."""
    limit, ratio = np.array(limits), np.array(ratios)
    for order in permutations(range(len(limit))):
        agrees(held(limit, ratio, order, height), limit, ratio, height)


def agrees(model: Held, limit: Matrix, ratio: Matrix, height: float) -> None:
    times = np.linspace(0.05, 0.95, 10)
    expected = np.array([shares(limit / np.abs(ratio), height * t) for t in times])
    result = pt.simulate(model, 1.0, inputs={"press": 1.0})
    found = np.array([result.at(times, f"brakes[{i}].tau") for i in range(len(limit))]).T
    np.testing.assert_allclose(found / ratio, expected, atol=2e-6)
    np.testing.assert_allclose(result["shaft.w"], 0.0, atol=1e-12)


def test_whichever_speed_is_the_state() -> None:
    """That of the first brake, which is any of three with ratios of their own."""
    limit, ratio = np.array([1.0, 20.0, 2.5]), np.array([2.0, -1.0, 0.5])
    for turn in range(3):
        limits, ratios = np.roll(limit, turn), np.roll(ratio, turn)
        model = held(limits, ratios, (0, 1, 2), 10.0)
        assert "brakes[0].w" in pt.compile(model).compiled.states
        agrees(model, limits, ratios, 10.0)


@pytest.mark.parametrize("height", [10.0, -10.0])
def test_a_law_at_its_limit_that_others_hold_is_stuck(height: float) -> None:
    """Its torque is at its bound, its speed zero, and nothing begins to slide: no event."""
    model = held(np.array([2.0, 20.0]), np.ones(2), (0, 1), height)
    result = pt.simulate(model, 1.0, inputs={"press": 1.0}, times=np.linspace(0.0, 1.0, 41))
    begins = 0.4  # 4 N.m of 10 N.m in one second
    sign = np.sign(height)
    after = result.time > begins + 1e-6
    assert (result["brakes[0].mode"] == 0).all()
    assert (result["brakes[1].mode"] == 0).all()
    np.testing.assert_allclose(result["brakes[0].tau"][after], sign * 2.0, atol=1e-9)
    assert not result.events


def test_a_run_does_not_depend_on_the_runs_before_it() -> None:
    """Heights in turn on one plant, and each on a plant of its own."""
    limits, ratios = np.array([1.0, 20.0, 2.5]), np.array([2.0, -1.0, 0.5])
    plant = pt.compile(held(limits, ratios, (0, 1, 2), 1.0))
    times = np.linspace(0.0, 1.0, 11)

    def torques(plant: pt.Plant[Any], height: float) -> Matrix:
        result = plant.simulate(1.0, inputs={"press": 1.0}, times=times, parameters={"rise.height": height})
        return np.array([result[f"brakes[{i}].tau"] for i in range(3)])

    heights = (3.0, -60.0, 30.0, 3.0)
    together = [torques(plant, height) for height in heights]
    for before, after in pairwise([together[0], together[3]]):
        np.testing.assert_array_equal(before, after)
    for height, found in zip(heights, together, strict=True):
        alone = torques(pt.compile(held(limits, ratios, (0, 1, 2), 1.0)), height)
        np.testing.assert_array_equal(found, alone)


def test_a_start_at_rest_needs_the_break_away_torque() -> None:
    """6 N.m on a brake that slides at 5 N.m and breaks away at 7.5; 8 N.m are enough."""
    for height, moves in ((6.0, False), (8.0, True)):
        brakes = (rot.Brake(fn_max=5.0, mue_pos=((0.0, 1.0),), peak=1.5),)
        model = Held(
            order=(0,),
            brakes=brakes,
            gears=(rot.IdealGear(ratio=1.0),),
            rise=Ramp(offset=height, height=0.0, duration=1.0),
        )
        result = pt.simulate(model, 1.0, inputs={"press": 1.0})
        assert (abs(result["shaft.w"][-1]) > 0.1) == moves


class Balanced(pt.Component):
    """A torque on a shaft that two brakes and a damper hold, one brake and the damper behind a gear; its speed is not known before."""

    tau: pt.Input = pt.signal_input("N.m", "Torque on the shaft")
    drive: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    one: rot.Brake = brake(100.0)
    gear: rot.IdealGear = rot.IdealGear(ratio=2.0)
    other: rot.Brake = brake(100.0)
    damper: rot.Damper = rot.Damper(d=0.3)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.one.flange_a, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.other.flange_a, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.wall.flange)
        yield self.one.f_normalized.value == 1.0
        yield self.other.f_normalized.value == 1.0


def test_operating_points_share_as_simulations_do() -> None:
    """The brake behind the gear sees half of the speed and takes twice the torque: tau = tau_1 + tau_2/2."""
    found = pt.steady(Balanced(), {"tau": [10.0, -4.0, 0.0]}, outputs=["one.tau", "other.tau"])
    assert (found.status == 0).all()
    np.testing.assert_allclose(found["one.tau"], [5.0, -2.0, 0.0], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(found["other.tau"], [10.0, -4.0, 0.0], rtol=1e-6, atol=1e-12)


class Apart(pt.Component):
    """A small brake under a torque that rises; beside it, and not connected, a brake that holds a large one."""

    small: Held
    large: rot.ConstantTorque
    wheel: rot.Inertia = rot.Inertia(J=1e3)
    stop: rot.Brake = rot.Brake(fn_max=1e7, mue_pos=((0.0, 1.0),))
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.press.y, self.small.press, self.stop.f_normalized)
        yield pt.connect(self.large.flange, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.stop.flange_a)


@pytest.mark.parametrize("torque", [1.0, 1e6])
def test_what_is_not_connected_says_nothing_of_how_well_a_torque_is_known(torque: float) -> None:
    small = held(np.array([1e-3]), np.array([1.0]), (0,), 2e-3)
    result = pt.simulate(Apart(small=small, large=rot.ConstantTorque(tau_constant=torque)), 1.0)
    assert result.events.times == pytest.approx(0.5, abs=2e-6)


class Series(pt.Component):
    """A torque on a heavy shaft that a clutch ties to a light one, which a brake holds."""

    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=1.0)
    heavy: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=3.0, mue_pos=((0.0, 1.0),))
    light: rot.Inertia = rot.Inertia(J=1e-6)
    brake: rot.Brake = brake(3.0)
    pressure: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.heavy.flange_a)
        yield pt.connect(self.heavy.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.light.flange_a)
        yield pt.connect(self.light.flange_b, self.brake.flange_a)
        yield pt.connect(self.pressure.y, self.clutch.f_normalized, self.brake.f_normalized)


@pytest.mark.parametrize("light", [1e-3, 1e-6, 1e-8])
def test_laws_in_series_do_not_creep_however_light_the_part_between(light: float) -> None:
    """They share no motion. What is left is the round-off of accelerations that torques cause on the light part."""
    result = pt.simulate(Series(), 10.0, parameters={"light.J": light})
    rounding = 10 * np.finfo(float).eps / light
    np.testing.assert_allclose(result["heavy.w"], 0.0, atol=10.0 * rounding)
    np.testing.assert_allclose(result["clutch.tau"], -1.0, rtol=rounding)
    np.testing.assert_allclose(result["brake.tau"], 1.0, rtol=rounding)


class WithoutInertia(pt.Component):
    """A torque on a shaft that two couplings in series tie to another one; the part between them has drag, but no inertia."""

    couplings: tuple[Any, ...]
    drag: rot.Damper = rot.Damper(d=0.05)
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=300.0)
    first: rot.Inertia = rot.Inertia(J=0.5)
    last: rot.Inertia = rot.Inertia(J=0.6)
    load: rot.Damper = rot.Damper(d=1.0)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        one, other = self.couplings
        yield pt.connect(self.drive.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, one.flange_a)
        yield pt.connect(one.flange_b, other.flange_a, self.drag.flange_a)
        yield pt.connect(other.flange_b, self.last.flange_a)
        yield pt.connect(self.last.flange_b, self.load.flange_a)
        yield pt.connect(self.wall.flange, self.load.flange_b, self.drag.flange_b)
        for coupling in self.couplings:
            if isinstance(coupling, rot.Clutch):
                yield coupling.f_normalized.value == 1.0


CLOSED = rot.Clutch(fn_max=500.0, mue_pos=((0.0, 1.0),))


@pytest.mark.parametrize("couplings", [(CLOSED, CLOSED), (CLOSED, rot.Freewheel()), (rot.Freewheel(), CLOSED)])
def test_laws_hold_together_what_has_no_inertia_between_them(couplings: tuple[Any, ...]) -> None:
    """1.1 w' = 300 - 1.05 w. They creep by half of eps tau/d; a run with more than 3 N.m was rejected as inaccurate for it."""
    result = pt.simulate(WithoutInertia(couplings=couplings), 3.0, rtol=1e-8)
    w = 300 / 1.05 * (1 - np.exp(-1.05 / 1.1 * result.time))
    np.testing.assert_allclose(result["last.w"], w, atol=1e-4)
    np.testing.assert_allclose(result["first.w"] - result["last.w"], 0.0, atol=1e-8 * 2 * 300 / 0.05)
    first, last = (-result[f"couplings[{k}].tau"][1:] for k in (0, 1))
    np.testing.assert_allclose(first - last, 0.05 * w[1:], atol=1e-4)
    np.testing.assert_allclose(first, 300 - 0.5 * (300 - 1.05 * w[1:]) / 1.1, atol=1e-3)
    assert pt.energy_audit(result).closure < 1e-6


def test_laws_that_creep_noticeably_are_rejected() -> None:
    """With less drag, their compliance is one: at 100 N.m they creep by 1 mrad/s."""
    with pytest.raises(pt.SimulationError, match=r"couplings.* larger inertia"):
        pt.simulate(WithoutInertia(couplings=(CLOSED, CLOSED)), 3.0, parameters={"drag.d": 1e-3})


class Hub(pt.Component):
    """A torque on a shaft with a clutch to a hub, which has drag, but no inertia; a brake holds the hub."""

    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=10.0)
    shaft: rot.Inertia = rot.Inertia(J=2.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=1.0, mue_pos=((0.0, 1.0),))
    drag: rot.Damper = rot.Damper(d=0.4)
    brake: rot.Brake = brake(3.0)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.brake.flange_a, self.drag.flange_a)
        yield pt.connect(self.wall.flange, self.drag.flange_b)
        yield self.clutch.f_normalized.value == 1.0
        yield self.brake.f_normalized.value == 1.0


@pytest.mark.parametrize("peak", [1.0, 1.2, 2.0])
def test_a_clutch_to_a_braked_hub_without_inertia_lets_go_at_its_peak(peak: float) -> None:
    """The brake is the stronger one: 2 w' = 10 - 1, as soon as the clutch has reached its peak. From a peak of 1.2 on it jammed there."""
    result = pt.simulate(Hub(), 1.0, parameters={"clutch.peak": peak})
    np.testing.assert_allclose(result["shaft.w"], 4.5 * result.time, atol=1e-6)
    np.testing.assert_allclose(result["brake.w"], 0.0, atol=1e-6)
    assert result["brake.tau"][-1] == pytest.approx(1.0, abs=1e-6)


def test_the_complementarity_problem_has_the_torques_of_the_model() -> None:
    """Also where laws creep on a part without inertia: at equal compliances each takes half of the speed of the shaft, w = eps/2 tau/d."""
    plant = pt.compile(Hub())
    dae = plant.compiled.dae
    x = np.where([name == "shaft.w" for name in dae.state_names], 4e-9, 0.0)
    point = OperatingPoint(0.0, x, np.zeros(0), np.zeros(dae.m.numel()), plant.parameter_vector())
    torques = dae.function("torques", ca.vertcat(*(law.torque for law in dae.frictions)))(*point).full().ravel()
    problem = Complementarity(dae)
    answer = problem.solve(point, np.zeros(2), ZONE, bends=False, known=problem.known(point))
    assert answer.tau is not None
    np.testing.assert_allclose(answer.tau, torques, rtol=1e-6)
    np.testing.assert_allclose(abs(torques), 0.4 * 4e-9 / 1e-8, rtol=1e-6)


class TwoGears(pt.Component):
    """A torque on a shaft that two clutches tie to another one, each behind a gear."""

    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=1.0)
    front: rot.Inertia = rot.Inertia(J=1.0)
    gears: tuple[rot.IdealGear, ...] = (rot.IdealGear(ratio=2.0), rot.IdealGear(ratio=2.0))
    clutches: tuple[rot.Clutch, ...] = (
        rot.Clutch(fn_max=3.0, mue_pos=((0.0, 1.0),)),
        rot.Clutch(fn_max=3.0, mue_pos=((0.0, 1.0),)),
    )
    back: rot.Inertia = rot.Inertia(J=0.5)
    pressure: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.front.flange_a)
        for gear, clutch in zip(self.gears, self.clutches, strict=True):
            yield pt.connect(self.front.flange_b, gear.flange_a)
            yield pt.connect(gear.flange_b, clutch.flange_a)
            yield pt.connect(clutch.flange_b, self.back.flange_a)
            yield pt.connect(self.pressure.y, clutch.f_normalized)


def test_gears_of_one_ratio_share_though_others_do_not() -> None:
    """With ratios of their own the clutches would hold two motions; with one ratio they hold one, and take half of the torque each."""
    result = pt.simulate(TwoGears(), 1.0)
    acceleration = 1.0 / (2.0 + 0.5 / 2.0)  # of the second shaft
    for i in range(2):
        np.testing.assert_allclose(result[f"clutches[{i}].tau"], -0.5 * 0.5 * acceleration, atol=1e-7)


def test_laws_beside_a_screw_break_away_once() -> None:
    """Its limits follow its torque, and the proximal step moves the shares: a law at its limit was let go of there, without end."""
    plant = pt.compile(mechanism(318))
    result = plant.simulate(1.0, starts=random_starts(plant, 318))
    broken = [event.name for event in result.events if event.name.endswith("mode")]
    assert broken == ["parts[1].mode", "parts[2].mode", "parts[7].mode"]


class Pressed(pt.Component):
    """A torque on a shaft that one brake holds while another is pressed little by little."""

    second: rot.Brake
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=1.0)
    shaft: rot.Inertia = rot.Inertia(J=0.1)
    first: rot.Brake = brake(3.0)
    full: Constant = Constant(k=1.0)
    pressure: Ramp = Ramp(duration=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.first.flange_a, self.second.flange_a)
        yield pt.connect(self.full.y, self.first.f_normalized)
        yield pt.connect(self.pressure.y, self.second.f_normalized)


@pytest.mark.parametrize("begins", [0.0, 0.1])
@pytest.mark.parametrize("peak", [1.0, 1.5])
def test_what_is_pressed_from_nothing_on_a_shaft_at_rest_takes_no_more_than_its_share(
    begins: float, peak: float
) -> None:
    """Its limit is smaller at first than the uncertainty of a torque. It took up to 4 N.m, and drove the other brake to -3 N.m."""
    second = rot.Brake(fn_max=10.0, mue_pos=((0.0, 1.0),), peak=peak)
    result = pt.simulate(Pressed(second=second), 1.0, parameters={"pressure.startTime": begins})
    limit = peak * 10.0 * np.maximum(result.time - begins, 0.0)
    np.testing.assert_allclose(result["second.tau"], np.minimum(limit, 0.5), atol=2e-7)
    np.testing.assert_allclose(result["first.tau"] + result["second.tau"], 1.0, atol=1e-9)
    assert [event.new for event in result.events] == ([0.0] if begins else [])


class Row(pt.Component):
    """Three clutches between four shafts, the last one much stronger."""

    shafts: tuple[pt.Component, ...] = tuple(rot.Inertia(J=1.0) for _ in range(4))
    clutches: tuple[pt.Component, ...] = tuple(rot.Clutch(fn_max=f, mue_pos=((0.0, 1.0),)) for f in (1.0, 1.0, 1e6))

    def equations(self) -> pt.Equations:
        for left, clutch, right in zip(self.shafts, self.clutches, self.shafts[1:], strict=False):
            yield pt.connect(left.flange_b, clutch.flange_a)  # type: ignore[attr-defined]
            yield pt.connect(clutch.flange_b, right.flange_a)  # type: ignore[attr-defined]
            yield clutch.f_normalized.value == 1.0  # type: ignore[attr-defined]


def test_torques_that_meet_through_others_tell_how_well_one_is_known() -> None:
    """The first clutch meets the third through the second, which slips: round-off of the largest is in all of them."""
    compiled = pt.compile(Row()).compiled
    dae = compiled.dae
    known = ca.Function("known", [dae.t, dae.x, dae.m, dae.p], [dae.frictions[0].known])
    m = np.array(dae.held_start)
    m[[law.index for law in dae.frictions]] = [0.0, 1.0, 1.0]
    p = [parameter.value for parameter in compiled.parameters.values()]
    assert float(known(0.0, np.zeros(dae.x.numel()), m, p)) >= RESOLVED * 1e6


class Windy(pt.Component):
    """Two brakes hold a shaft with a damper under a torque; beside it a fan turns, so that unknowns are implicit."""

    load: pt.Input = pt.signal_input("N.m", "Torque on the shaft")
    pull: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=0.1)
    weak: rot.Brake = brake(3e3)
    strong: rot.Brake = brake(8e3)
    damper: rot.Damper = rot.Damper(d=10.0)
    ground: rot.Fixed = rot.Fixed()
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=5.0)
    fan: rot.Inertia = rot.Inertia(J=1.0)
    air: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-10.0, w_nominal=10.0, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.load, self.pull.tau)
        yield pt.connect(self.pull.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.weak.flange_a, self.strong.flange_a, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield pt.connect(self.drive.flange, self.fan.flange_a)
        yield pt.connect(self.fan.flange_b, self.air.flange)
        yield self.weak.f_normalized.value == 1.0
        yield self.strong.f_normalized.value == 1.0


def test_shares_of_an_operating_point_add_up_to_the_load() -> None:
    """With compliance alone the shaft creeps, and the damper takes some hundred-millionths; the proximal steps take that away."""
    load = np.array([1e3, -5e3, 9e3])
    names = ["weak.tau", "strong.tau", "shaft.w"]
    found = pt.steady(Windy(), {"load": load}, outputs=names, guesses={"fan.w": 5.0})
    assert not found.status.any()
    np.testing.assert_allclose(found["weak.tau"] + found["strong.tau"], load, rtol=1e-12)
    np.testing.assert_allclose(found["weak.tau"], np.clip(load / 2, -3e3, 3e3), rtol=1e-7)
    np.testing.assert_allclose(found["shaft.w"], 0.0, atol=1e-9)


class TwoPaths(pt.Component):
    """A torque that swings to and fro on a shaft that two clutches tie to another one, each behind lossy gears of its own ratio."""

    swing: Sine = Sine(amplitude=10.0, f=1.0)
    drive: rot.Torque = rot.Torque()
    front: rot.Inertia = rot.Inertia(J=0.1)
    gears: tuple[rot.Gear, ...] = (rot.Gear(ratio=2.0, efficiency=0.9), rot.Gear(ratio=0.8, efficiency=0.9))
    clutches: tuple[rot.Clutch, ...] = tuple(rot.Clutch(fn_max=50.0, mue_pos=((0.0, 1.0),)) for _ in range(2))
    back: rot.Inertia = rot.Inertia(J=1.0)
    pressure: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.swing.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.front.flange_a)
        for gear, clutch in zip(self.gears, self.clutches, strict=True):
            yield pt.connect(self.front.flange_b, clutch.flange_a)
            yield pt.connect(clutch.flange_b, gear.flange_a)
            yield pt.connect(gear.flange_b, self.back.flange_a)
            yield pt.connect(self.pressure.y, clutch.f_normalized)


def test_meshes_at_rest_share_a_load_as_they_share_the_opposite_one() -> None:
    """Losses turn with the load. They kept their side, and the clutches carried 9.3 and 18.8 in place of 4.6 and 14.1 N.m."""
    result = pt.simulate(TwoPaths(), 1.0)
    times = np.array([0.05, 0.1, 0.2, 0.3, 0.45])
    for i in range(2):
        one, other = (result.at(t, f"clutches[{i}].tau") for t in (times, times + 0.5))
        np.testing.assert_allclose(other, -np.asarray(one), rtol=1e-6)


class Driven(pt.Component):
    """A shaft whose speed follows a sine drives a braked one through a freewheel."""

    speed: rot.Speed
    sine: Sine = Sine(amplitude=5.0, f=1.0)
    front: rot.Inertia = rot.Inertia(J=1.0)
    freewheel: rot.Freewheel = rot.Freewheel()
    back: rot.Inertia = rot.Inertia(J=0.5)
    brake: rot.Brake = brake(1.5)
    pressure: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.speed.w_ref)
        yield pt.connect(self.speed.flange, self.front.flange_a)
        yield pt.connect(self.front.flange_b, self.freewheel.flange_a)
        yield pt.connect(self.freewheel.flange_b, self.back.flange_a)
        yield pt.connect(self.back.flange_b, self.brake.flange_a)
        yield pt.connect(self.pressure.y, self.brake.f_normalized)


@pytest.mark.parametrize("exact", [True, False])
def test_a_freewheel_and_a_brake_may_hold_one_motion_if_a_source_ties_theirs(exact: bool) -> None:
    """T w' = 5 sin(2 pi t) - w drives 0.5 kg.m2 against 1.5 N.m, until w' < -3 rad/s2. With a filter it ended at 0 s by a rate of nan."""
    turns, lag = 2 * np.pi, 0.0 if exact else 1 / (2 * np.pi * 50)

    def rate(t: float) -> float:
        fading = np.exp(-t / lag) if lag else 0.0
        return float(
            5 * turns * (np.cos(turns * t) + turns * lag * np.sin(turns * t) - fading) / (1 + (turns * lag) ** 2)
        )

    free = brentq(lambda t: rate(t) + 3, 0.2, 0.4)
    result = pt.simulate(Driven(speed=rot.Speed(exact=exact)), 1.0)
    for t in (0.05, 0.1, 0.2):
        assert -result.at(t, "freewheel.tau") == pytest.approx(0.5 * rate(t) + 1.5, rel=1e-4)
    top = quad(rate, 0, free)[0]
    for t in (0.4, 0.6, 0.9):
        assert result.at(t, "freewheel.tau") == pytest.approx(0.0, abs=1e-9)
        assert result.at(t, "back.w") == pytest.approx(top - 3 * (t - free), rel=1e-5)
