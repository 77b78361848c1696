"""Laws that switch at one instant and act on each other, against exact runs in every order."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray
from runs_by_formula import TIGHT

import powertrain as pt


class Bank(pt.Component):
    """A level that each limit it passes slows down by k, 2 k, ...; the first and the last together by ``coupling`` more."""

    count: int = 2
    k: float = 1e-3
    coupling: float = 0.0
    l1: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    l2: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    l3: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    l4: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    l5: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        limits = [self.l1, self.l2, self.l3, self.l4, self.l5][: self.count]
        above = [pt.switch(self.x > limit, 1.0, 0.0) for limit in limits]
        slower: Any = sum(self.k * (i + 1) * a for i, a in enumerate(above))
        yield pt.der(self.x) == 1.0 - slower - self.coupling * above[0] * above[-1]


def in_order(bank: Bank, order: tuple[int, ...], moved: NDArray[np.float64]) -> float:
    """The level at t = 2 if its limits, a little apart in this order, are moved."""
    limits = 1.0 + moved
    limits[list(order)] += 1e-3 * np.arange(len(order))
    t, x, rate = 0.0, 0.0, 1.0
    for n, i in enumerate(order):
        t, x = t + (limits[i] - x) / rate, float(limits[i])
        passed = {*order[: n + 1]}
        rate = 1.0 - bank.k * sum(j + 1 for j in passed) - bank.coupling * ({0, len(order) - 1} <= passed)
    return x + rate * (2.0 - t)


def slopes(bank: Bank) -> NDArray[np.float64]:
    """The derivatives with respect to all limits, one row for each order; within one, the level is linear in them."""
    each = np.eye(bank.count) * 1e-4
    orders = permutations(range(bank.count))
    return np.array([[(in_order(bank, o, d) - in_order(bank, o, -d)) / 2e-4 for d in each] for o in orders])


@pytest.mark.parametrize(("count", "coupling"), [(2, 1e-5), (3, 1e-5), (5, 0.0), (5, 1e-5)])
def test_the_mean_over_all_orders(count: int, coupling: float) -> None:
    """And the deviation of the farthest order, for more than four laws of one that is about as far."""
    bank = Bank(count=count, coupling=coupling)
    exact = slopes(bank)
    mean = exact.mean(axis=0)
    apart = np.abs(exact - mean)
    found = pt.gradient(pt.simulate(bank, 2.0, rtol=1e-11), "x", [f"l{i + 1}" for i in range(count)])
    np.testing.assert_allclose(found.array, mean, atol=1e-7)
    assert found.spread.max() == pytest.approx(apart.max(), rel=0.02)
    assert np.abs(apart - found.spread).max(axis=1).min() < 0.3 * apart.max()


@pytest.mark.parametrize("count", [4, 5])
def test_orders_that_differ_are_refused(count: int) -> None:
    """The laws only slow each other down, which moves the later ones by tens of percent."""
    bank = Bank(count=count, k=0.02)
    assert (np.ptp(slopes(bank), axis=0) > 0.2 * slopes(bank).mean(axis=0)).all()
    with pytest.raises(pt.SimulationError, match="switch together and act on each other"):
        pt.gradient(pt.simulate(bank, 2.0, rtol=1e-11), "x", [f"l{i + 1}" for i in range(count)])


class Stopping(pt.Component):
    """A level that all but stops at its first limit, so that it does not reach the second one if that is higher; there it speeds up."""

    first: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    second: pt.Parameter = pt.parameter("1", "Limit", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    clock: pt.Variable = pt.variable("s", "Time", start=0.0)

    def equations(self) -> pt.Equations:
        stopped = (1.0 - 1e-8) * pt.switch(self.x > self.first, 1.0, 0.0)
        yield pt.der(self.x) == 1.0 - stopped + pt.switch(self.x > self.second, 0.2, 0.0)
        yield pt.der(self.clock) == 1.0


def test_a_law_that_another_one_stops() -> None:
    """With the second limit a little higher the run is another one. Either limit counts with half of the change of the rate, 0.8."""
    run = pt.simulate(Stopping(), 2.0, rtol=1e-11)
    found = pt.gradient(run, pt.final("x") + 1e5 * pt.final("clock"), ["first", "second"])
    np.testing.assert_allclose(found.array, [0.4, 0.4], rtol=1e-6)
    np.testing.assert_allclose(found.spread, [0.4, 0.4], rtol=1e-6)


class Pushed(pt.Component):
    """Two pushes that together overcome a friction."""

    x1: pt.Parameter = pt.parameter("1", "Limit for one push", default=1.0)
    x2: pt.Parameter = pt.parameter("1", "Limit for the other push", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=0.0)
    f: pt.Variable = pt.variable("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        pushes = [pt.switch(self.x > limit, 0.6, 0.0) for limit in (self.x1, self.x2)]
        yield pt.der(self.w) == pushes[0] + pushes[1] - self.f
        yield pt.friction(self.w, self.f, -1.0, 1.0)


def test_a_law_that_follows() -> None:
    """w = 0.2 (t - max(x1, x2))."""
    run = pt.simulate(Pushed(), 2.0, rtol=1e-11)
    found = pt.gradient(run, pt.final("x") + 1e-5 * pt.final("w"), ["x1", "x2"])
    np.testing.assert_allclose(found.array, [-1e-6, -1e-6], rtol=1e-6)
    np.testing.assert_allclose(found.spread, [1e-6, 1e-6], rtol=1e-6)


class Resetting(pt.Component):
    """x counts once when it reaches 1, y is halved and set back when it reaches 1, at the same time. Then y rises faster."""

    a: pt.Parameter = pt.parameter("1/s", "Rate of x", default=1.0)
    b: pt.Parameter = pt.parameter("1/s", "Rate of y", default=1.0)
    c: pt.Parameter = pt.parameter("1", "Coupling", default=1e-5)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)
    s: pt.Variable = pt.variable("s", "Sum", start=0.0)
    k: pt.Discrete = pt.discrete("1", "Count", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.a
        yield pt.der(self.y) == self.b + self.c * self.k
        yield pt.der(self.s) == 1.0 + self.c * self.k * self.y
        yield pt.when(self.x > 1, pt.reinit(self.k, self.k + 1))
        yield pt.when(self.y > 1, pt.reinit(self.y, 0.5 * self.y - 3 * pt.time))


def last_of(a: float, b: float, c: float) -> NDArray[np.float64]:
    """y and s at t = 2: from event to event y is linear and s quadratic."""
    t, x, y, s, k, below = 0.0, 0.0, 0.0, 0.0, 0, True
    while t < 2.0:
        rate = b + c * k
        until = [2.0 - t, (1 - x) / a if not k else np.inf, (1 - y) / rate if below else np.inf]
        d, event = min(until), int(np.argmin(until))
        t, x, y, s = t + d, x + a * d, y + rate * d, s + d + c * k * (y * d + rate * d**2 / 2)
        if event == 1:
            k = 1
        elif event == 2:
            y, below = 0.5 * y - 3 * t, False
    return np.array([y, s])


def test_resets_in_either_order() -> None:
    """What one reset leaves counts until the other law switches, and each reset moves with its own law."""
    run, exact = pt.simulate(Resetting(), 2.0, rtol=1e-11), last_of(1.0, 1.0, 1e-5)
    sides = []
    for h in 1e-5, -1e-5:
        near, far = ([last_of(1 + n * h * i, 1 + n * h * (not i), 1e-5) for i in (True, False)] for n in (1, 2))
        sides.append([(4 * one - two - 3 * exact) / (2 * h) for one, two in zip(near, far, strict=True)])
    for name, value, slopes in zip("ys", exact, np.array(sides).transpose(2, 0, 1), strict=True):
        found = pt.gradient(run, name, ["a", "b"])
        assert found.value == pytest.approx(value, rel=1e-9)
        np.testing.assert_allclose(found.array, slopes.mean(axis=0), atol=1e-8, rtol=1e-5)
        np.testing.assert_allclose(found.spread, np.ptp(slopes, axis=0) / 2, atol=1e-8)
    with pytest.raises(pt.SimulationError, match="switch together and act on each other"):
        pt.gradient(pt.simulate(Resetting(c=1.0), 2.0, rtol=1e-11), "s", ["a", "b"])


class Balls(pt.Component):
    """Two balls that hit the ground together."""

    e0: pt.Parameter = pt.parameter("1", "Restitution", default=0.8)
    e1: pt.Parameter = pt.parameter("1", "Restitution", default=0.7)
    h0: pt.Variable = pt.variable("m", "Height", start=1.0)
    h1: pt.Variable = pt.variable("m", "Height", start=1.0)
    v0: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    v1: pt.Variable = pt.variable("m/s", "Speed", start=0.0)
    f0: pt.Variable = pt.variable("N", "Force")
    f1: pt.Variable = pt.variable("N", "Force")

    def equations(self) -> pt.Equations:
        for h, v, f, e in (self.h0, self.v0, self.f0, self.e0), (self.h1, self.v1, self.f1, self.e1):
            yield pt.der(h) == v
            yield pt.der(v) == f - 10.0
            yield pt.unilateral(h, f, restitution=e)


def test_impacts_together() -> None:
    """Balls that have nothing to do with each other: h = e u (t - T) - 5 (t - T)^2 after T = sqrt(h/5), with u = 10 T."""
    run = pt.simulate(Balls(), 0.7, rtol=1e-11)
    assert len(run.events) == 2
    T = np.sqrt(0.2)
    s = 0.7 - T
    for i, e in enumerate((0.8, 0.7)):
        found = pt.gradient(run, f"h{i}", ["e0", "e1", "h0", "h1"])
        by_h = (e * 10 * (s - T) + 10 * s) / (10 * T)
        expected = [10 * T * s * (i == 0), 10 * T * s * (i == 1), by_h * (i == 0), by_h * (i == 1)]
        np.testing.assert_allclose(found.array, expected, atol=1e-8)
        np.testing.assert_allclose(found.spread, 0.0, atol=1e-8)


class Followed(pt.Component):
    """Two levels that fall back to zero at their limits. The limit of y falls with x, so y falls back at the latest when x does."""

    x1: pt.Parameter = pt.parameter("1", "Limit of x", default=1.0)
    y1: pt.Parameter = pt.parameter("1", "Limit of y while x = 1", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == 1.0
        yield pt.when(self.x > self.x1, pt.reinit(self.x, self.x - 1.0))
        yield pt.when(self.y > self.y1 + 0.5 * (self.x - 1.0), pt.reinit(self.y, 0.0))


class Clamped(pt.Component):
    """When x reaches 1, a weight that is 1 is set to 1; when the weighted x does, y falls back to zero."""

    y1: pt.Variable = pt.variable("1", "Weight of x", start=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y1) == 0.0
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == 1.0
        yield pt.when(self.x > 1, pt.reinit(self.y1, 1.0))
        yield pt.when(self.y1 * self.x > 1, pt.reinit(self.y, 0.0))


class Chained(pt.Component):
    """y falls back to zero when both of two levels have reached their limits."""

    y1: pt.Parameter = pt.parameter("1", "One limit", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)
    i: pt.Discrete = pt.discrete("1", "1: one is reached", start=0.0)
    j: pt.Discrete = pt.discrete("1", "1: the other one is reached", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == 1.0
        yield pt.when(self.x > 1, pt.reinit(self.i, 1.0))
        yield pt.when(self.x > self.y1, pt.reinit(self.j, 1.0))
        yield pt.when(self.i + self.j > 1.5, pt.reinit(self.y, 0.0))


@pytest.mark.parametrize("model", [Followed(), Clamped(), Chained()])
def test_resets_that_set_off_others_are_refused(model: pt.Component) -> None:
    """y falls back at t = 2 y1 - 1 or t = x1, whatever is first; at t = 1/y1 or t = 1; at t = y1 or t = 1, whatever is later."""
    run = pt.simulate(model, 1.5, rtol=1e-11)
    assert run["y"][-1] == pytest.approx(0.5)
    with pytest.raises(pt.SimulationError, match="switch together and act on each other"):
        pt.gradient(run, "y", "y1")


class Combined(pt.Component):
    """s runs faster when x has reached its limit, and faster still when x and y, or either of them, have, which is one condition."""

    either: bool = False
    x1: pt.Parameter = pt.parameter("1", "Limit of x", default=1.0)
    y1: pt.Parameter = pt.parameter("1", "Limit of y", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)
    s: pt.Variable = pt.variable("s", "Time", start=0.0)
    k: pt.Discrete = pt.discrete("1", "Excess of the rate", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == 1.0
        yield pt.der(self.y) == 1.0
        yield pt.der(self.s) == 1.0 + self.k + pt.switch(self.x > self.x1, 1e-5, 0.0)
        combined = ca.logic_or if self.either else ca.logic_and
        yield pt.when(combined(self.x > self.x1, self.y > self.y1), pt.reinit(self.k, self.k + 1e-5))


@pytest.mark.parametrize("either", [False, True])
def test_a_reset_on_two_conditions(either: bool) -> None:
    """s = t + 1e-5 (t - x1) + 1e-5 (t - max(x1, y1)), or the minimum."""
    found = pt.gradient(pt.simulate(Combined(either=either), 1.5, rtol=1e-11), "s", ["x1", "y1"])
    np.testing.assert_allclose(found.array, [-1.5e-5, -5e-6], rtol=1e-6)
    np.testing.assert_allclose(found.spread, [5e-6, 5e-6], rtol=1e-6)


class Stepped(pt.Component):
    """x reaches its threshold as the input steps from 0 to 1, and is so little beyond it then that both are one event."""

    u: pt.Input = pt.signal_input("1", "Input")
    x: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == pt.switch(self.x < 1 - 1.15e-10, 1 + self.u.value, 2.5 + 2.5 * self.u.value)


def test_a_step_of_an_input_at_the_instant_of_a_switch() -> None:
    """If the step comes later by d(T), the rate is 2.5 instead of 5 for so long; if it comes earlier, x gets there by d(T)/2 earlier."""
    run = pt.simulate(Stepped(), 2.0, inputs={"u": ([0.0, 1.0, 1.0, 2.0], [0.0, 0.0, 1.0, 1.0])})
    assert pt.gradient(run, "x", "u.times")["u.times[1]"] == pytest.approx(-2.5, rel=1e-6)


class Scaled(pt.Component):
    """The rate of x and its limit grow with r alike: like y it always passes its limit after 1 s."""

    r: pt.Parameter = pt.parameter("1", "Scale", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "Other level", start=0.0)

    def equations(self) -> pt.Equations:
        one, other = pt.switch(self.x > self.r, 1.0, 0.0), pt.switch(self.y > 1, 1.0, 0.0)
        yield pt.der(self.x) == self.r - 0.2 * one - 0.1 * other - 0.3 * one * other
        yield pt.der(self.y) == 1


@pytest.mark.parametrize("few", [0, 9])
def test_what_moves_no_instant_has_no_sides(monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """x = r + (r - 0.6): the unknown reaches the instants by the level and by the limit, which cancel."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    found = pt.gradient(pt.simulate(Scaled(), 2.0, rtol=1e-11), "x", "r")
    assert found["r"] == pytest.approx(2.0, rel=1e-7)
    assert found.spread[0] < 1e-7


