"""The differential of two circular-arc cams, with rollers in the cage between them, as an acausal component."""

from __future__ import annotations

import math
from typing import Self

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Parameter,
    Symbol,
    Variable,
    arguments_checked,
    der,
    friction,
    parameter,
    variable,
)
from powertrain.components.differentials.interfaces import SymmetricDifferential
from powertrain.components.gearless.circular_cam.design import LEAST_WIDTH, CircularCams
from powertrain.components.gearless.circular_cam.disk import Wear, friction_diameter
from powertrain.components.gearless.circular_cam.locking_law import (
    Sharing,
    disk_coefficient,
    groove_coefficient,
)
from powertrain.components.gearless.circular_cam.track import check_arcs
from powertrain.components.limited import magnitude
from powertrain.components.rotational.interfaces import Lossy

FLOOR = 1e-3
"""Sine of the contact angle below which the rigid rule is bounded; its infinite value at zero cannot be simulated."""
UPRIGHT = math.pi / 2


class RollerMasses(Component):
    """The inertia of the rollers of a circular-cam differential, which climb and turn during relative motion of the sides.

    Their rotation with the cage belongs to the inertia of the cage.
    """

    r_out: Parameter = parameter("m", "Radius of an outer roller", above=0)
    r_in: Parameter = parameter("m", "Radius of an inner roller", above=0)
    m_out: Parameter = parameter("kg", "Mass of an outer roller", above=0)
    J_out: Parameter = parameter("kg.m2", "Moment of inertia of an outer roller about its axis", above=0)
    m_in: Parameter = parameter("kg", "Mass of an inner roller", above=0)
    J_in: Parameter = parameter("kg.m2", "Moment of inertia of an inner roller about its axis", above=0)

    def equations(self) -> Equations:
        """None: the differential moves the rollers."""
        yield from ()

    @classmethod
    @arguments_checked
    def of(cls, cams: CircularCams, density: float = 7850.0) -> Self:
        """Slices of spheres as wide as the tracks' distance: m = rho pi (r^2 b - b^3/12), J = rho pi/2 (r^4 b - r^2 b^3/6 + b^5/80)."""
        values = {"r_out": cams.outer.r, "r_in": cams.inner.r}
        for name, r in (("out", cams.outer.r), ("in", cams.inner.r)):
            b = min((cams.outer.D - cams.inner.D) / 2, 2 * r)
            values[f"m_{name}"] = density * math.pi * (r**2 * b - b**3 / 12)
            values[f"J_{name}"] = density * math.pi / 2 * (r**4 * b - r**2 * b**3 / 6 + b**5 / 80)
        return cls(**values)


