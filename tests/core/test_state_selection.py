"""Which derivatives become dummies: the least wanted basis of the constraints, against numpy's ranks."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from powertrain.compiler.state_selection import eliminate, involved

Matrix = np.ndarray[Any, Any]


def cheapest(matrix: Matrix, wish: list[int]) -> int:
    """The least sum of wishes of a basis of columns: greedy, which is exact for a matroid."""
    chosen: list[int] = []
    for j in sorted(range(matrix.shape[1]), key=lambda j: wish[j]):
        if np.linalg.matrix_rank(matrix[:, [*chosen, j]], tol=1e-9) > len(chosen):
            chosen.append(j)
    return sum(wish[j] for j in chosen)


def constraints(rng: np.random.Generator, rows: int, columns: int) -> Matrix:
    """Sparse rows of small whole numbers, as gears and planetaries have."""
    matrix = rng.integers(-3, 4, (rows, columns)) * (rng.random((rows, columns)) < 0.5)
    return matrix.astype(float)


def as_table(matrix: Matrix) -> list[dict[int, float]]:
    return [{int(j): float(row[j]) for j in np.flatnonzero(row)} for row in matrix]


@pytest.mark.parametrize("seed", range(30))
def test_the_least_wanted_variables_are_dummies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = constraints(rng, 5, 9)
    if seed % 3 == 0:
        matrix[4] = 2 * matrix[0] - matrix[2]
    wish = rng.integers(0, 4, 9).tolist()
    chosen, free = eliminate(as_table(matrix), [10 * w for w in wish])
    rank = np.linalg.matrix_rank(matrix)
    assert len(chosen) == len(set(chosen)) == rank
    assert len(free) == len(matrix) - rank
    rest = [i for i in range(len(matrix)) if i not in free]
    assert np.linalg.matrix_rank(matrix[np.ix_(rest, chosen)]) == rank
    assert sum(wish[j] for j in chosen) == cheapest(matrix, wish)


def test_a_small_entry_is_no_pivot_where_a_large_one_is_as_little_wanted() -> None:
    """A twentieth of the row's largest is the least."""
    assert eliminate([{0: 0.04, 1: 1.0}, {1: 1.0, 2: 1.0}, {1: 1.0, 2: -1.0}], [0, 0, 0])[0][0] == 1
    assert eliminate([{0: 0.06, 1: 1.0}, {1: 1.0, 2: 1.0, 3: 1.0}, {1: 1.0, 2: -1.0, 3: 2.0}], [0, 0, 0, 0])[0][0] == 0


def test_the_least_wanted_is_taken_however_small_its_entry() -> None:
    """What is wanted more is not looked at before."""
    assert eliminate([{0: 1e-3, 1: 1.0}], [0, 10]) == ([0], [])
    assert eliminate([{0: 1e-3, 1: 1.0}], [10, 0]) == ([1], [])


def test_round_off_does_not_make_a_repeated_row_regular() -> None:
    third = 1.0 / 3.0
    table = [{0: third, 1: 0.1, 2: 0.7}, {0: 1.0, 1: 0.3, 2: 2.1}]
    chosen, free = eliminate(table, [0, 0, 0])
    assert len(chosen) == 1
    assert len(free) == 1


def test_all_rows_that_make_up_a_repeated_one_are_named() -> None:
    matrix = ca.DM([[1, 2, 0, 0], [0, 1, 1, 0], [0, 0, 1, 5], [1, 3, 1, 0]])
    assert involved(matrix, [3]) == [0, 1, 3]
