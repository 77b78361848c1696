"""Brakes of wheels."""

from __future__ import annotations

from powertrain import Equations, Input, Parameter, friction, parameter, signal_input
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import ShaftWithFriction


class WheelBrake(ShaftWithFriction):
    """A friction brake on the shaft of a wheel (or of an axle), applied by a demand from 0 to 1.

    w = der(flange_a.phi - support.phi),  flange_b.phi = flange_a.phi,  flange_a.tau + flange_b.tau = tau
    w > 0: tau = tau_max demand;  w < 0: tau = -tau_max demand;  w = 0: |tau| <= tau_max demand

    A demand below 0 counts as 0, one above 1 as 1. At rest the brake holds.
    """

    tau_max: Parameter = parameter("N.m", "Brake torque at full demand", default=3000.0, min=0)
    demand: Input = signal_input("1", "Brake demand from 0 to 1", default=0.0)

    def equations(self) -> Equations:
        """A shaft pressed against its support."""
        yield from self._turn()
        limit = self.tau_max * limited(self.demand.value)
        yield friction(self.w, self.tau, -limit, limit)
