"""Eddy-current brakes."""

from __future__ import annotations

from powertrain import Equations, Parameter, Variable, parameter, variable
from powertrain.components.characteristics import eddy_current, resistance
from powertrain.components.rotational.interfaces import Dragged


class EddyCurrentTorque(Dragged):
    """An eddy-current brake disc; the hotter the disc, the higher the speed of its largest torque.

    tau = flange.tau = 2 tau_nominal v/(1 + v^2),  v = w/(w_nominal R(T)/R(TRef)),  w = der(phi)
    R(T)/R(TRef) = 1 + alpha (T - TRef) with T of the heat port and alpha = alpha20/(1 + alpha20 (TRef - 293.15 K))

    Errors: ParameterError if R(TRef) is not positive; a simulation ends if R(T) is not: alpha20 applies near 293.15 K.
    """

    tau_nominal: Parameter = parameter("N.m", "Maximum torque; it brakes in both directions", min=0)
    w_nominal: Parameter = parameter("rad/s", "Speed of the maximum torque at TRef", above=0)
    TRef: Parameter = parameter("K", "Reference temperature of w_nominal", default=293.15, min=0)
    alpha20: Parameter = parameter("1/K", "Temperature coefficient of the disc's resistance at 293.15 K", default=0.0)
    tau: Variable = variable("N.m", "Braking torque, flange.tau")

    def check(self) -> Equations:
        """The resistance at TRef must be positive."""
        yield self.alpha20 * (293.15 - self.TRef) < 1  # the resistance at TRef is positive

    def equations(self) -> Equations:
        """Kloss' characteristic with a slip speed that grows with the disc's resistance."""
        yield from self._turn()
        v = self.w / (self.w_nominal * resistance(self.alpha20, self.heat_port.T, self.TRef))
        yield self.tau == self.tau_nominal * eddy_current(v)
        yield self.flange.tau == self.tau
