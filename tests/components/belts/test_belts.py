"""Belts and chains: Eytelwein's limit, pretension, slack, stiffness, ratio, polygon effect."""

from __future__ import annotations

import math

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.belts import BeltDrive, BeltSpan, ChainDrive, Pulley
from powertrain.components.electric import VoltageSource
from powertrain.components.engines import Alternator, PistonEngine
from powertrain.components.rotational import ConstantSpeed, Fixed, Inertia, Torque, TwoFlanges


class Loaded(pt.Component):
    """A drive from a shaft of constant speed to an inertia with a braking torque that rises with time."""

    drive: TwoFlanges
    motor: ConstantSpeed = ConstantSpeed(w_fixed=50)
    load: Inertia = Inertia(J=0.02)
    brake: Torque = Torque()
    rise: pt.Parameter = pt.parameter("N.m/s", "Rise of the torque", default=5.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.motor.flange, self.drive.flange_a)
        yield pt.connect(self.drive.flange_b, self.load.flange_a)
        yield pt.connect(self.load.flange_b, self.brake.flange)
        yield self.brake.tau.value == -self.rise * pt.time


def test_belt_slips_at_eytelweins_limit() -> None:
    """2 T_0 (e - 1)/(e + 1) at the radius of the smaller wrap, e = exp(mue wrap); below it the ratio is that of the radii."""
    belt = BeltDrive(rho=1e-4, mue=0.4, d=200)
    load = {"load.w": 50 * 0.075 / 0.03, "drive.pulley_a.v": 50 * 0.075, "drive.pulley_b.v": 50 * 0.075}
    run = pt.simulate(Loaded(drive=belt), 3.0, starts=load, points=3000)
    wrap = math.pi - 2 * math.asin((0.075 - 0.03) / 0.3)
    e = math.exp(0.4 * wrap)
    limit = 2 * 300 * (e - 1) / (e + 1) * 0.03
    slipping = run["drive.pulley_b.slip"] > 1e-3
    assert run["drive.pulley_a.slip"].min() > -1e-9
    first = run.time[np.argmax(slipping & (run.time > 0.1))]
    assert 5 * first == pytest.approx(limit, rel=0.01)
    before = (run.time > 0.2) & (run.time < 0.9 * first)
    np.testing.assert_allclose(run["load.w"][before], 125, rtol=1e-3)
    tight, loose = run["drive.tight.f"][before], run["drive.loose.f"][before]
    np.testing.assert_allclose(tight + loose, 600, rtol=1e-3)
    np.testing.assert_allclose((tight - loose) * 0.03, 5 * run.time[before], atol=0.05)
    assert pt.energy_audit(run).closure < 1e-6


def test_centrifugal_tension_takes_grip() -> None:
    """The largest force on a pulley is (e - 1)(T_2 - rho v^2): at v = root(T_0/rho) there is none."""
    fast = BeltDrive(rho=0.1, T_0=300, mue=0.4)
    v = 50.0
    model = Loaded(drive=fast, motor=ConstantSpeed(w_fixed=v / 0.075), rise=1.0)
    starts = {"load.w": v / 0.03, "drive.pulley_a.v": v, "drive.pulley_b.v": v}
    run = pt.simulate(model, 3.0, starts=starts, points=3000)
    e = math.exp(0.4 * (math.pi - 2 * math.asin(0.15)))
    limit = 2 * (300 - 0.1 * v**2) * (e - 1) / (e + 1) * 0.03
    first = run.time[np.argmax((run["drive.pulley_b.slip"] > 1e-3) & (run.time > 0.1))]
    assert first == pytest.approx(limit, rel=0.02)


@pytest.mark.parametrize("mue", [1.0, 3.0])
def test_a_belt_that_lifts_off_ends_a_run(mue: float) -> None:
    """Beyond root(T_0/rho) it has no grip; with mue = 3 its pulleys used to stick and slip without end there."""
    drive = BeltDrive(T_0=14, rho=3, mue=mue, EA=7e4, d=40, radius_b=0.05)
    model = Loaded(drive=drive, motor=ConstantSpeed(w_fixed=20.0), rise=0.0)
    run = pt.simulate(model, 1.0, starts={"load.w": 30.0, "drive.pulley_a.v": 1.5, "drive.pulley_b.v": 1.5})
    assert run.time[-1] == 1.0
    with pytest.raises(
        pt.SimulationError, match=r"speed of the belt, which .* lifts off .*pulley.*-2.158\d* to 2.158\d* m/s"
    ):
        pt.simulate(model, 1.0, parameters={"motor.w_fixed": 2.2 / 0.075})


class Held(pt.Component):
    """A drive with one shaft held and a torque on the other."""

    drive: TwoFlanges
    wall: Fixed = Fixed()
    source: Torque = Torque()
    shaft: Inertia = Inertia(J=0.01)
    torque: pt.Input = pt.signal_input("N.m", "Torque", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange_a, self.wall.flange)
        yield pt.connect(self.drive.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.source.flange)
        yield self.source.tau.value == self.torque.value - 0.5 * self.shaft.w


def test_a_belt_is_a_spring() -> None:
    """Both spans work: 2 EA/length radius^2."""
    belt = BeltDrive(mue=2, radius_a=0.05, radius_b=0.05, EA=3e4, T_0=100)
    run = pt.simulate(Held(drive=belt), 4.0, inputs={"torque": 5.0})
    assert run["shaft.phi"][-1] == pytest.approx(5 / (2 * 3e4 / 0.3 * 0.05**2), rel=1e-4)


