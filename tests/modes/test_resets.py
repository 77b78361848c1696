"""Several ``when`` laws that reset one variable at one instant."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Inertia


class Reset(pt.Component):
    """Two wheels on one shaft that turn with 2 rad/s, a position s = t, and laws."""

    laws: Callable[[Reset], pt.Equations]
    wheel: Inertia = Inertia(J=1.0)
    other: Inertia = Inertia(J=1.0)
    s: pt.Variable = pt.variable("m", "Position", start=0.0)
    opposite: pt.Variable = pt.variable("km", "Minus twice the position")
    held: pt.Discrete = pt.discrete("kg", "A value that is held", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wheel.flange_b, self.other.flange_a)
        yield pt.der(self.s) == 1
        yield self.opposite == -2 * self.s
        yield from self.laws(self)

    def initial(self) -> pt.Equations:
        yield self.wheel.w == 2
        yield self.wheel.phi == 0


def discretes(m: Reset) -> pt.Equations:
    yield pt.when(pt.time > 0.5, pt.reinit(m.held, 3 * m.held), name="first")
    yield pt.when(pt.time > 0.5, pt.reinit(m.held, 4), name="second")


def states(m: Reset) -> pt.Equations:
    """Two names of one state."""
    yield pt.when(m.s > 0.5, pt.reinit(m.other.w, 3 * m.held), name="first")
    yield pt.when(m.s > 0.5, pt.reinit(m.wheel.w, 4), name="second")


def multiples(m: Reset) -> pt.Equations:
    """A state and its multiple."""
    yield pt.when(m.s > 0.5, pt.reinit(m.opposite, -6), name="first")
    yield pt.when(m.s > 0.5, pt.reinit(m.s, 4), name="second")


def at_start(m: Reset) -> pt.Equations:
    yield pt.when(m.s < 1, pt.reinit(m.held, 3), name="first", initially=True)
    yield pt.when(m.wheel.w > 1, pt.reinit(m.held, 4), name="second", initially=True)


@pytest.mark.parametrize(
    ("laws", "instant", "variable", "unit"),
    [
        (discretes, "at t = 0.5 s", "held", "kg"),
        (states, "at t = 0.5 s", "wheel.w", "rad/s"),
        (multiples, "at t = 0.5 s", "s", "m"),
        (at_start, "start at t = 0 s:", "held", "kg"),
    ],
)
def test_two_values_of_one_variable_are_refused(
    laws: Callable[[Reset], pt.Equations], instant: str, variable: str, unit: str
) -> None:
    plant = pt.compile(Reset(laws=laws))
    for run in (lambda: plant.simulate(1.0), lambda: plant.start().step(1.0)):
        with pytest.raises((pt.SimulationError, pt.InitializationError)) as caught:
            run()
        place = r"\(.*\(test_resets.py:\d+\)\)"
        caught.match(rf"{instant} {variable} is reset to two values: ")
        caught.match(rf".* by first {place} to 3 {unit}, second {place} to 4 {unit}\.")


def equal(m: Reset) -> pt.Equations:
    """Values that are equal up to the accuracy of the instant."""
    yield pt.when(m.s > 0.5, pt.reinit(m.held, 5), pt.reinit(m.wheel.w, 0))
    yield pt.when(m.s > 0.5, pt.reinit(m.held, 10 * m.s), pt.reinit(m.other.w, m.s - pt.time))


def one_after_the_other(m: Reset) -> pt.Equations:
    """The second law is triggered by the first."""
    yield pt.when(m.s > 0.5, pt.reinit(m.held, 4))
    yield pt.when(m.held > 3, pt.reinit(m.held, 5), pt.reinit(m.wheel.w, 0))


@pytest.mark.parametrize(("apart", "differ"), [(1e-8, False), (1e-6, True)])
def test_values_differ_from_a_ten_millionth_on(apart: float, differ: bool) -> None:
    def laws(m: Reset) -> pt.Equations:
        yield pt.when(m.s > 0.5, pt.reinit(m.held, 5))
        yield pt.when(m.s > 0.5, pt.reinit(m.held, 5 * (1 + apart)))

    with pytest.raises(pt.SimulationError, match="reset to two values") if differ else nullcontext():
        pt.simulate(Reset(laws=laws), stop=1.0)


@pytest.mark.parametrize("laws", [equal, one_after_the_other])
def test_equal_values_and_later_ones_are_not(laws: Callable[[Reset], pt.Equations]) -> None:
    result = pt.simulate(Reset(laws=laws), stop=1.0)
    assert result["held"][-1] == pytest.approx(5.0, abs=1e-8)
    assert np.abs(result["other.w"][-1]) < 1e-8
    assert result["other.phi"][-1] == pytest.approx(2 * 0.5, abs=1e-8)


class Relay(pt.Component):
    """A relay that switches itself on as soon as it is off, and off as soon as it is on."""

    on: pt.Discrete = pt.discrete("1", "1 while the relay is on")

    def equations(self) -> pt.Equations:
        yield pt.when(pt.time > 1.0, pt.reinit(self.on, 1.0), name="key")
        yield pt.when(self.on > 0.5, pt.reinit(self.on, 0.0), name="opens")
        yield pt.when(self.on < 0.5, pt.reinit(self.on, 1.0), name="closes")


def test_resets_of_discrete_variables_without_end_are_named() -> None:
    with pytest.raises(pt.SimulationError, match="t = 1 s resets follow one another without end: closes, key, opens"):
        pt.simulate(Relay(), 2.0)
