"""Runs in C against runs in Python: the same steps, events and numbers."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from small_models import STARTS, Ball, Belt, CoupledClutches, Engaging, Gate, Overrunning, Relay

import powertrain as pt
from powertrain.components.blocks import Constant, Ramp
from powertrain.components.electric import AccessoryLoad, Battery
from powertrain.components.rotational import Brake, Inertia, SpringDamper, Torque
from powertrain.trials.cycle import on_cycle

RTOL = 1e-6
"""The default tolerance of a run."""

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")


@pytest.fixture(autouse=True)
def quickly_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """The numbers are those of any other level."""
    monkeypatch.setattr("powertrain.native.driver.FLAGS", ("-std=c99", "-O0", "-fPIC", "-shared"))


class Pendulum(pt.Component):
    """Smooth, nonlinear, never at rest."""

    phi: pt.Variable = pt.variable("rad", "Angle", start=1.0)
    w: pt.Variable = pt.variable("rad/s", "Angular velocity", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == self.w
        yield pt.der(self.w) == -9.81 * ca.sin(self.phi) - 0.1 * self.w


class Loaded(pt.Component):
    """A battery whose voltage is implicit."""

    battery: Battery = Battery()
    load: AccessoryLoad = AccessoryLoad(P=3000)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.bus, self.load.bus)


class Stiff(pt.Component):
    """Two inertias on a stiff shaft."""

    a: Inertia = Inertia(J=1.0)
    shaft: SpringDamper = SpringDamper(c=1e5, d=300.0)
    b: Inertia = Inertia(J=0.01)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.a.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.b.flange_a)

    def initial(self) -> pt.Equations:
        yield self.a.w == 10


class Held(pt.Component):
    """A weight on two brakes, one of which alone is too weak; their springs share the load until the pull is too strong for both."""

    pull: Ramp = Ramp(height=60.0, duration=1.0)
    torque: Torque = Torque()
    drum: Inertia = Inertia(J=0.5)
    press: Constant = Constant(k=1.0)
    weak: Brake = Brake(fn_max=20.0, mue_pos=((0.0, 0.5),))
    strong: Brake = Brake(fn_max=60.0, mue_pos=((0.0, 0.5),))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.pull.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.drum.flange_a)
        yield pt.connect(self.drum.flange_b, self.weak.flange_a, self.strong.flange_a)
        yield pt.connect(self.press.y, self.weak.f_normalized)
        yield pt.connect(self.press.y, self.strong.f_normalized)

    def initial(self) -> pt.Equations:
        yield self.drum.w == 2.0


def passing() -> Gate:
    """True for 0.2 ms, of time and of a state."""
    return Gate(condition=lambda g: ca.logic_and(pt.time > 0.3, ca.logic_not(g.load.s > 0.3002)))


CASES: dict[str, tuple[Callable[[], pt.Component], float, dict[str, Any]]] = {
    "smooth": (Pendulum, 5.0, {}),
    "clutches": (CoupledClutches, 1.5, {}),
    "resets and instants": (Relay, 8.0, {}),
    "relations": (passing, 2.0, {}),
    "implicit": (Loaded, 20.0, {}),
    "stiff": (Stiff, 1.0, {}),
    "held by others": (Held, 1.2, {}),
    "belt that jumps": (Belt, 2.0, {"inputs": {"u": ([0, 0.3, 0.3, 1.0, 1.0], [0, 0, 1, 1, -0.5])}}),
    "inputs": (
        Engaging,
        2.0,
        {"starts": STARTS, "inputs": {"torque": 20.0, "press": ([0, 0.5, 0.5, 1.5], [0.1, 0.3, 0.2, 0.9])}},
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("method", few(["dopri5", "rodas5p"]))
def test_the_run_is_that_of_python(case: str, method: Any, tmp_path: Path) -> None:
    make, stop, given = CASES[case]
    plant = pt.compile(make())
    if method == "dopri5" and plant.compiled.dae.z.numel():
        pytest.skip("an explicit method has no algebraic unknowns")
    model = plant.export_c(tmp_path, method=method, **given)
    found = model.simulate(stop, points=200, **given)
    wanted = plant.simulate(stop, points=200, method=method, **given)
    assert found.statistics["steps"] == wanted.statistics["steps"]
    assert [(e.name, e.old, e.new) for e in found.events] == [(e.name, e.old, e.new) for e in wanted.events]
    assert [e.time for e in found.events] == pytest.approx([e.time for e in wanted.events], rel=1e-12)
    for name in plant.compiled.signals:
        size = 1e-300 + float(np.abs(wanted[name]).max())
        np.testing.assert_allclose(found[name], wanted[name], rtol=0, atol=1e-10 * size, err_msg=name)


@pytest.mark.slow
def test_a_car_stops_and_stands_on_its_brakes(tmp_path: Path) -> None:
    """Newton's method goes round at its first stop, and brakes, rolling resistance and gears hold the same motion.

    Round-off grows in the sequence of step sizes, each of which follows from the error of the one before, until both runs differ by a share
    of their tolerance.
    """
    from powertrain.vehicles.split_path_car import SplitPathCar

    plant = pt.compile(SplitPathCar())
    model = plant.export_c(tmp_path, method="dopri5")
    found, wanted = model.simulate(60.0, points=30), plant.simulate(60.0, points=30, method="dopri5")
    assert [(e.name, e.old, e.new) for e in found.events] == [(e.name, e.old, e.new) for e in wanted.events]
    for name in plant.compiled.states:
        size = 1e-300 + float(np.abs(wanted[name]).max())
        np.testing.assert_allclose(found[name], wanted[name], rtol=0, atol=RTOL / 10 * size, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "stop"), [("ManualCar", 60.0), ("DualClutchCar", 100.0), ("RearDriveCar", 110.0)])
def test_cars_shift_gears(kind: str, stop: float, tmp_path: Path) -> None:
    """Synchronisers, dogs and clutches that come to rest at their limits while others hold them.

    Steps in one function and in parts differ by round-off, which grows as above: to speeds of 1e-6 of their size, and to instants at
    which such speeds are reached. The brakes of two axles release within the last digits of an instant, in either order.
    """
    plant = pt.compile(on_cycle(getattr(pt.vehicles, kind)(), "wltc"))
    found = plant.export_c(tmp_path, method="rodas5p").simulate(stop, points=100)
    wanted = plant.simulate(stop, points=100, method="rodas5p", compile=True)
    events, others = (sorted(run.events, key=lambda e: e.name) for run in (found, wanted))
    assert [(e.name, e.old, e.new) for e in events] == [(e.name, e.old, e.new) for e in others]
    assert [e.time for e in events] == pytest.approx([e.time for e in others], abs=1e-4)
    for name in ("body.v", "body.s", "engine.fuel", "engine.w"):
        size = float(np.abs(wanted[name]).max())
        at_these_times = np.interp(found.time, wanted.time, wanted[name])
        np.testing.assert_allclose(found[name], at_these_times, rtol=0, atol=1e-5 * size, err_msg=name)


def test_other_parameters_and_starts_need_no_export(tmp_path: Path) -> None:
    plant = pt.compile(CoupledClutches())
    model = plant.export_c(tmp_path)
    for parameters in ({"J1.J": 1.3, "clutch2.fn_max": 15.0}, {"sin1.f": 4.0}):
        found, wanted = (m.simulate(1.5, parameters=parameters) for m in (model, plant))
        assert found["J4.w"][-1] == pytest.approx(wanted["J4.w"][-1], rel=1e-12)
        assert found.parameters == wanted.parameters
    found, wanted = (m.simulate(1.5, starts={"J1.w": 7.0}, start=0.2, rtol=1e-9) for m in (model, plant))
    assert found["J4.w"] == pytest.approx(wanted["J4.w"], rel=1e-12, abs=1e-13)


class Decay(pt.Component):
    """A state that decays at a rate which is a number of the model."""

    rate: float
    y: pt.Variable = pt.variable("1", "State", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == -self.rate * self.y


def test_times_are_checked_as_by_simulate(tmp_path: Path) -> None:
    exported = pt.compile(Pendulum()).export_c(tmp_path)
    assert exported.simulate("0.3 s", times=[0.0, 3 * 0.1]).time.tolist() == [0.0, 0.3]
    with pytest.raises(pt.ParameterError, match="stop = -1 s is before start = 0 s"):
        exported.simulate(-1.0)
    with pytest.raises(pt.ParameterError, match="2 s lies outside the simulated span"):
        exported.simulate(1.0, times=[0.0, 2.0])


def test_a_folder_may_be_used_again(tmp_path: Path) -> None:
    """A library of the same name that is loaded already must not take the place of the new one."""
    slow = pt.compile(Decay(rate=1.0)).export_c(tmp_path)
    assert slow.simulate(1.0)["y"][-1] == pytest.approx(np.exp(-1.0), rel=1e-5)
    waiting = pt.compile(Decay(rate=2.0)).export_c(tmp_path)
    fast = pt.compile(Decay(rate=3.0)).export_c(tmp_path)
    assert fast.simulate(1.0)["y"][-1] == pytest.approx(np.exp(-3.0), rel=1e-5)
    assert slow.simulate(1.0)["y"][-1] == pytest.approx(np.exp(-1.0), rel=1e-5)
    with pytest.raises(pt.PowertrainError, match="has other sources than this export wrote; export the model again"):
        waiting.simulate(1.0)


def test_long_runs_fill_the_record_many_times(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from powertrain.native import driver

    monkeypatch.setattr(driver, "_ROWS", 7)
    monkeypatch.setattr(driver, "_HELD", 5)
    monkeypatch.setattr(driver, "_INSTANTS", 3)
    plant = pt.compile(CoupledClutches())
    found, wanted = plant.export_c(tmp_path).simulate(1.5), plant.simulate(1.5)
    assert found["J4.w"] == pytest.approx(wanted["J4.w"], rel=1e-12, abs=1e-13)
    assert len(found.events) == len(wanted.events)


def test_a_freewheel_that_a_signal_or_a_switch_throws_backward_ends_the_run(tmp_path: Path) -> None:
    class Switched(pt.Component):
        load: Overrunning = Overrunning()

        def equations(self) -> pt.Equations:
            yield self.load.u.value == pt.switch(pt.time < 0.5, 0.0, 1.0)

    by_input = {"u": ([0.0, 0.5, 0.5, 1.0], [0.0, 0.0, 1.0, 1.0])}
    for model, inputs in ((Overrunning(), by_input), (Switched(), None)):
        exported = pt.compile(model).export_c(tmp_path / type(model).__name__)
        with pytest.raises(pt.SimulationError, match=r"at t = 0\.5 s a jump throws a one-way law backward"):
            exported.simulate(1.0, inputs=inputs)


def test_fixed_steps_converge_with_the_order_of_the_method(tmp_path: Path) -> None:
    """Between events the error falls with the fifth power of the step."""
    plant = pt.compile(Pendulum())
    exact = plant.simulate(2.0, rtol=1e-12)["phi"][-1]
    model = plant.export_c(tmp_path)
    errors = [abs(model.simulate(2.0, step=h)["phi"][-1] - exact) for h in (0.1, 0.05, 0.025)]
    assert model.simulate(2.0, step=0.1).statistics["steps"] == 20
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([5.0, 5.0], abs=0.5)


@pytest.mark.slow
def test_fixed_steps_locate_events(tmp_path: Path) -> None:
    plant = pt.compile(CoupledClutches())
    found, wanted = plant.export_c(tmp_path).simulate(1.5, step=1e-3), plant.simulate(1.5, rtol=1e-10)
    assert [(e.name, e.new) for e in found.events] == [(e.name, e.new) for e in wanted.events]
    assert [e.time for e in found.events] == pytest.approx([e.time for e in wanted.events], abs=1e-9)
    assert found["J4.w"][-1] == pytest.approx(wanted["J4.w"][-1], abs=1e-9)


def test_the_program_in_c_prints_the_run(tmp_path: Path) -> None:
    plant = pt.compile(CoupledClutches())
    plant.export_c(tmp_path)
    sources = ["functions.c", "model.c", "powertrain_run.c", "powertrain_loop.c", "main.c"]
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wno-unused-function", "-Wno-unused-parameter"]
    subprocess.run(["cc", *strict, "-O1", *sources, "-o", "model", "-lm"], cwd=tmp_path, check=True)
    printed = subprocess.run(["./model", "1.5", "3"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    rows = [line.split(",") for line in printed.strip().splitlines()]
    wanted = plant.simulate(1.5, times=[0, 0.5, 1.0, 1.5]).at([0, 0.5, 1.0, 1.5], plant.compiled.states)
    assert rows[0] == ["time", *plant.compiled.states]
    for k, name in enumerate(plant.compiled.states, 1):
        assert [float(r[k]) for r in rows[1:]] == pytest.approx(wanted[name], rel=1e-6, abs=1e-8), name


def test_an_input_that_c_sets_keeps_its_value(tmp_path: Path) -> None:
    """Although the export gave it over time: speeds of a belt after its corners at 0.2 s and 1 s, from a run in hand."""
    import ctypes

    given: dict[str, Any] = {"inputs": {"u": ([0.0, 0.2, 1.0], [0.0, 1.0, -3.0])}}
    plant = pt.compile(Belt())
    library = plant.export_c(tmp_path, **given).library
    memory = np.zeros(library.pt_size() // 8 + 1)
    one = ctypes.c_void_p(memory.ctypes.data)
    for taken in (True, False):  # a new start gives the inputs back
        library.pt_start(one)
        if taken:
            library.pt_set_input(one, 0, ctypes.c_double(0.5))
        assert library.pt_run(one, ctypes.c_double(1.2)) == 0
        run = plant.start(**given)
        run.step(1.2, **({"u": 0.5} if taken else {}))
        assert library.pt_unknowns(one)[0] == pytest.approx(run.state.x[0], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("/nowhere/cc -O1", "the C compiler /nowhere/cc cannot be run: No such file or directory"),
        ("false", "the C compiler false failed with exit status 1"),
    ],
)
def test_a_compiler_that_does_not_work_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, said: str
) -> None:
    exported = pt.compile(Belt()).export_c(tmp_path, inputs={"u": 1.0})
    monkeypatch.setenv("CC", command)
    with pytest.raises(pt.PowertrainError, match=said):
        exported.simulate(0.1)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
def test_a_program_in_cpp_links_the_model(tmp_path: Path) -> None:
    pt.compile(Belt()).export_c(tmp_path, inputs={"u": 1.0})
    program = (
        '#include "powertrain_run.h"\nint main() { pt_start(pt_instance()); return pt_run(pt_instance(), 0.1); }\n'
    )
    (tmp_path / "program.cpp").write_text(program)
    sources = ["functions.c", "model.c", "powertrain_run.c", "powertrain_loop.c"]
    subprocess.run(["cc", "-c", *sources], cwd=tmp_path, check=True)
    objects = [source.replace(".c", ".o") for source in sources]
    subprocess.run(["g++", "program.cpp", *objects, "-o", "program", "-lm"], cwd=tmp_path, check=True)
    subprocess.run(["./program"], cwd=tmp_path, check=True)


@pytest.mark.slow
def test_inputs_set_from_c_are_those_of_a_run_in_hand(tmp_path: Path) -> None:
    import ctypes

    given: dict[str, Any] = {"starts": STARTS, "inputs": {"torque": 20.0, "press": 0.1}}
    plant = pt.compile(Engaging())
    model, run = plant.export_c(tmp_path, method="dopri5", **given), plant.start(method="dopri5", **given)
    library, place = model.library, list(plant.compiled.inputs).index("press")
    memory = np.zeros(library.pt_size() // 8 + 1)
    one = ctypes.c_void_p(memory.ctypes.data)
    library.pt_start(one)
    for k, press in enumerate((0.2, 0.5, 0.9), 1):
        library.pt_set_input(one, place, ctypes.c_double(press))
        assert library.pt_run(one, ctypes.c_double(0.3 * k)) == 0
        run.step(0.3 * k - run.time, press=press)
        found = np.array(library.pt_unknowns(one)[: len(plant.compiled.states)])
        assert found == pytest.approx(run.state.x, rel=1e-9, abs=1e-10)


def test_a_run_in_c_names_an_input_without_value(tmp_path: Path) -> None:
    model = pt.compile(Belt()).export_c(tmp_path)
    assert "the input u is 0 m/s, because it was given no value" in model.simulate(0.1).notes
    assert not model.simulate(0.1, inputs={"u": 0.0}).notes


def test_an_input_set_from_c_makes_a_load_slip(tmp_path: Path) -> None:
    """2 m/s2 for 0.1 s; the load had the speed of its belt at once."""
    import ctypes

    library = pt.compile(Belt()).export_c(tmp_path, inputs={"u": 0.0}).library
    memory = np.zeros(library.pt_size() // 8 + 1)
    one = ctypes.c_void_p(memory.ctypes.data)
    library.pt_start(one)
    for stop, u in ((0.1, 0.0), (0.2, 1.0)):
        library.pt_set_input(one, 0, ctypes.c_double(u))
        assert library.pt_run(one, ctypes.c_double(stop)) == 0
    assert library.pt_unknowns(one)[0] == pytest.approx(0.2)


def test_samples_are_written_while_the_run_passes_them(tmp_path: Path) -> None:
    """The values of the dense output at any times, the first and the last included."""
    import ctypes

    plant = pt.compile(CoupledClutches())
    library, wanted = plant.export_c(tmp_path, method="dopri5").library, plant.simulate(1.5, method="dopri5")
    times, states = np.sort([0.0, 1.5, *np.random.default_rng(0).uniform(0, 1.5, 60)]), len(plant.compiled.states)
    memory, found = np.zeros(library.pt_size() // 8 + 1), np.full((len(times), states), np.nan)
    one = ctypes.c_void_p(memory.ctypes.data)
    library.pt_start(one)
    given = (ctypes.c_void_p(a.ctypes.data) for a in (times, found))
    library.pt_sample(one, next(given), ctypes.c_long(len(times)), next(given))
    assert library.pt_run(one, ctypes.c_double(1.5)) == 0
    expected = np.column_stack([wanted.at(times, name) for name in plant.compiled.states])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


class Doubled(pt.Component):
    """A value that two laws reset at 0.5 s."""

    second: pt.Parameter = pt.parameter("kg", "What the second gives it", default=4.0)
    s: pt.Variable = pt.variable("s", "Runs with the time", start=0.0)
    held: pt.Discrete = pt.discrete("kg", "A value that is held", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == 1
        yield pt.when(pt.time > 0.5, pt.reinit(self.held, 3))
        yield pt.when(pt.time > 0.5, pt.reinit(self.held, self.second))


def test_two_resets_of_one_variable_agree_or_are_refused(tmp_path: Path) -> None:
    model = pt.compile(Doubled()).export_c(tmp_path)
    for second in (3.0, 3.0 + 3e-7):  # up to 1e-7 of one and their size
        assert model.simulate(1.0, parameters={"second": second})["held"][-1] == second
    with pytest.raises(pt.SimulationError, match="to different values"):
        model.simulate(1.0, parameters={"second": 3.0 + 5e-7})
    with pytest.raises(pt.SimulationError, match="two laws reset one variable to different values") as caught:
        model.simulate(1.0)
    assert caught.value.result is not None
    assert caught.value.result.time[-1] == 0.5


class Paused(pt.Component):
    """A motion given by time that comes to rest, where nothing determines the torque of the brake that a counter needs."""

    s: pt.Variable = pt.variable("1", "Count")
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque of the brake")

    def equations(self) -> pt.Equations:
        yield self.w == pt.switch(pt.time < 0.5, 0.5 - pt.time, 0.0, continuous=True)
        yield pt.friction(self.w, self.tau, -1.0, 1.0)
        yield pt.der(self.s) == self.tau


def test_a_torque_that_nothing_determines_is_refused(tmp_path: Path) -> None:
    plant = pt.compile(Paused())
    with pytest.raises(pt.SimulationError, match="nothing determines this torque"):
        plant.simulate(1.0)
    with pytest.raises(
        pt.SimulationError, match=r"in C: at t = 0.5 s a friction law .* rests where nothing determines its torque"
    ):
        plant.export_c(tmp_path).simulate(1.0)


def test_what_c_cannot_do_is_refused(tmp_path: Path) -> None:
    with pytest.raises(pt.ParameterError, match="is a unilateral contact; impacts are not available in C"):
        pt.compile(Ball()).export_c(tmp_path)
    with pytest.raises(pt.ParameterError, match="method='euler' must be one of"):
        pt.compile(Pendulum()).export_c(tmp_path, method="euler")  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match="folder = 3"):
        pt.compile(Pendulum()).export_c(3)  # type: ignore[arg-type]
