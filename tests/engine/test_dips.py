"""Torques that reverse for an instant: a crank that is pedalled behind a freewheel lets go twice in a turn, for some milliseconds."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import Freewheel, Inertia, QuadraticSpeedDependentTorque, Torque


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


@pytest.mark.parametrize("seed", range(12))
def test_every_reversal_is_an_event(plant: pt.Plant[Pedalled], seed: int) -> None:
    """The same events with a tenth of the tolerance and steps that are short beside every dip."""
    rng = np.random.default_rng(seed)
    inertia = 10.0 ** rng.uniform(-3.0, -2.0)
    parameters = {
        "tau": rng.uniform(50.0, 200.0),
        "crank.J": inertia,
        "drag": 30.0 * inertia + rng.uniform(0.02, 0.1),
        "wheel.J": 10.0 ** rng.uniform(0.3, 1.3),
        "air.tau_nominal": -rng.uniform(5.0, 40.0),
    }
    found, fine = (
        plant.simulate(20.0, parameters=parameters, starts={"crank.phi": 0.3, "wheel.w": 3.0}, rtol=rtol, max_step=step)
        for rtol, step in ((1e-5, np.inf), (1e-6, 0.003))
    )
    assert len(fine.events) > 20
    assert [(e.name, e.new) for e in found.events] == [(e.name, e.new) for e in fine.events]
    np.testing.assert_allclose([e.time for e in found.events], [e.time for e in fine.events], atol=1e-3)
