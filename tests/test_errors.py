"""Bad input: every message says where, quotes the line or the value with its unit, says what is wrong and what to do."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant, Ramp, Sine, Step


def refused(kind: type[pt.PowertrainError], *said: str, do: Callable[[], Any]) -> str:
    """The message of the error that ``do`` raises, which must contain all of ``said``."""
    with pytest.raises(kind) as caught:
        do()
    message = str(caught.value)
    for text in said:
        assert text in message, f"{text!r} is not in:\n{message}"
    return message


# --- structure


class OneShaft(pt.Component):
    """Two speed sources on one shaft."""

    motor: rot.Speed = rot.Speed(exact=True)
    brake: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=3.0)
    sine: Sine = Sine(f=1.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.J1.flange_a)
        yield pt.connect(self.J1.flange_b, self.brake.flange)


def test_two_speed_sources_on_one_shaft() -> None:
    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown",
        "motor: yield self.w == self.w_ref.value (motions.py:",
        "brake: yield self.w == self.w_fixed (motions.py:",
        "one of these has to go",
        do=lambda: pt.compile(OneShaft()),
    )


class TwoGears(pt.Component):
    """Two gears side by side."""

    g1: rot.IdealGear = rot.IdealGear(ratio=2.0)
    g2: rot.IdealGear = rot.IdealGear(ratio=3.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.g1.flange_a, self.g2.flange_a)
        yield pt.connect(self.g1.flange_b, self.g2.flange_b, self.J2.flange_a)


def test_contradictory_gear_speeds_with_their_values() -> None:
    refused(
        pt.ModelError,
        "contradiction: these equations cannot all hold, except at standstill",
        "g1: yield self.phi_a == self.ratio * self.phi_b",
        "g2: yield self.phi_a == self.ratio * self.phi_b",
        "g1.ratio = 2",
        "g2.ratio = 3",
        do=lambda: pt.compile(TwoGears()),
    )


def test_equal_gears_side_by_side_are_a_rigid_loop() -> None:
    model = pt.replace(TwoGears(), {"g2.ratio": 2.0})
    refused(pt.ModelError, "rigid loop", "g1: yield", "g2: yield", "give it a compliance", do=lambda: pt.compile(model))


class Offset(pt.Component):
    """Two shafts held at different angles and joined."""

    wall: rot.Fixed = rot.Fixed(phi0=0.0)
    other: rot.Fixed = rot.Fixed(phi0=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wall.flange, self.other.flange)


def test_two_angles_of_one_shaft() -> None:
    said = refused(
        pt.ModelError,
        "contradiction: these equations cannot all hold",
        "wall: yield self.flange.phi == self.phi0",
        "other: yield self.flange.phi == self.phi0",
        "other.phi0 = 0.5",
        do=lambda: pt.compile(Offset()),
    )
    assert "standstill" not in said


class Loose(pt.Component):
    """A torque source whose signal nobody gives."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    drive: rot.Torque = rot.Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.J1.flange_a)


def test_input_that_is_not_connected() -> None:
    refused(
        pt.ModelError,
        "under-determined: 1 equation missing",
        "not connected: drive.tau",
        do=lambda: pt.compile(Loose()),
    )


class MissingEquation(pt.Component):
    """Two unknowns, one equation."""

    x: pt.Variable = pt.variable("1", "first")
    y: pt.Variable = pt.variable("1", "second")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.y


def test_missing_equation_names_the_variable() -> None:
    refused(pt.ModelError, "under-determined: 1 equation missing", "y", do=lambda: pt.compile(MissingEquation()))


class TooMany(pt.Component):
    """One unknown, two equations."""

    x: pt.Variable = pt.variable("1", "first")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.x
        yield ca.sin(self.x) == pt.time


