"""Impacts of several contacts at once: by hand, and against Moreau's impact law with all sets of contacts that may act."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

import powertrain as pt

Array = NDArray[np.float64]
TOUCHING = 1e-7
"""Gaps (m) below this are closed."""

SLOW = 0.05
"""Bodies that bounce to rest have several impacts at one instant below this speed (m/s)."""


class Row(pt.Component):
    """Three bodies in a row between two walls, with their weight along it; each strikes the next."""

    m1: pt.Parameter = pt.parameter("kg", "mass", default=1.0)
    m2: pt.Parameter = pt.parameter("kg", "mass", default=2.0)
    m3: pt.Parameter = pt.parameter("kg", "mass", default=0.5)
    e1: pt.Parameter = pt.parameter("1", "restitution of the first two", default=0.0)
    e2: pt.Parameter = pt.parameter("1", "restitution of the last two", default=0.0)
    e3: pt.Parameter = pt.parameter("1", "restitution at the walls", default=0.0)
    g: pt.Parameter = pt.parameter("m/s2", "pull to the right", default=0.0)
    x1: pt.Variable = pt.variable("m", "position", start=-0.5)
    x2: pt.Variable = pt.variable("m", "position", start=0.0)
    x3: pt.Variable = pt.variable("m", "position", start=0.0)
    v1: pt.Variable = pt.variable("m/s", "speed", start=1.0)
    v2: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    v3: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    f0: pt.Variable = pt.variable("N", "force of the left wall")
    f1: pt.Variable = pt.variable("N", "force between the first two")
    f2: pt.Variable = pt.variable("N", "force between the last two")
    f3: pt.Variable = pt.variable("N", "force of the right wall")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x1) == self.v1
        yield pt.der(self.x2) == self.v2
        yield pt.der(self.x3) == self.v3
        yield self.m1 * pt.der(self.v1) == self.f0 - self.f1 + self.m1 * self.g
        yield self.m2 * pt.der(self.v2) == self.f1 - self.f2 + self.m2 * self.g
        yield self.m3 * pt.der(self.v3) == self.f2 - self.f3 + self.m3 * self.g
        yield pt.unilateral(self.x1 + 1.0, self.f0, restitution=self.e3, name="left")
        yield pt.unilateral(self.x2 - self.x1, self.f1, restitution=self.e1, name="first")
        yield pt.unilateral(self.x3 - self.x2, self.f2, restitution=self.e2, name="last")
        yield pt.unilateral(1.0 - self.x3, self.f3, restitution=self.e3, name="right")


GAPS = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]])
"""Of the four contacts by the three positions."""


def after_impact(mass: Array, restitution: Array, v: Array, touching: NDArray[np.bool_]) -> Array:
    """The speeds after an impact: the one set of contacts whose impulses press, and which leaves no contact too slow."""
    W, e = GAPS[touching], restitution[touching]
    G, w = W / mass @ W.T, W @ v
    goal = w + np.where(-e * w < 1e-4, 0.0, e) * np.minimum(w, 0.0)
    for acts in map(np.array, product((False, True), repeat=len(w))):
        impulse = np.zeros(len(w))
        if acts.any():
            impulse[acts] = np.linalg.solve(G[np.ix_(acts, acts)], -goal[acts])
        if (impulse >= -1e-12).all() and (goal + G @ impulse >= -1e-12).all():
            return np.asarray(v + impulse @ W / mass, np.float64)
    raise AssertionError("Moreau's law has no solution")


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Row]:
    return pt.compile(Row())


@pytest.mark.parametrize("seed", range(30))
def test_rows_of_bodies(plant: pt.Plant[Row], seed: int) -> None:
    rng = np.random.default_rng(seed)
    mass = 10.0 ** rng.uniform(-1.0, 1.0, 3)
    e1, e2, e3 = rng.choice([0.0, 0.0, 0.3, 0.8, 1.0], 3)
    g = rng.choice([0.0, 1.0])
    parameters = {"m1": mass[0], "m2": mass[1], "m3": mass[2], "e1": e1, "e2": e2, "e3": e3, "g": g}
    starts = {"v1": rng.uniform(0.5, 3.0), "v3": rng.choice([0.0, 1.0]), "x3": rng.choice([0.0, 0.4, 1.0])}
    result = plant.simulate(2.0, parameters=parameters, starts=starts)
    assert plant.compiled.states == ["left.speed", "first.speed", "last.speed", "x1", "x2", "x3"]
    modes = [contact.index for contact in plant.compiled.dae.contacts]
    impacts = [i for i in result.trajectory.instants if any(kind == "impact" for _, kind in i.extra)]
    assert impacts
    for instant in impacts:
        before, after = (np.cumsum(y[:3]) for y in (instant.left, instant.right))
        if np.abs(GAPS @ before).max() < SLOW:
            continue
        gaps = GAPS @ instant.left[3:] + [1.0, 0.0, 0.0, 1.0]
        striking = (gaps < TOUCHING) & (GAPS @ before < 0.0)
        touching = striking | (instant.held_left[modes] > 0.5)
        expected = after_impact(mass, np.array([e3, e1, e2, e3]), before, touching)
        np.testing.assert_allclose(after, expected, atol=1e-7)
    x = np.array([result[name] for name in ("x1", "x2", "x3")])
    assert (GAPS @ x + [[1.0], [0.0], [0.0], [1.0]]).min() > -TOUCHING


def test_a_body_that_presses_on_another_stops_with_it() -> None:
    """Both go on as one until the wall, which stops both; what presses then is the weight of both."""
    result = pt.simulate(pt.replace(Row(), {"g": 1.0}), 5.0)
    assert [result[name][-1] for name in ("x1", "x2", "x3")] == pytest.approx([1.0, 1.0, 1.0], abs=1e-8)
    assert [result[name][-1] for name in ("f1", "f2", "f3")] == pytest.approx([1.0, 3.0, 3.5])


class Thrown(pt.Component):
    """A mass that lies on a floor and is thrown at it by a reset."""

    e: pt.Parameter = pt.parameter("1", "restitution", default=0.0)
    x: pt.Variable = pt.variable("m", "height", start=0.0)
    v: pt.Variable = pt.variable("m/s", "speed", start=0.0)
    f: pt.Variable = pt.variable("N", "force of the floor")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield pt.der(self.v) == self.f - 1.0
        yield pt.unilateral(self.x, self.f, restitution=self.e, name="floor")
        yield pt.when(pt.time > 0.5, pt.reinit(self.v, -2.0))


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_reset_throws_a_mass_at_the_floor_it_lies_on(e: float) -> None:
    result = pt.simulate(pt.replace(Thrown(), {"e": e}), 1.0)
    assert [event.name for event in result.events if event.kind == "impact"] == ["floor"]
    assert result["v"][-1] == pytest.approx(2.0 * e - 0.5 if e else 0.0)
    assert result["x"].min() > -TOUCHING
