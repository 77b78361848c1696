"""Forces between the links by Newton's and Euler's equations, and the shaking forces on the housing.

The mechanism has one redundant constraint (30 of rank 29): couplers that are slightly too long stress it without any load. Axial forces
+N in the left and -N in the right coupler leave everything in balance, for any N. So the equations of rigid links do not determine the
difference of the axial forces, nor the C-pair's reaction to it. Everything else is determined. Here N_left = N_right, the convention
under which (7.1) holds, F = T/(a cos beta), because both are zero if only torque acts. ``Reactions.prestress`` is the
undetermined part, per newton of N; ``Reactions.with_prestress`` adds it.

Its effect on the C-pair is 2 N (sin beta, 0, sin alpha cos beta) in axes of the cage, and a moment. The whole force of the C-pair along x
is therefore undetermined, and a part of its force along z. Determined are the force perpendicular to that direction in the plane x z,
and the torque on the cage M_x + S F_z of (5.50).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError
from powertrain.components.gearless.linkage.kinematics import HALF_TURN, Linkage, Motion
from powertrain.components.gearless.linkage.masses import TABLE_5_1, LinkMasses, inertia

Array = NDArray[np.float64]
X: Array = np.array([1.0, 0.0, 0.0])
Y: Array = np.array([0.0, 1.0, 0.0])


class Drive(NamedTuple):
    """A state of motion, or many: alpha [rad], u = d alpha/dt, speed w of the cage [rad/s], and their rates of change [rad/s2]."""

    alpha: Array
    u: Array
    w: Array
    du: Array
    dw: Array

    @classmethod
    def at(
        cls, alpha: ArrayLike, *, u: ArrayLike = 0.0, w: ArrayLike = 0.0, du: ArrayLike = 0.0, dw: ArrayLike = 0.0
    ) -> Drive:
        """From numbers or arrays that broadcast."""
        return cls(*(np.array(v, float) for v in np.broadcast_arrays(alpha, u, w, du, dw)))


class Torques(NamedTuple):
    """Torques into the mechanism at its three shafts [N.m]."""

    crown: Array
    left: Array
    right: Array


@dataclass(frozen=True)
class Reactions:
    """Forces [N] and moments [N.m] in axes of the cage, arrays (..., 3), with the convention N_left = N_right.

    S_left, S_right: forces of the couplers on the lever;  C_force, C_moment: of the cage on the lever, at the lever's centre;
    R_left, R_right: forces of the output shafts on the couplers, which the shafts' bearings in the cage pass on; R_left_moment, ... about
    the R-pair's centre;  axial: the axial forces N, equal on both sides, positive if a coupler pushes the lever's end away.
    ``prestress``: the effect of +N = 1 N on the left and -1 N on the right on each of these, which statics does not determine.
    """

    drive: Drive
    torques: Torques
    S_left: Array
    S_right: Array
    C_force: Array
    C_moment: Array
    R_left: Array
    R_right: Array
    R_left_moment: Array
    R_right_moment: Array
    axial: Array
    prestress: dict[str, Array] = field(repr=False)

    def with_prestress(self, N: ArrayLike) -> Reactions:
        """The forces with additional axial forces +N in the left and -N in the right coupler [N]."""
        scale = np.asarray(N, float)[..., None]
        return replace(self, **{name: getattr(self, name) + scale * one for name, one in self.prestress.items()})

    @property
    def across(self) -> tuple[Array, Array]:
        """Forces in the S-pairs perpendicular to the couplers, left and right [N]; these are determined."""
        left, right = (
            np.linalg.norm(np.cross(self.prestress[name], getattr(self, name)), axis=-1)
            for name in ("S_left", "S_right")
        )
        return left, right


class _Coupler(NamedTuple):
    """A coupler seen from the cage: its axis p, its R-pair's axis n, q = n x p, d/d alpha of its angle and of that derivative."""

    p: Array
    n: Array
    q: Array
    turn: Array
    turn1: Array

    @classmethod
    def left(cls, m: Motion) -> _Coupler:
        """The left one: p = (sin beta, cos alpha cos beta, sin alpha cos beta), turning by x + beta' n."""
        s, c, zero = np.sin(m.alpha), np.cos(m.alpha), np.zeros_like(m.alpha)
        e, n = np.stack([zero, c, s], -1), np.stack([zero, s, -c], -1)
        sin, cos = np.sin(m.beta)[..., None], np.cos(m.beta)[..., None]
        turn = X + m.beta1[..., None] * n
        return cls(sin * X + cos * e, n, cos * X - sin * e, turn, m.beta2[..., None] * n + m.beta1[..., None] * e)

    def mirrored(self) -> _Coupler:
        """The right one."""
        return _Coupler(*(v * HALF_TURN for v in self))