def test_equation_too_much_quotes_both() -> None:
    refused(
        pt.ModelError,
        "over-determined: 2 equations for the 1 unknown x",
        "the model: yield pt.der(self.x) == -self.x (test_errors.py:",
        "ca.sin(self.x)",
        do=lambda: pt.compile(TooMany()),
    )


class OpenClutch(pt.Component):
    """A clutch whose second side is not connected."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    clutch: rot.Clutch = rot.Clutch(fn_max=10.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.press.y, self.clutch.f_normalized)
        yield pt.connect(self.J1.flange_b, self.clutch.flange_a)


def test_clutch_with_an_open_side() -> None:
    refused(
        pt.ModelError,
        "loose part: clutch: yield friction(",
        "clutch.flange_b (not connected)",
        "connect what is open to something with inertia",
        do=lambda: pt.compile(OpenClutch()),
    )


class OpenPlanetary(pt.Component):
    """A planetary gear with two open shafts."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    gear: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.gear.carrier)


def test_planetary_with_two_open_shafts() -> None:
    refused(
        pt.ModelError,
        "loose part",
        "gear.ring (not connected)",
        "gear.sun (not connected)",
        do=lambda: pt.compile(OpenPlanetary()),
    )


class InSeries(pt.Component):
    """Two clutches with nothing between."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    c1: rot.Clutch = rot.Clutch(fn_max=10.0)
    c2: rot.Clutch = rot.Clutch(fn_max=20.0)
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.press.y, self.c1.f_normalized, self.c2.f_normalized)
        yield pt.connect(self.J1.flange_b, self.c1.flange_a)
        yield pt.connect(self.c1.flange_b, self.c2.flange_a)
        yield pt.connect(self.c2.flange_b, self.J2.flange_a)


def test_clutches_in_series_without_inertia_between() -> None:
    refused(
        pt.ModelError, "c1: yield friction(", "c2: yield friction(", "put an inertia", do=lambda: pt.compile(InSeries())
    )


# --- text


class Same(pt.Component):
    """x == x."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.J1.w == self.J1.w


class Numbers(pt.Component):
    """An equation between numbers."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield 1.0 == 2.0


class NoEquation(pt.Component):
    """An expression instead of an equation."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield self.J1.w


class PythonIf(pt.Component):
    """A Python if on a symbol."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        if self.J1.w > 0:
            yield self.J1.flange_a.tau == 1


class MixedPorts(pt.Component):
    """A shaft joined to a mass."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    mass: trans.Mass = trans.Mass(m=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.mass.flange_a)


class OnePort(pt.Component):
    """connect with one port."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b)


class NoPort(pt.Component):
    """connect with a component."""

    J1: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.J1)  # type: ignore[arg-type]


class TwoOutputs(pt.Component):
    """Two outputs joined."""

    a: Constant = Constant(k=1.0)
    b: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.a.y, self.b.y)


class Partial(pt.Component):
    """A partial as a part."""

    shaft: rot.TwoFlanges = rot.TwoFlanges()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_a, self.shaft.flange_b)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (Same, ["yield self.J1.w == self.J1.w (test_errors.py:", "both sides are the same"]),
        (Numbers, ["yield 1.0 == 2.0", "plain value False"]),
        (NoEquation, ["yield self.J1.w (test_errors.py:", "is no equation", "a == b"]),
        (PythonIf, ["if self.J1.w > 0:", "Python if/and/or/not cannot decide on a symbol", "switch(condition, a, b)"]),
        (
            MixedPorts,
            ["connect(self.J1.flange_b, self.mass.flange_a)", "ports of one kind", "J1.flange_b (", "mass.flange_a ("],
        ),
        (OnePort, ["connect(self.J1.flange_b)", "at least two ports"]),
        (NoPort, ["joins ports", "J1"]),
        (TwoOutputs, ["two outputs are connected", "a.y", "b.y"]),
        (Partial, ["shaft: TwoFlanges is partial", "use one of its kinds"]),
    ],
)
def test_wrong_text(model: type[pt.Component], said: list[str]) -> None:
    refused(pt.ModelError, *said, do=lambda: pt.compile(model()))


def test_flanges_of_both_kinds_say_which_is_which() -> None:
    said = refused(pt.ModelError, do=lambda: pt.compile(MixedPorts()))
    assert "rotational" in said
    assert "translational" in said


def test_class_that_overrides_equations() -> None:
    def define() -> None:
        class Odd(rot.Inertia):
            def equations(self) -> pt.Equations:
                yield self.w == 0

    refused(pt.ModelError, "Odd.equations", "Inertia", "compose the component instead", do=define)


def test_der_outside_equations() -> None:
    refused(pt.ModelError, "inside equations()", do=lambda: pt.der(pt.time))


# --- values and names


class Shaft(pt.Component):
    """A driven shaft."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.J1.flange_a)


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Shaft]:
    return pt.compile(Shaft())


