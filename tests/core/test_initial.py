"""Which conditions fix the start, in which order, and what the report says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from core_models import Crank, row

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.electric import AccessoryLoad, Battery


@pytest.fixture(scope="module")
def sprung() -> pt.Plant:  # type: ignore[type-arg]
    return pt.compile(row(rot.Inertia(J=1.0), rot.SpringDamper(c=100.0, d=1.0), rot.Inertia(J=2.0)))


def start(plant: pt.Plant, **options: object) -> dict[str, float]:  # type: ignore[type-arg]
    result = plant.simulate(1e-6, points=1, **options)  # type: ignore[arg-type]
    names = ("parts[0].w", "parts[2].w", "parts[1].w_rel", "parts[0].phi", "parts[2].phi", "parts[1].phi_rel")
    return {name: float(result[name][0]) for name in names}


def test_declared_starts_are_zero(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    assert set(start(sprung).values()) == {0.0}


def test_relative_speed_and_elongation_are_given(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    """What is asked holds; of the two absolute values one keeps its declared start."""
    found = start(sprung, starts={"parts[1].w_rel": 3.0, "parts[1].phi_rel": 0.1})
    assert found["parts[1].w_rel"] == 3.0
    assert found["parts[1].phi_rel"] == pytest.approx(0.1)
    assert found["parts[2].w"] - found["parts[0].w"] == pytest.approx(3.0)
    assert found["parts[2].phi"] - found["parts[0].phi"] == pytest.approx(0.1)
    assert 0.0 in (found["parts[0].w"], found["parts[2].w"])


def test_any_two_speeds_fix_the_third(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    found = start(sprung, starts={"parts[1].w_rel": 3.0, "parts[2].w": 5.0})
    assert found["parts[0].w"] == pytest.approx(2.0)
    found = start(sprung, starts={"parts[0].w": 1.0, "parts[2].w": 5.0})
    assert found["parts[1].w_rel"] == pytest.approx(4.0)


def test_three_speeds_that_contradict(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    with pytest.raises(pt.InitializationError, match=r"parts\[2\].w.*\n.*asks for 9 rad/s.* already give 4 rad/s"):
        start(sprung, starts={"parts[1].w_rel": 3.0, "parts[0].w": 1.0, "parts[2].w": 9.0})


def test_torque_as_a_start(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    """tau = c phi_rel + d w_rel = 30 with w_rel = 2: phi_rel = 0.28."""
    found = start(sprung, starts={"parts[1].tau": 30.0, "parts[1].w_rel": 2.0})
    assert found["parts[1].phi_rel"] == pytest.approx(0.28)


def test_report_says_what_was_used(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    report = repr(sprung.simulate(1e-6, starts={"parts[1].w_rel": 3.0}).report)
    lines = {line.split()[0]: line for line in reversed(report.splitlines())}
    assert "3 rad/s" in lines["parts[1].w_rel"]
    assert "given for this run" in lines["parts[1].w_rel"]
    assert "start of the variable" in report
    assert "not needed, it follows from the others" in report


def test_guesses_choose_the_branch_and_fix_nothing() -> None:
    plant = pt.compile(row(rot.Inertia(J=0.1), Crank(implicit=True)))
    angles = {}
    for guess in (0.1, np.pi - 0.1):
        result = plant.simulate(1e-6, starts={"parts[0].phi": 0.5}, guesses={"parts[1].beta": guess})
        angles[guess] = float(result["parts[1].beta"][0])
    beta = np.arcsin(0.1 * np.sin(0.5) / 0.3)
    assert angles[0.1] == pytest.approx(beta)
    assert angles[np.pi - 0.1] == pytest.approx(np.pi - beta)


class Text(pt.Component):
    """initial() says an acceleration and a speed."""

    drag: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-4.0, w_nominal=2.0, TorqueDirection=False
    )
    J1: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drag.flange, self.J1.flange_a)

    def initial(self) -> pt.Equations:
        yield self.J1.a == -8.0
        yield self.J1.phi == 1.0


def test_text_conditions_go_before_declared_starts() -> None:
    """J a = -w^2 for w > 0: a = -8 asks w = 4, found from a guess of the speed."""
    result = pt.simulate(Text(), 0.1, guesses={"J1.w": 1.0})
    assert result["J1.w"][0] == pytest.approx(4.0)
    assert result["J1.phi"][0] == pytest.approx(1.0)


def test_a_value_of_the_run_replaces_the_text() -> None:
    result = pt.simulate(Text(), 0.1, starts={"J1.w": 3.0, "J1.phi": 0.0})
    assert (result["J1.w"][0], result["J1.phi"][0]) == (3.0, 0.0)


def test_guess_of_something_computed_is_refused(sprung: pt.Plant) -> None:  # type: ignore[type-arg]
    with pytest.raises(pt.ParameterError, match="is computed from others"):
        start(sprung, guesses={"parts[1].lossPower": 1.0})


class Counting(pt.Component):
    """A load that depends on how often a shaft has turned, counted from a start of its own."""

    torque: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    first: pt.Parameter = pt.parameter("1", "First count", default=3.0)
    count: pt.Discrete = pt.discrete("1", "Count")
    other: pt.Discrete = pt.discrete("1", "One more")

    def initial(self) -> pt.Equations:
        yield self.shaft.w == 2.0
        yield self.count == 2 * self.first
        yield self.other == self.count + 1

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.shaft.flange_a)
        fast = pt.switch(self.shaft.w > 2.3, 0.5 * self.count, self.count, name="limit")
        yield self.torque.tau.value == fast
        yield pt.when(self.shaft.phi > 1, pt.reinit(self.count, self.count + 1), name="turned")


def test_discrete_variables_get_values() -> None:
    """From parameters and one another; and the names of switch and when stand in the table of events."""
    plant = pt.compile(Counting())
    for first in (3.0, 4.0):
        result = plant.simulate(1.0, parameters={"first": first})
        assert result["count"][[0, -1]].tolist() == [2 * first, 2 * first + 1]
        assert result["other"][0] == 2 * first + 1
        assert result.events.names == ["limit", "turned"]
        assert result.events[0].time == pytest.approx(0.3 / (2 * first))


class Chained(pt.Component):
    """Three discrete variables that ``initial()`` determines from one another."""

    p: pt.Parameter = pt.parameter("1", "Given", default=3.0)
    x: pt.Variable = pt.variable("1", "Sum", start=0.0)
    a: pt.Discrete = pt.discrete("1", "First")
    b: pt.Discrete = pt.discrete("1", "Second")
    c: pt.Discrete = pt.discrete("1", "Third", start=0.5)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a + 10 * self.b + 100 * self.c


class Forward(Chained):
    """a, then b from a, then c from b."""

    def initial(self) -> pt.Equations:
        yield self.a == self.p
        yield self.b == 2 * self.a
        yield self.c == self.b - 1


class Reverse(Chained):
    """The same in the other order."""

    def initial(self) -> pt.Equations:
        yield self.c == self.b - 1
        yield self.b == 2 * self.a
        yield self.a == self.p


class Together(Chained):
    """a and b from two equations together; c keeps its declared start."""

    def initial(self) -> pt.Equations:
        yield self.a + self.b == 3 * self.p
        yield self.a - self.b + self.c == 0.5 - self.p


@pytest.mark.parametrize(
    ("model", "starts", "expected"),
    [
        (Forward, {}, [3, 6, 5]),
        (Reverse, {}, [3, 6, 5]),
        (Together, {}, [3, 6, 0.5]),
        (Forward, {"a": 7.0}, [7, 14, 13]),
        (Reverse, {"a": 7.0}, [7, 14, 13]),
        (Forward, {"b": 5.0}, [3, 5, 4]),
        (Forward, {"a": 7.0, "b": 5.0}, [7, 5, 4]),
        (Together, {"c": 2.5}, [2, 7, 2.5]),
    ],
)
def test_discrete_variables_that_depend_on_one_another(
    model: type[Chained], starts: dict[str, float], expected: list[float]
) -> None:
    """The order of equations does not matter, and a value given for the run counts in the equations of the others."""
    result = pt.simulate(model(), 1.0, starts=starts)
    assert [result[name][0] for name in "abc"] == pytest.approx(expected)


class Stages(pt.Component):
    """The stages that a shaft has passed at its initial speed, and a filter that begins with their number."""

    torque: rot.ConstantTorque = rot.ConstantTorque(tau_constant=0.0)
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    stage: pt.Discrete = pt.discrete("1", "Number of the stage")
    filtered: pt.Variable = pt.variable("1", "Number, delayed")

    def initial(self) -> pt.Equations:
        yield self.stage == sum(ca.if_else(self.shaft.w > w, 1, 0) for w in (10.0, 20.0))
        yield self.filtered == self.stage

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.shaft.flange_a)
        yield pt.der(self.filtered) == self.stage - self.filtered


@pytest.mark.parametrize(("w", "stage"), [(5.0, 0), (15.0, 1), (25.0, 2)])
def test_a_discrete_variable_may_start_from_a_comparison_of_speeds(w: float, stage: int) -> None:
    result = pt.simulate(Stages(), 1.0, starts={"shaft.w": w})
    assert set(result["stage"]) == {stage}
    np.testing.assert_allclose(result["filtered"], stage, atol=1e-12)
    given = pt.simulate(Stages(), 1.0, starts={"shaft.w": w, "stage": 7.0})
    assert given["filtered"][0] == 7


def test_discrete_variables_without_a_solution() -> None:
    """Two values for one variable, also if another one is given, and an equation that is not linear in it."""

    class Twice(Chained):
        def initial(self) -> pt.Equations:
            yield self.a == self.p
            yield self.b == self.p
            yield 2 * self.a == self.p

    class Squared(Chained):
        def initial(self) -> pt.Equations:
            yield self.a**2 == self.p

    for model in Twice, Squared:
        for starts in {}, {"b": 2.0}:
            with pytest.raises(
                pt.InitializationError, match="cannot hold: the other conditions leave left minus right"
            ):
                pt.simulate(model(), 1.0, starts=starts)


class Circle(pt.Component):
    """x on the lower or upper half of a circle around -c; without a solution where |y| > 1."""

    x: pt.Variable = pt.variable("1", "Across")
    y: pt.Variable = pt.variable("1", "Along", start=0.6)
    c: pt.Parameter = pt.parameter("1", "Shift", default=0.0)

    def equations(self) -> pt.Equations:
        yield self.x**2 + self.y**2 + self.c == 1
        yield pt.der(self.y) == 0.1 * self.x


def test_a_start_holds_where_the_slopes_of_an_equation_vanish_at_the_guess() -> None:
    """At x = 0 the slope 2x is zero: the equation must not take the start of y for that."""
    result = pt.simulate(Circle(), 0.1)
    assert result["y"][0] == 0.6
    assert abs(result["x"][0]) == pytest.approx(0.8)
    with pytest.raises(pt.InitializationError, match="no solution"):
        pt.simulate(Circle(c=1.0), 0.1)


class Stiff(pt.Component):
    """Two unknowns that differences of large terms hold together."""

    k: pt.Parameter = pt.parameter("1", "Stiffness", default=1e7)
    c: pt.Parameter = pt.parameter("1", "Load", default=2.0)
    a: pt.Variable = pt.variable("1", "One", guess=1.0)
    b: pt.Variable = pt.variable("1", "Other", guess=1.0)

    def equations(self) -> pt.Equations:
        apart = self.k * self.a**2 - self.k * self.b**2
        yield self.a**3 + apart == self.c
        yield self.b**3 - 0.7 * self.k * self.a**2 + 0.7 * self.k * self.b**2 == 3.0


def test_stiff_equations_are_solved_to_their_round_off() -> None:
    """k -> infinity: a = b and 1.7 a^3 = 0.7 c + 3; below 1e-9 of the terms there is only rounding."""
    plant = pt.compile(Stiff())
    for c in np.linspace(1.0, 5.0, 20).tolist():
        a = plant.simulate(0.0, parameters={"c": c})["a"][-1]
        assert a == pytest.approx(((0.7 * c + 3) / 1.7) ** (1 / 3), rel=1e-6)


class Bus(pt.Component):
    """A battery and two loads of constant power: v^2 - U v + R P = 0 for the voltage has two roots, U and a short circuit for small P."""

    battery: Battery = Battery()
    loads: tuple[AccessoryLoad, ...] = (AccessoryLoad(), AccessoryLoad())

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.bus, *(load.bus for load in self.loads))


def test_constant_power_begins_at_the_upper_voltage() -> None:
    plant = pt.compile(Bus())
    U, R = 56 * 3.78, 0.15
    for power in (100.0, 3e3, 2e4, 0.95 * U**2 / 4 / R):
        loads = {"loads[0].P": 0.3 * power, "loads[1].P": 0.7 * power}
        found = plant.simulate(0.0, parameters=loads)["battery.bus.v"][-1]
        assert found == pytest.approx(U / 2 + np.sqrt(U**2 / 4 - R * power), rel=1e-6)
        with pytest.raises(pt.PowertrainError, match="no solution"):  # which is no reason to short the battery
            plant.simulate(0.0, parameters=loads, guesses={"loads[0].bus.v": 0.0})


class Rooted(pt.Component):
    """An unknown that has no value below x = 1."""

    x: pt.Variable = pt.variable("1", "State", start=2.0)
    z: pt.Variable = pt.variable("1", "z^3 + z = sqrt(x - 1)")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 0.0
        yield self.z**3 + self.z == ca.sqrt(self.x - 1.0)


def test_the_search_begins_at_the_declared_starts() -> None:
    """From zero there is no step; nor was there one for a battery whose car is started at rest, from a state of charge of zero."""
    z = pt.simulate(Rooted(), 1)["z"][0]
    assert z**3 + z == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("jump", [ca.sign, ca.floor, lambda g: ca.if_else(g > 1, 1, 0)])
def test_an_equation_that_jumps_with_a_discrete_variable_does_not_give_its_start(jump: Any) -> None:
    class Gear(pt.Component):
        g: pt.Discrete = pt.discrete("1", "Gear")
        w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)

        def equations(self) -> pt.Equations:
            yield pt.der(self.w) == self.g

        def initial(self) -> pt.Equations:
            yield self.g + 2 * jump(self.g) == 4

    with pytest.raises(pt.InitializationError, match="cannot hold"):
        pt.simulate(Gear(), 1)


class Constant(pt.Component):
    """Two constant values."""

    v: pt.Variable = pt.variable("1", "Value")
    x: pt.Variable = pt.variable("1", "Value that follows from the other")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == 0
        yield pt.der(self.x) == 0


CONSTANT_BUT_FOR_STEPS: dict[str, tuple[Callable[[pt.Symbol], pt.Symbol], float, float]] = {
    "sign": (ca.sign, -3.0, -1.0),
    "floor": (ca.floor, 7.3, 7.0),
    "choice": (lambda v: ca.if_else(v < -1, 5.0, 2.0), -3.0, 5.0),
}


@pytest.mark.parametrize("name", CONSTANT_BUT_FOR_STEPS)
def test_conditions_that_are_constant_but_for_steps(name: str) -> None:
    """Their slope is zero, but they are not affine."""
    step, v, x = CONSTANT_BUT_FOR_STEPS[name]

    class Stepped(pt.Component):
        pair: Constant = Constant()

        def equations(self) -> pt.Equations:
            yield from ()

        def initial(self) -> pt.Equations:
            yield self.pair.v == v
            yield self.pair.x == step(self.pair.v)

    result = pt.simulate(Stepped(), 1.0)
    assert (result["pair.v"][0], result["pair.x"][0]) == (v, x)


def test_a_far_guess_is_not_a_value() -> None:
    class Small(pt.Component):
        pair: Constant = Constant()

        def equations(self) -> pt.Equations:
            yield from ()

        def initial(self) -> pt.Equations:
            yield self.pair.v == 1e-6
            yield self.pair.x == 2 * self.pair.v

    result = pt.compile(Small()).simulate(1.0, guesses={"pair.v": 1e8, "pair.x": 1e8})
    assert result["pair.v"][0] == pytest.approx(1e-6, rel=1e-12)
    assert result["pair.x"][0] == pytest.approx(2e-6, rel=1e-12)


def test_nothing_fires_at_a_start_that_is_not_that_of_the_run() -> None:
    """In the second gear x is 20; in the first, where the gear begins, it would be 10."""

    class Geared(pt.Component):
        pair: Constant = Constant()
        gear: pt.Discrete = pt.discrete("1", "Gear", start=1.0)
        seen: pt.Discrete = pt.discrete("1", "Whether x was low", start=0.0)

        def equations(self) -> pt.Equations:
            yield pt.when(self.pair.x < 15, pt.reinit(self.seen, 1.0), initially=True)

        def initial(self) -> pt.Equations:
            yield self.pair.v == 10
            yield self.gear == ca.if_else(self.pair.v > 5, 2.0, 1.0)
            yield self.pair.x == self.gear * self.pair.v

    result = pt.simulate(Geared(), 1.0)
    assert (result["pair.x"][0], result["seen"][0]) == (20.0, 0.0)
