"""Signals: sources over time and simple arithmetic between outputs and inputs."""

from __future__ import annotations

import math
from itertools import pairwise

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
    schedule,
    signal_input,
    signal_output,
    switch,
    time,
    variable,
    when,
)

INSTANT = 1e-300
"""Shortest ramp in s, which avoids a division by zero for a duration of zero (a step)."""
NEVER = 1e300
"""A time in s that is never reached."""


class _Source(Component):
    """Partial: a signal y."""

    y: Output = signal_output("1", "Signal")


class Filter(_Source):
    """Partial: a signal y that depends on a signal u."""

    u: Input = signal_input("1", "Signal")


class _StartingSource(_Source):
    """Partial: a signal that is ``offset`` before ``startTime``."""

    offset: Parameter = parameter("1", "Value before startTime, added after it", default=0.0)
    startTime: Parameter = parameter("s", "Time at which the signal starts", default=0.0)

    def _after_start(self, value: Symbol, continuous: bool = False) -> Symbol:
        return self.offset + switch(time >= self.startTime, value, 0.0, continuous=continuous)


class Constant(_Source):
    """A constant signal: y = k."""

    k: Parameter = parameter("1", "Value")

    def equations(self) -> Equations:
        """A constant."""
        yield self.y.value == self.k


class Step(_StartingSource):
    """A jump: y = offset before startTime, offset + height from then on."""

    height: Parameter = parameter("1", "Height of the step", default=1.0)

    def equations(self) -> Equations:
        """A jump at a time."""
        yield self.y.value == self._after_start(self.height)


class Ramp(_StartingSource):
    """A linear rise from offset at startTime to offset + height at startTime + duration; a step if duration is 0."""

    height: Parameter = parameter("1", "Height of the ramp", default=1.0)
    duration: Parameter = parameter("s", "Duration of the ramp", min=0)

    def equations(self) -> Equations:
        """A slope between two corners."""
        elapsed = time - self.startTime
        slope = self.height / ca.fmax(self.duration, INSTANT)
        ramp = switch(elapsed >= self.duration, self.height, slope * elapsed, continuous=True)
        yield self.y.value == self._after_start(ramp, continuous=True)


class _Wave(_StartingSource):
    """Partial: a harmonic signal."""

    amplitude: Parameter = parameter("1", "Amplitude", default=1.0)
    f: Parameter = parameter("Hz", "Frequency")
    phase: Parameter = parameter("rad", "Phase at startTime", default=0.0)

    def _angle(self) -> Symbol:
        return 2 * math.pi * self.f * (time - self.startTime) + self.phase


class Sine(_Wave):
    """A sine from startTime on: y = offset + amplitude sin(2 pi f (time - startTime) + phase)."""

    def equations(self) -> Equations:
        """A sine."""
        yield self.y.value == self._after_start(self.amplitude * ca.sin(self._angle()))


class Cosine(_Wave):
    """A cosine from startTime on: y = offset + amplitude cos(2 pi f (time - startTime) + phase)."""

    def equations(self) -> Equations:
        """A cosine."""
        yield self.y.value == self._after_start(self.amplitude * ca.cos(self._angle()))


class ExpSine(_Wave):
    """A damped sine from startTime on: y = offset + amplitude exp(-damping t) sin(2 pi f t + phase), t = time - startTime."""

    damping: Parameter = parameter("1/s", "Damping coefficient")

    def equations(self) -> Equations:
        """A damped sine."""
        envelope = ca.exp(-self.damping * ca.fmax(time - self.startTime, 0))
        yield self.y.value == self._after_start(self.amplitude * envelope * ca.sin(self._angle()))


