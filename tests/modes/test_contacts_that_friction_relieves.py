"""Contacts between parts that friction holds at rest: they open where they would pull, and friction carries the load."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import translational as tr
from powertrain.components.blocks import TimeTable


class Touching(pt.Component):
    """Two masses that touch and rub on each other, moving together, with a force on each."""

    m1: pt.Parameter = pt.parameter("kg", "Mass behind", default=1.0)
    m2: pt.Parameter = pt.parameter("kg", "Mass in front", default=2.0)
    F1: pt.Parameter = pt.parameter("N", "Force on the mass behind", default=-0.5)
    F2: pt.Parameter = pt.parameter("N", "Force on the mass in front", default=0.7)
    x1: pt.Variable = pt.variable("m", "Place of the mass behind", start=0.0, prefer=True)
    x2: pt.Variable = pt.variable("m", "Place of the mass in front", start=0.0, prefer=True)
    v1: pt.Variable = pt.variable("m/s", "Speed of the mass behind", start=-1.0, prefer=True)
    v2: pt.Variable = pt.variable("m/s", "Speed of the mass in front", start=-1.0, prefer=True)
    f: pt.Variable = pt.variable("N", "Force of the contact")
    rubbing: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x1) == self.v1
        yield pt.der(self.x2) == self.v2
        yield self.m1 * pt.der(self.v1) == self.F1 - self.f - self.rubbing
        yield self.m2 * pt.der(self.v2) == self.F2 + self.f + self.rubbing
        yield pt.unilateral(self.x2 - self.x1, self.f, name="gap")
        yield pt.friction(self.v1 - self.v2, self.rubbing, -3.0, 3.0, name="rubs")


TOUCHING = pt.compile(Touching())


@pytest.mark.parametrize("seed", range(40))
def test_masses_that_touch_and_stick_move_as_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    masses, forces = 10.0 ** random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0, 2)
    parameters: dict[str, float] = dict(zip(("m1", "m2", "F1", "F2"), map(float, (*masses, *forces)), strict=True))
    result = TOUCHING.simulate(1.0, parameters=parameters)
    assert np.abs(result["x2"] - result["x1"]).max() < 1e-9
    assert result["v1"][-1] == pytest.approx(-1.0 + forces.sum() / masses.sum(), rel=1e-6)
    assert result["f"].min() > -1e-6


class Bench(pt.Component):
    """A mass between stops on a rough floor that a force pushes to one stop, and then away from it, less than friction holds."""

    push: TimeTable = TimeTable(table=((0.0, -10.0), (1.0, -10.0), (2.0, 1.0)))
    force: tr.Force = tr.Force()
    mass: tr.MassWithStopAndFriction = tr.MassWithStopAndFriction(
        m=1.0, F_prop=0.0, F_Coulomb=2.0, F_Stribeck=0.0, fexp=1.0, smin=-0.1, smax=0.1, L=0.0, restitution=0.3
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.push.y, self.force.f)
        yield pt.connect(self.force.flange, self.mass.flange_a)


BENCH = pt.compile(Bench())


@pytest.mark.parametrize("seed", range(30))
def test_a_mass_that_bounced_to_rest_is_released(seed: int) -> None:
    random = np.random.default_rng(seed)
    parameters = {
        "mass.restitution": float(random.choice([0.0, 0.1, 0.3, 0.5, 0.7])),
        "mass.m": float(random.uniform(0.5, 3.0)),
        "mass.F_Coulomb": float(random.uniform(1.5, 4.0)),
    }
    result = BENCH.simulate(3.0, parameters=parameters, starts={"mass.s": float(random.uniform(-0.09, 0.09))})
    assert result["mass.s"][-1] == pytest.approx(-0.1, abs=1e-8)
    assert result["mass.v"][-1] == pytest.approx(0.0, abs=1e-9)
