"""Gearboxes with loss, elasticity and play."""

from __future__ import annotations

from powertrain import Equations, connect, support
from powertrain.components.rotational.backlash import ElastoBacklash
from powertrain.components.rotational.gear import LossyGear
from powertrain.components.rotational.interfaces import TwoFlangesAndSupport
from powertrain.components.thermal import HeatPort


class Gearbox(TwoFlangesAndSupport):
    """A lossy gear at flange_a and, behind it, a shaft with elasticity, damping and play at flange_b; without inertia.

    Connect inertias to its flanges. The losses of both parts leave through the heat port.
    """

    lossyGear: LossyGear
    elastoBacklash: ElastoBacklash
    heat_port: HeatPort = support(HeatPort)

    def equations(self) -> Equations:
        """Gear and shaft in series."""
        yield connect(self.flange_a, self.lossyGear.flange_a)
        yield connect(self.lossyGear.flange_b, self.elastoBacklash.flange_a)
        yield connect(self.elastoBacklash.flange_b, self.flange_b)
        yield connect(self.lossyGear.support, self.support)
        yield connect(self.heat_port, self.lossyGear.heat_port, self.elastoBacklash.heat_port)