class _Periodic(_StartingSource):
    """Partial: a signal that repeats with every period, nperiod times (endlessly if nperiod < 0)."""

    period: Parameter = parameter("s", "Time for one period", above=0)
    nperiod: Parameter = parameter("1", "Number of periods, or -1 for no end", default=-1.0)
    count: Discrete = discrete("1", "Number of completed periods")

    def initial(self) -> Equations:
        """The periods that are over."""
        over = ca.fmax(ca.floor((time - self.startTime) / self.period), 0)
        yield self.count == ca.if_else(self.nperiod >= 0, ca.fmin(over, ca.fmax(self.nperiod, 0)), over)

    def _elapsed(self) -> Symbol:
        """Time since the start of the period."""
        return time - (self.startTime + self.count * self.period)

    def _over(self) -> Symbol:
        return ca.logic_and(self.nperiod >= 0, self.count > self.nperiod - 0.5)

    def _count(self) -> Equations:
        length = ca.if_else(self._over(), NEVER, self.period)
        yield when(self._elapsed() >= length, reinit(self.count, self.count + 1))

    def _running(self, value: Symbol) -> Symbol:
        return self._after_start(ca.if_else(self._over(), 0.0, value))


class Pulse(_Periodic):
    """A rectangular wave: y = offset + amplitude in the first ``width`` percent of every period, else offset."""

    amplitude: Parameter = parameter("1", "Height of the pulse", default=1.0)
    width: Parameter = parameter("1", "Width of the pulse in percent of the period", default=50.0, above=0, max=100)

    def equations(self) -> Equations:
        """A rectangular wave."""
        yield from self._count()
        width = ca.if_else(self._over(), -NEVER, self.period * self.width / 100)
        yield self.y.value == self._running(switch(self._elapsed() < width, self.amplitude, 0.0))


class Trapezoid(_Periodic):
    """A wave that rises from offset to offset + amplitude, holds, falls and holds offset, once in every period."""

    amplitude: Parameter = parameter("1", "Height of the trapezoid", default=1.0)
    rising: Parameter = parameter("s", "Duration of the rise", default=0.0, min=0)
    width: Parameter = parameter("s", "Duration at the top", default=0.5, min=0)
    falling: Parameter = parameter("s", "Duration of the fall", default=0.0, min=0)

    def equations(self) -> Equations:
        """Four pieces."""
        yield from self._count()
        t, fall = self._elapsed(), self.rising + self.width
        rise = self.amplitude * t / ca.fmax(self.rising, INSTANT)
        down = self.amplitude * (1 - (t - fall) / ca.fmax(self.falling, INSTANT))
        late = switch(t < fall + self.falling, down, 0.0, continuous=True)
        top = switch(t < fall, self.amplitude, late, continuous=True)
        yield self.y.value == self._running(switch(t < self.rising, rise, top, continuous=True))


class Exponentials(_StartingSource):
    """A rise towards outMax from startTime on, and a fall from startTime + riseTime on, both exponential.

    t < riseTime: y = offset + outMax (1 - exp(-t/riseTimeConst)) with t = time - startTime;
    then y = offset + y_r exp(-(t - riseTime)/fallTimeConst) with y_r the value reached.
    """

    outMax: Parameter = parameter("1", "Value towards which y rises", default=1.0)
    riseTime: Parameter = parameter("s", "Duration of the rise", min=0)
    riseTimeConst: Parameter = parameter("s", "Time constant of the rise", above=0)
    fallTimeConst: Parameter = parameter("s", "Time constant of the fall", above=0)

    def equations(self) -> Equations:
        """Two exponentials."""
        t = time - self.startTime
        rise = self.outMax * (1 - ca.exp(-ca.fmin(t, self.riseTime) / self.riseTimeConst))
        fall = ca.exp(-ca.fmax(t - self.riseTime, 0) / self.fallTimeConst)
        value = switch(t < self.riseTime, rise, rise * fall, continuous=True)
        yield self.y.value == self._after_start(value, continuous=True)


