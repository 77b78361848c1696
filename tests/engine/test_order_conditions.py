"""The two methods' coefficients against the order conditions of rooted trees, their stability, and their error estimates.

E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.2 and II.6; E. Hairer, G. Wanner, ... II, IV.7 (where a
vertex has one branch a Rosenbrock method takes alpha + gamma, where it has several alpha).
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement
from math import factorial
from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.integration import dopri5, rodas5p
from powertrain.integration.step import StepResult, combined, on_polynomial

Matrix = np.ndarray[Any, Any]
Tree = tuple[Any, ...]
"""A rooted tree: the trees at its root, sorted."""


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """All rooted trees with so many vertices: 1, 1, 2, 4, 9, 20, ..."""
    if order == 1:
        return ((),)
    smaller = [tree for n in range(1, order) for tree in trees(n)]
    found = set()
    for count in range(1, order):
        for branches in combinations_with_replacement(smaller, count):
            if sum(map(size, branches)) == order - 1:
                found.add(tuple(sorted(branches)))
    return tuple(sorted(found))


def size(tree: Tree) -> int:
    return 1 + sum(map(size, tree))


def density(tree: Tree) -> int:
    """gamma(t), the product of the sizes of all subtrees."""
    product = size(tree)
    for branch in tree:
        product *= density(branch)
    return product


def weight(tree: Tree, one: Matrix, several: Matrix) -> Matrix:
    """The elementary weight at every stage; the matrix of a branch depends on how many there are."""
    found = np.ones(len(one))
    for branch in tree:
        found = found * ((one if len(tree) == 1 else several) @ weight(branch, one, several))
    return found


def defects(b: Matrix, one: Matrix, several: Matrix, order: int, theta: float = 1.0) -> float:
    """The largest defect of all conditions b' Phi(t) = theta^|t| / gamma(t) up to an order."""
    found = [abs(b @ weight(t, one, several) - theta**n / density(t)) for n in range(1, order + 1) for t in trees(n)]
    return float(max(found))


def first_defect(b: Matrix, one: Matrix, several: Matrix, order: int) -> float:
    """The largest defect of one order alone."""
    return float(max(abs(b @ weight(t, one, several) - 1 / density(t)) for t in trees(order)))


def test_rooted_trees() -> None:
    assert [len(trees(n)) for n in range(1, 7)] == [1, 1, 2, 4, 9, 20]
    for n in range(1, 6):  # so many monotonic labellings in all
        assert sum(factorial(n) / density(t) / symmetry(t) for t in trees(n)) == pytest.approx(factorial(n - 1))


def symmetry(tree: Tree) -> int:
    found = 1
    for branch in set(tree):
        found *= factorial(tree.count(branch)) * symmetry(branch) ** tree.count(branch)
    return found


def weights_of(expression: ca.SX, k: ca.SX, count: int) -> Matrix:
    return np.array(ca.DM(ca.jacobian(expression, k)))[0, :count]


def explicit() -> tuple[Matrix, ca.SX, StepResult]:
    """A, the stages, and a step of size one from zero, linear in its stages, which are symbols."""
    A = np.zeros((7, 7))
    for i, row in enumerate(dopri5.A, 1):
        A[i, : len(row)] = row
    k = ca.SX.sym("k", 7)
    stage = iter(ca.vertsplit(k)[1:])
    step = dopri5.step(lambda t, y: next(stage), ca.SX(0), ca.SX(1), ca.SX(0), k[0])
    return A, k, step


def test_dormand_prince_satisfies_the_conditions() -> None:
    """Order 5, the estimate of order 4 and no more, the dense output of order 4 at any fraction."""
    A, k, step = explicit()
    np.testing.assert_allclose(A[1:].sum(axis=1), dopri5.C, atol=1e-15)
    b = weights_of(step.end, k, 7)
    assert defects(b, A, A, 5) < 1e-15
    assert first_defect(b, A, A, 6) > 1e-5
    lower = b - weights_of(step.error, k, 7)
    published = [5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40]
    np.testing.assert_allclose(lower, published, rtol=1e-14)  # any share of the error would be of order 4, too
    assert defects(lower, A, A, 4) < 1e-15
    assert first_defect(lower, A, A, 5) > 1e-4
    for theta in np.linspace(0.0, 1.0, 11):
        inside = weights_of(on_polynomial(step.dense, float(theta)), k, 7)
        assert defects(inside, A, A, 4, theta) < 1e-14
    np.testing.assert_allclose(weights_of(on_polynomial(step.dense, 1.0), k, 7), b, atol=1e-14)
    ends = [weights_of(step.dense[:, 1], k, 7), weights_of(step.dense @ ca.DM([0, 1, 2, 3, 4]), k, 7)]
    np.testing.assert_allclose(ends, np.eye(7)[[0, 6]], atol=1e-14)  # its slopes are those of the method


def rosenbrock() -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix]:
    """alpha and Gamma, and the weights b' = m' Gamma of the end, the error and the columns of the dense output."""
    g = rodas5p.GAMMA
    a, c = np.zeros((8, 8)), np.zeros((8, 8))
    for i in range(8):
        a[i, :i], c[i, :i] = rodas5p.A[i], rodas5p.C[i]
    gamma = np.linalg.inv(np.eye(8) / g - c)
    m = np.append(rodas5p.A[7], 1.0)
    first, second, third = (np.array(row) for row in rodas5p.DENSE)
    dense = np.array([m * 0, m + first, second - first, third - second, -third])
    return a @ gamma, gamma, m @ gamma, np.eye(8)[7] @ gamma, dense @ gamma


