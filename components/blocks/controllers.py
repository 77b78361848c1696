"""Controllers: continuous with anti-windup, and sampled."""

from __future__ import annotations

from typing import Literal

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    der,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    time,
    variable,
    when,
)
from powertrain.components.blocks.sampled import EARLY
from powertrain.components.limited import limited, limited_at


class _Controller(Component):
    """Partial: inputs and limits of a controller."""

    u_s: Input = signal_input("1", "Set point")
    u_m: Input = signal_input("1", "Measured value")
    y: Output = signal_output("1", "Actuating signal")
    k: Parameter = parameter("1", "Gain", default=1.0, above=0)
    Ti: Parameter = parameter("s", "Time constant of the integral", default=0.5, above=0)
    yMax: Parameter = parameter("1", "Upper limit of y")
    yMin: Parameter = parameter("1", "Lower limit of y")

    def check(self) -> Equations:
        """The limits must be in order."""
        yield self.yMin <= self.yMax


class LimPID(_Controller):
    """A PID controller with limited output and anti-windup, weights of the set point and a filtered derivative.

    y = v within yMin..yMax,  v = k (wp u_s - u_m + integral + derivative) + kFF u_ff
    Ti der(integral) = u_s - u_m + (y - v)/(k Ni)
    derivative = Nd (wd u_s - u_m - x),  Td der(x) = derivative

    Beyond a limit the integral part is reduced with the time constant Ni Ti, so that the output leaves the limit as soon as the error
    changes sign (back-calculation). ``controllerType`` selects the parts: "P", "PI", "PD", "PID". The feed-forward signal u_ff may be left
    unconnected.

    The derivative part is zero at the start. ``initType`` determines the start of the integral part: "InitialState" gives it the value
    xi_start, "InitialOutput" the value with which v = y_start, "SteadyState" the rate zero. With "NoInit" the conditions of the model
    determine it; without any it is zero. "InitialOutput" is the choice for a run that begins at an operating point, whose torque or pedal
    position is y_start. "SteadyState" by itself only says that the set point is met; the model must also ask for rest, by a condition such
    as ``der(self.shaft.w) == 0`` in its ``initial()``.

    Source: Modelica Standard Library 4.0.0, Blocks.Continuous.LimPID.
    """

    controllerType: Literal["P", "PI", "PD", "PID"] = "PID"
    initType: Literal["NoInit", "InitialState", "InitialOutput", "SteadyState"] = "InitialState"
    u_ff: Input = signal_input("1", "Feed-forward signal", default=0.0)
    kFF: Parameter = parameter("1", "Gain of the feed-forward signal", default=1.0)
    Td: Parameter = parameter("s", "Time constant of the derivative", default=0.1, above=0)
    wp: Parameter = parameter("1", "Weight of the set point in the proportional part", default=1.0, min=0)
    wd: Parameter = parameter("1", "Weight of the set point in the derivative part", default=0.0, min=0)
    Ni: Parameter = parameter("1", "Time of the anti-windup over Ti", default=0.9, above=0)
    Nd: Parameter = parameter("1", "Td over the time constant of the derivative's filter", default=10.0, above=0)
    xi_start: Parameter = parameter("1", "Integral part at the start, for InitialState", default=0.0)
    y_start: Parameter = parameter("1", "Actuating signal at the start, for InitialOutput", default=0.0)
    v: Variable = variable("1", "Actuating signal before its limits")
    integral: Variable = variable("1", "Integral part", start=0.0)
    derivative: Variable = variable("1", "Derivative part")
    x: Variable = variable("1", "State of the derivative filter")

    def check(self) -> Equations:
        """The limits must be in order; a start by output needs an integral part and a value within the limits."""
        yield from super().check()
        if self.initType == "InitialOutput":
            yield "I" in self.controllerType  # InitialOutput needs an integral part
            yield self.yMin <= self.y_start
            yield self.y_start <= self.yMax

    def equations(self) -> Equations:
        """Three parts, a feed-forward signal and two limits."""
        set_point, measured = self.u_s.value, self.u_m.value
        parts = self.wp * set_point - measured + self.integral + self.derivative
        yield self.v == self.k * parts + self.kFF * self.u_ff.value
        yield self.y.value == limited_at(self.v, self.yMin, self.yMax)
        integrates, derives = "I" in self.controllerType, "D" in self.controllerType
        back = (self.y.value - self.v) / (self.k * self.Ni)
        yield self.Ti * der(self.integral) == (set_point - measured + back if integrates else 0)
        yield self.Td * der(self.x) == (self.derivative if derives else 0)
        yield self.derivative == (self.Nd * (self.wd * set_point - measured - self.x) if derives else 0)

    def initial(self) -> Equations:
        """The derivative starts without a transient, the integral as ``initType`` says."""
        yield self.x == self.wd * self.u_s.value - self.u_m.value
        if "I" in self.controllerType and self.initType == "InitialState":
            yield self.integral == self.xi_start
        if self.initType == "InitialOutput":
            yield self.v == self.y_start
        if "I" in self.controllerType and self.initType == "SteadyState":
            yield der(self.integral) == 0


class SampledPI(_Controller):
    """A proportional-integral controller as computed by a control unit: sampled at period, 2 period, ..., and held in between.

    e_n = u_s - u_m;  y_n = v_n within yMin..yMax,  v_n = k e_n + x_n
      x_(n+1) = x_n + k period/Ti e_n;  x_(n+1) = x_n where v_n is beyond a limit and e_n drives it further (conditional integration)

    Before the first sample after the start of a run y = y_start. A sample reads the values just before its instant, and time signals that
    jump there after the jump. Of two controllers that are sampled at the same instant each sees the previous output of the other.
    """

    period: Parameter = parameter("s", "Sampling period", default=0.01, above=0)
    y_start: Parameter = parameter("1", "y before the first sample", default=0.0)
    n: Discrete = discrete("1", "Number of the last sample")
    x: Discrete = discrete("1", "Integral part", start=0.0)
    held: Discrete = discrete("1", "Last computed value")

    def equations(self) -> Equations:
        """One update per sample."""
        error = self.u_s.value - self.u_m.value
        v = self.k * error + self.x
        given = limited(v, self.yMin, self.yMax)
        yield when(
            time >= (self.n + 1) * self.period,
            reinit(self.n, self.n + 1),
            reinit(self.x, self.x + self.k * self.period / self.Ti * error * self._free(v, error)),
            reinit(self.held, given),
        )
        yield self.y.value == self.held

    def initial(self) -> Equations:
        """A run may start at any time: samples before it are counted, but not taken."""
        yield self.n == ca.floor(time / self.period + EARLY)
        yield self.held == self.y_start

    def _free(self, v: Symbol, error: Symbol) -> Symbol:
        """1 if the integral is updated, 0 if it is held."""
        wound = ca.logic_or(ca.logic_and(v > self.yMax, error > 0), ca.logic_and(v < self.yMin, error < 0))
        return 1 - wound
