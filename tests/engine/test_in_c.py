"""The loop in C and the loop in Python: with the same functions, the same steps to the same events, to the last bit."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np
import pytest
from cases import few
from joined import joined
from mechanisms import mechanism, random_starts
from small_models import STARTS, Ball, CoupledClutches, Engaging, Relay

import powertrain as pt
from powertrain import vehicles
from powertrain.components.blocks import Constant, Sine, Step
from powertrain.components.rotational import (
    Brake,
    Freewheel,
    Inertia,
    Position,
    Speed,
    SpringDamper,
    Torque,
)
from powertrain.engine import in_c
from powertrain.engine.in_c import LoopInC
from powertrain.engine.simulator import Simulator
from powertrain.trials.cycle import on_cycle

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
STOP = 1.0


@pytest.fixture(autouse=True)
def quickly_compiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr("powertrain.numerics.compiled.FLAGS", ("-O0", "-fPIC", "-shared", "-ffp-contract=off"))
    loop = in_c._loop
    loop.cache_clear()
    yield
    loop.cache_clear()


class Overrunning(pt.Component):
    """A freewheel that a swinging torque drives and leaves behind."""

    sine: Sine = Sine(amplitude=5.0, f=2.0)
    torque: Torque = Torque()
    a: Inertia = Inertia(J=0.1)
    freewheel: Freewheel = Freewheel()
    b: Inertia = Inertia(J=0.3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.a.flange_a)
        yield pt.connect(self.a.flange_b, self.freewheel.flange_a)
        yield pt.connect(self.freewheel.flange_b, self.b.flange_a)


class Stiffening(pt.Component):
    """A speed that follows the time at a rate that grows: the explicit method is given up during the run."""

    w: pt.Variable = pt.variable("rad/s", "Speed", start=1.0)
    c: pt.Variable = pt.variable("1/s", "Rate", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == -self.c * (self.w - pt.time)
        yield pt.der(self.c) == 20 * self.c * (1 - self.c / 1e5)


class Shaken(pt.Component):
    """An inertia on a prescribed shaft."""

    sine: Sine = Sine(amplitude=0.5, f=2.0)
    drive: Position = Position(exact=True)
    shaft: SpringDamper = SpringDamper(c=1e3, d=1.0)
    load: Inertia = Inertia(J=0.1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.drive.phi_ref)
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.load.flange_a)


class Slowing(pt.Component):
    """A sine that slows down presses a brake at rest, and at times moves it; a quantity that leaves its range is counted."""

    J: Inertia = Inertia(J=1.0)
    torque: Torque = Torque()
    brake: Brake = Brake(fn_max=4.0, mue_pos=((0.0, 0.5),))
    press: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.J.flange_a)
        yield pt.connect(self.J.flange_b, self.brake.flange_a)
        yield pt.connect(self.press.y, self.brake.f_normalized)
        yield self.torque.tau.value == (2.0 + 0.1 * pt.time) * ca.sin(20 * ca.exp(-pt.time) * (1 - pt.time))
        pt.within(self.J.w, -0.01, 0.01, name="slow", unit="rad/s", action="count")


def run(plant: pt.Plant[Any], stop: float, options: dict[str, Any], in_c: bool) -> pt.Result[Any] | str:
    with pytest.MonkeyPatch.context() as patch:
        if not in_c:
            patch.setattr(Simulator, "_in_c", lambda engine, method: None)
        try:
            return plant.simulate(stop, compile=True, **options)
        except pt.PowertrainError as error:
            return str(error)


def compared(model: pt.Component, stop: float, options: dict[str, Any]) -> pt.Result[Any] | str:
    """Both runs are equal; the one in C."""
    plant = pt.compile(model)
    found, wanted = run(plant, stop, options, True), run(plant, stop, options, False)
    if isinstance(found, str) or isinstance(wanted, str):
        assert found == wanted
        return found
    assert found.statistics == wanted.statistics
    assert found.notes == wanted.notes
    assert [(e.time, e.name, e.old, e.new) for e in found.events] == [
        (e.time, e.name, e.old, e.new) for e in wanted.events
    ]
    np.testing.assert_array_equal(found.to_dataframe().to_numpy(), wanted.to_dataframe().to_numpy())
    return found


TURNING: dict[str, Any] = {
    "torque": ([0, 0.5, 0.5, 1.5, 2], [20, 20, 30, 30, 10]),
    "press": ([0, 0.5, 1.5, 1.5, 2], [0.1, 0.3, 0.9, 0.2, 0.2]),
}
CASES: dict[str, tuple[Callable[[], pt.Component], float, dict[str, Any]]] = {
    "clutches": (CoupledClutches, 1.5, {}),
    "implicit method": (CoupledClutches, 1.5, {"method": "rodas5p", "rtol": 1e-4}),
    "bounded steps": (CoupledClutches, 1.5, {"max_step": 0.01}),
    "resets and instants": (Relay, 8.0, {}),
    "impacts": (Ball, 3.0, {}),
    "freewheel": (Overrunning, 2.0, {}),
    "becomes stiff": (Stiffening, 3.0, {}),
    "prescribed": (Shaken, 1.0, {}),
    "two signals turn, the first jumps": (Engaging, 2.0, {"starts": STARTS, "inputs": TURNING}),
    "two signals turn, the last jumps": (Engaging, 2.0, {"starts": STARTS, "inputs": dict(reversed(TURNING.items()))}),
    "sines at rest": (Slowing, 2.0, {"start": -1.0}),
}


@pytest.mark.parametrize("case", CASES)
def test_small_models(case: str) -> None:
    found = compared(CASES[case][0](), *CASES[case][1:])
    assert not isinstance(found, str)


def test_signals_that_make_an_inertia_jump_are_refused() -> None:
    parts = Step(height=5.0, startTime=0.5), Speed(exact=True), Inertia(J=0.1)
    assert "jump by 5 rad/s" in str(compared(joined(*parts, joints="0.y=1.w_ref 1.flange=2.flange_a"), 1.0, {}))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 230))
def test_random_machines(seed: int) -> None:
    model = mechanism(seed)
    compared(model, STOP, {"starts": random_starts(pt.compile(model), seed)})


@pytest.mark.parametrize("kind", few(["ManualCar", "RearDriveCar", "SplitPathCar", "AutomaticCar", "DualClutchCar"], 0))
def test_vehicles(kind: str) -> None:
    found = compared(on_cycle(getattr(vehicles, kind)(), "wltc"), 120.0, {"rtol": 1e-4})
    assert not isinstance(found, str)


def test_routine_events_stay_in_c(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clutches that stick and slide need Python for their start alone."""
    calls = list[int]()
    proceed = LoopInC.proceed

    def counted(loop: LoopInC, *given: Any) -> Any:
        calls.append(1)
        return proceed(loop, *given)

    monkeypatch.setattr(LoopInC, "proceed", counted)
    result = pt.compile(CoupledClutches()).simulate(1.5, compile=True)
    assert len(result.events) > 8
    assert len(calls) == 1


