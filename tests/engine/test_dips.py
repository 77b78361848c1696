"""Torques that reverse for an instant: a crank that is pedalled behind a freewheel lets go twice in a turn, for some milliseconds."""

from __future__ import annotations

import shutil
from typing import Any

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import Brake, Freewheel, Inertia, QuadraticSpeedDependentTorque, Torque


class Pedalled(pt.Component):
    """The torque of the rider is tau sin^2 of the crank's angle; where it vanishes, its drag slows the crank more than air the wheel."""

    tau: pt.Parameter = pt.parameter("N.m", "Amplitude of the rider's torque", default=120.0)
    drag: pt.Parameter = pt.parameter("N.m", "Drag of the crank", default=1.0)
    rider: Torque = Torque()
    crank: Inertia = Inertia(J=0.02)
    freewheel: Freewheel = Freewheel()
    wheel: Inertia = Inertia(J=4.0)
    air: QuadraticSpeedDependentTorque = QuadraticSpeedDependentTorque(tau_nominal=-20.0, w_nominal=10.0)

    def equations(self) -> pt.Equations:
        yield self.rider.tau.value == self.tau * ca.sin(self.crank.phi) ** 2 - self.drag
        yield pt.connect(self.rider.flange, self.crank.flange_a)
        yield pt.connect(self.crank.flange_b, self.freewheel.flange_a)
        yield pt.connect(self.freewheel.flange_b, self.wheel.flange_a)
        yield pt.connect(self.wheel.flange_b, self.air.flange)


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Pedalled]:
    return pt.compile(Pedalled())


def drawn(seed: int) -> dict[str, Any]:
    """Random parameters, and starts on the move."""
    rng = np.random.default_rng(seed)
    inertia = 10.0 ** rng.uniform(-3.0, -2.0)
    parameters = {
        "tau": rng.uniform(50.0, 200.0),
        "crank.J": inertia,
        "drag": 30.0 * inertia + rng.uniform(0.02, 0.1),
        "wheel.J": 10.0 ** rng.uniform(0.3, 1.3),
        "air.tau_nominal": -rng.uniform(5.0, 40.0),
    }
    return {"parameters": parameters, "starts": {"crank.phi": 0.3, "wheel.w": 3.0}}


@pytest.mark.parametrize("seed", range(12))
def test_every_reversal_is_an_event(plant: pt.Plant[Pedalled], seed: int) -> None:
    """The same events with a tenth of the tolerance and steps that are short beside every dip."""
    found, fine = (
        plant.simulate(20.0, **drawn(seed), rtol=rtol, max_step=step) for rtol, step in ((1e-5, np.inf), (1e-6, 0.003))
    )
    assert len(fine.events) > 20
    assert [(e.name, e.new) for e in found.events] == [(e.name, e.new) for e in fine.events]
    np.testing.assert_allclose([e.time for e in found.events], [e.time for e in fine.events], atol=1e-3)


@pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler on this machine")
def test_steps_in_parts_in_c_see_them_as_well(plant: pt.Plant[Pedalled], monkeypatch: pytest.MonkeyPatch) -> None:
    """A reversal at the start of a step counts by the indicators of the side from which the step is taken."""
    monkeypatch.setattr("powertrain.engine.prepared._LONG", 0)
    plain, compiled = (plant.simulate(20.0, **drawn(1), rtol=1e-5, compile=in_c) for in_c in (False, True))
    assert [(e.name, e.new) for e in compiled.events] == [(e.name, e.new) for e in plain.events]
    assert compiled.statistics["steps"] == plain.statistics["steps"]


class Held(pt.Component):
    """A brake holds a rotor against a torque that depends on the angle of a wheel that nothing slows: no state tells of the torque."""

    tau: pt.Parameter = pt.parameter("N.m", "Largest torque", default=50.0)
    kind: int = 0
    wheel: Inertia = Inertia(J=1.0)
    torque: Torque = Torque()
    rotor: Inertia = Inertia(J=0.01)
    brake: Brake = Brake(fn_max=100.0)  # holds 50 N.m
    on: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        x = self.wheel.phi
        shapes = ca.sin(x) ** 2, ca.sin(x) ** 4, ca.sin(3 * x) * ca.sin(x), 0.7 * ca.sin(x) + 0.3 * ca.sin(2.3 * x)
        yield self.torque.tau.value == self.tau * shapes[self.kind]
        yield pt.connect(self.torque.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.brake.flange_a)
        yield pt.connect(self.on.y, self.brake.f_normalized)


@pytest.mark.parametrize("kind", range(4))
def test_a_brake_gives_way_at_every_peak(kind: int) -> None:
    plant, rng = pt.compile(Held(kind=kind)), np.random.default_rng(kind)
    for excess in (1e-5, 1e-4, 1e-3, 1e-2):
        speed = rng.uniform(1.0, 50.0)
        starts = {"wheel.w": speed, "wheel.phi": rng.uniform(0.0, 6.0)}
        found, fine = (
            plant.simulate(
                60.0 / speed, parameters={"tau": 50.0 * (1 + excess)}, starts=starts, rtol=rtol, max_step=step
            )
            for rtol, step in ((1e-6, np.inf), (1e-7, 0.01 / speed))
        )
        assert [(e.name, e.new) for e in found.events] == [(e.name, e.new) for e in fine.events]
    assert kind == 3 or len(fine.events) > 20
