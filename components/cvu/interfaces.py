"""The common interface of all continuously variable units."""

from __future__ import annotations

from powertrain import Equations, Input, Parameter, Symbol, Variable, der, parameter, signal_input, variable, within
from powertrain.components.rotational.interfaces import Lossy, TwoFlangesAndSupport


class VariableUnit(TwoFlangesAndSupport, Lossy):
    """Partial: a continuously variable unit (CVU) between two shafts; the desired speed ratio V = w_b/w_a is a signal.

    Its housing is the support, which is at rest if nothing is connected. A ratio outside [ratio_min, ratio_max] ends a simulation with an
    error.
    """

    ratio: Input = signal_input("1", "Speed ratio V, speed of flange_b over speed of flange_a")
    ratio_min: Parameter = parameter("1", "Minimum ratio of the unit", default=-1e3)
    ratio_max: Parameter = parameter("1", "Maximum ratio of the unit", default=1e3)
    w_a: Variable = variable("rad/s", "Speed of flange_a against the housing")
    w_b: Variable = variable("rad/s", "Speed of flange_b against the housing")

    def check(self) -> Equations:
        """The range must not be empty."""
        yield self.ratio_min < self.ratio_max

    def _turn(self) -> Equations:
        yield from self._balance()
        yield self.w_a == der(self.flange_a.phi - self.support.phi)
        yield self.w_b == der(self.flange_b.phi - self.support.phi)

    def _ratio(self) -> Symbol:
        """The ratio, which must stay within its range."""
        V = self.ratio.value
        within(V, self.ratio_min, self.ratio_max, name="speed ratio of the variable unit", unit="1")
        return V
