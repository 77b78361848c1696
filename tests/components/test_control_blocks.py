"""Limits, hysteresis, delay, tables, controllers and motions from point to point against their closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import blocks as b

SINE = b.Sine(amplitude=2, f=0.5)


def test_limiter() -> None:
    result = run(joined(SINE, b.Limiter(uMax=1.5, uMin=-0.5), joints="0.y=1.u"), 2.0)
    np.testing.assert_allclose(result["parts[1].y"], np.clip(result["parts[0].y"], -0.5, 1.5), atol=1e-9)


@pytest.mark.parametrize(("start", "first"), [(0.0, 0), (1.0, 1)])
def test_hysteresis(start: float, first: int) -> None:
    """2 sin(pi t) rises above 1 at t = 1/6, falls below -1 at 7/6; at the start it lies between them."""
    part = b.Hysteresis(uLow=-1, uHigh=1, y_start=start)
    result = run(joined(SINE, part, joints="0.y=1.u"), 3.0, max_step=0.1)
    np.testing.assert_allclose(
        result.at([0.1, 0.2, 0.9, 1.1, 1.2, 1.9, 2.1, 2.2], "parts[1].y"), [first, 1, 1, 1, 0, 0, 0, 1]
    )


def test_hysteresis_knows_an_input_outside_at_the_start() -> None:
    for value, y in ((1.5, 1), (-1.5, 0)):
        result = run(joined(b.Constant(k=value), b.Hysteresis(uLow=-1, uHigh=1, y_start=1 - y), joints="0.y=1.u"), 0.1)
        assert set(result["parts[1].y"]) == {y}


def test_delay_of_a_sine() -> None:
    """8 sections for 0.5 s at 0.5 Hz: w T = 1.57, late by 0.16 % less, with its amplitude."""
    result = run(joined(SINE, b.Delay(delayTime=0.5), joints="0.y=1.u"), 6.0)
    late = result.time > 3
    n, w = 8, np.pi
    phase = 2 * n * np.arctan(w * 0.5 / (2 * n))
    np.testing.assert_allclose(result["parts[1].y"][late], 2 * np.sin(w * result.time[late] - phase), atol=1e-6)
    assert phase / w == pytest.approx(0.5, rel=4e-3)


def test_tables() -> None:
    curve = pt.Map.curve([0, 1, 2], [0, 1, 4], x="u", outside="linear")
    plane = pt.Map((pt.Axis("a", "1", [0, 1]), pt.Axis("b", "1", [0, 2])), [[0, 2], [3, 5]], "1")
    parts = b.Ramp(height=2, duration=2), b.CombiTable1D(table=curve), b.Constant(k=0.5), b.CombiTable2D(table=plane)
    result = run(joined(*parts, joints="0.y=1.u 2.y=3.u1 0.y=3.u2"), 2.0)
    t = result.time
    np.testing.assert_allclose(result["parts[1].y"], np.interp(t, [0, 1, 2], [0, 1, 4]), atol=1e-9)
    np.testing.assert_allclose(result["parts[3].y"], 1.5 + t, atol=1e-9)
    with pytest.raises(
        pt.ParameterError, match=r"CombiTable1D requires a map with 1 arguments; this one has a \[1\], b \[1\]"
    ):
        pt.compile(joined(b.Constant(k=0), b.CombiTable1D(table=plane), joints="0.y=1.u"))


def controlled(controller: pt.Component, stop: float = 10.0, **options: Any) -> pt.Result[pt.Component]:
    """A plant der(x) = y with a set point of 1."""
    parts = b.Constant(k=1), controller, b.Integrator()
    result: pt.Result[pt.Component] = run(joined(*parts, joints="0.y=1.u_s 1.y=2.u 2.y=1.u_m"), stop, **options)
    return result


def test_pi_controller_in_its_range() -> None:
    """s^2 + k s + k/Ti = 0 with k = 2, Ti = 2: (s + 1)^2, so the error is exp(-t) (1 - t)."""
    result = controlled(b.LimPID(controllerType="PI", k=2, Ti=2, yMax=10, yMin=-10))
    t = result.time
    np.testing.assert_allclose(1 - result["parts[2].y"], np.exp(-t) * (1 - t), atol=1e-7)


def test_derivative_is_filtered() -> None:
    """A ramp of slope 1 gives Td (1 - exp(-Nd t/Td)) beside the proportional part."""
    controller = b.LimPID(controllerType="PD", k=1, Td=0.5, Nd=5, wd=1, yMax=100, yMin=-100)
    parts = b.Ramp(height=10, duration=10), controller, b.Constant(k=0)
    result = run(joined(*parts, joints="0.y=1.u_s 2.y=1.u_m"), 2.0)
    t = result.time
    np.testing.assert_allclose(result["parts[1].y"], t + 0.5 * (1 - np.exp(-10 * t)), atol=1e-7)


def test_anti_windup() -> None:
    """At most 0.1: 10 s to the set point, and hardly beyond it, where an integral of the error alone would overshoot by half of it."""
    for controller in (
        b.LimPID(controllerType="PI", k=2, Ti=2, yMax=0.1, yMin=-0.1),
        b.SampledPI(k=2, Ti=2, yMax=0.1, yMin=-0.1, period=0.02),
    ):
        result = controlled(controller, 40.0)
        x = result["parts[2].y"]
        assert np.interp(5.0, result.time, x) == pytest.approx(0.5, abs=0.01)
        assert x.max() < 1.1
        assert x[-1] == pytest.approx(1, abs=0.01)


def test_sampled_controller_is_its_program() -> None:
    """Against the recursion on the exact plant: x_(n+1) = x_n + period y_n."""
    k, Ti, period = 2.0, 2.0, 0.25
    result = controlled(b.SampledPI(k=k, Ti=Ti, period=period, yMax=1.5, yMin=-1.5), 5.0, max_step=0.1)
    plant, integral = 0.0, 0.0
    for n in range(1, 20):
        error = 1 - plant
        v = k * error + integral
        y = float(np.clip(v, -1.5, 1.5))
        integral += 0.0 if v > 1.5 else k * period / Ti * error
        assert result.at([(n + 0.5) * period], "parts[1].y")[0] == pytest.approx(y, abs=1e-7)
        plant += period * y
        assert result.at([(n + 0.999999) * period], "parts[2].y")[0] == pytest.approx(plant, abs=1e-5)


@pytest.mark.parametrize(
    ("way", "duration", "top"), [(10.0, 7.0, 2.0), (-10.0, 7.0, -2.0), (1.0, 2.0, 1.0), (0.0, 0.0, 0.0)]
)
def test_motion_from_point_to_point(way: float, duration: float, top: float) -> None:
    """At most 2/s and 1/s2: 10 in 5 s + 2 s; 1 in two seconds without reaching the speed."""
    part = b.KinematicPTP(deltaq=way, qd_max=2, qdd_max=1, startTime=1)
    result = run(joined(part, b.Integrator(), b.Integrator(), joints="0.qdd=1.u 1.y=2.u"), 10.0)
    t, q, qd = result.time, result["parts[0].q"], result["parts[0].qd"]
    np.testing.assert_allclose(result["parts[1].y"], qd, atol=1e-7)
    np.testing.assert_allclose(result["parts[2].y"], q, atol=1e-7)
    assert q[-1] == way
    assert np.sign(top) * qd.max() == pytest.approx(top) if top > 0 else qd.min() == pytest.approx(top)
    assert np.abs(q[t >= 1 + duration] - way).max() < 1e-9
    assert np.all(np.abs(q[t <= 1]) == 0)


@pytest.mark.parametrize(
    ("block", "limits"),
    [
        (b.Limiter, {"uMax": -1.0, "uMin": 1.0}),
        (b.Hysteresis, {"uHigh": -1.0, "uLow": 1.0}),
        (b.LimPID, {"yMax": -1.0, "yMin": 1.0}),
        (b.SampledPI, {"yMax": -1.0, "yMin": 1.0}),
    ],
)
def test_limits_in_the_wrong_order_are_rejected(block: Any, limits: dict[str, float]) -> None:
    """Equal limits leave one value."""
    high, low = limits
    with pytest.raises(pt.ParameterError, match=f"{low} <= self.{high}"):
        block(**limits)
    assert block(**{high: 1.0, low: 1.0})


@pytest.mark.parametrize("start", [0.5, 1e-9, 1 - 1e-9])
def test_a_switch_starts_at_0_or_1(start: float) -> None:
    with pytest.raises(pt.ParameterError, match=r"(?s)Hysteresis: .*y_start"):
        b.Hysteresis(uLow=-1.0, uHigh=1.0, y_start=start)


def test_a_delay_needs_sections() -> None:
    with pytest.raises(pt.ParameterError, match="sections"):
        b.Delay(delayTime=1.0, sections=())