class CircularCamDifferential(SymmetricDifferential, Lossy):
    """A differential with two cam disks with circular-arc tracks, and rollers in grooves of the cage between them.

    w_left + w_right = 2 w_crown,  left.tau + right.tau + crown.tau = 0,  w_rel = w_left - w_right,  tau = (left.tau - right.tau)/2
    w_rel > 0: tau = limit;  w_rel < 0: tau = -limit;  w_rel = 0: |tau| <= limit;  limit = kappa(theta) |crown.tau|/2

    The half shafts receive T_L = -left.tau and T_R = -right.tau, so T_R - T_L = 2 tau. The rollers wedge the cams apart. Each cam
    turns at theta' relative to the cage, the left one forward and the right one backward, and its disk has the friction torque kappa
    |crown.tau|/2. With lambda, the outer track's share of the torque,

    kappa = mu D_R (lambda/(D_out tan(alpha_out)) + (1 - lambda)/(D_in tan(alpha_in))) + contribution of the grooves

    The torque-bias ratio is (1 + kappa)/(1 - kappa), the efficiency of the relative motion eta_0 = (1 - kappa)/(1 + kappa). The contact
    angles depend on the phase theta. With p the distance from the phase at which the outer track is level, from 0 to 1 over half an arc
    (pi/n of theta), sin(alpha_out) = p sin(alpha_out max) and sin(alpha_in) = (1 - p) sin(alpha_in max). How kappa changes with the phase
    depends on how the tracks share the load, see ``Sharing``; the rigid rule is bounded at a contact angle of 0.06 degrees.

    For kappa >= 1 it locks: halves at relative rest remain so under any torque of the cage while one shaft is free. A torque on the
    free shaft itself releases them: (kappa - 1)/2 times the cage's torque if the other shaft is held (bench experiment 1), or (kappa
    - 1)/(kappa + 1) times that of the first shaft, in the opposite direction, if the cage is held (experiment 2). While it slides with
    kappa > 1 the faster shaft is decelerated, T_L < 0 for w_rel > 0. With only inertias J at the three shafts, the outer torques determine
    T_C (4/J_crown + (1 - kappa)/J_fast + (1 + kappa)/J_slow) for T_C > 0; for T_C < 0 fast and slow change places. If the bracket is
    negative (a light fast side, a heavy cage), there is no sliding motion, or there are two: the halves seize at once. From rest a
    simulation remains stuck if that is possible. It ends with an error if rotating halves would have to seize instantaneously: put a
    compliant shaft between the crown and the heavy inertia behind it.

    ``masses``: the inertia of the rollers. A roller climbs at D/2 tan(alpha) theta' and turns at D/(2 r cos(alpha)) theta', so the
    relative motion has the kinetic energy I(theta) theta'^2/2,  I = n sum of (D/2)^2 (m tan(alpha)^2 + J/(r cos(alpha))^2), and
    (d(I theta')/dt - I' theta'^2/2)/2 is added to tau in left.tau - right.tau = 2 tau. The inertia forces do not affect the friction.

    Otherwise it has no inertia: connect inertias to its flanges. The defaults are the data of Table 1. Source: C. Provatidis, Eng 4 (2023)
    2309-2335. Errors: ParameterError for contact angles outside (0, 90 degrees), an odd number of rollers, tracks or disks inside out, or
    an unknown name of a rule. ``from_design`` also checks the complete geometry.
    """

    D_out: Parameter = parameter("m", "Mean diameter of the outer track", default=0.085, above=0)
    D_in: Parameter = parameter("m", "Mean diameter of the inner track", default=0.050, above=0)
    alpha_out: Parameter = parameter(
        "rad",
        "Maximum contact angle of the outer track",
        default=math.radians(15),
        above=0,
        max=UPRIGHT,
        exclude=(UPRIGHT,),
    )
    alpha_in: Parameter = parameter(
        "rad",
        "Maximum contact angle of the inner track",
        default=math.radians(27.25),
        above=0,
        max=UPRIGHT,
        exclude=(UPRIGHT,),
    )
    d_out: Parameter = parameter("m", "Outer diameter of the friction disks", default=0.095, above=0)
    d_in: Parameter = parameter("m", "Inner diameter of the friction disks", default=0.045, min=0)
    mu: Parameter = parameter("1", "Coefficient of friction of the disks", default=0.066, min=0)
    mu_groove: Parameter = parameter("1", "Coefficient of friction of the rollers in their grooves", default=0.0, min=0)
    stiffness: Parameter = parameter(
        "1", "Normal stiffness of an inner contact over that of an outer one, for elastic sharing", default=1.0, above=0
    )
    n: int = 4
    masses: RollerMasses | None = None
    sharing: Sharing = "elastic"
    uniform: Wear = "pressure"
    w_rel: Variable = variable("rad/s", "Speed of the left side against the right side", prefer=True)
    theta: Variable = variable("rad", "Phase: angle of the left cam against the cage", prefer=True)
    tau: Variable = variable("N.m", "Friction torque, half the difference of the sides' torques")
    kappa: Variable = variable("1", "Locking coefficient")

    def check(self) -> Equations:
        """The arcs close around the circle; the tracks and the hole of the disk are nested."""
        check_arcs(self.n, type(self).__name__)
        yield self.D_in < self.D_out  # the inner track lies inside
        yield self.d_in < self.d_out  # the hole of the friction disk lies inside
        room, masses = self.D_out - self.D_in, self.masses
        for D, alpha, name in ((self.D_out, self.alpha_out, "r_out"), (self.D_in, self.alpha_in, "r_in")):
            lift = math.pi * D / self.n * ca.tan(alpha / 2)
            least = LEAST_WIDTH * lift  # twice that of a roller of half the lift, the least that keeps the cams apart
            yield least < room  # the tracks leave no width to the rollers otherwise
            spacing = D * math.sin(math.pi / self.n)
            yield lift < spacing  # otherwise neighbouring rollers overlap, whose diameter must exceed the lift
            if masses is not None:
                diameter = 2 * getattr(masses, name)
                yield lift < diameter  # otherwise the cams collide where a hill passes a hill
                yield diameter < spacing  # otherwise neighbouring rollers overlap

    def equations(self) -> Equations:
        """Symmetric kinematics, and load-dependent friction."""
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield 2 * self.theta == self.left.phi - self.right.phi
        yield self.w_rel == 2 * der(self.theta)
        tau = self.tau + self._inertial()
        yield self.left.tau == tau - self.crown.tau / 2
        yield self.right.tau == -tau - self.crown.tau / 2
        yield self.kappa == self._coefficient()
        load = self.crown.tau
        limit = self.kappa / 2 * magnitude(load)
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()

    def _coefficient(self) -> Symbol:
        """The locking coefficient at the phase theta, smooth within each half arc."""
        sharing, friction_force = self.sharing, self.mu * friction_diameter(self.d_out, self.d_in, self.uniform)
        sines = self._mean_sines() if sharing == "averaged" else self._sines()
        floor = FLOOR if sharing == "rigid" else 0.0
        disks = disk_coefficient(
            sharing, *sines, self.D_out, self.D_in, friction_force, stiffness=self.stiffness, floor=floor
        )
        ratio = self.D_in / self.D_out
        return Symbol(disks + groove_coefficient(sharing, *sines, ratio, self.mu_groove, stiffness=self.stiffness))

    def _mean_sines(self) -> tuple[Symbol, Symbol]:
        return ca.sin(self.alpha_out / 2), ca.sin(self.alpha_in / 2)

    def _sines(self) -> tuple[Symbol, Symbol]:
        """A triangular wave of theta; each flank continues beyond its end."""
        sine = ca.sin(self.n * self.theta)
        rise = magnitude(sine)
        p = 0.5 + ca.atan2(-ca.cos(self.n * self.theta), rise) / math.pi
        return p * ca.sin(self.alpha_out), (1 - p) * ca.sin(self.alpha_in)

    def _inertia(self) -> Symbol:
        """I(theta) of the rollers' motion against the cage [kg.m2]."""
        masses, found = self.masses, Symbol(0)
        if masses is None:
            return found
        rollers = (
            (self.D_out, masses.r_out, masses.m_out, masses.J_out),
            (self.D_in, masses.r_in, masses.m_in, masses.J_in),
        )
        for sine, (D, r, m, J) in zip(self._sines(), rollers, strict=True):
            found += self.n * (D / 2) ** 2 * (m * sine**2 + J / r**2) / (1 - sine**2)
        return found

    def _inertial(self) -> Symbol:
        """Torque that the rollers' inertia adds to tau."""
        inertia = self._inertia()
        if inertia.is_constant():
            return Symbol(0)
        slope, turning = ca.gradient(inertia, self.theta), self.w_rel / 2
        return Symbol(inertia * der(turning) + slope * turning**2 / 2) / 2

    def energy(self) -> Symbol:
        """Kinetic energy of the rollers against the cage."""
        return self._inertia() * (self.w_rel / 2) ** 2 / 2

    def loss(self) -> Symbol:
        """Friction torque times relative speed."""
        return self.tau * self.w_rel

    @classmethod
    @arguments_checked
    def from_design(
        cls,
        cams: CircularCams,
        *,
        sharing: Sharing = "elastic",
        stiffness: float = 1.0,
        mu_groove: float = 0.0,
        masses: bool = False,
    ) -> Self:
        """The component of a design, whose geometry has been checked.

        Parameters
        ----------
        cams : CircularCams
            The tracks and the friction discs.
        sharing : {"elastic", "rigid", "averaged"}
            How the tracks share the torque (``Sharing``).
        stiffness : float
            Stiffness of the inner contacts relative to the outer ones [1].
        mu_groove : float
            Coefficient of friction in the grooves [1].
        masses : bool
            Whether the rollers have the masses of ``RollerMasses.of``, slices of steel spheres; otherwise they are massless.
        """
        return cls(
            D_out=cams.outer.D,
            D_in=cams.inner.D,
            alpha_out=cams.outer.alpha_max,
            alpha_in=cams.inner.alpha_max,
            d_out=cams.disk.d_out,
            d_in=cams.disk.d_in,
            mu=cams.disk.mu,
            mu_groove=mu_groove,
            stiffness=stiffness,
            masses=RollerMasses.of(cams) if masses else None,
            n=cams.outer.n,
            sharing=sharing,
            uniform=cams.disk.uniform,
        )
