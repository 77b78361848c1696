"""Speeds of stuck laws are set to zero by the smallest change of the states: against dense linear algebra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import dae

from powertrain.dae.hybrid import Friction, HybridDae, Opened
from powertrain.modes.projection import at_rest

Matrix = np.ndarray[Any, Any]
Speeds = Callable[[Any, Any, Any], Sequence[Any]]


def laws(speeds: Speeds, n: int, count: int) -> HybridDae:
    """Friction laws with these speeds, functions of (t, x, p)."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", n), ca.SX.sym("m", count), ca.SX.sym("p", 1)
    zero = ca.SX(0)
    frictions = tuple(
        Friction(f"law{k}", "hand", k, w, zero, zero, zero, ca.SX(1), zero) for k, w in enumerate(speeds(t, x, p))
    )
    return dae(t, x, m, p, ca.SX.zeros(n), [f"x{i}" for i in range(n)], frictions=frictions)


def projected(model: HybridDae, x: Matrix, modes: Matrix, t: float = 0.0, p: float = 0.0) -> Matrix:
    function = ca.Function("f", [model.t, model.x, model.m, model.p], [ca.densify(at_rest(model))])
    return np.array(function(t, x, modes, p), float).ravel()


def least(A: Matrix, x: Matrix) -> Matrix:
    return np.asarray(x - np.linalg.pinv(A, rcond=1e-9) @ A @ x)


@pytest.mark.parametrize("seed", range(12))
def test_least_change(seed: int) -> None:
    """x - A+ A x for the stuck rows, with rows that others already hold, in any order."""
    rng = np.random.default_rng(seed)
    n, k = 9, 7
    A = rng.normal(size=(k, n)) * (rng.random((k, n)) < 0.6)
    A[3], A[5] = A[0] - 2 * A[1], 0.0
    A = A[rng.permutation(k)]
    modes = rng.choice([0.0, 0.0, 1.0, -1.0, 2.0], k)
    x = rng.normal(size=n)
    found = projected(laws(lambda t, y, p: ca.vertsplit(ca.DM(A) @ y), n, k), x, modes)
    np.testing.assert_allclose(found, least(A[modes == 0], x), atol=1e-12)
    assert np.abs(A[modes == 0] @ found).max(initial=0.0) <= 1e-14 * np.abs(A).max() * np.abs(x).max() * n


@pytest.mark.parametrize("seed", range(6))
def test_states_that_are_speeds_of_stuck_laws_are_zero_to_the_last_bit(seed: int) -> None:
    """And the laws beside them that share these states take the rest of their motion from the other states."""
    rng = np.random.default_rng(seed)
    A, x = rng.normal(size=(3, 6)), rng.normal(size=6)
    model = laws(lambda t, y, p: [y[0], *ca.vertsplit(ca.DM(A) @ y), y[2]], 6, 5)
    found = projected(model, x, np.zeros(5))
    assert (found[0], found[2]) == (0.0, 0.0)
    np.testing.assert_allclose(found, least(np.vstack([np.eye(6)[[0, 2]], A]), x), atol=1e-12)
    loose = projected(model, x, np.array([1.0, 0.0, 2.0, 0.0, 0.0]))
    np.testing.assert_allclose(loose, least(np.vstack([A[[0, 2]], np.eye(6)[2]]), x), atol=1e-12)


def test_two_laws_on_one_motion() -> None:
    """The second leaves nothing to divide by."""
    found = projected(
        laws(lambda t, x, p: [x[0] - x[1], x[0] - x[1], x[1] - x[0]], 2, 3), np.array([3.0, 1.0]), np.zeros(3)
    )
    np.testing.assert_array_equal(found, [2.0, 2.0])


def test_speeds_that_are_not_linear_and_depend_on_time_and_parameters() -> None:
    """From 1e-3 off to 1e-6: two steps, the second with the slopes of the first."""
    model = laws(lambda t, x, p: [x[0] * (1 + 0.3 * x[1]) - t * p[0], x[1] ** 2 - 1], 2, 2)
    found = projected(model, np.array([1.001, 0.999]), np.zeros(2), t=2.0, p=0.65)
    np.testing.assert_allclose(found, [1.0, 1.0], atol=2e-6)


@pytest.mark.parametrize("kind", ["algebraic", "prescribed"])
def test_laws_whose_speed_is_no_state_are_left_alone(kind: str) -> None:
    model = laws(lambda t, x, p: [x[0], x[1] - x[0]], 2, 2)
    flags: dict[str, Any] = {kind: True}
    model = replace(model, frictions=(model.frictions[0], replace(model.frictions[1], **flags)))
    np.testing.assert_allclose(projected(model, np.array([3.0, 4.0]), np.zeros(2)), [0.0, 4.0], atol=1e-15)


