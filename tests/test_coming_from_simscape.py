"""The page for users of Simscape Driveline is true: what it names exists, and its substitutes do what it says."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.belts import BeltSpan
from powertrain.components.blocks import Constant, TimeTable
from powertrain.components.differentials import ChurningLoss, Differential, LimitedSlipDifferential, Mesh
from powertrain.components.engines import WillansEngine
from powertrain.components.wheels import MagicFormulaWheel
from powertrain.presets.catalogue import components

PAGE = (Path(__file__).parents[1] / "docs" / "simscape.md").read_text(encoding="utf-8")
NAMES = {entry.name for entry in components()}


def fields(name: str) -> set[str]:
    """Fields and methods of the components with a name."""
    return {field for entry in components() if entry.name == name for field in (*entry.kind._fields, *dir(entry.kind))}


def test_what_the_page_names_exists() -> None:
    named = re.findall(r"\b([A-Z]\w+)\.(\w+)", " ".join(re.findall(r"`[^`]+`", PAGE)))
    for kind, given in re.findall(r"`(?:\w+: \w+ = )?([A-Z]\w+)\(([^`]*)\)`", PAGE):
        named += [(kind, field) for field in re.findall(r"(\w+)=", given)]
    assert len(named) > 50
    for kind, field in named:
        assert field in fields(kind), f"{kind}.{field}"
    assert set(re.findall(r"`([A-Z]\w+)`", PAGE)) <= NAMES


def test_contradictory_start_conditions_are_an_error() -> None:
    class Twice(pt.Component):
        one: rot.Inertia = rot.Inertia(J=1)
        other: rot.Inertia = rot.Inertia(J=1)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.one.flange_b, self.other.flange_a)

        def initial(self) -> pt.Equations:
            yield self.one.w == 1
            yield self.other.w == 2

    with pytest.raises(pt.InitializationError):
        pt.simulate(Twice(), 1.0)


def test_rotational_hard_stop() -> None:
    """Between -0.2 and 0.5 rad a spring of 1e4 N.m/rad pushes back beyond either bound."""
    lower, upper = -0.2, 0.5
    for push, rest in ((10.0, upper + 1e-3), (-10.0, lower - 1e-3)):
        stop = rot.ElastoBacklash(c=1e4, d=300, b=upper - lower, phi_rel0=(upper + lower) / 2)
        parts = rot.Fixed(), stop, rot.Inertia(J=0.1), rot.ConstantTorque(tau_constant=push), ChurningLoss(d=1)
        wires = "0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange 2.flange_b=4.flange"
        assert pt.simulate(joined(*parts, joints=wires), 5.0)["parts[2].phi"][-1] == pytest.approx(rest, rel=1e-6)


def test_translational_hard_stop() -> None:
    """Two gaps between -0.2 and 0.5 m, the second one exchanged."""
    for push, rest in ((10.0, 0.5 + 1e-3), (-10.0, -0.2 - 1e-3)):
        low, high = tr.ElastoGap(c=1e4, d=300, s_rel0=-0.2), tr.ElastoGap(c=1e4, d=300, s_rel0=-0.5)
        parts = tr.Fixed(), low, high, tr.Mass(m=1), tr.ConstantForce(f_constant=push)
        wires = (
            "0.flange=1.flange_a 1.flange_b=3.flange_a 2.flange_a=3.flange_a 0.flange=2.flange_b 3.flange_b=4.flange"
        )
        run = pt.simulate(joined(*parts, joints=wires), 20.0)
        assert run["parts[3].s"][-1] == pytest.approx(rest, rel=1e-5)


class Hoist(pt.Component):
    """A drum of 0.2 m that lifts a mass of 100 kg on a rope, or sets it down on the ground and gives rope."""

    motor: rot.Speed = rot.Speed(exact=True)
    w: TimeTable = TimeTable(table=((0, 2), (2, 2), (3, -2), (9, -2)))
    drum: rot.IdealGearR2T = rot.IdealGearR2T(ratio=1 / 0.2)
    rope: BeltSpan = BeltSpan(T_0=0, c=1e5, d=3000)
    mass: tr.Mass = tr.Mass(m=100)
    weight: tr.ConstantForce = tr.ConstantForce(f_constant=-1000)
    ground: tr.ElastoGap = tr.ElastoGap(c=1e6, d=1e4)
    earth: tr.Fixed = tr.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w.y, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.drum.flangeR)
        yield pt.connect(self.drum.flangeT, self.rope.flange_b)
        yield pt.connect(self.rope.flange_a, self.mass.flange_b)
        yield pt.connect(self.mass.flange_a, self.weight.flange, self.ground.flange_b)
        yield pt.connect(self.ground.flange_a, self.earth.flange)


def test_rope_drum() -> None:
    """Lifting at a constant speed takes weight times radius; on the ground the rope is slack and the drum free."""
    run = pt.simulate(Hoist(), 9.0, rtol=1e-8)
    up = run.at([1.9], ["motor.flange.tau", "mass.v", "rope.f"])
    assert -up["motor.flange.tau"][0] == pytest.approx(1000 * 0.2, rel=1e-6)
    assert up["mass.v"][0] == pytest.approx(0.4, rel=1e-6)
    assert up["rope.f"][0] == pytest.approx(1000, rel=1e-6)
    assert run["rope.f"][-1] == run["motor.flange.tau"][-1] == 0
    assert run["mass.s"][-1] == pytest.approx(-1000 / 1e6, rel=1e-6)
    assert pt.energy_audit(run).closure < 1e-6


class Stalled(pt.Component):
    """An idling engine that a brake holds for a second."""

    engine: WillansEngine
    brake: rot.Brake = rot.Brake(fn_max=600, mue_pos=((0.0, 1.0),))
    press: TimeTable = TimeTable(table=((0, 0), (1, 0), (1.2, 1), (2.2, 1), (2.4, 0)))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.brake.flange_a)
        yield pt.connect(self.press.y, self.brake.f_normalized)
        yield self.engine.throttle.value == 0

    def initial(self) -> pt.Equations:
        yield self.engine.w == self.engine.w_idle


@pytest.mark.parametrize(("starter", "speed"), [(0.0, 0.0), (60.0, 85.0)])
def test_a_stalled_engine_restarts_only_by_its_starter(starter: float, speed: float) -> None:
    run = pt.simulate(Stalled(engine=WillansEngine(tau_starter=starter)), 8.0)
    assert run.at([2.1], ["engine.w"])["engine.w"][0] == pytest.approx(0, abs=1e-9)
    assert run["engine.w"][-1] == pytest.approx(speed, abs=0.1)


def test_a_closed_throttle_without_drag_gives_no_torque() -> None:
    engine = WillansEngine(tau_0=0, tau_2=0)
    w = np.array([150.0, 300.0, 500.0])
    np.testing.assert_array_equal(engine.torque(w, 0), 0)
    np.testing.assert_allclose(engine.torque(w, 0.3), 0.3 * engine.full_load(w))


@pytest.mark.parametrize("slip", [0.02, 0.1, 0.19, 0.5, 1.5, -0.05, -0.3])
def test_constant_coefficients_of_a_tyre(slip: float) -> None:
    """D sin(C atan(B k - E (B k - atan(B k)))) Fz on a road that moves."""
    B, C, D, E, load = 11.0, 1.9, 0.9, 0.97, 3000.0
    wheel = MagicFormulaWheel(load_nominal=load, Cr=0, pCx1=C, pDx1=D, pEx1=E, pKx1=B * C * D)
    parts = rot.ConstantSpeed(w_fixed=20 * (1 + slip) / 0.3), wheel, tr.ConstantSpeed(v_fixed=20)
    run = pt.simulate(joined(*parts, joints="0.flange=1.hub 1.road=2.flange"), 3.0, rtol=1e-8)
    x = B * slip
    expected = load * D * math.sin(C * math.atan(x - E * (x - math.atan(x))))
    assert run["parts[1].f"][-1] == pytest.approx(expected, rel=1e-6)


def test_torques_as_signals() -> None:
    """A clutch of 1 N per unit and 1 m slips with its signal in N.m."""
    clutch = rot.Clutch(fn_max=1, cgeo=1, mue_pos=((0.0, 1.0),))
    parts = rot.Fixed(), clutch, rot.Inertia(J=2), Constant(k=30)
    wires = "0.flange=1.flange_a 1.flange_b=2.flange_a 3.y=1.f_normalized"
    run = pt.simulate(joined(*parts, joints=wires), 1.0, starts={"parts[2].w": 40.0})
    assert run["parts[2].w"][-1] == pytest.approx(40 - 30 / 2)


class Sides(pt.Component):
    """A differential whose sides brake with 100 and 300 N.m while its cage is driven."""

    differential: Differential
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=400)
    left: rot.Inertia = rot.Inertia(J=1)
    right: rot.Inertia = rot.Inertia(J=1)
    weak: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-100)
    strong: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-300)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.flange_a)
        yield pt.connect(self.differential.right, self.right.flange_a)
        yield pt.connect(self.left.flange_b, self.weak.flange)
        yield pt.connect(self.right.flange_b, self.strong.flange)


@pytest.mark.parametrize("preload", [60.0, 120.0])
def test_a_differential_with_spring_preload_alone(preload: float) -> None:
    """The clutch moves the preload from the fast to the slow side, and holds both together if it can."""
    differential = LimitedSlipDifferential(preload=preload, bias_drive=1, bias_coast=1)
    run = pt.simulate(Sides(differential=differential), 1.0)
    slip = max(100 - preload, 0)
    assert run["left.w"][-1] == pytest.approx(slip, abs=1e-6)
    assert run["right.w"][-1] == pytest.approx(-slip, abs=1e-6)


class ThreeMeshes(Differential):
    """Side gear, two element gears and side gear on one cage; worms are less efficient where the wheel drives."""

    worm: Mesh = Mesh(ratio=-1.5, eta_ab=0.8, eta_ba=0.6)
    spur: Mesh = Mesh(ratio=-1.0, eta_ab=0.95, eta_ba=0.95)
    wheel: Mesh = Mesh(ratio=-1 / 1.5, eta_ab=0.6, eta_ba=0.8)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.crown, self.worm.carrier, self.spur.carrier, self.wheel.carrier)
        yield pt.connect(self.left, self.worm.a)
        yield pt.connect(self.worm.b, self.spur.a)
        yield pt.connect(self.spur.b, self.wheel.a)
        yield pt.connect(self.wheel.b, self.right)


def test_worms_on_a_cage_are_a_torsen_differential() -> None:
    """The slow side gets 1/(eta_1 eta_2 eta_3) of what the fast side gets."""
    run = pt.simulate(Sides(differential=ThreeMeshes()), 1.0)
    fast = 400 / (1 + 1 / (0.8 * 0.95 * 0.6))
    np.testing.assert_allclose([run["left.w"][-1], run["right.w"][-1]], [fast - 100, 100 - fast], rtol=1e-6)


class MovingPulley(pt.Component):
    """Two ends of a rope around a massless pulley."""

    a: tr.Flange = pt.port(tr.Flange)
    b: tr.Flange = pt.port(tr.Flange)
    centre: tr.Flange = pt.port(tr.Flange)

    def equations(self) -> pt.Equations:
        yield self.a.s + self.b.s == 2 * self.centre.s
        yield self.a.f == self.b.f
        yield self.centre.f == -2 * self.a.f


def test_a_pulley_that_moves() -> None:
    """A drum lifts a load on two falls of rope: (J/r^2 + m/4) a = T/r - m g/2 with the rope's acceleration a."""
    J, r, m, T = 5.0, 0.4, 800.0, 2000.0
    drum, rope = rot.Inertia(J=J), rot.IdealGearR2T(ratio=1 / r)
    parts = rot.ConstantTorque(tau_constant=T), drum, rope, MovingPulley(), tr.Fixed(), tr.Mass(m=m)
    weight = tr.ConstantForce(f_constant=-m * 9.81)
    joints = (
        "0.flange=1.flange_a 1.flange_b=2.flangeR 2.flangeT=3.a 3.b=4.flange 3.centre=5.flange_a 5.flange_b=6.flange"
    )
    run = pt.simulate(joined(*parts, weight, joints=joints), 1.0)
    a = (T / r - m * 9.81 / 2) / (J / r**2 + m / 4)
    assert run["parts[5].v"][-1] == pytest.approx(a / 2)
    assert run["parts[3].a.f"][-1] == pytest.approx(m * (9.81 + a / 2) / 2)
