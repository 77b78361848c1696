"""Gears with losses: constant efficiency, or a table of losses over speed."""

from __future__ import annotations

import math
from typing import TypeAlias

import casadi as ca

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    variable,
)
from powertrain.components.driving_side import mesh_losses
from powertrain.components.friction_table import at_speed
from powertrain.components.rotational.interfaces import Lossy, TwoShaftsAndSupport

LossTable: TypeAlias = tuple[tuple[float, float, float, float, float], ...]
"""Rows (speed from 0 up, efficiencies if flange_a and if flange_b drives, bearing frictions in either case)."""
EFFICIENCIES, ANY = (1e-6, 1.0), (-math.inf, math.inf)
ROUNDING = 1e-12
"""Relative difference up to which bearing frictions are equal."""
LEAST = -1e-12
"""Largest value of eta_mf1 - 1/eta_mf2 that counts as a mesh loss."""


class LossyPair(TwoShaftsAndSupport, Lossy):
    """Partial: a gear pair with the loss torque tauLoss at flange_a."""

    ratio: Parameter = parameter("1", "Transmission ratio, speed of flange_a over speed of flange_b", exclude=(0.0,))
    w_a: Variable = variable("rad/s", "Speed of flange_a against the support")
    tauLoss: Variable = variable("N.m", "Torque loss at flange_a")

    def _mesh(self, backward: Symbol, forward: Symbol) -> Equations:
        """The torque loss is ``backward`` or ``forward`` depending on the direction of rotation, and anything between them at rest."""
        yield from self._angles()
        yield self.phi_a == self.ratio * self.phi_b
        yield self.w_a == der(self.phi_a)
        yield self.flange_b.tau + self.ratio * (self.flange_a.tau - self.tauLoss) == 0
        yield friction(self.w_a, self.tauLoss, backward, forward)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque loss times speed."""
        return self.tauLoss * self.w_a


class Gear(LossyPair):
    """A gear pair with a constant efficiency, whichever side drives.

    phi_a = ratio phi_b,  flange_b.tau = -ratio (flange_a.tau - tauLoss),  output power = efficiency input power:
    tauLoss = (1 - efficiency) flange_a.tau if flange_a drives, (1 - 1/efficiency) flange_a.tau if flange_b drives

    At rest the mesh holds while its torques are between the two: to start, one side must exceed the other by 1/efficiency.
    """

    efficiency: Parameter = parameter("1", "Output power over input power", default=1.0, min=1e-6, max=1)

    def equations(self) -> Equations:
        """The loss opposes the motion and grows with the driving torque."""
        yield from self._mesh(*mesh_losses(self.flange_a.tau, self.efficiency, self.efficiency))


class LossyGear(LossyPair):
    """A gear pair with mesh efficiencies and bearing friction that depend on speed and on the driving side.

    phi_a = ratio phi_b,  flange_b.tau = -ratio (flange_a.tau - tauLoss)
    flange_a drives: tauLoss = (1 - eta_mf1) flange_a.tau + tau_bf1 sign(w_a)
    flange_b drives: tauLoss = (1 - 1/eta_mf2) flange_a.tau + tau_bf2 sign(w_a)
    w_a = 0: tauLoss anywhere between its values for forward and backward motion

    ``lossTable``: rows (|w_a| rad/s, eta_mf1, eta_mf2, |tau_bf1| N.m, |tau_bf2| N.m), linear between them and beyond
    the last: mesh efficiency if flange_a and if flange_b drives, bearing friction at flange_a in either case.
    The driving side changes where the mesh carries no torque:
    flange_a.tau = sign(w_a) (tau_bf1 - tau_bf2)/(eta_mf1 - 1/eta_mf2).
    Source: Pelchen, Schweiger and Otter: Modeling and Simulating the Efficiency of Gearboxes and of Planetary Gearboxes, Modelica
    Conference 2002, with the driving side found from the mesh torque (Bertsch 2009).
    Errors: ParameterError for efficiencies outside [1e-6, 1], and if a row has no mesh loss but two different bearing torques, which is
    impossible.
    """

    lossTable: LossTable = ((0.0, 1.0, 1.0, 0.0, 0.0),)

    def equations(self) -> Equations:
        """The four quadrants of speed and torque."""
        eta1, eta2, bearing1, bearing2 = self._losses()
        at_a = _bearing_at_a(eta1, eta2, bearing1, bearing2)
        yield from self._mesh(*mesh_losses(self.flange_a.tau, eta1, eta2, (bearing1, bearing2), at_a))

    def _losses(self) -> tuple[Symbol, Symbol, Symbol, Symbol]:
        """The columns of the table at |w_a|."""
        for row in self.lossTable:
            if row[1] == row[2] == 1 and not math.isclose(abs(row[3]), abs(row[4]), rel_tol=ROUNDING):
                raise ParameterError(
                    f"{self._label}.lossTable: the row {row} has no mesh loss, so its bearing friction cannot "
                    f"depend on the side that drives ({row[3]:g} N.m and {row[4]:g} N.m)"
                )
        eta1, eta2 = (at_speed(self, "lossTable", self.w_a, ("rad/s", "1"), i, EFFICIENCIES) for i in (1, 2))
        b1, b2 = (at_speed(self, "lossTable", self.w_a, ("rad/s", "N.m"), i, ANY) for i in (3, 4))
        return eta1, eta2, ca.fabs(b1), ca.fabs(b2)


def _bearing_at_a(eta1: Symbol, eta2: Symbol, bearing1: Symbol, bearing2: Symbol) -> Symbol:
    """The part of the bearing friction on the side of flange_a; half of it if the mesh has no loss."""
    mesh = eta1 - 1 / eta2
    if mesh.is_constant() and float(mesh) > LEAST:
        return bearing1 / 2
    if mesh.is_constant():
        return (bearing1 - bearing2) / mesh
    # Without mesh loss the two bearing frictions are equal; LEAST makes the result bearing1/2, without a jump.
    return (bearing1 - bearing2 + LEAST * bearing1 / 2) / ca.fmin(mesh, LEAST)