def test_a_chain_costs_as_much_as_it_is_long() -> None:
    """Laws that meet only their neighbours: instructions grow with their number."""

    def size(n: int) -> int:
        model = laws(lambda t, x, p: [x[i + 1] - x[i] for i in range(n - 1)], n, n - 1)
        return int(ca.Function("f", [model.x, model.m], [at_rest(model)]).n_instructions())

    assert size(80) < 2.2 * size(40)


def test_gears_on_one_shaft_cost_as_much_as_they_are_many() -> None:
    """Laws whose speeds are multiples of one state form no matrix; a multiple that is zero holds nothing."""

    def meshes(n: int) -> HybridDae:
        return laws(lambda t, x, p: [(p + k) * x[0] for k in range(n - 1)] + [x[0] - x[1]], 2, n)

    def size(n: int) -> int:
        model = meshes(n)
        return int(ca.Function("f", [model.x, model.m, model.p], [at_rest(model)]).n_instructions())

    assert size(80) < 2.2 * size(40)
    x, one = np.array([3.0, 1.0]), meshes(3)
    np.testing.assert_array_equal(projected(one, x, np.array([0.0, 1.0, 1.0])), x)
    np.testing.assert_array_equal(projected(one, x, np.array([0.0, 0.0, 1.0])), [0.0, 1.0])
    np.testing.assert_allclose(projected(one, x, np.array([0.0, 1.0, 0.0])), [2.0, 2.0])
    np.testing.assert_array_equal(projected(one, x, np.zeros(3)), [0.0, 0.0])


@pytest.mark.parametrize("coefficients", [(1.0, 1e-16, 0.0), (0.0, (0.1 * 3.0) / 0.3 - 1.0, 0.0), (1.0, -2e-15, 1e-15)])
def test_round_off_is_no_motion(coefficients: tuple[float, ...]) -> None:
    """A stuck law whose speed follows, but for round-off, from one that is zero already, or from none: the other states stay."""
    x = np.array([0.0, 100.0, -30.0])

    def speeds(t: Any, y: Any, p: Any) -> list[Any]:
        slope = (1.0 + coefficients[1] + p) - (1.0 + p)  # as a ratio over its equal
        return [y[0], coefficients[0] * y[0] + slope * y[1] + coefficients[2] * y[2]]

    found = projected(laws(speeds, 3, 2), x, np.zeros(2), p=0.3)
    np.testing.assert_allclose(found, x, rtol=1e-12)


def test_a_second_step_takes_away_what_a_speed_that_is_not_linear_leaves() -> None:
    """w = x0 + x1^2: one step leaves the square of its change; two with the same slopes, the product of that and the change of slope."""
    model = laws(lambda t, y, p: [y[0] + y[1] ** 2], 2, 1)
    x = np.array([1e-3, 0.5])
    found = projected(model, x, np.zeros(1))
    W = np.array([1.0, 2 * x[1]])
    w = x[0] + x[1] ** 2
    once = x - W * w / (W @ W)
    left = once[0] + once[1] ** 2
    np.testing.assert_allclose(found, once - W * left / (W @ W), rtol=1e-12)
    assert abs(found[0] + found[1] ** 2) < 0.2 * abs(left)


def test_motions_that_differ_by_a_millionth_are_both_set_to_zero() -> None:
    """What the first leaves of the second is 1e-12 of it: far more than round-off."""
    model = laws(lambda t, y, p: [y[0], y[0] + y[2], y[0] + y[2] + 1e-6 * y[1]], 3, 3)
    found = projected(model, np.array([0.3, 0.4, -0.7]), np.zeros(3))
    assert np.abs(found).max() < 1e-5


def test_states_that_torques_move_through_implicit_unknowns_yield_too() -> None:
    """The first state is moved by the torque itself, the second by an unknown that follows from it, the third by nothing."""
    model = laws(lambda t, y, p: [y[0] + y[1] + y[2]], 3, 1)
    z, torque, none, one = ca.SX.sym("z"), ca.SX.sym("torque"), ca.SX(0, 1), ca.SX(1)
    rates = ca.vertcat(torque, z, 0)
    opened = Opened(torque, rates, z**3 - torque, one, one, -one, one, one, one, one, none)
    function = at_rest(replace(model, z=z, residual=z**3 - torque, opened=opened))
    found = ca.Function("f", [model.x, model.m], [function])([1.0, 2.0, 3.0], [0.0])
    np.testing.assert_allclose(np.array(found).ravel(), [-2.0, -1.0, 3.0], atol=1e-14)
