"""Massless friction behind nonlinear dampers: the speed of a law follows its torque through an equation that nobody can solve for it.

The answers are those of a monotone inclusion, g(w) + F Sgn(w) = u, found by bisection. It has one solution, so no mode is guessed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import powertrain as pt

SHAPES: tuple[Callable[[Any], Any], ...] = (lambda w: w**3, ca.sinh, lambda w: w * ca.fabs(w), ca.atan)


class Damped(pt.Component):
    """Two massless sliders, each with friction and a nonlinear damper, and a damper between them; u1 and u2 pull."""

    shapes: tuple[Callable[[Any], Any], ...]
    c: tuple[float, ...]
    between: float
    F: tuple[float, ...]
    u1: pt.Input = pt.signal_input("N.m", "Pull on slider 1")
    u2: pt.Input = pt.signal_input("N.m", "Pull on slider 2")
    w1: pt.Variable = pt.variable("rad/s", "Speed 1")
    w2: pt.Variable = pt.variable("rad/s", "Speed 2")
    tau1: pt.Variable = pt.variable("N.m", "Friction 1")
    tau2: pt.Variable = pt.variable("N.m", "Friction 2")

    def equations(self) -> pt.Equations:
        d1, d2 = (self.c[k] * w + self.shapes[k](w) for k, w in enumerate((self.w1, self.w2)))
        d12 = self.between * (self.w1 - self.w2) ** 3 + self.between * (self.w1 - self.w2)
        yield d1 + d12 == self.u1.value - self.tau1
        yield d2 - d12 == self.u2.value - self.tau2
        yield pt.friction(self.w1, self.tau1, -self.F[0], self.F[0])
        yield pt.friction(self.w2, self.tau2, -self.F[1], self.F[1])


def inclusion(g: Callable[[float], float], F: float) -> float:
    """The w with 0 in g(w) + F Sgn(w), for an increasing g."""
    pull = -g(0.0)
    return 0.0 if abs(pull) <= F else float(brentq(lambda w: g(w) + np.sign(pull) * F, -50.0, 50.0, xtol=1e-13))


def speeds(model: Damped, u1: float, u2: float) -> tuple[float, float]:
    """Both speeds: that of slider 2 for a given one of slider 1 leaves an increasing equation for slider 1."""

    def force(k: int, w: float) -> float:
        return model.c[k] * w + float(model.shapes[k](w))

    def between(w1: float, w2: float) -> float:
        return model.between * ((w1 - w2) ** 3 + w1 - w2)

    def second(w1: float) -> float:
        return inclusion(lambda w2: force(1, w2) - between(w1, w2) - u2, model.F[1])

    w1 = inclusion(lambda w: force(0, w) + between(w, second(w)) - u1, model.F[0])
    return w1, second(w1)


def damped(seed: int) -> Damped:
    """Odd seeds: two sliders that do not know of each other."""
    rng = np.random.default_rng(seed)
    shapes = tuple(SHAPES[k] for k in rng.integers(len(SHAPES), size=2))
    c, F = rng.uniform(0.2, 2.0, 2), rng.uniform(0.3, 2.0, 2)
    return Damped(shapes=shapes, c=tuple(c), between=0.0 if seed % 2 else float(rng.uniform(0.1, 2.0)), F=tuple(F))


NAMES = ["w1", "w2"]


@pytest.mark.parametrize("seed", range(8))
def test_two_sliders_behind_nonlinear_dampers(seed: int) -> None:
    """Two pulls that go up and down: the speeds at 60 instants, each slider at rest in some and sliding in others."""
    model, rng = damped(seed), np.random.default_rng(100 + seed)
    corners = np.linspace(0.0, 6.0, 7)
    u1, u2 = rng.uniform(-5.0, 5.0, (2, 7))
    result = pt.compile(model).simulate(6.0, inputs={"u1": (corners, u1), "u2": (corners, u2)})
    t = np.linspace(0.0, 6.0, 60)
    expected = [speeds(model, np.interp(s, corners, u1), np.interp(s, corners, u2)) for s in t]
    for name, right in zip(NAMES, np.transpose(expected), strict=True):
        np.testing.assert_allclose(result.at(t, name), right, atol=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_operating_points_of_two_sliders(seed: int) -> None:
    """Maps of the same over both pulls."""
    model, pulls = damped(seed), np.linspace(-4.0, 4.1, 8)
    found = pt.steady(pt.compile(model), {"u1": pulls, "u2": pulls}, outputs=NAMES)
    expected = np.array([[speeds(model, a, b) for b in pulls] for a in pulls])
    for k, name in enumerate(NAMES):
        np.testing.assert_allclose(found[name].transpose("u1", "u2"), expected[:, :, k], atol=1e-8)


class LossyGear(pt.Component):
    """A brake before a gear whose loss grows with the square of the torque, and an inertia of 1 kg.m2 behind it."""

    w: pt.Variable = pt.variable("rad/s", "Speed")
    behind: pt.Variable = pt.variable("N.m", "Torque behind the gear")
    tau: pt.Variable = pt.variable("N.m", "Torque of the brake")

    def equations(self) -> pt.Equations:
        yield pt.der(self.w) == self.behind
        yield self.behind + self.behind * ca.fabs(self.behind) == pt.time - self.tau
        yield pt.friction(self.w, self.tau, -1.0, 1.0)

    def initial(self) -> pt.Equations:
        yield self.w == 0


def test_a_brake_before_a_gear_that_loses_with_the_square_of_its_torque() -> None:
    """At rest until the torque of t reaches 1 N.m; then a + a^2 = t - 1."""
    result = pt.simulate(LossyGear(), stop=4.0)
    expected = [quad(lambda s: np.sqrt(0.25 + s) - 0.5, 0.0, max(0.0, t - 1.0))[0] for t in (0.5, 2.0, 3.0, 4.0)]
    np.testing.assert_allclose(result.at([0.5, 2.0, 3.0, 4.0], "w"), expected, atol=1e-6)


class Node(pt.Component):
    """A massless slider, with friction unless F is 0."""

    F: float
    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Friction")

    def equations(self) -> pt.Equations:
        yield pt.friction(self.w, self.tau, -self.F, self.F) if self.F else self.tau == 0


class Chain(pt.Component):
    """Five sliders, nonlinear dampers to the ground and between neighbours."""

    nodes: tuple[Node, ...]

    def equations(self) -> pt.Equations:
        w = [node.w for node in self.nodes]
        for k, node in enumerate(self.nodes):
            yield damping(w, k) == 5 * ca.sin(pt.time + k) - node.tau


def damping(w: Sequence[Any], k: int) -> Any:
    slips = [w[k] - w[j] for j in (k - 1, k + 1) if 0 <= j < len(w)]
    return w[k] + 0.3 * w[k] ** 3 + sum(d + 0.3 * d**3 for d in slips)


@pytest.mark.parametrize("F", [(1.0, 0.0, 2.0, 0.0, 0.5), (1.0, 1.5, 1.0, 1.5, 1.0)])
def test_a_chain_of_sliders_obeys_coulomb(F: tuple[float, ...]) -> None:
    """What dampers and pulls leave is F Sgn(w); only one motion does this, as the dampers are strictly monotone."""
    nodes = tuple(Node(F=force) for force in F)
    result = pt.simulate(Chain(nodes=nodes), stop=6.0)
    t = np.linspace(0.05, 5.95, 60)
    w = [result.at(t, f"nodes[{k}].w") for k in range(5)]
    rests = 0
    for k, force in enumerate(F):
        left = 5 * np.sin(t + k) - damping(w, k)
        rest = np.abs(w[k]) < 1e-7
        rests += rest.sum()
        np.testing.assert_allclose(left[~rest], force * np.sign(w[k][~rest]), atol=1e-6)
        assert np.all(np.abs(left[rest]) <= force + 1e-6)
    assert rests > 20


class Given(pt.Component):
    """A speed that time alone gives, w + w^3 = sin t, and friction on it."""

    w: pt.Variable = pt.variable("rad/s", "Speed")
    tau: pt.Variable = pt.variable("N.m", "Friction")
    source: pt.Variable = pt.variable("N.m", "Torque of the source")

    def equations(self) -> pt.Equations:
        yield self.w + self.w**3 == ca.sin(pt.time)
        yield self.source + self.source**3 == self.tau
        yield pt.friction(self.w, self.tau, -1.0, 1.0)


def test_a_speed_that_time_gives_stays_prescribed() -> None:
    """An implicit unknown that the torque does not move leaves the law as it is, beside one that it moves."""
    (law,) = pt.compile(Given()).compiled.dae.frictions
    assert law.prescribed
