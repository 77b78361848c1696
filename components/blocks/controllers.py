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
    switch,
    time,
    variable,
    when,
)
from powertrain.components.limited import limited


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

    y = v within yMin..yMax,  v = k (wp u_s - u_m + integral + derivative)
    Ti der(integral) = u_s - u_m + (y - v)/(k Ni)
    derivative = Nd (wd u_s - u_m - x),  Td der(x) = derivative

    Beyond a limit the integral part is reduced with the time constant Ni Ti, so that the output leaves the limit as soon as the error
    changes sign (back-calculation). ``controllerType`` selects the parts: "P", "PI", "PD", "PID". Both parts are zero at the start.
    Source: Modelica Standard Library 4.0.0, Blocks.Continuous.LimPID.
    """

    controllerType: Literal["P", "PI", "PD", "PID"] = "PID"
    Td: Parameter = parameter("s", "Time constant of the derivative", default=0.1, above=0)
    wp: Parameter = parameter("1", "Weight of the set point in the proportional part", default=1.0, min=0)
    wd: Parameter = parameter("1", "Weight of the set point in the derivative part", default=0.0, min=0)
    Ni: Parameter = parameter("1", "Time of the anti-windup over Ti", default=0.9, above=0)
    Nd: Parameter = parameter("1", "Td over the time constant of the derivative's filter", default=10.0, above=0)
    v: Variable = variable("1", "Actuating signal before its limits")
    integral: Variable = variable("1", "Integral part", start=0.0)
    derivative: Variable = variable("1", "Derivative part")
    x: Variable = variable("1", "State of the derivative filter")

    def equations(self) -> Equations:
        """Three parts and two limits."""
        set_point, measured = self.u_s.value, self.u_m.value
        yield self.v == self.k * (self.wp * set_point - measured + self.integral + self.derivative)
        low = switch(self.v < self.yMin, self.yMin, self.v, continuous=True)
        yield self.y.value == switch(self.v > self.yMax, self.yMax, low, continuous=True)
        integrates, derives = "I" in self.controllerType, "D" in self.controllerType
        back = (self.y.value - self.v) / (self.k * self.Ni)
        yield self.Ti * der(self.integral) == (set_point - measured + back if integrates else 0)
        yield self.Td * der(self.x) == (self.derivative if derives else 0)
        yield self.derivative == (self.Nd * (self.wd * set_point - measured - self.x) if derives else 0)

    def initial(self) -> Equations:
        """The derivative starts without a transient."""
        yield self.x == self.wd * self.u_s.value - self.u_m.value


class SampledPI(_Controller):
    """A proportional-integral controller as computed by a control unit: sampled at period, 2 period, ..., and held in between.

    e_n = u_s - u_m;  y_n = v_n within yMin..yMax,  v_n = k e_n + x_n
    x_(n+1) = x_n + k period/Ti e_n, but as it is where v_n lies beyond a limit and e_n drives it further (conditional integration)

    Before the first sample y = y_start.
    """

    period: Parameter = parameter("s", "Sampling period", default=0.01, above=0)
    y_start: Parameter = parameter("1", "y before the first sample", default=0.0)
    n: Discrete = discrete("1", "Number of samples taken")
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
        yield self.y.value == switch(self.n > 0.5, self.held, self.y_start)

    def _free(self, v: Symbol, error: Symbol) -> Symbol:
        """1 if the integral is updated, 0 if it is held."""
        wound = ca.logic_or(ca.logic_and(v > self.yMax, error > 0), ca.logic_and(v < self.yMin, error < 0))
        return 1 - wound