@pytest.mark.parametrize(
    ("do", "said"),
    [
        (
            lambda: rot.Inertia(J=-1.0),
            ["Inertia.J = -1 kg.m2", "outside its range [0, inf) kg.m2", "Moment of inertia"],
        ),
        (lambda: rot.Inertia(J=float("nan")), ["Inertia.J = nan kg.m2"]),
        (lambda: rot.Inertia(J="heavy"), ["Inertia.J = 'heavy' is not a number", "kg.m2"]),  # type: ignore[arg-type]
        (rot.Inertia, ["Inertia.J must be given", "kg.m2"]),
        (lambda: rot.Inertia(Jay=1.0), ["Inertia has no field Jay", "its fields: J"]),  # type: ignore[call-arg]
        (lambda: rot.Gear(ratio=2.0, eficiency=0.9), ["no field eficiency", "did you mean efficiency?"]),  # type: ignore[call-arg]
        (lambda: pt.replace(Shaft(), {"J2.J": 1.0}), ["Shaft has no field J2", "did you mean J1?"]),
    ],
)
def test_wrong_value(do: Callable[[], Any], said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=do)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"value": rot.Inertia},
            ["Shaft.J1 takes a component of kind Inertia, not Inertia itself", "give Inertia(...)"],
        ),
        ({"value": Sine(f=1.0)}, ["Shaft.J1 takes", "Inertia", "not Sine"]),
        ({"value": 3.0}, ["Shaft.J1 takes", "Inertia", "not float"]),
    ],
)
def test_wrong_kind_in_a_slot(given: dict[str, Any], said: list[str]) -> None:
    refused(pt.ModelError, *said, do=lambda: Shaft(J1=given["value"]))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parameters": {"J1.j": 1.0}}, ["no parameter J1.j", "did you mean J1.J?"]),
        ({"parameters": {"J1.J": -2.0}}, ["J1.J = -2 kg.m2 is outside its range [0, inf) kg.m2"]),
        ({"parameters": {"J1.J": None}}, ["J1.J = None is not a number"]),
        ({"starts": {"J1.om": 1.0}}, ["starts: the model has no variable J1.om"]),
        ({"starts": {"J1.w": float("nan")}}, ["starts and guesses: J1.w = nan is not a finite number"]),
        ({"guesses": {"J1.ww": 1.0}}, ["guesses: the model has no variable J1.ww", "J1.w"]),
        ({"inputs": {"torque": 1.0}}, ["no input torque"]),
        ({"stop": -1.0}, ["stop = -1 s is before start = 0 s"]),
        ({"stop": float("nan")}, ["stop = nan s"]),
        ({"times": [0.0, 2.0]}, ["times: 2 s lies outside the simulated span [0, 1] s"]),
        ({"times": [0.5, 0.2]}, ["must not decrease"]),
        ({"points": 0}, ["points = 0"]),
        ({"record": ["J1.v"]}, ["no signal J1.v"]),
        ({"method": "euler"}, ["method", "euler", "dopri5"]),
        ({"rtol": -1.0}, ["rtol", "-1"]),
        ({"max_step": 0.0}, ["max_step"]),
    ],
)
def test_wrong_option(plant: pt.Plant[Shaft], options: dict[str, Any], said: list[str]) -> None:
    refused(pt.ParameterError, *said, do=lambda: plant.simulate(**{"stop": 1.0, **options}))


