"""Steady operating points that do not exist, or not alone: self-locking, circulating torque, torques that rise with speed."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.differentials import FundamentalDifferential, PlanetaryGear
from powertrain.components.rotational import (
    BearingFriction,
    Brake,
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    Freewheel,
    Gear,
    IdealGear,
    Inertia,
    LossyGear,
    OneWayClutch,
    QuadraticSpeedDependentTorque,
    SpringDamper,
    Torque,
)
from powertrain.dae.hybrid import OperatingPoint
from powertrain.modes.complementarity import Complementarity

OK, SEVERAL, NONE, DIVERGED = 0, 2, 3, 6


def behind(wheel: str, *resistance: pt.Component) -> pt.Component:
    """A shaft that 3 N.m drive at 30 rad/s, and a flywheel at the ``wheel`` side of a freewheel, with its ``resistance``."""
    parts = [ConstantTorque(tau_constant=3), Inertia(J=1.0), Damper(d=0.1), Fixed(), Freewheel(), Inertia(J=0.2)]
    driven = {"flange_a": "flange_b", "flange_b": "flange_a"}[wheel]
    wall = "=6.flange_a 3.flange=6.flange_b" if resistance else " 3.flange"
    joints = f"0.flange=1.flange_a=2.flange_a=4.{driven} 5.flange_a=4.{wheel}{wall}=2.flange_b"
    return joined(*parts, *resistance, joints=joints)


@pytest.mark.parametrize(("wheel", "sign"), [("flange_b", 1.0), ("flange_a", -1.0)])
def test_what_a_freewheel_may_let_run_ahead_has_no_speed_of_its_own(wheel: str, sign: float) -> None:
    """Nothing brakes the flywheel: each speed that the freewheel allows is one at which all rests."""
    plant = pt.compile(behind(wheel))
    for guess in (30.0, 30.0 + 5.0 * sign):
        found = pt.steady(plant, {}, outputs=["parts[5].w"], guesses={"parts[5].w": guess}, first=True)
        assert found.status == SEVERAL
        assert "parts[4].mode" in found.attrs["problems"]
        end = plant.simulate(200.0, starts={"parts[1].w": 30.0, "parts[5].w": guess})
        assert end["parts[5].w"][-1] == pytest.approx(guess, abs=1e-6)


@pytest.mark.parametrize(("wheel", "speed"), [("flange_b", 5.0), ("flange_a", 0.0)])
def test_what_is_braked_behind_a_freewheel_has_one_speed(wheel: str, speed: float) -> None:
    found = pt.steady(behind(wheel, Damper(d=0.5)), {}, outputs=["parts[1].w", "parts[5].w"])
    assert found.status == OK
    np.testing.assert_allclose(found["parts[5].w"], speed, atol=1e-9)
    np.testing.assert_allclose(found["parts[1].w"], speed or 30.0, rtol=1e-9)


class Backstop(pt.Component):
    """A wheel on a freewheel that lets it turn forward alone, where its drag grows with the square of the speed; backward it has none."""

    forward: float = 1.0
    wall: Fixed = Fixed()
    backstop: Freewheel = Freewheel()
    wheel: Inertia = Inertia(J=0.2)
    drag: Torque = Torque()

    def equations(self) -> pt.Equations:
        ends = self.backstop.flange_a, self.backstop.flange_b
        held, free = ends if self.forward > 0.0 else ends[::-1]
        yield pt.connect(self.wall.flange, held)
        yield pt.connect(free, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.drag.flange)
        yield self.drag.tau.value == -0.5 * self.forward * ca.fmax(self.forward * self.wheel.w, 0) ** 2


@pytest.mark.parametrize("forward", [1.0, -1.0])
def test_the_motion_that_a_freewheel_holds_is_none(forward: float) -> None:
    """Without a load it is at the limit of its torque, and the equations balance at any speed backward."""
    found = pt.steady(Backstop(forward=forward), {}, outputs=["wheel.w"])
    assert found.status == OK
    assert found["wheel.w"] == 0.0


@pytest.mark.parametrize(("wheel", "status"), [(behind("flange_b"), SEVERAL), (behind("flange_b", Damper(d=0.5)), OK)])
def test_a_freewheel_without_a_load_says_nothing_about_other_motions(wheel: pt.Component, status: int) -> None:
    assert pt.steady(joined(wheel, Backstop(), joints=""), {}, outputs=["parts[1].wheel.w"]).status == status


class LockedBench(pt.Component):
    """A differential of given speeds at a and b, and a given torque on the carrier."""

    torque: pt.Input = pt.signal_input("N.m", "Torque on the carrier")
    differential: FundamentalDifferential = FundamentalDifferential(ratio=1.02, eta_ab=0.95, eta_ba=0.95)
    drive: ConstantSpeed = ConstantSpeed(w_fixed=10)
    load: Torque = Torque()
    other: ConstantSpeed = ConstantSpeed(w_fixed=0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.differential.a)
        yield pt.connect(self.other.flange, self.differential.b)
        yield pt.connect(self.load.flange, self.differential.carrier)
        yield pt.connect(self.torque, self.load.tau)


def test_self_locking_has_no_or_several_solutions() -> None:
    """For eta < R_o < 1/eta the carrier cannot be turned: one direction has both modes, the other none."""
    plant = pt.compile(LockedBench())
    found = pt.steady(plant, {"torque": [-5.0, 5.0]}, outputs=["differential.a.tau"])
    assert sorted(found.status.values.tolist()) == [SEVERAL, NONE]
    assert np.isnan(found["differential.a.tau"]).all()
    assert "differential" in found.attrs["problems"]
    easy = pt.steady(plant, {"torque": [-5.0, 5.0], "differential.ratio": 2.0}, outputs=["differential.a.tau"])
    assert (easy.status == OK).all()


@pytest.mark.parametrize("compile", [False, True])
@pytest.mark.parametrize("ratio", [0.97, 1.02, 1.2, 2.0, -2.0])
def test_self_locking_is_said_also_where_the_efficiency_depends_on_torque(ratio: float, compile: bool) -> None:
    """Against all roots of T_a (1 - R_o eta) + T = 0, with R_o eta_ab if a drives and R_o/eta_ba if b drives."""
    size = np.array([0.0, 5.0, 50.0, 1e5])
    etas = np.array([[0.94, 0.955, 0.96, 0.96], [0.93, 0.94, 0.95, 0.95]])
    map_ab, map_ba = (pt.Map([pt.Axis("tau", "N.m", size)], eta, unit="1") for eta in etas)
    bench = LockedBench(differential=FundamentalDifferential(ratio=ratio, map_ab=map_ab, map_ba=map_ba))
    torques = np.array([-50.0, -5.0, -1.0, 1.0, 5.0, 50.0])
    found = pt.steady(bench, {"torque": torques}, outputs=["differential.a.tau"], compile=compile)
    place = np.concatenate([-np.geomspace(1e5, 1e-5, 100001), np.geomspace(1e-5, 1e5, 100001)])
    a_drives = place * ratio / (ratio - 1) > 0
    eta = np.where(a_drives, np.interp(abs(place), size, etas[0]), 1 / np.interp(abs(place), size, etas[1]))
    for torque, status, T_a in zip(torques, found.status.values, found["differential.a.tau"].values, strict=True):
        balance = place * (1 - ratio * eta) + torque
        roots = place[1:][balance[1:] * balance[:-1] <= 0]
        assert status == {0: DIVERGED, 1: OK, 2: SEVERAL}[len(roots)], torque
        np.testing.assert_allclose(T_a, roots[0] if status == OK else np.nan, rtol=3e-4)


def flat(eta: float) -> pt.Map:
    """An efficiency that is written as one that depends on torque."""
    return pt.Map([pt.Axis("tau", "N.m", [0.0, 1.0, 1e7])], [eta, eta * (1 - 1e-9), eta], unit="1")


class LockedTrain(pt.Component):
    """Three differentials that share shafts, between a given speed and a given torque."""

    torque: pt.Input = pt.signal_input("N.m", "Torque on the output")
    one: FundamentalDifferential = FundamentalDifferential(ratio=3.45, map_ab=flat(0.99), map_ba=flat(0.86))
    two: FundamentalDifferential = FundamentalDifferential(ratio=2.19, map_ab=flat(0.84), map_ba=flat(0.81))
    three: FundamentalDifferential = FundamentalDifferential(ratio=-1.61, map_ab=flat(0.83), map_ba=flat(0.86))
    drive: ConstantSpeed = ConstantSpeed(w_fixed=2)
    load: Torque = Torque()
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.one.a, self.two.carrier)
        yield pt.connect(self.load.flange, self.one.carrier, self.two.b)
        yield pt.connect(self.one.b, self.three.carrier)
        yield pt.connect(self.two.a, self.three.a)
        yield pt.connect(self.three.b, self.ground.flange)
        yield pt.connect(self.torque, self.load.tau)


def test_a_train_that_is_self_locking_as_a_whole() -> None:
    """The other solution has the other side driving in all three. With 5 N.m on the output, all directions tried one by one leave these two
    torques; with -5 N.m none.
    """
    found = pt.steady(LockedTrain(), {"torque": [-5.0, 5.0]}, outputs=["one.a.tau"], first=True)
    np.testing.assert_array_equal(found.status, [DIVERGED, SEVERAL])
    assert np.isclose(found["one.a.tau"].values[1], [-3.252842, 11.3084786], rtol=1e-5).any()


def test_a_point_without_a_solution_is_soon_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing moves with given speeds, so a shorter step poses the same problem again."""
    asked, solve = list[OperatingPoint](), Complementarity.solve

    def counted(self: Complementarity, point: OperatingPoint, *args: Any, **more: Any) -> Any:
        asked.append(point)
        return solve(self, point, *args, **more)

    monkeypatch.setattr(Complementarity, "solve", counted)
    eta = pt.Map([pt.Axis("tau", "N.m", [0.0, 1e5])], [0.94, 0.96], unit="1")
    bench = LockedBench(differential=FundamentalDifferential(ratio=1.02, map_ab=eta, map_ba=eta))
    assert pt.steady(bench, {"torque": 5.0}).status == DIVERGED
    assert 0 < len(asked) < 30


