"""Dual-mass flywheel and mounts: natural frequency, hysteresis, Eytelwein's law in the arc, stages, balance of torques."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components.engines import Engine, MappedEngine, WillansEngine
from powertrain.components.rotational import (
    ConstantSpeed,
    ConstantTorque,
    Fixed,
    IdealGear,
    Inertia,
    Position,
    SpringDamper,
    Torque,
)
from powertrain.components.vibration import ArcSpring, Coil, DualMassFlywheel, MountedHousing, StagedSpring


def test_natural_frequency() -> None:
    """Without friction and with light springs: root(c (1/J_1 + 1/J_2))."""
    arc = ArcSpring(coils=(Coil(),), mue=0, J=1e-7)
    modes = pt.eigenmodes(pt.compile(DualMassFlywheel(arc=arc)))
    assert min(modes.frequency) == pytest.approx(math.sqrt(400 * (1 / 0.09 + 1 / 0.05)) / (2 * math.pi), rel=1e-4)


def test_frequencies_with_coils() -> None:
    """Two coils without friction: masses J_1, J/2, J/2, J_2 between springs of 4 c, 2 c and 4 c."""
    arc = ArcSpring(coils=(Coil(), Coil()), mue=0, J=8e-3)
    found = sorted(pt.eigenmodes(pt.compile(DualMassFlywheel(arc=arc))).frequency)
    stiffness = 400 * (np.diag([4.0, 6, 6, 4]) - np.diag([4.0, 2, 4], 1) - np.diag([4.0, 2, 4], -1))
    squares = np.sort(np.linalg.eigvals(np.diag(1 / np.array([0.09, 4e-3, 4e-3, 0.05])) @ stiffness).real)
    np.testing.assert_allclose(found, np.sqrt(squares[1:]) / (2 * math.pi), rtol=1e-6)


class Swung(pt.Component):
    """An arc spring in a channel of constant speed whose other end swings by ``x``."""

    arc: ArcSpring
    channel: ConstantSpeed = ConstantSpeed(w_fixed=100)
    end: Position = Position(exact=True)
    x: pt.Parameter = pt.parameter("rad", "Amplitude", default=0.3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.arc.flange_a, self.channel.flange)
        yield pt.connect(self.arc.flange_b, self.end.flange)
        yield self.end.phi_ref.value == self.channel.w_fixed * pt.time - self.x * ca.cos(math.pi * pt.time)


@pytest.mark.slow
@pytest.mark.parametrize(("w", "x"), [(100.0, 0.3), (200.0, 0.1)])
def test_area_of_the_loop(w: float, x: float) -> None:
    """One coil: T (2 x - T/c), T = mue J w^2; none where the spring does not tear the coil loose, x < T/(2 c)."""
    arc = ArcSpring(coils=(Coil(),), wrap=0, J=4e-4, mue=1.0)
    run = pt.simulate(Swung(arc=arc, channel=ConstantSpeed(w_fixed=w), x=x), 4.0, points=8000)
    whole = run.time >= 2
    angle, torque = run["arc.coils[0].flange_b.phi"] - w * run.time, run["arc.coils[0].tau_b"]
    loop = abs(float(np.trapezoid(torque[whole], angle[whole])))
    force = 1.0 * 4e-4 * w**2
    assert loop == pytest.approx(force * (2 * x - force / 400), rel=2e-3)
    assert pt.energy_audit(run).closure < 1e-6


def test_a_coil_that_sticks_stiffens_the_spring() -> None:
    """Held by the channel, half of the one-coil spring works: 2 c."""
    arc = ArcSpring(coils=(Coil(),), wrap=0, mue=1.0)
    run = pt.simulate(Swung(arc=arc, x=0.01), 2.0, starts={"arc.coils[0].phi": -0.01})
    assert np.ptp(run["arc.coils[0].w_rel"]) < 1e-9
    assert np.ptp(run["arc.coils[0].tau_b"]) == pytest.approx(2 * 400 * 0.02, rel=1e-6)


@pytest.mark.slow
def test_torque_along_the_arc_follows_eytelwein() -> None:
    """Pulled slowly at rest, four coils slide: torques at the ends as exp(mue wrap), to the square of a coil's share."""
    arc = ArcSpring(coils=(Coil(),) * 4, mue=0.2, wrap=2.4, J=1e-4)

    class Pulled(pt.Component):
        arc: ArcSpring
        wall: Fixed = Fixed()
        damper: SpringDamper = SpringDamper(c=0, d=0.05)
        end: ConstantSpeed = ConstantSpeed(w_fixed=0.1)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.arc.flange_a, self.wall.flange)
            yield pt.connect(self.arc.flange_b, self.end.flange, self.damper.flange_a)
            yield pt.connect(self.damper.flange_b, self.wall.flange)

    run = pt.simulate(Pulled(arc=arc), 2.0, points=200)
    late = run.time > 1
    ratio = np.mean(run["arc.coils[3].tau_b"][late]) / np.mean(run["arc.coils[0].tau_a"][late])
    share = 0.2 * 2.4 / 8
    assert ratio == pytest.approx(((1 + share) / (1 - share)) ** 4, rel=0.02)
    assert ratio == pytest.approx(math.exp(0.2 * 2.4), rel=0.02)


