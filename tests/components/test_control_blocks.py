"""Limits, hysteresis, delay, tables, controllers and motions from point to point against their closed forms."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import blocks as b
from powertrain.components import rotational

SINE = b.Sine(amplitude=2, f=0.5)


def test_limiter() -> None:
    result = run(joined(SINE, b.Limiter(uMax=1.5, uMin=-0.5), joints="0.y=1.u"), 2.0)
    np.testing.assert_allclose(result["parts[1].y"], np.clip(result["parts[0].y"], -0.5, 1.5), atol=1e-9)


def test_limits_that_are_signals() -> None:
    """2 sin(pi t) between t/2 and 1.5 - t/4."""
    parts = SINE, b.VariableLimiter(), b.Ramp(offset=1.5, height=-1, duration=4), b.Ramp(height=2, duration=4)
    result = run(joined(*parts, joints="0.y=1.u 2.y=1.limit1 3.y=1.limit2"), 1.5)
    t = result.time
    np.testing.assert_allclose(result["parts[1].y"], np.clip(result["parts[0].y"], t / 2, 1.5 - t / 4), atol=1e-9)


def test_slew_rate() -> None:
    """A step from 0 to 1 at 1 s and back at 3 s: slopes of 2 and -4 to within Td of the end, exponential from there."""
    limiter = b.SlewRateLimiter(Rising=2, Falling=-4, Td=0.01)
    pulse = b.Pulse(period=10, width=20, startTime=1)
    result = run(joined(pulse, limiter, joints="0.y=1.u"), 4.0)
    t, y = result.time, result["parts[1].y"]
    np.testing.assert_allclose(y[t < 1], 0, atol=1e-12)
    for start, slope, end in ((1.0, 2.0, 1.0), (3.0, -4.0, 0.0)):
        length = 1 / abs(slope) - 0.01
        ramp, rest = (t > start) & (t < start + length), (t > start + length) & (t < start + 0.9)
        np.testing.assert_allclose(y[ramp], 1 - end + slope * (t[ramp] - start), atol=1e-9)
        np.testing.assert_allclose(y[rest], end - slope * 0.01 * np.exp(-(t[rest] - start - length) / 0.01), atol=1e-9)


def test_a_slew_rate_without_fall_is_rejected() -> None:
    with pytest.raises(pt.ParameterError, match=r"self.Falling < 0"):
        b.SlewRateLimiter(Falling=0)


def test_second_order() -> None:
    """A step response with damping 0.5: overshoot by exp(-pi D/root(1 - D^2)) = 16.3 %."""
    result = run(joined(b.Constant(k=3), b.SecondOrder(k=2, w=4, D=0.5), joints="0.y=1.u"), 4.0)
    t, damped = result.time, 4 * np.sqrt(0.75)
    bend = np.exp(-2 * t) * (np.cos(damped * t) + 2 / damped * np.sin(damped * t))
    np.testing.assert_allclose(result["parts[1].y"], 6 * (1 - bend), atol=1e-7)
    assert float(result.at(np.pi / damped, "parts[1].y")) == pytest.approx(
        6 * (1 + np.exp(-np.pi / np.sqrt(3))), rel=1e-7
    )


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


@pytest.mark.parametrize(
    ("kind", "first"), [({}, 2.0), ({"xi_start": -0.5}, 1.0), ({"initType": "InitialOutput", "y_start": 0.6}, 0.6)]
)
def test_pi_controller_starts_as_asked(kind: dict[str, Any], first: float) -> None:
    """The same double pole with error 1 and its rate -y at the start: exp(-t) (1 + (1 - y) t); y = k (1 + xi_start) or y_start."""
    result = controlled(b.LimPID(controllerType="PI", k=2, Ti=2, yMax=10, yMin=-10, **kind))
    t = result.time
    np.testing.assert_allclose(1 - result["parts[2].y"], np.exp(-t) * (1 + (1 - first) * t), atol=1e-7)


class Shaft(pt.Component):
    """A shaft of 2 kg.m2 with a drag of 30 N.m at 100 rad/s, whose speed a controller holds at 100 rad/s."""

    pid: b.LimPID
    conditions: tuple[str, ...] = ()
    set_point: b.Constant = b.Constant(k=100)
    one: b.Constant = b.Constant(k=1)
    torque: rotational.Torque = rotational.Torque()
    inertia: rotational.Inertia = rotational.Inertia(J=2)
    drag: rotational.LinearSpeedDependentTorque = rotational.LinearSpeedDependentTorque(tau_nominal=-30, w_nominal=100)
    sensor: rotational.SpeedSensor = rotational.SpeedSensor()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.set_point.y, self.pid.u_s)
        yield pt.connect(self.sensor.w, self.pid.u_m)
        yield pt.connect(self.pid.y, self.torque.tau)
        if "forward" in self.conditions:
            yield pt.connect(self.one.y, self.pid.u_ff)
        yield pt.connect(self.torque.flange, self.inertia.flange_a, self.sensor.flange)
        yield pt.connect(self.inertia.flange_b, self.drag.flange)

    def initial(self) -> pt.Equations:
        if "rest" in self.conditions:
            yield pt.der(self.inertia.w) == 0
        if "output" in self.conditions:
            yield self.pid.y.value == 30


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize(
    ("kind", "conditions", "starts"),
    [
        ({"initType": "SteadyState"}, ("rest",), {}),
        ({"initType": "InitialOutput", "y_start": 30}, (), {"inertia.w": 100}),
        ({"initType": "InitialState", "xi_start": 15}, (), {"inertia.w": 100}),
        ({"initType": "NoInit"}, ("output",), {"inertia.w": 100}),
        ({"initType": "InitialState", "kFF": 30}, ("forward",), {"inertia.w": 100}),
    ],
)
def test_controllers_start_at_rest(
    controller: Literal["PI", "PID"], kind: dict[str, Any], conditions: tuple[str, ...], starts: dict[str, float]
) -> None:
    """The set point takes 30 N.m: by the integral part, 15 of 30/k, or by the feed-forward signal; nothing moves then."""
    pid = b.LimPID(controllerType=controller, k=2, Ti=2, yMax=200, yMin=-200, **kind)
    result = pt.simulate(Shaft(pid=pid, conditions=conditions), 3.0, starts=starts)
    np.testing.assert_allclose(result["inertia.w"], 100.0, rtol=1e-9)
    np.testing.assert_allclose(result["pid.y"], 30.0, rtol=1e-9)


def test_a_controller_at_its_limit_starts_in_balance() -> None:
    """20 N.m hold 100 * 20/30 rad/s, and the back-calculation holds the integral part: v = y + k Ni (u_s - u_m)."""
    pid = b.LimPID(controllerType="PI", initType="SteadyState", k=2, Ti=2, yMax=20, yMin=-200)
    result = pt.simulate(Shaft(pid=pid, conditions=("rest",)), 3.0)
    np.testing.assert_allclose(result["inertia.w"], 100 * 20 / 30, rtol=1e-9)
    np.testing.assert_allclose(result["pid.v"], 20 + 2 * 0.9 * 100 / 3, rtol=1e-9)


def test_a_start_by_output_that_cannot_be_is_refused() -> None:
    limits: dict[str, Any] = {"yMax": 200.0, "yMin": -200.0, "initType": "InitialOutput"}
    with pytest.raises(pt.ParameterError, match=r"InitialOutput needs an integral part"):
        b.LimPID(controllerType="PD", **limits)
    with pytest.raises(pt.ParameterError, match=r"does not hold with yMax = 200, y_start = 300"):
        b.LimPID(y_start=300, **limits)


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


def test_sampled_controllers_in_cascade_see_each_others_previous_output() -> None:
    """Two difference equations, the inner one with half the period, around an integrator."""
    outer = b.SampledPI(period=0.02, k=1.0, Ti=1.0, yMax=10.0, yMin=-10.0)
    inner = b.SampledPI(period=0.01, k=0.5, Ti=2.0, yMax=10.0, yMin=-10.0)
    parts = b.Constant(k=1.0), outer, inner, b.Integrator()
    loops = joined(*parts, joints="0.y=1.u_s 3.y=1.u_m 1.y=2.u_s 3.y=2.u_m 2.y=3.u")
    y = u = given = x_outer = x_inner = 0.0
    wanted = []
    for k in range(1, 21):
        y += 0.01 * u
        wanted.append(y)
        e_inner, e_outer = given - y, 1.0 - y
        u, x_inner = 0.5 * e_inner + x_inner, x_inner + 0.5 * 0.01 / 2.0 * e_inner
        if k % 2 == 0:
            given, x_outer = e_outer + x_outer, x_outer + 0.02 * e_outer
    times = 0.01 * np.arange(1, 21)
    assert run(loops, 0.2).at(times, "parts[3].y") == pytest.approx(np.array(wanted), abs=1e-12)


@pytest.mark.parametrize(("start", "first"), [(0.0, 0.25), (0.1, 0.25), (10.0, 10.25), (10.05, 10.25)])
def test_a_sampled_controller_starts_with_the_run(start: float, first: float) -> None:
    """Without feedback y = k (1 + j period/Ti) after sample j: the multiples of the period that follow the start, whenever that is."""
    parts = b.Constant(k=1), b.Constant(k=0), b.SampledPI(k=2, Ti=1, period=0.25, yMax=9, yMin=-9, y_start=0.5)
    plant = pt.compile(joined(*parts, joints="0.y=2.u_s 1.y=2.u_m"))
    result = plant.simulate(start + 2.0, start=start)
    times = [(start + first) / 2, *(first + 0.125 + 0.25 * np.arange(7))]
    np.testing.assert_allclose(result.at(times, "parts[2].y"), [0.5, *(2 * (1 + 0.25 * np.arange(7)))])


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
