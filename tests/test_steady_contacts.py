"""Steady points with contacts, against their closed forms: stops that carry, and stops beside friction."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import translational as trans
from powertrain.components.translational.stop import BREAKAWAY

OK, SEVERAL = 0, 2


class Between(pt.Component):
    """A mass on a spring between two stops at s = -0.1 and s = 0.2, with the spring relaxed at s = 0."""

    force: pt.Input = pt.signal_input("N", "Force")
    source: trans.Force = trans.Force()
    mass: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        m=2.0, L=0.0, smin=-0.1, smax=0.2, F_prop=0.0, F_Coulomb=0.0, F_Stribeck=0.0, fexp=1.0
    )
    spring: trans.SpringDamper = trans.SpringDamper(c=100.0, d=20.0)
    ground: trans.Fixed = trans.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.force, self.source.f)
        yield pt.connect(self.source.flange, self.mass.flange_a)
        yield pt.connect(self.ground.flange, self.spring.flange_a)
        yield pt.connect(self.mass.flange_b, self.spring.flange_b)


def test_mass_between_stops() -> None:
    """c s = F inside; the stop carries the rest outside."""
    F = np.array([-40.0, -10.5, -9.0, 0.0, 15.0, 19.0, 21.0, 50.0])
    found = pt.steady(Between(), {"force": F}, outputs=["mass.s", "mass.f_min", "mass.f_max"])
    assert (found.status == OK).all(), found.attrs["problems"]
    s = np.clip(F / 100, -0.1, 0.2)
    np.testing.assert_allclose(found["mass.s"], s, atol=1e-12)
    np.testing.assert_allclose(found["mass.f_min"], np.maximum(100 * s - F, 0), atol=1e-9)
    np.testing.assert_allclose(found["mass.f_max"], np.maximum(F - 100 * s, 0), atol=1e-9)


def test_stop_is_where_a_simulation_ends() -> None:
    plant = pt.compile(Between())
    result = plant.simulate(0.5, inputs={"force": 50.0})
    point = pt.steady(plant, {"force": 50.0}, outputs=["mass.s", "mass.f_max"])
    assert result["mass.s"][-1] == pytest.approx(point["mass.s"].item(), abs=1e-9)
    assert result["mass.f_max"][-1] == pytest.approx(point["mass.f_max"].item(), rel=1e-6)


class Pressed(pt.Component):
    """A mass that slides between two stops against friction; nothing else holds it."""

    force: pt.Input = pt.signal_input("N", "Force")
    source: trans.Force = trans.Force()
    mass: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        m=2.0, L=0.0, smin=-0.1, smax=0.2, F_prop=10.0, F_Coulomb=5.0, F_Stribeck=0.0, fexp=1.0
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.force, self.source.f)
        yield pt.connect(self.source.flange, self.mass.flange_a)


@pytest.mark.parametrize("sign", [1, -1])
def test_friction_beside_a_stop_keeps_its_limit(sign: int) -> None:
    """Both hold the mass; friction takes what it can at rest, as where a simulation ends."""
    plant = pt.compile(Pressed())
    names = ["mass.f", "mass.f_max", "mass.f_min", "mass.mode"]
    point = pt.steady(plant, {"force": [sign * 50.0]}, outputs=names)
    result = plant.simulate(5.0, inputs={"force": sign * 50.0})
    assert point["mass.f"].item() == pytest.approx(sign * 5.0 * BREAKAWAY)
    for name in names:
        assert point[name].item() == pytest.approx(result[name][-1], abs=1e-6)


def test_friction_leaves_the_place_open() -> None:
    """Less than friction holds: it rests anywhere, and no value is invented."""
    found = pt.steady(Pressed(), {"force": [3.0]}, outputs=["mass.s"])
    assert found.status.item() == SEVERAL
    assert np.isnan(found["mass.s"].item())
