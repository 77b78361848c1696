"""Prescribed motions of a rod, at whatever force is required."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, Input, Parameter, Variable, der, parameter, signal_input, variable
from powertrain.components.prescribed import following_position, following_speed
from powertrain.components.translational.interfaces import OneFlangeAndSupport


class Position(OneFlangeAndSupport):
    """Prescribes the position of a rod by a signal.

    exact: s = s_ref, which must be differentiable as often as the model needs

    Otherwise s follows s_ref through a second-order Bessel filter with the critical frequency f_crit:
    s + 1.3617 v/w_crit + 0.6180 der(v)/w_crit^2 = s_ref,  w_crit = 2 pi f_crit,  starting at s = s_ref
    """

    boundary: ClassVar[bool] = True
    exact: bool = False
    f_crit: Parameter = parameter("Hz", "Critical frequency of the filter", default=50.0, above=0)
    s_ref: Input = signal_input("m", "Position of the flange against the support")
    s: Variable = variable("m", "Position of the flange against the support", start=0.0)
    v: Variable = variable("m/s", "Speed of the flange against the support", start=0.0)

    def equations(self) -> Equations:
        """The signal, or the filtered signal."""
        yield from self._against_support()
        yield from following_position(self.s, self.v, self.s_ref.value, self.exact, self.f_crit)

    def initial(self) -> Equations:
        """The filter starts on the signal."""
        if not self.exact:
            yield self.s == self.s_ref.value


class Speed(OneFlangeAndSupport):
    """Prescribes the speed of a rod by a signal.

    exact: v = v_ref, which must be differentiable as often as the model needs

    Otherwise v follows v_ref through a first-order filter with the critical frequency f_crit:
    der(v) = 2 pi f_crit (v_ref - v),  starting at v = v_ref
    """

    boundary: ClassVar[bool] = True
    exact: bool = False
    f_crit: Parameter = parameter("Hz", "Critical frequency of the filter", default=50.0, above=0)
    v_ref: Input = signal_input("m/s", "Speed of the flange against the support")
    s: Variable = variable("m", "Position of the flange against the support", start=0.0)
    v: Variable = variable("m/s", "Speed of the flange against the support", start=0.0)

    def equations(self) -> Equations:
        """The signal, or the filtered signal."""
        yield from self._against_support()
        yield from following_speed(self.s, self.v, self.v_ref.value, self.exact, self.f_crit)

    def initial(self) -> Equations:
        """The filter starts on the signal."""
        if not self.exact:
            yield self.v == self.v_ref.value


class Accelerate(OneFlangeAndSupport):
    """Prescribes the acceleration of a rod by a signal.

    v = der(s),  a = der(v) = a_ref
    """

    boundary: ClassVar[bool] = True
    a_ref: Input = signal_input("m/s2", "Acceleration of the flange against the support")
    s: Variable = variable("m", "Position of the flange against the support", start=0.0)
    v: Variable = variable("m/s", "Speed of the flange against the support", start=0.0)
    a: Variable = variable("m/s2", "Acceleration of the flange against the support")

    def equations(self) -> Equations:
        """The signal's acceleration."""
        yield from self._against_support()
        yield self.v == der(self.s)
        yield self.a == der(self.v)
        yield self.a == self.a_ref.value


class Move(OneFlangeAndSupport):
    """Prescribes the position of a rod by a signal whose derivatives are also given as signals.

    s = u_s,  v = der(s) = u_v,  a = der(v) = u_a

    u_s gives the initial position, u_v the initial speed, and u_a moves the rod from then on. If the signals are consistent, u_s and
    u_v hold at every time.
    """

    boundary: ClassVar[bool] = True
    u_s: Input = signal_input("m", "Position of the flange against the support")
    u_v: Input = signal_input("m/s", "Derivative of u_s")
    u_a: Input = signal_input("m/s2", "Derivative of u_v")
    s: Variable = variable("m", "Position of the flange against the support", start=0.0)
    v: Variable = variable("m/s", "Speed of the flange against the support", start=0.0)

    def equations(self) -> Equations:
        """The acceleration signal, integrated."""
        yield from self._against_support()
        yield self.v == der(self.s)
        yield der(self.v) == self.u_a.value

    def initial(self) -> Equations:
        """Position and speed start on their signals."""
        yield self.s == self.u_s.value
        yield self.v == self.u_v.value


class ConstantSpeed(OneFlangeAndSupport):
    """Moves a rod at a constant speed.

    v = der(s) = v_fixed
    """

    boundary: ClassVar[bool] = True
    v_fixed: Parameter = parameter("m/s", "Speed of the flange against the support")
    s: Variable = variable("m", "Position of the flange against the support", start=0.0)
    v: Variable = variable("m/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """A constant."""
        yield from self._against_support()
        yield self.v == der(self.s)
        yield self.v == self.v_fixed
