"""Models with algebraic unknowns that are explicit in most modes."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Sine
from powertrain.components.rotational import Brake, Inertia, SpringDamper, Torque
from powertrain.engine import special


class Braked(pt.Component):
    """A brake on a shaft that swings, and a speed y that is a root of a cubic in one mode only."""

    c: pt.Parameter = pt.parameter("N.m/rad", "Stiffness of the shaft", default=100.0, above=0)
    drive: Sine = Sine(amplitude=30, f=0.7)
    torque: Torque = Torque()
    first: Inertia = Inertia(J=0.2)
    shaft: SpringDamper = SpringDamper(c=100, d=0.5)
    second: Inertia = Inertia(J=0.3)
    brake: Brake = Brake(fn_max=20)
    press: Sine = Sine(amplitude=0.4, f=0.4, offset=0.5)
    y: pt.Variable = pt.variable("rad/s", "A root")

    def equations(self) -> pt.Equations:
        yield self.shaft.c == self.c
        yield pt.connect(self.drive.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.brake.flange_a)
        yield pt.connect(self.press.y, self.brake.f_normalized)
        slow = pt.switch(self.first.w > 2, self.y - self.first.w, self.y**3 + self.y - self.first.w)
        yield slow == 0


@pytest.mark.parametrize("c", [100.0, 1e9])
def test_explicit_where_modes_make_it_so_and_stable(c: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where y is linear the explicit method serves, but not on a stiff shaft; the results agree with the implicit method's."""
    implicit = pt.compile(Braked(c=c)).simulate(20, method="rodas5p", points=200, rtol=1e-8)
    assert implicit.compiled.dae.z.numel() == 1
    monkeypatch.setattr(special, "OFTEN", 5)
    plant = pt.compile(Braked(c=c))
    both = plant.simulate(20, points=200, rtol=1e-8)
    chosen = [explicit for _, explicit in plant._engine("auto", False).special._built.values()]
    assert any(chosen) == (c < 1e6)
    assert not all(chosen)
    assert len(both.events) == len(implicit.events) > 10
    times = np.linspace(0, 20, 101)
    for name in ("second.w", "y"):
        assert np.abs(both.at(times, name) - implicit.at(times, name)).max() < 2e-5
