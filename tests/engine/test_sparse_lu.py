"""The symbolic sparse factorisation and the choice of its pivot rows, against numpy and brute force."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.numerics.pivots import difference, match_rows
from powertrain.numerics.sparse_lu import _factors, factorize

Matrix = np.ndarray[Any, Any]


def pattern(rng: np.random.Generator, n: int) -> tuple[Matrix, list[int]]:
    """A sparse matrix with large entries at (rows[j], j), and these rows."""
    matrix = rng.normal(size=(n, n)) * (rng.random((n, n)) < 2.0 / n)
    rows = rng.permutation(n)
    matrix[rows, np.arange(n)] = np.sign(rng.normal(size=n)) * (1.0 + np.abs(matrix).sum(axis=0))
    return matrix, rows.tolist()


def symbolic(kind: Any, matrix: Matrix) -> Any:
    return kind.sym("A", ca.sparsify(ca.DM(matrix)).sparsity())


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
@pytest.mark.parametrize("n", [1, 2, 6, 15])
def test_random_patterns(kind: Any, n: int) -> None:
    """With the pivots anywhere, at two sets of values, two right sides from one factorisation."""
    rng = np.random.default_rng(n)
    for _ in range(4):
        matrix, rows = pattern(rng, n)
        A, b = symbolic(kind, matrix), kind.sym("b", n)
        solved = factorize(A, rows)
        solve = ca.Function("f", [A, b], [solved(b), solved(2 * b)])
        for values in (matrix, matrix * rng.uniform(0.9, 1.1, matrix.shape)):
            right = rng.normal(size=n)
            one, two = (
                np.array(v).ravel() for v in solve(ca.DM(A.sparsity(), ca.sparsify(ca.DM(values)).nonzeros()), right)
            )
            np.testing.assert_allclose(one, np.linalg.solve(values, right), rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(two, 2 * one, rtol=1e-12)


def test_the_diagonal_is_the_default() -> None:
    matrix = np.array([[4.0, 1, 0], [1, 3, 1], [0, 2, 5]])
    found = factorize(ca.sparsify(ca.SX(ca.DM(matrix))))(ca.SX([1.0, 2, 3]))
    np.testing.assert_allclose(np.array(ca.DM(found)).ravel(), np.linalg.solve(matrix, [1.0, 2, 3]), rtol=1e-14)


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_a_pivot_that_is_not_there(kind: Any) -> None:
    """As where a mode that is known takes it away: other pivots might vanish later."""
    matrix = symbolic(kind, np.array([[1.0, 2, 0], [3, 0, 4], [0, 5, 6]]))
    factorize(matrix, [0, 2, 1])
    for rows in ([0, 1, 2], [2, 0, 1]):
        with pytest.raises(KeyError):
            factorize(matrix, rows)


def numbers(matrix: Matrix) -> int:
    """How many a solution needs, with the diagonal as pivots: the entries and their fill."""
    return len(_factors(symbolic(ca.SX, matrix), range(len(matrix))).values())


def test_an_arrow_is_eliminated_without_fill() -> None:
    """The hub comes last, wherever it stands; a chain fills nothing either."""
    n = 12
    for hub in (0, 5, 11):
        arrow = np.eye(n)
        arrow[hub, :] = arrow[:, hub] = 1.0
        assert numbers(arrow) == np.count_nonzero(arrow)
        assert hub in [i for i, _ in _factors(symbolic(ca.SX, arrow), range(n)).order[-2:]]
    turned = np.random.default_rng(1).permutation(n)
    chain = (np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1))[np.ix_(turned, turned)]
    assert numbers(chain) == np.count_nonzero(chain)


def test_the_order_follows_the_fill() -> None:
    """A grid: short rows first, with what was filled, need less than 0.7 of the fill of the natural order."""
    k = 5
    n = k * k
    grid = np.eye(n)
    for i in range(n):
        for j in (i + 1 if (i + 1) % k else i, i + k if i + k < n else i):
            grid[i, j] = grid[j, i] = 1.0
    natural = grid != 0.0
    for i in range(n):
        natural[i + 1 :, i + 1 :] |= np.outer(natural[i + 1 :, i], natural[i, i + 1 :])
    entries = np.count_nonzero(grid)
    assert numbers(grid) - entries < 0.7 * (np.count_nonzero(natural) - entries)


@pytest.mark.parametrize("seed", range(8))
def test_pivots_have_the_largest_product(seed: int) -> None:
    """Relative to the largest entry of their rows, as brute force over all permutations finds."""
    rng = np.random.default_rng(seed)
    n = 5
    matrix = rng.normal(size=(n, n)) ** 3
    matrix *= 10.0 ** rng.uniform(-6, 6, n)[:, None]
    sparsity = ca.sparsify(ca.DM(matrix)).sparsity()
    relative = np.abs(matrix) / np.abs(matrix).max(axis=1)[:, None]
    best = max(np.prod([relative[rows[j], j] for j in range(n)]) for rows in permutations(range(n)))
    found = match_rows(sparsity, matrix)
    assert sorted(found) == list(range(n))
    assert np.prod([relative[found[j], j] for j in range(n)]) == pytest.approx(best, rel=1e-9)


def test_entries_that_vanish_at_the_point_are_pivots_only_where_nothing_else_fits() -> None:
    full = ca.Sparsity.dense(2, 2)
    assert match_rows(full, np.array([[0.0, 1.0], [1e-3, 1.0]])) == [1, 0]
    assert match_rows(full, np.array([[1.0, 0.0], [np.nan, 1.0]])) == [0, 1]
    small = np.array([[1.0, 1e-160, 0], [1e-160, 0, 1], [0, 0, 1]])  # 1e-320 in all, but nothing vanishes
    assert match_rows(ca.Sparsity.dense(3, 3), small) == [1, 0, 2]
    lower = ca.Sparsity.lower(2)
    assert match_rows(lower, np.array([[0.0, 0.0], [1.0, 1.0]])) == [0, 1]
    with pytest.raises(ValueError, match=r"structurally singular: no equation is left for the unknowns \[1\]"):
        match_rows(ca.Sparsity(2, 2, [0, 2, 2], [0, 1]), np.array([[1.0, 0.0], [2.0, 0.0]]))
    assert match_rows(ca.Sparsity(0, 0), np.zeros((0, 0))) == []


@pytest.mark.parametrize("size", [1e-30, 1.0, 1e30])
def test_what_is_round_off_does_not_depend_on_units(size: float) -> None:
    """0.1 three times less 0.3 is nothing, a billionth of a number is something."""
    assert difference(3 * 0.1 * size, 0.3 * size) == 0.0
    assert difference((1 + 1e-9) * size, size) == pytest.approx(1e-9 * size, rel=1e-6)
    assert difference(0.0, size) == -size
