"""Worm gears and screws with thread friction, which may be self-locking, and a rack and pinion."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Equations,
    Parameter,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    switch,
    variable,
)
from powertrain.components.rotational.gear import LossyPair
from powertrain.components.rotational.interfaces import Lossy
from powertrain.components.rotational.rolling import RotationToTranslation


def thread_efficiencies(lead: Symbol, mue: Symbol, alpha: Symbol) -> tuple[Symbol, Symbol]:
    """Efficiency if the thread drives and if it is driven (not above zero: self-locking), from its angles in rad."""
    rho = ca.atan(mue / ca.cos(alpha))
    return ca.tan(lead) / ca.tan(lead + rho), ca.tan(lead - rho) / ca.tan(lead)


def flank_losses(load: Symbol, eta_1: Symbol, eta_2: Symbol) -> tuple[Symbol, Symbol]:
    """The torque at the thread in excess of the ``load``, for backward and for forward motion.

    The load determines the loaded flank. Moved against the load the thread requires load/eta_1, moved with it eta_2 load. That is negative
    for eta_2 < 0, because a self-locking thread must be driven in that direction, too.
    """
    against, along = load * (1 / eta_1 - 1), load * (eta_2 - 1)
    lifts = load >= 0
    return switch(lifts, along, against, continuous=True), switch(lifts, against, along, continuous=True)


class WormGear(LossyPair):
    """A worm (flange_a) that drives a wheel (flange_b), with thread friction; self-locking if the lead is small.

    phi_a = ratio phi_b,  load = -flange_b.tau/ratio,  flange_a.tau = load + tauLoss,  rho = atan(mue/cos(alpha))
    w_a load > 0: flange_a.tau = load/eta_1,  eta_1 = tan(lead)/tan(lead + rho)
    w_a load < 0: flange_a.tau = load eta_2,  eta_2 = tan(lead - rho)/tan(lead)
    w_a = 0: flange_a.tau anywhere between the two

    With lead <= rho the efficiency eta_2 is not positive: the wheel cannot turn the worm at any torque, and lowering a load requires a
    torque. The law is that of ``LossyGear``, expressed by the torque at the wheel, so it also holds for eta_2 <= 0. With
    lead + rho >= pi/2 the worm cannot turn the wheel: it would jam in motion as soon as the load changes sides, an impact that rigid teeth
    cannot represent. Such parameters are rejected. A left-handed worm has a negative ratio. The shafts cross; the housing takes the full
    torque of each.
    Source: G. Niemann, H. Winter, Maschinenelemente III, 2nd ed., Springer 1986, ch. 24.

    Errors: ParameterError if the worm cannot turn the wheel.
    """

    lead: Parameter = parameter("rad", "Lead angle of the worm", above=0, max=1.2)
    mue: Parameter = parameter("1", "Coefficient of friction in the mesh", default=0.05, min=0, max=1)
    alpha: Parameter = parameter("rad", "Pressure angle in the normal section", default=math.radians(20), min=0, max=1)
    load: Variable = variable("N.m", "Torque of the wheel, counted at the worm without loss")

    def check(self) -> Equations:
        """The worm must be able to turn the wheel: tan(lead) tan(rho) < 1."""
        yield self.mue * ca.tan(self.lead) < ca.cos(self.alpha)  # else the worm cannot turn the wheel

    def equations(self) -> Equations:
        """The loss of the loaded flank."""
        yield self.load == -self.flange_b.tau / self.ratio
        yield from self._mesh(*flank_losses(self.load, *thread_efficiencies(self.lead, self.mue, self.alpha)))


class _LossyR2T(RotationToTranslation, Lossy):
    """Partial: a shaft that moves a rod, with a loss counted at the shaft."""

    phi: Variable = variable("rad", "Angle of the shaft against its support")
    w: Variable = variable("rad/s", "Speed of the shaft against its support")
    load: Variable = variable("N.m", "Force of the rod, counted at the shaft without loss")
    tauLoss: Variable = variable("N.m", "Torque loss at the shaft")

    def _moves(self, path: Symbol) -> Equations:
        """The rod moves by ``path`` [m] per radian."""
        yield from self._against_supports()
        yield self.phi == self.flangeR.phi - self.supportR.phi
        yield self.flangeT.s - self.supportT.s == path * self.phi
        yield self.w == der(self.phi)
        yield self.load == -path * self.flangeT.f
        yield self.flangeR.tau == self.load + self.tauLoss

    def _rubs(self, eta_1: Symbol, eta_2: Symbol) -> Equations:
        yield friction(self.w, self.tauLoss, *flank_losses(self.load, eta_1, eta_2))
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque loss times speed."""
        return self.tauLoss * self.w