def test_rodas5p_satisfies_the_conditions() -> None:
    """Order 5, the embedded method of order 4, the dense output of order 4 at any fraction."""
    alpha, gamma, b, error, dense = rosenbrock()
    beta = alpha + gamma
    np.testing.assert_allclose(alpha.sum(axis=1), rodas5p.ALPHA, atol=1e-12)
    np.testing.assert_allclose(gamma.sum(axis=1), rodas5p.GAMMA_SUM, atol=1e-11)
    np.testing.assert_allclose(np.diag(gamma), rodas5p.GAMMA, rtol=1e-14)
    assert defects(b, beta, alpha, 5) < 1e-11
    lower = b - error
    assert defects(lower, beta, alpha, 4) < 1e-11
    assert first_defect(lower, beta, alpha, 5) > 1e-6
    for theta in np.linspace(0.0, 1.0, 11):
        inside = theta ** np.arange(5) @ dense
        assert defects(inside, beta, alpha, 4, theta) < 1e-11
    np.testing.assert_allclose(dense.sum(axis=0), b, atol=1e-12)


def test_rodas5p_is_stiffly_accurate() -> None:
    """The last two rows of alpha + Gamma are the weights of the lower and of the higher method."""
    alpha, gamma, b, error, _ = rosenbrock()
    np.testing.assert_allclose((alpha + gamma)[7], b, atol=1e-11)
    np.testing.assert_allclose((alpha + gamma)[6], b - error, atol=1e-11)


def stability(z: Matrix) -> tuple[Matrix, Matrix]:
    """The end and the error of one step for y' = z y, y(0) = 1, h = 1, as the code takes it."""
    y, lam = ca.SX.sym("y", 2), ca.SX.sym("lam", 2)  # real and imaginary part
    J = ca.vertcat(ca.horzcat(lam[0], -lam[1]), ca.horzcat(lam[1], lam[0]))
    step = rodas5p.step(lambda t, u: J @ u, ca.densify(J), ca.SX.zeros(2), 2, ca.SX(0), ca.SX(1), y, J @ y)
    function = ca.Function("f", [y, lam], [step.end, step.error])
    found = [[complex(float(e[0]), float(e[1])) for e in function([1, 0], [v.real, v.imag])] for v in z]
    return np.array(found)[:, 0], np.array(found)[:, 1]


def test_rodas5p_is_l_stable() -> None:
    z = np.concatenate([1j * np.linspace(-60, 60, 121), -(10.0 ** np.linspace(-2, 4, 25))])
    assert np.abs(stability(z)[0]).max() <= 1.0 + 1e-9
    assert abs(stability(np.array([-1e9 + 0j]))[0][0]) < 1e-6
    small = np.array([0.01 + 0.02j])
    assert abs(stability(small)[0][0] - np.exp(small)[0]) < 1e-12


def test_rodas5p_estimates_the_difference_of_its_two_methods() -> None:
    """b' k and e' k with (1 - z (alpha + Gamma)) k = z, the stages of y' = z y in the classical form."""
    alpha, gamma, b, error, _ = rosenbrock()
    for z in (-0.7 + 0j, 0.3 + 0.9j, -20 + 0j):
        k = np.linalg.solve(np.eye(8) - z * (alpha + gamma), np.full(8, z))
        end, estimate = stability(np.array([z]))
        np.testing.assert_allclose([end[0], estimate[0]], [1 + b @ k, error @ k], rtol=1e-9)


def test_a_step_from_a_stage_of_its_own() -> None:
    """Everything of the order of h: both methods integrate a polynomial of degree 4 in time exactly, inside the step as well."""
    t, h, y = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("y", 1)

    def rate(t: ca.SX, y: ca.SX) -> ca.SX:
        return 1 + 2 * t + 3 * t**2 + 4 * t**3

    taken = [
        dopri5.step(rate, t, h, y, rate(t, y)),
        rodas5p.step(rate, ca.SX(1, 1), ca.jacobian(rate(t, y), t), 1, t, h, y, rate(t, y)),
    ]
    for step in taken:
        q = ca.SX.sym("q")
        f = ca.Function("f", [t, h, y, q], [on_polynomial(step.dense, q), step.end, step.error])
        for fraction in (0.0, 0.3, 1.0):
            at = 0.7 + 0.2 * fraction
            inside, end, error = (float(v) for v in f(0.7, 0.2, 5.0, fraction))
            assert inside == pytest.approx(5.0 + sum(at**k - 0.7**k for k in range(1, 5)), abs=1e-12)
            assert end == pytest.approx(5.0 + sum(0.9**k - 0.7**k for k in range(1, 5)), abs=1e-12)
            assert abs(error) < 1e-12


def test_the_stiffness_estimate_is_the_spectral_radius_times_the_step() -> None:
    """For y' = -50 y, also where h differs from one; a small multiple of it for matrices."""
    t, h, y = ca.SX(0), ca.SX.sym("h"), ca.SX.sym("y", 1)
    step = dopri5.step(lambda t, y: -50 * y, t, h, y, -50 * y)
    f = ca.Function("f", [h, y], [step.stiffness])
    for size in (0.01, 0.05):
        assert float(f(size, 2.0)) == pytest.approx(50 * size, rel=1e-9)


def test_combined_leaves_out_zeros() -> None:
    nothing = ca.SX.sym("never", 2)
    found = combined((2.0, 0.0, -1.0), [ca.SX([1, 2]), nothing, ca.SX([3, 4])])
    assert not ca.depends_on(found, nothing)
    np.testing.assert_allclose(np.array(ca.DM(found)).ravel(), [-1.0, 0.0])
