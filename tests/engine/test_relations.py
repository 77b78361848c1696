"""Conditions of several comparisons: each is an event, so that they may hold together for any short time."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from small_models import Gate

import powertrain as pt
from powertrain.components.rotational import Fixed, Inertia, Spring
from powertrain.components.translational import Mass

S, T = 0.7, 0.35
"""Position (m) and time (s) that conditions compare with; ``Gate`` is there at 0.7 and 0.35 s."""
SHORT = 2e-4
STOP = 2.0

CONDITIONS: dict[str, tuple[Callable[[Gate], pt.Symbol], float, float]] = {
    # the condition, the instant at which it becomes true, and the derivative of this instant by the load's speed
    "angle, then position": (lambda g: ca.logic_and(g.wheel.phi > g.phi, g.load.s < 1 + SHORT), 1.0, 0.0),
    "position, then angle": (lambda g: ca.logic_and(g.load.s > 1 - SHORT, g.wheel.phi < g.phi), 1 - SHORT, SHORT - 1),
    "both ends of a gap": (lambda g: ca.logic_and(g.load.s > S, g.load.s < S + SHORT), S, -S),
    "neither": (lambda g: ca.logic_not(ca.logic_or(g.load.s < S, g.load.s > S + SHORT)), S, -S),
    "time, then position": (lambda g: ca.logic_and(pt.time > T, g.load.s < T + SHORT), T, 0.0),
    "position, then time": (lambda g: ca.logic_and(g.load.s > T, pt.time < T + SHORT), T, -T),
    "one of two gaps": (
        lambda g: ca.logic_and(
            ca.logic_or(ca.logic_not(g.load.s < S), pt.time < -1), ca.logic_and(g.load.s < S + SHORT, g.passed < 1)
        ),
        S,
        -S,
    ),
}


@pytest.fixture(scope="module", params=CONDITIONS)
def gate(request: pytest.FixtureRequest) -> tuple[pt.Plant[Gate], float, float]:
    condition, instant, slope = CONDITIONS[request.param]
    return pt.compile(Gate(condition=condition)), instant, slope


def test_what_holds_for_a_moment_happens(gate: tuple[pt.Plant[Gate], float, float]) -> None:
    """The load goes on at half its speed: s = t_e + (t - t_e)/2."""
    plant, instant, slope = gate
    result = plant.simulate(STOP)
    assert result["passed"][-1] == 1
    assert [e.time for e in result.events if e.kind == "reset"] == pytest.approx([instant], abs=1e-9)
    assert result["load.s"][-1] == pytest.approx(instant + (STOP - instant) / 2, abs=1e-9)
    assert result.statistics["steps"] < 50  # steps are far longer than the condition holds
    found = pt.gradient(result, "load.s", ["v", "phi"])
    assert found["v"] == pytest.approx(instant + (STOP - instant) / 2 + slope / 2, rel=1e-6)
    assert found["phi"] == pytest.approx(0.5 if (instant, slope) == (1.0, 0.0) else 0.0, abs=1e-6)


def test_a_run_in_steps_passes_it_as_well(gate: tuple[pt.Plant[Gate], float, float]) -> None:
    plant, instant, _ = gate
    run = plant.start()
    for _ in range(4):
        run.step(STOP / 4)
    assert run["passed"] == 1
    assert run["load.s"] == pytest.approx(instant + (STOP - instant) / 2, abs=1e-9)


def test_what_only_events_change_is_compared_exactly() -> None:
    """At n = 2, n >= 2 holds and n < 2 does not, alone and beside other comparisons."""

    class Counting(pt.Component):
        n: pt.Discrete = pt.discrete("1", "Count", start=0.0)
        there: pt.Discrete = pt.discrete("1", "Whether it is there", start=0.0)
        late: pt.Discrete = pt.discrete("1", "Whether it goes on", start=0.0)
        s: pt.Variable = pt.variable("m", "Position", start=0.0)

        def equations(self) -> pt.Equations:
            yield pt.der(self.s) == 1
            yield pt.when(ca.logic_and(self.s > self.n + 1, self.n < 2), pt.reinit(self.n, self.n + 1))
            yield pt.when(self.n >= 2, pt.reinit(self.there, pt.time))
            yield pt.when(ca.logic_and(self.n >= 2, pt.time > 3), pt.reinit(self.late, pt.time))

    result = pt.compile(Counting()).simulate(5.0)
    assert [result[name][-1] for name in ("n", "there", "late")] == pytest.approx([2.0, 2.0, 3.0], abs=1e-9)


class Pushed(pt.Component):
    """A mass that is pushed while a condition holds."""

    condition: Callable[[Pushed], pt.Symbol]
    F: pt.Parameter = pt.parameter("N", "Force", default=2000.0)
    s: pt.Variable = pt.variable("m", "Position", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == self.v
        yield pt.der(self.v) == pt.switch(self.condition(self), self.F, 0.0, name="push")


PUSHES: dict[str, tuple[Callable[[Pushed], pt.Symbol], bool]] = {
    # the condition, and whether it holds for a time or for a way
    "for a time": (lambda m: ca.logic_and(pt.time > T, pt.time < T + SHORT), True),
    "for a way": (lambda m: ca.logic_and(m.s > S, m.s < S + SHORT), False),
    "not outside": (lambda m: ca.logic_not(ca.logic_or(m.s < S, m.s > S + SHORT)), False),
    "nested": (lambda m: ca.logic_and(ca.logic_or(m.s > S, m.s < -1), ca.logic_and(m.s < S + SHORT, m.v > 0)), False),
}


@pytest.mark.slow
@pytest.mark.parametrize("push", PUSHES)
def test_a_switch_that_holds_for_a_moment(push: str, tmp_path: Path) -> None:
    """An impulse F dt, or a work F ds, of a mass of 1 kg; in Python, in steps, in C, and its derivative."""
    condition, timed = PUSHES[push]
    plant = pt.compile(Pushed(condition=condition))
    result = plant.simulate(STOP)
    F = result.parameters["F"]
    speed = 1 + F * SHORT if timed else math.sqrt(1 + 2 * F * SHORT)
    assert result["v"][-1] == pytest.approx(speed, rel=1e-8)
    assert [e.name for e in result.events] == ["push", "push"]
    assert result.statistics["steps"] < 50
    assert pt.gradient(result, "v", ["F"])["F"] == pytest.approx(SHORT if timed else SHORT / speed, rel=1e-6)
    assert plant.export_c(tmp_path).simulate(STOP)["v"][-1] == pytest.approx(speed, rel=1e-8)
    run = plant.start()
    run.step(STOP)
    assert run["v"] == pytest.approx(speed, rel=1e-8)


def test_operating_points_on_both_sides_of_combined_comparisons() -> None:
    """A brake that is pressed where two signals agree: brute force over a grid that has all four cases."""

    class Pressed(pt.Component):
        a: pt.Input = pt.signal_input("1", "One signal")
        b: pt.Input = pt.signal_input("1", "Another")
        w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)

        def equations(self) -> pt.Equations:
            both = ca.logic_and(self.a.value + self.w > 0, ca.logic_not(self.b.value > 0.5))
            yield pt.der(self.w) == 3 - self.w - pt.switch(both, 2.0, 0.0)

    grid = {"a": [-5.0, -2.0, 1.0, 4.0], "b": [0.0, 1.0]}
    found = pt.steady(pt.compile(Pressed()), grid, outputs=["w"])
    a, b = (found[name].to_numpy() for name in ("a", "b"))
    on, off = (a[:, None] + 1 > 0) & (b <= 0.5), ~((a[:, None] + 3 > 0) & (b <= 0.5))
    w = found["w"].transpose("a", "b").to_numpy()
    assert (np.isclose(w, 1.0) == on).all()
    assert (np.isclose(w, 3.0) == (off & ~on)).all()


class Swinging(pt.Component):
    """A wheel on a spring and a mass that coasts, which is knocked whenever a condition of both becomes true."""

    condition: Callable[[Swinging], pt.Symbol]
    ground: Fixed = Fixed()
    spring: Spring = Spring(c=40.0)
    wheel: Inertia = Inertia(J=1.0)
    load: Mass = Mass(m=1.0)
    knocks: pt.Discrete = pt.discrete("1", "How often", start=0.0)
    held: pt.Variable = pt.variable("s", "How long the condition has held", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.ground.flange, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.wheel.flange_a)
        knock = pt.reinit(self.load.v, 0.9 * self.load.v), pt.reinit(self.knocks, self.knocks + 1)
        yield pt.when(self.condition(self), *knock, name="knock")
        yield pt.der(self.held) == pt.switch(self.condition(self), 1.0, 0.0)

    def initial(self) -> pt.Equations:
        yield self.wheel.phi == 1
        yield self.wheel.w == 0
        yield self.load.s == 0
        yield self.load.v == 1


def drawn(draws: random.Random, depth: int = 3) -> Callable[[Swinging], pt.Symbol]:
    """Comparisons of an angle, a speed, a position and the time with limits close to each other, combined at random."""
    if not depth or draws.random() < 0.2:
        kind, limit, above = draws.randrange(4), draws.choice((-0.5, 0.0, 0.5)), draws.random() < 0.5

        limit += draws.uniform(-1e-3, 1e-3)

        def relation(m: Swinging) -> pt.Symbol:
            values = (m.wheel.phi, m.wheel.w / 6, m.load.s / 2 - 1, pt.time / 2 - 1)
            return values[kind] > limit if above else values[kind] < limit

        return relation
    word = draws.choice((ca.logic_and, ca.logic_and, ca.logic_or, ca.logic_not))
    parts = [drawn(draws, depth - 1) for _ in range(1 if word is ca.logic_not else 2)]
    return lambda m: word(*(part(m) for part in parts))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50))
def test_random_conditions_need_no_short_steps(seed: int) -> None:
    plant = pt.compile(Swinging(condition=drawn(random.Random(seed))))
    coarse, fine = plant.simulate(4.0, rtol=1e-8), plant.simulate(4.0, max_step=1e-3)
    assert [e.kind + f"{e.new}" for e in coarse.events] == [e.kind + f"{e.new}" for e in fine.events]
    assert coarse.events.times == pytest.approx(fine.events.times, abs=1e-5)
    assert coarse["load.s"][-1] == pytest.approx(fine["load.s"][-1], abs=1e-5)
    assert coarse["held"][-1] == pytest.approx(fine["held"][-1], abs=1e-5)


class Falling(pt.Component):
    """x = 1 - t counts how often it came below 2, which it is from the start, and below 1/2."""

    initially: bool = True
    x: pt.Variable = pt.variable("1", "Falls", start=1.0)
    below: pt.Discrete = pt.discrete("1", "Times that 0 < x < 2 became true")
    half: pt.Discrete = pt.discrete("1", "Times that x < 1/2 became true")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -1.0
        between = ca.logic_and(self.x < 2, self.x > 0)
        yield pt.when(between, pt.reinit(self.below, self.below + 1), initially=self.initially)
        yield pt.when(self.x < 0.5, pt.reinit(self.half, self.half + 1), initially=self.initially)


@pytest.mark.parametrize("initially", [True, False])
def test_a_condition_that_holds_from_the_start(initially: bool) -> None:
    """It becomes true there, and once, if that is asked for."""
    plant = pt.compile(Falling(initially=initially))
    result = plant.simulate(1.5)
    assert set(result["below"]) == {float(initially)}
    assert result["half"][[0, -1]].tolist() == [0.0, 1.0]
    late = plant.simulate(1.2, start=1.0, starts={"x": 0.4})
    assert set(late["half"]) == {float(initially)}


class Late(pt.Component):
    """Conditions of time that change a little after one of a state."""

    before: pt.Parameter = pt.parameter("s", "How much earlier the state changes its condition", default=0.0)
    x: pt.Variable = pt.variable("s", "Runs with the time", start=0.0)
    y: pt.Variable = pt.variable("1", "Changes at 1000 s")
    early: pt.Variable = pt.variable("1", "Changes just before")
    n: pt.Discrete = pt.discrete("1", "Seconds that were counted", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1
        yield self.y == pt.switch(pt.time < 1000, 1.0, 2.0)
        yield self.early == pt.switch(self.x > 1000 - self.before, 1.0, 0.0)
        yield pt.when(pt.time > 1000, pt.reinit(self.n, self.n + 1))


@pytest.mark.parametrize("before", [-6e-10, 0.0, 1e-12, 2e-10, 6e-10, 9e-10, 2e-9])
def test_an_instant_just_after_an_event_is_not_lost(before: float) -> None:
    """Instants 1e-9 s apart are the same at 1000 s; what has changed so early is not taken back, and happens once."""
    result = pt.simulate(Late(before=before), 1200.0)
    assert result["y"][-1] == 2.0
    assert result["n"][-1] == 1.0
    assert sorted(event.name for event in result.events) == ["switch0", "switch1", "when"]
    assert [event.time for event in result.events] == pytest.approx([1000.0] * 3, rel=0, abs=3e-9)
