"""All modes at one point against brute force over stuck, forward and backward, open and closed, and the pieces of the bounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from opened import Fit, Piecewise, compared, dae_of, finite_slopes, fits

from powertrain.compiler.torques import COMPLIANCE
from powertrain.dae.hybrid import Friction, HybridDae, Opened, OperatingPoint
from powertrain.dae.tolerances import ZONE
from powertrain.modes.complementarity import Answer, Complementarity, Laws, _inverse

Matrix = np.ndarray[Any, Any]


def answered(given: Piecewise, tau: Matrix | None = None, bends: bool = True) -> Answer:
    dae, point = dae_of(given)
    return Complementarity(dae).solve(point, np.zeros(given.n) if tau is None else tau, ZONE, bends)


def agrees(answer: Answer, fit: Fit, tolerance: float = 1e-6) -> None:
    assert answer.tau is not None
    np.testing.assert_allclose(answer.tau, fit.tau, atol=tolerance * (1.0 + np.abs(fit.tau).max()))
    if fit.clear:
        assert compared(answer.modes, fit)


def mobility(rng: np.random.Generator, n: int, rank: int) -> Matrix:
    """Symmetric and positive semidefinite; laws that hold the same motions where ``rank`` is less than ``n``."""
    root = rng.normal(size=(n, rank))
    G: Matrix = root @ np.diag(rng.uniform(0.3, 3.0, rank)) @ root.T
    return G


def reachable(rng: np.random.Generator, G: Matrix) -> Matrix:
    """Rates that torques can make: those of laws on one motion agree."""
    a: Matrix = G @ rng.normal(size=len(G)) * 4.0
    return a


@pytest.mark.parametrize("rank", [1, 2, 4])
def test_constant_bounds(rank: int) -> None:
    """Convex: one solution whatever the rank, at rest or sliding."""
    rng = np.random.default_rng(rank)
    for k in range(25):
        n = 4
        G = mobility(rng, n, rank)
        speed = np.where(rng.random(n) < 0.3, rng.normal(size=n), 0.0) if k % 2 else np.zeros(n)
        given = Piecewise(reachable(rng, G), G, rng.uniform(0.5, 4.0, n), speed=speed)
        found = fits(given, COMPLIANCE)
        assert found
        agrees(answered(given, rng.normal(size=n)), found[0])


def test_contacts_with_friction() -> None:
    """Forces push, gaps open; open contacts carry nothing."""
    rng = np.random.default_rng(8)
    modes = set()
    for k in range(60):
        n = 4
        G = mobility(rng, n, n)
        speed = np.array([0.0, rng.normal() * (k % 3 == 0), 0.0, 1.0 * (k % 4 == 0)])
        given = Piecewise(reachable(rng, G), G, rng.uniform(0.5, 4.0, n), contacts=2, speed=speed)
        found = fits(given, COMPLIANCE)
        assert len(found) == 1
        answer = answered(given)
        agrees(answer, found[0])
        assert answer.tau is not None
        assert (answer.tau[2:] <= 0.0).all()
        modes.add(found[0].modes[2:])
    assert len(modes) == 4


def bent(rng: np.random.Generator, n: int, steep: float, contacts: int = 0) -> Piecewise:
    """Bounds that lean on torques and bend with the size of two combinations of them, as losses of meshes do."""
    G = mobility(rng, n, n) + 0.2 * np.eye(n)
    W = np.abs(rng.normal(size=(n, 2))) * steep
    W[n - contacts :] = 0.0
    B = rng.normal(size=(n, n)) * steep * 0.1
    B[n - contacts :] = 0.0
    return Piecewise(
        G @ rng.normal(size=n) * 4.0, G, rng.uniform(0.5, 4.0, n), contacts=contacts, B=B, W=W,
        C=rng.normal(size=(2, n)), c=rng.normal(size=2) * (rng.random() < 0.5),
    )  # fmt: skip


def test_bounds_that_bend_with_torques() -> None:
    """Losses of some per cent: one solution. From any torques, and also where some laws slide."""
    rng = np.random.default_rng(20)
    pieces = set()
    for k in range(40):
        given = bent(rng, 3, 0.04, contacts=k % 2)
        if k % 3 == 0:
            given = replace(given, speed=np.array([rng.normal(), 0.0, 0.0]))
        found = fits(given, COMPLIANCE)
        assert len({f.modes for f in found if f.clear}) <= 1
        agrees(answered(given, rng.normal(size=3)), found[0])
        pieces.add(found[0].modes[3:])
    assert len(pieces) == 4


def test_steep_bounds_end_in_a_solution_or_on_a_ray() -> None:
    """Self-locking, where no theorem promises that a solution is found: what is found is among what brute force finds; a ray names laws."""
    rng = np.random.default_rng(21)
    rays = solutions = 0
    for _ in range(100):
        given = bent(rng, 3, 0.8)
        answer = answered(given)
        if answer.tau is None:
            rays += 1
            assert answer.ray
            assert not answer.modes
            continue
        solutions += 1
        found, tau = fits(given, COMPLIANCE), answer.tau
        agrees(answer, min(found, key=lambda fit: float(np.abs(tau - fit.tau).max())))
    assert solutions > 20
    assert rays + solutions == 100


def test_rates_that_bend_with_torques() -> None:
    """A loss that is no law of its own: its torque stands in the rates."""
    rng = np.random.default_rng(22)
    for _ in range(30):
        given = bent(rng, 3, 0.03)
        given = replace(given, R=rng.normal(size=(3, 2)) * 0.05)
        found = fits(given, COMPLIANCE)
        assert found
        agrees(answered(given), found[0])


def test_held_pieces_are_not_part_of_the_problem() -> None:
    """Without ``bends`` the bounds are those of the present piece, right or wrong."""
    rng = np.random.default_rng(23)
    for piece in ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)):
        given = bent(rng, 3, 0.05)
        dae, point = dae_of(given)
        point.m[3:] = piece
        answer = Complementarity(dae).solve(point, np.zeros(3), ZONE, bends=False)
        D = np.diag(np.where(np.array(piece) == 1.0, 1.0, -1.0))
        straight = Piecewise(given.a, given.G, given.b + given.W @ D @ given.c, B=given.B + given.W @ D @ given.C)
        agrees(answer, fits(straight, COMPLIANCE)[0])
        assert not set(answer.modes) & {3, 4}


def test_scale_of_torques_and_of_motions_does_not_matter() -> None:
    """Ten thousand times larger torques, and laws behind ratios from 1/100 to 100 (with their bounds)."""
    rng = np.random.default_rng(24)
    for scale in (1e-4, 1e4):
        for _ in range(10):
            G = mobility(rng, 4, 3)
            given = Piecewise(reachable(rng, G), G, rng.uniform(0.5, 4.0, 4))
            ratio = 10.0 ** rng.uniform(-2, 2, 4)
            other = Piecewise(ratio * given.a * scale, ratio[:, None] * G * ratio, given.b / ratio * scale)
            first, second = answered(given), answered(other)
            assert first.tau is not None
            assert second.tau is not None
            assert first.modes == second.modes
            size = 1.0 + np.abs(first.tau).max()
            np.testing.assert_allclose(second.tau * ratio / scale, first.tau, atol=1e-6 * size)


def test_order_of_the_laws_does_not_matter() -> None:
    rng = np.random.default_rng(25)
    for _ in range(20):
        G = mobility(rng, 5, 2)
        given = Piecewise(reachable(rng, G), G, rng.uniform(0.5, 4.0, 5))
        order = rng.permutation(5)
        turned = Piecewise(given.a[order], G[np.ix_(order, order)], given.b[order])
        first, second = answered(given), answered(turned)
        assert first.tau is not None
        assert second.tau is not None
        np.testing.assert_allclose(second.tau, first.tau[order], atol=1e-6)
        assert [second.modes[k] for k in range(5)] == [first.modes[i] for i in order]


@pytest.mark.parametrize(("push", "weak", "shares", "modes"), [
    (4.0, 3.0, (2.0, 2.0), (0.0, 0.0)),
    (4.0, 1.5, (1.5, 2.5), (1.0, 0.0)),
    (-4.0, 1.5, (-1.5, -2.5), (-1.0, 0.0)),
    (9.0, 1.5, (1.5, 5.0), (1.0, 1.0)),
])  # fmt: skip
def test_two_brakes_on_one_shaft(
    push: float, weak: float, shares: tuple[float, float], modes: tuple[float, float]
) -> None:
    """Equal shares; the weaker at its limit and the other takes the rest; both slide."""
    given = Piecewise(np.full(2, push), np.ones((2, 2)), np.array([weak, 5.0]))
    answer = answered(given)
    np.testing.assert_allclose(np.array(answer.tau), shares, atol=1e-7)
    assert [answer.modes[0], answer.modes[1]] == list(modes)


def with_unknowns(free: bool = False) -> tuple[HybridDae, OperatingPoint, Matrix]:
    """Two friction laws and two implicit unknowns that are not linear in the torques: z0^3 + z0 = tau0 + x0, z1 + 0.3 z0 z1 = tau1 + t."""
    t, x, z, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("z", 3), ca.SX.sym("p", 1)
    m, tau = ca.SX.sym("m", 3), ca.SX.sym("tau", 2)
    residual = ca.vertcat(z[0] ** 3 + z[0] - tau[0] - x[0], z[1] + 0.3 * z[0] * z[1] - tau[1] - t)
    rate = ca.vertcat(p[0] - tau[0] - ca.sin(z[1]), 0.5 - z[0] * z[1] - 2 * tau[1])
    upper = ca.vertcat(3 + z[0] ** 2, 2 + tau[0] * z[1])
    opened = Opened(
        tau, x, residual, ca.vertcat(x[0] + z[1], x[1]), rate, ca.vertcat(-1 - z[1] ** 2, -2 + z[0]), upper,
        ca.SX.ones(2), ca.vertcat(1, 2 + z[0] ** 2), ca.SX([1, 2]), ca.vertcat(z[0] - tau[1] ** 2),
    )  # fmt: skip
    frictions = tuple(
        Friction(f"law{i}", "hand", i, x[i], NONE, NONE, NONE, ca.SX(1), NONE, may_free=free) for i in range(2)
    )
    dae = HybridDae(
        t, x, z, m, p, x, ca.vertcat(residual, z[2] - 1), ("a", "b"), np.zeros(3), frictions=frictions, opened=opened
    )
    point = OperatingPoint(0.7, np.array([0.4, -0.2]), np.array([0.8, 0.6, 1.0]), np.zeros(3), np.array([1.3]))
    return dae, point, np.array([0.9, -0.4])


NONE = ca.SX(0)


def moved(point: OperatingPoint, tau: Matrix) -> Matrix:
    """The implicit unknowns for these torques, in closed form or from the roots of the cubic."""
    roots = np.roots([1.0, 0.0, 1.0, -tau[0] - point.x[0]])
    z0 = float(roots[np.abs(roots.imag).argmin()].real)  # the only real one
    return np.array([z0, (tau[1] + point.t) / (1 + 0.3 * z0)])


def values(point: OperatingPoint, tau: Matrix) -> dict[str, Matrix]:
    z0, z1 = moved(point, tau)
    return {
        "rate": np.array([1.3 - tau[0] - np.sin(z1), 0.5 - z0 * z1 - 2 * tau[1]]),
        "lower": np.array([-1 - z1**2, -2 + z0]),
        "upper": np.array([3 + z0**2, 2 + tau[0] * z1]),
        "g": np.array([z0 - tau[1] ** 2]),
    }


def test_slopes_follow_the_implicit_unknowns() -> None:
    """At unknowns that solve their equations: values, and slopes against central differences of the whole."""
    dae, point, tau = with_unknowns()
    point.z[:2] = moved(point, tau)
    near = Laws(dae).at(point, tau)
    for name, value in values(point, tau).items():
        np.testing.assert_allclose(getattr(near, name), value, atol=1e-12)
        expected = finite_slopes(lambda tau, name=name: values(point, tau)[name], tau)  # type: ignore[misc]
        np.testing.assert_allclose(getattr(near, f"{name}_slope"), expected, atol=1e-8)
    np.testing.assert_allclose(near.speed, [0.4 + point.z[1], -0.2], atol=1e-12)
    np.testing.assert_allclose(near.reach, [1, 2 + point.z[0] ** 2], atol=1e-12)
    np.testing.assert_allclose(near.yields, COMPLIANCE / 2 * np.array([1.0, 2.0]), rtol=1e-14)  # after a proximal step


def test_unknowns_are_moved_by_one_step_of_newton() -> None:
    """Off by delta, values are those of the solution but for delta^2."""
    dae, point, tau = with_unknowns()
    solved = moved(point, tau)
    errors = []
    for delta in (1e-3, 1e-4):
        point.z[:2] = solved + delta * np.array([1.0, -2.0])
        near = Laws(dae).at(point, tau)
        errors.append(max(np.abs(getattr(near, k) - v).max() for k, v in values(point, tau).items()))
    assert errors[0] < 1e-4
    assert errors[1] == pytest.approx(errors[0] / 100, rel=0.1)


def test_unknowns_without_a_slope_give_no_answer() -> None:
    """At a fold of the equations nothing is guessed: no torques, no ray."""
    dae, point, tau = with_unknowns()
    assert dae.opened is not None
    z = dae.z
    residual = ca.vertcat(z[0] ** 2 - dae.opened.tau[0], z[1] - dae.opened.tau[1])
    singular = replace(dae, opened=replace(dae.opened, residual=residual))
    point.z[0] = 0.0
    assert np.isnan(Laws(singular).at(point, tau).rate_slope).any()
    answer = Complementarity(singular).solve(point, tau, 10.0, bends=True)
    assert answer.tau is None
    assert answer.ray == ()


def test_contacts_count_against_their_force() -> None:
    """A force f opens a gap: with tau = -f the rate is a - G tau, for friction beside it as well."""
    rng = np.random.default_rng(26)
    G = mobility(rng, 3, 3)
    given = Piecewise(rng.normal(size=3), G, np.ones(3), contacts=1)
    dae, point = dae_of(given)
    tau = np.array([0.3, -0.2, -1.5])
    near = Laws(dae).at(point, tau)
    np.testing.assert_allclose(near.rate, given.a - G @ tau, atol=1e-14)
    np.testing.assert_allclose(near.rate_slope, -G, atol=1e-14)
    assert near.lower[2] == -np.inf
    assert near.upper[2] == 0.0


def test_one_way_laws() -> None:
    """Without lower limit it holds any pull one way and slides the other way at its upper bound; likewise without upper limit."""
    for lower, upper, push, tau, mode in (
        (-np.inf, 0.0, -7.0, -7.0, 0.0),
        (-np.inf, 0.0, 7.0, 0.0, 1.0),
        (-np.inf, 2.0, 7.0, 2.0, 1.0),
        (0.0, np.inf, 7.0, 7.0, 0.0),
        (0.0, np.inf, -7.0, 0.0, -1.0),
        (-2.0, np.inf, -7.0, -2.0, -1.0),
        (-np.inf, np.inf, -7.0, -7.0, 0.0),
    ):
        dae, point = dae_of(Piecewise(np.array([push, 0.5]), np.diag([1.0, 2.0]), np.ones(2)))
        assert dae.opened is not None
        opened = replace(dae.opened, lower=ca.SX([lower, -1]), upper=ca.SX([upper, 1]))
        answer = Complementarity(replace(dae, opened=opened)).solve(point, np.zeros(2), ZONE, bends=True)
        assert answer.tau is not None
        assert answer.tau[0] == pytest.approx(tau, abs=1e-6)
        assert answer.modes == {0: mode, 1: 0.0}


@pytest.mark.parametrize("load", [3.0, -3.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_one_limit_of_a_one_way_law_bends(way: float, load: float) -> None:
    """Its limit is 1 + 0.5 |tau_1| = 2.5 with the held load of 3 on either side; pushed beyond it slides, pushed back it holds."""
    given = Piecewise(
        np.array([9.0 * way, load]), np.eye(2), np.array([1.0, 5.0]),
        W=np.array([[0.5], [0.0]]), C=np.array([[0.0, 1.0]]), c=np.zeros(1),
    )  # fmt: skip
    dae, point = dae_of(given)
    assert dae.opened is not None
    limits = (ca.SX(-np.inf), dae.opened.upper[0]) if way > 0.0 else (dae.opened.lower[0], ca.SX(np.inf))
    lower, upper = (
        ca.vertcat(one, each[1]) for one, each in zip(limits, (dae.opened.lower, dae.opened.upper), strict=True)
    )
    problem = Complementarity(replace(dae, opened=replace(dae.opened, lower=lower, upper=upper)))
    answer = problem.solve(point, np.zeros(2), ZONE, bends=True)
    np.testing.assert_allclose(np.array(answer.tau), [2.5 * way, load], atol=1e-6)
    assert answer.modes == {0: way, 1: 0.0, 2: float(load > 0.0)}


def test_a_law_of_no_width_is_free() -> None:
    """Where it may be; else it slides or rests with its one torque."""
    given = Piecewise(np.array([1.0, 1.0]), np.eye(2), np.array([0.0, 5.0]))
    dae, point = dae_of(given)
    free = replace(dae, frictions=tuple(replace(f, may_free=True) for f in dae.frictions))
    answer = Complementarity(free).solve(point, np.zeros(2), ZONE, bends=True)
    assert answer.modes == {0: 2.0, 1: 0.0}
    np.testing.assert_allclose(np.array(answer.tau), [0.0, 1.0], atol=1e-7)
    assert answered(given).modes[0] == 1.0


@pytest.mark.parametrize(("pull", "mode", "torque"), [(4.0, -1.0, -3.0), (0.5, 2.0, 0.5)])
def test_a_law_is_free_at_the_torques_that_are_found(pull: float, mode: float, torque: float) -> None:
    """A clutch that slips backward and is pressed by another's torque, |tau| <= tau_2 - 1: below one it opens."""
    given = Piecewise(
        np.array([0.0, pull]),
        np.eye(2),
        np.array([-1.0, 9.0]),
        speed=np.array([-5.0, 0.0]),
        B=np.array([[0.0, 1], [0, 0]]),
    )
    dae, point = dae_of(given)
    free = replace(dae, frictions=tuple(replace(f, may_free=True) for f in dae.frictions))
    for guess in (np.zeros(2), np.array([0.0, 6.0])):
        answer = Complementarity(free).solve(point, guess, ZONE, bends=True)
        assert answer.modes == {0: mode, 1: 0.0}
        np.testing.assert_allclose(np.array(answer.tau), [torque, pull], atol=1e-6)