def torques(
    linkage: Linkage,
    drive: Drive,
    masses: LinkMasses = TABLE_5_1,
    *,
    crown: ArrayLike | None = None,
    right: ArrayLike | None = None,
) -> Torques:
    """The torques required for a motion, from Lagrange's equations without friction; one of them (crown or right) is given.

    crown + left + right = d(J w)/dt,  left - right = d(M u)/dt - (M' u^2 + J' w^2)/2
    """
    alpha, u, w, du, dw = drive
    J, M, J1, M1 = inertia(linkage.loop(alpha), linkage.a, linkage.b, linkage.d, masses)
    total, difference = J * dw + J1 * u * w, M * du + (M1 * u**2 - J1 * w**2) / 2
    if (crown is None) == (right is None):
        raise ParameterError("torques: give either crown or right")
    if crown is not None:
        given = np.broadcast_to(np.asarray(crown, float), alpha.shape)
        return Torques(given.copy(), (total - given + difference) / 2, (total - given - difference) / 2)
    given = np.broadcast_to(np.asarray(right, float), alpha.shape)
    return Torques(total - difference - 2 * given, given + difference, given.copy())


def reactions(
    linkage: Linkage,
    drive: Drive,
    masses: LinkMasses = TABLE_5_1,
    *,
    crown: ArrayLike | None = None,
    right: ArrayLike | None = None,
) -> Reactions:
    """Forces in the pairs for a motion and one torque, without friction in the joints.

    Each coupler pushes the lever with F = N p + T n + G q (p along it, n along its R-pair, q = n x p). The moments about its R-pair, fixed
    in space, give G about n, G = -n.dH/dt / a; and about x, where the shaft turns it with M = tau - J_output dw_side/dt, T = +-(x.dH/dt -
    M)/(a cos beta), whose static part is (7.1). The forces along y and the moments about y on the lever, which its C-pair does not take,
    give the sum of the N.
    """
    m, needed = linkage.motion(drive.alpha), torques(linkage, drive, masses, crown=crown, right=right)
    left = _Coupler.left(m)
    pairs = (left, 1.0, needed.left), (left.mirrored(), -1.0, needed.right)
    known = [_coupler_forces(linkage, drive, m, masses, *pair) for pair in pairs]
    arm = linkage.points(drive.alpha)["S_left"] - m.S[..., None] * Y
    force = masses.lever.m * acceleration(drive, m.S[..., None] * Y, m.S1[..., None] * Y, m.S2[..., None] * Y)
    H = lever_rate(linkage, drive, masses)
    rest, moment = force - known[0] - known[1], H - np.cross(arm, known[0]) + np.cross(arm, known[1])
    p_right = left.p * HALF_TURN
    about, along = np.cross(arm, left.p)[..., 1] / linkage.b, left.p[..., 1]
    axial = (rest[..., 1] * along + moment[..., 1] / linkage.b * about) / (2 * (about**2 + along**2))
    F_left, F_right = known[0] + axial[..., None] * left.p, known[1] + axial[..., None] * p_right
    R, R_moment = zip(
        *(_pin(linkage, drive, masses, c, F) for (c, _, _), F in zip(pairs, (F_left, F_right), strict=True)),
        strict=True,
    )
    stress = np.cross(arm, left.p + p_right)
    return Reactions(
        drive=drive,
        torques=needed,
        S_left=F_left,
        S_right=F_right,
        C_force=force - F_left - F_right,
        C_moment=H - np.cross(arm, F_left - F_right),
        R_left=R[0],
        R_right=R[1],
        R_left_moment=R_moment[0],
        R_right_moment=R_moment[1],
        axial=axial,
        prestress={
            "S_left": left.p,
            "S_right": -p_right,
            "C_force": p_right - left.p,
            "C_moment": -stress,
            "R_left": left.p,
            "R_right": -p_right,
        },
    )


