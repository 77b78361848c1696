"""Geared axle differentials, open and with limited slip, and the crown wheel that drives them."""

from __future__ import annotations

from typing import Self

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    connect,
    der,
    friction,
    parameter,
    support,
    switch,
    variable,
)
from powertrain.components.differentials.interfaces import SymmetricDifferential
from powertrain.components.differentials.mesh import Mesh
from powertrain.components.differentials.teeth import pair_ratio
from powertrain.components.driving_side import mesh_losses
from powertrain.components.rotational.gear import LossyPair
from powertrain.components.rotational.interfaces import Lossy
from powertrain.components.thermal import HeatPort


class BevelDifferential(SymmetricDifferential):
    """The open bevel-gear differential: equal side wheels on bevel planets in a cage, which the crown wheel turns.

    w_left + w_right = 2 w_crown,  left.tau + right.tau + crown.tau = 0
    The mesh law with R_o = -1: left.tau = right.tau without loss. With loss the slower side gets 1/eta of what the faster side gets if the
    crown wheel drives; in overrun the faster side gives 1/eta of what the slower side gives.

    There is no loss while both sides turn as fast as the crown wheel. It has no inertia: connect inertias to its flanges.
    """

    eta: Parameter = parameter(
        "1", "Efficiency from one side wheel to the other, cage fixed", default=1.0, above=0, max=1
    )
    heat_port: HeatPort = support(HeatPort)
    mesh: Mesh = Mesh(ratio=-1)

    def equations(self) -> Equations:
        """A symmetric fundamental differential."""
        yield self.mesh.eta_ab == self.eta
        yield self.mesh.eta_ba == self.eta
        yield connect(self.left, self.mesh.a)
        yield connect(self.right, self.mesh.b)
        yield connect(self.crown, self.mesh.carrier)
        yield connect(self.heat_port, self.mesh.heat_port)


class LimitedSlipDifferential(SymmetricDifferential, Lossy):
    """A differential with friction against a speed difference between its sides: a preload and a part that increases with the torque.

    w_left + w_right = 2 w_crown,  left.tau + right.tau + crown.tau = 0,  w_rel = w_left - w_right,  tau = (left.tau - right.tau)/2
    w_rel > 0: tau = limit;  w_rel < 0: tau = -limit;  w_rel = 0: |tau| <= limit
    limit = preload + lock |crown.tau|/2,  lock = (bias - 1)/(bias + 1)

    Power in is crown.tau w_crown + left.tau w_left + right.tau w_right = tau w_rel, which is lost. ``preload`` is the torque that turns
    one side while the other is held and the cage is free. ``bias`` is the torque-bias ratio, larger over smaller side torque without
    preload: 1 for an open differential, 2.5 to 5 for helical (Torsen-like) differentials, often higher in traction than in coasting. The
    defaults are a mild one of a passenger car; ``preload=0, bias_drive=1, bias_coast=1`` is open.
    This corresponds to a carrier-fixed efficiency of 1/bias in the mesh law: with both shafts loaded in the same direction, the two
    laws are equal.
    """

    preload: Parameter = parameter("N.m", "Torque between one side and the other without load", default=20.0, min=0)
    bias_drive: Parameter = parameter("1", "Torque-bias ratio while crown.tau > 0", default=2.5, min=1)
    bias_coast: Parameter = parameter("1", "Torque-bias ratio while crown.tau < 0", default=1.5, min=1)
    w_rel: Variable = variable("rad/s", "Speed of the left side against the right side", prefer=True)
    tau: Variable = variable("N.m", "Friction torque, half the difference of the sides' torques")

    def equations(self) -> Equations:
        """Symmetric kinematics, and friction between the sides."""
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield self.w_rel == der(self.left.phi - self.right.phi)
        yield self.left.tau == self.tau - self.crown.tau / 2
        yield self.right.tau == -self.tau - self.crown.tau / 2
        drive, coast = (self.crown.tau / 2 * (bias - 1) / (bias + 1) for bias in (self.bias_drive, self.bias_coast))
        limit = self.preload + switch(self.crown.tau >= 0, drive, -coast, continuous=True)
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel


class CrownGear(LossyPair):
    """A pinion (flange_a) that drives a crown wheel (flange_b), bevel or hypoid.

    phi_a = ratio phi_b,  flange_b.tau = -ratio eta_ab flange_a.tau if the pinion drives, -ratio flange_a.tau/eta_ba if the crown wheel
    drives

    ratio < 0 if the crown wheel is on the other side of the pinion, +-1 for a mitre gear. The shafts are at right angles, so the
    housing takes the full torque of each about its own axis.
    """

    eta_ab: Parameter = parameter("1", "Efficiency if the pinion drives", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency if the crown wheel drives", default=1.0, above=0, max=1)

    def equations(self) -> Equations:
        """The loss of the side that drives."""
        yield from self._mesh(*mesh_losses(self.flange_a.tau, self.eta_ab, self.eta_ba))

    @classmethod
    def from_teeth(cls, pinion: int, crown: int, *, eta_ab: float = 1.0, eta_ba: float = 1.0) -> Self:
        """A crown gear of ratio crown/pinion.

        Parameters
        ----------
        pinion, crown : int
            Numbers of teeth.
        eta_ab, eta_ba : float
            Efficiencies if the pinion drives, and if the crown wheel drives [1].

        Raises
        ------
        ParameterError
            If the crown wheel is smaller than the pinion.
        """
        ratio = pair_ratio(pinion, crown)
        if crown < pinion:
            raise ParameterError(
                f"a crown wheel of {crown} teeth is smaller than its pinion of {pinion}: exchange them, or use a gear pair"
            )
        return cls(ratio=ratio, eta_ab=eta_ab, eta_ba=eta_ba)