def test_a_speed_within_the_zone_is_rest_and_one_beyond_is_not() -> None:
    given = Piecewise(np.array([1.0, 1.0]), np.eye(2), np.full(2, 5.0), speed=np.array([0.9 * ZONE, -1.1 * ZONE]))
    assert answered(given).modes == {0: 0.0, 1: -1.0}
    np.testing.assert_allclose(np.array(answered(given).tau), [1.0, -5.0], atol=1e-7)


def test_an_algebraic_law_is_decided_by_its_speed() -> None:
    """Its rate is its speed, so that it is at rest or not as its torque makes it."""
    given = Piecewise(np.array([9.0, 1.0]), np.eye(2), np.full(2, 5.0), speed=np.array([4.0, -4.0]))
    dae, point = dae_of(given)
    algebraic = replace(dae, frictions=tuple(replace(f, algebraic=True) for f in dae.frictions))
    answer = Complementarity(algebraic).solve(point, np.zeros(2), ZONE, bends=True)
    assert answer.modes == {0: 1.0, 1: 0.0}
    np.testing.assert_allclose(np.array(answer.tau), [5.0, 1.0], atol=1e-7)


def test_a_rate_that_no_torque_can_make_ends_on_the_ray_of_the_laws_involved() -> None:
    """Two laws without limits on one motion that are asked for two rates cannot be; a third beside them is not named."""
    G = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 1]])
    dae, point = dae_of(Piecewise(np.array([1.0, -1.0, 1.0]), G, np.ones(3)))
    assert dae.opened is not None
    opened = replace(
        dae.opened, lower=ca.SX([-np.inf, 0, -1]), upper=ca.SX([0, np.inf, 1]), compliance=ca.SX([0, 0, 1])
    )
    answer = Complementarity(replace(dae, opened=opened)).solve(point, np.zeros(3), ZONE, bends=True)
    assert answer.tau is not None  # both slide apart: w1 > 0 at its upper bound, w2 < 0 at its lower one
    assert answer.modes == {0: 1.0, 1: -1.0, 2: 0.0}
    point.x[:] = 0.0
    locked = replace(opened, lower=ca.SX([0, -np.inf, -1]), upper=ca.SX([np.inf, 0, 1]))
    answer = Complementarity(replace(dae, opened=locked)).solve(point, np.zeros(3), ZONE, bends=True)
    assert answer.tau is None
    assert answer.ray == (0, 1)


