"""Parts that are taken out: a plant that is given what they gave moves as the whole did."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Inertia, SpeedSensor, Torque


class Governor(pt.Component):
    """A proportional controller that switches itself off after a time."""

    k: pt.Parameter = pt.parameter("N.m.s/rad", "Gain", default=2.0)
    w: pt.Input = pt.signal_input("rad/s", "Speed")
    tau: pt.Output = pt.signal_output("N.m", "Torque")
    error: pt.Variable = pt.variable("rad/s", "Deviation")
    active: pt.Discrete = pt.discrete("1", "Whether it works", start=1.0)

    def equations(self) -> pt.Equations:
        yield self.error == 10 - self.w.value
        yield self.tau.value == self.active * self.k * self.error
        yield pt.when(pt.time > 1.0, pt.reinit(self.active, 0))


class Governed(pt.Component):
    """An inertia whose speed is held."""

    governor: Governor = Governor()
    torque: Torque = Torque()
    inertia: Inertia = Inertia(J=1.0)
    sensor: SpeedSensor = SpeedSensor()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.governor.tau, self.torque.tau)
        yield pt.connect(self.torque.flange, self.inertia.flange_a, self.sensor.flange)
        yield pt.connect(self.sensor.w, self.governor.w)


class Curious(pt.Component):
    """A whole that reads an unknown of its part."""

    governed: Governed = Governed()
    seen: pt.Variable = pt.variable("rad/s", "Deviation of the governor")

    def equations(self) -> pt.Equations:
        yield self.seen == self.governed.governor.error


def test_outputs_of_the_part_are_inputs_of_the_model() -> None:
    whole = pt.simulate(Governed(), 2.0, starts={"inertia.w": 0.0}, rtol=1e-9)
    plant = pt.compile(pt.bench(Governed(), without="governor"))
    assert list(plant.compiled.inputs) == ["governor.tau"]
    times = np.unique(np.r_[np.linspace(0, 1, 4001), np.linspace(1, 2, 5)])
    before = times <= 1.0
    torque = np.where(before, 2.0 * (10 - np.interp(times, whole.time, whole["inertia.w"])), 0.0)
    exact = 20 * np.exp(-2 * times)  # of the closed loop
    assert torque[before] == pytest.approx(exact[before], abs=2e-3)
    knots = (
        np.r_[times[before], times[~before][:1] * 0 + 1.0, times[~before]],
        np.r_[exact[before], 0.0, exact[~before] * 0],
    )
    alone = plant.simulate(2.0, inputs={"governor.tau": knots}, starts={"inertia.w": 0.0})
    assert alone["inertia.w"][-1] == pytest.approx(10 * (1 - np.exp(-2)), rel=1e-6)
    assert alone["governor.w"] == pytest.approx(alone["inertia.w"])


def test_a_part_of_a_part_and_a_copy() -> None:
    class Outer(pt.Component):
        inner: Governed = Governed()

        def equations(self) -> pt.Equations:
            yield from ()

    plant = pt.compile(pt.bench(Outer(), without=["inner.governor"]))
    assert list(plant.compiled.inputs) == ["inner.governor.tau"]
    opened = pt.bench(Governed(governor=Governor(k=3.0)), without="governor")
    again = pickle.loads(pickle.dumps(opened))
    assert again == opened
    assert again.governor.k is not None
    assert pt.replace(opened, {"inertia.J": 2.0}).inertia != opened.inertia


@pytest.mark.parametrize(
    ("without", "said"),
    [
        ("inertia", r"inertia \(Inertia\) carries power through its port flange_a"),
        ("governer", r"has no part governer.*governor"),
        ("governor.tau", "has no part governor.tau"),
    ],
)
def test_what_cannot_be_taken_out(without: str, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        pt.bench(Governed(), without=without)


def test_unknowns_of_the_part_are_gone() -> None:
    with pytest.raises(pt.ParameterError, match=r"the model reads governed.governor.error"):
        pt.compile(pt.bench(Curious(), without="governed.governor"))


def test_two_inputs_of_the_model_on_one_signal_are_refused() -> None:
    class Relay(pt.Component):
        given: pt.Input = pt.signal_input("N.m", "Torque")
        tau: pt.Output = pt.signal_output("N.m", "Torque")

        def equations(self) -> pt.Equations:
            yield self.tau.value == self.given.value / 2

    class Doubled(pt.Component):
        one: Relay = Relay()
        torque: Torque = Torque()
        inertia: Inertia = Inertia(J=1.0)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.one.tau, self.torque.tau, self.one.given)
            yield pt.connect(self.torque.flange, self.inertia.flange_a)

    assert list(pt.compile(pt.bench(Doubled(), without="one")).compiled.inputs) == ["one.tau"]