@pytest.mark.parametrize("case", ["clutches", "sines at rest"])
def test_progress_and_long_records(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The records in C are emptied many times."""
    for name, size in {"_ROWS": 7, "_HELD": 5, "_INSTANTS": 3}.items():
        monkeypatch.setattr(f"powertrain.engine.in_c.{name}", size)
    monkeypatch.setattr("powertrain.engine.loop._throttled", lambda tell: tell)
    times = list[float]()
    make, stop, options = CASES[case]
    compared(make(), stop, {**options, "progress": lambda now: times.append(now.time)})
    assert len(set(times)) > 10


def test_runs_of_one_plant_with_other_inputs_and_in_steps() -> None:
    plant = pt.compile(Engaging())
    for press in (0.1, ([0, 0.5, 0.5, 1.5], [0.1, 0.3, 0.2, 0.9]), 0.4):
        options = {"starts": STARTS, "inputs": {"torque": 20.0, "press": press}}
        found, wanted = run(plant, 2.0, options, True), run(plant, 2.0, options, False)
        assert not isinstance(found, str)
        assert not isinstance(wanted, str)
        np.testing.assert_array_equal(found.to_dataframe().to_numpy(), wanted.to_dataframe().to_numpy())
    steps = [plant.start(starts=STARTS, inputs={"torque": 20.0}, compile=compiled) for compiled in (True, False)]
    for k in range(20):
        for each in steps:
            each.step(0.1, press=0.05 * k)
    assert steps[0].state.x == pytest.approx(steps[1].state.x, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize(
    ("struct", "fields"),
    [
        ("pt_dimensions", in_c._Dimensions),
        ("pt_tables", in_c._Tables),
        ("pt_functions", in_c._Functions),
        ("pt_model", in_c._Model),
    ],
)
def test_records_repeat_those_of_c(struct: str, fields: Any) -> None:
    text = re.sub(r"/\*.*?\*/", "", (in_c.SOURCES / "powertrain_loop.h").read_text(encoding="utf-8"), flags=re.DOTALL)
    pattern = r"struct pt_model \{(.*?)\};" if struct == "pt_model" else rf"typedef struct \{{([^{{}}]*)\}} {struct};"
    found = re.search(pattern, text, re.DOTALL)
    assert found is not None
    names = list[str]()
    for declared in found[1].split(";"):
        for name in re.findall(r"(\w+(?:\[2\])?)\s*(?:,|$)", declared.strip()):
            names += [f"{name[:-3]}_{k}" for k in (0, 1)] if name.endswith("[2]") else [name]
    assert names == [name for name, *_ in fields._fields_]


def test_without_the_loop_in_c_a_run_is_made_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    def full() -> None:
        raise OSError(28, "No space left on device")

    plant = pt.compile(CoupledClutches())
    wanted = run(plant, 1.5, {}, False)
    monkeypatch.setattr(in_c, "_loop", full)
    with pytest.warns(RuntimeWarning, match="cache of compiled models cannot be used .*No space left"):
        found = pt.compile(CoupledClutches()).simulate(1.5, compile=True)
    assert not isinstance(wanted, str)
    assert found.statistics == wanted.statistics


class Paused(pt.Component):
    """A motion given by time that comes to rest, where nothing determines the torque of the brake that a counter needs."""

    s: pt.Variable = pt.variable("1", "Count")
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Torque of the brake")

    def equations(self) -> pt.Equations:
        yield self.w == pt.switch(pt.time < 0.5, 0.5 - pt.time, 0.0, continuous=True)
        yield pt.friction(self.w, self.tau, -1.0, 1.0)
        yield pt.der(self.s) == self.tau


class Seizing(pt.Component):
    """A shoe that draws itself in from a certain speed on."""

    w: pt.Variable = pt.variable("rad/s", "Speed", start=10.0)
    k: pt.Variable = pt.variable("1", "Pressing force over friction force")
    N: pt.Variable = pt.variable("N", "Pressing force")
    F: pt.Variable = pt.variable("N", "Friction force")

    def equations(self) -> pt.Equations:
        yield self.k == pt.switch(self.w < 9.5, 3.0, 1.0)
        yield self.N - self.k * self.F == 10.0
        yield pt.friction(self.w, self.F, -0.5 * self.N, 0.5 * self.N)
        yield pt.der(self.w) == 1.0 - self.F


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (Paused(), "rests at t = 0.5 s .* nothing determines this torque"),
        (Seizing(), "is self-locking.* in the wrong order"),
    ],
)
def test_modes_that_are_refused(model: pt.Component, said: str) -> None:
    """Python checks what the modes found by C mean."""
    for compiled in (False, True):
        with pytest.raises(pt.SimulationError, match=said):
            pt.simulate(model, 1.0, compile=compiled)
