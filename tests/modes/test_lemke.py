"""Lemke's method against all 2^n complementary bases, against linear programming, and where the ratio test is tied."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from powertrain.modes import lemke as module
from powertrain.modes.lemke import Solution, lemke

Matrix = np.ndarray[Any, Any]
TIGHT = 1e-10

KOSTREVA = np.array([[1.0, 2, 0], [0, 1, 2], [2, 0, 1]])
"""M. M. Kostreva, Cycling in linear complementarity problems, Mathematical Programming 16 (1979) 127; with q = -1 z is 1/3."""
CYCLES = [
    (np.array([[-1.0, 2, 0], [0, 1, -2], [-2, 0, 1]]), np.array([-1.0, -1, -1])),
    (np.array([[0.0, 1, 2], [2, 1, 1], [-1, 0, 1]]), np.array([-1.0, -1, -1])),
    (np.array([[-1.0, 1, 2], [1, 0, 1], [-2, -1, 0]]), np.array([-1.0, -1, 0])),
    (np.array([[0.0, 2, 0], [1, 1, -2], [-2, 1, 1]]), np.array([-1.0, -1, -1])),
]
"""With the first of tied rows the method comes back to a basis that it had."""


def all_solutions(M: Matrix, q: Matrix) -> list[Matrix]:
    """The z of all complementary bases that are regular and feasible."""
    n, found = len(q), []
    for chosen in product((False, True), repeat=n):
        B = np.flatnonzero(chosen)
        z = np.zeros(n)
        if B.size:
            if abs(np.linalg.det(M[np.ix_(B, B)])) < 1e-9:
                continue
            z[B] = np.linalg.solve(M[np.ix_(B, B)], -q[B])
        if z.min(initial=0.0) >= -1e-11 and (q + M @ z).min() >= -1e-11:
            found.append(z)
    return found


def solves(found: Solution, M: Matrix, q: Matrix) -> None:
    """w = q + M z, both not negative, one of each pair zero."""
    assert found.z is not None
    assert found.w is not None
    z, w = np.array(found.z, float), np.array(found.w, float)
    np.testing.assert_allclose(w, q + M @ z, atol=TIGHT)
    assert z.min() >= 0.0
    assert w.min() >= 0.0
    assert (np.minimum(z, w) == 0.0).all()


def feasible(M: Matrix, q: Matrix) -> bool:
    """Whether z >= 0 exists with q + M z >= 0."""
    from scipy.optimize import linprog

    return bool(linprog(np.zeros(len(q)), A_ub=-M, b_ub=q, method="highs").status == 0)


@pytest.mark.parametrize("n", [1, 2, 4, 6])
def test_p_matrices_have_the_one_solution_of_all_bases(n: int) -> None:
    """Positive definite, not symmetric; and strictly diagonally dominant ones. Half of the vectors have zeros and equal entries."""
    rng = np.random.default_rng(n)
    for k in range(40):
        root = rng.normal(size=(n, n))
        skew = rng.normal(size=(n, n))
        M = root @ root.T + 0.1 * np.eye(n) + skew - skew.T
        if k % 3 == 0:
            M = rng.normal(size=(n, n))
            M += np.diag(np.abs(M).sum(axis=1) - np.diag(M))
        q = rng.normal(size=n) if k % 2 else rng.integers(-1, 2, n).astype(float)
        found = lemke(M, q)
        solves(found, M, q)
        for z in all_solutions(M, q):
            np.testing.assert_allclose(np.array(found.z, float), z, atol=1e-9)


@pytest.mark.parametrize("seed", [*range(6), 100009, 100011])  # in the last two, ties are broken by round-off
def test_copositive_plus_a_ray_proves_that_there_is_no_solution(seed: int) -> None:
    """Semidefinite of low rank plus a skew part is copositive-plus: solvable if feasible. Both ends occur."""
    rng = np.random.default_rng(seed)
    ends = set()
    for _ in range(30):
        n, rank = 5, int(rng.integers(0, 4))
        root = rng.integers(-2, 3, (n, rank)).astype(float)
        skew = rng.integers(-1, 2, (n, n)).astype(float)
        M, q = root @ root.T + skew - skew.T, rng.integers(-2, 3, n).astype(float)
        found = lemke(M, q)
        ends.add(found.z is not None)
        if found.z is not None:
            solves(found, M, q)
        else:
            assert found.ray
            assert not feasible(M, q)
            assert not all_solutions(M, q)
    assert ends == {True, False}


def test_a_tie_that_round_off_breaks_does_not_hide_the_solution() -> None:
    """Copositive-plus with the solution z = (2, 0, 0). Thirds leave 1e-19 of the artificial variable in a basis that solves the problem."""
    M, q = np.array([[0.0, -1, -1], [1, 1, -2], [1, -2, 4]]), np.array([0.0, 0, -2])
    found = lemke(M, q)
    solves(found, M, q)
    np.testing.assert_allclose(np.array(found.z, float), [2.0, 0.0, 0.0], atol=TIGHT)


def test_a_violation_beyond_round_off_is_no_solution() -> None:
    """Two opposite conditions on one variable, which miss each other by 1e-12."""
    M = np.array([[0.0, 0, 1], [0, 0, -1], [-1, 1, 0]])
    assert lemke(M, np.array([-1.0, 1.0 - 1e-9, 1.0])).z is None
    q = np.array([-1.0, 1.0 - 1e-15, 1.0])
    solves(lemke(M, q), M, q)


def test_nonnegative_with_positive_diagonal_always_has_a_solution() -> None:
    """Strictly copositive: Lemke's method ends in a solution for every vector, in one of several where it is no P-matrix."""
    rng = np.random.default_rng(3)
    several = 0
    for _ in range(60):
        n = 5
        M = rng.integers(0, 4, (n, n)).astype(float)
        np.fill_diagonal(M, 1.0)
        q = rng.integers(-2, 2, n).astype(float)
        found = lemke(M, q)
        solves(found, M, q)
        several += len(all_solutions(M, q)) > 1
    assert several > 10