@pytest.mark.parametrize("first", [False, True])
def test_infinite_torque_is_no_solution_beside_a_finite_one(first: bool) -> None:
    """At R_o = eta_ba the carrier turns with T_a = -T/(1 - R_o eta_ab) if a drives, and would need an infinite torque if b drives."""
    edge = {"differential.ratio": 0.97, "differential.eta_ab": 0.99, "differential.eta_ba": 0.97}
    torque = np.array([-5.0, 5.0])
    found = pt.steady(LockedBench(), {"torque": torque}, outputs=["differential.a.tau"], parameters=edge, first=first)
    expected = -torque / (1 - 0.97 * 0.99)
    drives = expected < 0  # w_a - w_h = -R_o/(1 - R_o) w_a, with b at rest
    np.testing.assert_array_equal(found.status, np.where(drives, OK, NONE))
    np.testing.assert_allclose(found["differential.a.tau"], np.where(drives, expected, np.nan), rtol=1e-9)


@pytest.mark.parametrize("alternatives", [64, 0])
def test_large_maps_tell_several_solutions_from_one(monkeypatch: pytest.MonkeyPatch, alternatives: int) -> None:
    """Also where laws have too many other combinations of modes for a tape: every point is solved on its own then, and only so."""
    monkeypatch.setattr("powertrain.steadystate.known_modes._ALTERNATIVES", alternatives)
    if not alternatives:
        monkeypatch.delattr("powertrain.steadystate.known_modes.KnownModes.parts")
    large = pt.steady(
        pt.compile(LockedBench()),
        {"torque": np.linspace(-5, 5, 64), "differential.ratio": np.linspace(1.01, 1.2, 64)},
        outputs=["differential.a.tau"],
    )
    ratio, eta = large["ratio"].values, 0.95
    locked = (eta < ratio) & (ratio < 1 / eta)
    assert (large.status.values[:, ~locked] == OK).all()
    assert set(large.status.values[:, locked].ravel()) == {SEVERAL, NONE}


