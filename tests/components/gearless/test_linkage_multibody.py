"""The linkage as rigid bodies with joints, solved by Newton and Euler from nothing but the joints: rank, forces, torques, shaking."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from powertrain.components.gearless.linkage import CORRECTED, TABLE_5_1, Linkage, LinkMasses
from powertrain.components.gearless.linkage.forces import Drive, reactions, torques
from powertrain.components.gearless.linkage.shaking import shaking

Array = NDArray[np.float64]
X, Y, Z = np.eye(3)
BODIES = ["cage", "shaft_left", "shaft_right", "coupler_left", "coupler_right", "lever"]
ROWS = {
    "cage": slice(0, 5),
    "shaft_left": slice(5, 10),
    "shaft_right": slice(10, 15),
    "R_left": slice(15, 20),
    "R_right": slice(20, 25),
    "S_left": slice(25, 28),
    "S_right": slice(28, 31),
    "C": slice(31, 35),
}


def rotation(axis: Array, angle: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned: Array = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    return turned


def poses(linkage: Linkage, masses: LinkMasses, phi: float, alpha: float) -> tuple[list[Array], list[Array]]:
    """Centres and rotations of the bodies where the joints close, found by Newton's method from the constraint equations alone.

    Rotations from the position alpha = 0, couplers along y, lever along x. Unknown: angles of both couplers, of the right shaft, slide
    and angle of the lever; equations: the S-pairs' places, one more than needed. The rough start is none of the closed form.
    """
    a, b, d = linkage.a, linkage.b, linkage.d

    def coupler(side: float, turn: float, beta: float) -> Array:
        return rotation(X, turn) @ rotation(Z, side * beta)

    def gaps(q: Array) -> Array:
        beta_l, beta_r, right, S, theta = q
        lever = rotation(Y, theta)
        left = -d * X + coupler(1, alpha, -beta_l) @ (a * Y) - (S * Y + lever @ (-b * X))
        other = d * X + coupler(-1, right, -beta_r) @ (a * Y) - (S * Y + lever @ (b * X))
        return np.concatenate([left, other])

    guess = [0.05, 0.05, -alpha, a * np.cos(alpha), a / b * np.sin(alpha)]
    q: Any = np.array(guess)
    for _ in range(12):
        if np.abs(gaps(q)).max() < 1e-15:
            break
        slopes = np.array([(gaps(q + step) - gaps(q - step)) / 2e-6 for step in 1e-6 * np.eye(5)]).T
        q = q - np.linalg.lstsq(slopes, gaps(q), rcond=None)[0]
    assert np.abs(gaps(q)).max() < 1e-15
    beta_l, beta_r, right, S, theta = q
    cage = rotation(X, phi)
    turns = [np.eye(3), rotation(X, alpha), rotation(X, right), coupler(1, alpha, -beta_l), coupler(-1, right, -beta_r)]
    h = masses.coupler_centre * a
    centres = [0 * X, -d * X, d * X, -d * X + turns[3] @ (h * Y), d * X + turns[4] @ (h * Y), S * Y]
    return [cage @ c for c in centres], [cage @ r for r in [*turns, rotation(Y, theta)]]


def jacobian(linkage: Linkage, centres: list[Array], turns: list[Array]) -> Array:
    """Rows: what each joint holds, in ``ROWS``; columns: velocity and angular velocity of each body."""
    b, d, cage = linkage.b, linkage.d, turns[0]
    rows: list[Array] = []

    def point(body: int | None, place: Array, direction: Array, sign: float) -> Array:
        row = np.zeros(36)
        if body is not None:
            row[6 * body : 6 * body + 3] = sign * direction
            row[6 * body + 3 : 6 * body + 6] = sign * np.cross(place - centres[body], direction)
        return row

    def joint(i: int | None, j: int, place: Array, forces: list[Array], moments: list[Array]) -> None:
        """Body j relative to body i (None: ground): no velocity along ``forces`` at ``place``, no turning about ``moments``."""
        for direction in forces:
            rows.append(point(j, place, direction, 1.0) + point(i, place, direction, -1.0))
        for direction in moments:
            row = np.zeros(36)
            row[6 * j + 3 : 6 * j + 6] = direction
            if i is not None:
                row[6 * i + 3 : 6 * i + 6] = -direction
            rows.append(row)

    space = [X, Y, Z]
    joint(None, 0, 0 * X, space, [Y, Z])
    for k, side in (1, -1.0), (2, 1.0):
        joint(0, k, side * d * X, space, [Y, Z])
    for k, side in (1, -1.0), (2, 1.0):
        joint(k, k + 2, side * d * X, space, [turns[k] @ X, turns[k] @ Y])
    for k, side in (3, -1.0), (4, 1.0):
        joint(k, 5, centres[5] + turns[5] @ (side * b * X), space, [])
    across = [cage @ X, cage @ Z]
    joint(0, 5, centres[5], across, across)
    return np.array(rows)


class Solved:
    """Accelerations by differences along a motion that is twice differentiable, forces by least squares."""

    def __init__(
        self, linkage: Linkage, masses: LinkMasses, motion: Callable[[float], tuple[float, float]], speed: float
    ) -> None:
        def places(t: float) -> tuple[list[Array], list[Array]]:
            return poses(linkage, masses, *motion(t))

        h = 0.01 / speed
        now = places(0.0)
        J = jacobian(linkage, *now)

        def slope(values: Callable[[float], Array], t: float) -> Array:
            near, far = (values(t + k * h) - values(t - k * h) for k in (1, 2))
            return (8 * near - far) / (12 * h)

        def velocity(t: float) -> Array:
            v = slope(lambda time: np.array(places(time)[0]), t)
            spin = slope(lambda time: np.array(places(time)[1]), t) @ np.swapaxes(np.array(places(t)[1]), 1, 2)
            omega = np.array([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]]).T
            return np.hstack([v, omega]).ravel()

        velocities = velocity(0.0)
        acceleration = slope(velocity, 0.0)
        inertial = np.zeros(36)
        bodies = [masses.cage, None, None, masses.coupler, masses.coupler, masses.lever]
        axes = [X, X, X, Y, Y, X]
        for k, (body, axis) in enumerate(zip(bodies, axes, strict=True)):
            if body is None:
                inertia, m = masses.output * np.outer(X, X), 0.0
            else:
                m = body.m
                inertia = body.transverse * np.eye(3) + (body.axial - body.transverse) * np.outer(axis, axis)
            I = now[1][k] @ inertia @ now[1][k].T  # noqa: E741
            omega, rate = velocities[6 * k + 3 : 6 * k + 6], acceleration[6 * k + 3 : 6 * k + 6]
            inertial[6 * k : 6 * k + 3] = m * acceleration[6 * k : 6 * k + 3]
            inertial[6 * k + 3 : 6 * k + 6] = I @ rate + np.cross(omega, I @ omega)
        self.jacobian, self.inertial, self.velocities, self.acceleration = J, inertial, velocities, acceleration
        self.turns, self.centres = now[1], now[0]

    def forces(self, crown: float) -> tuple[Array, Array, Array]:
        """Multipliers, torques left and right, and the multipliers that belong to no load (one direction)."""
        drives = np.zeros((2, 36))
        drives[0, 9], drives[1, 15] = 1.0, 1.0
        load = self.inertial.copy()
        load[3] -= crown
        A = np.vstack([self.jacobian, drives]).T
        found: Array = np.asarray(np.linalg.lstsq(A, load, rcond=None)[0], np.float64)
        assert np.abs(A @ found - load).max() < 2e-5 * (1 + np.abs(load).max())
        _, size, basis = np.linalg.svd(np.asarray(self.jacobian.T, np.float64))
        assert size[-1] < 1e-12 < 1e-4 < size[-2]
        return found[:35], found[35:], np.asarray(basis[-1], np.float64)


LINKAGES = [Linkage(), Linkage(0.04, 0.05, 0.006)]
HEAVY = LinkMasses(TABLE_5_1.cage, CORRECTED.coupler, TABLE_5_1.lever, output=0.02, coupler_centre=0.4)
STATES: list[dict[str, Any]] = [
    {"alpha": 0.7, "u": 8.8, "w": 88.0, "du": 0.0, "dw": 0.0},
    {"alpha": -2.1, "u": -30.0, "w": 60.0, "du": 400.0, "dw": -150.0},
    {"alpha": np.pi / 2, "u": 20.0, "w": -40.0, "du": 50.0, "dw": 90.0},
    {"alpha": 0.0, "u": 209.4, "w": 0.0, "du": 0.0, "dw": 0.0},
]


def solved(linkage: Linkage, masses: LinkMasses, state: dict[str, Any], phi: float = 0.4) -> Solved:
    def motion(t: float) -> tuple[float, float]:
        angles = (
            start + speed * t + rate * t**2 / 2
            for start, speed, rate in (
                (phi, state["w"], state["dw"]),
                (state["alpha"], state["u"], state["du"]),
            )
        )
        cage, alpha = angles
        return cage, alpha

    return Solved(linkage, masses, motion, abs(state["w"]) + abs(state["u"]))


@pytest.mark.parametrize("alpha", [0.0, 0.3, np.pi / 2, 2.0, -3.0])
def test_one_constraint_too_many(alpha: float) -> None:
    """Cage held: 5 bodies with 30 coordinates, 30 constraints of rank 29; so the mechanism moves."""
    linkage = Linkage()
    J = jacobian(linkage, *poses(linkage, TABLE_5_1, 0.0, alpha))[5:, 6:]
    assert J.shape == (30, 30)
    assert np.linalg.matrix_rank(J, tol=1e-9) == 29


@pytest.mark.parametrize("linkage", LINKAGES, ids=str)
@pytest.mark.parametrize("alpha", [0.0, 0.3, np.pi / 2, 2.0, -3.0])
def test_closed_form_closes_the_loop(linkage: Linkage, alpha: float) -> None:
    """Newton on the joints finds lever and couplers where the closed form has them, and the right shaft at minus the left one's angle."""
    centres, turns = poses(linkage, TABLE_5_1, 0.0, alpha)
    m = linkage.motion(alpha)
    np.testing.assert_allclose(centres[5], m.S * Y, atol=1e-12)
    np.testing.assert_allclose(turns[5], rotation(Y, float(m.theta)), atol=1e-12)
    np.testing.assert_allclose(turns[3], rotation(X, alpha) @ rotation(Z, -float(m.beta)), atol=1e-12)
    np.testing.assert_allclose(turns[2], rotation(X, -alpha), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("masses", [TABLE_5_1, HEAVY], ids=["table", "heavy"])
@pytest.mark.parametrize("linkage", LINKAGES, ids=str)
@pytest.mark.parametrize("state", STATES, ids=str)
def test_forces_of_the_multibody_system(linkage: Linkage, masses: LinkMasses, state: dict[str, Any]) -> None:
    """Torques, determined forces and what is left open agree with the joints' multipliers; so does the whole up to one number."""
    system, drive, crown = solved(linkage, masses, state), Drive.at(**state), 200.0
    multipliers, sides, free = system.forces(crown)
    forces = reactions(linkage, drive, masses, crown=crown)
    scale = max(1.0, float(np.abs(forces.S_left).max()))
    needed = torques(linkage, drive, masses, crown=crown)
    np.testing.assert_allclose(sides, [needed.left, needed.right], atol=1e-5 * scale * linkage.a)
    cage = system.turns[0]
    mine = {"S_left": forces.S_left, "S_right": forces.S_right, "R_left": forces.R_left, "R_right": forces.R_right}
    own, stress = np.zeros(35), np.zeros(35)
    for name, value in mine.items():
        rows = slice(ROWS[name].start, ROWS[name].start + 3)
        own[rows], stress[rows] = cage @ value, cage @ forces.prestress[name]
    for values, force, moment in (
        (own, forces.C_force, forces.C_moment),
        (stress, forces.prestress["C_force"], forces.prestress["C_moment"]),
    ):
        values[31:35] = [force[0], force[2], moment[0], moment[2]]
    shown = np.r_[15:18, 20:23, 25:35]
    open_part = free[shown] / np.linalg.norm(free[shown])
    assert abs(open_part @ stress[shown]) == pytest.approx(np.linalg.norm(stress[shown]), rel=1e-9)
    difference = (multipliers - own)[shown]
    difference -= open_part * (open_part @ difference)
    np.testing.assert_allclose(difference, 0.0, atol=1e-5 * scale)


@pytest.mark.parametrize("state", STATES, ids=str)
def test_shaking_of_the_multibody_system(state: dict[str, Any]) -> None:
    """What the bearing of the cage in the ground carries, less the shafts' torques: about the centre, in axes of the ground."""
    linkage, masses, phi = Linkage(0.04, 0.05, 0.006), HEAVY, 0.4
    system = solved(linkage, masses, state, phi)
    force, moment = np.zeros(3), np.zeros(3)
    for k, centre in enumerate(system.centres):
        momentum = system.inertial[6 * k : 6 * k + 3]
        force -= momentum
        moment -= system.inertial[6 * k + 3 : 6 * k + 6] + np.cross(centre, momentum)
    got = shaking(linkage, Drive.at(**state), masses, phi=phi)
    np.testing.assert_allclose(got.force, force, atol=1e-5 * np.abs(force).max())
    np.testing.assert_allclose(got.moment[1:], moment[1:], atol=1e-6 * (1 + np.abs(moment).max()))
    multipliers, _, _ = system.forces(200.0)
    np.testing.assert_allclose(-multipliers[:3], got.force, atol=1e-4 * (1 + np.abs(force).max()))
