"""Switching the engine on and off."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    time,
    when,
)


class EngineSwitch(Component):
    """Partial: switches the engine on and off depending on the accelerator and the vehicle speed."""

    accelerator: Input = signal_input("1", "Accelerator pedal", default=0.0)
    v: Input = signal_input("m/s", "Speed of the vehicle", default=0.0)
    on: Output = signal_output("1", "1: the engine runs, 0: it is stopped")


class AlwaysOn(EngineSwitch):
    """The engine runs: on = 1."""

    def equations(self) -> Equations:
        """A constant."""
        yield self.on.value == 1


class StartStop(EngineSwitch):
    """Stops the engine at standstill and starts it with the accelerator.

    The signal ``on``:
      on = 0 as soon as |v| < v_stop and accelerator < u_stop have held for ``delay``,  if it has been running for t_least
      on = 1 as soon as accelerator > u_start
    """

    v_stop: Parameter = parameter("m/s", "Speed below which the engine is stopped", default=0.1, above=0)
    u_stop: Parameter = parameter(
        "1", "Accelerator position below which the engine may stop", default=0.01, above=0, max=1
    )
    u_start: Parameter = parameter(
        "1", "Accelerator position above which the engine starts", default=0.02, above=0, max=1
    )
    delay: Parameter = parameter("s", "Time at standstill before the engine stops", default=0.0, min=0)
    t_least: Parameter = parameter("s", "Minimum running time", default=2.0, above=0)
    running: Discrete = discrete("1", "1: running, 0: stopped", start=1.0)
    since: Discrete = discrete("s", "Time at which it was started", start=0.0)
    resting: Discrete = discrete("1", "1: at rest with the accelerator released, 0: not", start=0.0)
    rested: Discrete = discrete("s", "Time at which the vehicle came to rest", start=0.0)

    def check(self) -> Equations:
        """A started engine must not stop at the same accelerator."""
        yield self.u_stop <= self.u_start

    def initial(self) -> Equations:
        """A running engine has just been started."""
        yield self.since == time

    def equations(self) -> Equations:
        """A switch with hysteresis."""
        u, v, runs = self.accelerator.value, self.v.value, self.running > 0.5
        rests = ca.logic_and(ca.fabs(v) < self.v_stop, u < self.u_stop)
        ready = ca.logic_and(runs, time > ca.fmax(self.since + self.t_least, self.rested + self.delay))
        stops = ca.logic_and(rests, self.resting < 0.5)
        yield when(stops, reinit(self.resting, 1), reinit(self.rested, time), initially=True)
        yield when(ca.logic_not(rests), reinit(self.resting, 0), initially=True)
        yield when(ca.logic_and(self.resting > 0.5, ready), reinit(self.running, 0), initially=True)
        started = ca.logic_and(u > self.u_start, self.running < 0.5)
        yield when(started, reinit(self.running, 1), reinit(self.since, time), initially=True)
        yield self.on.value == self.running