def test_stages_and_stop() -> None:
    """Torque by hand at angles in every stage, the same in both directions."""
    spring = StagedSpring(stages=((0.1, 100.0), (0.5, 300.0)))

    class Turned(pt.Component):
        spring: StagedSpring
        wall: Fixed = Fixed()
        end: ConstantSpeed = ConstantSpeed(w_fixed=1.0)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.spring.flange_a, self.wall.flange)
            yield pt.connect(self.spring.flange_b, self.end.flange)

    run = pt.simulate(Turned(spring=spring), 0.9, starts={"spring.phi_rel": -0.2}, times=[0, 0.2, 0.5, 0.9])
    np.testing.assert_allclose(run.at([0.0, 0.2, 0.5, 0.9], "spring.tau"), [-10, 0, 20, 60 + 60], atol=1e-9)
    with pytest.raises(pt.ParameterError, match=r"stages: -5 N.m/rad from 0.1 rad"):
        pt.compile(Turned(spring=StagedSpring(stages=((0.1, -5),))))


class OnMounts(pt.Component):
    """Engine torque through a gear of ratio 10 in a housing on mounts, against a held output shaft."""

    mounts: MountedHousing = MountedHousing()
    engine: Torque = Torque()
    crank: Inertia = Inertia(J=0.2)
    gear: IdealGear = IdealGear(ratio=10)
    shaft: SpringDamper = SpringDamper(c=1e4, d=100)
    wheel: Fixed = Fixed()
    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine", default=100.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.engine.tau)
        yield pt.connect(self.engine.flange, self.crank.flange_a)
        yield pt.connect(self.crank.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.wheel.flange)
        yield pt.connect(self.mounts.housing, self.engine.support, self.gear.support)


def test_mounts_carry_the_torque_of_the_half_shafts() -> None:
    """At rest the mounts carry the output torque, 10 times the engine's, whose own reaction stays inside; y^2 k phi (1 + (y phi/s_0)^2)."""
    run = pt.simulate(OnMounts(), 20.0, rtol=1e-8)
    tau, phi = run["mounts.tau"][-1], run["mounts.phi"][-1]
    assert abs(tau) == pytest.approx(1000, rel=1e-6)
    assert tau == pytest.approx(2 * 1.2e5 * 0.16 * phi * (1 + (0.4 * phi / 0.02) ** 2), rel=1e-6)
    # At every instant: what the parts on the housing put on it is what their shafts take out, less what accelerates the crank.
    reactions = run["engine.support.tau"] + run["gear.support.tau"]
    shafts = run["engine.flange.tau"] + run["gear.flange_a.tau"] + run["gear.flange_b.tau"]
    np.testing.assert_allclose(reactions, -shafts, atol=1e-9)
    np.testing.assert_allclose(run["mounts.housing.tau"], -reactions, atol=1e-9)
    assert pt.energy_audit(run).closure < 1e-7


class Powertrain(pt.Component):
    """An engine and its gear of ratio 10 in a housing on mounts; the output shaft turns at a given speed."""

    mounts: MountedHousing = MountedHousing()
    engine: Engine
    gear: IdealGear = IdealGear(ratio=10)
    road: ConstantSpeed = ConstantSpeed(w_fixed=25)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.road.flange)
        yield pt.connect(self.mounts.housing, self.engine.housing, self.gear.support)
        yield self.engine.throttle.value == 0.5