def test_any_matrix_ends_in_a_solution_or_on_a_ray() -> None:
    rng = np.random.default_rng(4)
    rays = 0
    for _ in range(300):
        n = int(rng.integers(1, 7))
        M, q = rng.integers(-2, 3, (n, n)).astype(float), rng.integers(-2, 3, n).astype(float)
        found = lemke(M, q)
        if found.z is None:
            rays += 1
            assert found.ray
            assert found.pivots < 50 * n
        else:
            solves(found, M, q)
    assert 50 < rays < 250


def first_tied_row(M: Matrix, q: Matrix) -> str:
    """Lemke's method in double precision where the first of tied rows leaves, the artificial variable before others: how it ends."""
    n = len(q)
    tableau = np.hstack([np.eye(n), -M, -np.ones((n, 1)), q[:, None]])
    basis, entering, row = list(range(n)), 2 * n, int(np.argmin(q))
    seen: set[tuple[int, ...]] = set()
    while True:
        tableau[row] /= tableau[row, entering]
        for k in set(range(n)) - {row}:
            tableau[k] -= tableau[k, entering] * tableau[row]
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            return "solution"
        if tuple(basis) in seen:
            return "cycle"
        seen.add(tuple(basis))
        entering = leaving + n if leaving < n else leaving - n
        positive = np.flatnonzero(tableau[:, entering] > 1e-12)
        if not positive.size:
            return "ray"
        ratios = tableau[positive, -1] / tableau[positive, entering]
        tied = positive[ratios <= ratios.min() + 1e-12]
        row = next((int(k) for k in tied if basis[k] == 2 * n), int(tied[0]))


@pytest.mark.parametrize(("M", "q"), CYCLES)
def test_the_lexicographic_rule_does_not_cycle(M: Matrix, q: Matrix) -> None:
    assert first_tied_row(M, q) == "cycle"
    solves(lemke(M, q), M, q)


