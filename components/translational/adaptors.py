"""Flanges as signals, for blocks that have only inputs and outputs."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Component, Equations, Input, Output, der, port, signal_input, signal_output
from powertrain.components.translational.interfaces import Flange


class ForceToPositionAdaptor(Component):
    """Outputs the motion of a flange as signals and applies a force given by a signal.

    s = flange.s,  v = der(s) if use_v,  a = der(v) if use_a (else 0),  flange.f = f
    """

    boundary: ClassVar[bool] = True
    use_v: bool = True
    use_a: bool = True
    flange: Flange = port(Flange)
    s: Output = signal_output("m", "Position of the flange")
    v: Output = signal_output("m/s", "Speed of the flange")
    a: Output = signal_output("m/s2", "Acceleration of the flange")
    f: Input = signal_input("N", "Force that the outer block takes from the flange, flange.f")

    def equations(self) -> Equations:
        """Motion out, force in."""
        yield self.s.value == self.flange.s
        yield self.v.value == (der(self.flange.s) if self.use_v else 0)
        yield self.a.value == (der(der(self.flange.s)) if self.use_a else 0)
        yield self.flange.f == self.f.value


class PositionToForceAdaptor(Component):
    """Prescribes the position of a flange by a signal and outputs the force required.

    flange.s = s,  f = -flange.f

    Speed and acceleration follow by differentiation of s.
    """

    boundary: ClassVar[bool] = True
    flange: Flange = port(Flange)
    s: Input = signal_input("m", "Position of the flange")
    f: Output = signal_output("N", "Force that drives what is connected to the flange, -flange.f")

    def equations(self) -> Equations:
        """Motion in, force out."""
        yield self.flange.s == self.s.value
        yield self.f.value == -self.flange.f