class Fan(pt.Component):
    """A torque on an inertia, through a lossy gear, to a fan that brakes either way."""

    tau: pt.Input = pt.signal_input("N.m", "Driving torque")
    torque: Torque = Torque()
    J: Inertia = Inertia(J=0.1)
    gear: Gear = Gear(ratio=2.0, efficiency=0.9)
    shaft: SpringDamper = SpringDamper(c=1e3, d=1.0)
    J2: Inertia = Inertia(J=0.2)
    fan: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-20, w_nominal=50, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J.flange_a)
        yield pt.connect(self.J.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.fan.flange)


def test_speed_of_a_fan() -> None:
    """0.9 * 2 tau = 20 (w/50)^2."""
    plant = pt.compile(Fan())
    tau = np.array([1.0, 4.0, 9.0])
    found = pt.steady(plant, {"tau": tau}, outputs=["J2.w", "J.w", "shaft.tau"])
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["J2.w"], 50 * np.sqrt(1.8 * tau / 20), rtol=1e-9)
    np.testing.assert_allclose(found["J.w"], 2 * found["J2.w"], rtol=1e-9)
    result = plant.simulate(30.0, inputs={"tau": 4.0}, starts={"J.w": 1.0})
    np.testing.assert_allclose(result["J2.w"][-1], found["J2.w"][1], rtol=1e-5)
    np.testing.assert_allclose(result["shaft.phi_rel"][-1], -4 * 1.8 / 1e3, rtol=1e-5)