@pytest.mark.parametrize("copies", [1, 2, 3])
@pytest.mark.parametrize("M", [KOSTREVA, KOSTREVA.T])
def test_a_cyclic_matrix_with_all_ratios_tied(M: Matrix, copies: int) -> None:
    several: Matrix = np.kron(np.eye(copies), M)
    q = -np.ones(3 * copies)
    found = lemke(several, q)
    solves(found, several, q)
    np.testing.assert_allclose(np.array(found.z, float), 1 / 3, atol=1e-15)


def test_many_degenerate_problems_end_on_both_sides_of_a_tie() -> None:
    """Vectors of -1 and 0 only: where the first tied row cycles, the lexicographic rule ends, and soon."""
    rng = np.random.default_rng(0)
    cycles = 0
    for _ in range(3000):
        n = int(rng.integers(3, 6))
        M, q = rng.integers(-2, 3, (n, n)).astype(float), rng.integers(-1, 1, n).astype(float)
        if q.min() == 0.0 or first_tied_row(M, q) != "cycle":
            continue
        cycles += 1
        found = lemke(M, q)
        assert found.pivots <= 2**n
        if found.z is None:
            assert found.ray
        else:
            solves(found, M, q)
    assert cycles > 20


def test_no_pivot_where_nothing_is_negative() -> None:
    q = np.array([0.0, 2.0])
    found = lemke(np.full((2, 2), np.nan), q)
    assert found.pivots == 0
    assert np.array_equal(np.array(found.w), q)
    assert np.array_equal(np.array(found.z), [0.0, 0.0])


def test_what_is_negative_by_little_is_negative() -> None:
    found = lemke(np.array([[2.0, 0.0], [0.0, 1.0]]), np.array([-1e-9, 1.0]))
    np.testing.assert_allclose(np.array(found.z, float), [5e-10, 0.0], rtol=1e-9)


def test_a_ray_names_the_pairs_that_grow() -> None:
    """w1 = -1 + z2, w2 = -1 - z1 (and w3 = z3 beside them): the second has no solution, whatever the first two do."""
    M = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    found = lemke(M, np.array([-1.0, -1.0, 0.5]))
    assert found.z is None
    assert found.w is None
    assert 1 in found.ray
    assert not feasible(M, np.array([-1.0, -1.0, 0.5]))


@pytest.mark.parametrize("seed", range(5))
def test_scale_of_rows_and_columns_does_not_matter(seed: int) -> None:
    """D1 M D2 with q = D1 q has w = D1 w and z = z/D2; powers of two are exact. Seven orders of magnitude."""
    rng = np.random.default_rng(seed)
    n = 6
    root = rng.normal(size=(n, n))
    M, q = root @ root.T + 0.1 * np.eye(n), rng.normal(size=n)
    left, right = 2.0 ** rng.integers(-4, 5, n), 2.0 ** rng.integers(-12, 13, n)
    plain, scaled = lemke(M, q), lemke(left[:, None] * M * right, left * q)
    solves(scaled, left[:, None] * M * right, left * q)
    np.testing.assert_allclose(np.array(scaled.z) * right, np.array(plain.z), rtol=1e-9, atol=1e-14)
    assert np.array_equal(np.array(scaled.z) > 0, np.array(plain.z) > 0)


@pytest.mark.parametrize("eps", [1e-6, 1e-8, 1e-10, 1e-11])
def test_a_tiny_compliance_decides_what_the_rest_leaves_open(eps: float) -> None:
    """Unit entries with eps on the diagonal: a push of n is shared alike, z_i = n/(n + eps), to extended round-off over eps."""
    n = 5
    M, q = np.ones((n, n)) + eps * np.eye(n), np.full(n, -float(n))
    found = lemke(M, q)
    solves(found, M, q)
    digits = np.finfo(np.longdouble).eps
    np.testing.assert_allclose(np.array(found.z, float), n / (n + eps), rtol=max(1e-15, 50 * float(digits) / eps))


