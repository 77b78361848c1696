"""Derivatives of runs by the values and instants of the corners of an input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from runs_by_formula import TIGHT
from small_models import STARTS, Decay, Engaging

import powertrain as pt


@pytest.fixture(scope="module")
def decay() -> pt.Plant[Decay]:
    return pt.compile(Decay())


def test_knots_of_an_input(decay: pt.Plant[Decay]) -> None:
    """The response to a hat function of each knot; they add up to the response to a constant."""
    knots = ([0.0, 1.0, 1.0, 2.0], [1.0, 2.0, -1.0, 0.5])
    result = decay.simulate(3.0, inputs={"torque": knots}, **TIGHT)
    found = pt.gradient(result, "inertia.w", ["torque"])
    assert list(found) == ["torque[0]", "torque[1]", "torque[2]", "torque[3]"]
    for k, name in enumerate(found):
        unit = [float(k == i) for i in range(4)]
        alone = decay.simulate(3.0, inputs={"torque": (knots[0], unit)}, **TIGHT)
        assert found[name] == pytest.approx(alone["inertia.w"][-1], rel=1e-9)


@pytest.mark.parametrize("few", [0, 100])
def test_instants_of_knots(decay: pt.Plant[Decay], monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """J w(T) is the integral of u exp(-d (T - t)/J), whose derivatives by the corners of u are differences of quadratures."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    times, values = [0.0, 1.0, 1.0, 2.0, 2.5], [1.0, 2.0, -1.0, 0.5, 4.0]
    result = decay.simulate(3.0, inputs={"torque": (times, values)}, **TIGHT)
    found = pt.gradient(result, "inertia.w", ["torque.times", "torque"])
    assert list(found)[5:] == [f"torque.times[{i}]" for i in range(4)]
    assert found.units["torque.times[1]"] == "rad/s/s"

    def speed(corners: list[float]) -> float:
        t0, t1, t2, t3 = corners
        pieces = [(t0, t1, 1.0, 2.0), (t1, t2, -1.0, 0.5), (t2, t3, 0.5, 4.0), (t3, 3.0, 4.0, 4.0)]
        nodes, weights = np.polynomial.legendre.leggauss(12)
        total = 0.0
        for a, b, u, v in pieces:
            s = (nodes + 1.0) / 2.0
            total += (
                (b - a) / 2.0 * float(weights @ ((u + (v - u) * s) * np.exp(-0.25 * (3.0 - a - (b - a) * s)))) / 2.0
            )
        return total

    assert speed([0.0, 1.0, 2.0, 2.5]) == pytest.approx(found.value, rel=1e-9)
    for k in (1, 2, 3):
        up, down = ([0.0, 1.0, 2.0, 2.5] for _ in range(2))
        up[k] += 1e-5
        down[k] -= 1e-5
        assert found[f"torque.times[{k}]"] == pytest.approx((speed(up) - speed(down)) / 2e-5, rel=1e-7)


class Fed(pt.Component):
    """The integral of u + 3 v."""

    u: pt.Input = pt.signal_input("1", "One")
    v: pt.Input = pt.signal_input("1", "Other")
    x: pt.Variable = pt.variable("1", "Integral", start=0.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.u.value + 3 * self.v.value


def test_instants_of_steps_of_two_inputs() -> None:
    steps = {"u": ([0.0, 0.5, 0.5], [0.0, 0.0, 1.0]), "v": ([0.0, 1.0, 1.0], [0.0, 0.0, 1.0])}
    found = pt.gradient(pt.simulate(Fed(), 2.0, inputs=steps), "x", ["u.times", "v.times"])
    assert (found["u.times[1]"], found["v.times[1]"]) == pytest.approx((-1.0, -3.0), rel=1e-9)


@pytest.mark.parametrize("few", [0, 9])
def test_a_maximum_where_an_input_steps_down(monkeypatch: pytest.MonkeyPatch, few: int) -> None:
    """x rises at 1/s until the step comes."""
    monkeypatch.setattr("powertrain.variational.gradients._FEW", few)
    run = pt.simulate(Fed(), 2.0, inputs={"u": ([0.0, 1.0, 1.0, 1.8], [1.0, 1.0, -1.0, -1.0])})
    found = pt.gradient(run, pt.maximum("x"), "u.times")
    assert found.value == pytest.approx(1.0)
    assert (found["u.times[1]"], found["u.times[2]"]) == pytest.approx((1.0, 0.0), abs=1e-9)


def test_instants_of_knots_through_slip_and_stick() -> None:
    """The heat of an engagement by the corners of the command, against differences of runs."""
    plant = pt.compile(Engaging())
    of = pt.integral(lambda m: m.clutch.tau * m.clutch.w_rel)

    def run(corners: list[float]) -> pt.Result[Engaging]:
        inputs: dict[str, Any] = {"torque": 30.0, "press": (corners, [0.0, 0.3, 0.5, 0.9])}
        return plant.simulate(2.0, starts=STARTS, inputs=inputs, **TIGHT)

    corners = [0.0, 0.2, 0.6, 0.6]
    found = pt.gradient(run(corners), of, "press.times")
    assert found["press.times[1]"] > 1.0
    for k, moved in ((1, (1,)), (2, (2, 3))):
        up, down = ([t + e * (i in moved) for i, t in enumerate(corners)] for e in (1e-4, -1e-4))
        slope = (pt.gradient(run(up), of, "torque").value - pt.gradient(run(down), of, "torque").value) / 2e-4
        assert found[f"press.times[{k}]"] == pytest.approx(slope, rel=2e-6)
