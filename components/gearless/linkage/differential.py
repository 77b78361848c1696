"""The linkage differential as an acausal component."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Self

import casadi as ca

from powertrain import (
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
from powertrain.components.gearless.linkage.friction import JointFriction, kappa
from powertrain.components.gearless.linkage.kinematics import Linkage, closed_loop
from powertrain.components.gearless.linkage.masses import ROUNDING, TABLE_5_1, LinkMasses, ReflectedInertia, inertia
from powertrain.components.limited import magnitude
from powertrain.components.rotational.interfaces import Lossy

_CAGE, _COUPLER, _LEVER, _JOINTS = TABLE_5_1.cage, TABLE_5_1.coupler, TABLE_5_1.lever, JointFriction()


class LinkageDifferential(SymmetricDifferential, Lossy):
    """The gearless differential RRSCSRR with the masses of its links and friction in its joints.

    w_left + w_right = 2 w_crown,  w = w_crown,  alpha = alpha_0 + (left.phi - right.phi)/2,  u = w_diff = d alpha/dt
    d(J w)/dt = crown.tau + left.tau + right.tau
    d(M u)/dt - (M' u^2 + J' w^2)/2 = left.tau - right.tau - tau
    u > 0: tau = limit;  u < 0: tau = -limit;  u = 0: |tau| <= limit;  limit = kappa(alpha) |left.tau + right.tau|

    These are Lagrange's equations of the kinetic energy (J(alpha) w^2 + M(alpha) u^2)/2 of cage, couplers, lever and outputs (see
    ``inertia``; there is no product w u, because a half-turn about the C axis exchanges left and right) in the coordinates crown.phi and
    alpha. A virtual rotation of the shafts is crown.phi +- alpha, so left.tau + right.tau works on crown.phi and left.tau - right.tau on
    alpha. ' is d/d alpha. J' w^2/2 is the centrifugal torque that turns the lever towards its outermost position, alpha = 0 or 180 degrees.
    Gravity is neglected, as in the source. Without masses and friction it is the open bevel differential.

    Friction in the joints is computed from the joint forces due to the transmitted torque (see ``kappa``). At rest and in slow motion
    right.tau/left.tau is within (1 + kappa)/(1 - kappa), so the efficiency from one side to the other, with the cage held, is eta_0(alpha)
    = (1 - kappa)/(1 + kappa); for kappa >= 1 the linkage is self-locking.

    The lengths must satisfy |offset| < a < 2 b - offset (without offset 0 < a/b < 2). Errors: ParameterError at construction otherwise,
    SimulationError if such lengths are given to a compiled model. Defaults: lengths and masses of the source (Table 5.1), no friction.
    Source: B. Madhavan, Systematic design of gearless differentials and analysis of a potential mechanism, M.S. 96-7, Univ. of Maryland,
    1996, ch. 5, which computes the motion with DADS models and proposes these equations in 7.2.
    """

    a: Parameter = parameter("m", "Length of a coupler, from R-pair to S-pair", default=0.03, above=0)
    b: Parameter = parameter("m", "Half length of the lever, from C axis to S-pair", default=0.06, above=0)
    offset: Parameter = parameter("m", "Offset of the C axis towards the R-pairs", default=0.0)
    alpha_0: Parameter = parameter("rad", "Angle of the left shaft against the cage at equal angles", default=0.0)
    J_cage: Parameter = parameter("kg.m2", "Cage about the shaft axis", default=_CAGE.axial, min=0)
    J_output: Parameter = parameter("kg.m2", "An output shaft about its axis", default=0.0, min=0)
    m_coupler: Parameter = parameter("kg", "Mass of a coupler", default=_COUPLER.m, min=0)
    axial_coupler: Parameter = parameter("kg.m2", "A coupler along its axis", default=_COUPLER.axial, min=0)
    transverse_coupler: Parameter = parameter(
        "kg.m2", "A coupler across its axis, about its centre", default=_COUPLER.transverse, min=0
    )
    centre_coupler: Parameter = parameter(
        "1", "Distance of a coupler's centre from its R-pair divided by a", default=0.5, min=0
    )
    m_lever: Parameter = parameter("kg", "Mass of the lever", default=_LEVER.m, min=0)
    axial_lever: Parameter = parameter("kg.m2", "The lever along its axis", default=_LEVER.axial, min=0)
    transverse_lever: Parameter = parameter(
        "kg.m2", "The lever across its axis, about its centre", default=_LEVER.transverse, min=0
    )
    mu_shaft: Parameter = parameter("1", "Friction of an output shaft in the cage", default=_JOINTS.mu_shaft, min=0)
    mu_pin: Parameter = parameter("1", "Friction of the couplers' R-pairs", default=_JOINTS.mu_pin, min=0)
    mu_ball: Parameter = parameter("1", "Friction of the S-pairs", default=_JOINTS.mu_ball, min=0)
    mu_rod: Parameter = parameter("1", "Friction of the C-pair", default=_JOINTS.mu_rod, min=0)
    r_shaft: Parameter = parameter("m", "Radius of an output shaft in its bearing", default=_JOINTS.r_shaft, min=0)
    r_pin: Parameter = parameter("m", "Radius of a coupler's pin", default=_JOINTS.r_pin, min=0)
    l_pin: Parameter = parameter("m", "Length of a coupler's pin", default=_JOINTS.l_pin, above=0)
    r_ball: Parameter = parameter("m", "Radius of an S-pair", default=_JOINTS.r_ball, min=0)
    r_rod: Parameter = parameter("m", "Radius of the C-pair's rod", default=_JOINTS.r_rod, min=0)
    l_rod: Parameter = parameter("m", "Length of the C-pair's bore", default=_JOINTS.l_rod, above=0)
    phi_diff: Variable = variable("rad", "Angle of the left shaft relative to the cage", start=0.0, prefer=True)
    alpha: Variable = variable("rad", "Angle of the left shaft against the cage, as it is assembled")
    w: Variable = variable("rad/s", "Speed of the cage", prefer=True)
    w_diff: Variable = variable("rad/s", "Speed of the left shaft against the cage", prefer=True)
    tau: Variable = variable("N.m", "Torque of friction, left.tau - right.tau at steady speeds")

    def check(self) -> Equations:
        """The linkage must be assemblable at every angle, and the inertias of its links physically possible."""
        yield ca.fabs(self.offset) < self.a  # or the coupler does not reach the lever's end at alpha = 0
        yield self.a + self.offset < 2 * self.b  # or the coupler does not reach the lever's end at alpha = 90 degrees
        yield self.axial_coupler <= 2 * (1 + ROUNDING) * self.transverse_coupler  # no body has more along its axis
        yield self.axial_lever <= 2 * (1 + ROUNDING) * self.transverse_lever  # no body has more along its axis

    def equations(self) -> Equations:
        """Symmetric kinematics, Lagrange's two equations and friction."""
        yield self.left.phi + self.right.phi == 2 * self.crown.phi
        yield self.phi_diff == (self.left.phi - self.right.phi) / 2
        yield self.alpha == self.alpha_0 + self.phi_diff
        yield self.w == der(self.crown.phi)
        yield self.w_diff == der(self.phi_diff)
        J, M, J_slope, M_slope = self._inertia()
        w, u, sides = self.w, self.w_diff, self.left.tau + self.right.tau
        yield J * der(w) + J_slope * u * w == self.crown.tau + sides
        yield M * der(u) + (M_slope * u**2 - J_slope * w**2) / 2 == self.left.tau - self.right.tau - self.tau
        locking = kappa(self._loop(), self.a, self.b, self.b - self.offset, self, ca)
        limit = locking * magnitude(sides)
        yield friction(u, self.tau, -limit, limit)
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy of cage, couplers, lever and outputs, (J w^2 + M u^2)/2."""
        J, M, _, _ = self._inertia()
        return Symbol(J * self.w**2 + M * self.w_diff**2) / 2

    def loss(self) -> Symbol:
        """Torque of friction times relative speed."""
        return self.tau * self.w_diff

    def _loop(self) -> Any:
        return closed_loop(self.alpha, self.a, self.b, self.b - self.offset, ca)

    def _inertia(self) -> ReflectedInertia:
        parts = {
            part: SimpleNamespace(
                m=getattr(self, f"m_{part}"),
                axial=getattr(self, f"axial_{part}"),
                transverse=getattr(self, f"transverse_{part}"),
            )
            for part in ("coupler", "lever")
        }
        masses: Any = SimpleNamespace(
            cage=SimpleNamespace(axial=self.J_cage), output=self.J_output, coupler_centre=self.centre_coupler, **parts
        )
        return inertia(self._loop(), self.a, self.b, self.b - self.offset, masses)

    @classmethod
    @arguments_checked
    def of(
        cls,
        linkage: Linkage | None = None,
        masses: LinkMasses = TABLE_5_1,
        joints: JointFriction | None = None,
        *,
        alpha_0: float = 0.0,
    ) -> Self:
        """The component from the records of the design tools. Without arguments it is the differential of the thesis.

        Parameters
        ----------
        linkage : Linkage, optional
            Lengths.
        masses : LinkMasses
            Masses and moments of inertia.
        joints : JointFriction, optional
            Friction in the joints; by default none.
        alpha_0 : float
            Angle of the crank at the start [rad].
        """
        linkage, given = linkage or Linkage(), vars(joints or _JOINTS)
        coupler, lever = masses.coupler, masses.lever
        return cls(
            a=linkage.a,
            b=linkage.b,
            offset=linkage.offset,
            alpha_0=alpha_0,
            J_cage=masses.cage.axial,
            J_output=masses.output,
            m_coupler=coupler.m,
            axial_coupler=coupler.axial,
            transverse_coupler=coupler.transverse,
            centre_coupler=masses.coupler_centre,
            m_lever=lever.m,
            axial_lever=lever.axial,
            transverse_lever=lever.transverse,
            **given,
        )