class TimeTable(_Source):
    """Rows (time in s, value) with linear interpolation; constant before the first and after the last.

    A time that appears in two rows is a jump. The Modelica Standard Library continues the line through the last two rows instead; add a
    row for that.
    """

    table: tuple[tuple[float, float], ...]

    def check(self) -> Equations:
        """There is at least one row, and times do not decrease."""
        yield len(self.table) > 0  # it has rows
        yield all(before[0] <= after[0] for before, after in pairwise(self.table))  # times do not decrease

    def equations(self) -> Equations:
        """The rows' polygon."""
        yield self.y.value == schedule([row[0] for row in self.table], [row[1] for row in self.table])


class Gain(_Source):
    """A gain: y = k u."""

    k: Parameter = parameter("1", "Gain")
    u: Input = signal_input("1", "Signal")

    def equations(self) -> Equations:
        """A product with a constant."""
        yield self.y.value == self.k * self.u.value


class Add(_Source):
    """A weighted sum: y = k1 u1 + k2 u2."""

    k1: Parameter = parameter("1", "Gain of u1", default=1.0)
    k2: Parameter = parameter("1", "Gain of u2", default=1.0)
    u1: Input = signal_input("1", "First signal")
    u2: Input = signal_input("1", "Second signal")

    def equations(self) -> Equations:
        """A weighted sum."""
        yield self.y.value == self.k1 * self.u1.value + self.k2 * self.u2.value


class Product(_Source):
    """A product: y = u1 u2."""

    u1: Input = signal_input("1", "First signal")
    u2: Input = signal_input("1", "Second signal")

    def equations(self) -> Equations:
        """A product."""
        yield self.y.value == self.u1.value * self.u2.value


class Feedback(_Source):
    """A difference: y = u1 - u2."""

    u1: Input = signal_input("1", "Command")
    u2: Input = signal_input("1", "Value fed back")

    def equations(self) -> Equations:
        """A difference."""
        yield self.y.value == self.u1.value - self.u2.value


class Integrator(_Source):
    """An integrator that starts at y_start: der(y) = k u."""

    k: Parameter = parameter("1/s", "Gain", default=1.0)
    y_start: Parameter = parameter("1", "y at the start", default=0.0)
    u: Input = signal_input("1", "Signal")

    def equations(self) -> Equations:
        """An integral."""
        yield der(self.y.value) == self.k * self.u.value

    def initial(self) -> Equations:
        """The start."""
        yield self.y.value == self.y_start


class FirstOrder(_Source):
    """A first-order lag that starts at y_start: T der(y) + y = k u."""

    k: Parameter = parameter("1", "Gain", default=1.0)
    T: Parameter = parameter("s", "Time constant", above=0)
    y_start: Parameter = parameter("1", "y at the start", default=0.0)
    u: Input = signal_input("1", "Signal")

    def equations(self) -> Equations:
        """A first-order lag."""
        yield self.T * der(self.y.value) + self.y.value == self.k * self.u.value

    def initial(self) -> Equations:
        """The start."""
        yield self.y.value == self.y_start


class SecondOrder(_Source):
    """A second-order lag that starts at y_start with the rate yd_start: an actuator, a filter, a hydraulic valve.

    der(yd) = w (w (k u - y) - 2 D yd),  der(y) = yd
    """

    k: Parameter = parameter("1", "Gain", default=1.0)
    w: Parameter = parameter("rad/s", "Natural angular frequency without damping", above=0)
    D: Parameter = parameter("1", "Damping ratio", min=0)
    y_start: Parameter = parameter("1", "y at the start", default=0.0)
    yd_start: Parameter = parameter("1/s", "yd at the start", default=0.0)
    u: Input = signal_input("1", "Signal")
    yd: Variable = variable("1/s", "Rate of y")

    def equations(self) -> Equations:
        """A second-order lag."""
        yield der(self.y.value) == self.yd
        yield der(self.yd) == self.w * (self.w * (self.k * self.u.value - self.y.value) - 2 * self.D * self.yd)

    def initial(self) -> Equations:
        """The start."""
        yield self.y.value == self.y_start
        yield self.yd == self.yd_start