class RackAndPinion(_LossyR2T):
    """A pinion (flangeR) that moves a rack (flangeT), or is moved by it, with a constant efficiency.

    flangeT.s - supportT.s = radius (flangeR.phi - supportR.phi),  load = -radius flangeT.f,  flangeR.tau = load + tauLoss
    w load > 0: flangeR.tau = load/efficiency;  w load < 0: flangeR.tau = load efficiency;  w = 0: between the two

    Without loss it is ``IdealGearR2T`` with the ratio 1/radius. A negative radius is for a rack on the other side of the pinion.
    """

    radius: Parameter = parameter("m", "Pitch radius of the pinion", exclude=(0.0,))
    efficiency: Parameter = parameter("1", "Output power over input power", default=1.0, above=0, max=1)

    def equations(self) -> Equations:
        """A gear with a straight wheel."""
        yield from self._moves(self.radius)
        yield from self._rubs(self.efficiency, self.efficiency)


class Screw(_LossyR2T):
    """A screw (flangeR) that moves its nut (flangeT), with friction in the thread and at a collar; self-locking if the lead is small.

    flangeT.s - supportT.s = p/(2 pi) (flangeR.phi - supportR.phi),  tan(lead) = |p|/(pi d),  rho = atan(mue/cos(alpha))
    load = -p/(2 pi) flangeT.f,  flangeR.tau = load + tauLoss,  collar = pi d_collar mue_collar/|p|
    w load > 0: flangeR.tau = load (tan(lead + rho)/tan(lead) + collar)
    w load < 0: flangeR.tau = load (tan(lead - rho)/tan(lead) - collar)
    w = 0: between the two

    alpha is half of the thread's angle: 0 for a square, 15 degrees for a trapezoidal, 30 degrees for a metric thread. A left-handed thread
    has a negative p. A thread so steep that lead + rho >= pi/2 cannot move its nut; such parameters are rejected, as for ``WormGear``.
    The collar bears the force of the nut and turns on the support; with d_collar = 0, the default, it rubs nothing.

    Source: R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill 2011, sec. 8-2. Errors:
    ParameterError if the screw cannot move the nut.
    """

    p: Parameter = parameter("m", "Lead, path of the nut in a turn", exclude=(0.0,))
    d: Parameter = parameter("m", "Pitch diameter", above=0)
    mue: Parameter = parameter("1", "Coefficient of friction in the thread", default=0.1, min=0, max=1)
    alpha: Parameter = parameter("rad", "Angle of the flank against the normal", default=0.0, min=0, max=1)
    d_collar: Parameter = parameter("m", "Mean diameter of the thrust collar", default=0.0, min=0)
    mue_collar: Parameter = parameter("1", "Coefficient of friction at the collar", default=0.1, min=0, max=1)

    def check(self) -> Equations:
        """The screw must be able to move the nut: tan(lead) tan(rho) < 1."""
        yield self.mue * ca.fabs(self.p) < math.pi * self.d * ca.cos(self.alpha)  # else the screw cannot move the nut

    def equations(self) -> Equations:
        """A wedge wound around a cylinder, and a ring that rubs."""
        yield from self._moves(self.p / (2 * math.pi))
        turn = ca.fabs(self.p)
        eta_1, eta_2 = thread_efficiencies(ca.atan(turn / (math.pi * self.d)), self.mue, self.alpha)
        collar = math.pi * self.d_collar * self.mue_collar / turn
        yield from self._rubs(eta_1 / (1 + collar * eta_1), eta_2 - collar)
