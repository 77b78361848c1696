"""Cone synchronisers with a blocking ring and dogs."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Discrete,
    Equations,
    Parameter,
    Symbol,
    Variable,
    discrete,
    friction,
    parameter,
    port,
    reinit,
    support,
    unilateral,
    variable,
    when,
)
from powertrain.components.rotational.interfaces import FrictionCoupling
from powertrain.components.translational.interfaces import Flange as LinearFlange

CLEARANCE = 1e-4
"""Distance [m] from a row of teeth at which the sleeve reaches it."""


class Synchroniser(FrictionCoupling):
    """A gear wheel (flange_a), the hub of its shaft (flange_b), and between them a cone, a blocking ring and dogs, shifted by a sleeve.

    x = direction (sleeve.s - supportT.s),  w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau
      F >= 0: force of the sleeve on the stop that blocks it, at s_ring, then at s_dog, then at s_end
    1. x = s_ring: the ring blocks. |tau| <= cones mue F radius/sin(angle), and tau takes w_rel to zero
    2. F index > |tau| + tau_ring: the chamfers turn the ring aside and the sleeve passes,
       index = chamfer_radius (cos(chamfer) - mue_chamfer sin(chamfer))/(sin(chamfer) + mue_chamfer cos(chamfer))
    3. x = s_dog and |w_rel| < w_in: the dogs engage; |tau| = tau_in removes the rest of w_rel, then |tau| <= tau_max;
       at a higher speed they ratchet and the sleeve waits
      back at x < s_dog the dogs are out, back at x < s_ring the ring blocks again
      at the start: the sleeve has passed the ring if x > s_ring, and the dogs are in if x > s_dog

    While the cone slides, its torque holds the ring against the chamfers. The ring blocks until the speeds are equal if ``index`` is below
    the cone's torque per unit of F, cones mue radius/sin(angle); otherwise the sleeve passes at once and the dogs ratchet. Once the cone
    sticks, its torque is only what the wheel's drag requires; a drag above F index keeps the shift blocked, as on a cold day.
    ``direction`` = -1 is for the wheel on the other side of a sleeve. The sleeve needs mass; its stops are rigid. The angle between dogs is
    assumed to be small.
    Sources: H. Naunheimer et al., Automotive Transmissions, 2nd ed., Springer 2011, ch. 9; R. J. Socin, L. K. Walters, Manual
    Transmission Synchronizers, SAE 680008, 1968.

    Errors: ParameterError if the cone would stick (tan(angle) <= mue), no force would turn the ring aside (index <= 0) or the positions
    are not in order; InitializationError for a start beyond s_end.
    """

    sleeve: LinearFlange = port(LinearFlange)
    supportT: LinearFlange = support(LinearFlange)
    direction: Parameter = parameter(
        "1", "1: engages at sleeve.s > 0, -1: at sleeve.s < 0", default=1.0, exclude=(0.0,)
    )
    mue: Parameter = parameter("1", "Coefficient of friction of the cone", default=0.1, min=0)
    radius: Parameter = parameter("m", "Mean radius of the cone", default=0.035, above=0)
    angle: Parameter = parameter("rad", "Half of the cone's opening angle", default=math.radians(6.5), above=0, max=1.5)
    cones: Parameter = parameter("1", "Friction cones that act in parallel", default=1.0, above=0)
    chamfer: Parameter = parameter(
        "rad", "Angle of the ring's chamfers against the axis", default=math.radians(55), above=0, max=1.5
    )
    mue_chamfer: Parameter = parameter("1", "Coefficient of friction of the chamfers", default=0.09, min=0)
    chamfer_radius: Parameter = parameter("m", "Radius of the chamfers", default=0.042, above=0)
    tau_ring: Parameter = parameter("N.m", "Torque that turns the ring aside", default=0.1, above=0)
    s_ring: Parameter = parameter("m", "Position of the sleeve at the ring", default=2e-3, above=0)
    s_dog: Parameter = parameter("m", "Position of the sleeve at the dogs", default=5e-3, above=0)
    s_end: Parameter = parameter("m", "Position of the sleeve with the dogs engaged", default=9e-3, above=0)
    w_in: Parameter = parameter("rad/s", "Speed difference below which the dogs engage", default=3.0, above=0)
    tau_in: Parameter = parameter(
        "N.m", "Torque of the dogs' chamfers on a wheel that still slides", default=100.0, above=0
    )
    tau_max: Parameter = parameter("N.m", "Torque capacity of the dogs", default=3000.0, above=0)
    passed: Discrete = discrete("1", "1: the sleeve is past the ring", start=0.0)
    inside: Discrete = discrete("1", "1: the dogs are engaged", start=0.0)
    x: Variable = variable("m", "Path of the sleeve towards the wheel")
    F: Variable = variable("N", "Force of the sleeve on ring, dogs or stop")

    def check(self) -> Equations:
        """Cone and chamfers must not lock themselves, the positions be in order, the direction be 1 or -1, and the dogs hold."""
        yield ca.tan(self.angle) > self.mue  # else the cone sticks
        yield self.mue_chamfer * ca.tan(self.chamfer) < 1  # else no force turns the ring aside
        yield self.s_ring < self.s_dog
        yield self.s_dog < self.s_end
        yield self.direction * self.direction == 1.0  # 1 or -1
        yield self.tau_in <= self.tau_max  # the dogs hold

    def equations(self) -> Equations:
        """A sleeve with several stops, and friction that depends on its force and position."""
        yield from self._transmit()
        yield self.x == self.direction * (self.sleeve.s - self.supportT.s)
        yield self.sleeve.f == self.direction * self.F
        yield self.supportT.f == -self.sleeve.f
        way = self.s_ring + self.passed * (self.s_dog - self.s_ring) + self.inside * (self.s_end - self.s_dog)
        yield unilateral(way - self.x, self.F, name="stop")
        limit = (1 - self.passed) * self._cone() * self.F + self.inside * self.tau_in
        held = 1 + self.inside * (self.tau_max / self.tau_in - 1)
        yield friction(self.w_rel, self.tau, -limit, limit, peak=held)
        yield from self._shift()
        yield from self._dissipate()

    def _shift(self) -> Equations:
        turned = self.F * self._index() > ca.fabs(self.tau) + self.tau_ring
        yield when(ca.logic_and(turned, self.passed < 0.5), reinit(self.passed, 1), name="ring passed", initially=True)
        reach = ca.logic_and(self.x > self.s_dog - CLEARANCE, ca.fabs(self.w_rel) < self.w_in)
        yield when(ca.logic_and(reach, self.passed > 0.5), reinit(self.inside, 1), name="dogs in", initially=True)
        yield when(self.x < self.s_dog - 2 * CLEARANCE, reinit(self.inside, 0), name="dogs out", initially=True)
        yield when(self.x < self.s_ring - 2 * CLEARANCE, reinit(self.passed, 0), name="ring free", initially=True)

    def initial(self) -> Equations:
        """A sleeve that a run starts beyond the ring, or beyond the edge of the dogs, has passed it before."""
        for place, state in ((self.s_ring, self.passed), (self.s_dog, self.inside)):
            yield state == ca.if_else(self.x > place + CLEARANCE, 1.0, 0.0)

    def _cone(self) -> Symbol:
        return self.cones * self.mue * self.radius / ca.sin(self.angle)

    def _index(self) -> Symbol:
        sine, cosine = ca.sin(self.chamfer), ca.cos(self.chamfer)
        return self.chamfer_radius * (cosine - self.mue_chamfer * sine) / (sine + self.mue_chamfer * cosine)

    def torques_per_force(self) -> tuple[float, float]:
        """Cone torque and index torque per force of the sleeve [N.m/N]: the ring blocks if the first is larger.

        >>> [round(torque, 4) for torque in Synchroniser().torques_per_force()]
        [0.0309, 0.0241]
        """
        return float(self._cone()), float(self._index())