def test_a_ray_names_laws_of_which_only_the_rate_grows() -> None:
    """Both laws narrow the bounds as they pull; on the ray the second moves faster and faster at its upper bound."""
    B = np.array([[-3.0, -3.0], [1.0, -2.0]])
    answer = answered(Piecewise(np.array([3.0, -2.0]), np.eye(2), np.array([0.0, 2.0]), B=B))
    assert answer.tau is None
    assert answer.ray == (0, 1)


def test_a_bound_that_follows_its_own_torque_gives_no_answer() -> None:
    """The lower bound is tau - 2, the upper one 2 - tau: no torque is at the lower bound, and none is measured from it."""
    answer = answered(Piecewise(np.array([1.0]), np.eye(1), np.array([2.0]), B=-np.eye(1)))
    assert answer.tau is None
    assert answer.ray == ()


@pytest.mark.parametrize("size", [1.0, 1e8])
def test_a_condition_that_is_zero_but_for_round_off_keeps_its_side(size: float) -> None:
    """Torques of a third, two thirds and minus one add up to zero, though their doubles do not, nor does what compliance leaves."""
    given = Piecewise(
        np.array([1.0, 2.0, -3.0]) / 3.0 * size, np.eye(3), np.full(3, 9.0 * size), C=np.ones((1, 3)), c=np.array([1e-17 * size])
    )  # fmt: skip
    assert set(answered(given).modes) == {0, 1, 2}
    assert answered(replace(given, c=np.array([1e-6 * size]))).modes[3] == 1.0
    assert answered(replace(given, c=np.array([-1e-6 * size]))).modes[3] == 0.0


