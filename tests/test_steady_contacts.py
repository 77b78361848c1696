"""Steady points with contacts, against their closed forms: stops that carry, and stops beside friction."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import translational as trans
from powertrain.components.translational.stop import BREAKAWAY

OK, SEVERAL, NONE = 0, 2, 3


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


class SoftPress(pt.Component):
    """A mass pressed against a wall whose force enters by its square as well; a slider rubs on the wall with half of that force."""

    push: pt.Input = pt.signal_input("N", "Force towards the wall")
    pull: pt.Input = pt.signal_input("N", "Force along the wall")
    gap: pt.Variable = pt.variable("m", "Distance from the wall", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed away from the wall")
    s: pt.Variable = pt.variable("m", "Position along the wall")
    w: pt.Variable = pt.variable("m/s", "Speed along the wall")
    N: pt.Variable = pt.variable("N", "Force of the wall")
    F: pt.Variable = pt.variable("N", "Friction")

    def equations(self) -> pt.Equations:
        yield self.v == pt.der(self.gap)
        yield self.w == pt.der(self.s)
        yield pt.unilateral(self.gap, self.N)
        yield pt.friction(self.w, self.F, -self.N / 2, self.N / 2)
        yield 2.0 * pt.der(self.v) == self.N + 0.1 * self.N**2 - self.push.value - 5.0 * self.v
        yield 3.0 * pt.der(self.w) == self.pull.value - self.F - 4.0 * self.w


def test_force_of_a_contact_that_is_an_implicit_unknown() -> None:
    """N + N^2/10 = push; the slider stays up to N/2, and moves at (pull - N/2)/4 beyond."""
    push, pull = np.array([10.0, 20.0]), np.array([1.0, 3.0, 20.0])
    found = pt.steady(SoftPress(), {"push": push, "pull": pull}, outputs=["N", "F", "w"])
    assert (found.status == OK).all(), found.attrs["problems"]
    N = np.broadcast_to(5 * (np.sqrt(1 + 0.4 * push) - 1)[:, None], (2, 3))
    np.testing.assert_allclose(found["N"], N, rtol=1e-9)
    np.testing.assert_allclose(found["F"], np.minimum(pull, N / 2), rtol=1e-9)
    np.testing.assert_allclose(found["w"], np.maximum(pull - N / 2, 0) / 4, rtol=1e-9, atol=1e-12)


class Placed(pt.Component):
    """A mass between stops at s = -0.1 and s = 0.2 at a given place: no unknown moves it onto a stop."""

    place: pt.Input = pt.signal_input("m", "Place of the mass")
    position: trans.Position = trans.Position(exact=True)
    mass: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        m=2.0, L=0.0, smin=-0.1, smax=0.2, F_prop=0.0, F_Coulomb=0.0, F_Stribeck=0.0, fexp=1.0
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.place, self.position.s_ref)
        yield pt.connect(self.position.flange, self.mass.flange_a)


def test_no_stop_carries_at_a_given_place_beyond_it() -> None:
    found = pt.steady(Placed(), {"place": [-0.11, -0.1, 0.0, 0.2, 0.21]}, outputs=["mass.f_min", "mass.f_max"])
    assert found.status.values.tolist() == [NONE, OK, OK, OK, NONE]
    np.testing.assert_array_equal(found["mass.f_max"][1:4], 0.0)
