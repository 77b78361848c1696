"""Matchings and strongly connected components against scipy, on random graphs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

from powertrain.compiler.matching import Matching, components


@pytest.mark.parametrize("seed", range(20))
def test_as_many_pairs_as_possible_and_the_reason_where_one_is_missing(seed: int) -> None:
    """A failed search has reached more equations than variables, and all variables of these equations (Hall)."""
    rng = np.random.default_rng(seed)
    n, v = 12, 11 + seed % 3
    matrix = rng.random((n, v)) < 0.16
    adjacent = [np.flatnonzero(row).tolist() for row in matrix]
    matching = Matching(lambda e: adjacent[e])
    found = 0
    for e in range(n):
        if matching.augment(e):
            found += 1
            continue
        assert len(matching.seen_equations) == len(matching.seen_variables) + 1
        assert {k for s in matching.seen_equations for k in adjacent[s]} == matching.seen_variables
    assert found == (maximum_bipartite_matching(csr_matrix(matrix)) >= 0).sum()
    assert len(matching.variable_of) == len(matching.equation_of) == found
    for e, k in matching.variable_of.items():
        assert matrix[e, k]
        assert matching.equation_of[k] == e


def test_a_released_variable_can_be_matched_again() -> None:
    matching = Matching(lambda e: [[0, 1], [0]][e])
    assert matching.augment(0)
    assert matching.augment(1)
    assert matching.variable_of == {0: 1, 1: 0}
    assert matching.release(0) == 1
    assert matching.release(0) is None
    assert matching.variable_of == {0: 1}
    assert matching.augment(1)
    assert matching.variable_of == {0: 1, 1: 0}


def test_the_best_candidate_is_taken_where_it_is_free() -> None:
    matching = Matching(lambda e: [[2, 0, 1], [2, 1]][e])
    assert matching.augment(0)
    assert matching.variable_of == {0: 2}
    assert matching.augment(1)
    assert matching.variable_of == {0: 2, 1: 1}


@pytest.mark.parametrize("seed", range(20))
def test_components_are_strongly_connected_and_in_order(seed: int) -> None:
    """Each after all that it points to."""
    rng = np.random.default_rng(seed)
    n = 25
    matrix = rng.random((n, n)) < 1.3 / n
    successors = [np.flatnonzero(row).tolist() for row in matrix]
    found = components(successors)
    count, labels = connected_components(csr_matrix(matrix.astype(float)), directed=True, connection="strong")
    assert len(found) == count
    assert sorted(k for members in found for k in members) == list(range(n))
    place = np.zeros(n, int)
    for i, members in enumerate(found):
        place[members] = i
        assert len({int(labels[k]) for k in members}) == 1
    assert all(place[k] <= place[node] for node in range(n) for k in successors[node])


def test_a_long_chain_and_a_long_ring_need_no_recursion() -> None:
    n = 20_000
    chain = components([[k + 1] if k + 1 < n else [] for k in range(n)])
    assert [members[0] for members in chain] == list(range(n - 1, -1, -1))
    assert len(components([[(k + 1) % n] for k in range(n)])) == 1