@pytest.mark.parametrize("load", [0.5, 1.0, 2.0, -2.0])
def test_a_chain_is_a_spring_until_a_strand_is_slack(load: float) -> None:
    """2 c radius^2, and half of it beyond the torque 2 T_0 radius."""
    chain = ChainDrive(polygon=False, teeth_a=20, teeth_b=20, c=1e5, T_0=100)
    radius = 9.525e-3 * 20 / (2 * math.pi)
    torque = load * 2 * 100 * radius
    run = pt.simulate(Held(drive=chain), 6.0, inputs={"torque": torque})
    beyond = max(abs(torque) - 2 * 100 * radius, 0)
    angle = (abs(torque) + beyond) / (2 * 1e5 * radius**2)
    assert run["shaft.phi"][-1] == pytest.approx(math.copysign(angle, torque), rel=1e-4)


def test_three_pulleys_in_a_ring() -> None:
    """A serpentine belt turns all pulleys at its speed."""
    radii = (0.08, 0.03, 0.05)

    class Ring(pt.Component):
        pulleys: tuple[Pulley, ...] = tuple(Pulley(radius=r) for r in radii)
        spans: tuple[BeltSpan, ...]
        shafts: tuple[Inertia, ...] = (Inertia(J=0.01),) * 2
        motor: ConstantSpeed = ConstantSpeed(w_fixed=60)

        def equations(self) -> pt.Equations:
            for k, span in enumerate(self.spans):
                yield pt.connect(self.pulleys[k].belt_b, span.flange_a)
                yield pt.connect(span.flange_b, self.pulleys[(k + 1) % 3].belt_a)
            yield pt.connect(self.motor.flange, self.pulleys[0].flange)
            for pulley, shaft in zip(self.pulleys[1:], self.shafts, strict=True):
                yield pt.connect(pulley.flange, shaft.flange_a)

    run = pt.simulate(Ring(spans=(BeltSpan(),) * 3), 6.0)
    for k, radius in enumerate(radii[1:]):
        assert run[f"shafts[{k}].w"][-1] == pytest.approx(60 * 0.08 / radius, rel=1e-5)
    assert pt.energy_audit(run).closure < 1e-6


class Charging(pt.Component):
    """An engine at a held speed drives an alternator by a belt."""

    engine: PistonEngine = PistonEngine.inline((1, 3, 4, 2))
    drive: ConstantSpeed = ConstantSpeed(w_fixed=200)
    belt: BeltDrive = BeltDrive()
    rotor: Inertia = Inertia(J=2.5e-3)
    alternator: Alternator = Alternator()
    bus: VoltageSource = VoltageSource(V=13.2)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange, self.belt.flange_a)
        yield pt.connect(self.belt.flange_b, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.alternator.flange)
        yield pt.connect(self.alternator.bus, self.bus.bus)
        yield self.engine.throttle.value == 0.3


def test_an_accessory_drive() -> None:
    """The alternator turns 2.5 times faster and delivers what its regulator asks for; the belt brings the torque, without slip."""
    run = pt.simulate(Charging(), 2.0, starts={"rotor.w": 500.0}, rtol=1e-7)
    assert run["alternator.w"][-1] == pytest.approx(500, rel=1e-4)
    assert run["alternator.i"][-1] == pytest.approx(80, rel=1e-9)
    torque = 13.2 * 80 / 0.65 / 500
    assert run["belt.flange_a.tau"][-1] == pytest.approx(2.5 * torque, rel=1e-3)
    assert run["belt.tight.f"][-1] - run["belt.loose.f"][-1] == pytest.approx(torque / 0.03, rel=1e-3)
    assert pt.energy_audit(run).closure < 1e-6


@pytest.mark.slow
def test_chain_has_its_ratio_and_polygon_effect() -> None:
    """Seven teeth: the speed of the chain between r and r cos(pi/z), with teeth_b/teeth_a in the mean."""
    chain = ChainDrive(teeth_a=7, teeth_b=70, c=1e8, d=5e3)
    run = pt.simulate(
        Loaded(drive=chain, rise=0.0, load=Inertia(J=1e-6)), 4.0, starts={"load.w": 5.0}, points=16000, rtol=1e-8
    )
    late = run.time > 1
    w, phi = run["load.w"][late], 50 * run.time[late]
    psi = (phi + math.pi / 7) % (2 * math.pi / 7) - math.pi / 7
    radius = 9.525e-3 / (2 * math.sin(math.pi / 7))
    expected = 50 * radius * np.cos(psi) / (9.525e-3 * 70 / (2 * math.pi))
    np.testing.assert_allclose(
        w, expected, rtol=0.014
    )  # what follows the third harmonic, sum of 2/(k z)^2 = 0.0116, and the other sprocket
    assert np.ptp(w) > 0.85 * np.ptp(expected)
    assert w.mean() == pytest.approx(5, rel=1e-3)
    # 2 m of chain are known to 2e-16 m, times c to 2e-8 N: over these 2 m 4e-8 J of the 1e-3 J that the small load turns over
    assert pt.energy_audit(run).closure < 1e-4


def test_a_chain_without_polygon_is_a_gear_that_may_become_slack() -> None:
    chain = ChainDrive(polygon=False)
    run = pt.simulate(Loaded(drive=chain, rise=2.0), 4.0, starts={"load.w": 25.0}, points=2000)
    np.testing.assert_allclose(run["load.w"], 25, rtol=0.02)
    radius_b = 9.525e-3 * 40 / (2 * math.pi)
    np.testing.assert_allclose(run["drive.tight"] - run["drive.loose"], 2 * run.time / radius_b, atol=5)
    assert run["drive.loose"][-1] == 0
    with pytest.raises(pt.ParameterError, match="teeth_a = 4: a sprocket has at least 6"):
        pt.compile(Loaded(drive=ChainDrive(teeth_a=4)))


def test_pulleys_have_room() -> None:
    with pytest.raises(pt.ParameterError, match="radius_a"):
        BeltDrive(distance=0.1)
