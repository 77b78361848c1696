"""Signals that are limited, quantised, switched with hysteresis, or delayed."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    connect,
    der,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    switch,
    when,
)
from powertrain.components.blocks.basic import Filter
from powertrain.components.limited import limited_at


class Limiter(Filter):
    """A limited signal: y = u where uMin <= u <= uMax, else the limit exceeded."""

    uMax: Parameter = parameter("1", "Upper limit")
    uMin: Parameter = parameter("1", "Lower limit")

    def check(self) -> Equations:
        """The limits must be in order."""
        yield self.uMin <= self.uMax

    def equations(self) -> Equations:
        """Three pieces."""
        yield self.y.value == limited_at(self.u.value, self.uMin, self.uMax)


class DeadZone(Filter):
    """A signal without effect near zero: y = 0 where uMin <= u <= uMax, else u less the limit exceeded."""

    uMax: Parameter = parameter("1", "Upper limit of the dead zone")
    uMin: Parameter = parameter("1", "Lower limit of the dead zone")

    def check(self) -> Equations:
        """The limits must be in order."""
        yield self.uMin <= self.uMax

    def equations(self) -> Equations:
        """Three pieces."""
        u = self.u.value
        yield self.y.value == u - limited_at(u, self.uMin, self.uMax)


class Quantizer(Filter):
    """A signal in steps, as a converter or an encoder resolves it: y = n quantum, with the integer n nearest to u/quantum.

    Every step is an event. At the threshold between two steps y keeps its value. A control loop that comes to rest at a threshold switches
    there without end, and its run ends with an error. With a ``ZeroOrderHold`` before the quantizer, as in a converter, it does not.
    Operating points and linear models hold y at 0, or at a given ``n``, as they hold all discrete variables.
    """

    quantum: Parameter = parameter("1", "Height of a step", above=0)
    n: Discrete = discrete("1", "Number of the step")

    def equations(self) -> Equations:
        """It goes up and down at the same thresholds; one step at least, where round-off would have none."""
        steps = self.u.value / self.quantum
        yield when(steps > self.n + 0.5, reinit(self.n, ca.fmax(self.n + 1, ca.ceil(steps - 0.5))), initially=True)
        yield when(steps < self.n - 0.5, reinit(self.n, ca.fmin(self.n - 1, ca.floor(steps + 0.5))), initially=True)
        yield self.y.value == self.quantum * self.n


class VariableLimiter(Filter):
    """A signal within limits that are signals: y = u where limit2 <= u <= limit1, else the limit exceeded.

    Where limit2 exceeds limit1, y = limit1.
    """

    limit1: Input = signal_input("1", "Upper limit")
    limit2: Input = signal_input("1", "Lower limit")

    def equations(self) -> Equations:
        """Three pieces."""
        low = switch(self.u.value < self.limit2.value, self.limit2.value, self.u.value, continuous=True)
        yield self.y.value == switch(low > self.limit1.value, self.limit1.value, low, continuous=True)


class SlewRateLimiter(Filter):
    """A signal that follows another one with limited rates, as a demanded torque follows the pedal.

    der(y) = (u - y)/Td within Falling..Rising;  it starts at y = u

    Td is the time constant with which y reaches u in the end. Source: Modelica Standard Library 4.0.0, Blocks.Nonlinear.SlewRateLimiter.
    """

    Rising: Parameter = parameter("1/s", "Maximum rate", default=1.0, above=0)
    Falling: Parameter = parameter("1/s", "Minimum rate, negative", default=-1.0)
    Td: Parameter = parameter("s", "Time constant of the approach", default=0.01, above=0)

    def check(self) -> Equations:
        """A signal must be able to fall."""
        yield self.Falling < 0  # the signal can fall

    def equations(self) -> Equations:
        """Three pieces."""
        rate = (self.u.value - self.y.value) / self.Td
        yield der(self.y.value) == limited_at(rate, self.Falling, self.Rising)

    def initial(self) -> Equations:
        """At rest."""
        yield self.y.value == self.u.value


class Hysteresis(Filter):
    """A switch: y becomes 1 when u rises above uHigh, and 0 when u falls below uLow; between them it keeps its value.

    At the start y = 1 for u > uHigh, 0 for u < uLow, and y_start between them.
    """

    uLow: Parameter = parameter("1", "Value below which y is 0")
    uHigh: Parameter = parameter("1", "Value above which y is 1")
    y_start: Parameter = parameter("1", "y at the start between the two, 0 or 1", default=0.0, min=0, max=1)
    held: Discrete = discrete("1", "Last state of u: 1 above uHigh, -1 below uLow, 0 neither")

    def check(self) -> Equations:
        """The band must not be empty, and y_start is 0 or 1."""
        yield self.uLow <= self.uHigh
        yield self.y_start * self.y_start == self.y_start  # 0 or 1

    def equations(self) -> Equations:
        """The state is needed only within the band."""
        u = self.u.value
        above, below = u > self.uHigh, u < self.uLow
        yield when(above, reinit(self.held, 1), initially=True)
        yield when(below, reinit(self.held, -1), initially=True)
        kept = switch(self.held > 0.5, 1.0, switch(self.held < -0.5, 0.0, self.y_start))
        yield self.y.value == switch(above, 1.0, switch(below, 0.0, kept))


class AllPass(Filter):
    """A first-order all-pass filter, which leaves amplitudes unchanged: the first Padé approximation of a delay.

    delayTime/2 der(x) + x = u,  y = 2 x - u;  it starts as if u had been constant before.
    """

    delayTime: Parameter = parameter("s", "Delay of slow signals", above=0)
    x: Output = signal_output("1", "Signal after a first-order lag")

    def equations(self) -> Equations:
        """A first-order lag, whose deviation counts twice."""
        yield self.delayTime / 2 * der(self.x.value) + self.x.value == self.u.value
        yield self.y.value == 2 * self.x.value - self.u.value

    def initial(self) -> Equations:
        """At rest."""
        yield self.x.value == self.u.value


class Delay(Filter):
    """A delayed signal: y(t) = u(t - delayTime), approximated by n all-pass sections of delayTime/n each.

    A sine of angular frequency w keeps its amplitude and is delayed by delayTime (1 - (w delayTime)^2/(12 n^2) + ...), 1 % too little at
    w delayTime = 0.35 n. A jump of u appears at once and rings until about delayTime: smooth it, or use more sections. An exact delay
    would need the history of the signal, which is not part of a model's state.
    """

    delayTime: Parameter = parameter("s", "Delay", above=0)
    sections: tuple[AllPass, ...] = (AllPass(delayTime=1),) * 8

    def check(self) -> Equations:
        """There is at least one section."""
        yield len(self.sections) > 0  # it has sections

    def equations(self) -> Equations:
        """A chain."""
        for before, after in zip(self.sections, self.sections[1:], strict=False):
            yield connect(before.y, after.u)
        for section in self.sections:
            yield section.delayTime == self.delayTime / len(self.sections)
        yield connect(self.u, self.sections[0].u)
        yield connect(self.sections[-1].y, self.y)
