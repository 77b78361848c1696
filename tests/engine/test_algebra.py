"""The damped Newton iteration for algebraic unknowns: roots that are known, bad starts, kinks, singular points, and what has no root."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from models import dae
from scipy.optimize import brentq

from powertrain.modes.algebra import AlgebraicSolver, NotConsistent
from powertrain.numerics.buffers import Memory

Matrix = np.ndarray[Any, Any]


def algebra(residual: Any, unknowns: int, x: Any = (), m: Any = (), p: Any = ()) -> tuple[AlgebraicSolver, Memory]:
    """``residual(t, x, z, m, p)`` as a model of its own."""
    t, states, z = ca.SX.sym("t"), ca.SX.sym("x", len(x)), ca.SX.sym("z", unknowns)
    held, parameters = ca.SX.sym("m", len(m)), ca.SX.sym("p", len(p))
    equations = ca.vertcat(*residual(t, states, z, held, parameters))
    names = [f"x{i}" for i in range(len(x))]
    model = dae(t, states, held, parameters, ca.SX.zeros(len(x)), names, z=z, residual=equations)
    memory = Memory(model, 0, 0)
    memory.m[: len(m)], memory.p[: len(p)] = m, p
    for side in memory.y:
        side[: len(x)] = x
    return AlgebraicSolver(model, memory), memory


def solved(residual: Any, start: Any, **given: Any) -> Matrix:
    found, memory = algebra(residual, len(start), **given)
    n = len(given.get("x", ()))
    memory.y[1][n : n + len(start)] = start
    found.solve(1)
    return memory.y[1][n : n + len(start)].copy()


@pytest.mark.parametrize("n", [1, 3, 8])
def test_linear_systems_take_one_step(n: int) -> None:
    rng = np.random.default_rng(n)
    A, b = rng.normal(size=(n, n)), rng.normal(size=n)
    found = solved(lambda t, x, z, m, p: [ca.DM(A) @ z - ca.DM(b)], rng.normal(size=n) * 100)
    np.testing.assert_allclose(found, np.linalg.solve(A, b), rtol=1e-10, atol=1e-10)


def evaluations(residual: Any, start: Any) -> int:
    """How often the equations are evaluated until they are solved."""
    found, memory = algebra(residual, len(start))
    memory.y[1][: len(start)] = start
    count, equations = [0], found.equations

    def counted(side: int) -> tuple[Any, Any]:
        count[0] += 1
        return equations(side)

    found.equations = counted  # type: ignore[method-assign]
    found.solve(1)
    return count[0]


def test_convergence_is_quadratic() -> None:
    """A linear system takes two steps, the last to see that it ends; a smooth one doubles its digits with every step."""
    A = np.array([[2.0, 1], [1, -3]])
    assert evaluations(lambda t, x, z, m, p: [ca.DM(A) @ z - 5], [100.0, 3.0]) <= 3
    assert evaluations(lambda t, x, z, m, p: [z + ca.sinh(z) - 2], [0.9]) <= 6


def test_time_states_modes_and_parameters_are_those_of_memory() -> None:
    found, memory = algebra(
        lambda t, x, z, m, p: [z - (t + 10 * x[0] + 100 * m[0] + 1000 * p[0])], 1, [2.0], [3.0], [4.0]
    )
    memory.time[0] = 1.0
    memory.y[0][0] = 5.0
    found.solve(1)
    assert memory.y[1][1] == pytest.approx(4321.0)
    assert memory.y[0][1] == 0.0
    found.solve(0)
    assert memory.y[0][1] == pytest.approx(4351.0)


def test_the_jacobian_has_equations_in_rows() -> None:
    found, memory = algebra(lambda t, x, z, m, p: [z[0] + 2 * z[1], z[0] * z[1]], 2)
    memory.y[0][:2] = 3.0, 4.0
    np.testing.assert_allclose(found.equations(0)[0], [[1, 2], [4, 3]])


@pytest.mark.parametrize("start", [-30.0, -2.0, 1.5, 20.0, 300.0])
def test_bad_starts_are_damped(start: float) -> None:
    """Full steps on arctan diverge from beyond 1.39; a cubic with a flat part sends them far away."""
    assert solved(lambda t, x, z, m, p: [ca.atan(z)], [start])[0] == pytest.approx(0.0, abs=1e-10)
    root = brentq(lambda z: z**3 + 0.01 * z - 2, -50, 50, xtol=1e-15)
    assert solved(lambda t, x, z, m, p: [z**3 + 0.01 * z - 2], [start])[0] == pytest.approx(root, abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_random_systems_that_are_not_linear(seed: int) -> None:
    """z + S tanh(z) with S small enough to be monotone: one root, from anywhere."""
    rng = np.random.default_rng(seed)
    n = 5
    S = rng.normal(size=(n, n))
    S *= 0.9 / np.linalg.norm(S, 2)
    root = rng.normal(size=n) * 3
    right = root + S @ np.tanh(root)
    found = solved(lambda t, x, z, m, p: [z + ca.DM(S) @ ca.tanh(z) - ca.DM(right)], rng.normal(size=n) * 50)
    np.testing.assert_allclose(found, root, atol=1e-9)


def test_a_kink_is_solved_from_either_side() -> None:
    """2 z above zero, z/2 below: the residual falls, though a full step lands on the other side."""
    for start in (-5.0, 5.0, 0.0):
        for right in (3.0, -3.0, 0.0):
            found = solved(lambda t, x, z, m, p, right=right: [ca.if_else(z > 0, 2 * z, z / 2) - right], [start])
            assert found[0] == pytest.approx(right / 2 if right > 0 else 2 * right, abs=1e-9)


def test_a_singular_start_takes_the_least_step() -> None:
    """z0 + z1 = 2 twice at the start: least squares moves both alike, and the second equation then tells them apart."""
    found = solved(lambda t, x, z, m, p: [z[0] + z[1] - 2, z[0] + z[1] - 2 + (z[0] - z[1]) * (z[0] + z[1])], [0.0, 0.0])
    np.testing.assert_allclose(found, [1.0, 1.0], atol=1e-9)


def test_a_double_root_is_close_enough() -> None:
    """Newton's method converges linearly there: the nearest point is as good as the modes are known."""
    found = solved(lambda t, x, z, m, p: [(z - 1.0) ** 2], [3.0])
    assert found[0] == pytest.approx(1.0, abs=1e-4)


