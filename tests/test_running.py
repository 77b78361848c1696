"""A run in hand: the same as one run, the same to the last bit from the same state, with inputs from outside."""

from __future__ import annotations

import copy
import pickle
import random
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from mechanisms import simulated
from small_models import STARTS, CoupledClutches, Engaging, Relay

import powertrain as pt
from powertrain.components.rotational import Damper, Fixed, Inertia

TIGHT: dict[str, Any] = {"rtol": 1e-10}


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Engaging]:
    return pt.compile(Engaging())


def commanded(run: Any, count: int) -> Any:
    """A controller: more torque below 90 rad/s, the clutch closes slowly and opens again."""
    for _ in range(count):
        press = min(run.time, 0.8) if run.time < 1.5 else 0.1
        run.step(0.05, torque=30.0 if run["engine.w"] < 90.0 else 10.0, press=press)
    return run


def test_steps_are_one_run(plant: pt.Plant[Engaging]) -> None:
    run = commanded(plant.start(starts=STARTS, **TIGHT), 40)
    result = run.result()
    assert set(result.inputs) == {"torque", "press"}
    whole = plant.simulate(run.time, starts=STARTS, inputs=result.inputs, **TIGHT)
    assert [(e.name, e.new) for e in result.events] == [(e.name, e.new) for e in whole.events]
    assert len(result.events) == 3
    np.testing.assert_allclose([e.time for e in result.events], [e.time for e in whole.events], rtol=1e-8)
    for name in ("engine.w", "load.w", "shaft.tau"):
        assert run[name] == pytest.approx(float(whole[name][-1]), rel=1e-8)
        assert run[name] == pytest.approx(float(result[name][-1]), rel=1e-12)
    assert run[lambda m: m.engine.w - m.load.w] == pytest.approx(run["engine.w"] - run["load.w"])


def test_inputs_without_a_value_are_noted(plant: pt.Plant[Engaging]) -> None:
    """As in a run at once, until a step gives the value; a zero that was given is one."""
    run = plant.start(starts=STARTS, inputs={"torque": 0.0}).step(0.1)
    assert run.result().notes == plant.simulate(0.1, starts=STARTS, inputs={"torque": 0.0}).notes
    assert [note for note in run.result().notes if "no value" in note] == [
        "the input press is 0, because it was given no value"
    ]
    other = copy.copy(run)
    assert not [note for note in run.step(0.1, press=0.0).result().notes if "no value" in note]
    assert [note for note in other.step(0.1).result().notes if "no value" in note]
    run.state = other.state
    assert [note for note in run.step(0.1).result().notes if "no value" in note]


def test_the_same_state_goes_on_the_same(plant: pt.Plant[Engaging]) -> None:
    run = commanded(plant.start(starts=STARTS), 12)
    kept = run.state
    first = commanded(run, 25).state
    plant.simulate(1.0, starts=STARTS, inputs={"press": 1.0})
    run.state = kept
    again = commanded(run, 25).state
    other = plant.start()
    other.state = kept
    third = commanded(other, 25).state
    for state in (again, third):
        assert state.t == first.t
        for values, same in ((state.x, first.x), (state.z, first.z), (state.m, first.m)):
            assert values.tobytes() == same.tobytes()
    assert kept.x.tobytes() != first.x.tobytes()


def test_a_copy_goes_on_by_itself(plant: pt.Plant[Engaging]) -> None:
    run = commanded(plant.start(starts=STARTS), 12)
    whole = commanded(plant.start(starts=STARTS), 20).result()
    for other in copy.copy(run), copy.deepcopy(run):
        np.testing.assert_array_equal(commanded(other, 8).result()["engine.w"], whole["engine.w"])
    assert run.result().time[-1] == run.time < whole.time[-1]
    assert run.result().inputs["press"][0][-1] < run.time


def test_what_goes_to_another_process_is_the_state(plant: pt.Plant[Engaging]) -> None:
    run = commanded(plant.start(starts=STARTS), 12)
    with pytest.raises(pt.ParameterError, match=r"send the plant and run\.state"):
        pickle.dumps(run)
    other = pickle.loads(pickle.dumps(plant)).start()
    other.state = pickle.loads(pickle.dumps(run.state))
    assert commanded(other, 8)["engine.w"] == commanded(run, 8)["engine.w"]


def test_discrete_variables_are_part_of_the_state() -> None:
    plant = pt.compile(Relay())
    run = plant.start(**TIGHT)
    for _ in range(60):
        run.step(0.1)
    whole = plant.simulate(6.0, **TIGHT)
    assert run["level"] == pytest.approx(float(whole["level"][-1]), rel=1e-8)
    assert run["since"] == pytest.approx(float(whole["since"][-1]), rel=1e-8)
    assert [e.name for e in run.result().events] == [e.name for e in whole.events]


