"""Second derivatives of runs against closed forms and against central differences of gradients; and what is refused."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from drivelines import random_plant
from small_models import STARTS, Ball, CoupledClutches, Engaging, Relay

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import Clutch, Damper, Fixed, Inertia
from powertrain.vehicles.manual_car import ManualCar


class Decay(pt.Component):
    """w0 exp(-d t/J)."""

    inertia: Inertia = Inertia(J=2.0)
    damper: Damper = Damper(d=0.5)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


def test_decay() -> None:
    J, d, w0 = ca.SX.sym("J"), ca.SX.sym("d"), ca.SX.sym("w0")
    exact = ca.Function("exact", [J, d, w0], [ca.hessian(w0 * ca.exp(-d * 3.0 / J), ca.vertcat(J, d, w0))[0]])
    found = pt.hessian(
        Decay(), "inertia.w", ["inertia.J", "damper.d", "inertia.w"], stop=3.0, starts={"inertia.w": 10.0}
    )
    np.testing.assert_allclose(found, np.array(exact(2.0, 0.5, 10.0)), rtol=1e-11, atol=1e-12)
    assert found["units"].sel(wrt="inertia.J", wrt_2="inertia.w").item() == "rad/s/(kg.m2)/(rad/s)"


class Cubic(pt.Component):
    """x'' + w^2 (x + x^2) = 0, at rest."""

    w: pt.Parameter = pt.parameter("rad/s", "Angular frequency of small vibrations", default=7.0)
    x: pt.Variable = pt.variable("1", "Position", start=0.0)
    v: pt.Variable = pt.variable("1/s", "Speed", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == -(self.w**2) * (self.x + self.x**2)


def test_a_run_at_rest_has_the_curvature_of_its_vibrations() -> None:
    """x = x_0 cos(w t) + x_0^2 (cos(2 w t)/6 + cos(w t)/3 - 1/2) + ...; steps of the run are longer than the period."""
    found = pt.hessian(Cubic(), "x", ["x"], stop=5.0)
    assert float(found.squeeze()) == pytest.approx(2 * (np.cos(70.0) / 6 + np.cos(35.0) / 3 - 1 / 2), rel=1e-6)


def test_extrema_at_the_start_and_at_the_end() -> None:
    """A decay has its largest value w0 at the start and its least one at the end; none of the two instants moves."""
    names, options = ["inertia.J", "inertia.w"], {"stop": 3.0, "starts": {"inertia.w": 10.0}}
    largest, least, last = (
        pt.hessian(Decay(), of, names, **options)
        for of in (pt.maximum("inertia.w"), pt.minimum("inertia.w"), "inertia.w")
    )
    np.testing.assert_allclose(largest, 0.0, atol=1e-12)
    np.testing.assert_allclose(least, last, rtol=1e-12)


def test_a_ball_through_two_bounces() -> None:
    """Falls from h, bounces with e v, 2 e v/g later with e^2 v."""
    e, g, h = ca.SX.sym("e"), ca.SX.sym("g"), ca.SX.sym("h")
    v = ca.sqrt(2 * g * h)
    left = 1.5 - v / g - 2 * e * v / g
    exact = ca.Function("exact", [e, g, h], [ca.hessian(e**2 * v * left - g * left**2 / 2, ca.vertcat(e, g, h))[0]])
    found = pt.hessian(Ball(), "h", ["e", "g", "h"], stop=1.5)
    wanted = np.array(exact(0.8, 10.0, 1.0))
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


class Joining(pt.Component):
    """Two inertias that a clutch joins."""

    command: Constant = Constant(k=1.0)
    engine: Inertia = Inertia(J=0.2)
    clutch: Clutch = Clutch(fn_max=100.0, mue_pos=((0.0, 0.5),))
    load: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.command.y, self.clutch.f_normalized)
        yield pt.connect(self.engine.flange_b, self.clutch.flange_a)
        yield pt.connect(self.clutch.flange_b, self.load.flange_a)


def test_a_clutch_that_sticks() -> None:
    """The heat until it sticks is J1 J2/(J1 + J2) w0^2/2, whatever the clutch."""
    one, two, w = (ca.SX.sym(n) for n in ("one", "two", "w"))
    exact = ca.Function(
        "exact", [one, two, w], [ca.hessian(one * two / (one + two) * w**2 / 2, ca.vertcat(one, two, w))[0]]
    )
    found = pt.hessian(
        Joining(), pt.integral(lambda m: -m.clutch.tau * m.clutch.w_rel), ["engine.J", "load.J", "engine.w", "clutch.fn_max"],
        stop=1.5, starts={"engine.w": 100.0, "load.w": 0.0},
    )  # fmt: skip
    order = ["engine.J", "load.J", "engine.w", "clutch.fn_max"]
    found, wanted = found.sel(wrt=order, wrt_2=order), np.zeros((4, 4))
    wanted[:3, :3] = np.array(exact(0.2, 1.0, 100.0))
    size = np.array([0.2, 1.0, 100.0, 100.0])
    np.testing.assert_allclose(np.abs(found) * np.outer(size, size), np.abs(wanted) * np.outer(size, size), atol=1e-9)


TIGHT: dict[str, Any] = {"rtol": 1e-11}


def differences(plant: pt.Plant[Any], of: Any, names: list[str], share: float, **options: Any) -> np.ndarray | None:
    """Central differences of gradients, extrapolated once; None where a run has other events."""
    run = plant.simulate(**options)
    here, events = pt.gradient(run, of, names), [(e.name, e.new) for e in run.events]
    found = np.empty((len(names), len(names)))
    for j, name in enumerate(here):
        h, slopes = share * (abs(here.at[name]) or 1.0), []
        kind = "parameters" if name in plant.parameters else "starts"
        for k in (1.0, -1.0, 0.5, -0.5):
            other = plant.simulate(**{**options, kind: {**options.get(kind, {}), name: here.at[name] + k * h}})
            if [(e.name, e.new) for e in other.events] != events:
                return None
            slopes.append(pt.gradient(other, of, names).array)
        found[:, j] = (4 * (slopes[2] - slopes[3]) / h - (slopes[0] - slopes[1]) / (2 * h)) / 3
    return found


def assert_as_differences(
    model: Any, of: Any, names: list[str], tolerance: float, share: float = 1e-3, **options: Any
) -> None:
    plant = model if isinstance(model, pt.Plant) else pt.compile(model)
    options = {**TIGHT, **options}
    found, wanted = pt.hessian(plant, of, names, **options), differences(plant, of, names, share, **options)
    assert wanted is not None
    size = np.array([abs(plant.parameters.get(str(n), 1.0)) or 1.0 for n in found["wrt"].values])
    scale = np.outer(size, size)
    np.testing.assert_allclose(found * scale, wanted * scale, rtol=0.0, atol=tolerance * np.abs(wanted * scale).max())


@pytest.mark.slow
@pytest.mark.parametrize("of", ["J1.w", pt.integral(lambda m: m.clutch1.tau * m.clutch1.w_rel)], ids=["end", "heat"])
def test_coupled_clutches(of: Any) -> None:
    names = ["J1.J", "J3.J", "clutch1.fn_max", "clutch2.fn_max", "sin2.f", "step2.startTime"]
    assert_as_differences(CoupledClutches(), of, names, 1e-6, share=1e-4, stop=1.5)


class Shaft(pt.Component):
    """A wheel slowed through a mesh whose efficiency depends on its load, which makes the torque an algebraic unknown."""

    J: pt.Parameter = pt.parameter("kg.m2", "Inertia", default=0.7)
    k: pt.Parameter = pt.parameter("1", "Share lost at no load", default=0.3)
    d: pt.Parameter = pt.parameter("1", "Size of the load", default=1.3)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=3.0)
    tau: pt.Variable = pt.variable("N.m", "Torque", start=0.3)

    def equations(self) -> pt.Equations:
        yield self.J * pt.der(self.w) == -self.tau
        yield self.tau * (1 - self.k * ca.exp(-(self.tau**2))) == self.d * self.w**2 / (1 + self.w)


@pytest.mark.parametrize(
    "of",
    ["w", pt.integral("tau"), pt.at("tau", 0.5), pt.squares("tau", [0.2, 0.5, 1.0], [1.0, 1.0, 1.0], 0.3)],
    ids=str,
)
def test_algebraic_unknowns(of: Any) -> None:
    assert_as_differences(Shaft(), of, ["J", "k", "d", "w"], 1e-9, stop=1.2)


class Timed(pt.Component):
    """A switch and a nonlinear reset at instants that are parameters' doing."""

    T: pt.Parameter = pt.parameter("s", "Time", default=0.4)
    k: pt.Parameter = pt.parameter("1", "Rate", default=0.6)
    x: pt.Variable = pt.variable("1", "Level", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.k * self.x + pt.switch(pt.time > self.T**2, self.k * ca.sin(pt.time), 0.2)
        yield pt.when(pt.time > 2 * self.T * self.k + 0.3, pt.reinit(self.x, self.x**2 * (1 + pt.time)))


def test_instants_that_depend_on_parameters() -> None:
    assert_as_differences(Timed(), "x", ["T", "k", "x"], 1e-9, stop=1.2)


def test_resets_at_state_events() -> None:
    assert_as_differences(Relay(), "level", ["inflow", "leak", "high", "low", "spill", "since"], 1e-9, stop=3.0)


def test_an_extremum_at_an_impact() -> None:
    assert_as_differences(Ball(), pt.minimum("v"), ["e", "g", "h"], 1e-9, stop=1.5)


class Swing(pt.Component):
    """x = v sin(w t)/w; the largest x v is v^2/(2 w), in a quarter of the time at which x itself is largest."""

    w0: pt.Parameter = pt.parameter("rad/s", "Frequency", default=3.0)
    x: pt.Variable = pt.variable("1", "Deflection", start=0.0)
    v: pt.Variable = pt.variable("1", "Rate", start=2.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == -(self.w0**2) * self.x


def test_an_extremum_between_events() -> None:
    """Its instant moves with the frequency."""
    found = pt.hessian(Swing(), pt.maximum(lambda m: m.x * m.v), ["w0", "v"], stop=0.4)
    np.testing.assert_allclose(found, [[4.0 / 27.0, -2.0 / 9.0], [-2.0 / 9.0, 1.0 / 3.0]], rtol=1e-5)


class Bent(pt.Component):
    """x grows at a c until it reaches c, at a x from then on: x = c exp(a t - 1 + x0/c)."""

    a: pt.Parameter = pt.parameter("1", "Rate", default=0.7)
    c: pt.Parameter = pt.parameter("1", "Corner", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.5)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a * ca.fmax(self.x, self.c)


@pytest.mark.parametrize("rtol", [1e-10, 1.8e-10, 3.2e-10, 1e-9, 1e-8])
def test_a_corner(rtol: float) -> None:
    """Wherever in a step it lies."""
    a, c, x = (ca.SX.sym(n) for n in "acx")
    exact = ca.Function("exact", [a, c, x], [ca.hessian(c * ca.exp(2 * a - 1 + x / c), ca.vertcat(a, c, x))[0]])
    np.testing.assert_allclose(
        pt.hessian(Bent(), "x", ["a", "c", "x"], stop=2.0, rtol=rtol), np.array(exact(0.7, 1.0, 0.5)), rtol=100 * rtol
    )


class Twice(pt.Component):
    """x falls at k; z grows at p until x = c, at q until x = c - d, and at r from then on."""

    k: pt.Parameter = pt.parameter("1", "Rate", default=0.8)
    c: pt.Parameter = pt.parameter("1", "Threshold", default=0.3)
    d: pt.Parameter = pt.parameter("1", "Distance of the thresholds", default=1e-9)
    p: pt.Parameter = pt.parameter("1", "First rate", default=0.5)
    q: pt.Parameter = pt.parameter("1", "Rate between", default=-3.0)
    r: pt.Parameter = pt.parameter("1", "Last rate", default=1.5)
    x: pt.Variable = pt.variable("1", "Trigger", start=1.0)
    z: pt.Variable = pt.variable("1", "Level", start=2.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.k
        last = pt.switch(self.x > self.c - self.d, self.q, self.r)
        yield pt.der(self.z) == self.z * pt.switch(self.x > self.c, self.p, last)


@pytest.mark.parametrize("apart", [1e-3, 1e-9, 1e-11])
def test_events_that_follow_at_once(apart: float) -> None:
    """10 ps apart, the run has no room for samples between them."""
    names = ["k", "c", "p", "q", "r", "x"]
    k, c, p, q, r, x = symbols = [ca.SX.sym(n) for n in names]
    end = 2.0 * ca.exp(p * (x - c) / k + q * apart / k + r * (2.0 - (x - c + apart) / k))
    exact = ca.Function("exact", symbols, [ca.hessian(end, ca.vertcat(*symbols))[0]])
    found = pt.hessian(Twice(d=apart), "z", names, stop=2.0)
    wanted = np.array(exact(0.8, 0.3, 0.5, -3.0, 1.5, 1.0))
    np.testing.assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())


def test_events_that_move_apart_are_refused() -> None:
    """Two switches in one instant, of which an unknown moves only one."""
    with pytest.raises(pt.SimulationError, match="switch together, and an unknown moves their instants apart"):
        pt.hessian(Twice(d=1e-12), "z", ["d"], stop=2.0)


class Fading(pt.Component):
    """x = x0 exp(-k t) meets c exp(-a t) at t = ln(x0/c)/(k - a), where z, growing at p until then, begins to grow at q."""

    k: pt.Parameter = pt.parameter("1", "Decay", default=1.5)
    a: pt.Parameter = pt.parameter("1", "Decay of the threshold", default=0.4)
    c: pt.Parameter = pt.parameter("1", "Threshold", default=0.3)
    p: pt.Parameter = pt.parameter("1", "Rate before", default=0.5)
    q: pt.Parameter = pt.parameter("1", "Rate after", default=-2.0)
    x: pt.Variable = pt.variable("1", "Trigger", start=1.0)
    z: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.k * self.x
        yield pt.der(self.z) == pt.switch(self.x > self.c * ca.exp(-self.a * pt.time), self.p, self.q)


def test_a_condition_that_is_nonlinear_in_time() -> None:
    names = ["k", "a", "c", "p", "q", "x"]
    k, a, c, p, q, x = symbols = [ca.SX.sym(n) for n in names]
    instant = ca.log(x / c) / (k - a)
    end = ca.hessian(p * instant + q * (2.0 - instant), ca.vertcat(*symbols))[0]
    wanted = np.array(ca.Function("exact", symbols, [end])(1.5, 0.4, 0.3, 0.5, -2.0, 1.0))
    found = pt.hessian(Fading(), "z", names, stop=2.0, **TIGHT)
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


class Gripped(pt.Component):
    """A friction of the speed v - y^2 that grips at 0.5 s: then v becomes y^2."""

    v: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    y: pt.Variable = pt.variable("1", "Level", start=0.0)
    f: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == -self.f
        yield pt.der(self.y) == 0.0
        limit = pt.switch(pt.time > 0.5, 1.0, 0.0)
        yield pt.friction(self.v - self.y**2, self.f, -limit, limit)


def test_a_law_that_sticks_at_a_speed_of_second_order() -> None:
    """At y = 0 it holds at once. Beside it, it slides for a time that goes with y^2."""
    np.testing.assert_allclose(pt.hessian(Gripped(), "v", ["y"], stop=1.0), [[2.0]], rtol=1e-9)
    beside = pt.simulate(Gripped(), 1.0, starts={"y": 0.1, "v": 0.0})
    assert beside["v"][-1] == pytest.approx(0.01)


TABLE = pt.Map(
    [pt.Axis("x", "1", [0, 5], outside="linear"), pt.Axis("y", "1", [0, 6], outside="linear")], [[1, 2], [3, 9]], "1"
)


class Tabled(pt.Component):
    """Rates from a linear map with two axes, of which only mixed second derivatives are not zero."""

    a: pt.Parameter = pt.parameter("1", "Rate", default=0.7)
    x: pt.Variable = pt.variable("1", "One level", start=0.1)
    y: pt.Variable = pt.variable("1", "Another", start=0.1)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a * TABLE(self.x, self.y)
        yield pt.der(self.y) == TABLE(self.y, self.x)


def test_a_map_by_differences_of_gradients() -> None:
    """CasADi has no second derivatives of maps."""
    assert_as_differences(Tabled(), "x", ["a", "x", "y"], 1e-7, stop=1.0)
    assert pt.hessian(Tabled(), "x", ["a", "x"], stop=1.0).attrs["asymmetry"] < 1e-7


AXES = [pt.Axis("x", "1", [0, 1, 2, 3], outside="linear"), pt.Axis("y", "1", [0, 1], outside="linear")]
KINKED = pt.Map(AXES, [[0.5, 0.5], [2.0, 2.0], [1.0, 1.0], [3.0, 3.0]], "1")


class Kinked(pt.Component):
    """A level that rises past the kinks of a map, at 1 and at 2."""

    a: pt.Parameter = pt.parameter("1", "Rate", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.1)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a * KINKED(self.x, 0.5)


def test_differences_say_how_well_they_agree() -> None:
    """x = (x0 + 1/3) exp(1.5 a t) - 1/3 up to 1; beyond 2, x = 2 + (exp(2 a t - 2 K) - 1)/2 with K = ln(2/0.65)/1.5 + ln 2."""
    smooth = pt.hessian(Kinked(), "x", ["a"], stop=0.3)
    assert float(smooth[0, 0]) == pytest.approx((0.1 + 1 / 3) * 0.45**2 * np.exp(0.45), rel=1e-6)
    assert smooth.attrs["spread"] < 1e-3
    passing = pt.hessian(Kinked(), "x", ["a"], stop=2.0)
    exact = 8.0 * np.exp(4.0 - 2.0 * (np.log(2.0 / 0.65) / 1.5 + np.log(2.0)))
    assert abs(float(passing[0, 0]) / exact - 1.0) < passing.attrs["spread"]
    assert passing.attrs["spread"] > 1e-3


def test_a_clutch_whose_friction_falls_with_speed() -> None:
    """Corners of the friction curve, a slip speed that is an algebraic unknown, and |w| at the event itself."""
    clutch = Clutch(fn_max=200.0, mue_pos=((0.0, 1.0), (20.0, 0.8), (60.0, 0.7), (120.0, 0.65)))
    inputs = {"torque": ([0, 0.2], [20.0, 40.0]), "press": ([0, 0.15], [0.1, 0.9])}
    names = ["engine.J", "shaft.d"]
    options: dict[str, Any] = {"stop": 0.3, "starts": STARTS, "inputs": inputs}
    assert_as_differences(Engaging(clutch=clutch), "load.w", names, 1e-3, share=5e-3, **options)
    some, more = (
        pt.hessian(Engaging(clutch=clutch), "load.w", names, max_step=h, **options, **TIGHT) for h in (1e-3, np.inf)
    )
    np.testing.assert_allclose(some, more, rtol=1e-6)  # also where the step before the event is tiny


@pytest.mark.slow
def test_a_car_through_a_shift() -> None:
    """A clutch that opens and closes, synchronisers, limits that open with their event, corners of signals of time."""
    names = ["body.m", "body.Cd"]
    assert_as_differences(ManualCar(), "engine.fuel", names, 1e-5, stop=20.0, rtol=1e-10, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [[5, 6, 9], [23, 24, 25, 29, 40, 41, 67, 70, 80, 85]], ids=["three", "ten"])
def test_random_drivelines(seeds: list[int]) -> None:
    compared = 0
    for seed in seeds:
        plant, rng = random_plant(seed)
        signal = rng.choice([s for s in plant.compiled.states if not s.endswith("phi")])
        known = [n for n, v in plant.parameters.items() if v and not n.endswith("peak") and "Table" not in n]
        names = rng.sample([n for n in known if "tau_pos" not in n], 2)
        found = pt.hessian(plant, signal, names, stop=1.0, **TIGHT)
        each = [differences(plant, signal, names, h, stop=1.0, **TIGHT) for h in (1e-3, 1e-4)]
        size = np.array([abs(plant.parameters[n]) for n in names])
        scale = np.outer(size, size)
        errors = [np.abs((found.values - d) * scale).max() for d in each if d is not None]
        if errors:
            gradient = pt.gradient(plant.simulate(1.0, **TIGHT), signal, names)
            whole = np.abs(found.values * scale).max() + np.abs(gradient.array * size).max()
            assert min(errors) <= 1e-7 * whole + 1e-9, (seed, signal, names)
            compared += 1
    assert compared > 0.75 * len(seeds)


def test_refusals() -> None:
    with pytest.raises(pt.ParameterError, match="torque is an input"):
        pt.hessian(Engaging(), "engine.w", ["torque"], stop=0.1, starts=STARTS, inputs={"torque": 1.0, "press": 0.0})
    with pytest.raises(pt.ParameterError, match="at least one"):
        pt.hessian(Ball(), "h", [], stop=0.1)
    with pytest.raises(pt.SimulationError, match="corner of the signal"):
        pt.hessian(Swing(), pt.minimum(lambda m: ca.fabs(m.v)), ["w0"], stop=0.6)
    starts = {"engine.w": 50.0, "load.w": 50.0}
    with pytest.raises(pt.SimulationError, match="zero by coincidence"):
        pt.hessian(Joining(), "load.w", ["engine.w"], stop=0.1, starts=starts)


@pytest.mark.slow
def test_a_gear_shift() -> None:
    """A clutch whose limits begin to open at an instant that an earlier shift determines, against differences of gradients."""
    from powertrain.components.cycles import DriveCycle
    from powertrain.trials.cycle import on_cycle

    plant = pt.compile(on_cycle(ManualCar(), DriveCycle.named("udds").part(0, 126)))
    options: dict[str, Any] = {"rtol": 1e-10, "points": 1}
    name, value, h = "driver.k_p", plant.parameters["driver.k_p"], 1e-4
    found = float(pt.hessian(plant, "engine.fuel", [name], stop=28.0, **options).values[0, 0])
    ends = [
        pt.gradient(plant.simulate(28.0, parameters={name: value * k}, **options), "engine.fuel", [name])[name]
        for k in (1 + h, 1 - h)
    ]
    assert found == pytest.approx((ends[0] - ends[1]) / (2 * h * value), rel=1e-5)
