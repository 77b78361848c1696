"""Starts that contradict each other, and equations without a solution."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from refusals import refused

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant


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
        "inconsistent initial conditions: the model: yield self.J2.w == self.second (test_start_errors.py:",
        "remove one of them",
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
        "(test_start_errors.py:",
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
        "(speed -5 rad/s)",
        "Choose initial values",
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
    text = ("clutch.mode (clutch: yield friction(", "moves backward at t = 0 s", "Choose initial values")
    refused(pt.InitializationError, *text, do=lambda: pt.simulate(OneWayBesideGear(), 1.0))
    assert pt.simulate(OneWayBesideGear(), 1.0, starts={"J1.w": 5.0})["J2.w"][-1] == pytest.approx(12.5)


class PressedBySpeed(pt.Component):
    """A clutch whose force grows with speed, pulled at one side."""

    J1: rot.Inertia = rot.Inertia(J=1.0)
    c: rot.Clutch = rot.Clutch(fn_max=10.0)
    J2: rot.Inertia = rot.Inertia(J=1.0)
    pull: rot.ConstantTorque = rot.ConstantTorque(tau_constant=3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.c.flange_a)
        yield pt.connect(self.c.flange_b, self.J2.flange_a)
        yield pt.connect(self.J2.flange_b, self.pull.flange)
        yield self.c.f_normalized.value == 0.1 + 0.01 * self.J1.w


def test_start_by_an_acceleration_that_modes_decide() -> None:
    plant = pt.compile(PressedBySpeed())
    refused(
        pt.InitializationError,
        "c.mode: the modes of these laws at the start do not settle, and they decide J1.a",
        "give the speeds of the laws (c.w_rel) too",
        do=lambda: plant.simulate(0.1, starts={"J1.a": 1.0}),
    )
    assert plant.simulate(0.1, starts={"J1.a": 3.0, "c.w_rel": 1.0})["J1.a"][0] == pytest.approx(3.0)


class Rubbing(pt.Component):
    """An inertia with friction whose lower and upper limits are given as functions of the speed."""

    lower: Any
    upper: Any
    inertia: rot.Inertia = rot.Inertia(J=1.0)
    source: rot.Torque = rot.Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.inertia.flange_a)
        yield pt.friction(
            self.inertia.w, -self.source.tau.value, self.lower(self.inertia.w), self.upper(self.inertia.w)
        )


@pytest.mark.parametrize("speed", [0.0, 5.0])
@pytest.mark.parametrize("limit", [lambda w: 3.0, lambda w: 1.0 + 2.0 * ca.exp(-(w**2))])
def test_friction_limits_in_the_wrong_order(limit: Callable[[Any], Any], speed: float) -> None:
    value = float(limit(speed))
    refused(
        pt.InitializationError,
        "mode (the model: ",
        f"lower limit of {value:.6g} N.m above its upper limit of {-value:.6g} N.m",
        "write friction(w, torque, -limit, limit)",
        do=lambda: pt.simulate(Rubbing(lower=limit, upper=lambda w: -limit(w)), 1.0, starts={"inertia.w": speed}),
    )


@pytest.mark.parametrize("limit", [lambda w: 0.0, lambda w: 3.0])
def test_friction_limits_in_order(limit: Callable[[Any], float]) -> None:
    """An inertia of 1 kg.m2 at 5 rad/s loses 3 rad/s in a second against 3 N.m, and nothing against none."""
    result = pt.simulate(Rubbing(lower=lambda w: -limit(w), upper=limit), 1.0, starts={"inertia.w": 5.0})
    assert result["inertia.w"][-1] == pytest.approx(5.0 - limit(0.0))