def test_the_nearest_point_is_kept_where_the_iteration_goes_to_and_fro() -> None:
    """A kink whose least value counts as zero: full steps end at 7.5e-10 and 1.5e-9 in turn, from either side."""
    for start in (-1.0, 1.0):
        found = solved(lambda t, x, z, m, p: [ca.if_else(z > 0, 5 * z, -10 * z) + 5e-10], [start])
        assert max(5 * found[0], -10 * found[0]) + 5e-10 < 1e-9


def test_equations_that_contradict_each_other_are_refused() -> None:
    """Where least squares stands still nothing is solved."""
    with pytest.raises(NotConsistent, match="no solution near the guess"):
        solved(lambda t, x, z, m, p: [z[0] + z[1] - 2, z[0] + z[1] - 3], [0.0, 0.0])


@pytest.mark.parametrize(("equation", "start"), [
    (lambda z: z**2 + 1, 0.7),
    (lambda z: ca.sqrt(z) + 1, 1.0),
    (lambda z: ca.if_else(z > 0, 5 * z, -10 * z) + 1e-8, 1.0),
    (lambda z: ca.log(z - 5), 1.0),
])  # fmt: skip
def test_what_has_no_root_is_refused_with_the_equation(equation: Any, start: float) -> None:
    with pytest.raises(NotConsistent, match=r"no solution near the guess(.|\n)*left minus right is"):
        solved(lambda t, x, z, m, p: [equation(z)], [start])


def test_the_worst_equations_are_quoted_first() -> None:
    with pytest.raises(NotConsistent) as caught:
        solved(lambda t, x, z, m, p: [z[0] - 1, z[1] ** 2 + 1, z[2] ** 2 + 100], [0.0, 0.5, 0.5])
    lines = str(caught.value).splitlines()[1:]
    assert [line.split(":")[0].strip() for line in lines][:2] == ["equation 3 of 3", "equation 2 of 3"]


def test_quick_steps_are_taken_where_they_end_and_not_where_they_do_not() -> None:
    found, memory = algebra(lambda t, x, z, m, p: [z - 7.0], 1)
    inputs = [ca.SX.sym("time", 2), ca.SX.sym("y", 1), ca.SX.sym("m", 0), ca.SX.sym("p", 0)]
    for unsettled, expected in ((0.0, 3.0), (1.0, 7.0)):
        found.hasten(ca.Function("quick", inputs, [ca.densify(ca.SX(3.0)), ca.densify(ca.SX(unsettled))]))
        memory.y[0][0] = 0.0
        found.solve(0)
        assert memory.y[0][0] == pytest.approx(expected)