@pytest.mark.parametrize("unit", [1e-14, 1e14])
def test_unit_of_the_conditions_does_not_matter(unit: float) -> None:
    rng = np.random.default_rng(27)
    for _ in range(10):
        given = bent(rng, 3, 0.04)
        other = replace(given, C=given.C * unit, c=given.c * unit, W=given.W / unit)
        first, second = answered(given), answered(other)
        assert first.tau is not None
        assert second.tau is not None
        np.testing.assert_allclose(second.tau, first.tau, atol=1e-9 * (1.0 + np.abs(first.tau).max()))
        assert second.modes == first.modes


@pytest.mark.skipif(bool(np.finfo(np.longdouble).eps > 1e-18), reason="no extended precision on this machine")
def test_inverse_in_extended_precision() -> None:
    rng = np.random.default_rng(28)
    u, _, v = np.linalg.svd(rng.normal(size=(5, 5)))
    matrix = u @ np.diag(10.0 ** np.linspace(0, -4, 5)) @ v
    inverse = _inverse(matrix)
    assert inverse.dtype == np.longdouble
    assert float(np.abs(matrix.astype(np.longdouble) @ inverse - np.eye(5)).max()) < 1e-14


@pytest.mark.parametrize(
    ("push", "mode", "expected"), [(6.0, 0.0, 0.0), (6.0, 1.0, 1.0), (8.0, 0.0, 1.0), (4.0, 1.0, 0.0)]
)
def test_what_is_stuck_has_to_be_broken_away(push: float, mode: float, expected: float) -> None:
    """Bounds of 5 and a break-away ratio of 1.5: 6 moves what moved before and not what was stuck; a law that slides feels no ratio."""
    dae, point = dae_of(Piecewise(np.array([push, 9.0]), np.eye(2), np.full(2, 5.0), speed=np.array([0.0, 1.0])))
    assert dae.opened is not None
    opened = replace(dae.opened, peak=ca.SX([1.5, 1.5]))
    point.m[0] = mode
    answer = Complementarity(replace(dae, opened=opened)).solve(point, np.zeros(2), ZONE, bends=True)
    assert answer.modes == {0: expected, 1: 1.0}
    assert answer.tau is not None
    assert answer.tau[1] == pytest.approx(5.0)


