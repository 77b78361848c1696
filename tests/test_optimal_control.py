"""Plans against solutions by hand, through changes of modes, replayed in the whole model; and bad input."""

from __future__ import annotations

import math
from pathlib import Path
from runpy import run_path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from small_models import Ball

import powertrain as pt
from powertrain.components.differentials import CrownGear
from powertrain.components.rotational import Clutch, ElastoBacklash, IdealGear, Inertia, SpringDamper, Torque
from powertrain.optimal.rounding import rounded

EXAMPLES = Path(__file__).parents[1] / "examples"


class Slide(pt.Component):
    """An inertia and a torque."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    inertia: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.inertia.flange_a)


REST = {"inertia.phi": 0.0, "inertia.w": 0.0}


@pytest.fixture(scope="module")
def slide() -> pt.Plant[Slide]:
    return pt.compile(Slide())


def test_least_effort(slide: pt.Plant[Slide]) -> None:
    """From rest to rest over 1 rad in T: u = 6 J (1 - 2 t/T)/T^2, cost 12 J^2/T^3."""
    guess = slide.simulate(1.5, starts=REST, inputs={"torque": 0.1})
    plan = pt.optimal_control(
        slide,
        pt.integral(lambda m: m.torque.value**2),
        guess,
        {"torque": (-50, 50)},
        ends={"inertia.phi": 1.0, "inertia.w": 0.0},
    )
    assert plan.ok
    assert plan.cost == pytest.approx(12 * 4 / 1.5**3, rel=1e-7)
    assert plan.replayed == pytest.approx(plan.cost, rel=1e-6)
    t, u = plan.inputs["torque"]
    np.testing.assert_allclose(u, 6 * 2.0 * (1 - 2 * t / 1.5) / 1.5**2, atol=1e-5)
    assert plan.same_modes
    assert "the planned modes" in str(plan)


def test_least_time(slide: pt.Plant[Slide]) -> None:
    """Full torque, then full brake: T = 2 sqrt(J/u); an odd number of intervals cannot change sign at once."""
    guess = slide.simulate(2.0, starts=REST, inputs={"torque": 0.1})
    plan = pt.optimal_control(
        slide, pt.final(lambda m: pt.time), guess, {"torque": (-8.0, 8.0)}, stop=(0.1, 10.0),
        ends={"inertia.phi": 1.0, "inertia.w": 0.0}, intervals=40,
    )  # fmt: skip
    best = 2 * math.sqrt(2.0 / 8.0)
    assert plan.ok
    assert best < plan.cost < 1.01 * best
    assert plan.result["inertia.phi"][-1] == pytest.approx(1.0, abs=1e-5)


def test_a_plan_may_last_much_longer_than_its_guess(slide: pt.Plant[Slide]) -> None:
    """12 J^2/T^3 falls with T up to the latest end; twenty times the guess used to be the longest, without a word."""
    guess = slide.simulate(1.0, starts=REST, inputs={"torque": 0.1})
    plan = pt.optimal_control(
        slide, pt.integral(lambda m: m.torque.value**2), guess, {"torque": (-50.0, 50.0)}, stop=(0.5, 60.0),
        ends={"inertia.phi": 1.0, "inertia.w": 0.0},
    )  # fmt: skip
    assert plan.durations == pytest.approx([60.0], rel=1e-2)
    assert plan.cost == pytest.approx(12 * 4 / 60.0**3, rel=3e-2)
    assert not plan.notes


def test_a_phase_that_would_become_shorter_still_is_told(slide: pt.Plant[Slide]) -> None:
    """A second is enough, but the guess lasts 50 s."""
    guess = slide.simulate(50.0, starts=REST, inputs={"torque": 0.001})
    plan = pt.optimal_control(
        slide, pt.final(lambda m: pt.time), guess, {"torque": (-8.0, 8.0)}, stop=(0.1, 60.0),
        ends={"inertia.phi": 1.0, "inertia.w": 0.0},
    )  # fmt: skip
    assert "phase 0 is as short as it may become, 2.5 s (in the guess: 50 s)" in str(plan)
    with pytest.raises(pt.ParameterError, match="the latest end, 0 s, is not after the start of the guess, 0 s"):
        pt.optimal_control(slide, "inertia.w", guess, {"torque": (-8.0, 8.0)}, stop=(-1.0, 0.0))


class Drive(pt.Component):
    """A motor with inertia, a gear and a load."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    motor: Inertia = Inertia(J=0.02)
    gear: IdealGear = IdealGear(ratio=3.0)
    load: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.motor.flange_a)
        yield pt.connect(self.motor.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.load.flange_a)


