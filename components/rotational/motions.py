"""Prescribed motions of a shaft, at whatever torque is required."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, Input, Parameter, Variable, der, parameter, signal_input, variable
from powertrain.components.prescribed import following_position, following_speed
from powertrain.components.rotational.interfaces import OneFlangeAndSupport


class Position(OneFlangeAndSupport):
    """Prescribes the angle of a shaft by a signal.

    exact: phi = phi_ref, which must be differentiable as often as the model needs

    Otherwise phi follows phi_ref through a second-order Bessel filter with the critical frequency f_crit:
    phi + 1.3617 w/w_crit + 0.6180 der(w)/w_crit^2 = phi_ref,  w_crit = 2 pi f_crit,  starting at phi = phi_ref
    """

    boundary: ClassVar[bool] = True
    exact: bool = False
    f_crit: Parameter = parameter("Hz", "Critical frequency of the filter", default=50.0, above=0)
    phi_ref: Input = signal_input("rad", "Angle of the flange against the support")
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """The signal, or the filtered signal."""
        yield from self._against_support()
        yield from following_position(self.phi, self.w, self.phi_ref.value, self.exact, self.f_crit)

    def initial(self) -> Equations:
        """The filter starts on the signal."""
        if not self.exact:
            yield self.phi == self.phi_ref.value


class Speed(OneFlangeAndSupport):
    """Prescribes the speed of a shaft by a signal.

    exact: w = w_ref, which must be differentiable as often as the model needs

    Otherwise w follows w_ref through a first-order filter with the critical frequency f_crit:
    der(w) = 2 pi f_crit (w_ref - w),  starting at w = w_ref
    """

    boundary: ClassVar[bool] = True
    exact: bool = False
    f_crit: Parameter = parameter("Hz", "Critical frequency of the filter", default=50.0, above=0)
    w_ref: Input = signal_input("rad/s", "Speed of the flange against the support")
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """The signal, or the filtered signal."""
        yield from self._against_support()
        yield from following_speed(self.phi, self.w, self.w_ref.value, self.exact, self.f_crit)

    def initial(self) -> Equations:
        """The filter starts on the signal."""
        if not self.exact:
            yield self.w == self.w_ref.value


class Accelerate(OneFlangeAndSupport):
    """Prescribes the acceleration of a shaft by a signal.

    w = der(phi),  a = der(w) = a_ref
    """

    boundary: ClassVar[bool] = True
    a_ref: Input = signal_input("rad/s2", "Angular acceleration of the flange against the support")
    w: Variable = variable("rad/s", "Speed of the flange against the support")
    a: Variable = variable("rad/s2", "Angular acceleration of the flange against the support")

    def equations(self) -> Equations:
        """The signal's acceleration."""
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield self.a == der(self.w)
        yield self.a == self.a_ref.value


class Move(OneFlangeAndSupport):
    """Prescribes the angle of a shaft by a signal whose derivatives are also given as signals.

    phi = u_phi,  w = der(phi) = u_w,  a = der(w) = u_a

    u_phi gives the initial angle, u_w the initial speed, and u_a moves the shaft from then on. If the signals are consistent, u_phi and
    u_w hold at every time.
    """

    boundary: ClassVar[bool] = True
    u_phi: Input = signal_input("rad", "Angle of the flange against the support")
    u_w: Input = signal_input("rad/s", "Derivative of u_phi")
    u_a: Input = signal_input("rad/s2", "Derivative of u_w")
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """The acceleration signal, integrated."""
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield der(self.w) == self.u_a.value

    def initial(self) -> Equations:
        """Angle and speed start on their signals."""
        yield self.phi == self.u_phi.value
        yield self.w == self.u_w.value


class ConstantSpeed(OneFlangeAndSupport):
    """Turns a shaft at a constant speed.

    w = der(phi) = w_fixed
    """

    boundary: ClassVar[bool] = True
    w_fixed: Parameter = parameter("rad/s", "Speed of the flange against the support")
    w: Variable = variable("rad/s", "Speed of the flange against the support")

    def equations(self) -> Equations:
        """A constant."""
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield self.w == self.w_fixed
