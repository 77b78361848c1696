"""Flanges as signals, for blocks that have only inputs and outputs."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Component, Equations, Input, Output, der, port, signal_input, signal_output
from powertrain.components.rotational.interfaces import Flange


class TorqueToAngleAdaptor(Component):
    """Outputs the motion of a flange as signals and applies a torque given by a signal.

    phi = flange.phi,  w = der(phi) if use_w,  a = der(w) if use_a (else 0),  flange.tau = tau
    """

    boundary: ClassVar[bool] = True
    use_w: bool = True
    use_a: bool = True
    flange: Flange = port(Flange)
    phi: Output = signal_output("rad", "Angle of the flange")
    w: Output = signal_output("rad/s", "Speed of the flange")
    a: Output = signal_output("rad/s2", "Angular acceleration of the flange")
    tau: Input = signal_input("N.m", "Torque that the outer block takes from the flange, flange.tau")

    def equations(self) -> Equations:
        """Motion out, torque in."""
        yield self.phi.value == self.flange.phi
        yield self.w.value == (der(self.flange.phi) if self.use_w else 0)
        yield self.a.value == (der(der(self.flange.phi)) if self.use_a else 0)
        yield self.flange.tau == self.tau.value


class AngleToTorqueAdaptor(Component):
    """Prescribes the angle of a flange by a signal and outputs the torque required.

    flange.phi = phi,  tau = -flange.tau

    Speed and acceleration follow by differentiation of phi.
    """

    boundary: ClassVar[bool] = True
    flange: Flange = port(Flange)
    phi: Input = signal_input("rad", "Angle of the flange")
    tau: Output = signal_output("N.m", "Torque that drives what is connected to the flange, -flange.tau")

    def equations(self) -> Equations:
        """Motion in, torque out."""
        yield self.flange.phi == self.phi.value
        yield self.tau.value == -self.flange.tau