@pytest.mark.parametrize("limit", [0.2, 0.9])
def test_shares_with_limits_do_not_depend_on_the_order(limit: float) -> None:
    """Three torques hold 3; one is limited to less than its share, the others take the rest. Any order of the pairs."""
    eps, rng = 1e-8, np.random.default_rng(1)
    M, q = np.zeros((6, 6)), np.concatenate([np.full(3, -3.0), [limit, 10.0, 10.0]])
    M[:3, :3] = np.ones((3, 3)) + eps * np.eye(3)
    M[:3, 3:], M[3:, :3] = np.eye(3), -np.eye(3)
    expected = np.array([limit, (3 - limit) / 2, (3 - limit) / 2])
    for _ in range(20):
        order = rng.permutation(6)
        found = lemke(M[np.ix_(order, order)], q[order])
        solves(found, M[np.ix_(order, order)], q[order])
        assert found.z is not None
        z = np.array(found.z, float)[np.argsort(order)]
        np.testing.assert_allclose(z[:3], expected, atol=1e-7)


def test_round_off_that_leads_in_a_circle_is_no_ray(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that is cut short says so: no solution, and no ray that would prove anything."""
    monkeypatch.setattr(module, "_MOST", 0)
    found = lemke(KOSTREVA, -np.ones(3))
    assert found.z is None
    assert found.ray == ()


@pytest.mark.parametrize("M", [[[2.0, 1], [1, 0]], [[2.0, 0], [1, -1]]])
def test_the_artificial_variable_leaves_where_it_may(M: list[list[float]]) -> None:
    """z = (1, 0) makes both rows zero at once; whoever goes on from there ends on a ray."""
    found = lemke(np.array(M), np.array([-2.0, -1.0]))
    solves(found, np.array(M), np.array([-2.0, -1.0]))
    np.testing.assert_allclose(np.array(found.z, float), [1.0, 0.0], atol=1e-15)


def test_small_pivots_are_avoided_where_rows_are_tied() -> None:
    """Nonnegative with unit diagonal, entries of 1, 1e-6 and 1e-11, vectors of -1 and 0: solved to 1e-10."""
    rng = np.random.default_rng(0)
    for _ in range(1100):
        n = int(rng.integers(3, 7))
        M = rng.integers(0, 3, (n, n)) * 10.0 ** rng.choice([0, 0, -11, -6], (n, n))
        np.fill_diagonal(M, 1.0)
        q = rng.integers(-1, 1, n).astype(float)
        found = lemke(M, q)
        assert found.z is not None
        assert found.w is not None
        z = np.array(found.z, float)
        np.testing.assert_allclose(np.array(found.w, float), q + M @ z, atol=1e-10 * (1.0 + z.max()))


@pytest.mark.parametrize("noise", [1e-16, 1e-15, 1e-14])
def test_rows_tied_but_for_round_off_do_not_cycle(noise: float) -> None:
    """The same problems with other vectors, of -1 and 0 but for round-off: each has a solution, and soon."""
    rng = np.random.default_rng(7)
    for _ in range(800):
        n = int(rng.integers(3, 7))
        M = rng.integers(0, 3, (n, n)) * 10.0 ** rng.choice([0, 0, -11, -6], (n, n))
        np.fill_diagonal(M, 1.0)
        q = rng.integers(-1, 1, n) + noise * rng.uniform(-1.0, 1.0, n)
        found = lemke(M, q)
        assert found.pivots <= 2**n
        assert found.z is not None
        assert found.w is not None
        z = np.array(found.z, float)
        np.testing.assert_allclose(np.array(found.w, float), q + M @ z, atol=1e-7 * (1.0 + z.max()))


@pytest.mark.skipif(bool(np.finfo(np.longdouble).eps > 1e-18), reason="no extended precision on this machine")
def test_extended_precision_is_kept() -> None:
    """r r' + eps diag(r^2) with any r: z_i = k/r_i with k = c/(n + eps), to 1e-19/eps, where double precision gives 1e-16/eps."""
    rng = np.random.default_rng(5)
    n, eps, c = 5, 1e-10, np.longdouble(2)
    r = rng.uniform(0.5, 2.0, n).astype(np.longdouble)
    M: Matrix = np.outer(r, r) + eps * np.diag(r**2)
    q: Matrix = -c * r
    found = lemke(M, q)
    assert found.z is not None
    np.testing.assert_allclose(np.array(found.z * r / (c / (n + eps)), float), 1.0, atol=3e-8)
