"""Freewheels."""

from __future__ import annotations

import math

from powertrain import Equations, friction
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates


class Freewheel(CompliantWithRelativeStates):
    """Lets flange_b run ahead of flange_a without torque and drives it before it falls behind.

    w_rel = der(flange_b.phi - flange_a.phi) >= 0,  tau = flange_b.tau = -flange_a.tau <= 0,  tau w_rel = 0
    """

    def equations(self) -> Equations:
        """Free forward, locked backward."""
        yield from self._transmit()
        yield friction(self.w_rel, self.tau, -math.inf, 0.0)
