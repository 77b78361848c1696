"""Symbolic elimination of sparse blocks against numpy, at the values the pivots were chosen for and at others."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.numerics.sparse_lu import Factors, SingularBlock, eliminate, solve

Matrix = np.ndarray[Any, Any]


def sparse(rng: np.random.Generator, n: int, density: float) -> Matrix:
    """Regular for sure: entries on a permuted diagonal of the size of one, others up to it."""
    matrix = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    matrix[np.arange(n), rng.permutation(n)] += np.sign(rng.normal(size=n)) * (1.0 + np.abs(matrix).sum(axis=1))
    return matrix


def table(matrix: Matrix) -> tuple[ca.SX, list[dict[int, ca.SX]], list[dict[int, float]]]:
    """Symbols for the entries, the rows of symbols and of numbers."""
    places = np.argwhere(matrix != 0.0)
    names = ca.SX.sym("a", len(places))
    rows: list[dict[int, ca.SX]] = [{} for _ in matrix]
    numbers: list[dict[int, float]] = [{} for _ in matrix]
    for k, (i, j) in enumerate(places):
        rows[i][int(j)], numbers[i][int(j)] = names[k], float(matrix[i, j])
    return names, rows, numbers


def evaluated(names: ca.SX, solution: dict[int, ca.SX], right: ca.SX, entries: Matrix, b: Matrix) -> Matrix:
    column = ca.vertcat(*(solution[j] for j in range(len(b))))
    found = ca.Function("f", [names, right], [column])(entries, b)
    return np.array(found).ravel()


@pytest.mark.parametrize("n", [1, 2, 5, 12, 30])
def test_random_sparse_systems(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(6):
        matrix, b = sparse(rng, n, 2.5 / n), rng.normal(size=n)
        names, rows, numbers = table(matrix)
        right = ca.SX.sym("b", n)
        solution = solve(rows, ca.vertsplit(right), numbers)
        entries = matrix[matrix != 0.0]
        np.testing.assert_allclose(
            evaluated(names, solution, right, entries, b), np.linalg.solve(matrix, b), rtol=1e-9, atol=1e-11
        )
        other = matrix * rng.uniform(0.8, 1.2, matrix.shape)
        np.testing.assert_allclose(
            evaluated(names, solution, right, other[matrix != 0.0], b), np.linalg.solve(other, b), rtol=1e-8, atol=1e-10
        )


def test_rows_are_not_changed_and_factors_serve_many_right_sides() -> None:
    rng = np.random.default_rng(40)
    matrix = sparse(rng, 8, 0.4)
    names, rows, numbers = table(matrix)
    before = [dict(row) for row in rows], [dict(row) for row in numbers]
    factors: Factors = eliminate(rows, numbers)
    for _ in range(3):
        b = rng.normal(size=8)
        solution = factors.solve([ca.SX(float(v)) for v in b])
        found = evaluated(names, solution, ca.SX.sym("b", 8), matrix[matrix != 0.0], b)
        np.testing.assert_allclose(found, np.linalg.solve(matrix, b), rtol=1e-9)
    assert [set(row) for row in rows] == [set(row) for row in before[0]]
    assert numbers == before[1]


@pytest.mark.parametrize("tiny", [1e-14, 1e-9, 1e-3])
def test_small_entries_are_no_pivots(tiny: float) -> None:
    """Those of a short column, which sparsity would take: the error stays that of the condition number."""
    rng = np.random.default_rng(41)
    for _ in range(10):
        n = 8
        matrix = sparse(rng, n, 0.5)
        matrix[0, :] = [tiny, *rng.uniform(1, 2, n - 1)]
        matrix[1:, 0] = 0.0
        matrix[n - 1, 0] = 1.0
        if np.linalg.cond(matrix) > 1e4:
            continue
        b = rng.normal(size=n)
        names, rows, numbers = table(matrix)
        solution = solve(rows, [ca.SX(float(v)) for v in b], numbers)
        found = evaluated(names, solution, ca.SX.sym("b", n), matrix[matrix != 0.0], b)
        np.testing.assert_allclose(found, np.linalg.solve(matrix, b), rtol=1e-9, atol=1e-9)


def test_the_pivot_is_the_entry_of_the_shortest_column_that_is_large_enough() -> None:
    """Of 5 and 0.1 in a row, 0.1 is a fiftieth and stands in the shorter column; 0.04 would be too small."""
    matrix = np.array([[5.0, 0.1, 0.0], [1.0, 1.0, 2.0], [3.0, 0.0, 1.0]])
    _, rows, numbers = table(matrix)
    assert (0, 1) in eliminate(rows, numbers).order
    matrix[0, 1] = 0.04
    _, rows, numbers = table(matrix)
    assert (0, 1) not in eliminate(rows, numbers).order


def test_short_rows_come_first() -> None:
    """A triangular system in any order is solved without an operation on the table."""
    rng = np.random.default_rng(42)
    matrix = np.tril(rng.uniform(1, 2, (7, 7)))[rng.permutation(7)][:, rng.permutation(7)]
    names, rows, numbers = table(matrix)
    factors = eliminate(rows, numbers)
    assert [set(t) for t in factors.table] != []
    assert all(len(factors.table[i]) == 1 for i, _ in factors.order)
    b = rng.normal(size=7)
    found = evaluated(names, factors.solve([ca.SX(float(v)) for v in b]), ca.SX.sym("b", 7), matrix[matrix != 0.0], b)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, b), rtol=1e-10)


def test_what_cancels_in_the_numbers_is_no_pivot() -> None:
    """1 + 1e-13 - 1 is round-off of the elimination: the system is singular, and says by which row."""
    matrix = np.array([[1.0, 2.0, 0.0], [3.0, 6.0 * (1 + 1e-13), 0.0], [0.0, 1.0, 1.0]])
    _, rows, numbers = table(matrix)
    with pytest.raises(SingularBlock) as caught:
        eliminate(rows, numbers)
    assert set(caught.value.rows) <= {0, 1}
    one = ca.SX(1)
    with pytest.raises(SingularBlock):
        eliminate([{0: one, 1: one}, {0: one, 1: one}], [{0: 1.0, 1: 1.0}, {0: 1.0, 1: 1.0}])


def test_entries_that_cancel_symbolically_leave_the_table() -> None:
    a, one = ca.SX.sym("a"), ca.SX(1)
    rows = [{0: one, 1: a, 2: one}, {0: one, 1: a, 2: -one}, {1: one, 2: a}]
    numbers = [{0: 1.0, 1: 0.5, 2: 1.0}, {0: 1.0, 1: 0.5, 2: -1.0}, {1: 1.0, 2: 0.5}]
    factors = eliminate(rows, numbers)
    matrix = np.array([[1, 0.5, 1], [1, 0.5, -1], [0, 1, 0.5]])
    b = np.array([1.0, -2.0, 3.0])
    found = evaluated(a, factors.solve([ca.SX(float(v)) for v in b]), ca.SX.sym("b", 3), np.array([0.5]), b)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, b), rtol=1e-12)


def test_an_entry_that_may_vanish_is_a_pivot_only_where_there_is_no_other() -> None:
    """Each entry beside the dominant one in turn: later it is zero, and the solution is still right."""
    rng = np.random.default_rng(43)
    for _ in range(12):
        n = 6
        matrix = sparse(rng, n, 0.4)
        names, rows, numbers = table(matrix)
        b = rng.normal(size=n)
        for i, j in np.argwhere((matrix != 0.0) & (np.abs(matrix) < np.abs(matrix).max(axis=1)[:, None])):
            varying = [{int(j)} if k == i else set[int]() for k in range(n)]
            solution = solve(rows, [ca.SX(float(v)) for v in b], numbers, varying)
            later = matrix.copy()
            later[i, j] = 0.0
            found = evaluated(names, solution, ca.SX.sym("b", n), later[matrix != 0.0], b)
            np.testing.assert_allclose(found, np.linalg.solve(later, b), rtol=1e-8, atol=1e-10)


def test_a_firm_entry_is_the_pivot_although_its_column_is_longer() -> None:
    matrix = np.array([[0.7, 0.3, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, -1.0]])
    _, rows, numbers = table(matrix)
    assert (0, 0) in eliminate(rows, numbers).order
    matrix = np.array([[0.7, 0.3, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, -1.0]])
    _, rows, numbers = table(matrix)
    assert (0, 0) in eliminate(rows, numbers).order
    assert (0, 1) in eliminate(rows, numbers, [{0}, set(), set()]).order


def test_a_row_of_varying_entries_comes_last() -> None:
    """v x + y = 1, x + y + z = 2, z = 1 with v = 0 later: v is not the pivot although its row is short."""
    matrix = np.array([[0.7, 0.0, 0.3], [1.0, 1.0, 1.0], [0.0, 0.9, 1.0]])
    _, rows, numbers = table(matrix)
    factors = eliminate(rows, numbers, [{0, 2}, set(), set()])
    assert factors.order[-1][0] == 0


def test_the_order_follows_the_fill() -> None:
    """A grid of 6 x 6: rows that have grown wait, so that the eliminated table has hardly more entries than the grid."""
    k = 6
    grid = 5.0 * np.eye(k * k)
    for i in range(k * k):
        for j in (i + 1, i + k):
            if j < k * k and (j != i + 1 or j % k):
                grid[i, j] = grid[j, i] = -1.0
    _, rows, numbers = table(grid)
    assert sum(map(len, eliminate(rows, numbers).table)) < 1.2 * np.count_nonzero(grid)


def test_entries_that_vanish_on_the_way() -> None:
    """Of numbers -1, 0 and 1 many differences are zero: the rows must forget these entries, and who holds a column."""
    rng, regular = np.random.default_rng(7), 0
    for _ in range(300):
        n = int(rng.integers(3, 8))
        matrix = rng.choice([-1.0, 0.0, 0.0, 1.0], (n, n))
        rows = [{j: ca.SX(float(row[j])) for j in range(n) if row[j]} for row in matrix]
        numbers = [{j: float(row[j]) for j in range(n) if row[j]} for row in matrix]
        if abs(np.linalg.det(matrix)) < 0.5:
            with pytest.raises(SingularBlock):
                eliminate(rows, numbers)
            continue
        regular += 1
        b = rng.normal(size=n)
        found = solve(rows, [ca.SX(float(v)) for v in b], numbers)
        np.testing.assert_allclose(
            [float(found[j]) for j in range(n)], np.linalg.solve(matrix, b), rtol=1e-9, atol=1e-12
        )
    assert regular > 50


@pytest.mark.parametrize("varying", [(0, 1), (1, 0)])
def test_what_a_varying_entry_reaches_varies_too(varying: tuple[int, int]) -> None:
    """x + v y, v x + y: eliminating x leaves 1 - v in the second row, zero later: z is its pivot."""
    matrix = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 0.5]])
    matrix[varying] = 0.7
    names, rows, numbers = table(matrix)
    rough = [{varying[1]} if i == varying[0] else set[int]() for i in range(3)]
    b = np.array([1.0, -2.0, 3.0])
    solution = solve(rows, [ca.SX(float(v)) for v in b], numbers, rough)
    later = matrix.copy()
    later[varying] = 1.0
    found = evaluated(names, solution, ca.SX.sym("b", 3), later[matrix != 0.0], b)
    np.testing.assert_allclose(found, np.linalg.solve(later, b), rtol=1e-12)
