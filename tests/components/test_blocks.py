"""Signal blocks: every source against its formula, exact corners and jumps, integrals, late starts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from joined import joined, run
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components import blocks as b

Array = NDArray[np.float64]


def integrated(source: pt.Component, stop: float = 2.0, points: int = 400) -> pt.Result[pt.Component]:
    result: pt.Result[pt.Component] = run(joined(source, b.Integrator(), joints="0.y=1.u"), stop, points=points)
    return result


def test_constant_and_step() -> None:
    result = run(joined(b.Constant(k=3), b.Step(height=2, offset=1, startTime=0.3), joints=""), 1.0)
    assert set(result["parts[0].y"]) == {3.0}
    before = result.time < 0.3
    assert set(result["parts[1].y"][before]) == {1.0}
    assert set(result["parts[1].y"][result.time > 0.3]) == {3.0}
    assert result.events[0].time == 0.3
    at = result["parts[1].y"][result.time == 0.3]
    assert (at[0], at[-1]) == (1.0, 3.0)


def test_a_step_at_the_start_has_happened() -> None:
    result = run(joined(b.Step(), b.Cosine(f=1), joints=""), 1.0)
    assert result["parts[0].y"][0] == 1.0
    assert result["parts[1].y"][0] == 1.0


@pytest.mark.parametrize("duration", [0.5, 0.0])
def test_ramp(duration: float) -> None:
    result = integrated(b.Ramp(height=2, duration=duration, offset=1, startTime=0.4))
    t = result.time
    inside = np.clip((t - 0.4) / duration, 0, 1) if duration else np.where(t > 0.4, 1.0, 0.0)
    away = t != 0.4
    np.testing.assert_allclose(result["parts[0].y"][away], (1 + 2 * inside)[away], atol=1e-12)
    assert result["parts[1].y"][-1] == pytest.approx(2 * 1 + 2 * (1.6 - duration / 2), rel=1e-12)


def test_corners_are_met_exactly_and_do_not_fill_the_events() -> None:
    result = integrated(b.Ramp(height=1, duration=1 / 3, startTime=1 / 7))
    assert result["parts[1].y"][-1] == pytest.approx(2 - 1 / 7 - 1 / 6, rel=1e-14)
    assert len(result.events) == 0


@pytest.mark.parametrize(("wave", "function"), [(b.Sine, np.sin), (b.Cosine, np.cos)])
def test_waves(wave: type[b.Sine] | type[b.Cosine], function: np.ufunc) -> None:
    result = integrated(wave(amplitude=2, f=1.5, phase=0.7, offset=-1, startTime=0.25))
    t = result.time
    expected = -1 + np.where(t > 0.25, 2 * function(2 * np.pi * 1.5 * (t - 0.25) + 0.7), 0.0)
    away = t != 0.25
    np.testing.assert_allclose(result["parts[0].y"][away], expected[away], atol=1e-12)


def test_damped_sine() -> None:
    result = integrated(b.ExpSine(amplitude=3, f=2, phase=0.4, damping=1.5, offset=0.5, startTime=0.25))
    t = result.time - 0.25
    expected = 0.5 + np.where(t < 0, 0, 3 * np.exp(-1.5 * t) * np.sin(4 * np.pi * t + 0.4))
    away = t != 0  # it jumps there
    np.testing.assert_allclose(result["parts[0].y"][away], expected[away], atol=1e-12)


def test_pulse() -> None:
    result = integrated(b.Pulse(amplitude=3, width=30, period=0.2, offset=1, startTime=0.05))
    t = result.time
    phase = np.mod(t - 0.05, 0.2)
    near = np.minimum(np.abs(phase - 0.06), np.minimum(phase, 0.2 - phase)) < 1e-9
    expected = 1 + np.where((t > 0.05) & (phase < 0.06), 3.0, 0.0)
    np.testing.assert_allclose(result["parts[0].y"][~near], expected[~near])
    assert result["parts[1].y"][-1] == pytest.approx(2 + 3 * (9 * 0.06 + 0.06), rel=1e-12)


def test_pulse_stops_after_its_periods_and_leaves_no_events() -> None:
    result = integrated(b.Pulse(amplitude=1, width=50, period=0.1, nperiod=3), stop=5)
    assert result["parts[1].y"][-1] == pytest.approx(0.15, rel=1e-12)
    assert result.events[-1].time == pytest.approx(0.25)


def test_trapezoid() -> None:
    result = integrated(b.Trapezoid(amplitude=2, rising=0.1, width=0.2, falling=0.3, period=0.8, offset=1))
    phase = np.mod(result.time, 0.8)
    expected = 1 + 2 * np.interp(phase, [0, 0.1, 0.3, 0.6, 0.8], [0, 1, 1, 0, 0])
    np.testing.assert_allclose(result["parts[0].y"], expected, atol=1e-12)
    assert result["parts[1].y"][-1] == pytest.approx(2 + 2 * (2 * 0.4 + 0.25 + 0.1 * 5 / 6), rel=1e-12)


def test_trapezoid_with_steep_sides_is_a_pulse() -> None:
    steep = integrated(b.Trapezoid(width=0.06, period=0.2))
    pulse = integrated(b.Pulse(width=30, period=0.2))
    assert steep["parts[1].y"][-1] == pytest.approx(pulse["parts[1].y"][-1], rel=1e-12)


@pytest.mark.parametrize(
    "wave",
    [
        b.Pulse(period=0.3, width=40, startTime=0.05),
        b.Pulse(period=0.3, width=40, nperiod=4),
        b.Pulse(period=0.3, nperiod=2),
        b.Trapezoid(period=0.3, rising=0.3, width=0),
    ],
    ids=["endless", "ends", "is over", "sawtooth"],
)
def test_a_periodic_signal_may_start_in_the_middle(wave: Any) -> None:
    """It goes on as if the run had started at zero."""
    whole, late = run(joined(wave, joints=""), 2.0), run(joined(wave, joints=""), 2.0, start=0.94)
    t = np.linspace(0.943, 1.993, 106)
    np.testing.assert_allclose(late.at(t, "parts[0].y"), whole.at(t, "parts[0].y"), atol=1e-9)


def test_exponentials() -> None:
    result = integrated(
        b.Exponentials(outMax=2, riseTime=0.5, riseTimeConst=0.1, fallTimeConst=0.2, offset=1, startTime=0.3)
    )
    t = np.maximum(result.time - 0.3, 0)
    top = 2 * (1 - np.exp(-5))
    expected = 1 + np.where(t < 0.5, 2 * (1 - np.exp(-t / 0.1)), top * np.exp(-(t - 0.5) / 0.2))
    np.testing.assert_allclose(result["parts[0].y"], expected, atol=1e-12)


def test_time_table_with_a_jump() -> None:
    table = ((0.0, 1.0), (0.5, 2.0), (0.5, 5.0), (1.0, 4.0))
    result = integrated(b.TimeTable(table=table))
    away = result.time != 0.5
    t = result.time[away]
    expected = np.where(t < 0.5, 1 + 2 * t, np.maximum(5 - 2 * (t - 0.5), 4))
    np.testing.assert_allclose(result["parts[0].y"][away], expected, atol=1e-12)
    at = result["parts[0].y"][result.time == 0.5]
    np.testing.assert_allclose([at[0], at[-1]], [2.0, 5.0])
    assert result["parts[1].y"][-1] == pytest.approx(0.75 + 2.25 + 4, rel=1e-12)


def test_time_table_refuses_falling_times() -> None:
    with pytest.raises(pt.ParameterError, match="times do not decrease"):
        run(joined(b.TimeTable(table=((0.0, 1.0), (1.0, 2.0), (0.5, 3.0))), joints=""), 1.0)


def test_arithmetic() -> None:
    parts = (b.Sine(f=1), b.Cosine(f=2), b.Gain(k=3), b.Add(k1=2, k2=-1), b.Product(), b.Feedback())
    joints = "0.y=2.u=3.u1=4.u1=5.u1 1.y=3.u2=4.u2=5.u2"
    result = run(joined(*parts, joints=joints), 1.0)
    x, y = result["parts[0].y"], result["parts[1].y"]
    for index, expected in enumerate([3 * x, 2 * x - y, x * y, x - y], 2):
        np.testing.assert_allclose(result[f"parts[{index}].y"], expected, atol=1e-13)


def test_integrator_and_lag() -> None:
    parts = (b.Step(height=2), b.Integrator(k=3, y_start=1), b.FirstOrder(k=4, T=0.5, y_start=-1))
    result = run(joined(*parts, joints="0.y=1.u=2.u"), 2.0)
    np.testing.assert_allclose(result["parts[1].y"], 1 + 6 * result.time, rtol=1e-12)
    np.testing.assert_allclose(result["parts[2].y"], 8 - 9 * np.exp(-result.time / 0.5), rtol=1e-9, atol=1e-9)


def test_signals_keep_their_units_and_tunable_parameters() -> None:
    plant = pt.compile(joined(b.Ramp(duration=1), b.Integrator(), joints="0.y=1.u"))
    slow = plant.simulate(1.0, parameters={"parts[0].duration": 2.0})
    assert slow["parts[1].y"][-1] == pytest.approx(0.25, rel=1e-9)


@pytest.mark.parametrize("kind", ["pulse", "table", "input"])
def test_a_pulse_too_short_for_a_late_start_is_noted(kind: str) -> None:
    """A pulse of 1 ms and area 1, a second after a start at the time since 1970, and counted from the start of the run."""

    def found(begin: float) -> pt.Result[Any]:
        table = ((begin + 1, 0.0), (begin + 1, 1e3), (begin + 1.001, 1e3), (begin + 1.001, 0.0))
        if kind == "input":
            times, values = zip(*table, strict=True)
            return pt.simulate(b.Integrator(), begin + 3, start=begin, inputs={"u": (times, values)})
        pulse = b.Pulse(amplitude=1e3, period=10.0, width=0.01, startTime=begin + 1)
        source = pulse if kind == "pulse" else b.TimeTable(table=table)
        result: pt.Result[Any] = run(joined(source, b.Integrator(), joints="0.y=1.u"), begin + 3, start=begin)
        return result

    early, late = found(0.0), found(1.7e9)
    area = "y" if kind == "input" else "parts[1].y"
    assert (early[area][-1], early.notes) == (pytest.approx(1, rel=1e-9), ())
    assert late[area][-1] == 0
    assert late.notes == (
        "at t = 1.7e+09 s, events of time signals within 0.0017 s count as one, so shorter pulses are lost; count time from the start "
        "of the run",
    )
    assert run(joined(b.Constant(k=1), b.Integrator(), joints="0.y=1.u"), 1.7e9 + 1, start=1.7e9).notes == ()
