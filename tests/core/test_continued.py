"""A run goes on from its own end: every state and every discrete variable is a signal, and may be given as a start."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.rotational import ConstantTorque, IdealGear, Inertia, Spring


class Geared(pt.Component):
    """The speed behind the gear has no name of its own."""

    torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
    first: Inertia = Inertia(J=1.0)
    gear: IdealGear = IdealGear(ratio=3.0)
    spring: Spring = Spring(c=100.0)
    second: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.second.flange_a)

    def initial(self) -> pt.Equations:
        yield self.first.w == 3.0
        yield self.second.w == 0.0


class Counter(pt.Component):
    """Counts the turns of what runs at 10 rad/s, from one turn on."""

    phi: pt.Variable = pt.variable("rad", "Angle", start=0.0)
    turns: pt.Discrete = pt.discrete("1", "Turns")

    def equations(self) -> pt.Equations:
        yield pt.der(self.phi) == 10.0
        yield pt.when(self.phi > 2 * np.pi * (self.turns + 1), pt.reinit(self.turns, self.turns + 1))

    def initial(self) -> pt.Equations:
        yield self.turns == 0.0


def test_every_state_is_a_signal() -> None:
    plant = pt.compile(Geared())
    assert "der(gear.phi_b)" in plant.compiled.states
    run = plant.simulate(1.0)
    assert np.allclose(run["der(gear.phi_b)"], run["first.w"] / 3.0)
    assert run.unit("der(gear.phi_b)") == "rad/s"
    assert set(plant.compiled.states) <= set(run)


@pytest.mark.parametrize("model", [Geared(), Counter()], ids=repr)
def test_a_run_goes_on_from_its_end(model: pt.Component) -> None:
    plant = pt.compile(model)
    names = [*plant.compiled.states, *plant.compiled.discretes]
    whole, half = (plant.simulate(stop, rtol=1e-9) for stop in (2.0, 1.0))
    rest = plant.simulate(2.0, start=1.0, starts={name: float(half[name][-1]) for name in names}, rtol=1e-9)
    for name in names:
        assert rest[name][-1] == pytest.approx(whole[name][-1], abs=1e-7)
    if isinstance(model, Counter):
        assert rest["turns"][-1] == np.floor(20.0 / (2 * np.pi))