def test_unknown_result(plant: pt.Plant[Shaft]) -> None:
    result = plant.simulate(0.1)
    refused(pt.ParameterError, "no signal J1.W", "did you mean", "J1.w", do=lambda: result["J1.W"])
    refused(pt.ParameterError, "Inertia has no field om", "w", do=lambda: result[lambda m: m.J1.om])  # type: ignore[attr-defined]


def test_unknown_port() -> None:
    class Misspelt(pt.Component):
        J1: rot.Inertia = rot.Inertia(J=1.0)
        drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=2.0)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.drive.flange, self.J1.flange_c)  # type: ignore[attr-defined]

    refused(
        pt.ModelError,
        "self.J1.flange_c",
        "J1 (Inertia) has no flange_c; did you mean flange_",
        do=lambda: pt.compile(Misspelt()),
    )


# --- starts


class Fixtures(pt.Component):
    """Two inertias on one shaft, whose starts the text gives."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    first: float = 10.0
    second: float = 10.0

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.J2.flange_a)

    def initial(self) -> pt.Equations:
        yield self.J1.w == self.first
        yield self.J2.w == self.second


def test_starts_that_agree() -> None:
    assert pt.simulate(Fixtures(), 0.1)["J2.w"][0] == 10.0


def test_starts_that_contradict_each_other() -> None:
    refused(
        pt.InitializationError,
        "inconsistent initial conditions: the model: yield self.J2.w == self.second (test_errors.py:",
        "take one of them out",
        do=lambda: pt.simulate(Fixtures(second=5.0), 0.1),
    )


def test_starts_of_the_run_that_contradict_each_other() -> None:
    refused(
        pt.InitializationError,
        "inconsistent initial conditions: J2.w",
        "asks for 5 rad/s, but the other conditions already give 10 rad/s",
        do=lambda: pt.simulate(Fixtures(), 0.1, starts={"J1.w": 10.0, "J2.w": 5.0}),
    )


class Loop(pt.Component):
    """x = exp(y), y = x + c has a solution for c < -1 only."""

    c: pt.Parameter = pt.parameter("1", "Offset", default=0.0)
    x: pt.Variable = pt.variable("1", "first")
    y: pt.Variable = pt.variable("1", "second", guess=-1.0)

    def equations(self) -> pt.Equations:
        yield self.x == ca.exp(self.y)
        yield self.y == self.x + self.c + pt.time


def test_algebraic_loop_without_solution() -> None:
    refused(
        pt.InitializationError,
        "no solution",
        "guesses",
        "(test_errors.py:",
        "left minus right is",
        do=lambda: pt.simulate(Loop(), 1.0),
    )


def test_algebraic_loop_that_loses_its_solution_on_the_way() -> None:
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Loop(c=-1.5), 1.0)
    result = caught.value.result
    assert not result.ok
    assert 0.45 < result.time[-1] <= 0.5 + 1e-6
    np.testing.assert_allclose(np.exp(result["y"][:400:20]), result["x"][:400:20], rtol=1e-5)


class OneWay(pt.Component):
    """A freewheel that starts backward."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    wheel: rot.Freewheel = rot.Freewheel()
    J2: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.J2.flange_a)


def test_freewheel_that_starts_backward() -> None:
    refused(
        pt.InitializationError,
        "wheel.mode (wheel: yield friction(",
        "moves backward at t = 0 s",
        "Give a start",
        do=lambda: pt.simulate(OneWay(), 1.0, starts={"J1.w": 5.0}),
    )