class Two(pt.Component):
    """A level that grows half as fast above its limit, and slower still once another has passed 1."""

    limit: pt.Parameter = pt.parameter("1", "Where it slows down", default=1.0)
    coupling: pt.Parameter = pt.parameter("1", "How much the other slows it down", default=0.3)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)
    y: pt.Variable = pt.variable("1", "The other level", start=0.0)

    def equations(self) -> pt.Equations:
        above = pt.switch(self.x > self.limit, 1.0, 0.0)
        yield pt.der(self.x) == 1.0 - 0.5 * above - self.coupling * above * pt.switch(self.y > 1.0, 1.0, 0.0)
        yield pt.der(self.y) == 1.0


class Delayed(pt.Component):
    """A level whose rate is 1, r_a once it has passed its first limit, r_b once its second, r_ab once both."""

    second: pt.Parameter = pt.parameter("1", "Second limit", default=1.0)
    x: pt.Variable = pt.variable("1", "Level", start=0.0)

    def equations(self) -> pt.Equations:
        a, b = pt.switch(self.x > 1.0, 1.0, 0.0), pt.switch(self.x > self.second, 1.0, 0.0)
        yield pt.der(self.x) == 1.0 - 0.5 * a + 0.0405 * b - 0.0305 * a * b


def test_the_first_law_delays_the_second() -> None:
    """Raised by d, the second limit is passed 2 d later (r_a = 0.5), which costs 2 d (r_ab - r_a); lowered, time is won at r_b."""
    r_a, r_b, r_ab = 0.5, 1.0405, 0.51
    sides = [-(r_ab - r_a) / r_a, -(1.0 - 1.0 / r_b) * r_ab]
    found = pt.gradient(pt.simulate(Delayed(), 2.0, **TIGHT), "x", "second")["second"]
    assert found == pytest.approx(np.mean(sides), rel=1e-7)


