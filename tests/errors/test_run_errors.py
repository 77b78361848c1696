"""What goes wrong during a run is named, and what was reached is kept."""

from __future__ import annotations

import math
import re
from typing import Any

import casadi as ca
import numpy as np
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Step


class Prescribed(pt.Component):
    """A bearing on a shaft whose speed is forced."""

    motor: rot.Speed = rot.Speed(exact=True)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, 1.0),))
    speed: pt.Component = Constant(k=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.speed.y, self.motor.w_ref)  # type: ignore[attr-defined]
        yield pt.connect(self.motor.flange, self.bearing.flange_a)


class SameSpeed(pt.Component):
    """A pressed clutch between two shafts that are forced to turn."""

    one: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=3.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=20.0)
    other: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=3.0)
    press: Step = Step(startTime=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.one.flange, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.other.flange)
        yield pt.connect(self.press.y, self.clutch.f_normalized)


def test_friction_under_prescribed_motion() -> None:
    said = ("nothing in the model can move it", "nothing determines this torque", "add a shaft stiffness")
    text = ("bearing: yield friction(", "-1 to 1 N.m", "t = 0 s", *said)
    refused(pt.InitializationError, *text, do=lambda: pt.simulate(Prescribed(), 1.0))
    moving = pt.simulate(pt.replace(Prescribed(), {"speed.k": 2.0}), 1.0)
    assert moving["bearing.tau"][-1] == 1.0
    assert not moving.notes
    text = ("clutch: yield friction(", "-10 to 10 N.m", "t = 0.5 s", *said)
    refused(pt.SimulationError, *text, do=lambda: pt.simulate(SameSpeed(), 1.0))
    slips = pt.simulate(SameSpeed(), 1.0, parameters={"other.w_fixed": 4.0})
    assert slips["clutch.tau"][-1] == 10.0


def test_friction_under_a_motion_that_pauses() -> None:
    """While it pauses no equation determines the torque: the smallest is given, and the notes say so."""
    result = pt.simulate(Prescribed(speed=Ramp(duration=1.0, startTime=0.5)), 1.0)
    assert (result["bearing.tau"][result.time < 0.5] == 0).all()
    assert result["bearing.tau"][-1] == 1.0
    (note,) = result.notes
    assert "bearing.mode is stuck where nothing can move" in note
    assert "its torque is not unique: 0 N.m is used, but any torque from -1 to 1 N.m is possible" in note


class Felt(pt.Component):
    """The torque that a bearing takes at an exact speed, put on a shaft of its own by a sensor."""

    speed: Ramp = Ramp(height=-10.0, duration=0.5, offset=10.0)
    motor: rot.Speed = rot.Speed(exact=True)
    sensor: rot.TorqueSensor = rot.TorqueSensor()
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, 2.0),))
    torque: rot.Torque = rot.Torque()
    J: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.speed.y, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.sensor.flange_a)
        yield pt.connect(self.sensor.flange_b, self.bearing.flange_a)
        yield pt.connect(self.sensor.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.J.flange_a)


def test_motion_that_follows_a_torque_that_nothing_determines() -> None:
    text = ("bearing: yield friction(", "the motion of other parts depends on its torque", "t = 0.5 s", "-2 to 2 N.m")
    refused(pt.SimulationError, *text, do=lambda: pt.simulate(Felt(), 1.0))
    assert pt.simulate(Felt(), 0.4)["J.w"][-1] == pytest.approx(2 * 0.4)


class UserTorque(pt.Component):
    """A user's function outside its range: sqrt(1 - phi) on a shaft that turns beyond phi = 1."""

    flange: rot.Flange = pt.port(rot.Flange)

    def equations(self) -> pt.Equations:
        yield self.flange.tau == -ca.sqrt(1 - self.flange.phi)


class Driven(pt.Component):
    """A shaft driven by a user's function."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    user: UserTorque = UserTorque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.user.flange, self.J1.flange_a)


def test_nan_of_a_users_function_keeps_what_was_reached() -> None:
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Driven(), 5.0)
    message = str(caught.value)
    assert "J1.w" in message
    assert "nan" in message
    assert "outside its range" in message
    assert re.search(r"user: yield self.flange.tau == .*\(test_run_errors.py:\d+\): square root of -\d", message)
    result = caught.value.result
    assert not result.ok
    assert result["J1.phi"][-1] == pytest.approx(1.0, abs=1e-2)
    assert np.isfinite(result["J1.w"]).all()


class LoosePlay(pt.Component):
    """Nothing holds the massless node between the spring and the backlash while this is in its gap."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    play: rot.ElastoBacklash2 = rot.ElastoBacklash2(c=100.0, d=1.0, b=0.2)
    spring: rot.Spring = rot.Spring(c=100.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.play.flange_a)
        yield pt.connect(self.play.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.J2.flange_a)


def test_loose_node_is_named() -> None:
    refused(
        pt.SimulationError,
        "the equations do not determine play.w_rel",
        "put an inertia, mass or damper between",
        "play: yield self.tau == switch(",
        do=lambda: pt.simulate(LoosePlay(), 1.0, starts={"J1.w": 1.0}),
    )


class Flicker(pt.Component):
    """der(x) = -1 where x > 0, else 1."""

    x: pt.Variable = pt.variable("1", "state", start=0.1)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == pt.switch(self.x > 0, -1.0, 1.0)


