"""Impacts of several contacts and one-way laws at once: by hand, and against Moreau's impact law with all sets that may act."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components import rotational, translational

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


def after_impact(W: Array, mass: Array, e: Array, v: Array) -> Array:
    """The speeds v after an impact of laws with speeds W v: the set whose impulses press, and which leaves no law too slow."""
    G, w = W / mass @ W.T, W @ v
    goal = w + np.where(-e * w < 1e-4, 0.0, e) * np.minimum(w, 0.0)
    for acts in map(np.array, product((False, True), repeat=len(w))):
        impulse = np.zeros(len(w))
        impulse[acts] = np.linalg.lstsq(G[np.ix_(acts, acts)], -goal[acts])[0]
        after = goal + G @ impulse
        if (impulse >= -1e-12).all() and (after >= -1e-12).all() and (np.abs(after[acts]) <= 1e-12).all():
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
        expected = after_impact(GAPS[touching], mass, np.array([e3, e1, e2, e3])[touching], before)
        np.testing.assert_allclose(after, expected, atol=1e-7)
    x = np.array([result[name] for name in ("x1", "x2", "x3")])
    assert (GAPS @ x + [[1.0], [0.0], [0.0], [1.0]]).min() > -TOUCHING


@pytest.mark.parametrize("speed", [1.0, 1e4, 1e8])
@pytest.mark.parametrize("mass", [0.3, 1.1, 7.7])
def test_bodies_that_do_not_bounce_stay_together_at_any_speed(plant: pt.Plant[Row], speed: float, mass: float) -> None:
    """The first strikes the others, which touch already; round-off of the impulses parts none of them."""
    result = plant.simulate(0.6 / speed, parameters={"m1": mass}, starts={"v1": speed})
    closed = [("first", 1.0), ("last", 1.0)]
    assert [(event.name, event.new) for event in result.events if event.kind == "contact"] == closed
    together = speed * mass / (mass + 2.5)
    assert [result[name][-1] for name in ("v1", "v2", "v3")] == pytest.approx([together] * 3)


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


class Pushed(pt.Component):
    """Two bodies that a third one pushes through one-way laws of opposite signs; a wall before each of the two and one behind the third."""

    m1: pt.Parameter = pt.parameter("kg", "mass", default=1.0)
    m2: pt.Parameter = pt.parameter("kg", "mass of the one that pushes", default=2.0)
    m3: pt.Parameter = pt.parameter("kg", "mass", default=0.5)
    e1: pt.Parameter = pt.parameter("1", "restitution of the first at its wall", default=0.0)
    e2: pt.Parameter = pt.parameter("1", "restitution of the one that pushes at its wall", default=0.0)
    e3: pt.Parameter = pt.parameter("1", "restitution of the last at its wall", default=0.0)
    F: pt.Parameter = pt.parameter("N", "force on the one that pushes", default=0.0)
    x1: pt.Variable = pt.variable("m", "position", start=0.0)
    x2: pt.Variable = pt.variable("m", "position", start=0.0)
    x3: pt.Variable = pt.variable("m", "position", start=0.0)
    v1: pt.Variable = pt.variable("m/s", "speed", start=1.0)
    v2: pt.Variable = pt.variable("m/s", "speed", start=1.0)
    v3: pt.Variable = pt.variable("m/s", "speed", start=1.0)
    f1: pt.Variable = pt.variable("N", "force of the first wall")
    f2: pt.Variable = pt.variable("N", "force of the wall behind")
    f3: pt.Variable = pt.variable("N", "force of the last wall")
    p1: pt.Variable = pt.variable("N", "force that pushes the first")
    p3: pt.Variable = pt.variable("N", "force that pushes the last")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x1) == self.v1
        yield pt.der(self.x2) == self.v2
        yield pt.der(self.x3) == self.v3
        yield self.m1 * pt.der(self.v1) == self.p1 - self.f1
        yield self.m2 * pt.der(self.v2) == self.F - self.p1 - self.p3 + self.f2
        yield self.m3 * pt.der(self.v3) == self.p3 - self.f3
        yield pt.unilateral(1.0 - self.x1, self.f1, restitution=self.e1, name="wall1")
        yield pt.unilateral(1.0 + self.x2, self.f2, restitution=self.e2, name="wall2")
        yield pt.unilateral(1.0 - self.x3, self.f3, restitution=self.e3, name="wall3")
        yield pt.friction(self.v1 - self.v2, -self.p1, -math.inf, 0.0, name="push1")
        yield pt.friction(self.v2 - self.v3, self.p3, 0.0, math.inf, name="push3")


WALLS = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
PUSHES = np.array([[1.0, -1.0, 0.0], [0.0, -1.0, 1.0]])


def after_impacts(mass: Array, e: Array, v: Array, near: NDArray[np.bool_], closed: NDArray[np.bool_]) -> Array:
    """The speeds after all impacts of one instant: walls that are ``near`` or ``closed``, one-way laws at rest or thrown backward."""
    W, e = np.vstack([WALLS, PUSHES]), np.append(e, [0.0, 0.0])
    near, closed = np.append(near, [True, True]), np.append(closed, [False, False])
    for _ in range(100):
        w = W @ v
        acts = closed | (near & (w < -1e-9))
        if not (acts & (w < -1e-9)).any():
            return v
        acts[3:] |= np.abs(w[3:]) < 1e-9
        v = after_impact(W[acts], mass, e[acts], v)
        closed = acts & (W @ v < 1e-9)
        closed[3:] = False
    raise AssertionError("impacts without end")


@pytest.fixture(scope="module")
def pushed() -> pt.Plant[Pushed]:
    return pt.compile(Pushed())


@pytest.mark.parametrize(
    "seed", [*range(30), 7013]
)  # the last one ends between two walls, all at rest but for round-off
def test_bodies_that_push_each_other(pushed: pt.Plant[Pushed], seed: int) -> None:
    rng = np.random.default_rng(seed)
    mass = 10.0 ** rng.uniform(-1.0, 1.0, 3)
    e = rng.choice([0.0, 0.0, 0.5, 1.0], 3)
    v2 = rng.uniform(-2.0, 2.0)
    v1, v3 = v2 + rng.choice([0.0, 1.0], 2) * rng.uniform(0.0, 2.0, 2)
    parameters = {f"m{k + 1}": mass[k] for k in range(3)} | {f"e{k + 1}": e[k] for k in range(3)}
    parameters["F"] = rng.choice([0.0, 3.0, -3.0])
    starts = {"v1": v1, "v2": v2, "v3": v3, "x1": rng.choice([0.0, 0.5])}
    result = pushed.simulate(2.0, parameters=parameters, starts=starts)
    v, x = (np.array([result[f"{name}{k}"] for k in (1, 2, 3)]) for name in "vx")
    for t in {event.time for event in result.events if event.kind == "impact"}:
        first, last = np.flatnonzero(result.time == t)[[0, -1]]
        before, after = v[:, first], v[:, last]
        assert mass @ after**2 <= (mass @ before**2) * (1.0 + 1e-9)
        if np.abs(np.vstack([WALLS, PUSHES]) @ before).max() < SLOW:
            continue
        closed = np.array([result[f"wall{k}"][first] > 0.5 for k in (1, 2, 3)])
        expected = after_impacts(mass, e, before, WALLS @ x[:, first] + 1.0 < 0.0, closed)
        np.testing.assert_allclose(after, expected, atol=1e-7)
    assert (WALLS @ x + 1.0).min() > -TOUCHING
    assert (PUSHES @ v).min() > -1e-7


def impacts(result: pt.Result[Any]) -> list[str]:
    """What was struck, in the order of time."""
    return [event.name for event in result.events if event.kind == "impact"]


@pytest.mark.parametrize(("e", "expected"), [(0.0, 0.0), (0.5, -0.5), (1.0, -1.0)])
def test_a_body_and_what_pushes_it_stop_together(e: float, expected: float) -> None:
    result = pt.simulate(pt.replace(Pushed(), {"e1": e}), 1.5, starts={"x3": -5.0, "v3": 1.5})
    assert impacts(result) == ["wall1", "push1"]
    assert [result["v1"][-1], result["v2"][-1], result["v3"][-1]] == pytest.approx([expected, expected, 1.5])
    assert result["push1"][-1] == 0.0


def test_a_law_that_slides_is_struck_after_the_rebound() -> None:
    """Were it part of the rebound at the wall, both would go back at 1 m/s, with more energy than before."""
    result = pt.simulate(pt.replace(Pushed(), {"e1": 1.0}), 1.5, starts={"v2": 0.5, "x3": -5.0, "v3": 1.5})
    assert impacts(result) == ["wall1", "push1"]
    assert [result["v1"][-1], result["v2"][-1]] == pytest.approx([0.0, 0.0], abs=1e-12)  # (-1 + 2 0.5)/3


class Bench(pt.Component):
    """A motor pushes a mass against a stop, through a freewheel."""

    drive: rotational.ConstantTorque = rotational.ConstantTorque(tau_constant=1.0)
    rotor: rotational.Inertia = rotational.Inertia(J=0.01)
    freewheel: rotational.Freewheel = rotational.Freewheel()
    pinion: rotational.IdealGearR2T = rotational.IdealGearR2T(ratio=10.0)
    mass: translational.MassWithStopAndFriction = translational.MassWithStopAndFriction(
        m=1.0, F_prop=1.0, F_Coulomb=2.0, F_Stribeck=0.0, fexp=1.0, smin=-0.1, smax=0.1, L=0.0
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.rotor.flange_a)
        yield pt.connect(self.rotor.flange_b, self.freewheel.flange_a)
        yield pt.connect(self.freewheel.flange_b, self.pinion.flangeR)
        yield pt.connect(self.pinion.flangeT, self.mass.flange_a)


def test_a_mass_on_a_freewheel_stops_with_the_rotor() -> None:
    result = pt.simulate(Bench(), 2.0)
    assert impacts(result) == ["mass.stop_max", "freewheel.mode"]
    assert [result["mass.v"][-1], result["rotor.w"][-1]] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert result["freewheel.tau"][-1] == pytest.approx(-1.0)
    assert result["freewheel.mode"][-1] == 0.0
    assert pt.energy_audit(result).closure < 1e-6


class Kicked(pt.Component):
    """Two inertias on a freewheel; a reset throws the first one back against it."""

    J1: pt.Parameter = pt.parameter("kg.m2", "inertia", default=1.0)
    J2: pt.Parameter = pt.parameter("kg.m2", "inertia", default=2.0)
    w1: pt.Variable = pt.variable("rad/s", "speed", start=1.0)
    w2: pt.Variable = pt.variable("rad/s", "speed", start=1.0)
    tau: pt.Variable = pt.variable("N.m", "torque of the freewheel")

    def equations(self) -> pt.Equations:
        yield self.J1 * pt.der(self.w1) == -self.tau
        yield self.J2 * pt.der(self.w2) == self.tau
        yield pt.friction(self.w1 - self.w2, self.tau, -math.inf, 0.0, name="freewheel")
        yield pt.when(pt.time > 0.5, pt.reinit(self.w1, -3.0))


def test_a_reset_throws_an_inertia_against_its_freewheel() -> None:
    """What follows is the plastic impact of both: w = (J2 - 3 J1)/(J1 + J2)."""
    result = pt.simulate(Kicked(), 1.0)
    assert impacts(result) == ["freewheel"]
    assert [result["w1"][-1], result["w2"][-1]] == pytest.approx([-1.0 / 3.0, -1.0 / 3.0])
    slopes = pt.gradient(result, "w2", ["J1", "J2"])
    assert [slopes["J1"], slopes["J2"]] == pytest.approx([-8.0 / 9.0, 4.0 / 9.0])


@pytest.mark.parametrize(
    ("starts", "name"), [({"x1": -1.02}, "left"), ({"x1": 0.5, "x2": 0.48}, "first"), ({"x3": -0.02}, "last")]
)
@pytest.mark.parametrize("toward", [-1.0, 0.0, 1.0])
def test_a_start_with_an_overlap_is_rejected(
    plant: pt.Plant[Row], starts: dict[str, float], name: str, toward: float
) -> None:
    with pytest.raises(pt.InitializationError, match=rf"sides of {name} .* overlap: the gap is -0\.02,"):
        plant.simulate(1.0, starts={**starts, "v1": toward, "v3": -toward})


def test_runs_continue_from_the_end_of_others(plant: pt.Plant[Row]) -> None:
    """Every instant of a run with its contacts open and closed may be the start of another."""
    parameters = {"e1": 0.3, "e2": 0.0, "e3": 0.5, "g": 1.0}
    whole = plant.simulate(4.0, parameters=parameters, rtol=1e-3)
    names = ("x1", "x2", "x3", "v1", "v2", "v3")
    for t in np.linspace(0.1, 3.9, 20):
        k = int(np.searchsorted(whole.time, t))
        starts = {name: float(whole[name][k]) for name in names}
        rest = plant.simulate(4.0, parameters=parameters, starts=starts, start=float(whole.time[k]))
        assert rest["x1"][-1] == pytest.approx(whole["x1"][-1], abs=1e-3)


def test_impulses_that_are_not_found_are_an_error_with_the_names_of_what_is_struck(
    plant: pt.Plant[Row], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if round-off had made Lemke's method cycle."""
    monkeypatch.setattr("powertrain.modes.lemke._MOST", 0)
    with pytest.raises(
        pt.SimulationError, match=r"no impulses were found.* first \(.*Put a compliance between some"
    ) as error:
        plant.simulate(2.0)
    assert "right" not in str(error.value)