@pytest.mark.parametrize("few", [0, 9])
def test_laws_that_switch_together(monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """Passing its limit later, a level loses 0.5 + coupling until then; passing it earlier, 0.5."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    plant = pt.compile(Two())
    close = plant.simulate(2.0, parameters={"coupling": 0.004}, **TIGHT)
    found = pt.gradient(close, "x", ["limit"])
    assert found["limit"] == pytest.approx(0.502, rel=1e-8)
    assert found.spread[0] == pytest.approx(0.002, rel=1e-6)
    assert "+-" not in str(found)
    assert pt.sensitivity(close, "x", "limit", [0.5, 1.5])["x"].values.ravel() == pytest.approx([0, 0.502])
    far = plant.simulate(2.0, **TIGHT)
    assert pt.gradient(far, "x", ["coupling"])["coupling"] == pytest.approx(-1.0, rel=1e-8)
    hardly = pt.gradient(far, pt.at("x", 2.0) + 1e5 * pt.at("y", 2.0), ["limit"])
    assert "(0.65 +- 0.15)" in str(hardly)
    assert hardly.to_dataframe()["spread"]["limit"] == pytest.approx(0.15, rel=1e-6)
    with pytest.raises(pt.SimulationError, match=r"switch together and act on each other.*sides differ by"):
        pt.gradient(far, "x", ["limit"])
    with pytest.raises(pt.SimulationError, match=r"switch together and act on each other"):
        pt.sensitivity(far, "x", "limit")
