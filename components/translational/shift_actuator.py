"""Actuators of gear shifts."""

from __future__ import annotations

from typing import ClassVar

from powertrain import Equations, Input, Parameter, Symbol, Variable, der, parameter, port, signal_input, variable
from powertrain.components.limited import limited
from powertrain.components.translational.interfaces import Flange, Lossy


class ShiftActuator(Lossy):
    """A rail with fork and sleeve, moved to a position by a servo with limited force.

    s = flange.s,  v = der(s),  m der(v) = f - d v + flange.f,  f = k (s_ref - s) limited to -f_max..f_max

    It represents a hydraulic, pneumatic or electric shift cylinder with position control, or a driver's hand: against a blocked
    synchroniser the force is f_max. ``d`` is the damping of cylinder and seals, whose power is lost.
    """

    boundary: ClassVar[bool] = True
    flange: Flange = port(Flange)
    s_ref: Input = signal_input("m", "Position to go to")
    m: Parameter = parameter("kg", "Mass of rail, fork and sleeve", default=1.0, above=0)
    f_max: Parameter = parameter("N", "Maximum force", default=800.0, above=0)
    k: Parameter = parameter("N/m", "Gain of the position control", default=1e6, above=0)
    d: Parameter = parameter("N.s/m", "Damping", default=2000.0, min=0)
    s: Variable = variable("m", "Position", start=0.0, prefer=True)
    v: Variable = variable("m/s", "Speed", start=0.0, prefer=True)
    f: Variable = variable("N", "Force of the servo")

    def equations(self) -> Equations:
        """Newton's law and a servo."""
        yield self.s == self.flange.s
        yield self.v == der(self.s)
        yield self.f == limited(self.k * (self.s_ref.value - self.s), -self.f_max, self.f_max)
        yield self.m * der(self.v) == self.f - self.d * self.v + self.flange.f
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Power of the damping."""
        return self.d * self.v**2

    def energy(self) -> Symbol:
        """Kinetic energy m v^2/2."""
        return self.m * self.v**2 / 2
