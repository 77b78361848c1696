"""Limits of friction in the wrong order, with which it would drive: refused in runs, in C and at operating points."""

from __future__ import annotations

import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.equilibrium.points import NONE, OK


class Rubbing(pt.Component):
    """An inertia of 1 kg.m2 with a drag of 0.1 N.m.s/rad and a friction that an input presses."""

    gain: pt.Parameter = pt.parameter("1", "Limit over pressing torque", default=1.0)
    drive: pt.Input = pt.signal_input("N.m", "Torque", default=2.0)
    press: pt.Input = pt.signal_input("N.m", "Pressing torque", default=1.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=1.0)
    tau: pt.Variable = pt.variable("N.m", "Torque of friction")

    def equations(self) -> pt.Equations:
        limit = self.gain * self.press.value
        yield pt.der(self.w) == self.drive.value - self.tau - 0.1 * self.w
        yield pt.friction(self.w, self.tau, -limit, limit)

    def loss(self) -> pt.Symbol:
        return self.tau * self.w


class Released(pt.Component):
    """The pressing torque is a state, which falls at 1 N.m/s and does not stop at zero."""

    tau_press: pt.Variable = pt.variable("N.m", "Pressing torque", start=1.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=1.0)
    tau: pt.Variable = pt.variable("N.m", "Torque of friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.tau_press) == -1.0
        yield pt.der(self.w) == 2.0 - self.tau
        yield pt.friction(self.w, self.tau, -self.tau_press, self.tau_press)


class Fading(pt.Component):
    """The pressing torque of 1000 N.m falls along a line of its own to zero, and stays there with the error of the integration."""

    left: pt.Variable = pt.variable("N.m", "Pressing torque", start=1000.0, nominal=1000.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    tau: pt.Variable = pt.variable("N.m", "Torque of friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.left) == pt.switch(pt.time < 1.0, -500.0 * np.pi * ca.sin(np.pi * pt.time), 0.0)
        yield pt.der(self.w) == 2.0 - self.tau
        yield pt.friction(self.w, self.tau, -self.left, self.left)


FALLING = {"press": ([0.0, 2.0], [1.0, -1.0])}
SAID = "mode .the model: .* has a lower limit of {}( N.m)? above its upper limit of -{}( N.m)? at t = {} s"


@pytest.mark.parametrize("compiled", [False, True])
def test_a_limit_that_becomes_negative_ends_the_run(compiled: bool) -> None:
    """As soon as it has been zero; a state that presses has a tenth of its nominal size of 0.01 left to errors."""
    with pytest.raises(pt.SimulationError, match=SAID.format(r"5\S*e-07", r"5\S*e-07", r"1(.000000\d*)?")) as caught:
        pt.simulate(Rubbing(), 2.0, inputs=FALLING, compile=compiled)
    assert caught.value.result is not None
    assert caught.value.result["tau"].min() > -2e-3
    with pytest.raises(pt.SimulationError, match=SAID.format(r"0.001\d*", r"0.001\d*", r"1.001\d*")):
        pt.simulate(Released(), 2.0, compile=compiled)


def test_an_input_that_makes_a_limit_negative_ends_the_step() -> None:
    run = pt.compile(Rubbing()).start()
    run.step(0.1)
    with pytest.raises(pt.SimulationError, match=r"lower limit of 3 N.m above its upper limit of -3 N.m at t = 0\.1 s"):
        run.step(0.1, press=-3.0)


def test_a_limit_may_end_at_zero() -> None:
    """Also in a coarse run."""
    for rtol in (1e-3, 1e-6):
        result = pt.simulate(Fading(), 2.0, rtol=rtol)
        assert abs(result["left"][-1]) < 1000 * rtol


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_the_program_in_c_refuses_it_too(tmp_path: Path) -> None:
    plant = pt.compile(Rubbing())
    model = plant.export_c(tmp_path, inputs=FALLING)
    with pytest.raises(
        pt.SimulationError,
        match=r"in C: at t = 1(.000000\d*)? s a friction law has a lower limit",
    ):
        model.simulate(2.0, inputs=FALLING)


def test_operating_points_have_limits_in_order() -> None:
    """Speeds that are given, and speeds that are found."""
    plant, press = pt.compile(Rubbing()), np.array([-1.0, 1.0])
    free: list[str]
    for axis, values, free in ("w", [1.0, -1.0, 0.0], ["drive"]), ("drive", [1.0, 3.0, -5.0, 0.5], []):
        found = pt.steady(plant, {axis: values, "press": press}, outputs="tau", free=free).transpose("press", axis)
        assert (found.status[0] == NONE).all()
        assert np.isnan(found.tau[0]).all()
        assert (found.status[1, :2] == OK).all()
        assert "limits of friction are in the wrong order (lower above upper)" in found.problems
        assert "mode (the model: " in found.problems
    with pytest.raises(pt.ParameterError, match="limits of friction are in the wrong order"):
        pt.steady_function(plant, {"w": 1.0, "press": -1.0}, ["tau"], free=["drive"])