def test_fan_that_also_drives() -> None:
    """Its torque has one direction: 0.9 * 2 tau = 20 (w/50)^2 forward, tau * 2/0.9 = 20 (w/50)^2 backward."""
    fan = QuadraticSpeedDependentTorque(tau_nominal=-20, w_nominal=50)
    plant = pt.compile(pt.replace(Fan(), fan=fan))
    tau = np.array([1.0, 4.0, 9.0])
    found = pt.steady(plant, {"tau": tau}, outputs=["J2.w"])
    assert (found.status == SEVERAL).all()
    assert np.isnan(found["J2.w"]).all()
    first = pt.steady(plant, {"tau": tau}, outputs=["J2.w"], first=True)
    assert (first.status == SEVERAL).all()
    np.testing.assert_allclose(first["J2.w"], 50 * np.sqrt(1.8 * tau / 20), rtol=1e-9)
    backward = pt.steady(plant, {"J2.w": -50 * np.sqrt(tau / 9)}, outputs=["tau"])
    np.testing.assert_allclose(backward["tau"], tau, rtol=1e-9)


def test_torque_that_keeps_a_speed() -> None:
    plant = pt.compile(Fan())
    w = np.array([10.0, 40.0])
    found = pt.steady(plant, {"J2.w": w}, outputs=["tau"])
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["tau"], 20 * (w / 50) ** 2 / 1.8, rtol=1e-9)


def test_nothing_balances() -> None:
    class Runaway(pt.Component):
        torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
        J: Inertia = Inertia(J=0.5)
        brake: Brake = Brake(fn_max=10, mue_pos=((0.0, 1.0),))
        grip: pt.Input = pt.signal_input("1", "Brake")

        def equations(self) -> pt.Equations:
            yield pt.connect(self.torque.flange, self.J.flange_a)
            yield pt.connect(self.grip, self.brake.f_normalized)
            yield pt.connect(self.J.flange_b, self.brake.flange_a)

    found = pt.steady(Runaway(), {"grip": [0.01, 1.0]}, outputs=["J.w"])
    assert found.status.values.tolist() == [DIVERGED, OK]
    assert "brake" in found.attrs["problems"]


def test_torques_without_limit_are_not_ok() -> None:
    """On the border of self-locking, R_o = 1/eta, the torque is infinite if a drives; if b drives, T_a = -T/(1 - R_o/eta) < 0."""
    torque = np.array([-5.0, 5.0])
    found = pt.steady(LockedBench(), {"torque": torque, "differential.ratio": 1 / 0.95}, outputs=["differential.a.tau"])
    np.testing.assert_array_equal(found.status, [OK, NONE])
    np.testing.assert_allclose(found["differential.a.tau"], [5.0 / (1 - 1 / 0.95**2), np.nan], rtol=1e-9)
    other = pt.steady(
        LockedBench(), {"torque": [-5.0, 5.0], "differential.ratio": 0.95}, outputs=["differential.a.tau"]
    )
    assert np.nanmax(np.abs(other["differential.a.tau"])) < 1e3


