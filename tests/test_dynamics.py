"""The model as casadi functions: against a run, in every mode it has, with steps and limits of the modes."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from small_models import STARTS, CoupledClutches, Engaging

import powertrain as pt
from powertrain.components.rotational import Inertia, Speed, Torque

INPUTS = {"torque": 20.0, "press": 0.6}


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Engaging]:
    return pt.compile(Engaging())


@pytest.fixture(scope="module")
def run(plant: pt.Plant[Engaging]) -> pt.Result[Engaging]:
    result = plant.simulate(2.0, starts=STARTS, inputs=INPUTS, rtol=1e-10)
    assert [e.new for e in result.events] == [0.0]
    return result


@pytest.mark.parametrize("t", [0.1, 1.9])
def test_signals_in_the_modes_of_a_run(plant: pt.Plant[Engaging], run: pt.Result[Engaging], t: float) -> None:
    outputs = ["clutch.tau", "load.a", "shaft.tau"]
    found = plant.function(outputs, modes=(run, t))
    assert found.inputs == ("torque", "press")
    np.testing.assert_allclose(found.u, [20.0, 0.6])
    y = np.array(found.function(t, found.x, found.z, found.u, found.p)[2]).ravel()
    exact = run.at([t], outputs)
    np.testing.assert_allclose(y, [float(exact[o][0]) for o in outputs], rtol=1e-9)
    margins = np.array(found.function(t, found.x, found.z, found.u, found.p)[3]).ravel()
    assert len(margins) == len(found.margins)
    assert (margins >= 0).all()
    assert found.units["clutch.tau"] == "N.m"


def test_rates_are_those_of_the_run() -> None:
    """CoupledClutches has signals of time: they stay signals of time, through all of its modes."""
    plant = pt.compile(CoupledClutches())
    run = plant.simulate(1.5, rtol=1e-11)
    for t in (0.05, 0.35, 0.7, 1.0, 1.4):
        found = plant.function(modes=(run, t))
        h = 1e-5
        states = [run.at([t + k * h], list(found.states)) for k in (1, -1)]
        slope = [(float(states[0][s][0]) - float(states[1][s][0])) / (2 * h) for s in found.states]
        xdot = np.array(found.function(t, found.x, found.z, found.u, found.p)[0]).ravel()
        np.testing.assert_allclose(xdot, slope, rtol=1e-5, atol=1e-5)


def test_step_is_the_run(plant: pt.Plant[Engaging], run: pt.Result[Engaging]) -> None:
    found = plant.function("clutch.tau", modes=(run, 0.0))
    step = found.step(0.02, intervals=4)
    x, y, margin = ca.DM(found.x), ca.DM(0), ca.DM(0)
    for k in range(5):
        x, y, margin = step(0.02 * k, x, found.u, found.p)
    exact = run.at([0.1], [*found.states, "clutch.tau"])
    np.testing.assert_allclose(np.array(x).ravel(), [float(exact[s][0]) for s in found.states], rtol=1e-7, atol=1e-7)
    assert float(y) == pytest.approx(float(exact["clutch.tau"][0]))
    assert float(margin) == pytest.approx(-run.at(0.1, "clutch.w_rel"))
    slopes = ca.Function("d", [u := ca.MX.sym("u", 2)], [ca.jacobian(step(0.0, found.x, u, found.p)[0], u)])
    by = [
        np.array(step(0.0, found.x, found.u + d, found.p)[0]).ravel()
        for d in (np.array([0, 1e-4]), np.array([0, -1e-4]))
    ]
    np.testing.assert_allclose(np.array(slopes(found.u))[:, 1], (by[0] - by[1]) / 2e-4, rtol=1e-6, atol=1e-8)


def test_parameters_as_inputs(plant: pt.Plant[Engaging], run: pt.Result[Engaging]) -> None:
    found = plant.function("load.a", inputs=["shaft.c", "torque"], modes=(run, 0.1))
    np.testing.assert_allclose(found.u, [500.0, 20.0])
    other = plant.function("load.a", modes=(run, 0.1))
    at = [np.array(f.function(0.1, f.x, f.z, f.u, f.p)[2]).ravel() for f in (found, other)]
    np.testing.assert_allclose(at[0], at[1])


def test_modes_by_name(plant: pt.Plant[Engaging]) -> None:
    sliding, stuck = (plant.function("clutch.tau", modes={"clutch.mode": mode}) for mode in (1, 0))
    assert sliding.margins == ("clutch.mode: forward",)
    assert stuck.margins == ("clutch.mode: above its lower limit", "clutch.mode: below its upper limit")
    heavy = pt.compile(CoupledClutches()).function(modes={f"clutch{k}.mode": 0 for k in (1, 2, 3)})
    assert heavy.stills == tuple(f"clutch{k}.mode: speed" for k in (1, 2, 3))
    assert sliding.modes == {"clutch.mode": 1.0}
    tau = float(sliding.function(0, sliding.x, sliding.z, [0, 0.5], sliding.p)[2])
    assert tau == pytest.approx(100.0)


def test_bad_input(plant: pt.Plant[Engaging], run: pt.Result[Engaging]) -> None:
    with pytest.raises(pt.ParameterError, match=r"also give those of clutch\.mode"):
        plant.function("load.a")
    with pytest.raises(pt.ParameterError, match=r"no law clutch\.mod; did you mean clutch\.mode"):
        plant.function(modes={"clutch.mod": 1})
    with pytest.raises(pt.ParameterError, match="must be one of 1, 0, -1, 2"):
        plant.function(modes={"clutch.mode": 3})
    with pytest.raises(pt.ParameterError, match="no input or parameter torq"):
        plant.function(inputs="torq", modes=(run, 0.0))
    bad: Any = (run, 0.0, 1)
    with pytest.raises(pt.ParameterError, match=r"\(result, t\)"):
        plant.function(modes=bad)
    with pytest.raises(pt.ParameterError, match="not positive"):
        plant.function(modes=(run, 0.0)).step(0.0)
    with pytest.raises(pt.ParameterError, match="intervals = 0 must be at least 1"):
        plant.function(modes=(run, 0.0)).step(0.1, intervals=0)
    with pytest.raises(pt.ParameterError, match=r"t = 9 s lies outside the simulated span \[0, "):
        plant.function(modes=(run, 9.0))
    with pytest.raises(pt.ParameterError, match="the result belongs to another model"):
        plant.function(modes=(pt.simulate(Inertia(J=1.0), 1.0), 0.5))


class Dragged(pt.Component):
    """An inertia whose speed is prescribed by an input, and what its torque depends on."""

    v: pt.Input = pt.signal_input("rad/s", "Speed")
    extra: pt.Input = pt.signal_input("N.m", "Torque against it")
    motion: Speed = Speed(exact=True)
    inertia: Inertia = Inertia(J=2.0)
    brake: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.v, self.motion.w_ref)
        yield pt.connect(self.motion.flange, self.inertia.flange_a)
        yield pt.connect(self.inertia.flange_b, self.brake.flange)
        yield pt.connect(self.extra, self.brake.tau)


def test_inputs_over_time_keep_their_course_and_their_derivative() -> None:
    """Of a run from which modes are taken: also far from the instant, J der(v) from the slope of the signal there."""
    plant = pt.compile(Dragged())
    times, speeds = [0.0, 1.0, 3.0, 4.0], [0.0, 5.0, 1.0, 1.0]
    run = plant.simulate(4.0, inputs={"v": (times, speeds), "extra": 1.0})
    model = plant.function("motion.flange.tau", inputs=["extra"], modes=(run, 0.5))
    for t, slope in ((0.2, 5.0), (2.0, -2.0), (3.5, 0.0)):
        found = float(model.function(t=t, x=model.x, z=model.z, u=[1.0], p=model.p)["y"])
        size = 2.0 * slope - 1.0
        assert abs(found) == pytest.approx(abs(size)), t
        assert found == pytest.approx(run.at([t], ["motion.flange.tau"])["motion.flange.tau"][0])


def test_a_step_of_an_input_holds_from_its_instant_on() -> None:
    plant = pt.compile(Dragged())
    run = plant.simulate(3.0, inputs={"v": 2.0, "extra": ([0.0, 1.0, 1.0, 2.0], [1.0, 1.0, 4.0, 4.0])})
    model = plant.function("motion.flange.tau", inputs=[], modes=(run, 0.5))
    found = [
        abs(float(model.function(t=t, x=model.x, z=model.z, u=[], p=model.p)["y"])) for t in (0.0, 0.999, 1.0, 2.5)
    ]
    assert found == pytest.approx([1.0, 1.0, 4.0, 4.0])


@pytest.mark.parametrize("press", [0.0, 0.5])
def test_a_law_is_free_while_its_limits_coincide(plant: pt.Plant[Engaging], press: float) -> None:
    """100 N.m to either side at half the pressure."""
    free = plant.function(modes={"clutch.mode": 2})
    assert free.margins == ("clutch.mode: free",)
    assert float(free.function(0, free.x, free.z, [0.0, press], free.p)[3]) == pytest.approx(-400.0 * press)


class Limited(pt.Component):
    """A mass that friction holds up to 1.5 times what it slides with, and rates that follow two comparisons at once."""

    f: pt.Input = pt.signal_input("N", "Force on the mass")
    v: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.3)
    y: pt.Variable = pt.variable("1", "Other level", start=0.4)
    grip: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield 2 * pt.der(self.v) == self.f.value - self.grip
        yield pt.friction(self.v, self.grip, -3.0, 2.0, peak=1.5, name="grip")
        yield pt.der(self.x) == pt.switch(ca.logic_and(self.x > 0.2, self.y > 0.1), 1.0, 2.0)
        yield pt.der(self.y) == pt.switch(ca.logic_or(self.x > 1.0, self.y > 0.1), 1.0, 2.0)


@pytest.mark.parametrize(("x", "y"), [(0.3, 0.4), (0.1, 0.4), (1.3, 0.05), (0.15, 0.05)])
def test_limits_of_what_sticks_and_of_comparisons_at_once(x: float, y: float) -> None:
    """Both hold while the smaller excess is positive, either of them while the larger one is."""
    model = pt.compile(Limited()).function(modes={"grip": 0})
    states = [{"v": 0.0, "x": x, "y": y}[name] for name in model.states]
    margins = np.array(model.function(0, states, model.z, [2.5], model.p)[3]).ravel().tolist()
    assert margins == pytest.approx([2.5 + 4.5, 3.0 - 2.5, min(x - 0.2, y - 0.1), max(x - 1.0, y - 0.1)])
