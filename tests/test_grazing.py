"""Events at which an indicator only touches zero: when it counts as that, and what the derivatives of runs are then."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from runs_by_formula import TIGHT

import powertrain as pt
from powertrain.dae.tolerances import EPS
from powertrain.variational.instants import duration, grazing, negligible

LAW: Any = SimpleNamespace(name="law", where="here")


def grazes(slope: float, fallen: float, h: float) -> bool:
    return grazing(LAW, 1.0, slope, fallen, h) is not None


@pytest.mark.parametrize("h", [0.1, 2.0])
@pytest.mark.parametrize(("share", "grazing"), [(0.9, True), (1.1, False)])
def test_how_deep_it_would_fall(h: float, share: float, grazing: bool) -> None:
    """slope t + k t^2 falls to its least value at t > 0, found on a fine grid; it counts from 100 times the hysteresis on."""
    fallen = 1e-4
    slopes = -np.geomspace(1e-9, 1e-3, 4001) * fallen**0.5 / h
    bends = (fallen + slopes * h) / h**2
    times = np.linspace(0.0, 1.0, 2001) * h
    depths = np.array([-(s * times + k * times**2).min() for s, k in zip(slopes, bends, strict=True)])
    slope = float(slopes[np.searchsorted(depths, share * 100 * EPS)])
    assert grazes(slope, fallen, h) == grazing


def test_a_share_of_the_mean_slope() -> None:
    """An indicator that falls by 1 in 1 s and arrives with less than 1e-3 1/s, or rising, grazes however deep it would fall."""
    assert grazes(-0.9e-3, 1.0, 1.0)
    assert not grazes(-1.1e-3, 1.0, 1.0)
    assert grazes(1.0, 1.0, 1.0)


def test_one_that_falls_ever_faster_does_not_graze() -> None:
    assert not grazes(-3.0, 1.0, 1.0)


class Flat(pt.Component):
    """Something begins where (t - 1)^3 passes a limit: at zero it does so without slope."""

    limit: pt.Parameter = pt.parameter("1", "The limit", default=0.0)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.y) == pt.switch((pt.time - 1.0) ** 3 > self.limit, 1.0, 0.0)


def test_grazing_is_refused() -> None:
    """y = T - 1 - limit^(1/3)."""
    plant = pt.compile(Flat())
    clear = plant.simulate(3.0, parameters={"limit": 0.1}, max_step=0.1, **TIGHT)
    assert pt.gradient(clear, "y", "limit")["limit"] == pytest.approx(-(0.1 ** (-2 / 3)) / 3, rel=1e-7)
    flat = plant.simulate(3.0, max_step=0.1, **TIGHT)
    assert flat["y"][-1] == pytest.approx(2.0, abs=1e-2)
    with pytest.raises(pt.SimulationError, match="only just switches"):
        pt.gradient(flat, "y", "limit")


@pytest.mark.parametrize(
    ("change", "lasting", "nothing"),
    [(1e-8, math.inf, True), (1e-3, math.inf, False), (1e-3, 1e-5, True), (1e-3, 1e-3, False), (-1e-3, 1e-3, False)],
)
def test_a_grazing_event_counts_by_what_the_run_misses_without_it(change: float, lasting: float, nothing: bool) -> None:
    """Rates that change by nothing, and those that change for no time."""
    assert negligible(np.array([0.0, change]), np.array([1.0, 1.0]), lasting) == nothing


class Stop(pt.Component):
    """A mass on a spring that swings against a stiff stop."""

    spring: pt.Parameter = pt.parameter("N/m", "Stiffness of the spring", default=0.5)
    stiffness: pt.Parameter = pt.parameter("N/m", "Stiffness of the stop", default=1e9)
    limit: pt.Parameter = pt.parameter("m", "Where the stop begins", default=1.0)
    x: pt.Variable = pt.variable("m", "Deflection", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        deep = self.x - self.limit
        yield pt.der(self.v) == -self.spring * self.x - pt.switch(deep > 0, self.stiffness * deep, 0.0, continuous=True)


def after_a_touch(spring: complex, stiffness: float, limit: float, t: float) -> complex:
    """The deflection after the stop was touched: that of the free swing, by the time that the stop has saved later."""
    free, both = np.sqrt(spring), np.sqrt(spring + stiffness)
    speed = np.sqrt(1.0 - spring * limit**2)
    saved = 2.0 * np.arctan(speed / (free * limit)) / free - 2.0 * np.arctan(speed * both / (spring * limit)) / both
    return complex(np.sin(free * (t + saved)) / free)


@pytest.mark.parametrize("stiffness", [1e6, 1e8, 1e9])
def test_a_stop_that_is_barely_touched(stiffness: float) -> None:
    """The force is continuous there, so the run has a derivative, however flat the indicator; compared by a complex step."""
    limit = 1.0 / math.sqrt(0.5) - 1e-8
    result = pt.compile(Stop()).simulate(4.0, parameters={"limit": limit, "stiffness": stiffness}, **TIGHT)
    assert result["x"][-1] == pytest.approx(after_a_touch(0.5, stiffness, limit, 4.0).real, abs=1e-5)
    exact = after_a_touch(0.5 + 1e-25j, stiffness, limit, 4.0).imag / 1e-25
    assert pt.gradient(result, "x", "spring")["spring"] == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize(("depth", "stiffness"), [(1e-8, 1e13), (1e-9, 1e11)])
def test_a_stop_that_is_touched_by_as_little_as_the_hysteresis(depth: float, stiffness: float) -> None:
    """The event comes so late that the derivative would be wrong by 2 % to 40 %."""
    given = {"limit": 1.0 / math.sqrt(0.5) - depth, "stiffness": stiffness}
    result = pt.compile(Stop()).simulate(4.0, parameters=given, **TIGHT)
    with pytest.raises(pt.PowertrainError, match="only just switches"):
        pt.gradient(result, "x", "spring")


class Counted(pt.Component):
    """As ``Stop``; something hardly noticeable begins at the same instant."""

    spring: pt.Parameter = pt.parameter("N/m", "Stiffness of the spring", default=0.5)
    stiffness: pt.Parameter = pt.parameter("N/m", "Stiffness of the stop", default=1e9)
    limit: pt.Parameter = pt.parameter("m", "Where the stop begins", default=1.0)
    x: pt.Variable = pt.variable("m", "Deflection", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)
    y: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        deep = self.x - self.limit
        yield pt.der(self.v) == -self.spring * self.x - pt.switch(deep > 0, self.stiffness * deep, 0.0, continuous=True)
        yield pt.der(self.y) == pt.switch(deep > 5e-12, 1e-12, 0.0)


def test_a_law_that_grazes_together_with_a_kink() -> None:
    """What jumps changes nothing, and what changes does not jump."""
    limit = 1.0 / math.sqrt(0.5) - 1e-8
    result = pt.compile(Counted()).simulate(4.0, parameters={"limit": limit}, **TIGHT)
    exact = after_a_touch(0.5 + 1e-25j, 1e9, limit, 4.0).imag / 1e-25
    assert pt.gradient(result, "x", "spring")["spring"] == pytest.approx(exact, rel=2e-3)


def test_how_long_an_event_lasts() -> None:
    """Until the same law changes again, or to the end."""
    held = np.array([[1.0, 0.0], [1.0, 2.0], [0.0, 2.0]])
    run: Any = SimpleNamespace(
        end=9.0, instants=SimpleNamespace(times=np.array([1.0, 2.0, 4.0]), right=SimpleNamespace(m=held))
    )
    assert [duration(run, k, 0) for k in range(3)] == [3.0, 2.0, 5.0]
    assert [duration(run, k, 1) for k in range(3)] == [1.0, 7.0, 5.0]
