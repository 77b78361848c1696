"""Conditions of ``when`` are judged with consistent modes: what is true only while modes are sought does not happen."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Hysteresis, Ramp, TimeTable
from powertrain.components.control import StartStop
from powertrain.components.rotational import Brake, DogClutch, Fixed, Inertia, Torque

T = 0.5


class Chain(pt.Component):
    """A signal, its negation, and a count of when both are true: of a chain of switches each follows the one before."""

    T: pt.Parameter = pt.parameter("s", "Instant", default=T)
    initially: bool = False
    x: pt.Variable = pt.variable("1", "A level", start=1.0)
    count: pt.Discrete = pt.discrete("1", "How often both were true", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -0.1 * self.x
        signal = pt.switch(pt.time >= self.T, self.x, 0.0)
        negated = pt.switch(signal > 0.5, 0.0, self.x)
        both = ca.logic_and(signal > 0.5, negated > 0.5)
        yield pt.when(both, pt.reinit(self.count, self.count + 1), pt.reinit(self.x, 5.0), initially=self.initially)


def ends(plant: pt.Plant[Any], folder: Path) -> list[Any]:
    """The same run in Python, by machine code, and in an exported program."""
    return [plant.simulate(1.0), plant.simulate(1.0, compile=True), plant.export_c(folder).simulate(1.0)]


@pytest.mark.slow
@pytest.mark.parametrize("initially", [False, True])
@pytest.mark.parametrize("instant", [T, 0.0, -1.0])
def test_a_hazard_in_a_chain_of_switches_is_no_edge(instant: float, initially: bool, tmp_path: Path) -> None:
    plant = pt.compile(Chain(T=instant, initially=initially))
    for result in ends(plant, tmp_path):
        assert result["count"][-1] == 0.0
        assert result["x"][-1] == pytest.approx(np.exp(-0.1), rel=1e-5)


class Behind(pt.Component):
    """What becomes true only behind a chain of switches."""

    T: pt.Parameter = pt.parameter("s", "Instant", default=T)
    initially: bool = False
    x: pt.Variable = pt.variable("1", "A state", start=1.0)
    count: pt.Discrete = pt.discrete("1", "How often it became true", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -0.1 * self.x
        signal = pt.switch(pt.time >= self.T, self.x, 0.0)
        negated = pt.switch(signal > 0.5, 0.0, self.x)
        yield pt.when(negated < 0.5, pt.reinit(self.count, self.count + 1), initially=self.initially)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("instant", "initially", "count"), [(T, False, 1), (0.0, False, 0), (-1.0, False, 0), (0.0, True, 1)]
)
def test_what_is_true_behind_a_chain_at_the_start_has_not_become_true(
    instant: float, initially: bool, count: float, tmp_path: Path
) -> None:
    plant = pt.compile(Behind(T=instant, initially=initially))
    assert [result["count"][-1] for result in ends(plant, tmp_path)] == [count] * 3


@pytest.mark.parametrize("initially", [False, True])
def test_a_parameter_set_in_c_makes_it_true_at_the_start(initially: bool, tmp_path: Path) -> None:
    plant = pt.compile(Behind(initially=initially))
    library = plant.export_c(tmp_path).library
    memory = np.zeros(library.pt_size() // 8 + 1)
    one = ctypes.c_void_p(memory.ctypes.data)
    library.pt_start(one)
    library.pt_set_parameter(one, list(plant.parameters).index("T"), ctypes.c_double(-1.0))
    assert library.pt_run(one, ctypes.c_double(1.0)) == 0
    assert library.pt_held(one)[plant.compiled.discretes["count"]] == float(initially)


class Raised(pt.Component):
    """A level that is raised to three times what a switch lets through."""

    T: pt.Parameter = pt.parameter("s", "Instant", default=T)
    x: pt.Variable = pt.variable("1", "A level", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -0.1 * self.x
        signal = pt.switch(pt.time >= self.T, self.x, 0.0)
        negated = pt.switch(signal > 0.5, 0.0, self.x)
        yield pt.when(negated < 0.5, pt.reinit(self.x, 3.0 * signal))


def test_resets_are_evaluated_with_the_new_modes() -> None:
    """x = 3 exp(-t/10) x(0) after the instant, wherever it lies; and the derivatives."""
    result = pt.simulate(Raised(), 1.0, rtol=1e-10)
    assert result["x"][-1] == pytest.approx(3 * np.exp(-0.1), rel=1e-8)
    found = pt.gradient(result, "x", ["x", "T"])
    assert [found["x"], found["T"]] == pytest.approx([3 * np.exp(-0.1), 0.0], abs=1e-7)


class Held(pt.Component):
    """A load on a brake that opens; it is dropped when the torque of the brake is small while nothing presses it."""

    torque: Torque = Torque()
    load: TimeTable = TimeTable(table=((0.0, 5.0), (T, 5.0), (T, 80.0), (1.0, 80.0)))
    pressed: TimeTable = TimeTable(table=((0.0, 1.0), (T, 1.0), (T, 0.5), (1.0, 0.5)))
    wheel: Inertia = Inertia(J=1.0)
    brake: Brake = Brake(fn_max=200.0)
    small: pt.Discrete = pt.discrete("1", "How often the wheel was free", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.load.y, self.torque.tau)
        yield pt.connect(self.pressed.y, self.brake.f_normalized)
        yield pt.connect(self.torque.flange, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.brake.flange_a)
        free = ca.fabs(pt.der(self.wheel.w)) < 1e-6
        yield pt.when(ca.logic_and(self.pressed.y.value < 0.75, free), pt.reinit(self.small, self.small + 1))


def test_torques_of_modes_that_have_ended_trigger_nothing() -> None:
    """Beyond the capacity the brake slips from T on: the rate of rest, zero, belongs to the mode before."""
    result = pt.simulate(Held(), 1.0)
    assert abs(result["wheel.w"][-1]) > 1.0
    assert result["small"][-1] == 0.0


@pytest.mark.parametrize(("start", "end", "y_start", "expected"), [
    (2.0, 0.5, 0.0, 1.0), (-1.0, 0.5, 1.0, 0.0), (0.5, 0.6, 1.0, 1.0), (0.5, 0.6, 0.0, 0.0),
])  # fmt: skip
def test_hysteresis_keeps_what_it_starts_with(start: float, end: float, y_start: float, expected: float) -> None:
    """Above uHigh = 1 it starts with 1, below uLow = 0 with 0, whatever ``y_start`` says, and keeps it within the band."""

    class Moved(pt.Component):
        ramp: Ramp = Ramp(offset=start, height=end - start, duration=1.0)
        relay: Hysteresis = Hysteresis(uLow=0.0, uHigh=1.0, y_start=y_start)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.ramp.y, self.relay.u)

    assert set(pt.simulate(Moved(), 1.0)["relay.y"]) == {expected}


class Dogs(pt.Component):
    """A turning shaft whose dogs a relay commands."""

    command: Callable[[Any], pt.Symbol] = lambda _: ca.SX(1.0)
    relay: Hysteresis = Hysteresis(uLow=0.3, uHigh=0.8, y_start=1.0)
    wheel: Inertia = Inertia(J=1.0)
    dogs: DogClutch = DogClutch()
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield self.relay.u.value == self.command(self)
        yield pt.connect(self.relay.y, self.dogs.engage)
        yield pt.connect(self.wheel.flange_b, self.dogs.flange_a)
        yield pt.connect(self.dogs.flange_b, self.ground.flange)


@pytest.mark.parametrize(("w", "command", "inside", "expected"), [
    (2.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (2.0, 1.0, 0.0, 1.0), (2.0, 1.0, 1.0, 1.0),
])  # fmt: skip
def test_dogs_start_as_they_are_commanded(w: float, command: float, inside: float, expected: float) -> None:
    """Not as the guess of the relay's mode commands; dogs without load go out at the start, too."""
    model = Dogs(command=lambda _: ca.SX(command))
    result = pt.simulate(model, 1.0, starts={"wheel.w": w, "dogs.inside": inside})
    assert set(result["dogs.inside"]) == {expected}
    assert result["wheel.w"][-1] == pytest.approx(0.0 if expected else w, abs=1e-6)


class Stop(pt.Component):
    """Start-stop of a car at rest."""

    pedal: TimeTable = TimeTable(table=((0.0, 0.0), (10.0, 0.0)))
    control: StartStop = StartStop(delay=3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pedal.y, self.control.accelerator)
        yield self.control.v.value == 0.0


def test_a_run_that_goes_on_remembers_since_when_the_car_rests() -> None:
    plant = pt.compile(Stop())
    whole = plant.simulate(5.0)
    first = plant.simulate(2.0)
    starts = {name: float(first[name][-1]) for name in plant.compiled.discretes}
    second = plant.simulate(5.0, start=2.0, starts=starts)
    assert first["control.resting"][-1] == 1.0
    for result in (whole, second):
        assert result.at([2.99, 3.01], "control.running") == pytest.approx([1.0, 0.0])


def test_an_engine_that_a_run_starts_stopped_is_started_by_a_pressed_pedal() -> None:
    pressed = pt.replace(Stop(), {"pedal": TimeTable(table=((0.0, 0.5), (10.0, 0.5)))})
    assert pt.simulate(pressed, 1.0, starts={"control.running": 0.0})["control.running"][-1] == 1.0
