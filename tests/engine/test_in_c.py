"""The loop in C and the loop in Python: with the same functions, the same steps to the same events, to the last bit."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import few
from mechanisms import mechanism, random_starts
from small_models import Ball, CoupledClutches, Relay

import powertrain as pt
from powertrain import vehicles
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Freewheel, Inertia, Position, SpringDamper, Torque
from powertrain.engine.in_c import LoopInC
from powertrain.engine.simulator import Simulator
from powertrain.trials.cycle import on_cycle

pytestmark = pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
STOP = 1.0


@pytest.fixture(autouse=True)
def quickly_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("powertrain.numerics.compiled.FLAGS", ("-O0", "-fPIC", "-shared", "-ffp-contract=off"))


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
    """A shaft whose inertia is thrown by a stiff spring: the explicit method is given up during the run."""

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
    assert [(e.time, e.name, e.old, e.new) for e in found.events] == [
        (e.time, e.name, e.old, e.new) for e in wanted.events
    ]
    np.testing.assert_array_equal(found.to_dataframe().to_numpy(), wanted.to_dataframe().to_numpy())
    return found


CASES: dict[str, tuple[Callable[[], pt.Component], float, dict[str, Any]]] = {
    "clutches": (CoupledClutches, 1.5, {}),
    "implicit method": (CoupledClutches, 1.5, {"method": "rodas5p", "rtol": 1e-4}),
    "bounded steps": (CoupledClutches, 1.5, {"max_step": 0.01}),
    "resets and instants": (Relay, 8.0, {}),
    "impacts": (Ball, 3.0, {}),
    "freewheel": (Overrunning, 2.0, {}),
    "becomes stiff": (Stiffening, 3.0, {}),
    "prescribed": (Shaken, 1.0, {}),
}


@pytest.mark.parametrize("case", CASES)
def test_small_models(case: str) -> None:
    found = compared(CASES[case][0](), *CASES[case][1:])
    assert not isinstance(found, str)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 260))
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


def test_progress_and_long_records(monkeypatch: pytest.MonkeyPatch) -> None:
    """The records in C are emptied many times."""
    for name, size in {"_ROWS": 7, "_HELD": 5, "_INSTANTS": 3}.items():
        monkeypatch.setattr(f"powertrain.engine.in_c.{name}", size)
    compared(CoupledClutches(), 1.5, {})
