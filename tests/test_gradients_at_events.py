"""Derivatives of runs through every kind of event against solutions by hand."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from runs_by_formula import TIGHT
from small_models import Ball

import powertrain as pt
from powertrain.components.blocks import Sine, Step
from powertrain.components.rotational import (
    Brake,
    Damper,
    Fixed,
    Freewheel,
    IdealGear,
    Inertia,
    Speed,
    SpringDamper,
    Torque,
)


def height(t: float, e: Any, g: Any, h: Any) -> Any:
    """By hand: the time of the first hit and of every flight after it."""
    v, begin = ca.sqrt(2 * g * h), ca.sqrt(2 * h / g)
    result = h - g * t**2 / 2
    for _ in range(20):
        v = e * v
        result = ca.if_else(t > begin, v * (t - begin) - g * (t - begin) ** 2 / 2, result)
        begin = begin + 2 * v / g
    return result


@pytest.mark.parametrize("stop", [0.3, 0.9, 1.7])
def test_impacts(stop: float) -> None:
    result = pt.simulate(Ball(), stop, **TIGHT)
    e, g, h = (ca.SX.sym(n) for n in "egh")
    y = height(stop, e, g, h)
    exact = ca.Function("f", [e, g, h], [y, ca.jacobian(y, ca.vertcat(e, g, h))])
    value, slopes = exact(0.8, 10.0, 1.0)
    found = pt.gradient(result, "h", ["e", "g", "h"])
    assert found.value == pytest.approx(float(value), rel=1e-8)
    np.testing.assert_allclose(found.array, np.array(slopes).ravel(), rtol=1e-8, atol=1e-9)


def test_extremum_after_an_impact() -> None:
    """The second top: e^2 h; the greatest upward speed stands right after the first hit: e sqrt(2 g h)."""
    result = pt.simulate(Ball(), 1.0, **TIGHT)
    fastest = pt.gradient(result, pt.maximum("v"), ["e", "g", "h"])
    assert fastest.value == pytest.approx(0.8 * math.sqrt(20))
    assert fastest["e"] == pytest.approx(math.sqrt(20), rel=1e-8)
    assert fastest["h"] == pytest.approx(0.4 * math.sqrt(20), rel=1e-8)
    hardest = pt.gradient(result, pt.minimum("v"), ["e", "g", "h"])
    assert hardest["g"] == pytest.approx(-math.sqrt(2 / 10) / 2, rel=1e-8)
    assert hardest["e"] == pytest.approx(0.0, abs=1e-9)


class Braked(pt.Component):
    """A brake closes at ``step.startTime`` and stops the inertia; then a spring winds up until it slips again."""

    step: Step = Step(startTime=0.3, height=1.0)
    inertia: Inertia = Inertia(J=1.0)
    brake: Brake = Brake(fn_max=10.0, mue_pos=((0.0, 0.5),), peak=1.0)
    push: Torque = Torque()
    pushed: Step = Step(startTime=1.5, height=7.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.step.y, self.brake.f_normalized)
        yield pt.connect(self.inertia.flange_b, self.brake.flange_a)
        yield pt.connect(self.pushed.y, self.push.tau)
        yield pt.connect(self.push.flange, self.inertia.flange_a)


def test_stick_and_slip_by_hand() -> None:
    """Sliding to rest in J w/tau with w^2/(2 tau) of angle; pushed beyond the limit it moves again."""
    result = pt.simulate(Braked(), 2.0, starts={"inertia.w": 4.0}, **TIGHT)
    found = pt.gradient(
        result, "inertia.phi", ["inertia.J", "brake.fn_max", "inertia.w", "step.startTime", "pushed.startTime"]
    )
    # phi = w t1 + J w^2/(2 mue fn) + (tau - mue fn) (T - t2)^2/(2 J)
    J, fn, mue, w, t1, t2, tau = 1.0, 10.0, 0.5, 4.0, 0.3, 1.5, 7.0
    assert found["inertia.J"] == pytest.approx(w**2 / (2 * mue * fn) - (tau - mue * fn) * (2 - t2) ** 2 / (2 * J**2))
    assert found["brake.fn_max"] == pytest.approx(-J * w**2 / (2 * mue * fn**2) - mue * (2 - t2) ** 2 / (2 * J))
    assert found["inertia.w"] == pytest.approx(t1 + J * w / (mue * fn))
    assert found["step.startTime"] == pytest.approx(w)
    assert found["pushed.startTime"] == pytest.approx(-(tau - mue * fn) * (2 - t2) / J)
    speed = pt.gradient(result, pt.at("inertia.w", 1.4), ["inertia.w", "inertia.J"])
    np.testing.assert_allclose(speed.array, 0.0, atol=1e-10)


class Ramp(pt.Component):
    """A value that rises with the rate c to 1 and stays there, and the integral of the squared rate of a function of it."""

    of: pt.Map
    c: pt.Parameter = pt.parameter("1/s", "Rate", default=0.8)
    y: pt.Variable = pt.variable("1", "Value")
    z: pt.Variable = pt.variable("1", "Function of the value")
    E: pt.Variable = pt.variable("1/s", "Integral of its rate squared", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.y == pt.switch(self.c * pt.time < 1.0, self.c * pt.time, 1.0, continuous=True)
        yield self.z == self.of(self.y)
        yield pt.der(self.E) == pt.der(self.z) ** 2


@pytest.mark.parametrize("beyond", [2.0, 4.0])
def test_a_rate_jumps_where_branches_meet(beyond: float) -> None:
    """E = c^2 (1/c) = c: the kink in y, which is no event of the log, is a jump of its rate, and its instant 1/c moves.

    The slope of z over y beyond 1, which y never reaches, makes no difference.
    """
    of = pt.Map.curve([0.0, 1.0, 2.0], [0.0, 1.0, beyond])
    found = pt.gradient(pt.simulate(Ramp(of=of), 3.0, rtol=1e-10), pt.final("E"), "c")
    assert found.value == pytest.approx(0.8, rel=1e-9)
    assert found["c"] == pytest.approx(1.0, rel=1e-6)


class Chain(pt.Component):
    """A reset at x = 1 sets off another one, which remembers the time b and is over by that; y rises with b from then on."""

    c: pt.Parameter = pt.parameter("1/s", "Rate", default=0.8)
    x: pt.Variable = pt.variable("1", "Value", start=0.0)
    y: pt.Variable = pt.variable("1", "Other value", start=0.0)
    a: pt.Discrete = pt.discrete("1", "Whether x has reached 1", start=0.0)
    b: pt.Discrete = pt.discrete("s", "When", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.c
        yield pt.der(self.y) == self.b
        yield pt.when(self.x > 1.0, pt.reinit(self.a, 1.0))
        yield pt.when(ca.logic_and(self.a > 0.5, self.b < 0.5), pt.reinit(self.b, pt.time))


def test_a_reset_sets_off_another_one() -> None:
    """y = b (T - b) with b = 1/c: dy/dc = -(T - 2/c)/c^2."""
    found = pt.gradient(pt.simulate(Chain(), 3.0, rtol=1e-10), pt.final("y"), "c")
    assert found.value == pytest.approx(1.25 * 1.75, rel=1e-9)
    assert found["c"] == pytest.approx(-0.5 / 0.64, rel=1e-7)


class Dwell(pt.Component):
    """The rate of y rises by one after every dwell time T, three times."""

    T: pt.Parameter = pt.parameter("s", "Dwell time", default=0.7)
    y: pt.Variable = pt.variable("1", "Value", start=0.0)
    a: pt.Discrete = pt.discrete("1/s", "Its rate", start=0.0)
    since: pt.Discrete = pt.discrete("s", "Last change", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == self.a
        due = ca.logic_and(pt.time - self.since > self.T, self.a < 2.5)
        yield pt.when(due, pt.reinit(self.a, self.a + 1.0), pt.reinit(self.since, pt.time))


def test_a_reset_restarts_the_time_that_caused_it() -> None:
    """y = 3 t - (1 + 2 + 3) T: after each reset the comparison with the dwell time is as it was before."""
    found = pt.gradient(pt.simulate(Dwell(), 3.0, rtol=1e-10), pt.final("y"), "T")
    assert found.value == pytest.approx(9.0 - 6.0 * 0.7, rel=1e-9)
    assert found["T"] == pytest.approx(-6.0, rel=1e-7)


class TwoBrakes(pt.Component):
    """An inertia that two brakes hold against a rising torque, and a mark that is set at a speed."""

    inertia: pt.Parameter = pt.parameter("kg.m2", "Moment of inertia", default=2.0)
    first: pt.Parameter = pt.parameter("N.m", "Torque of one brake", default=3.0)
    second: pt.Parameter = pt.parameter("N.m", "Torque of the other brake", default=5.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    tau_1: pt.Variable = pt.variable("N.m", "Torque of one brake")
    tau_2: pt.Variable = pt.variable("N.m", "Torque of the other brake")
    mark: pt.Discrete = pt.discrete("1", "1 above 0.5 rad/s", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.inertia * pt.der(self.w) == 4.0 * pt.time - self.tau_1 - self.tau_2
        yield pt.friction(self.w, self.tau_1, -self.first, self.first)
        yield pt.friction(self.w, self.tau_2, -self.second, self.second)
        yield pt.when(self.w > 0.5, pt.reinit(self.mark, 1.0))


def test_laws_that_share_a_motion_let_go_together() -> None:
    """w = (a/2)(T - M/a)^2/J with a = 4 N.m/s, M the torque of both: dw/dM = -(T - M/a)/J; what laws remember of rest is no variable."""
    run = pt.simulate(TwoBrakes(), 4.0, rtol=1e-10)
    found = pt.gradient(run, pt.final("w"), ["first", "second", "inertia"])
    assert found.value == pytest.approx(4.0, rel=1e-6)
    assert [found[n] for n in ("first", "second", "inertia")] == pytest.approx([-1.0, -1.0, -2.0], rel=1e-6)


class Held(pt.Component):
    """A brake that is closed from the start takes away whatever speed the start is given."""

    first: Inertia = Inertia(J=1.0)
    second: Inertia = Inertia(J=3.0)
    clutch: Brake = Brake(fn_max=10.0)
    closed: Step = Step(height=0.0, offset=1.0)
    shaft: SpringDamper = SpringDamper(c=100.0, d=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.closed.y, self.clutch.f_normalized)
        yield pt.connect(self.first.flange_b, self.clutch.flange_a)
        yield pt.connect(self.first.flange_a, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.second.flange_a)


def test_a_stuck_law_keeps_its_speed_at_the_start() -> None:
    starts = {"first.w": 0.0, "second.w": 0.01, "first.phi": 0.0, "second.phi": 0.0}
    plant = pt.compile(Held())
    result = plant.simulate(0.05, starts=starts, **TIGHT)
    found = pt.gradient(result, "second.phi", ["first.w", "second.w"])
    h = 1e-4
    sides = [plant.simulate(0.05, starts={**starts, "first.w": s * h}, **TIGHT)["second.phi"][-1] for s in (1, -1)]
    assert found["first.w"] == pytest.approx((sides[0] - sides[1]) / (2 * h), abs=1e-6)
    assert abs(found["first.w"]) < 1e-12 < found["second.w"]


class Roof(pt.Component):
    """x' = k (1 - x), and the smaller of 2 x, which rises, and 1.5 - p x, which falls."""

    p: pt.Parameter = pt.parameter("1", "Slope of the falling side", default=0.3)
    k: pt.Parameter = pt.parameter("1/s", "Rate", default=1.2)
    x: pt.Variable = pt.variable("1", "Quantity", start=0.1)
    ridge: pt.Variable = pt.variable("1", "Roof over x")
    valley: pt.Variable = pt.variable("1", "Distance from p")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.k * (1 - self.x)
        yield self.ridge == ca.fmin(2 * self.x, 1.5 - self.p * self.x)
        yield self.valley == ca.fabs(self.x - self.p)