def test_chattering_is_named_and_keeps_what_was_reached() -> None:
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Flicker(), 1.0)
    message = str(caught.value)
    assert "switches without end" in message
    assert "switch(self.x > 0, -1.0, 1.0) (test_run_errors.py:" in message
    assert "hysteresis" in message
    result = caught.value.result
    assert result["x"][0] == pytest.approx(0.1)
    assert result.time[-1] == pytest.approx(0.1, abs=2e-3)


class Escape(pt.Component):
    """der(x) = x^2 leaves every bound at t = 1."""

    x: pt.Variable = pt.variable("1", "state", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.x**2


def test_integrator_that_fails_midway_keeps_what_was_reached() -> None:
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Escape(), 2.0)
    assert "x" in str(caught.value)
    assert "t = 1 s" in str(caught.value) or "t = 0.99" in str(caught.value) or "t = 1.0" in str(caught.value)
    result = caught.value.result
    assert not result.ok
    early = result.time < 0.9
    np.testing.assert_allclose(result["x"][early], 1 / (1 - result.time[early]), rtol=1e-4)


class Within(pt.Component):
    """A value that leaves its declared range."""

    x: pt.Variable = pt.variable("rad/s", "speed", start=0.0)

    def equations(self) -> pt.Equations:
        pt.within(self.x, 0.0, 2.0, name="speed of the map", unit="rad/s")
        yield pt.der(self.x) == 4.0


def test_value_that_leaves_its_range_with_unit_and_time() -> None:
    refused(
        pt.SimulationError,
        "speed of the map",
        "leaves its range at t = 0.5",
        "it rises above 2 rad/s; allowed is 0 to 2 rad/s",
        do=lambda: pt.simulate(Within(), 1.0),
    )


class Kept(pt.Component):
    """A value that stays as it starts, within a range that begins at zero."""

    x: pt.Variable = pt.variable("W", "power", start=0.0)

    def equations(self) -> pt.Equations:
        pt.within(self.x, 0.0, 1e6, name="power", unit="W")
        yield pt.der(self.x) == 0.0


@pytest.mark.parametrize(("start", "fits"), [(1e6 + 5e-4, True), (1e6 + 2e-3, False), (-5e-10, True), (-2e-9, False)])
def test_each_limit_of_a_range_has_its_own_rounding(start: float, fits: bool) -> None:
    """1e-9 of one plus the limit: a milliwatt at a megawatt, a nanowatt at zero."""
    if fits:
        assert pt.simulate(Kept(), 1.0, starts={"x": start})["x"][-1] == start
        return
    with pytest.raises(pt.SimulationError, match=r"power .* leaves its range at t = 0 s"):
        pt.simulate(Kept(), 1.0, starts={"x": start})


class Oscillator(pt.Component):
    """Two shafts and a spring."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    spring: rot.SpringDamper = rot.SpringDamper(c=100.0, d=1.0)
    J2: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.J2.flange_a)


def test_run_that_its_observer_ends_is_the_run_until_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """At any step, whose number is even or odd: the last sample is the state at the last time."""
    monkeypatch.setattr("powertrain.engine.loop._throttled", lambda watch: watch)
    whole = pt.simulate(Oscillator(), 3.0, starts={"J1.phi": 1.0}, rtol=1e-8)
    for seconds in (0.3, 0.61, 1.27, 1.3, 2.0):

        def watch(now: pt.Present[Any], seconds: float = seconds) -> None:
            if now.time > seconds:
                raise pt.SimulationError("enough")

        with pytest.raises(pt.SimulationError, match="enough") as caught:
            pt.simulate(Oscillator(), 3.0, starts={"J1.phi": 1.0}, rtol=1e-8, progress=watch)
        result = caught.value.result
        end = float(result.time[-1])
        assert seconds < end < seconds + 0.2
        for name in ("J1.w", "J2.phi", "J2.w"):
            assert result[name][-1] == pytest.approx(float(whole.at([end], name)[0]), abs=1e-7)


class Fan(pt.Component):
    """A shaft, an open clutch, and a fan without inertia, whose torque grows with the square of its speed."""

    shaft: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=20.0)
    fan: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-5.0, w_nominal=50.0, TorqueDirection=False
    )
    press: Step = Step(startTime=0.2)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.fan.flange)
        yield pt.connect(self.press.y, self.clutch.f_normalized)


def test_a_speed_that_nothing_determines_is_named() -> None:
    refused(
        pt.SimulationError,
        "at t = 0 s an equation does not determine der(fan.flange.phi): its slope is zero there",
        "Give what it moves an inertia",
        "fan: yield self.tau == ",
        do=lambda: pt.simulate(Fan(), 1.0, starts={"shaft.w": 10.0}),
    )


def test_a_number_that_is_not_finite_is_named_with_its_line() -> None:
    class Rushing(pt.Component):
        """Its rate is a plain number."""

        rate: float = math.inf
        x: pt.Variable = pt.variable("m", "Position")

        def equations(self) -> pt.Equations:
            yield pt.der(self.x) == self.rate

    said = ["the derivative of x is inf", "a number that is not finite in", "yield pt.der(self.x) == self.rate"]
    refused(pt.SimulationError, *said, do=lambda: pt.simulate(Rushing(), 1.0))
