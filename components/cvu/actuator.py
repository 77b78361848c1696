"""Actuators for the ratio of a variable unit."""

from __future__ import annotations

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Variable,
    der,
    parameter,
    signal_input,
    signal_output,
    variable,
)
from powertrain.components.limited import limited, limited_at


class Actuator(Component):
    """Partial: brings the ratio of a variable unit to the demand, limited to [ratio_min, ratio_max]."""

    ratio_min: Parameter = parameter("1", "Minimum ratio", default=-1e3)
    ratio_max: Parameter = parameter("1", "Maximum ratio", default=1e3)
    demand: Input = signal_input("1", "Demanded ratio")
    ratio: Output = signal_output("1", "Ratio, for the variable unit")

    def check(self) -> Equations:
        """The range must not be empty."""
        yield self.ratio_min <= self.ratio_max


class IdealActuator(Actuator):
    """Follows the demanded ratio without delay, for operating points.

    ratio = demand held within [ratio_min, ratio_max]
    """

    def equations(self) -> Equations:
        """No lag."""
        yield self.ratio.value == limited(self.demand.value, self.ratio_min, self.ratio_max)


class RatioActuator(Actuator):
    """Follows a demanded ratio with a first-order lag, within limits of rate and range.

    T der(ratio) = target - ratio,  |der(ratio)| <= rate,  target = demand held within [ratio_min, ratio_max]

    It starts at ratio_start.
    """

    T: Parameter = parameter("s", "Time constant of the follow-up", default=0.05, above=0)
    rate: Parameter = parameter("1/s", "Maximum rate of the ratio", default=1.0, above=0)
    ratio_start: Parameter = parameter("1", "Ratio at the start", default=1.0)
    V: Variable = variable("1", "Ratio", prefer=True)

    def check(self) -> Equations:
        """The start must be within the range."""
        yield from super().check()
        yield self.ratio_min <= self.ratio_start
        yield self.ratio_start <= self.ratio_max

    def equations(self) -> Equations:
        """A lag within limits."""
        yield self.ratio.value == self.V
        target = limited_at(self.demand.value, self.ratio_min, self.ratio_max)
        yield der(self.V) == limited_at((target - self.V) / self.T, -self.rate, self.rate)

    def initial(self) -> Equations:
        """The start."""
        yield self.ratio_start == self.V