def test_signals_of_time_go_on() -> None:
    plant = pt.compile(CoupledClutches())
    run = plant.start(**TIGHT)
    while run.time < 1.4999:
        run.step(0.01)
    whole = plant.simulate(1.5, **TIGHT)
    for k in (1, 2, 3, 4):
        assert run[f"J{k}.w"] == pytest.approx(float(whole[f"J{k}.w"][-1]), abs=1e-7)
    assert [(e.name, e.new) for e in run.result().events] == [(e.name, e.new) for e in whole.events]


def test_inputs_over_time_until_one_is_set(plant: pt.Plant[Engaging]) -> None:
    ramp = ([0.0, 1.0], [0.0, 1.0])
    run = plant.start(starts=STARTS, inputs={"press": ramp, "torque": 5.0})
    run.step(0.5)
    assert run["press"] == pytest.approx(0.5)
    run.step(0.25, press=0.1)
    assert run["press"] == 0.1
    assert run["torque"] == 5.0


def test_a_state_knows_which_inputs_follow_a_signal(plant: pt.Plant[Engaging]) -> None:
    """A value that is set, or a step that fails, after a state was stored does not end the signals of that state."""
    run = plant.start(starts=STARTS, inputs={"press": ([0.0, 0.6, 1.0], [0.0, 0.1, 0.9]), "torque": 5.0})
    followed, constant = run.step(0.5).state, run.step(0.1, press=0.3).state
    for state, press in ((followed, 0.9), (constant, 0.3), (followed, 0.9)):
        run.state = state
        assert run.step(0.6)["press"] == pytest.approx(press)
    run.state = followed
    with pytest.raises(pt.SimulationError):
        run.step(0.1, press=0.3, torque=1e300)
    assert run.step(0.6)["press"] == pytest.approx(0.9)


def test_inputs_that_were_given_are_those_of_the_run(plant: pt.Plant[Engaging]) -> None:
    """What the run was started with, what held before an input was set, and what a restored state holds."""
    given: dict[str, Any] = {"press": ([0.0, 0.3, 0.3, 1.0], [0.0, 0.1, 0.2, 0.9]), "torque": 5.0}
    run = plant.start(starts=STARTS, inputs=given, **TIGHT)
    run.step(0.5)
    run.step(0.25, torque=20.0)
    kept = run.step(0.25, press=0.3).state
    result = run.result()
    assert np.array_equal(result.inputs["torque"], ([0.0, 0.5, 0.5], [5.0, 5.0, 20.0]))
    press = [0.0, 0.3, 0.3, 0.75, 0.75], [0.0, 0.1, 0.2, 0.65, 0.3]
    np.testing.assert_allclose(result.inputs["press"], press, rtol=1e-15)
    whole = plant.simulate(1.0, starts=STARTS, inputs=result.inputs, **TIGHT)
    assert float(whole["engine.w"][-1]) == pytest.approx(run["engine.w"], rel=1e-8)
    found, same = (pt.gradient(r, "engine.w", ["torque", "press"]) for r in (result, whole))
    assert dict(found) == pytest.approx(dict(same), rel=1e-6, abs=1e-8)
    assert found["torque[1]"] != pytest.approx(0.0, abs=1e-3)
    run.state = kept
    assert {
        name: tuple(v.tolist() for v in knots) for name, knots in run.step(0.5, torque=1.0).result().inputs.items()
    } == {
        "press": ([1.0], [0.3]),
        "torque": ([1.0], [1.0]),
    }


def test_a_state_knows_which_inputs_still_run_over_time(plant: pt.Plant[Engaging]) -> None:
    """Setting an input, also in a step that fails, does not end its course in a state that is older, or in another run."""
    given: dict[str, Any] = {"starts": STARTS, "inputs": {"press": ([0.0, 0.2, 1.0], [0.0, 1.0, 0.0]), "torque": 5.0}}
    run, whole = plant.start(**given), plant.simulate(0.6, times=[0.6], **given)
    begun, wanted = run.state, {name: float(whole[name][-1]) for name in ("press", "engine.w", "load.w")}
    run.step(0.1, press=0.3)
    taken = run.state
    run.state = begun
    other = plant.start(starts=STARTS)
    other.state = begun
    for again in (run, other):
        again.step(0.6)
        assert {name: again[name] for name in wanted} == pytest.approx(wanted, rel=1e-6)
    run.state = taken
    assert run.step(0.5)["press"] == 0.3


