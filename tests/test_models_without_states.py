"""Models without states, laws, parameters or inputs: what exists of their runs, derivatives and programs."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

import powertrain as pt


class Algebraic(pt.Component):
    """y = cos(y + a t), without any state."""

    a: pt.Parameter = pt.parameter("1/s", "Rate", default=0.3)
    y: pt.Variable = pt.variable("1", "Unknown", start=0.5)

    def equations(self) -> pt.Equations:
        yield self.y == ca.cos(self.y + self.a * pt.time)


class Constant(pt.Component):
    """Nothing but a number."""

    y: pt.Variable = pt.variable("1", "Number")

    def equations(self) -> pt.Equations:
        yield self.y == 3.0


class Signal(pt.Component):
    """Three times an input."""

    u: pt.Input = pt.signal_input("1", "Input", default=2.0)
    y: pt.Variable = pt.variable("1", "Output")

    def equations(self) -> pt.Equations:
        yield self.y == 3 * self.u.value


def exact(a: float, t: float) -> float:
    return float(brentq(lambda y: y - np.cos(y + a * t), -2.0, 2.0, xtol=1e-15))


@pytest.fixture(scope="module")
def plant() -> pt.Plant[Algebraic]:
    return pt.compile(Algebraic())


def test_runs_in_python_in_steps_and_in_c(plant: pt.Plant[Algebraic], tmp_path: Path) -> None:
    y = exact(0.3, 1.0)
    run = plant.start()
    run.step(0.4)
    run.step(0.6)
    found = [plant.simulate(1.0)["y"][-1], run["y"], plant.export_c(tmp_path).simulate(1.0)["y"][-1]]
    assert found == pytest.approx([y] * 3, rel=1e-6)


def test_derivatives(plant: pt.Plant[Algebraic]) -> None:
    """dy/da = -t sin/(1 + sin) with s = sin(y + a t), and differences of the exact solution."""
    result, a, h = plant.simulate(1.0, rtol=1e-10), 0.3, 1e-4
    low, middle, high = (exact(a + k * h, 1.0) for k in (-1, 0, 1))
    s = np.sin(middle + a)
    assert pt.gradient(result, "y", ["a"])["a"] == pytest.approx(-s / (1 + s), rel=1e-8)
    assert (high - low) / (2 * h) == pytest.approx(-s / (1 + s), rel=1e-6)
    assert float(pt.sensitivity(result, "y", ["a"])["y"][-1, 0]) == pytest.approx(-s / (1 + s), rel=1e-8)
    second = pt.hessian(plant, "y", ["a"], stop=1.0, rtol=1e-10)
    assert float(second[0, 0]) == pytest.approx((high - 2 * middle + low) / h**2, rel=1e-5)
    times = np.linspace(0.0, 1.0, 2001)
    areas = [np.trapezoid([exact(a + k * h, t) for t in times], times) for k in (-1, 1)]
    assert pt.gradient(result, pt.integral("y"), ["a"])["a"] == pytest.approx((areas[1] - areas[0]) / (2 * h), rel=1e-5)


@pytest.mark.parametrize(("model", "y"), [(Constant(), 3.0), (Signal(), 6.0)])
def test_models_without_parameters(model: pt.Component, y: float) -> None:
    plant = pt.compile(model)
    result = plant.simulate(1.0)
    assert result["y"][-1] == y
    assert pt.gradient(result, pt.integral("y")).value == pytest.approx(y)


def test_what_needs_states_is_refused(plant: pt.Plant[Algebraic]) -> None:
    with pytest.raises(pt.ParameterError, match="Algebraic has no states, and so no vibration modes"):
        pt.eigenmodes(plant)
    with pytest.raises(pt.ParameterError, match="the model has no states to integrate"):
        plant.function().step(0.1)