@pytest.mark.parametrize("other", [3.0, -3.0])
@pytest.mark.parametrize(("push", "stays"), [(1.52, True), (-1.52, True), (1.6, False), (-1.6, False)])
def test_a_break_away_ratio_widens_bounds_that_bend(push: float, stays: bool, other: float) -> None:
    """A law that is stuck holds 1.2 times the bound 1 + |tau_2|/10, that is 1.56, where tau_2 is 3 or -3."""
    given = Piecewise(
        np.array([push, other]),
        np.eye(2),
        np.array([1.0, 9.0]),
        W=np.array([[0.1], [0.0]]),
        C=np.array([[0.0, 1.0]]),
        c=np.zeros(1),
    )
    dae, point = dae_of(given)
    assert dae.opened is not None
    for peak, expected in ((1.0, np.sign(push)), (1.2, 0.0 if stays else np.sign(push))):
        opened = replace(dae.opened, peak=ca.SX([peak, 1.0]))
        answer = Complementarity(replace(dae, opened=opened)).solve(point, np.zeros(2), ZONE, bends=True)
        assert answer.modes[0] == expected
    marked = tuple(replace(law, rests=3) for law in dae.frictions[:1])  # whether it is at its peak, but not sliding yet
    held = ca.vertcat(dae.m, ca.SX.sym("rests"))
    problem = Complementarity(replace(dae, m=held, opened=opened, frictions=(*marked, dae.frictions[1])))
    assert problem.solve(replace(point, m=np.zeros(4)), np.zeros(2), ZONE, bends=True).modes[3] == float(not stays)
