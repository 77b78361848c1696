"""Events of laws at rest under sines of time: none is lost although nothing is integrated."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import Sine
from powertrain.components.transmissions import SwitchedSplitPathTransmission
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.engine.waves import MOST, PART, Waves, _follows, _Speeds
from powertrain.modes.indicators import indicators


class Shaken(pt.Component):
    """An inertia on a brake, both pushed and pressed by sines."""

    push: Sine
    press: Sine
    torque: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    brake: rot.Brake = rot.Brake(fn_max=1.0, mue_pos=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.push.y, self.torque.tau)
        yield pt.connect(self.press.y, self.brake.f_normalized)
        yield pt.connect(self.torque.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.brake.flange_a)


class Bearing(pt.Component):
    """A bearing on a shaft whose angle is a sine."""

    shake: Sine
    moved: rot.Position = rot.Position(exact=True)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shake.y, self.moved.phi_ref)
        yield pt.connect(self.moved.flange, self.bearing.flange_a)


class Stop(pt.Component):
    """A rod whose position is a sine of 0.2 m, before a rigid stop."""

    depth: pt.Parameter = pt.parameter("m", "How far the sine would go beyond the stop")
    shake: Sine
    moved: tr.Position = tr.Position(exact=True)
    rod: tr.Mass = tr.Mass(m=1.0)
    push: tr.Force = tr.Force()
    force: pt.Variable = pt.variable("N", "Force of the stop")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shake.y, self.moved.s_ref)
        yield pt.connect(self.moved.flange, self.rod.flange_a)
        yield pt.connect(self.rod.flange_b, self.push.flange)
        yield self.push.f.value == -self.force
        yield pt.unilateral(0.2 - self.depth - self.rod.s, self.force)


def events(plant: pt.Plant[Shaken], case: dict[str, float], **options: Any) -> list[tuple[str, float, float, float]]:
    found = plant.simulate(2.0, parameters=case, rtol=1e-8, **options).events
    return [(e.name, e.old, e.new, e.time) for e in found]


def same(seldom: list[tuple[str, float, float, float]], often: list[tuple[str, float, float, float]]) -> None:
    assert [event[:3] for event in seldom] == [event[:3] for event in often]
    assert [event[3] for event in seldom] == pytest.approx([event[3] for event in often], abs=1e-4)


def random_case(rng: np.random.Generator) -> dict[str, float]:
    return {
        "push.amplitude": rng.uniform(0, 3), "push.offset": rng.uniform(-1, 1), "push.f": 10 ** rng.uniform(-1, 1.5),
        "press.amplitude": rng.uniform(0, 3), "press.offset": rng.uniform(-1, 3), "press.f": 10 ** rng.uniform(-1, 1.5),
        "push.phase": rng.uniform(0, 6), "press.phase": rng.uniform(0, 6),
    }  # fmt: skip


def compared(count: int) -> int:
    plant = pt.compile(Shaken(push=Sine(f=1, amplitude=1), press=Sine(f=1, amplitude=1)))
    total = 0
    for k in range(count):
        case = random_case(np.random.default_rng(k))
        often = events(plant, case, max_step=0.05 / max(case["push.f"], case["press.f"]))
        same(events(plant, case), often)
        total += len(often)
    return total


def test_brakes_pressed_by_sines() -> None:
    assert compared(12) > 30


@pytest.mark.slow
def test_six_hundred_brakes_pressed_by_sines() -> None:
    assert compared(600) > 2000


def test_a_sine_of_seven_hertz_breaks_a_brake_loose_at_every_half_period() -> None:
    """The press all but vanishes 7.2 times a second (where it touched zero, round-off would say whether the brake is free there); 1 N.m
    moves the shaft whenever it is below that."""
    plant = pt.compile(Shaken(push=Sine(f=1e-6, offset=1, amplitude=0), press=Sine(f=7.2, amplitude=2, offset=2.001)))
    same(events(plant, {}), events(plant, {}, max_step=0.01))
    assert len(events(plant, {})) >= 14


@pytest.mark.parametrize("over", [s * 10.0**k for k in (-3, -4, -5, -6, -7) for s in (1, -1)])
def test_a_sine_that_just_reaches_the_limit(over: float) -> None:
    """It exceeds the limit by a thousandth of it for 2 acos(1/1.001)/(2 pi f), 14 ms at 1 Hz, or never; by a ten-millionth for 0.14 ms."""
    plant = pt.compile(Shaken(push=Sine(f=1, amplitude=1 + over), press=Sine(f=1e-6, amplitude=0, offset=1)))
    loose = [event for event in events(plant, {}) if event[2] != 0]
    assert len(loose) == (4 if over > 0 else 0)
    for k, event in enumerate(loose):
        assert event[3] == pytest.approx((np.arcsin(1 / (1 + over)) / np.pi + k) / 2, abs=1e-6)


def test_a_long_run_loses_nothing() -> None:
    """A thousand times the limit is exceeded by a millionth, on either side in turn, as in a short run."""
    plant = pt.compile(Shaken(push=Sine(f=7.2, amplitude=1 + 1e-6), press=Sine(f=1e-6, amplitude=0, offset=1)))
    assert sum(event.new != 0 for event in plant.simulate(500 / 7.2).events) == 1000


def test_steps_are_short_only_where_the_limit_is_near() -> None:
    """Eight steps in each period; more where only a close look shows that it is not reached."""
    plant = pt.compile(Shaken(push=Sine(f=1, amplitude=1), press=Sine(f=1e-6, amplitude=0, offset=1)))
    steps = [
        plant.simulate(10.0, parameters={"push.amplitude": a}).statistics["steps"] for a in (0.9, 1 - 1e-3, 1 - 1e-6)
    ]
    assert steps[0] == steps[1] < 100
    assert steps[0] < steps[2] < 3 * steps[0]


def test_a_bearing_on_a_shaken_shaft() -> None:
    plant = pt.compile(Bearing(shake=Sine(f=9.0, amplitude=0.1)))
    turns = [e.time for e in plant.simulate(2.0).events]
    assert turns == pytest.approx([(2 * k + 1) / 36 for k in range(36)], abs=1e-8)


@pytest.mark.parametrize("f", [0.37, 1.0, 3.1])
@pytest.mark.parametrize("depth", [1e-7, 1e-5, 3e-4])
def test_a_shaken_rod_hits_a_stop_for_an_instant(depth: float, f: float) -> None:
    """Nothing is integrated until then that would limit the steps; nothing stops it, so the run ends there."""
    plant = pt.compile(Stop(depth=depth, shake=Sine(f=f, amplitude=0.2)))
    with pytest.raises(pt.SimulationError, match="a motion that no force can stop") as refused:
        plant.simulate(2.0)
    assert refused.value.result.time[-1] == pytest.approx(np.arcsin(1 - depth / 0.2) / (2 * np.pi * f), abs=1e-5)


def test_a_shaken_rod_that_stays_away_from_its_stop() -> None:
    assert len(pt.simulate(Stop(depth=-1e-8, shake=Sine(f=1, amplitude=0.2)), 2.0).events) == 0


class Swept(pt.Component):
    """A brake of 1 N.m on a shaft that is pushed by a sine whose frequency rises from nothing."""

    rate: pt.Parameter = pt.parameter("1/s2", "Rise of the frequency", default=4.0)
    drive: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    brake: rot.Brake = rot.Brake(fn_max=1.0, mue_pos=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield self.drive.tau.value == (1 + 1e-4) * ca.sin(np.pi * self.rate * pt.time**2)
        yield self.brake.f_normalized.value == 1.0
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.brake.flange_a)


def test_a_sine_that_becomes_faster_is_followed_as_it_is_at_the_end() -> None:
    """It begins with the frequency 0: its first steps are told by the last one. Every extremum breaks the brake loose."""
    loose = [event.time for event in pt.simulate(Swept(), 3.0).events if event.new != 0]
    extrema = np.sqrt((np.arange(36) + 0.5) / 4.0)
    assert loose == pytest.approx(extrema, abs=2e-3)


def test_the_longest_step_follows_the_faster_end_of_a_sweep() -> None:
    """Part of a period as it is at the end of the run, or now where it slows down; a loose brake does not follow the sine."""
    dae = pt.compile(Swept()).compiled.dae
    waves = Waves(dae, indicators(dae))
    stuck, loose = np.array([0.0] * dae.m.numel()), np.array([1.0] + [0.0] * (dae.m.numel() - 1))
    names = [dae.p[i].name() for i in range(dae.p.numel())]
    p = np.where(np.array(names) == "rate", 4.0, 1.0)
    assert waves.longest_step(0.0, 3.0, stuck, p) == pytest.approx(PART / 12.0)
    assert waves.longest_step(-5.0, 3.0, stuck, p) == pytest.approx(PART / 20.0)
    assert waves.longest_step(0.0, 3.0, loose, p) == np.inf


class Powered(pt.Component):
    """A brake of 1 N.m on a shaft that is pushed by a power of a sine, or by a product of two."""

    n: int
    over: float
    f: float = 3.1
    drive: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    brake: rot.Brake = rot.Brake(fn_max=1.0, mue_pos=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        angle = 2 * np.pi * self.f * pt.time
        wave = ca.sin(angle) ** self.n if self.n else 2 * ca.sin(angle) * ca.cos(angle)
        yield self.drive.tau.value == (1 + self.over) * wave
        yield self.brake.f_normalized.value == 1.0
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.brake.flange_a)


@pytest.mark.parametrize("over", [1e-2, 1e-4, -1e-4])
@pytest.mark.parametrize("n", [0, 2, 3, 8, 40])
def test_powers_and_products_of_sines_are_as_fast_as_they_bend(n: int, over: float) -> None:
    """Every extremum breaks the brake loose, on either side: 2 f in a second, for the product 4 f."""
    loose = [event.time for event in pt.simulate(Powered(n=n, over=over), 6.0).events if event.new != 0]
    f = 6.2 if n == 0 else 3.1
    extrema = (np.arange(int(12 * f + 0.5)) + 0.5) / (2 * f)
    assert loose == pytest.approx(extrema if over > 0 else [], abs=0.03)
    assert len(loose) == (len(extrema) if over > 0 else 0)


@pytest.mark.parametrize("n", [1.5, 2.5, 4.5, 3, 9])
def test_a_power_is_as_fast_as_it_bends(n: float) -> None:
    """At its extremum the fourth derivative of a sine of the rate s is -s^2 times the second, and so it is for a power.

    CasADi writes whole powers as products, whose rate is an upper bound.
    """
    t = ca.SX.sym("t")
    wave = ca.cos(5 * t) ** n
    second = ca.jacobian(ca.jacobian(wave, t), t)
    fourth = ca.jacobian(ca.jacobian(second, t), t)
    s = np.sqrt(-float(ca.Function("ratio", [t], [fourth / second])(0.0)))
    dae: Any = SimpleNamespace(t=t, x=ca.SX(0, 1), z=ca.SX(0, 1))
    rates = [abs(float(rate)) for rate in _Speeds(dae, [wave]).of(0)]
    assert max(rates) == pytest.approx(5 * n if n == int(n) else s)
    assert max(rates) > 0.999 * s


class VariedRatio(pt.Component):
    """A transmission whose ratio follows a sine, between two inertias."""

    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)
    rotor: rot.Inertia = rot.Inertia(J=1.6)
    ratio: Sine = Sine(amplitude=0.3, offset=0.6, f=1.65)
    transmission: SwitchedSplitPathTransmission = SwitchedSplitPathTransmission()
    wheel: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.ratio, self.ratio.y)
        yield self.transmission.shift.value == 0.0
        yield pt.connect(self.transmission.flange_b, self.wheel.flange_a)


def test_a_ratio_that_elimination_multiplies_again_and_again_does_not_shorten_the_steps() -> None:
    """The clutches at rest follow the ratio, which the torques at the mesh contain some twenty times over."""
    plant = pt.compile(VariedRatio())
    dae = plant.compiled.dae
    waves, closed, values = (
        Waves(dae, indicators(dae)),
        np.zeros(dae.m.numel()),
        np.array(list(plant.parameters.values())),
    )
    assert waves.longest_step(0.0, 2.0, closed, values) > PART / 1.65 / (MOST + 1)
    assert plant.simulate(2.0).statistics["steps"] < 2000


def test_laws_follow_time_where_nothing_is_integrated() -> None:
    """A stuck law and one that is free to engage, but not one that slides."""
    dae = pt.compile(Swept()).compiled.dae
    (law,) = dae.frictions
    follows = ca.Function("follows", [dae.t, dae.m], [_follows(law, dae.t, dae.m)])
    modes = np.zeros((4, dae.m.numel()))
    modes[:, law.index] = FORWARD, STUCK, BACKWARD, FREE
    assert [float(follows(0.0, m)) for m in modes] == [0.0, 1.0, 0.0, 1.0]