def test_a_parameter_is_found() -> None:
    """The ratio of greatest acceleration is sqrt(J_load/J_motor)."""
    plant = pt.compile(Drive())
    guess = plant.simulate(1.0, starts={"load.w": 0.0}, inputs={"torque": 2.0})
    plan = pt.optimal_control(plant, -pt.final("load.w"), guess, parameters={"gear.ratio": (1.0, 50.0)})
    assert plan.parameters == {"gear.ratio": pytest.approx(10.0, rel=1e-4)}
    assert plan.replayed == pytest.approx(plan.cost, rel=1e-6)
    assert plan.replayed == pytest.approx(-2.0 * 10 / (2 + 0.02 * 100), rel=1e-6)


class Launch(pt.Component):
    """Engine, clutch, soft shaft, car."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    press: pt.Input = pt.signal_input("1", "Command of the clutch")
    source: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=200.0, mue_pos=((0.0, 1.0),))
    disc: Inertia = Inertia(J=0.02)
    shaft: SpringDamper = SpringDamper(c=800.0, d=8.0)
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.source.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.load.flange_a)


def heat(m: Any) -> Any:
    return m.clutch.tau * m.clutch.w_rel


@pytest.fixture(scope="module")
def launch() -> pt.Plant[Launch]:
    return pt.compile(Launch())


@pytest.fixture(scope="module")
def by_hand(launch: pt.Plant[Launch]) -> pt.Result[Launch]:
    starts = {"engine.w": 100.0, "disc.w": 0.0, "load.w": 0.0, "load.phi": 0.0, "shaft.phi_rel": 0.0}
    found = launch.simulate(2.0, starts=starts, inputs={"torque": 20.0, "press": ([0, 1], [0.1, 0.6])})
    assert [e.new for e in found.events] == [0.0]
    return found


def test_a_clutch_engages(launch: pt.Plant[Launch], by_hand: pt.Result[Launch]) -> None:
    plan = pt.optimal_control(
        launch, pt.integral(heat), by_hand, {"press": (0.02, 1.0), "torque": (0.0, 60.0)},
        ends={"load.w": 80.0, "shaft.w_rel": 0.0}, limits={"shaft.tau": (-80.0, 10.0)}, smooth=0.1,
    )  # fmt: skip
    assert plan.ok
    assert plan.same_modes
    assert plan.replayed == pytest.approx(plan.cost, rel=5e-3)
    guessed = pt.gradient(by_hand, pt.integral(heat), "engine.J").value
    assert plan.replayed < 0.8 * guessed
    assert plan.result["load.w"][-1] == pytest.approx(80.0, rel=1e-4)
    assert plan.result["shaft.tau"].min() > -80.0 * 1.02
    assert len(plan.durations) == 2
    (sticks,) = [e.time for e in plan.result.events if e.new == 0.0]
    assert sticks == pytest.approx(plan.durations[0], abs=1e-3)


class TipIn(pt.Component):
    """Two inertias with play between them."""

    torque: pt.Input = pt.signal_input("N.m", "Torque of the engine")
    source: Torque = Torque()
    engine: Inertia = Inertia(J=0.2)
    play: ElastoBacklash = ElastoBacklash(c=800.0, d=8.0, b=0.05)
    car: Inertia = Inertia(J=3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.play.flange_a)
        yield pt.connect(self.play.flange_b, self.car.flange_a)


def test_through_play() -> None:
    """From pull to push through the gap, with kinks at both flanks: the least effort for a given gain of speed is a constant torque."""
    plant = pt.compile(TipIn())
    starts = {"engine.w": 50.0, "car.w": 50.0, "play.phi_rel": 0.04}
    guess = plant.simulate(1.0, starts=starts, inputs={"torque": ([0, 0.2, 0.4, 1], [-10, -10, 40, 40])})
    plan = pt.optimal_control(
        plant, pt.integral(lambda m: m.torque.value**2), guess, {"torque": (-60.0, 100.0)},
        ends={"car.w": float(guess["car.w"][-1]), "play.w_rel": 0.0}, limits={"play.tau": (-200.0, 200.0)}, smooth=1e-3,
    )  # fmt: skip
    assert plan.ok
    assert plan.same_modes
    assert plan.cost == pytest.approx(25.0**2, rel=1e-4)
    assert plan.replayed == pytest.approx(plan.cost, rel=1e-4)
    assert plan.result["car.w"][-1] == pytest.approx(guess["car.w"][-1], rel=1e-5)


def test_corners_are_rounded() -> None:
    """Each by its formula, with a width in parts of the largest side; a comparison of parameters stays sharp."""
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    y = [ca.fabs(x), ca.fmax(x, 1.0), ca.fmin(x, p), ca.if_else(x > 0.0, x, 2.0 * x), ca.if_else(p > 0.0, x, 2.0 * x)]
    course = np.linspace(-4.0, 4.0, 9)[None]
    made, corners = rounded(ca.Function("f", [x, p], [ca.vertcat(*y)], ["x", "p"], ["y"]), [course, 0 * course], ["x"])
    assert corners == 4
    for at, width in ((0.3, 0.1), (-2.0, 0.01)):
        h = 4.0 * width
        step = (1 + at / math.hypot(at, h)) / 2
        top, least = (at + 1 + math.hypot(at - 1, 1.25 * h)) / 2, (at - math.hypot(at, h)) / 2
        exact = [math.hypot(at, h), top, least, step * at + (1 - step) * 2 * at, 2.0 * at]
        np.testing.assert_allclose(np.array(made(at, [0.0, width])).ravel(), exact, rtol=1e-12)
    far = rounded(ca.Function("f", [x, p], [ca.vertcat(*y)], ["x", "p"], ["y"]), [course + 9.0, 0 * course], ["x"])[1]
    root = rounded(
        ca.Function("f", [x, p], [ca.if_else(x > 0.0, ca.sqrt(x), 0.0)], ["x", "p"], ["y"]), [course, 0 * course], ["x"]
    )
    assert far == root[1] == 0  # never reached; without a value beyond the corner
    assert root[0](-1.0, [0.0, 0.1]) == 0.0


class Braked(pt.Component):
    """A motor that drives and brakes a load through a gear with losses."""

    torque: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    motor: Inertia = Inertia(J=0.02)
    gear: CrownGear = CrownGear(ratio=3.0, eta_ab=0.8, eta_ba=0.7)
    load: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque, self.source.tau)
        yield pt.connect(self.source.flange, self.motor.flange_a)
        yield pt.connect(self.motor.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.load.flange_a)


def test_each_side_drives_with_its_own_loss() -> None:
    """Where the torque of a gear changes sign, its loss does in the plan, too, as in the simulation."""
    plant = pt.compile(Braked())
    guess = plant.simulate(1.0, starts={"load.w": 10.0}, inputs={"torque": ([0.0, 1.0], [5.0, -8.0])})
    ends = {"load.w": 10.0, "load.phi": float(guess["load.phi"][0]) + 12.0}
    plan = pt.optimal_control(plant, pt.integral(lambda m: m.torque.value**2), guess, {"torque": (-60, 60)}, ends=ends)
    assert plan.ok
    assert plan.inputs["torque"][1].min() < -1.0 < 1.0 < plan.inputs["torque"][1].max()
    assert plan.result["load.w"][-1] == pytest.approx(10.0, rel=1e-3)
    assert plan.result["load.phi"][-1] == pytest.approx(ends["load.phi"], rel=1e-3)


def test_derivatives_of_smooth_maps_are_left_as_they_are() -> None:
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    parabola = pt.Map.curve([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 4.0, 9.0, 16.0], method="smooth")
    y = ca.fabs(x - 2.0) + ca.jacobian(parabola(x), x)
    course = np.linspace(0.5, 3.5, 7)[None]
    made, corners = rounded(ca.Function("f", [x, p], [y], ["x", "p"], ["y"]), [course, 0 * course], ["x"])
    assert corners == 1
    assert float(made(3.0, [0.0, 1e-6])) == pytest.approx(1.0 + 6.0, rel=1e-6)


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)])
def test_combined_conditions_are_rounded_as_truth_values(x: float, y: float) -> None:
    """Of a, b in [0, 1]: a b for both, a + b - a b for either, 1 - a for not."""
    u, p = ca.SX.sym("u", 2), ca.SX.sym("p")
    one, other = u[0] > 0.0, u[1] > 0.0
    conditions = [ca.logic_and(one, other), ca.logic_or(one, other), ca.logic_not(one)]
    f = ca.Function("f", [u, p], [ca.vertcat(*(ca.if_else(c, 1.0, 0.0) for c in conditions))], ["u", "p"], ["y"])
    course = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, -1.0]])
    found = np.array(rounded(f, [course, np.zeros((1, 3))], ["u"])[0]([x, y], [0.0, 0.3])).ravel()
    a, b = ((1 + v / math.hypot(v, 0.3)) / 2 for v in (x, y))
    np.testing.assert_allclose(found, [a * b, a + b - a * b, 1 - a], rtol=1e-12)


@pytest.mark.parametrize(("nearest", "corners"), [(0.005, 1), (0.02, 0)])
def test_a_corner_that_the_course_all_but_reaches_is_rounded(nearest: float, corners: int) -> None:
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    course = np.linspace(nearest, 1.0, 5)[None]
    assert rounded(ca.Function("f", [x, p], [ca.fabs(x)], ["x", "p"], ["y"]), [course, 0 * course], ["x"])[1] == corners


def test_a_corner_of_round_off_stays_sharp() -> None:
    """A limit that holds throughout, but for round-off, has no size that a width could be a part of."""
    x, p = ca.SX.sym("x"), ca.SX.sym("p")
    course = 1.0 + 1e-14 * np.linspace(-1.0, 1.0, 5)[None]
    function = ca.Function("f", [x, p], [ca.fmin(x, 1.0)], ["x", "p"], ["y"])
    assert rounded(function, [course, 0 * course], ["x"])[1] == 0


def test_a_free_law_begins_no_phase_of_its_own(launch: pt.Plant[Launch]) -> None:
    """An open clutch has the equations of one that slides without pressure: nothing determines the instant between them."""
    starts = {"engine.w": 100.0, "disc.w": 0.0, "load.w": 0.0, "load.phi": 0.0, "shaft.phi_rel": 0.0}
    inputs: dict[str, Any] = {"torque": 20.0, "press": ([0.0, 0.3, 1.3], [0.0, 0.0, 0.6])}
    guess = launch.simulate(2.0, starts=starts, inputs=inputs)
    assert [e.new for e in guess.events] == [-1.0, 0.0]
    plan = pt.optimal_control(
        launch, pt.integral(heat), guess, {"press": (0.0, 1.0), "torque": (0.0, 60.0)}, ends={"load.w": 60.0},
        smooth=0.1,
    )  # fmt: skip
    assert plan.ok
    assert len(plan.durations) == 2


@pytest.mark.slow
def test_when_to_charge_a_flywheel() -> None:
    """The example converges from a run with the rules, and the plan does in the simulation what it promises."""
    plan, rules = run_path(str(EXAMPLES / "17_when_to_charge.py"))["main"]()
    assert plan.message == "Solve_Succeeded"
    assert plan.same_modes
    assert plan.replayed == pytest.approx(plan.cost, rel=5e-3)
    assert plan.replayed < 0.97 * rules
    assert plan.result["flywheel.w"].min() > 840.0 * (1 - 1e-3)


def test_intervals_of_each_phase(launch: pt.Plant[Launch], by_hand: pt.Result[Launch]) -> None:
    cost = pt.final(lambda m: (m.load.w - 60.0) ** 2)
    plan = pt.optimal_control(launch, cost, by_hand, parameters={"engine.J": (0.05, 2.0)}, intervals=[8, 4])
    assert plan.ok
    assert len(plan.times) == 9 + 5
    with pytest.raises(pt.ParameterError, match="intervals: 3 numbers for 2 phases"):
        pt.optimal_control(launch, cost, by_hand, parameters={"engine.J": (0.05, 2.0)}, intervals=[8, 4, 4])


def test_the_cost_cannot_be_bettered_by_its_gradient(launch: pt.Plant[Launch], by_hand: pt.Result[Launch]) -> None:
    """At an optimum without active limits the derivative of the replayed cost with respect to a free parameter is zero."""
    cost = pt.final(lambda m: (m.load.w - 60.0) ** 2)
    plan = pt.optimal_control(launch, cost, by_hand, parameters={"engine.J": (0.05, 2.0)})
    slope = pt.gradient(plan.result, cost, "engine.J")
    before = pt.gradient(by_hand, cost, "engine.J")
    assert abs(slope["engine.J"]) < 1e-3 * abs(before["engine.J"])


def test_what_cannot_be_reached_says_so(slide: pt.Plant[Slide]) -> None:
    guess = slide.simulate(1.0, starts=REST, inputs={"torque": 0.1})
    plan = pt.optimal_control(slide, pt.final("inertia.w"), guess, {"torque": (0, 1)}, ends={"inertia.phi": [5.0, 6.0]})
    assert not plan.ok
    assert "NOT CONVERGED: Infeasible" in str(plan)


def test_bad_input(slide: pt.Plant[Slide]) -> None:
    guess = slide.simulate(1.0, starts=REST, inputs={"torque": 0.1})
    cost = pt.final("inertia.w")
    with pytest.raises(pt.ParameterError, match="the model has no torqe; did you mean torque"):
        pt.optimal_control(slide, cost, guess, {"torqe": (0, 1)})
    with pytest.raises(pt.ParameterError, match="is empty"):
        pt.optimal_control(slide, cost, guess, {"torque": (1, 1)})
    with pytest.raises(pt.ParameterError, match="nothing to optimise"):
        pt.optimal_control(slide, cost, guess)
    with pytest.raises(pt.ParameterError, match=r"pt\.integral and pt\.final"):
        pt.optimal_control(slide, pt.maximum("inertia.w"), guess, {"torque": (0, 1)})
    with pytest.raises(pt.ParameterError, match="inputs: torque: the range -inf to inf must be finite"):
        pt.optimal_control(slide, cost, guess, {"torque": (-math.inf, math.inf)})
    uneven: Any = {"inertia.phi": [1, [2]]}
    with pytest.raises(pt.ParameterError, match=r"ends: inertia\.phi = \[1, \[2\]\]: give \(low, high\)"):
        pt.optimal_control(slide, cost, guess, {"torque": (0, 1)}, ends=uneven)
    with pytest.raises(pt.ParameterError, match=r"guess: the result belongs to another model \(Ball\)"):
        pt.optimal_control(slide, cost, pt.simulate(Ball(), 0.1), {"torque": (0, 1)})
    ball = pt.compile(Ball())
    with pytest.raises(pt.SimulationError, match="impacts or resets"):
        pt.optimal_control(ball, pt.final("h"), ball.simulate(1.0), parameters={"g": (1.0, 20.0)})
