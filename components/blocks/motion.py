"""Point-to-point motions."""

from __future__ import annotations

import casadi as ca

from powertrain import Component, Equations, Output, Parameter, parameter, signal_output, switch, time

SMALL = 1e-300
"""A speed or a time that avoids a division by zero."""


class KinematicPTP(Component):
    """The fastest motion over deltaq within limits of speed and acceleration.

    qdd = a for the time t_1 = v/a, 0 until T - t_1, -a until T;  v = min(qd_max, root(a |deltaq|)),  T = |deltaq|/v + t_1,  a = qdd_max

    All quantities have the sign of deltaq. If the distance is too short to reach qd_max, v is the speed reached, and deceleration
    follows acceleration directly. Source: Modelica Standard Library 4.0.0, Blocks.Sources.KinematicPTP2, for one axis.
    """

    deltaq: Parameter = parameter("1", "Displacement")
    qd_max: Parameter = parameter("1/s", "Maximum speed", above=0)
    qdd_max: Parameter = parameter("1/s2", "Maximum acceleration", above=0)
    startTime: Parameter = parameter("s", "Start time", default=0.0)
    q: Output = signal_output("1", "Position")
    qd: Output = signal_output("1/s", "Speed")
    qdd: Output = signal_output("1/s2", "Acceleration")

    def equations(self) -> Equations:
        """Four phases."""
        way, a = ca.fabs(self.deltaq), self.qdd_max
        v = ca.fmin(self.qd_max, ca.sqrt(a * way))
        ramp = v / a
        t, T = time - self.startTime, way / ca.fmax(v, SMALL) + ramp
        rest = T - t
        ends = t < 0, t < ramp, rest > ramp, rest > 0
        sign = ca.sign(self.deltaq)
        phases = (
            (self.q, (0, a * t**2 / 2, v * (t - ramp / 2), way - a * rest**2 / 2, way)),
            (self.qd, (0, a * t, v, a * rest, 0)),
            (self.qdd, (0, a, 0, -a, 0)),
        )
        for signal, values in phases:
            value = values[-1]
            for end, before in zip(reversed(ends), reversed(values[:-1]), strict=True):
                value = switch(end, before, value)
            yield signal.value == sign * value