@pytest.mark.parametrize("few", [6, 0], ids=["forward", "adjoint"])
def test_extrema_at_corners_of_a_signal(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ridge is at x = 1.5/(2 + p), 3/(2 + p) high; the valley is 0 deep. The derivatives used to be those of one side."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    run = pt.compile(Roof()).simulate(2.0, rtol=1e-10)
    ridge = pt.gradient(run, pt.maximum("ridge"), ["p", "k", "x"])
    assert ridge.value == pytest.approx(3 / 2.3)
    np.testing.assert_allclose(ridge.array, [-3 / 2.3**2, 0.0, 0.0], atol=1e-6)
    valley = pt.gradient(run, pt.minimum("valley"), ["p", "k", "x"])
    np.testing.assert_allclose(valley.array, 0.0, atol=1e-6)


class Rectifier(pt.Component):
    """A shaft that swings at an exact speed drives a wheel in one direction: by one freewheel, or reversed by another."""

    swing: Sine = Sine(f=1.0, amplitude=10.0)
    source: Speed = Speed(exact=True)
    reverse: IdealGear = IdealGear(ratio=-1.0)
    one: Freewheel = Freewheel()
    other: Freewheel = Freewheel()
    wheel: Inertia = Inertia(J=0.5)
    drag: Damper = Damper(d=1.0)
    wall: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.swing.y, self.source.w_ref)
        yield pt.connect(self.source.flange, self.one.flange_a, self.reverse.flange_a)
        yield pt.connect(self.reverse.flange_b, self.other.flange_a)
        yield pt.connect(self.one.flange_b, self.other.flange_b, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.wall.flange)


