"""Retarders: wear-free brakes of heavy vehicles."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Variable, parameter, signal_input, variable
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import Dragged

CREEP = 1e-3
"""Smallest speed [rad/s] in the limit of power."""


class Retarder(Dragged):
    """A hydrodynamic retarder on a shaft, with a command from 0 to 1.

    w = der(phi),  tau = flange.tau = command min(tau_max (w/w_full)^2, tau_max, P_max/|w|), against the rotation

    The torque of the full circuit grows with the square of the speed up to the limit of its pressure; at high speed the heat that the
    coolant takes limits it. A command below 0 counts as 0, one above 1 as 1. At rest it has no torque, so it does not hold a vehicle. The
    delay of filling is not included; a ``FirstOrder`` in front of the command adds it. The defaults are invented, for a retarder at the
    output of the gearbox of a heavy truck.
    """

    tau_max: Parameter = parameter("N.m", "Maximum torque", default=3500.0, min=0)
    w_full: Parameter = parameter("rad/s", "Speed from which the torque is the largest", default=70.0, above=0)
    P_max: Parameter = parameter("W", "Maximum power, which the coolant takes", default=350e3, min=0)
    command: Input = signal_input("1", "Share of the torque at the present speed, from 0 to 1", default=0.0)
    tau: Variable = variable("N.m", "Braking torque, flange.tau")

    def equations(self) -> Equations:
        """The least of three torques, each odd in the speed."""
        yield from self._turn()
        slope = ca.fmin(ca.fabs(self.w) / self.w_full, 1) / ca.fmax(ca.fabs(self.w), self.w_full)
        hot = self.P_max / ca.fmax(ca.fabs(self.w), CREEP) ** 2
        yield self.tau == limited(self.command.value) * self.w * ca.fmin(self.tau_max * slope, hot)
        yield self.flange.tau == self.tau
