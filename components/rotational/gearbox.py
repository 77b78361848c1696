"""Gearboxes with loss, elasticity and play."""

from __future__ import annotations

from typing import Self

from powertrain import Equations, Variable, connect, support, variable
from powertrain.components.rotational.backlash import ElastoBacklash
from powertrain.components.rotational.gear import LossTable, LossyGear
from powertrain.components.rotational.interfaces import TwoFlangesAndSupport
from powertrain.components.thermal import HeatPort


class Gearbox(TwoFlangesAndSupport):
    """A lossy gear at flange_a and, behind it, a shaft with elasticity, damping and play at flange_b; without inertia.

    phi_rel = flange_b.phi - lossyGear.flange_b.phi,  w_rel = der(phi_rel)

    Connect inertias to its flanges. The losses of both parts leave through the heat port. ``of`` takes the parameters of the parts.
    """

    lossyGear: LossyGear
    elastoBacklash: ElastoBacklash
    heat_port: HeatPort = support(HeatPort)
    phi_rel: Variable = variable("rad", "Twist of the shaft with its play")
    w_rel: Variable = variable("rad/s", "Speed of the twist, der(phi_rel)")

    @classmethod
    def of(
        cls,
        *,
        ratio: float,
        c: float,
        d: float,
        b: float = 0.0,
        lossTable: LossTable = ((0.0, 1.0, 1.0, 0.0, 0.0),),
    ) -> Self:
        """A gearbox from its data.

        Parameters
        ----------
        ratio : float
            Transmission ratio, speed of flange_a over speed of flange_b [1].
        c : float
            Stiffness of the shaft at flange_b [N.m/rad].
        d : float
            Damping of the shaft [N.m.s/rad].
        b : float
            Backlash from contact to contact [rad].
        lossTable : tuple of tuple of float
            Losses over speed, as in ``LossyGear``.
        """
        return cls(lossyGear=LossyGear(ratio=ratio, lossTable=lossTable), elastoBacklash=ElastoBacklash(c=c, d=d, b=b))

    def equations(self) -> Equations:
        """Gear and shaft in series."""
        yield connect(self.flange_a, self.lossyGear.flange_a)
        yield connect(self.lossyGear.flange_b, self.elastoBacklash.flange_a)
        yield connect(self.elastoBacklash.flange_b, self.flange_b)
        yield connect(self.lossyGear.support, self.support)
        yield connect(self.heat_port, self.lossyGear.heat_port, self.elastoBacklash.heat_port)
        yield self.phi_rel == self.elastoBacklash.phi_rel
        yield self.w_rel == self.elastoBacklash.w_rel
