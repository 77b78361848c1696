"""Laws that switch at one instant and act on each other, against exact runs in every order."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

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