class Silent(pt.Component):
    """Equations that are written but not yielded."""

    x: pt.Variable = pt.variable("1", "Something")

    def equations(self) -> pt.Equations:  # type: ignore[return]
        self.x == 1  # noqa: B015  # pyright: ignore[reportUnusedExpression]


def test_equations_that_are_not_yielded() -> None:
    refused(pt.ModelError, "the model", "Silent", "yield a == b", do=lambda: pt.compile(Silent()))


class OneWayBesideGear(pt.Component):
    """A one-way clutch behind a speed source; the lossy gear beside it rubs on the same motion."""

    motor: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=5.0)
    clutch: rot.OneWayClutch = rot.OneWayClutch(fn_max=10.0)
    open: Constant = Constant(k=0.0)
    J1: rot.Inertia = rot.Inertia(J=1.0)
    gear: rot.Gear = rot.Gear(ratio=0.4, efficiency=0.9)
    J2: rot.Inertia = rot.Inertia(J=0.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.motor.flange, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.J1.flange_a, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.J2.flange_a)
        yield pt.connect(self.open.y, self.clutch.f_normalized)


def test_one_way_clutch_that_starts_backward_beside_another_law() -> None:
    text = ("clutch.mode (clutch: yield friction(", "moves backward at t = 0 s", "Give a start")
    refused(pt.InitializationError, *text, do=lambda: pt.simulate(OneWayBesideGear(), 1.0))
    assert pt.simulate(OneWayBesideGear(), 1.0, starts={"J1.w": 5.0})["J2.w"][-1] == pytest.approx(12.5)


# --- on the way


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
    said = ("nothing in the model can move it", "nothing determines this torque", "put a shaft stiffness")
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
    assert "bearing.mode (bearing: yield friction(" in note
    assert "its torque is not unique: 0 N.m is given, any from -1 to 1 N.m would do" in note


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
    text = ("bearing: yield friction(", "other parts move", "t = 0.5 s", "-2 to 2 N.m")
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
    assert re.search(r"user: yield self.flange.tau == .*\(test_errors.py:\d+\): square root of -\d", message)
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
    assert "switch(self.x > 0, -1.0, 1.0) (test_errors.py:" in message
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
        "rad/s, allowed 0 .. 2 rad/s",
        do=lambda: pt.simulate(Within(), 1.0),
    )


# --- processes


def test_unpicklable_function_is_named() -> None:
    plant = pt.compile(OwnTorque(law=lambda w: -w))
    said = ("OwnTorque.law = <function", "lambda", "cannot be sent to another process", "top level of a module")
    refused(pt.ParameterError, *said, do=lambda: pickle.dumps(plant))
    with ProcessPoolExecutor(1) as pool:
        refused(pt.ParameterError, *said, do=lambda: pool.submit(run, plant).result())


class OwnTorque(pt.Component):
    """A shaft with a torque by a user's function."""

    law: Callable[[pt.Symbol], pt.Symbol]
    J1: rot.Inertia = rot.Inertia(J=1.0)
    source: rot.Torque = rot.Torque()
    w: pt.Output = pt.signal_output("N.m", "torque")

    def equations(self) -> pt.Equations:
        yield self.w.value == self.law(self.J1.w)
        yield pt.connect(self.w, self.source.tau)
        yield pt.connect(self.source.flange, self.J1.flange_a)


def run(plant: pt.Plant[Any]) -> float:
    return float(plant.simulate(1.0, starts={"J1.w": 1.0})["J1.w"][-1])


def drag(w: pt.Symbol) -> pt.Symbol:
    return -w


def test_function_of_a_module_goes_to_a_process() -> None:
    plant = pt.compile(OwnTorque(law=drag))
    with ProcessPoolExecutor(1) as pool:
        assert pool.submit(run, plant).result() == pytest.approx(np.exp(-1.0), rel=1e-5)
