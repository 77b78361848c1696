"""Eddy-current brakes."""

from __future__ import annotations

from powertrain import Equations, Parameter, Variable, parameter, variable
from powertrain.components.characteristics import eddy_current, resistance
from powertrain.components.translational.interfaces import Dragged


class EddyCurrentForce(Dragged):
    """An eddy-current brake fin; the hotter the fin, the higher the speed of its largest force.

    f = flange.f = 2 f_nominal x/(1 + x^2),  x = v/(v_nominal R(T)/R(TRef)),  v = der(s)
    R(T)/R(TRef) = 1 + alpha (T - TRef) with T of the heat port and alpha = alpha20/(1 + alpha20 (TRef - 293.15 K))

    Errors: ParameterError if R(TRef) is not positive; a simulation ends if R(T) is not: alpha20 applies near 293.15 K.
    """

    f_nominal: Parameter = parameter("N", "Maximum force; it brakes in both directions", min=0)
    v_nominal: Parameter = parameter("m/s", "Speed of the maximum force at TRef", above=0)
    TRef: Parameter = parameter("K", "Reference temperature of v_nominal", default=293.15, min=0)
    alpha20: Parameter = parameter("1/K", "Temperature coefficient of the fin's resistance at 293.15 K", default=0.0)
    f: Variable = variable("N", "Braking force, flange.f")

    def check(self) -> Equations:
        """The resistance at TRef must be positive."""
        yield self.alpha20 * (293.15 - self.TRef) < 1  # the resistance at TRef is positive

    def equations(self) -> Equations:
        """Kloss' characteristic with a speed of largest force that grows with the fin's resistance."""
        yield from self._move()
        x = self.v / (self.v_nominal * resistance(self.alpha20, self.heat_port.T, self.TRef))
        yield self.f == self.f_nominal * eddy_current(x)
        yield self.flange.f == self.f
