"""What jumps leaves stuck laws and closed contacts: by a signal, a switch, a reset or a new input."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
from small_models import Belt, Body, Floor, Overrunning

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Step


class Switched(pt.Component):
    belt: Belt = Belt()
    step: Step = Step(height=1.0, startTime=0.3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.step.y, self.belt.u)


class Reset(pt.Component):
    belt: Belt = Belt()
    d: pt.Variable = pt.discrete("m/s", "speed of the belt", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.belt.u.value == self.d
        yield pt.when(pt.time > 0.3, pt.reinit(self.d, 1.0))


class Shifted(pt.Component):
    """The place of the belt is a polygon: its speed is 1 m/s from 0.3 to 0.6 s."""

    belt: Belt = Belt()
    place: pt.Variable = pt.variable("m", "place of the belt")

    def equations(self) -> pt.Equations:
        yield self.place == pt.schedule([0.0, 0.3, 0.6, 1.0], [0.0, 0.0, 0.3, 0.3])
        yield self.belt.u.value == pt.der(self.place)


@pytest.mark.parametrize("compile", [False, True])
def test_a_load_slips_on_a_belt_whose_place_has_corners(compile: bool) -> None:
    """2 N make it 0.6 m/s in 0.3 s, and stop it as fast. It had the speed of the belt at once."""
    result = pt.simulate(Shifted(), 1.0, compile=compile)
    np.testing.assert_allclose(result.at([0.3, 0.4, 0.6, 0.7, 0.95], "belt.v"), [0.0, 0.2, 0.6, 0.4, 0.0], atol=1e-9)
    assert not pt.compile(Belt()).compiled.dae.schedules[0].turns


@pytest.mark.parametrize("compile", [False, True])
@pytest.mark.parametrize("model", [Switched(), Reset()])
def test_a_load_slips_on_a_belt_that_starts_at_once(model: pt.Component, compile: bool) -> None:
    """2 N take 0.5 s for 1 m/s. It had the speed of a belt that a switch starts at once, by a force without limit."""
    result = pt.simulate(model, 1.0, compile=compile)
    times = np.array([0.2, 0.4, 0.6, 0.9])
    np.testing.assert_allclose(result.at(times, "belt.v"), [0.0, 0.2, 0.6, 1.0], atol=1e-9)


def pulled(times: list[float], speeds: list[float], end: float) -> float:
    """The speed of the load at ``end``: from jump to jump it goes to the speed of the belt with 2 m/s2, and stays there."""
    v = 0.0
    for (start, stop), u in zip(pairwise([*times, end]), speeds, strict=True):
        v += float(np.clip(u - v, -2.0 * (stop - start), 2.0 * (stop - start)))
    return v


@pytest.mark.parametrize("seed", range(20))
def test_a_belt_of_many_speeds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times, speeds = [0.0, *np.sort(rng.uniform(0.05, 2.0, 6))], rng.normal(0.0, 1.0, 7)
    stairs = np.repeat(times, 2)[1:], np.repeat(speeds, 2)[:-1]
    plant = pt.compile(Belt())
    expected = pulled(times, list(speeds), 2.1)
    assert plant.simulate(2.1, inputs={"u": stairs})["v"][-1] == pytest.approx(expected, abs=1e-8)
    run = plant.start()
    for (start, stop), u in zip(pairwise([*times, 2.1]), speeds, strict=True):
        run.step(stop - start, u=u)
    assert run["v"] == pytest.approx(expected, abs=1e-8)


def test_a_freewheel_overruns_a_belt_that_stops_and_is_struck_by_one_that_starts() -> None:
    """It went backward with the belt at once, and forward by an impulse of which nothing was said."""
    plant = pt.compile(Overrunning())

    def run(speed: float) -> pt.Result[Overrunning]:
        return plant.simulate(1.0, inputs={"u": ([0.0, 0.5, 0.5, 1.0], [0.0, 0.0, speed, speed])})

    assert run(-1.0)["v"][-1] == pytest.approx(-0.05)
    assert run(1.0)["v"][-1] == pytest.approx(1.0)
    assert [(e.time, e.kind) for e in run(1.0).events] == [(0.5, "impact")]
    hand = plant.start()
    hand.step(0.5, u=0.0)
    hand.step(0.5, u=1.0)
    assert hand["v"] == pytest.approx(1.0)
    with pytest.raises(
        pt.InitializationError, match=r"belt .* moves backward at t = 0 s, where its torque has no limit"
    ):
        plant.simulate(1.0, inputs={"u": 1.0})


class Undone(pt.Component):
    """A belt whose speed is switched on, and off by another switch at the same instant."""

    on: Overrunning = Overrunning()
    a: pt.Variable = pt.variable("1", "1 from 0.5 s on")

    def equations(self) -> pt.Equations:
        yield self.a == pt.switch(pt.time < 0.5, 0.0, 1.0)
        yield self.on.u.value == self.a - pt.switch(self.a > 0.5, 1.0, 0.0)


def test_a_jump_that_another_switch_undoes_strikes_nothing() -> None:
    result = pt.simulate(Undone(), 1.0)
    assert {e.kind for e in result.events} == {"switch"}
    assert result["on.v"][-1] == pytest.approx(0.0, abs=1e-12)


class Struck(pt.Component):
    """A mass that a belt takes along from an instant on, and another on a spring behind it."""

    speed: pt.Parameter = pt.parameter("m/s", "Speed of the belt", default=1.0)
    instant: pt.Parameter = pt.parameter("s", "When it starts", default=0.3)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    w: pt.Variable = pt.variable("m/s", "Speed of the other mass", start=0.0)
    x: pt.Variable = pt.variable("m", "Compression", start=0.0)
    f: pt.Variable = pt.variable("N", "Force of the belt")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == self.f - 0.1
        yield pt.der(self.x) == self.v - self.w
        yield pt.der(self.w) == 5.0 * self.x
        yield pt.friction(self.v - pt.switch(pt.time < self.instant, 0.0, self.speed), -self.f, -math.inf, 0.0)


def test_the_gradient_passes_through_the_impact() -> None:
    """w = u (1 - cos(a (1 s - T))) with a^2 = 5/s2, as the belt keeps the mass at u from T on."""
    angle = math.sqrt(5.0) * 0.7
    result = pt.simulate(Struck(), 1.0, rtol=1e-10)
    found = pt.gradient(result, "w", ["speed", "instant"])
    assert result["w"][-1] == pytest.approx(1.0 - math.cos(angle))
    assert found["speed"] == pytest.approx(1.0 - math.cos(angle))
    assert found["instant"] == pytest.approx(-math.sqrt(5.0) * math.sin(angle))
    second = pt.hessian(Struck(), "w", ["speed", "instant"], stop=1.0)
    mixed = -math.sqrt(5.0) * math.sin(angle)
    np.testing.assert_allclose(second, [[0.0, mixed], [mixed, 5.0 * math.cos(angle)]], atol=1e-5)


def floor(height: float) -> tuple[list[float], list[float]]:
    return [0.0, 0.3, 0.3, 1.0], [0.0, 0.0, height, height]


def test_a_floor_that_drops_leaves_the_body_in_the_air() -> None:
    """It falls 0.2 m in 0.2 s. It hung in the air, on a contact that stayed closed."""
    result = pt.simulate(Floor(), 1.0, inputs={"h": floor(-0.2)})
    assert result.at(0.4, "x") == pytest.approx(-0.05)
    assert result["x"][-1] == pytest.approx(-0.2)
    assert [round(e.time, 6) for e in result.events if e.name == "floor" and e.kind == "contact"] == [0.3, 0.5]


class Thrown(Body):
    """It is thrown up at 0.3 s."""

    def equations(self) -> pt.Equations:
        yield from self.falling()
        yield pt.when(pt.time > 0.3, pt.reinit(self.v, 2.0))


def test_a_body_that_is_thrown_up_comes_down_again() -> None:
    """0.2 m high after 0.2 s. It rose for ever, on a contact that stayed closed."""
    result = pt.simulate(Thrown(), 1.0)
    assert result.at(0.5, "x") == pytest.approx(0.2)
    assert result["x"][-1] == pytest.approx(0.0, abs=1e-9)


class Raised(Body):
    """A switch raises the floor."""

    def equations(self) -> pt.Equations:
        yield from self.falling(pt.switch(pt.time >= 0.3, 0.2, 0.0))


@pytest.mark.parametrize("compile", [False, True])
@pytest.mark.parametrize(("model", "inputs"), [(Floor(), {"h": floor(0.2)}), (Raised(), {})])
def test_a_floor_that_jumps_into_a_body_is_refused(model: pt.Component, inputs: Any, compile: bool) -> None:
    """The body went on inside the floor."""
    with pytest.raises(pt.SimulationError, match=r"at t = 0\.3 s .* sides of floor .* from 0 to -0\.2, but may not"):
        pt.simulate(model, 1.0, inputs=inputs, compile=compile)


def test_an_input_that_jumps_into_a_body_is_refused() -> None:
    run = pt.compile(Floor()).start()
    run.step(0.1, h=0.0)
    with pytest.raises(pt.SimulationError, match=r"at t = 0\.1 s .* sides of floor .* from 0 to -0\.2, but may not"):
        run.step(0.1, h=0.2)


class Wavy(pt.Component):
    """Two shafts that a clutch holds at a ratio of their angle, driven by a torque that is an input."""

    torque: pt.Input = pt.signal_input("N.m", "torque on the first")
    phi: pt.Variable = pt.variable("rad", "angle of the first", start=0.0)
    w: pt.Variable = pt.variable("rad/s", "speed of the first", start=10.0)
    spin: pt.Variable = pt.variable("rad/s", "speed of the second", start=10.0)
    grip: pt.Variable = pt.variable("N.m", "torque of the clutch")

    def equations(self) -> pt.Equations:
        ratio = 1.0 + 0.5 * ca.sin(self.phi)
        yield pt.der(self.phi) == self.w
        yield pt.der(self.w) == self.torque.value + ratio * self.grip
        yield pt.der(self.spin) == -self.grip
        yield pt.friction(self.spin - ratio * self.w, self.grip, -1e3, 1e3, name="clutch")


def test_inputs_that_move_nothing_leave_a_clutch_stuck() -> None:
    """Errors of the integration are no slip."""
    run = pt.compile(Wavy()).start(rtol=1e-4)
    for k in range(20):
        run.step(0.1, torque=float(k % 3))
    assert [event.name for event in run.result().events] == []


class Exact(pt.Component):
    """A shaft whose speed is an input."""

    w: pt.Input = pt.signal_input("rad/s", "speed")
    speed: rot.Speed = rot.Speed(exact=True)
    shaft: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.speed.w_ref)
        yield pt.connect(self.speed.flange, self.shaft.flange_a)


def test_an_input_that_jumps_with_an_inertia_on_it_is_refused() -> None:
    """The impulse was lost in silence."""
    run = pt.compile(Exact()).start()
    run.step(0.1, w=0.0)
    with pytest.raises(pt.SimulationError, match=r"at t = 0\.1 s w makes .* jump by 1 rad/s"):
        run.step(0.1, w=1.0)


class Sunk(Body):
    """A reset puts it elsewhere while it falls."""

    to: pt.Parameter = pt.parameter("m", "height after the reset", default=-0.1)

    def equations(self) -> pt.Equations:
        yield from self.falling()
        yield pt.when(pt.time > 0.2, pt.reinit(self.x, self.to))


def test_a_reset_into_a_floor_is_refused() -> None:
    plant = pt.compile(Sunk(start=1.0))
    with pytest.raises(pt.SimulationError, match=r"gap changes from 0\.8 to -0\.1, but may not"):
        plant.simulate(1.0)
    assert plant.simulate(1.0, parameters={"to": 0.0})["x"][-1] == pytest.approx(0.0, abs=1e-9)