class HeldByItsPeak(pt.Component):
    """A brake that holds half as much again as it takes while it slides, against a torque that a damper takes at some speed."""

    torque: Torque = Torque()
    J: Inertia = Inertia(J=1.0)
    brake: Brake = Brake(fn_max=10.0, mue_pos=((0.0, 1.0),), peak=1.5)
    damper: Damper = Damper(d=0.1)
    ground: Fixed = Fixed()
    tau: pt.Input = pt.signal_input("N.m", "Torque", default=12.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J.flange_a, self.brake.flange_a, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield self.brake.f_normalized.value == 1.0


def test_a_brake_that_its_peak_holds_may_slide_as_well() -> None:
    """It ends where it began: at rest, or sliding at (tau - 10)/0.1. With another peak as the grid says."""
    plant = pt.compile(HeldByItsPeak())
    rest, slide = (plant.simulate(300.0, starts={"J.w": w})["J.w"][-1] for w in (0.0, 5.0))
    assert rest == 0.0
    assert slide == pytest.approx(20.0, rel=1e-6)
    tau = np.array([-14.0, -9.0, 5.0, 9.9, 10.5, 14.9, 15.5, 20.0])
    found = pt.steady(plant, {"tau": tau}, outputs="J.w")
    assert found.status.values.tolist() == [SEVERAL, OK, OK, OK, SEVERAL, SEVERAL, OK, OK]
    np.testing.assert_allclose(found["J.w"][-2:], (tau[-2:] - 10.0) / 0.1, rtol=1e-9)
    held = pt.steady(plant, {"tau": tau}, outputs="J.w", first=True)
    np.testing.assert_allclose(
        held["J.w"], np.where(np.abs(tau) < 15.0, 0.0, (tau - 10.0) / 0.1), rtol=1e-9, atol=1e-12
    )
    peaks = pt.steady(plant, {"brake.peak": [1.0, 1.1, 1.3], "tau": 12.0}, outputs="J.w")
    assert peaks.status.values.tolist() == [OK, OK, SEVERAL]


@pytest.mark.parametrize("eta", [1.0, 0.95])
def test_an_unloaded_planetary_gear_on_a_held_carrier_may_spin(eta: float) -> None:
    """Nothing slows sun and ring down, so every speed is an operating point; a bearing that the sun cannot overcome holds them."""
    parts = PlanetaryGear(ratio=2.0, eta_ab=eta, eta_ba=eta), *[Inertia(J=1.0)] * 3, Brake(fn_max=10.0), Constant(k=1.0)
    ends = "0.carrier=1.flange_a=4.flange_a 0.sun=2.flange_a 0.ring=3.flange_a 5.y=4.f_normalized"
    free, held = (
        joined(*parts, joints=ends),
        joined(*parts, BearingFriction(tau_pos=((0.0, 1.0),)), joints=f"{ends} 2.flange_b=6.flange_a"),
    )
    spinning = pt.simulate(free, 50.0, starts={"parts[2].w": 10.0, "parts[1].w": 0.0})
    assert spinning["parts[2].w"][-1] == pytest.approx(10.0)
    found, first, fixed = (
        pt.steady(model, {}, outputs="parts[2].w", first=one)
        for model, one in ((free, False), (free, True), (held, False))
    )
    assert found.status == SEVERAL
    assert first["parts[2].w"] == fixed["parts[2].w"] == 0.0
    assert fixed.status == OK


@pytest.mark.parametrize("ratio", [1.5, 49.0])
@pytest.mark.parametrize("driven", [True, False])
def test_a_rig_in_which_torque_circulates(ratio: float, driven: bool) -> None:
    """A shaft is twisted by 0.01 rad between two gears whose ratios cancel, in round-off for 49. With others it would wind up."""
    drive = ConstantSpeed(w_fixed=100.0) if driven else ConstantTorque(tau_constant=3.0)
    parts = (
        drive,
        Inertia(J=0.1),
        IdealGear(ratio=ratio),
        SpringDamper(c=1e4, d=1.0, phi_rel0=0.01),
        IdealGear(ratio=1 / ratio),
    )
    ends = "0.flange=1.flange_a=2.flange_a=5.flange_a 2.flange_b=3.flange_a 3.flange_b=4.flange_a 4.flange_b=1.flange_b"
    plant = pt.compile(joined(*parts, BearingFriction(tau_pos=((0.0, 1.0), (100.0, 2.0))), joints=ends))
    outputs = ["parts[3].tau", "parts[1].w", "parts[0].flange.tau"]
    found = pt.steady(plant, {}, outputs=outputs)
    assert found.status == OK
    w, tau = (100.0, 2.0) if driven else (200.0, 3.0)
    np.testing.assert_allclose([found[name] for name in outputs], [-100.0, w, -tau], rtol=1e-9)
    if driven:
        with pytest.raises(pt.ParameterError, match=r"parts\[3\].tau depends on an angle that only rotates"):
            pt.steady(plant, {}, outputs=outputs, parameters={"parts[4].ratio": 1.0})


def test_a_law_without_a_limit_yields_before_others_that_share_its_torque() -> None:
    """Of 3 N.m at the carrier a lossless gear passes 2 N.m on to the sun, by Willis' equation; nothing accelerates.

    Sun and ring turn together through a freewheel and a gear, each of which could carry more.
    """
    parts = (
        *(ConstantTorque(tau_constant=-3.0), PlanetaryGear(ratio=0.5), OneWayClutch(fn_max=10.0), Constant(k=1.0)),
        *(
            LossyGear(ratio=2.0, lossTable=((0.0, 0.9, 0.8, 0.5, 1.0),)),
            *[Inertia(J=J) for J in (4.0, 0.5, 10.0, 0.5, 0.5)],
        ),
        QuadraticSpeedDependentTorque(tau_nominal=-5.0, w_nominal=10.0, TorqueDirection=False),
    )
    ends = "0.flange=1.carrier=6.flange_a 1.sun=5.flange_b 5.flange_a=2.flange_a 3.y=2.f_normalized 1.ring=4.flange_a=7.flange_a"
    model = joined(*parts, joints=f"{ends} 4.support=2.flange_b=8.flange_a 4.flange_b=9.flange_a=10.flange")
    found = pt.steady(model, {}, outputs=["parts[2].tau", *(f"parts[{k}].a" for k in range(5, 10))])
    assert found.status == OK
    assert found["parts[2].tau"] == pytest.approx(2.0, rel=1e-9)
    for k in range(5, 10):
        assert found[f"parts[{k}].a"] == pytest.approx(0.0, abs=1e-9)


class Windage(pt.Component):
    """A torque, and the drag of air, which has no slope at rest."""

    tau: pt.Input = pt.signal_input("N.m", "Torque")
    drive: Torque = Torque()
    rotor: Inertia = Inertia(J=1.0)
    drag: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(
        tau_nominal=-1.0, w_nominal=10.0, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.drag.flange)


def test_drag_holds_a_shaft_at_rest() -> None:
    """Without a torque the only speed is zero, and with a torque of 1e-12 N.m it is 1e-5 rad/s; without drag it is any speed."""
    torques = np.array([-1e-8, -1e-12, 0.0, 1e-12, 1e-8, 1.0])
    found = pt.steady(Windage(), {"tau": torques}, outputs="rotor.w")
    assert (found.status == 0).all()
    np.testing.assert_allclose(
        found["rotor.w"], np.sign(torques) * 10 * np.sqrt(np.abs(torques)), rtol=1e-6, atol=1e-12
    )
    loose = pt.steady(Windage(), {"tau": [0.0, 1.0], "drag.tau_nominal": 0.0}, outputs="rotor.w")
    assert loose.status.values.tolist() == [2, 6]


@pytest.mark.parametrize(("drags", "status"), [((1, 1), 0), ((1, 0), 2), ((0, 1), 2), ((0, 0), 2)])
def test_a_free_shaft_beside_one_that_drag_holds(drags: tuple[int, int], status: int) -> None:
    parts: list[pt.Component] = []
    for drag in drags:
        fan = QuadraticSpeedDependentTorque(tau_nominal=-drag, w_nominal=10.0, TorqueDirection=False)
        parts += [ConstantTorque(tau_constant=0.0), Inertia(J=1.0), fan]
    bearing = BearingFriction(tau_pos=((0.0, 0.0),))
    joints = "0.flange=1.flange_a 1.flange_b=2.flange=6.flange_a 3.flange=4.flange_a 4.flange_b=5.flange"
    found = pt.steady(joined(*parts, bearing, joints=joints), {"parts[0].tau_constant": 0.0}, outputs="parts[1].w")
    assert found.status.item() == status


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
def test_torques_of_any_size_are_compared_with_friction(unit: float) -> None:
    """A bearing holds 1, and what exceeds it drives a fan to 10 rad/s times its square root."""
    bearing = BearingFriction(tau_pos=((0.0, unit),))
    fan = QuadraticSpeedDependentTorque(tau_nominal=-unit, w_nominal=10.0, TorqueDirection=False)
    joints = "0.flange=1.flange_a 1.flange_b=2.flange_a=3.flange"
    model = joined(ConstantTorque(tau_constant=0.0), Inertia(J=unit), bearing, fan, joints=joints)
    torques = np.array([-1.6, 0.0, 0.8, 1.5])
    found = pt.steady(model, {"parts[0].tau_constant": unit * torques}, outputs="parts[1].w")
    assert (found.status == 0).all()
    excess = np.maximum(np.abs(torques) - 1.0, 0.0)
    np.testing.assert_allclose(found["parts[1].w"], 10 * np.sign(torques) * np.sqrt(excess), rtol=1e-6, atol=1e-6)
