"""Forces between the rollers of a carrier and the conjugate cams, with friction: in numbers or in symbols.

Frame, angles and signs are those of ``CamGeometry`` with its axes at right angles, e_phi = (1, 0, 0). s is the cam's angle from the middle
of a stroke, u that of one roller, psi = u - pi/M; the carrier has turned by M u/N. Forces are per unit of normal force, torques at unit
distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from powertrain.components.gearless.spherical_cam.profile import SphericalCam

Sharing: TypeAlias = Literal["elastic", "single"]
"""How two rollers of one carrier, one on each of the conjugate cams, share the load when both can carry.

"elastic": normal forces in proportion to the lever arms, as for contacts of equal stiffness, times a relief that unloads the leaving
roller before the lobe's tip, (1 - x)^2 (1 + 2 x), with x from 0 to 1 over the overlap of length sigma. The forces are continuous.
"single": one carries alone, the one with the longer lever arm, i.e. the smaller mu_p, while in contact. They change where the
pressure angles are equal (the paper's "intersection of cycle 1 with cycle 2") or, before that, where the leaving roller reaches the
lobe's tip. The efficiency jumps there.
"""
LOCKED = 3.0
"""The locking coefficient if the cage cannot turn the sides against each other. Any number above 1 has the same meaning."""
TINY = 1e-12
"""A torque per unit of normal force that counts as zero."""

Vector: TypeAlias = tuple[Any, Any, Any]


class Algebra(NamedTuple):
    """``of``: numpy or casadi; ``choose(condition, a, b, name)``: a if the condition holds, else b, in a model with an event."""

    of: Any
    choose: Callable[[Any, Any, Any, str], Any]


NUMBERS = Algebra(np, lambda condition, a, b, _: np.where(condition, a, b))


class CamContact(NamedTuple):
    """One roller at u. ``normal``: n, on the roller; ``side``: its moment e_c x n, a unit vector along the profile.

    side = e_e x e_p/sin(beta_4),  n = side x e_c = (cos(beta_3) e_p - cos(alpha_4) e_e)/sin(beta_4)
    v = (phi' e_phi - psi' e_psi) x e_c = -psi' |(M/N) e_phi + e_psi| sin(beta_3) side

    v is the velocity of a non-rotating roller against the cam. ``spin`` = sign(sin(beta_3)) is the direction in which the roller turns,
    ``slip`` = |v/psi'|.
    """

    side: Vector
    normal: Vector
    spin: Any
    slip: Any


class Rollers(NamedTuple):
    """Sums over the loaded rollers of a carrier, N the normal force of each.

    ``force``: N n;  ``moment``: N side, their moment;  ``drag``: N spin side;  ``twist``: N spin n, its moment reversed;
    ``slip``: N |v/psi'|
    """

    force: Vector
    moment: Vector
    drag: Vector
    twist: Vector
    slip: Any


class Loaded(NamedTuple):
    """A carrier's rollers with friction: torque on the carrier about e_phi, from the cam about e_psi, force on the carrier, loss/|psi'|."""

    carrier: Any
    cam: Any
    force: Vector
    lost: Any


def contact(cam: SphericalCam, u: Any, since: float, by: Algebra = NUMBERS) -> CamContact:
    """The contact of one roller at u, which is unloaded before ``since``."""
    of, v = by.of, cam.M / cam.N * u
    e_x, e_z = math.sin(cam.beta_1), math.cos(cam.beta_1)
    x, across = math.cos(cam.alpha_3), math.sin(cam.alpha_3)
    y, z = across * of.sin(v), across * of.cos(v)
    cos_4 = e_x * x + e_z * z
    turn = (-e_z * y, e_z * x - e_x * z, e_x * y)
    sin_4 = of.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    c, s = math.cos(cam.alpha_4), math.sin(cam.alpha_4)
    cos_3, sin_3 = cos_4 * c + sin_4 * s, sin_4 * c - cos_4 * s
    side = (turn[0] / sin_4, turn[1] / sin_4, turn[2] / sin_4)
    normal = ((cos_3 * x - c * e_x) / sin_4, cos_3 * y / sin_4, (cos_3 * z - c * e_z) / sin_4)
    return CamContact(side, normal, _spin(cam, u, since, by), math.hypot(cam.M / cam.N, 1.0) * of.fabs(sin_3))


def _spin(cam: SphericalCam, u: Any, since: float, by: Algebra) -> Any:
    """-1 while the axis of relative rotation is inside the roller. An unloaded roller keeps +1, so its reversal is no event.

    It is unloaded before ``since`` and past the tip. The event is continuous also where ``place`` jumps, from ``last`` to ``first``.
    """
    if cam.alpha_1 - cam.alpha_3 - cam.beta_1 >= cam.alpha_4:  # beta_4 in the middle of a stroke, its minimum
        return 1.0
    e_x, e_z = math.sin(cam.beta_1), math.cos(cam.beta_1)

    def outside(at: Any, of: Any) -> Any:
        cos_4 = e_x * math.cos(cam.alpha_3) + e_z * math.sin(cam.alpha_3) * of.cos(cam.M / cam.N * at)
        return math.cos(cam.alpha_4) - cos_4

    centre = (cam.half + cam.sigma) / 2
    first, last = centre - math.pi / cam.M, centre + math.pi / cam.M
    past = (cam.half + cam.sigma + last) / 2  # well past the tip, so it is no event of a roller at the handover
    top = max(since - first, outside(first, np), outside(last, np))
    idle = by.of.fmax((since - u) * (top / (since - first)), (u - past) * (top / (last - past)))
    return by.choose(by.of.fmax(outside(u, by.of), idle) > 0, 1.0, -1.0, "spin")


def roller_spin(cam: SphericalCam, u: Any, of: Any = np) -> Any:
    """Speed of a rolling roller about its pin over that of the cam, cage at rest: relative to the carrier, plus the carrier's rotation.

    (phi' e_phi + s e_p - psi' e_psi) x e_c = 0 gives s = -psi' |(M/N) e_phi + e_psi| sin(beta_3)/sin(alpha_4), and phi' = -(M/N) psi'.
    """
    cos_4 = math.sin(cam.beta_1) * math.cos(cam.alpha_3) + math.cos(cam.beta_1) * math.sin(cam.alpha_3) * of.cos(
        cam.M / cam.N * u
    )
    sin_3 = of.sqrt(1 - cos_4**2) * math.cos(cam.alpha_4) - cos_4 * math.sin(cam.alpha_4)
    return math.hypot(cam.M / cam.N, 1.0) * sin_3 / math.sin(cam.alpha_4) + cam.M / cam.N * math.cos(cam.alpha_3)


def place(cam: SphericalCam, s: Any, by: Algebra = NUMBERS) -> tuple[Any, Any]:
    """Angle u of the roller on either conjugate cam. It jumps to that of the next roller halfway between two strokes, out of contact."""
    centre = (cam.half + cam.sigma) / 2
    sine, cosine = by.of.sin(cam.M * (s - centre)), by.of.cos(cam.M * (s - centre))
    return centre + by.of.atan2(sine, cosine) / cam.M, centre + by.of.atan2(-sine, -cosine) / cam.M


def elastic_weight(cam: SphericalCam, u: Any, arm: Any, by: Algebra = NUMBERS) -> Any:
    """Normal force up to a factor, by the rule "elastic". ``arm``: the lever arm on the carrier, positive if the roller can carry."""
    x = by.of.fmin(by.of.fmax((u - cam.half) / cam.sigma, 0.0), 1.0)
    return by.of.fmax(arm, 0.0) * (1 - x) ** 2 * (1 + 2 * x)


def rollers(cam: SphericalCam, sharing: Sharing, handover: float, s: Any, by: Algebra = NUMBERS) -> Rollers:
    """The loaded rollers at s. ``handover``: the angle u at which a roller takes over by the rule "single"."""
    places = place(cam, s, by)
    since = handover if sharing == "single" else 0.0
    contacts = [contact(cam, u, since, by) for u in places]
    if sharing == "elastic":
        weights = [elastic_weight(cam, u, -at.side[0], by) for u, at in zip(places, contacts, strict=True)]
    else:
        first = by.choose(by.of.sin(cam.M * (s - handover)) > 0, 1.0, 0.0, "handover")
        weights = [first, 1 - first]
    pairs = list(zip(weights, contacts, strict=True))
    return Rollers(
        _total([(w, at.normal) for w, at in pairs]),
        _total([(w, at.side) for w, at in pairs]),
        _total([(w * at.spin, at.side) for w, at in pairs]),
        _total([(w * at.spin, at.normal) for w, at in pairs]),
        sum(w * at.slip for w, at in pairs),
    )


def _total(pairs: list[tuple[Any, Vector]]) -> Vector:
    (v, (a, b, c)), (w, (d, e, f)) = pairs
    return v * a + w * d, v * b + w * e, v * c + w * f


def loaded(on: Rollers, f: Any, psi_dot: int) -> Loaded:
    """The forces with the ratio f of tangential to normal force: F = N n - f N v/|v|, for psi' = 1 (cam drives) or -1 (carrier drives)."""
    g = psi_dot * f
    force = [n + g * t for n, t in zip(on.force, on.drag, strict=True)]
    return Loaded(
        on.moment[0] - g * on.twist[0], on.moment[2] - g * on.twist[2], (force[0], force[1], force[2]), f * on.slip
    )


def rolling(friction: Any, alpha_4: float, of: Any = np) -> Any:
    """Ratio of tangential to normal force at a turning roller: its pin carries N cos(alpha_4), its collar N sin(alpha_4); or it slips."""
    turning = friction.mu_pin * friction.pin * math.cos(alpha_4) + friction.mu_thrust * friction.thrust * math.sin(
        alpha_4
    )
    return of.fmin(turning, friction.mu_contact)


def locking(ahead: Rollers, behind: Rollers, cam: SphericalCam, friction: Any, by: Algebra = NUMBERS) -> Any:
    """The locking coefficient (T_slow - T_fast)/(T_slow + T_fast) from the rollers at s (``ahead``) and at -s (``behind``), see ``Cycle``.

    T_fast is the torque on the driven carrier, T_slow that on the driving carrier, both positive here. y is the ratio of the sums of
    normal forces on the driving and on the driven carrier. Moments about the cam's axis give it:

    y T_psi(driving) = T_psi(driven) + mu_bearing (shaft |F_xy| + washer |F_z|),  F = F(driven) + y F(driving)

    The loss gives kappa: T_slow - T_fast = (N/M) (loss of both carriers' rollers + loss of the bearing)/psi', which is never
    negative. kappa > 1 if the cam turns a carrier only with help, T_fast < 0. The sides are locked if a member would have to push
    with the wrong sign: if the rollers of the driving carrier do not even overcome the friction that they cause in the cam's bearing,
    or if friction alone would carry them along (T_slow <= 0).
    """
    of, f = by.of, rolling(friction, cam.alpha_4, by.of)
    driven, driving = loaded(ahead, f, 1), loaded(behind, f, -1)
    # The mirror image of a carrier (y reversed: torques about x and z change sign), half a turn about z to its own side: x is reversed.
    A, (x, *rest) = driven.force, driving.force
    B = (-x, *rest)
    k, m = friction.mu_bearing * friction.shaft, friction.mu_bearing * friction.washer
    y, surplus = _balance(driven.cam, driving.cam, A, B, (k, m), of)
    both = -driven.carrier - y * driving.carrier
    radial = of.sqrt((A[0] + y * B[0]) ** 2 + (A[1] + y * B[1]) ** 2)
    bearing = k * radial + m * of.fabs(A[2] + y * B[2])
    kappa = cam.N / cam.M * (driven.lost + y * driving.lost + bearing) / of.fmax(both, TINY)
    pushes = of.fmin(of.fmin(-driving.carrier, driven.cam), surplus)
    return by.choose(pushes > TINY, of.fmin(kappa, LOCKED), LOCKED, "locked")


def _balance(a: Any, b: Any, A: Vector, B: Vector, arms: tuple[Any, Any], of: Any) -> tuple[Any, Any]:
    """The y for which b y = a + k |(A + y B)_xy| + m |(A + y B)_z|, and a number that is positive if it exists.

    With z = +-(A + y B)_z, c = a + m z_A and d = b - m z_B it is d y - c = k |A + y B|_xy, whose root is

    y = (c d + k^2 A.B + k sqrt(|d A + c B|^2 - k^2 (A x B)^2))/(d^2 - k^2 B.B)

    if d > k |B|: the driving rollers overcome the bearing friction that they cause. |z| is the larger of both signs, hence so is y.
    """
    k, m = arms
    AA, AB, BB = A[0] ** 2 + A[1] ** 2, A[0] * B[0] + A[1] * B[1], B[0] ** 2 + B[1] ** 2
    cross = A[0] * B[1] - A[1] * B[0]
    roots, surplus = [], []
    for sign in (1, -1):
        c, d = a + sign * m * A[2], b - sign * m * B[2]
        left = d**2 - k**2 * BB
        inside = d**2 * AA + 2 * c * d * AB + c**2 * BB - (k * cross) ** 2
        roots.append((c * d + k**2 * AB + k * of.sqrt(of.fmax(inside, TINY**2))) / of.fmax(left, TINY))
        surplus.append(of.fmin(d, left))
    return of.fmax(roots[0], roots[1]), of.fmin(surplus[0], surplus[1])