@pytest.mark.parametrize("engine", [WillansEngine(), MappedEngine.diesel()], ids=["willans", "mapped"])
def test_mounts_carry_the_reaction_of_an_engine(engine: Engine) -> None:
    run = pt.simulate(Powertrain(engine=engine), 20.0, rtol=1e-8)
    assert run["engine.w"][-1] == pytest.approx(250, rel=1e-6)
    torque = 10 * float(engine.torque(250.0, 0.5))
    assert run["road.flange.tau"][-1] == pytest.approx(torque, rel=1e-5)
    assert run["mounts.tau"][-1] == pytest.approx(-torque, rel=1e-5), "the housing rolls against the output shaft"
    assert pt.energy_audit(run).closure < 1e-7


class Afloat(pt.Component):
    """An engine whose housing is free to turn."""

    engine: WillansEngine = WillansEngine()
    block: Inertia = Inertia(J=3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.housing, self.block.flange_a)
        yield self.engine.throttle.value == 0.2


def test_a_free_engine_keeps_its_angular_momentum() -> None:
    """0.15 w_crank + 3 w_block stays that of idling at 85 rad/s; the engine knows the speed between them."""
    run = pt.simulate(Afloat(), 1.0, starts={"engine.w": 85.0, "block.w": 0.0}, rtol=1e-9)
    block = run["block.w"]
    crank = run["engine.w"] + block
    assert block[-1] < -2
    np.testing.assert_allclose(0.15 * crank + 3 * block, 0.15 * 85, rtol=1e-7)
    supplied = np.trapezoid(run["engine.tau"] * run["engine.w"], run.time)
    gained = (0.15 * crank**2 + 3 * block**2) / 2
    assert gained[-1] - gained[0] == pytest.approx(supplied, rel=1e-3)
    assert pt.energy_audit(run).closure < 1e-7


def test_frequency_of_the_roll() -> None:
    """Small oscillations: root(sum(k y^2)/J)."""
    run = pt.simulate(
        MountedHousing(mounts=((-0.4, 1.2e5, 0.0), (0.4, 1.2e5, 0.0))), 1.0, starts={"phi": 1e-4}, points=4000
    )
    phi: Any = run["phi"]
    i = np.flatnonzero((phi[:-1] > 0) & (phi[1:] <= 0))
    period = np.diff(run.time[i]).mean()
    assert 2 * math.pi / period == pytest.approx(math.sqrt(2 * 1.2e5 * 0.16 / 12), rel=1e-3)
    with pytest.raises(pt.ParameterError, match=r"mounts: k = -1 N/m at y = 0.4 m"):
        pt.compile(MountedHousing(mounts=((0.4, -1.0, 0.0),)))


def test_free_torque_is_held_by_the_stop() -> None:
    """Beyond the torque of the springs the stop of the flywheel carries: 400 phi + 400 (phi - 0.6) + 2e4 (phi - 0.95)."""

    class Loaded(pt.Component):
        flywheel: DualMassFlywheel = DualMassFlywheel()
        engine: ConstantTorque = ConstantTorque(tau_constant=900)
        damper: SpringDamper = SpringDamper(c=0, d=3)
        wall: Fixed = Fixed()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.engine.flange, self.flywheel.flange_a, self.damper.flange_a)
            yield pt.connect(self.flywheel.flange_b, self.wall.flange, self.damper.flange_b)

    run = pt.simulate(Loaded(flywheel=DualMassFlywheel(arc=ArcSpring(mue=0))), 4.0)
    phi = (900 + 400 * 0.6 + 2e4 * 0.95) / (400 + 400 + 2e4)
    assert abs(run["flywheel.stages.phi_rel"][-1]) == pytest.approx(phi, rel=1e-3)


def test_a_staged_spring_stores_the_work_that_it_takes() -> None:
    """From 4 rad/s 1 kg.m2 comes to rest where 100/2 x^2 + 900/2 (x - 0.1)^2 = 8 J, in the second stage."""
    x = float(np.roots([500.0, -90.0, 4.5 - 8.0]).max())
    spring = StagedSpring(stages=((0.0, 100.0), (0.1, 900.0)))
    model = joined(spring, Inertia(J=1), Fixed(), joints="0.flange_b=1.flange_a 0.flange_a=2.flange")
    result = run(model, 0.06, {"1.w": 4.0}, rtol=1e-9)
    stored, w = pt.energy_audit(result).components["stored"], result["parts[1].w"]
    assert stored["parts[0]"] == pytest.approx(8 - w[-1] ** 2 / 2, rel=1e-6)
    longer = run(model, 0.3, {"1.w": 4.0}, rtol=1e-9)
    assert longer["parts[1].phi"].max() == pytest.approx(x, rel=1e-4)