def test_a_freewheel_that_lets_go_loses_its_drift_without_a_jump() -> None:
    """Only the speed against one freewheel is a state; the zero speed of the other has the errors of the integration.

    The wheel leaves the swing at a time s where both slow down alike: w = A sin(2 pi f s) exp(-d (t - s)/J).
    """
    A, d, J, end = 10.0, 1.0, 0.5, 3.3
    late = math.atan(d / J / (2 * math.pi)) / (2 * math.pi)
    free = end - 3.25 - late
    w = A * math.cos(2 * math.pi * late) * math.exp(-d / J * free)
    run = pt.simulate(Rectifier(), end)
    found = pt.gradient(run, "wheel.w", ["swing.amplitude", "drag.d"])
    assert found.value == pytest.approx(w, rel=1e-6)
    np.testing.assert_allclose([found["swing.amplitude"], found["drag.d"]], [w / A, -w * free / J], rtol=1e-5)


class Beside(pt.Component):
    """Beside the rectifier, a level whose rate two limits change, which it passes at one instant."""

    rectifier: Rectifier = Rectifier()
    limit: pt.Parameter = pt.parameter("1", "The first of them", default=0.7)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        a, b = pt.switch(self.x > self.limit, 1.0, 0.0), pt.switch(self.x > 0.7, 1.0, 0.0)
        yield pt.der(self.x) == 1.0 - 0.5 * a + 0.004 * b


def test_laws_that_switch_together_while_a_freewheel_loses_its_drift() -> None:
    """The limit is passed at the rate 1.004 if moved up, at 1 if moved down; then the rate is 0.504. The drift is lost in either order."""
    sides = 1 - 0.504 / 1.004, 0.504 * (1 / 0.5 - 1)
    found = pt.gradient(pt.simulate(Beside(), 1.0, rtol=1e-4), "x", "limit")
    assert found["limit"] == pytest.approx(np.mean(sides), rel=1e-7)
    assert found.spread[0] == pytest.approx(np.ptp(sides) / 2, rel=1e-6)