def acceleration(drive: Drive, r: Array, r1: Array, r2: Array) -> Array:
    """Absolute acceleration of a point r(alpha) given in axes of the cage, in these axes."""
    u, w, du, dw = (v[..., None] for v in drive[1:])
    spun = np.cross(X, r)
    found: Array = r2 * u**2 + r1 * du + 2 * w * u * np.cross(X, r1) + dw * spun + w**2 * np.cross(X, spun)
    return found


def _turning(drive: Drive, turn: Array, turn1: Array) -> tuple[Array, Array]:
    """Absolute angular velocity of a link that turns by ``turn`` d alpha against the cage, and its rate of change."""
    u, w, du, dw = (v[..., None] for v in drive[1:])
    omega = w * X + u * turn
    return omega, dw * X + du * turn + u**2 * turn1 + w * np.cross(X, omega)


def _euler(omega: Array, rate: Array, axis: Array, axial: float, across: float) -> Array:
    """dH/dt of a body of revolution."""

    def times(v: Array) -> Array:
        along: Array = np.sum(axis * v, -1, keepdims=True) * axis
        return across * v + (axial - across) * along

    return times(rate) + np.cross(omega, times(omega))


def lever_rate(linkage: Linkage, drive: Drive, masses: LinkMasses = TABLE_5_1) -> Array:
    """dH/dt of the lever about its centre [N.m]."""
    m = linkage.motion(drive.alpha)
    axis = np.stack([np.cos(m.theta), np.zeros_like(m.theta), -np.sin(m.theta)], -1)
    omega, rate = _turning(drive, m.theta1[..., None] * Y, m.theta2[..., None] * Y)
    return _euler(omega, rate, axis, masses.lever.axial, masses.lever.transverse)


def coupler_rates(linkage: Linkage, drive: Drive, masses: LinkMasses = TABLE_5_1) -> list[tuple[Array, Array, float]]:
    """dH/dt of the couplers about their R-pairs [N.m], their mass times acceleration [N], and the side (-1 left, 1 right)."""
    left = _Coupler.left(linkage.motion(drive.alpha))
    return [(*_momenta(linkage, drive, masses, one), side) for one, side in ((left, -1.0), (left.mirrored(), 1.0))]


def _momenta(linkage: Linkage, drive: Drive, masses: LinkMasses, coupler: _Coupler) -> tuple[Array, Array]:
    """dH/dt about the R-pair, mass times acceleration."""
    body, h = masses.coupler, masses.coupler_centre * linkage.a
    omega, rate = _turning(drive, coupler.turn, coupler.turn1)
    centre = h * coupler.p
    H = _euler(omega, rate, coupler.p, body.axial, body.transverse + body.m * h**2)
    return H, body.m * (np.cross(rate, centre) + np.cross(omega, np.cross(omega, centre)))


def _coupler_forces(
    linkage: Linkage, drive: Drive, m: Motion, masses: LinkMasses, coupler: _Coupler, side: float, torque: Array
) -> Array:
    """The force on the lever without its component along the coupler."""
    (H, _), a = _momenta(linkage, drive, masses, coupler), linkage.a
    shaft = torque - masses.output * (drive.dw + side * drive.du)
    T = side * (H[..., 0] - shaft) / (a * np.cos(m.beta))
    G = -np.sum(coupler.n * H, -1) / a
    found: Array = T[..., None] * coupler.n + G[..., None] * coupler.q
    return found


def _pin(linkage: Linkage, drive: Drive, masses: LinkMasses, coupler: _Coupler, F: Array) -> tuple[Array, Array]:
    """Force and moment of the shaft on the coupler."""
    H, momentum = _momenta(linkage, drive, masses, coupler)
    return momentum + F, H + linkage.a * np.cross(coupler.p, F)