def test_a_step_that_fails_leaves_inputs_as_they_were() -> None:
    class Rooted(pt.Component):
        """A root of an input, which ends the run at the first negative value."""

        u: pt.Input = pt.signal_input("1", "Signal")
        x: pt.Variable = pt.variable("1", "Integral of the root")

        def equations(self) -> pt.Equations:
            yield pt.der(self.x) == ca.sqrt(self.u.value)

    run = pt.compile(Rooted()).start(inputs={"u": ([0.0, 1.0, 2.0], [1.0, 1.0, 4.0])})
    with pytest.raises(pt.SimulationError):
        run.step(1.0, u=-1.0)
    run.step(2.0)
    assert run["x"] == pytest.approx(1.0 + 14.0 / 9.0, rel=1e-6)  # the integral of sqrt(1 + 3 s) over a second


def test_output_times_are_those_of_the_run(plant: pt.Plant[Engaging]) -> None:
    """Ten steps of 0.1 s end at 0.9999999999999999 s: 1 s is the end. Other times outside the run are errors, as for ``simulate``."""
    run = plant.start(starts=STARTS)
    for _ in range(10):
        run.step(0.1)
    assert run.time != 1.0
    result = run.result(np.linspace(0.0, 1.0, 11))
    assert result.time == pytest.approx(np.linspace(0.0, 1.0, 11), abs=1e-15)
    assert result["engine.w"][-1] == pytest.approx(run["engine.w"])
    for times in ([0.5, 2.0], [-1.0, 0.5]):
        with pytest.raises(pt.ParameterError, match=r"outside the simulated span \[0, 1\] s"):
            run.result(times)
    with pytest.raises(pt.ParameterError, match="times must not decrease"):
        run.result([0.5, 0.2])


def test_gradient_of_what_was_done(plant: pt.Plant[Engaging]) -> None:
    """The derivative with respect to what the controller gave at each step."""
    result = commanded(plant.start(starts=STARTS, **TIGHT), 10).result()
    found = pt.gradient(result, "engine.w", ["torque"])
    knots = result.inputs["torque"]
    k = 4
    ends = []
    for d in (1e-3, -1e-3):
        values = knots[1].copy()
        values[k] += d
        inputs = {**result.inputs, "torque": (knots[0], values)}
        ends.append(float(plant.simulate(0.5, starts=STARTS, inputs=inputs, **TIGHT)["engine.w"][-1]))
    assert found[f"torque[{k}]"] == pytest.approx((ends[0] - ends[1]) / 2e-3, rel=1e-6)


def test_bad_input(plant: pt.Plant[Engaging]) -> None:
    run = plant.start(starts=STARTS, record=False)
    with pytest.raises(pt.ParameterError, match="no input pres; did you mean press"):
        run.step(0.1, pres=1.0)
    with pytest.raises(pt.ParameterError, match=r"dt = -1 s is not positive"):
        run.step(-1.0)
    with pytest.raises(pt.ParameterError, match="record=False"):
        run.result()
    with pytest.raises(pt.ParameterError, match="step"):
        plant.start().result()
    with pytest.raises(pt.ParameterError, match="state from a run of the same model"):
        run.state = pt.compile(Relay()).start().state
    before = run.state
    with pytest.raises(pt.ParameterError):
        run.step(0.1, torque=float("nan"))
    assert run.state is before


class Coasting(pt.Component):
    """J der(w) = -d w, without laws, signals and inputs."""

    wheel: Inertia = Inertia(J=1.0)
    damper: Damper = Damper(d=1.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wheel.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


def test_a_model_without_laws_in_steps() -> None:
    run = pt.compile(Coasting()).start(starts={"wheel.w": 1.0}, **TIGHT)
    run.step(0.5)
    kept = run.state
    for _ in range(2):
        run.state = kept
        assert run.step(0.5)["wheel.w"] == pytest.approx(np.exp(-1.0), rel=1e-8)
    assert run.result([0.75])["wheel.w"] == pytest.approx([np.exp(-0.75)], rel=1e-8)


@pytest.mark.parametrize("seed", few(range(50), 3))
def test_machines_in_random_steps(seed: int) -> None:
    """At the end of each step the states are those of the whole run, also from a stored state."""
    draws = random.Random(seed)
    options: dict[str, Any] = {"rtol": 1e-8}
    plant, starts, whole = simulated(seed, **options)
    run = plant.start(starts=starts, **options)
    for end in [*sorted(draws.random() for _ in range(4)), 1.0]:
        kept = run.state
        run.step(end - run.time)
        if draws.random() < 0.5:
            time, run.state = run.time, kept
            run.step(time - run.time)
        for name in plant.compiled.states:
            size = 1.0 + np.abs(whole[name]).max()
            assert run[name] == pytest.approx(float(whole.at(end, name)), abs=1e-4 * size), name
